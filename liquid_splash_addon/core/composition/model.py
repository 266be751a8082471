# SPDX-License-Identifier: GPL-3.0-or-later
"""Several splashes, their copies and obstacles, evaluated as one model whenever it changes."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..mesh.marching_cubes import level_surface
from ..mesh.mesh import Mesh
from ..obstacles.contact import push_out
from ..obstacles.obstacles import Obstacle, digest, outside_obstacles
from ..progress import Report, silent
from ..refinement.drop_meshes import DropCloud
from ..refinement.settings import RefinementSettings, SheetSettings, WaveSettings
from ..refinement.shader_attributes import Attributes, carried_room
from ..refinement.sheet_mesh import EDGE, SheetMesh
from ..refinement.sheets import Sheeted, add_sheets
from ..refinement.stack import Refiner
from ..refinement.waves import WaveMesh, prepare, propagate, wave_edge
from ..settings import ModelSettings
from ..sketch.local_frame import Frame
from ..sketch.strokes import Stroke
from .drops import Drops, drops_to_drawing, mesh_to_drawing
from .joint_sheets import JointSheets
from .placement import Placed, mirrored, radial
from .sparse_blocks import Blocks
from .union import MOST_MEMORY, compose

AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Part:
    """A splash of a model.

    Attributes
    ----------
    name : key of its liquid and drops, different for different ones, wherever they are placed
    placed : the liquid without its drops
    cloud : the drops that fly free of it, local metres
    strokes : what it was made of, local metres and m/s
    colours : float32 ``(strokes, 4)``, what they are to colour; None for none
    """

    name: Hashable
    placed: Placed
    cloud: DropCloud
    strokes: Sequence[Stroke] = ()
    colours: np.ndarray | None = None


def refined_part(
    name: Hashable, refiner: Refiner, steps: Sequence[RefinementSettings], frame: Frame
) -> Part:
    """Return a splash after ``steps``, but not sheets and waves: the joint surface has its own."""
    detail = refiner.liquid(steps)
    mesh = level_surface(detail.liquid.level, detail.liquid.velocity, detail.liquid.grid)
    return Part(name, Placed(detail.liquid, frame, mesh), detail.cloud, refiner.strokes)


@dataclass(frozen=True)
class Composed:
    """A finished model in drawing units.

    Attributes
    ----------
    mesh : the surface, free drops included
    drops : those that fly free
    warnings : sentences for the user
    attributes : of the mesh's vertices, at real size, where they were asked for
    """

    mesh: Mesh
    drops: Drops
    warnings: list[str] = field(default_factory=list)
    attributes: Attributes | None = None


def copies(parts: Sequence[Part], settings: ModelSettings) -> list[Part]:
    """Return the parts with their mirror images, and the copies of all of these around the axis.

    Mirror planes and axis pass through the origin of the drawing. Raises CompositionError.
    """
    places = [part.placed for part in parts]
    for axis, wanted in zip(AXES.values(), settings.mirrors, strict=True):
        if wanted:
            places = mirrored(places, axis)
    places = radial(places, settings.count, AXES[settings.axis])
    # Copies come after what they are copies of, in the same order.
    return [replace(parts[n % len(parts)], placed=place) for n, place in enumerate(places)]


class Composer:
    """Composes one model, and keeps the results that the next change does not affect."""

    def __init__(self, most_memory: int = MOST_MEMORY) -> None:
        """Take the most bytes that a model may need."""
        self.most_memory = most_memory
        self._blocks: tuple[Hashable, Blocks] | None = None
        self._carved: tuple[Hashable, Blocks, Mesh] | None = None
        self._sheets: tuple[Hashable, SheetMesh] | None = None
        self._ready: tuple[Hashable, WaveMesh] | None = None

    def compose(
        self,
        parts: Sequence[Part],
        settings: ModelSettings,
        waves: WaveSettings | None = None,
        obstacles: Sequence[Obstacle] = (),
        offset: float = 0.0,
        report: Report | None = None,
        sheets: SheetSettings | None = None,
        attributes: bool = False,
    ) -> Composed:
        """Return the finished model.

        attributes : whether shaders are to know of its vertices; sheets, waves : on the joint
        surface, in metres of the finest part; obstacles : in drawing units, carved out of the
        joint liquid with ``offset`` cells of air around them. Raises CompositionError (no part, no
        liquid, too much memory), ObstacleError if obstacles leave no liquid, and whatever
        ``report`` raises.
        """
        report = report or silent
        everyone = copies(parts, settings)
        shape = shape_key(everyone, settings)
        blocks = self._joined(shape, everyone, settings.blend, report)
        report("Building surface", 0.7)
        around = (shape, digest(obstacles), offset)
        blocks, mesh = self._surface(around, blocks, obstacles, offset)
        warnings = [obstacle.warning for obstacle in obstacles if obstacle.warning]
        room, films, shed = None, None, DropCloud.empty()
        joint = JointSheets(
            finest(parts), [(part.placed.frame, part.strokes) for part in everyone],
            obstacles, offset,
        )  # fmt: skip
        if sheets is not None and len(mesh.faces):
            report(sheets.label, 0.75)
            mesh, made = self._sheeted(around, mesh, joint, sheets)
            films = mesh, made.room
            room, shed = made.room, joint.outside(made.cloud)
            warnings += made.warnings
        if waves is not None and len(mesh.faces):
            report(waves.label, 0.85)
            mesh, said = self._waved((around, sheets), mesh, finest(parts), waves, room)
            warnings += said
        drops, balls = free_drops(everyone, blocks, obstacles, offset)
        if sheets is not None and len(shed.radii):
            fresh = joint.drops_in_drawing(shed)
            shed_too = clear_of_drops(fresh, drops)
            balls = balls.joined(joint.in_drawing(shed.only(shed_too).mesh))
            drops = Drops(
                *(np.concatenate([a, b[shed_too]]) for a, b in zip(drops, fresh, strict=True))
            )
        half = None if films is None else carried_room(*films, mesh, shed.radii[:0])
        mesh = mesh.joined(balls)
        if obstacles:
            cell = blocks.grid.spacing
            vertices = push_out(mesh.vertices, mesh.faces, obstacles, cell, offset)
            mesh = replace(mesh, vertices=vertices)
        found = None
        if attributes:
            report("Attributes", 0.95)
            found = joint.attributes(mesh, half, colours_of(everyone))
        report("Done", 1.0)
        return Composed(mesh, drops, warnings, found)

    def liquid(
        self,
        parts: Sequence[Part],
        settings: ModelSettings,
        obstacles: Sequence[Obstacle] = (),
        offset: float = 0.0,
        report: Report | None = None,
    ) -> tuple[Blocks, Drops]:
        """Return what :meth:`compose` makes its mesh from: the liquid without waves, and the drops.

        Both in drawing units; obstacles are carved out. Raises what ``compose`` raises.
        """
        everyone = copies(parts, settings)
        shape = shape_key(everyone, settings)
        blocks = self._joined(shape, everyone, settings.blend, report or silent)
        blocks = blocks.carved(obstacles, offset)
        return blocks, free_drops(everyone, blocks, obstacles, offset)[0]

    def _joined(
        self, name: Hashable, parts: Sequence[Part], blend: float, report: Report
    ) -> Blocks:
        if self._blocks is None or self._blocks[0] != name:
            made = compose(
                [part.placed for part in parts], blend, most_memory=self.most_memory,
                report=lambda stage, share: report(stage, 0.7 * share),
            )  # fmt: skip
            self._blocks = name, made
        return self._blocks[1]

    def _surface(
        self, name: Hashable, blocks: Blocks, obstacles: Sequence[Obstacle], offset: float
    ) -> tuple[Blocks, Mesh]:
        """Return the liquid outside the obstacles, and its surface."""
        if self._carved is None or self._carved[0] != name:
            carved = blocks.carved(obstacles, offset)
            self._carved = name, carved, carved.mesh()
        return self._carved[1:]

    def _sheeted(
        self, name: Hashable, mesh: Mesh, joint: JointSheets, settings: SheetSettings
    ) -> tuple[Mesh, Sheeted]:
        """Return the mesh with films and rims in drawing units, and what they are, in metres."""
        if self._sheets is None or self._sheets[0] != name:
            self._sheets = name, joint.prepared(mesh)
        made = add_sheets(self._sheets[1], settings)
        return joint.in_drawing(made.mesh), made

    def _waved(
        self, name: Hashable, mesh: Mesh, part: Placed, settings: WaveSettings,
        room: np.ndarray | None,
    ) -> tuple[Mesh, list[str]]:  # fmt: skip
        """Return the mesh with waves in the local metres of ``part``, and warnings.

        room : half the thickness at each vertex, m, where sheets have made films.
        """
        scale, spacing = part.frame.scale, part.liquid.grid.spacing
        metres = replace(mesh, vertices=scale.lengths_to_local(mesh.vertices))
        edge = wave_edge(metres, settings, spacing if room is None else EDGE * spacing)
        if self._ready is None or self._ready[0] != (name, edge, spacing):
            self._ready = (name, edge, spacing), prepare(metres, edge, spacing, room)
        moved, about = propagate(self._ready[1], settings)
        return replace(moved, vertices=scale.lengths_to_drawing(moved.vertices)), about.warnings


def shape_key(parts: Sequence[Part], settings: ModelSettings) -> Hashable:
    """Return a key of the liquid that these parts, copies included, are joined to."""
    return tuple((part.name, place_of(part.placed.frame)) for part in parts), settings.blend


def finest(parts: Sequence[Part]) -> Placed:
    """Return the part with the smallest cells in the drawing, which are also the model's."""
    return min((part.placed for part in parts), key=lambda placed: placed.cell)


