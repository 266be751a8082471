# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash itself, in NumPy, torch and numba; knows nothing of Blender.

Rooms, in the order in which a sketch becomes a splash; each imports only from those above it::

    settings, grid, scale, progress   parameters; metres to cells; a drawing's units and seconds to
                 the liquid's; how work reports and is cancelled
    numeric      compiled arithmetic on arrays and cells
    fluid        the liquid's physics on sparse cells
    sketch       strokes with a velocity at every point, their local frame  (paper, 4.1, 4.2.3)
    condition    strokes and the patches between them on a grid             (paper, 4.1)
    liquid       liquid as fields and as a level set, and how it is shaped
    generator    condition + latent -> occupancy, distance, velocity        (paper, 4.3)
    mesh         the surface at phi_air = 0.5, and triangle meshes
    obstacles    meshes that liquid keeps out of
    refinement   droplets, ruptures, capillary waves                        (paper, 5)
    composition  several splashes as one liquid
    animation    what solvers and exporters start from
    simulation   splashes that move on, frame by frame
    playback     simulated frames as files that Blender plays
    mantaflow    the splash as a frame of Mantaflow's cache, and what it made of it
    pipeline     all of it: ``make_splash(strokes, settings, generator)``

Conventions
-----------
SI units: metres, seconds, m/s; z is up. A field is a float32 array ``(C, X, Y, Z)`` indexed
x, y, z; a batch is ``(B, C, X, Y, Z)``. Cell ``(i, j, k)`` of a :class:`~.grid.Grid` has its
centre at ``origin + (index + 0.5) * spacing``. Signed distances are negative in the liquid.
"paper" is Yan, Chen, Yang, Wang: Interactive Liquid Splash Modeling by User Sketches,
ACM Transactions on Graphics 39(6), 2020.
"""
