# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid as an OpenVDB file: the signed distance to its surface, and its velocity."""

from __future__ import annotations

from errno import ENOSPC
from pathlib import Path
from types import ModuleType

import numpy as np

from ..grid import Grid
from ..liquid.fields import AIR
from ..liquid.level_set import wider
from ..sketch.local_frame import Frame
from ..whole_file import whole_file
from .solver_start import SolverStart

SURFACE, VELOCITY = "surface", "velocity"
"""Names of the grids. "velocity" is what Cycles takes for the motion blur of volumes."""

MARGIN = 3
"""Cells around the liquid's box that are written: velocity is known there too."""


def write_vdb(openvdb: ModuleType, path: Path, start: SolverStart) -> None:
    """Write the liquid of ``start`` to ``path``, in the world's units and timeline seconds.

    ``surface`` is a level set, float, in world units, clipped at AIR cells. ``velocity`` has three
    components in world units per second, on cells within MARGIN cells of the liquid. Free drops are
    not in it. The file is there in whole or not at all.

    openvdb : OpenVDB's Python module. Raises ValueError where there is no liquid, OSError.
    """
    if start.liquid.box is None:
        raise ValueError("There is no liquid on the grid, only free drops: export those as points")
    box = wider(start.liquid.box, MARGIN)
    corner = tuple(side.start for side in box)
    transform = openvdb.createLinearTransform(index_to_world(start.liquid.grid, start.world))
    cell = np.float32(start.cell)
    distance = np.ascontiguousarray(start.liquid.distance[box])
    surface = openvdb.FloatGrid(float(AIR * cell))
    surface.copyFromArray(distance * cell, ijk=corner)
    surface.gridClass = openvdb.GridClass.LEVEL_SET
    surface.name = SURFACE
    velocity = openvdb.Vec3SGrid()
    local = np.moveaxis(start.liquid.velocity[(slice(None), *box)], 0, -1)
    local = np.where((distance < MARGIN)[..., None], local, np.float32(0))
    velocity.copyFromArray(
        np.ascontiguousarray(start.world.vectors_to_drawing(local), dtype=np.float32), ijk=corner
    )
    velocity.name = VELOCITY
    for grid in (surface, velocity):
        grid.transform = transform
    with whole_file(path) as unfinished:
        openvdb.write(str(unfinished), [surface, velocity])
        check_whole(openvdb, unfinished)


def check_whole(openvdb: ModuleType, path: Path) -> None:
    """Raise OSError where a file was not written to its end: OpenVDB does not say so."""
    try:
        grids, _ = openvdb.readAll(str(path))
    except Exception as error:  # openvdb has its own, and raises others too
        raise OSError(ENOSPC, "the disk may be full") from error
    if len(grids) != 2:
        raise OSError(ENOSPC, "the disk may be full")


def index_to_world(grid: Grid, world: Frame) -> np.ndarray:
    """Return the matrix ``(4, 4)`` from cells (centres at whole numbers) to the world.

    In OpenVDB's convention: points are rows, so the translation is the last row.
    """
    corners = np.vstack([np.zeros(3), np.eye(3)]) + 0.5
    points = world.points_to_drawing(grid.to_metres(corners))
    matrix = np.eye(4)
    matrix[:3, :3] = points[1:] - points[0]
    matrix[3, :3] = points[0]
    return matrix
