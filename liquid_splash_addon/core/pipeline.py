# SPDX-License-Identifier: GPL-3.0-or-later
"""From strokes to a splash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from .animation.projection import divergence_free
from .composition.drops import Drops, drops_to_drawing, mesh_to_drawing
from .condition.similarity import LEAST_OUTSIDE, at_real_size, in_words, model_scale
from .condition.voxelize import outside_share
from .generator.latent import draw_latent
from .grid import Grid
from .liquid.fields import Fields
from .liquid.level_set import LevelSet
from .liquid.shaping import shaped
from .mesh.marching_cubes import surface
from .mesh.mesh import Mesh
from .progress import Report, silent
from .scale import Scale
from .settings import SplashSettings
from .sketch.local_frame import Frame, fit_frame
from .sketch.strokes import Stroke, StrokeError, check_strokes
from .sketch.variation import varied

if TYPE_CHECKING:
    from .generator.generator import Generator
    from .obstacles.obstacles import Obstacle
    from .refinement.settings import RefinementSettings
    from .refinement.shader_attributes import Attributes, Look


LEAST_KEPT = 0.75
"""Size of a model in a stored frame over that in a fitted one; below it, details would be lost."""

LATENT = 1.5
"""Size of latents at full variation over those of training: seeds differ more, and stay covered."""

BOX_SHARE = 0.9
"""Longest side of a large sketch over that of its box."""


@dataclass(frozen=True)
class Splash:
    """A finished splash.

    Attributes
    ----------
    mesh : the surface, drawing units and drawing units per second
    fields : occupancy, distance, velocity on the generator's grid at the real size, SI
    frame : where the local box lies in the drawing
    strokes : what it was made of, local metres and m/s
    warnings : sentences for the user
    regime : what is computed instead, in words, where no generator was trained on its size
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
    regime: str = ""


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
    local = frame.strokes_to_local(strokes, settings.speed_gain)
    model = model_scale(local)
    seen = frame.seen_as(model)
    drawn = varied(
        seen.strokes_to_local(strokes, settings.speed_gain), settings.seed, settings.variation
    )
    around = [obstacle.seen_from(seen) for obstacle in obstacles]
    fields = generated(drawn, settings, generator, around, report)
    fields = shaped(fields, at_real_size(drawn, model), settings, model)
    if settings.divergence_free:
        fields = without_divergence(fields, settings.surface_threshold)
    fields = fields.round_off()
    report("Building surface", 0.7)
    if not (fields.occupancy > settings.surface_threshold).any():
        raise StrokeError("These strokes give no liquid: lower Thinness, or raise Keep Near")
    warnings = speed_warnings(local, model.velocities_to_drawing(generator.fastest))
    regime = in_words(model, local)
    if not refinements and not obstacles and look is None:
        mesh = mesh_to_drawing(surface(fields, settings.surface_threshold), frame)
        report("Done", 1.0)
        return Splash(mesh, fields, frame, local, warnings, regime=regime)
    from .refinement.stack import Refiner

    around = [obstacle.seen_from(frame) for obstacle in obstacles]
    refiner = Refiner(
        fields, settings.surface_threshold, around, clearance, strokes=local,
        seed=settings.seed_of_details,
    )  # fmt: skip
    refined = refiner.refine(
        refinements, lambda stage, share: report(stage, 0.7 + 0.3 * share), look
    )
    return Splash(
        mesh_to_drawing(refined.mesh, frame), fields, frame, local, warnings + refined.warnings,
        drops_to_drawing(refined.cloud, frame), refined.attributes, regime,
    )  # fmt: skip


def generated(
    strokes: Sequence[Stroke],
    settings: SplashSettings,
    generator: Generator,
    obstacles: Sequence[Obstacle],
    report: Report,
) -> Fields:
    """Return the generator's answer, in the metres and seconds of the model that it sees.

    strokes, obstacles : in those, too
    """
    grid = Grid.local(settings.cells)
    condition = generator.condition(strokes, grid)
    report("Generating liquid", 0.1)
    latent = draw_latent(generator.config, settings.seed, LATENT * settings.variation)
    return generator.generate(condition, grid, latent, *near(obstacles, grid))


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
    """Return the frame to use.

    Raises StrokeError for strokes of which nothing can be made, and for those that have left a
    stored frame so far that a box around both would show little of them.
    """
    check_strokes(strokes)
    fitted = fit_frame(strokes, settings.real_size)
    if frame is None:
        return fitted
    kept, anew = (model_scale(one.strokes_to_local(strokes)).length for one in (frame, fitted))
    if kept < LEAST_KEPT * anew:
        raise StrokeError(
            "The strokes have left their splash: use Refit to Sketch, or move them back"
        )
    return frame


def fits(strokes: Sequence[Stroke], frame: Frame, real_size: float) -> bool:
    """Whether nearly all of the strokes (drawing units) lie in the box around ``frame``.

    The box is the generator's, and for sketches of a larger ``real_size`` (m) as much larger.
    """
    box = Grid.local()
    model = Scale.similar(min(1.0, BOX_SHARE * box.size[0] / max(real_size, 1e-9)))
    return outside_share(frame.seen_as(model).strokes_to_local(strokes), box) < LEAST_OUTSIDE


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
