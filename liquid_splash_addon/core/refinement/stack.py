# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of refinements of a splash, evaluated like a stack of modifiers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..liquid.fields import Fields
from ..liquid.level_set import LevelSet
from ..mesh.marching_cubes import level_surface
from ..mesh.mesh import Mesh
from ..obstacles.contact import push_out
from ..obstacles.obstacles import Obstacle, carve, free_share, outside_obstacles
from ..progress import Report, silent
from ..sketch.strokes import Stroke
from .cleanup import remove_specks
from .detail import Detail
from .drop_meshes import DropCloud
from .droplets import add_droplets
from .ruptures import add_ruptures
from .settings import (
    CleanupSettings,
    DropletSettings,
    RefinementSettings,
    RuptureSettings,
    SheetSettings,
    WaveSettings,
)
from .shader_attributes import Attributes, Look, carried_room, shader_attributes
from .sheet_mesh import EDGE, SheetMesh, prepare_sheets
from .sheets import Sheeted, add_sheets, last_sheets, repeated_sheets
from .stored_splash import Applied, Flowed
from .waves import WaveMesh, prepare, propagate, wave_edge

CHANGES: dict[type[RefinementSettings], Callable[[LevelSet, Any], Detail]] = {
    DropletSettings: add_droplets,
    RuptureSettings: add_ruptures,
    CleanupSettings: remove_specks,
}
"""The steps that change the liquid. Sheets and then waves come last, wherever they stand in the
list: they move the finished mesh."""

OFFSET = 0.25
"""Cells of air between liquid and obstacles: faces in the same place would flicker in a render."""

Steps = tuple[RefinementSettings, ...]


@dataclass(frozen=True)
class Refined:
    """A refined splash in local metres.

    Attributes
    ----------
    mesh : the surface, free drops included
    cloud : the drops that fly free
    gained : volume that each step added, over that of the unrefined splash
    warnings : sentences for the user
    attributes : of the mesh's vertices, where they were asked for
    """

    mesh: Mesh
    cloud: DropCloud
    gained: list[float] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    attributes: Attributes | None = None


def liquid_steps(steps: Sequence[RefinementSettings]) -> Steps:
    """Return the steps that change the liquid: all but sheets and waves."""
    return tuple(step for step in steps if type(step) in CHANGES)


def surface_steps(steps: Sequence[RefinementSettings]) -> Steps:
    """Return the steps that change the finished mesh, in the order in which they do."""
    sheets = last_sheets(steps)
    return (*([] if sheets is None else [sheets]), *wave_steps(steps))


def wave_steps(steps: Sequence[RefinementSettings]) -> tuple[WaveSettings, ...]:
    """Return the waves among ``steps``."""
    return tuple(step for step in steps if isinstance(step, WaveSettings))


