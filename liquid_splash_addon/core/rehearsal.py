# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything done once, as the interface does it, so that all that it needs is compiled and kept.

numba compiles a function for the types of its arguments when it is first called, so nothing short
of real splashes finds all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from .animation.solver_start import SolverStart
from .compiled_code import FIRST, REACHED, REFINED
from .compiling import while_compiling
from .composition.model import Composer, refined_part
from .generator.loading import load_generator, load_torch
from .grid import LOCAL_SPACING
from .liquid.edge_smoothing import smoothed_edges
from .liquid.fields import AIR, Fields, clip_to_band
from .liquid.level_set import LevelSet
from .mantaflow.domain import Domain, bounds
from .mantaflow.first_frame import first_frame
from .mantaflow.settings import MantaflowSettings
from .obstacles.obstacles import Obstacle, obstacle_from_mesh
from .pipeline import make_splash
from .progress import Report, part_of, silent
from .refinement.presets import PRESETS
from .refinement.settings import SheetSettings, WaveSettings
from .refinement.shader_attributes import Look
from .refinement.stack import OFFSET, Refiner
from .refinement.stored_splash import StoredSplash
from .settings import ModelSettings, SplashSettings
from .simulation.flow_on import flow_on
from .simulation.frames import read_frame
from .simulation.run import run
from .simulation.settings import SimulationSettings
from .simulation.start import MovingObstacle, Start
from .sketch.drawing import strokes_from_drawings
from .sketch.presets import example_sketch

if TYPE_CHECKING:
    from .generator.generator import Generator
    from .grid import Grid
    from .pipeline import Splash
    from .sketch.strokes import Stroke

# Graphics cards run no compiled loops: what they leave out is the only difference.
DRAFT = SplashSettings(resolution="64", device="CPU")
FULL = replace(DRAFT, resolution="128")
UNUSUAL = replace(DRAFT, variation=0.5, reach=0.05, breakup=4.0, divergence_free=True)

SLOW = 0.15
"""Times the usual speed gain at which a splash breaks up, as one of slow strokes does."""

STEP = 0.01
"""Part of what is left of a stage that a function stands for: a stage has tens to hundreds."""

SLOWEST = 3.0
"""Times that a number format may take of 32 bits': a processor without bfloat16 takes minutes."""

FRESH, STORM = PRESETS["FRESH"].steps, PRESETS["STORM"].steps

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
SQUARE = ((0, 2, 3), (0, 3, 1))
CUBE = (
    *((0, 1, 3), (0, 3, 2)), *((4, 6, 7), (4, 7, 5)), *((0, 4, 5), (0, 5, 1)),
    *((2, 3, 7), (2, 7, 6)), *((0, 2, 6), (0, 6, 4)), *((1, 5, 7), (1, 7, 3)),
)  # fmt: skip


