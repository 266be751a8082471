# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of the surface that the splashes of a model share: one rim where they meet, not two."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..mesh.mesh import Mesh
from ..obstacles.obstacles import Obstacle, free_share, outside_obstacles
from ..refinement.drop_meshes import DropCloud
from ..refinement.sheet_mesh import SheetMesh, prepare_sheets
from ..sketch.local_frame import Frame
from ..sketch.strokes import Stroke
from .drops import Drops
from .placement import Placed


@dataclass(frozen=True)
class JointSheets:
    """What decides about the sheets of a model besides its surface.

    Attributes
    ----------
    finest : the part in whose metres, but in the drawing's axes, sheets are made
    strokes : of all parts, copies included, in the metres of their frames
    obstacles, offset : in drawing units; cells of air around them
    """

    finest: Placed
    strokes: Sequence[tuple[Frame, Sequence[Stroke]]]
    obstacles: Sequence[Obstacle]
    offset: float

    def prepared(self, mesh: Mesh) -> SheetMesh:
        """Return a mesh in drawing units with its sheets found, in metres."""
        scale, cell = self.finest.frame.scale, self.finest.liquid.grid.spacing
        metres = replace(
            mesh,
            vertices=scale.lengths_to_local(mesh.vertices).astype(np.float32),
            velocities=scale.velocities_to_local(mesh.velocities).astype(np.float32),
        )

        def free(points: np.ndarray) -> np.ndarray:
            there = scale.lengths_to_drawing(points)
            return free_share(there, self.obstacles, self.finest.cell, self.offset)

        strokes = list(self._placed_strokes())
        return prepare_sheets(metres, cell, strokes, free if self.obstacles else None)

    def in_drawing(self, mesh: Mesh) -> Mesh:
        """Return a mesh in metres in drawing units."""
        scale = self.finest.frame.scale
        return replace(
            mesh,
            vertices=scale.lengths_to_drawing(mesh.vertices).astype(np.float32),
            velocities=scale.velocities_to_drawing(mesh.velocities).astype(np.float32),
        )

    def outside(self, cloud: DropCloud) -> DropCloud:
        """Return the drops (metres) whose centre is outside all obstacles."""
        places = self.finest.frame.scale.lengths_to_drawing(cloud.positions)
        cell = self.finest.cell
        return cloud.only(outside_obstacles(places, self.obstacles, cell, self.offset))

    def drops_in_drawing(self, cloud: DropCloud) -> Drops:
        """Return drops in metres in drawing units."""
        scale = self.finest.frame.scale
        return Drops(
            scale.lengths_to_drawing(cloud.positions).astype(np.float32),
            scale.velocities_to_drawing(cloud.velocities).astype(np.float32),
            scale.lengths_to_drawing(cloud.radii).astype(np.float32),
            cloud.meshed,
        )

    def _placed_strokes(self) -> Iterator[Stroke]:
        """Yield all strokes in the metres of the finest part."""
        scale = self.finest.frame.scale
        for frame, strokes in self.strokes:
            for stroke in strokes:
                yield Stroke(
                    scale.lengths_to_local(frame.points_to_drawing(stroke.points)),
                    scale.velocities_to_local(frame.vectors_to_drawing(stroke.velocities)),
                )
