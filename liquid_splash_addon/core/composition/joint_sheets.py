# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of the surface that the splashes of a model share: one rim where they meet, not two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..mesh.mesh import Mesh
from ..obstacles.obstacles import Obstacle, free_share, outside_obstacles
from ..refinement.drop_meshes import DropCloud
from ..refinement.shader_attributes import Attributes, shader_attributes
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

        return prepare_sheets(metres, cell, self.placed_strokes, free if self.obstacles else None)

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

    def attributes(
        self, mesh: Mesh, half: np.ndarray | None, colours: np.ndarray | None
    ) -> Attributes:
        """Return what shaders know of a mesh in drawing units, see ``shader_attributes``."""
        scale, cell = self.finest.frame.scale, self.finest.liquid.grid.spacing
        points = scale.lengths_to_local(mesh.vertices).astype(np.float32)
        metres = replace(mesh, vertices=points)
        return shader_attributes(metres, cell, self.placed_strokes, half, colours)

    @property
    def placed_strokes(self) -> list[Stroke]:
        """All strokes in the metres of the finest part."""
        scale = self.finest.frame.scale
        return [
            Stroke(
                scale.lengths_to_local(frame.points_to_drawing(stroke.points)),
                scale.velocities_to_local(frame.vectors_to_drawing(stroke.velocities)),
            )
            for frame, strokes in self.strokes
            for stroke in strokes
        ]
