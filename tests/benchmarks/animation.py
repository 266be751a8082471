# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash simulated, by our solver and by Blender's own (Mantaflow).

Both start from the same particles of the example crown above a floor, in the same open box of
cells, and make the same frames. Mantaflow has two threads. Our solver has one: two scenes side by
side have a core each, and one alone leaves the other core idle. Neither makes a mesh here; the
sixty frames of ``animation.seconds_crown_60`` are whole ones, with meshes, in files.
"""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from liquid_splash_addon.core.fluid.step import OPEN_MARGIN, advance
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.pipeline import make_splash
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.simulation.run import run
from liquid_splash_addon.core.simulation.scene import Scene, ground_height, prepare
from liquid_splash_addon.core.simulation.settings import SimulationSettings
from liquid_splash_addon.core.simulation.start import Start
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import example_sketch
from tests.benchmarks.simulation import Run, bake, blender_command, in_processes

FPS = 24

SLOW_MOTION = 1 / 20
"""Seconds of the liquid's time in one of the film's."""

FULL_SPEED = 1.0

FRAMES = 60

COMPARED = 12
"""Frames that both solvers make."""

COMPARED_MARGIN = 0.25
"""Margin of the box in which both do: within these frames nothing leaves it."""


def crown(speed: float = SLOW_MOTION) -> Start:
    """Return the example crown, standing on a floor, for a film at this speed."""
    settings = SplashSettings(device="CPU")
    strokes, _ = strokes_from_drawings(example_sketch("crown"), settings)
    splash = make_splash(strokes, settings, load_generator(None, "CPU", "float32"))
    liquid = LevelSet.of(splash.fields)
    lowest = int(np.argwhere(liquid.level < 0)[:, 2].min())
    ground = liquid.grid.origin[2] + lowest * liquid.grid.spacing
    return Start(liquid, speed / FPS, ground=ground)


def crown_scene(start: Start) -> Scene:
    """Return the scene that both solvers get."""
    return prepare(start, SimulationSettings(ground="FLOOR", margin=COMPARED_MARGIN))


def run_ours(start: Start, frames: int = COMPARED) -> Run:
    """Return how our solver simulates the crown, at the start and in every frame."""
    scene = crown_scene(start)
    advance(scene.liquid, scene.world, start.frame_seconds)  # compiles
    liquid, seconds, centres = scene.liquid, 0.0, []
    for frame in range(frames + 1):
        begin = time.perf_counter()
        liquid = advance(liquid, scene.world, frame * start.frame_seconds)
        seconds += time.perf_counter() - begin
        particles = liquid.particles
        places = particles.positions.astype(float)
        centres.append(np.average(places, axis=0, weights=particles.volumes) * scene.domain.cell)
    return Run(seconds, np.array(centres), np.zeros(frames + 1))


def run_mantaflow(start: Start, frames: int = COMPARED) -> Run:
    """Return how Mantaflow simulates the crown; metres count from the corner of the domain."""
    scene = crown_scene(start)
    cell, cells = scene.domain.cell, scene.domain.cells
    size = cells * cell
    below = ground_height(start, scene.domain) * cell - size
    floor = {"shape": "cube", "size": size, "height": size,
             "centre": [size / 2, size / 2, below], "axes": np.eye(3).tolist()}  # fmt: skip
    given: dict[str, Any] = {
        "cells": cells, "spacing": cell, "resolution": cells - 2 * int(OPEN_MARGIN),
        "frames": frames, "fps": round(1 / start.frame_seconds), "streamlets": [],
        "obstacle": floor,
    }  # fmt: skip
    particles = scene.liquid.particles
    return bake(
        given,
        {"positions": particles.positions * cell, "velocities": particles.velocities * cell},
    )


def film_seconds(start: Start) -> float:
    """Return the seconds that the frames of a film take, with meshes and files."""
    settings = SimulationSettings(frames=FRAMES, ground="FLOOR")
    with tempfile.TemporaryDirectory() as folder:
        run(start, SimulationSettings(frames=1, ground="FLOOR"), Path(folder) / "warm")
        begin = time.perf_counter()
        run(start, settings, Path(folder) / "frames")
        return time.perf_counter() - begin


def measure_beside_mantaflow(start: Start) -> dict[str, float]:
    """Return how much faster our solver is, and how far both agree."""
    if blender_command() is None:
        print("Skipped: Mantaflow's crown. There is no Blender: run 'make blender' as root.")
        return {}
    both = in_processes(run_ours, [(start,), (start,)])
    (alone,) = in_processes(run_ours, [(start,)])
    theirs = run_mantaflow(start)
    size = max(start.liquid.grid.size)
    apart = np.linalg.norm(theirs.centres - alone.centres, axis=1).max()
    return {
        "animation.speedup_over_mantaflow": 2 * theirs.seconds / max(one.seconds for one in both),
        "animation.speedup_alone": theirs.seconds / alone.seconds,
        "animation.seconds_crown_12": alone.seconds,
        "animation.mantaflow_seconds_crown_12": theirs.seconds,
        "animation.centres_apart": float(apart / size),
    }


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    start = crown()
    films = {
        f"animation.seconds_crown_{FRAMES}": film_seconds(start),
        f"animation.seconds_crown_{FRAMES}_full_speed": film_seconds(crown(FULL_SPEED)),
    }
    return films | measure_beside_mantaflow(start)