class Refiner:
    """Refines one splash, again whenever its list changes.

    The results of the last list are kept up to the first step that differs, so that a change of one
    step evaluates only that step and those after it.
    """

    def __init__(
        self,
        fields: Fields,
        threshold: float = 0.5,
        obstacles: Sequence[Obstacle] = (),
        offset: float = OFFSET,
        applied: Applied | None = None,
        flowed: Flowed | None = None,
        strokes: Sequence[Stroke] = (),
        seed: int = 0,
    ) -> None:
        """Take a splash and its obstacles.

        threshold : probability of liquid at the surface; obstacles : in local metres; offset :
        cells of air around them; applied : refinements that were applied to it, which come
        before all others; flowed : the liquid and drops of both, some time later; strokes : from
        which times of flight come, local metres and m/s; seed : of the splash, which those of
        steps follow.
        """
        self.base = Detail(LevelSet.of(fields, threshold))
        self.applied_waves: tuple[WaveSettings, ...] = ()
        self.applied_sheets: SheetSettings | None = None
        if applied is not None:
            self.base = Detail(applied.liquid, cloud=applied.cloud)
            self.applied_waves, self.applied_sheets = applied.waves, applied.sheets
        if flowed is not None:
            self.base = Detail(flowed.liquid)
        self.obstacles, self.offset, self.strokes = obstacles, offset, strokes
        self.seed = seed
        self._sheets: tuple[Steps, SheetMesh] | None = None
        self._details: dict[Steps, Detail] = {}
        self._meshes: dict[Steps, Mesh] = {}
        self._ready: tuple[tuple[Any, ...], WaveMesh] | None = None

    def refine(
        self,
        steps: Sequence[RefinementSettings],
        report: Report | None = None,
        look: Look | None = None,
    ) -> Refined:
        """Return the splash after ``steps``; without any, its bare surface.

        look : what shaders are to know of its vertices.

        Obstacles are carved out after droplets and ruptures. Sheets and waves follow, and vertices
        that they move into an obstacle are pushed out again. Raises ObstacleError if no liquid is
        left, and whatever ``report`` raises.
        """
        report = report or silent
        steps = self._own(steps)
        solid = liquid_steps(steps)
        waves = (*self.applied_waves, *wave_steps(steps))
        sheets = last_sheets(steps) or self.applied_sheets
        count = len(solid) + len(waves) + 1 + (sheets is not None)
        details = self._run(solid, report, count)
        report("Building surface", len(solid) / count)
        mesh = self._surface(details[-1].liquid, solid)
        gained = [detail.gained / max(self.base.liquid.volume, 1e-9) for detail in details[1:]]
        warnings = [warning for detail in details for warning in detail.warnings]
        cloud, room, films = self._free(details), None, None
        if sheets is not None:
            report(sheets.label, (len(solid) + 1) / count)
            sheeted = self._sheeted(mesh, sheets, solid, details[-1].liquid, cloud)
            mesh, room = sheeted.mesh, sheeted.room
            films = mesh, room
            cloud = cloud.joined(self._outside(sheeted.cloud))
            gained.append(sheeted.volume_change)
            warnings += [*sheeted.warnings, *repeated_sheets(steps)]
        before: Steps = solid if sheets is None else (*solid, sheets)
        for number, wave in enumerate(waves):
            report(wave.label, (count - len(waves) + number) / count)
            mesh, change, said = self._waves(mesh, wave, (*before, *waves[:number]), room)
            room = None
            gained.append(change)
            warnings += said
        if films is not None:  # a rim takes up drops that it has come to touch
            cloud = cloud.only(cloud.clear_of(mesh))
        half = None if films is None else carried_room(*films, mesh, cloud.radii[cloud.owner])
        mesh = self._pushed_out(mesh.joined(cloud.mesh))
        warnings += [obstacle.warning for obstacle in self.obstacles if obstacle.warning]
        attributes = None
        if look is not None:
            report("Attributes", 1.0)
            cell = self.base.liquid.grid.spacing
            attributes = shader_attributes(mesh, cell, self.strokes, half, look.colours)
        return Refined(mesh, cloud, gained, warnings, attributes)

    def liquid(self, steps: Sequence[RefinementSettings], report: Report | None = None) -> Detail:
        """Return what :meth:`refine` makes its mesh from: the liquid without waves, and the drops.

        Obstacles are carved out. Raises ObstacleError if no liquid is left.
        """
        solid = liquid_steps(self._own(steps))
        details = self._run(solid, report or silent, len(solid) + 1)
        return Detail(
            carve(details[-1].liquid, self.obstacles, self.offset),
            sum(detail.gained for detail in details),
            [warning for detail in details for warning in detail.warnings],
            self._free(details),
        )

    def applied(self, steps: Sequence[RefinementSettings]) -> Applied:
        """Return what is kept when ``steps`` are applied: obstacles are not carved out yet."""
        steps = self._own(steps)
        solid = liquid_steps(steps)
        details = self._run(solid, silent, len(solid) + 1)
        cloud = DropCloud.empty()
        for detail in details:
            cloud = cloud.joined(detail.cloud)
        waves = (*self.applied_waves, *wave_steps(steps))
        sheets = last_sheets(steps) or self.applied_sheets
        return Applied(details[-1].liquid, cloud, waves, sheets)

    def _own(self, steps: Sequence[RefinementSettings]) -> Steps:
        """Return the steps as they are on this splash: their seeds follow its own."""
        return tuple(step.of_splash(self.seed) for step in steps)

    def _run(self, solid: Steps, report: Report, count: int) -> list[Detail]:
        """Return the splash before and after each of the ``solid`` steps.

        count : number of stages of the whole evaluation, for the report.
        """
        details = [self.base]
        for number, step in enumerate(solid):
            report(step.label, number / count)
            details.append(self._change(details[-1], solid[: number + 1]))
        self._forget(solid)
        return details

    def _free(self, details: Sequence[Detail]) -> DropCloud:
        """Return the drops of all steps that are outside the obstacles."""
        cloud = DropCloud.empty()
        for detail in details:
            cloud = cloud.joined(self._outside(detail.cloud))
        return cloud

    def _change(self, before: Detail, steps: Steps) -> Detail:
        """Return the splash after the last of ``steps``, kept from the last run if possible."""
        if steps not in self._details:
            change = CHANGES[type(steps[-1])]
            self._details[steps] = change(before.liquid, steps[-1])
        return self._details[steps]

    def _surface(self, liquid: LevelSet, steps: Steps) -> Mesh:
        if steps not in self._meshes:
            if self.obstacles:
                liquid = carve(liquid, self.obstacles, self.offset)
            mesh = level_surface(liquid.level, liquid.velocity, liquid.grid)
            self._meshes = {steps: mesh}
        return self._meshes[steps]

    def _sheeted(
        self, mesh: Mesh, step: SheetSettings, before: Steps, liquid: LevelSet, drops: DropCloud
    ) -> Sheeted:
        """Return the mesh with films and rims.

        before : the steps that the mesh was made with; liquid : what it is the surface of; drops
        : that fly free of it.
        """
        cell = self.base.liquid.grid.spacing
        if self._sheets is None or self._sheets[0] != before:

            def free(points: np.ndarray) -> np.ndarray:
                return free_share(points, self.obstacles, cell, self.offset)

            made = prepare_sheets(mesh, cell, self.strokes, free if self.obstacles else None)
            self._sheets = before, made
        grid = liquid.grid

        def flow(points: np.ndarray) -> np.ndarray:
            return liquid.flow_at(grid.to_cells(points)) * grid.spacing

        return add_sheets(self._sheets[1], step, flow, drops)

    def _waves(
        self, mesh: Mesh, step: WaveSettings, before: Steps, room: np.ndarray | None
    ) -> tuple[Mesh, float, list[str]]:
        """Return the mesh with waves, the share by which they changed the volume, and warnings.

        room : half the thickness at each vertex, m, where sheets have made films.
        """
        spacing = self.base.liquid.grid.spacing
        edge = wave_edge(mesh, step, spacing if room is None else EDGE * spacing)
        if self._ready is None or self._ready[0] != (before, edge):
            self._ready = (before, edge), prepare(mesh, edge, spacing, room)
        moved, about = propagate(self._ready[1], step)
        return moved, about.volume_change, about.warnings

    def _outside(self, cloud: DropCloud) -> DropCloud:
        """Return the drops whose centre is outside all obstacles."""
        cell = self.base.liquid.grid.spacing
        return cloud.only(outside_obstacles(cloud.positions, self.obstacles, cell, self.offset))

    def _pushed_out(self, mesh: Mesh) -> Mesh:
        """Return the mesh with vertices in obstacles pushed out of them."""
        if not self.obstacles or not len(mesh.faces):
            return mesh
        cell = self.base.liquid.grid.spacing
        vertices = push_out(mesh.vertices, mesh.faces, self.obstacles, cell, self.offset)
        return replace(mesh, vertices=vertices)

    def _forget(self, steps: Steps) -> None:
        """Forget results that the next run is unlikely to start with: each takes tens of MB."""
        kept = {steps[:number] for number in range(1, len(steps) + 1)}
        self._details = {key: value for key, value in self._details.items() if key in kept}
