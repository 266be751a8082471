# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulator that makes the training data, beside Blender's own (Mantaflow).

Both get the same streamlets and the same solid in the same open box. Mantaflow has two threads
for one scene after the other, and Blender's default settings but for its fractional obstacles,
which ours has too. Our simulator, which has no threads, runs two scenes side by side. Mantaflow
writes its cache meanwhile, as it always does; ours keeps nothing.
"""

import contextlib
import json
import multiprocessing
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from liquid_splash_addon.core.fluid.step import OPEN_MARGIN, Liquid, Physics, advance, step
from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING
from tests.benchmarks.synthesis import own_peak_mb
from training.scenes.bodies import Body
from training.scenes.families import random_scene
from training.scenes.scene import Scene, Streamlet
from training.simulation.simulate import occupied_cells

ROOT = Path(__file__).resolve().parents[2]

SEEDS = (8, 20)
"""Of the paper's family; radii of 25 and 27 mm, near the mean of its range, and streamlets that
fit into the box from the start."""

FPS = 100
FRAMES = 40

STEPS = 16
"""Steps over which the scaling is measured: the ball hits the sphere and spreads, and none of
its liquid reaches the walls of the smallest box."""

REPEATS = 3


class Run(NamedTuple):
    """The simulation of a scene, at the start and in every frame.

    Attributes
    ----------
    seconds : of computing
    centres : ``(frames + 1, 3)`` metres, of mass
    cells : ``(frames + 1,)``, with liquid in them
    whole : frames until a hundredth of the liquid has left the box (Mantaflow does not tell)
    """

    seconds: float
    centres: np.ndarray
    cells: np.ndarray
    whole: int = 0


def paper_scene(seed: int, resolution: int) -> Scene:
    """Return a scene of the paper's family in the local box, from which liquid can leave.

    Around the ``resolution`` cells lies the margin in which our simulator drops liquid.
    """
    scene = random_scene(seed, resolution, "streamlet")
    cells = resolution + 2 * int(OPEN_MARGIN)
    return replace(scene, cells=cells).shifted(
        np.full(3, (cells - scene.cells) * scene.spacing / 2)
    )


@cache
def blender_command() -> str | None:
    """Return what runs Blender, the one that BLENDER names or the provisioned one; None if none."""
    command = os.environ.get("BLENDER") or str(ROOT / "tests" / "blender.sh")
    if shutil.which(command) is None:
        return None
    found = subprocess.run([command, "--version"], capture_output=True, stdin=subprocess.DEVNULL)
    return command if found.returncode == 0 else None


def run_mantaflow(scene: Scene, frames: int = FRAMES) -> Run:
    """Return how Mantaflow simulates ``scene`` with two threads; seconds are the bake's alone."""
    given = {"resolution": scene.cells - 2 * int(OPEN_MARGIN), "frames": frames, "fps": FPS}
    return bake(scene.parameters() | given)


