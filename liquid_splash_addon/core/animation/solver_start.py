# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid of a splash or a model as solvers and exporters need it: on a grid, not as a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ..composition.drops import Drops, drops_to_local
from ..composition.placement import CompositionError
from ..composition.sparse_blocks import Blocks
from ..grid import Grid
from ..liquid.level_set import LevelSet
from ..obstacles.obstacles import Obstacle
from ..scale import Scale
from ..sketch.local_frame import Frame

if TYPE_CHECKING:
    from ..refinement.detail import Detail

MOST_BYTES = 4 << 30
"""Bytes that a model's liquid may take on one dense grid."""

CELL_BYTES = 16
"""Bytes of the level and velocity of one cell."""


@dataclass(frozen=True)
class SolverStart:
    """What a solver or an exporter starts from: the liquid of a splash or a model.

    All that changes the liquid is in it (breakup, droplets, ruptures, applied refinements, for a
    model its symmetry and blend), and obstacles are carved out. What only moves the finished mesh
    (waves) is not. Everything is in local metres, m/s and seconds of the liquid. ``frame`` and
    ``world`` turn that over to Blender's units and seconds of its timeline: slow motion is in
    their scales.

    Attributes
    ----------
    liquid : level (cells) and velocity (m/s) on a grid in local metres. ``liquid.distance`` is the
        signed distance; the level itself has the same zero, but is steeper or flatter
    drops : those that fly free and are not in ``liquid``, local metres and m/s
    obstacles : what the splash keeps out of, as it stands, local metres
    clearance : cells of air between them and the liquid
    frame : the local space in the space of the splash or model object
    world : the local space in the world; its axes are mirrored (determinant -1) for a mirrored
        object
    warnings : sentences for the user
    """

    liquid: LevelSet
    drops: Drops
    frame: Frame
    world: Frame
    obstacles: tuple[Obstacle, ...] = ()
    clearance: float = 0.0
    warnings: list[str] = field(default_factory=list)

    @property
    def cell(self) -> float:
        """Edge of a cell of the liquid in the world's units."""
        return self.world.scale.lengths_to_drawing(self.liquid.grid.spacing)

    @property
    def is_empty(self) -> bool:
        """Whether there is neither liquid nor a drop."""
        return self.liquid.box is None and not len(self.drops.radii)

    @classmethod
    def of_splash(
        cls,
        detail: Detail,
        frame: Frame,
        world: Frame,
        obstacles: Sequence[Obstacle] = (),
        clearance: float = 0.0,
    ) -> SolverStart:
        """Return the start of a splash.

        detail : of ``Refiner.liquid``; obstacles : local metres.
        """
        cloud = detail.cloud
        drops = Drops(cloud.positions, cloud.velocities, cloud.radii, cloud.meshed)
        warnings = [*detail.warnings, *(each.warning for each in obstacles if each.warning)]
        return cls(
            detail.liquid, drops, frame, world, tuple(obstacles), clearance, warnings,
        )  # fmt: skip

    @classmethod
    def of_model(
        cls,
        blocks: Blocks,
        drops: Drops,
        frame: Frame,
        world: Frame,
        obstacles: Sequence[Obstacle] = (),
        clearance: float = 0.0,
    ) -> SolverStart:
        """Return the start of a model.

        blocks, drops : of ``Composer.liquid``, drawing units and, as meshes are made, in real time;
        frame : its scale says how large and how slow the model is, its axes and centre are those
        of the drawing; obstacles : drawing units. Raises CompositionError if a dense grid would
        take more than MOST_BYTES.
        """
        warnings = [each.warning for each in obstacles if each.warning]
        return cls(
            dense(blocks, frame), drops_to_local(drops, in_real_time(frame)), frame, world,
            tuple(each.seen_from(frame) for each in obstacles), clearance, warnings,
        )  # fmt: skip


def in_real_time(frame: Frame) -> Frame:
    """Return a frame without its slow motion."""
    return replace(frame, scale=Scale(frame.scale.length))


def dense(blocks: Blocks, frame: Frame) -> LevelSet:
    """Return the liquid of a model on one grid, in local metres and m/s.

    frame : of the drawing's axes and centre. Raises CompositionError if that takes too much memory.
    """
    size = CELL_BYTES * float(np.prod([float(n) for n in blocks.grid.shape]))
    if size > MOST_BYTES:
        raise CompositionError(
            f"The model's liquid would need {size / 2**30:.1f} GB on one grid, more than the "
            f"{MOST_BYTES >> 30} GB allowed: move its splashes together, or use them one by one"
        )
    whole = blocks.whole()
    x, y, z = (float(value) for value in frame.points_to_local(np.array(whole.grid.origin)))
    grid = Grid(whole.grid.shape, frame.scale.lengths_to_local(whole.grid.spacing), (x, y, z))
    whole.velocity[:] *= np.float32(in_real_time(frame).scale.speed)
    return replace(whole, grid=grid)