class Rehearsal:
    """Splashes of the crown, each made of what the one before left."""

    generator: Generator
    splash: Splash
    stored: StoredSplash

    def __init__(self) -> None:
        """Take the strokes."""
        self.strokes, _ = strokes_from_drawings(example_sketch("crown"), DRAFT)

    def draft(self, report: Report) -> None:
        """Make a draft in the fastest number format, as a first splash is made, and store it."""
        load_torch()
        from .generator.precision import known_fastest

        self.generator = load_generator(None, "CPU", known_fastest("cpu"))
        self.splash = make_splash(self.strokes, DRAFT, self.generator, report=report)
        self.splash.mesh.with_edges()
        StoredSplash(self.splash.fields, self.splash.strokes).to_bytes()
        smooth_as_if_full(self.splash.fields)
        slow = replace(DRAFT, speed_gain=DRAFT.speed_gain * SLOW)
        make_splash(self.strokes, slow, self.generator, self.splash.frame, report=report)

    def formats(self, report: Report) -> None:
        """Make a draft in every other number format that is of use here: the user may choose."""
        names = [name for name in useful_precisions() if name != self.generator.precision]
        for number, name in enumerate(names):
            part = part_of(report, number / len(names), (number + 1) / len(names))
            generator = load_generator(None, "CPU", name)
            make_splash(self.strokes, DRAFT, generator, report=part)

    def unusual(self, report: Report) -> None:
        """Make a draft with settings that are off by default."""
        make_splash(self.strokes, UNUSUAL, self.generator, self.splash.frame, report)

    def refined(self, report: Report) -> None:
        """Refine the draft, as stored in a file, by the usual list."""
        stored = StoredSplash(self.splash.fields, self.splash.strokes)
        self.stored = StoredSplash.from_bytes(stored.to_bytes())
        Refiner(self.stored.fields, strokes=self.stored.strokes).refine(FRESH, report)

    def refinements(self, report: Report) -> None:
        """Refine it by another list, and again after applying the usual one."""
        stored = self.stored
        refiner = Refiner(stored.fields, strokes=stored.strokes)
        refiner.refine(STORM, part_of(report, 0.0, 0.6), Look())
        applied = replace(stored, applied=refiner.applied(FRESH))
        applied = StoredSplash.from_bytes(applied.to_bytes())
        again = Refiner(applied.fields, applied=applied.applied)
        again.refine(FRESH, part_of(report, 0.6, 1.0))

    def obstacles(self, report: Report) -> None:
        """Make and refine a draft that keeps out of a body and a sheet."""
        make_splash(
            self.strokes, DRAFT, self.generator, report=report,
            refinements=STORM, obstacles=obstacles(), clearance=OFFSET,
        )  # fmt: skip

    def model(self, report: Report) -> None:
        """Join two splashes and their mirror images, around obstacles."""
        refiner, frame = Refiner(self.splash.fields), self.splash.frame
        beside = replace(frame, centre=frame.centre + np.array([0.4, 0.1, 0.0]))
        steps = tuple(step for step in STORM if not isinstance(step, WaveSettings))
        parts = [refined_part(name, refiner, steps, at) for name, at in enumerate((frame, beside))]
        settings, around = ModelSettings(mirror_x=True), obstacles()
        Composer().compose(
            parts, settings, WaveSettings(), around, OFFSET, report, SheetSettings(holes=0.5)
        )

    def export(self, report: Report) -> None:
        """Place the splash in a domain of Mantaflow, divergence-free, on a floor."""
        frame = self.splash.frame
        start = SolverStart.of_splash(Refiner(self.splash.fields).liquid(FRESH), frame, frame)
        bottom = float(bounds(start)[0][2])
        settings = MantaflowSettings(resolution=48, ground="FLOOR", ground_height=bottom)
        first_frame(start, Domain.around(start, settings), settings, report=report)

    def simulation(self, report: Report) -> None:
        """Flow the draft on, and simulate a frame of it in a pool, past an obstacle that moves."""
        liquid = LevelSet.of(self.splash.fields)
        cube = CORNERS * 0.05 - np.array([0.0, 0.0, 0.1])
        poses = np.stack([cube, cube + 0.005]).astype(np.float32)
        mover = MovingObstacle(poses, np.array(CUBE, dtype=np.int32))
        start = Start(liquid, 0.002, ground=-0.1, obstacles=(mover,))
        flow_on(start, 2.0, part_of(report, 0.0, 0.5))
        settings = SimulationSettings(frames=1, resolution="64", ground="POOL", tension=True)
        with TemporaryDirectory() as folder:
            run(start, settings, folder, part_of(report, 0.5, 1.0))
            read_frame(folder, 1)

    def full(self, report: Report) -> None:
        """Make and refine a full result."""
        make_splash(self.strokes, FULL, self.generator, report=report, refinements=FRESH)