def bake(given: dict[str, Any], particles: dict[str, np.ndarray] | None = None) -> Run:
    """Return how Mantaflow simulates what ``mantaflow_scene`` takes, with two threads.

    particles : ``positions`` (metres) and ``velocities`` (m/s) of the start, instead of streamlets
    """
    blender = blender_command()
    if blender is None:
        raise RuntimeError("there is no Blender: run 'make blender' as root or set BLENDER")
    # The provisioned Blender sees /tmp and the checkout, and nothing else of ours.
    with tempfile.TemporaryDirectory(dir="/tmp" if os.path.isdir("/tmp") else None) as folder:
        source, result = Path(folder) / "in.json", Path(folder) / "out.json"
        if particles is not None:
            given = given | {"particles": str(Path(folder) / "particles.npz")}
            np.savez(given["particles"], **particles)
        source.write_text(json.dumps(given))
        script = ROOT / "tests" / "benchmarks" / "mantaflow_scene.py"
        options = ["-b", "--factory-startup", "--threads", "2", "--python", str(script)]
        done = subprocess.run(
            [blender, *options, "--", str(source), str(result)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        if not result.exists():
            raise RuntimeError(f"Blender did not bake the scene:\n{done.stdout}")
        found = json.loads(result.read_text())
    return Run(found["seconds"], np.array(found["centres"]), np.array(found["cells"]))


def run_ours(scene: Scene, frames: int = FRAMES, physics: Physics | None = None) -> Run:
    """Return how our simulator does ``scene``, at the same moments."""
    world, liquid = scene.world(physics), scene.liquid()
    looks = [look(liquid, scene)]
    seconds, whole = 0.0, 0
    for frame in range(1, frames + 1):
        begin = time.perf_counter()
        liquid = advance(liquid, world, frame / FPS)
        seconds += time.perf_counter() - begin
        looks.append(look(liquid, scene))
        whole += liquid.left < 0.01 * liquid.emitted
    centres, cells = zip(*looks, strict=True)
    return Run(seconds, np.array(centres), np.array(cells), whole)


def look(liquid: Liquid, scene: Scene) -> tuple[np.ndarray, int]:
    """Return the centre of mass, metres, and the number of cells with liquid in them."""
    particles = liquid.particles
    if not len(particles.positions):
        return np.full(3, np.nan), 0
    centre = np.average(particles.positions.astype(float), axis=0, weights=particles.volumes)
    return centre * scene.spacing, len(occupied_cells(liquid, 1.0))


def warm_up() -> None:
    """Compile all that is compiled, or load it from its cache."""
    run_ours(ball_scene(64, radius=2.0), frames=1)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Give processes that are started meanwhile one thread."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def in_processes(function: Callable[..., Any], tasks: list[tuple[Any, ...]]) -> list[Any]:
    """Return what ``function`` gives for each of the tasks, which run at once in new processes.

    No task starts before all processes are warm.
    """
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(len(tasks))
    with (
        one_thread(),
        ProcessPoolExecutor(len(tasks), context, meet_when_warm, (barrier,)) as pool,
    ):
        futures = [pool.submit(function, *task) for task in tasks]
        return [future.result() for future in futures]


def meet_when_warm(barrier: Any) -> None:
    """Warm up and wait for the others."""
    warm_up()
    barrier.wait()


def ball_scene(cells: int, radius: float = 8.0, finer: int = 1) -> Scene:
    """Return a scene in a box of ``cells``: a short streamlet falls on a sphere in the middle.

    radius : of both, in cells of LOCAL_SPACING. finer : cells are so many times smaller.
    """
    size = radius * LOCAL_SPACING
    spacing = LOCAL_SPACING / finer
    middle = np.full(3, cells * spacing / 2)
    up = np.array([0.0, 0.0, 1.0])
    tip = middle + 2 * LOCAL_SPACING * up
    streamlet = Streamlet(size, size, 1.5, tip, -up)
    sphere = Body("sphere", size, size, middle - size * up, np.eye(3))
    return Scene(0, "ball", cells, spacing, (streamlet,), sphere, 0.0)


def step_cost(scene: Scene, steps: int) -> tuple[float, float, float]:
    """Return seconds a step, liquid cells, and the memory in MB that the steps took at most.

    Seconds are the processor's, so that other processes matter less.
    """
    before, best, cells = own_peak_mb(), np.inf, 0.0
    dt = STEPS * LOCAL_SPACING / 1.5 / steps  # at most about a cell a step
    for _ in range(REPEATS):
        world, liquid = scene.world(), scene.liquid()
        seconds, cells = 0.0, 0.0
        for _ in range(steps):
            begin = time.process_time()
            liquid = step(liquid, world, dt)
            seconds += time.process_time() - begin
            cells += len(occupied_cells(liquid, 1.0)) / steps
        best = min(best, seconds / steps)
    return best, cells, own_peak_mb() - before


def measure_scaling() -> dict[str, float]:
    """Return how time and memory grow with the box and with the number of liquid cells.

    Memory is how far the steps raise the peak of the process's resident memory.
    """
    small, middle, large, fine = (
        in_processes(step_cost, [(scene, steps)])[0]
        for scene, steps in (
            (ball_scene(64), STEPS),
            (ball_scene(128), STEPS),
            (ball_scene(256), STEPS),
            (ball_scene(256, finer=2), 2 * STEPS),
        )
    )
    return {
        "simulation.box_256_over_64_time": large[0] / small[0],
        "simulation.box_256_over_64_memory": large[2] / small[2],
        "simulation.halved_cells_time_ratio": fine[0] / middle[0] / (fine[1] / middle[1]),
    }


def measure_speed() -> dict[str, float]:
    """Return the time that both simulators take for the same two scenes."""
    if blender_command() is None:
        print("Skipped: Mantaflow's time. There is no Blender: run 'make blender' as root.")
        return {}
    scenes = [paper_scene(seed, LOCAL_CELLS) for seed in SEEDS]
    ours = max(run.seconds for run in in_processes(run_ours, [(scene,) for scene in scenes]))
    mantaflow = sum(run_mantaflow(scene).seconds for scene in scenes)
    return {
        "simulation.speedup_over_mantaflow_128": mantaflow / ours,
        "simulation.seconds_128": ours,
        "simulation.mantaflow_seconds_128": mantaflow,
    }


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    return measure_speed() | measure_scaling()
