# SPDX-License-Identifier: GPL-3.0-or-later
"""Velocity made divergence-free: the solver's own pressure, at rest in time (paper, 6.3)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..fluid.cells import Cells, activate
from ..fluid.collision import Solid, open_share
from ..fluid.extrapolation import extrapolate, valid_faces
from ..fluid.pressure import Poisson, divergence, project
from ..liquid.level_set import LevelSet

LAYERS = 2
"""Layers of air cells around the liquid that get a velocity."""

MARGIN = LAYERS + 2
"""Cells around a grid, so that liquid may touch its sides."""

THICK = -1.5
"""Level (cells) below which liquid counts as thick: there the first pressure solve of any solver
removes the divergence, while a thin sheet is free to stretch across itself."""


class Faces:
    """Velocities on the faces of a grid's liquid cells and of the air next to them.

    Attributes
    ----------
    cells : the active cells; they lie MARGIN cells farther along each axis than in the grid
    velocity : float32 ``(cells, 3)``, on the lower face of each cell along each axis
    share : float32 ``(cells, 3)``, part of each of these faces that is not solid, 0..1
    """

    def __init__(self, level: np.ndarray, faces: np.ndarray, solid: Solid | None = None) -> None:
        """Take a grid's faces.

        level : ``(X, Y, Z)``, cells, negative in the liquid; faces : ``(3, X, Y, Z)``, velocity on
        the lower faces, in any unit; solid : in cells of the grid
        """
        wet = np.argwhere(level < 0) + MARGIN
        shape = tuple(int(n) + 2 * MARGIN for n in level.shape)
        self.cells: Cells = activate(
            (wet + 0.5).astype(np.float32), (shape[0], shape[1], shape[2]), LAYERS
        )
        places = self.cells.coordinates - MARGIN
        self.inside = ((places >= 0) & (places < level.shape)).all(axis=1)
        near = np.clip(places, 0, np.array(level.shape) - 1)
        self.velocity = np.ascontiguousarray(faces[:, *near.T].T, dtype=np.float32)
        self.share = np.ones_like(self.velocity)
        if solid is not None:
            self.share = open_share(places, solid)
        self.places = places

    @property
    def divergence(self) -> np.ndarray:
        """Outflow of each liquid cell, ``(liquid,)``, in the faces' unit per cell."""
        return divergence(self.velocity, self.cells, self.share)

    def projected(self) -> np.ndarray:
        """Return the velocity without divergence, ``(cells, 3)``, carried on into the air."""
        matrix = Poisson.assemble(self.cells, self.share)
        free = project(self.velocity, self.cells, self.share, matrix)
        extrapolate(free, valid_faces(self.cells, self.share), self.cells, LAYERS)
        return free


def project_faces(
    level: np.ndarray, faces: np.ndarray, solid: Solid | None = None
) -> tuple[np.ndarray, float]:
    """Return faces ``(3, X, Y, Z)`` that are divergence-free in the liquid, and what that removed.

    The surface is free: the pressure in the air is 0. Velocities in the air next to the liquid are
    carried there from its faces, those farther away stay. What was removed is the relative L2 norm
    of the change inside thick liquid, 0 to 1; where there is none, in all of it.

    level, faces, solid : see :class:`Faces`
    """
    if not (level < 0).any():
        return faces, 0.0
    flow = Faces(level, faces, solid)
    free = flow.projected()
    share = removed_share(flow, free, level)
    out = faces.astype(np.float32)
    out[:, *flow.places[flow.inside].T] = free[flow.inside].T
    return out, share


def removed_share(flow: Faces, free: np.ndarray, level: np.ndarray) -> float:
    """Return the relative L2 norm of the change from ``flow`` to ``free`` in thick liquid."""
    count = flow.cells.liquid
    depth = level[tuple(flow.places[:count].T)]
    chosen = depth < THICK if (depth < THICK).any() else np.ones(count, dtype=bool)
    before = flow.velocity[:count][chosen].astype(np.float64)
    change = free[:count][chosen] - before
    return min(float(np.sqrt((change**2).sum() / max((before**2).sum(), 1e-30))), 1.0)


def divergence_free(liquid: LevelSet, solid: Solid | None = None) -> LevelSet:
    """Return the liquid with a velocity of which the divergent part is removed.

    Only the change is brought from the faces to the cells' centres, so that nothing is smoothed.

    solid : in cells of the liquid's grid
    """
    if liquid.box is None:
        return liquid
    flow = Faces(liquid.level, lower_faces(liquid.velocity), solid)
    change = flow.projected() - flow.velocity
    change[flow.share <= 0] = 0
    # The faces of each cell's upper sides; in the outermost layer of air there are none: its own.
    own = np.arange(len(change))
    upper = np.where(flow.cells.neighbours[:, [1, 3, 5]] < 0, own[:, None],
                     flow.cells.neighbours[:, [1, 3, 5]])  # fmt: skip
    middle = (change + np.take_along_axis(change, upper, axis=0)) / 2
    velocity = liquid.velocity.copy()
    places = tuple(flow.places[flow.inside].T)
    known = np.abs(velocity[:, *places]).max(axis=0) > 0
    velocity[:, *places] += np.where(known, middle[flow.inside].T, 0)
    return replace(liquid, velocity=velocity)


def lower_faces(velocity: np.ndarray) -> np.ndarray:
    """Return the velocity at the lower faces of cells ``(3, X, Y, Z)`` from that at their centres.

    A cell whose velocity is unknown (zero) has no say.
    """
    known = (np.abs(velocity).max(axis=0) > 0).astype(np.float32)
    faces = np.empty_like(velocity, dtype=np.float32)
    for axis in range(3):
        before = (slice(None),) * axis + (slice(None, -1),)
        after = (slice(None),) * axis + (slice(1, None),)
        total, weight = velocity[axis].astype(np.float32), known.copy()
        total[after] += velocity[axis][before]
        weight[after] += known[before]
        faces[axis] = total / np.maximum(weight, 1)
    return faces