STAGES = (
    ("First preview", Rehearsal.draft, REACHED[FIRST], FIRST),
    ("Usual refinements", Rehearsal.refined, REACHED[REFINED] - REACHED[FIRST], REFINED),
    ("Other refinements", Rehearsal.refinements, 0.13),
    ("Number formats", Rehearsal.formats, 0.22),
    ("Other previews", Rehearsal.unusual, 0.02),
    ("Obstacles", Rehearsal.obstacles, 0.09),
    ("Models", Rehearsal.model, 0.03),
    ("Mantaflow", Rehearsal.export, 0.02),
    ("Simulation", Rehearsal.simulation, 0.1),
    ("Full resolution", Rehearsal.full, 0.02),
)
"""What is done, with its share of the whole time where nothing was compiled before, and for whom
what it compiles is enough."""


def rehearse(report: Report = silent, reached: Callable[[str], None] = lambda _: None) -> None:
    """Do everything once. Raises PackageError, and what any splash may raise.

    reached : told of the stages of ``compiled_code.REACHED``, at their ends
    """
    rehearsal, done = Rehearsal(), 0.0
    for label, work, share, *stages in STAGES:
        report(label, done)
        with counted(label, part_of(report, done, done + share)) as part:
            work(rehearsal, part)
        done += share
        for stage in stages:
            reached(stage)
    report("Done", 1.0)


@contextmanager
def counted(label: str, report: Report) -> Iterator[Report]:
    """Let every function that is compiled move the share on; give back the report to work with."""
    share = 0.0

    def move(to: float) -> None:
        nonlocal share
        share = max(share, to)
        report(label, share)

    with while_compiling(lambda: move(share + STEP * (1 - share))):
        yield lambda _, done: move(done)


def smooth_as_if_full(fields: Fields) -> None:
    """Smooth the edges of a draft as those of a full result are, whose cells are finer."""
    liquid = LevelSet.of(fields)
    smoothed_edges(replace(liquid, grid=replace(liquid.grid, spacing=LOCAL_SPACING)))


class Bowl:
    """In place of a generator, without networks: a bowl that grows, whatever the strokes are."""

    config, fastest = None, np.inf

    def condition(self, _strokes: Sequence[Stroke], _grid: Grid) -> None:
        """Look at no strokes."""

    def generate(self, _condition: None, grid: Grid, _latent: object, *_obstacle: object) -> Fields:
        """Return the lower half of a shell, 6 cells thick, as a generator returns a splash."""
        centres = np.stack(np.meshgrid(*(np.arange(n) - n / 2 for n in grid.shape), indexing="ij"))
        away = np.linalg.norm(centres, axis=0)
        shell = np.maximum(np.abs(away - grid.shape[0] / 4) - 3, centres[2])
        distance = np.clip(shell, -AIR, AIR).astype(np.float32)
        velocity = (centres / np.maximum(away, 1)).astype(np.float32)
        return clip_to_band(1 / (1 + np.exp(2 * distance)), distance, velocity, grid)


def work(_job: object, _say: Callable[..., None]) -> int:
    """Rehearse what needs no networks, in a process beside :func:`rehearse`, which gains by it."""
    rehearsal = Rehearsal()
    bowl: Any = Bowl()
    rehearsal.splash = make_splash(rehearsal.strokes, DRAFT, bowl)
    rehearsal.refined(silent)
    rehearsal.refinements(silent)
    return 0


def useful_precisions() -> list[str]:
    """List the number formats that are not much slower here than others, the fastest last."""
    load_torch()
    from .generator.precision import measure_all

    taken = measure_all("cpu", silent)
    most = SLOWEST * taken["float32"]
    return sorted((name for name in taken if taken[name] <= most), key=lambda n: -taken[n])


def obstacles() -> list[Obstacle]:
    """Return a cube and an open square in the crown's way, drawing units."""
    places = (CUBE, 0.5, (0.4, -0.2, 0.1)), (SQUARE, 1.0, (-0.6, -0.5, 0.2))
    return [
        obstacle_from_mesh(CORNERS * size + corner, np.array(faces, dtype=np.int32))
        for faces, size, corner in places
    ]
