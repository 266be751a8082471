# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid's surface by marching cubes, with a velocity at every vertex."""

from __future__ import annotations

import numpy as np

from ..grid import Grid
from ..liquid.fields import Fields
from ..liquid.level_set import liquid_box, surface_level
from ..liquid.volume import filled_cells
from ..numeric.trilinear import sample_field
from .isosurface import isosurface
from .mesh import Mesh, edge_counts
from .taubin import taubin_smoothed

LEAST_DEPTH = 1e-3
"""Cells: of liquid that reaches no deeper below the surface, nothing is meshed."""

LEVEL_SPREAD = 0.5
"""Width in cells of the Gaussian that joins the generator's 2^3 patches before meshing."""

LEVEL_BAND = 1.5
"""The level is clipped to this many cells before that blur, so that sheets do not thin out."""


def surface(fields: Fields, threshold: float = 0.5) -> Mesh:
    """Return the surface of the liquid in local metres, by marching cubes (Lewiner).

    threshold : probability of liquid at the surface; 0.5 is the calibrated one. Fields are
    padded by a cell of air first, so that the mesh is closed where liquid meets the box. A
    splash with no liquid gives an empty mesh.
    """
    return level_surface(surface_level(fields, threshold), fields.velocity, fields.grid)


def level_surface(level: np.ndarray, velocity: np.ndarray, grid: Grid) -> Mesh:
    """Return the surface where ``level`` ``(X, Y, Z)`` is zero (``liquid.level_set``), in metres.

    It encloses as much liquid as there is below zero: within 5 % where sheets are a few cells
    thick, 15 % where they are one.

    velocity : ``(3, X, Y, Z)``, m/s.
    """
    from scipy.ndimage import gaussian_filter

    box = liquid_box(level)
    if box is None:
        return Mesh.empty()
    bounded = np.pad(np.clip(level[box], -LEVEL_BAND, LEVEL_BAND), 1, constant_values=LEVEL_BAND)
    padded = gaussian_filter(bounded, LEVEL_SPREAD, mode="nearest")
    padded[[0, -1]] = padded[:, [0, -1]] = padded[:, :, [0, -1]] = LEVEL_BAND
    iso = min(
        level_of_volume(bounded, padded), LEVEL_BAND - LEAST_DEPTH
    )  # else a full box has none
    if float(padded.min()) > iso - LEAST_DEPTH:
        return Mesh.empty()
    vertices, faces = marched(padded, iso)
    # Vertices are array indices: 0 is the centre of the padding's first cell.
    cells = taubin_smoothed(vertices, faces) - 0.5 + [side.start for side in box]
    velocities = sample_field(velocity, cells)
    points = grid.to_metres(cells).astype(np.float32)
    return Mesh(points, faces.astype(np.int32), velocities)


def marched(level: np.ndarray, iso: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices ``(n, 3)`` and faces ``(m, 3)`` of the surface at ``iso``, a manifold.

    In sheets thinner than a cell, marching cubes may make edges with four faces. There are fewer
    of them nearer to zero, so ``iso`` is halved until there are none; at zero, where such sheets
    are torn, the surface is taken as it is.
    """
    while True:
        vertices, faces = isosurface(level, iso)
        if edge_counts(faces, len(vertices)).data.max() == 1 or iso == 0 or level.min() >= 0:
            return vertices, faces
        iso = iso / 2 if abs(iso) > 0.05 else 0.0


def level_of_volume(level: np.ndarray, blurred: np.ndarray) -> float:
    """Return the isovalue at which ``blurred`` encloses as much as ``level`` does at zero.

    A blurred sheet or drop loses liquid to the air around it; at this value it keeps its volume.
    Both are in cells. A cell is full half a cell below the surface and empty half a cell above.
    """
    from scipy.optimize import brentq

    volume = filled_cells(level[level < 0.5])
    near = blurred[blurred < LEVEL_BAND]
    return float(
        brentq(lambda iso: filled_cells(near - iso) - volume, -LEVEL_BAND, LEVEL_BAND, xtol=1e-4)
    )