def colours_of(parts: Sequence[Part]) -> np.ndarray | None:
    """Return the colours of all parts' strokes, ``(strokes, 4)``; None if none has any."""
    if all(part.colours is None for part in parts):
        return None
    return np.concatenate(
        [np.zeros((len(p.strokes), 4)) if p.colours is None else p.colours for p in parts]
    )


def place_of(frame: Frame) -> Hashable:
    """Return a key of a frame, different for different ones."""
    return frame.axes.tobytes(), frame.centre.tobytes(), frame.scale


def free_drops(
    parts: Sequence[Part], blocks: Blocks, obstacles: Sequence[Obstacle], offset: float
) -> tuple[Drops, Mesh]:
    """Return the drops of all parts that fly free in the model, and their surfaces, drawing units.

    Drops in the model's liquid, in an obstacle or in a drop of an earlier part are left out (those
    of a splash that was joined with itself, or that lies across a mirror plane).
    """
    nothing = np.zeros((0, 3), dtype=np.float32)
    found = Drops(nothing, nothing, nothing[:, 0], np.zeros(0, dtype=bool))
    balls = Mesh.empty()
    for part in parts:
        frame = part.placed.frame
        drops = drops_to_drawing(part.cloud, frame)
        kept = blocks.level_at(drops.positions) > 0
        kept &= outside_obstacles(drops.positions, obstacles, blocks.grid.spacing, offset)
        kept &= clear_of_drops(drops, found)
        mesh = mesh_to_drawing(part.cloud.only(kept).mesh, frame)
        balls = balls.joined(mesh)
        found = Drops(*(np.concatenate([a, b[kept]]) for a, b in zip(found, drops, strict=True)))
    return found, balls


def clear_of_drops(drops: Drops, others: Drops) -> np.ndarray:
    """Return which drops do not touch the nearest of ``others``."""
    if not len(drops.radii) or not len(others.radii):
        return np.ones(len(drops.radii), dtype=bool)
    from scipy.spatial import cKDTree

    away, nearest = cKDTree(others.positions).query(drops.positions)
    return np.asarray(away > drops.radii + others.radii[nearest])
