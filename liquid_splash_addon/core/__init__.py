# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash itself, in NumPy, torch and numba; knows nothing of Blender.

The pipeline, one module a step::

    strokes    polylines with a velocity at every point            (paper, 4.1)
    alignment  the strokes' own frame, found by PCA                (paper, 4.2.3)
    voxels     strokes on a grid: occupancy and mean velocity      (paper, 4.1)
    generator  condition + latent -> occupancy, distance, velocity (paper, 4.3)
    meshing    the surface at phi_air = 0.5, with a velocity at every vertex
    pipeline   all of it: ``make_splash(strokes, settings, generator)``

Conventions
-----------
SI units: metres, seconds, m/s; z is up. A field is a float32 array ``(C, X, Y, Z)`` indexed
x, y, z; a batch is ``(B, C, X, Y, Z)``. Cell ``(i, j, k)`` of a :class:`~.grid.Grid` has its
centre at ``origin + (index + 0.5) * spacing``. Signed distances are negative in the liquid.
"paper" is Yan, Chen, Yang, Wang: Interactive Liquid Splash Modeling by User Sketches,
ACM Transactions on Graphics 39(6), 2020.
"""
