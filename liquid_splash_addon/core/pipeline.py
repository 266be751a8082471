# SPDX-License-Identifier: GPL-3.0-or-later
"""From strokes to a splash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from .animation.projection import divergence_free
from .composition.drops import Drops, drops_to_drawing, mesh_to_drawing
from .condition.voxelize import outside_share
from .generator.latent import draw_latent
from .grid import Grid
from .liquid.fields import Fields
from .liquid.level_set import LevelSet
from .liquid.shaping import shaped
from .mesh.marching_cubes import surface
from .mesh.mesh import Mesh
from .progress import Report, silent
from .settings import SplashSettings
from .sketch.local_frame import Frame, fit_frame
from .sketch.strokes import Stroke, StrokeError, check_strokes, resampled_points
from .sketch.variation import varied

if TYPE_CHECKING:
    from .generator.generator import Generator
    from .obstacles.obstacles import Obstacle
    from .refinement.settings import RefinementSettings
    from .refinement.shader_attributes import Attributes, Look

MOST_OUTSIDE = 0.05
"""Share of the strokes' length that may lie outside the local grid."""

LEAST_OUTSIDE = 0.005
"""Share from which it is worth a warning."""


@dataclass(frozen=True)
class Splash:
    """A finished splash.

    Attributes
    ----------
    mesh : the surface, drawing units and drawing units per second
    fields : occupancy, distance, velocity on the local grid, SI
    frame : where the local box lies in the drawing
    strokes : what it was made of, local metres and m/s
    warnings : sentences for the user
    drops : the free drops of its refinements, if there are any
    attributes : of the mesh's vertices at real size, where they were asked for
    """

    mesh: Mesh
    fields: Fields
    frame: Frame
    strokes: Sequence[Stroke] = ()
    warnings: list[str] = field(default_factory=list)
    drops: Drops | None = None
    attributes: Attributes | None = None


def make_splash(
    strokes: Sequence[Stroke],
    settings: SplashSettings,
    generator: Generator,
    frame: Frame | None = None,
    report: Report | None = None,
    refinements: Sequence[RefinementSettings] = (),
    obstacles: Sequence[Obstacle] = (),
    clearance: float = 0.0,
    look: Look | None = None,
) -> Splash:
    """Return the splash of ``strokes`` (drawing units, drawing units per second).

    obstacles : what it keeps out of, drawing units; clearance : cells of air around them.
    look : what shaders are to know of its vertices.
    frame : the stored frame of an earlier splash; by default one is fitted to the strokes.
    Raises StrokeError, with advice, where no splash can be made.
    """
    report = report or silent
    report("Reading strokes", 0.0)
    frame = prepare_frame(strokes, settings, frame)
    grid = Grid.local(settings.cells)
    local = frame.strokes_to_local(strokes, settings.speed_gain)
    flown = varied(local, settings.seed, settings.variation)
    condition = generator.condition(flown, grid)
    report("Generating liquid", 0.1)
    latent = draw_latent(generator.config, settings.seed, settings.variation)
    local_obstacles = [obstacle.seen_from(frame) for obstacle in obstacles]
    fields = generator.generate(condition, grid, latent, *near(local_obstacles, grid))
    fields = shaped(fields, flown, settings)
    if settings.divergence_free:
        fields = without_divergence(fields, settings.surface_threshold)
    fields = fields.round_off()
    report("Building surface", 0.7)
    if not (fields.occupancy > settings.surface_threshold).any():
        raise StrokeError(
            "These strokes give no liquid: lower Surface Threshold, or change Real Size or Reach"
        )
    warnings = outside_warnings(local) + speed_warnings(local, generator.fastest)
    if not refinements and not obstacles and look is None:
        mesh = mesh_to_drawing(surface(fields, settings.surface_threshold), frame)
        report("Done", 1.0)
        return Splash(mesh, fields, frame, local, warnings)
    from .refinement.stack import Refiner

    refiner = Refiner(fields, settings.surface_threshold, local_obstacles, clearance, strokes=local)
    refined = refiner.refine(
        refinements, lambda stage, share: report(stage, 0.7 + 0.3 * share), look
    )
    return Splash(
        mesh_to_drawing(refined.mesh, frame), fields, frame, local, warnings + refined.warnings,
        drops_to_drawing(refined.cloud, frame), refined.attributes,
    )  # fmt: skip


def without_divergence(fields: Fields, threshold: float) -> Fields:
    """Return fields whose velocity is divergence-free in the liquid (paper, 6.3)."""
    return replace(fields, velocity=divergence_free(LevelSet.of(fields, threshold)).velocity)


def near(obstacles: Sequence[Obstacle], grid: Grid) -> tuple[np.ndarray, ...]:
    """Return the generator's obstacle on ``grid``, if there is one, to be passed on."""
    if not obstacles:
        return ()
    from .obstacles.obstacles import generator_obstacle

    distance = generator_obstacle(obstacles, grid)
    return () if distance is None else (distance,)


def prepare_frame(
    strokes: Sequence[Stroke], settings: SplashSettings, frame: Frame | None
) -> Frame:
    """Return the frame to use, checked: enough of the strokes must lie in the local box."""
    check_strokes(strokes)
    kept = frame is not None
    frame = frame or fit_frame(strokes, settings.real_size)
    local = frame.strokes_to_local(strokes)
    grid = Grid.local()
    share = outside_share(local, grid)
    if share > MOST_OUTSIDE:
        raise StrokeError(
            f"{share:.0%} of the strokes lie outside the generator's box of {grid.size[0]:g} m: "
            + size_advice(local)
            + (", or Realign" if kept else "")
        )
    return frame


def fits(strokes: Sequence[Stroke], frame: Frame) -> bool:
    """Whether nearly all of the strokes (drawing units) lie in the local box of ``frame``."""
    return outside_share(frame.strokes_to_local(strokes), Grid.local()) < LEAST_OUTSIDE


def size_advice(local: Sequence[Stroke], most: float = MOST_OUTSIDE) -> str:
    """Return what to do about strokes that leave the box: the largest real size that fits.

    most : share of their length that may stay outside.
    """
    grid = Grid.local()
    points, _ = resampled_points(local, grid.spacing / 2)
    size = max(float(np.ptp(points, axis=0).max()), 1e-9)
    # Scaling about the centre moves a point to the wall when its largest coordinate gets there.
    reach = float(np.quantile(np.abs(points).max(axis=1), 1 - most))
    share = grid.size[0] / 2 / max(reach, 1e-9)
    # At another size the strokes are resampled at other points: make sure.
    while (
        outside_share([Stroke(s.points * share, s.velocities) for s in local], grid) > 0.98 * most
    ):
        share *= 0.995
    return f"set Real Size to {np.floor(size * share * 1000) / 1000:g} m or less"


def outside_warnings(local: Sequence[Stroke]) -> list[str]:
    """Return a warning if parts of the strokes lie outside the box, where no liquid can be."""
    share = outside_share(local, Grid.local())
    if share < LEAST_OUTSIDE:
        return []
    return [
        f"{share:.1%} of the strokes lie outside the generator's box and get no liquid: "
        + size_advice(local, LEAST_OUTSIDE)
    ]


def speed_warnings(local: Sequence[Stroke], fastest: float) -> list[str]:
    """Return a warning if strokes are faster than anything the generator was trained on.

    One point in twenty may be faster: recorded times are never perfect.
    """
    speeds = np.concatenate([np.linalg.norm(stroke.velocities, axis=1) for stroke in local])
    speed = float(np.quantile(speeds, 0.95))
    if speed <= fastest:
        return []
    return [
        f"Strokes reach {speed:.1f} m/s, the generator knows speeds up to {fastest:.1f} m/s. "
        "Fit Speed lowers Speed Gain to suit"
    ]
