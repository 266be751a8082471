# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw how our simulator and Blender's own (Mantaflow) move the same three streamlets.

    python -m tests.benchmarks.mantaflow_figures --out docs/images/mantaflow.png

It takes several minutes a scene at full resolution, and a Blender (``make blender``).
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from liquid_splash_addon.core.fluid.step import Physics
from liquid_splash_addon.core.grid import LOCAL_CELLS
from tests.benchmarks.simulation import (
    FPS,
    FRAMES,
    SEEDS,
    Run,
    blender_command,
    in_processes,
    paper_scene,
    run_mantaflow,
    run_ours,
)
from training.scenes.scene import Scene

SCENES = (*SEEDS, 26)
"""A sphere, a cube and a cylinder: slow and thick, fast and long, thin and fast."""

LEAST = 0.2
"""A centre of mass is drawn while the liquid fills this share of the cells it had at its start."""

STYLES: dict[str, dict[str, Any]] = {
    "ours": {"color": "#0072b2", "linewidth": 1.8},
    "Mantaflow": {"color": "#d55e00", "linewidth": 1.8, "linestyle": (0, (4, 1.5))},
    "ours, sheets left to tear": {"color": "#0072b2", "linewidth": 1.0, "linestyle": ":"},
}


class Column(NamedTuple):
    """A scene and what was made of it by ours, Mantaflow, and ours without resampled sheets."""

    scene: Scene
    runs: tuple[Run, Run, Run]


def height(run: Run, scene: Scene) -> np.ndarray:
    """Return the height of the centre of mass above the place of the impact, cm."""
    return (run.centres[:, 2] - scene.cells * scene.spacing / 2) * 100


def distance(run: Run, scene: Scene) -> np.ndarray:
    """Return how far the centre of mass has moved horizontally, cm."""
    return np.linalg.norm(run.centres[:, :2] - run.centres[0, :2], axis=1) * 100


def volume(run: Run, scene: Scene) -> np.ndarray:
    """Return the volume of all cells with liquid in them, ml."""
    return run.cells * scene.spacing**3 * 1e6


ROWS = (
    ("Centre of mass:\nheight (cm)", height),
    ("Centre of mass:\nhorizontal shift (cm)", distance),
    ("Cells with liquid:\nvolume (ml)", volume),
)


def title(scene: Scene) -> str:
    """Return what the scene is, in two lines."""
    streamlet, body = scene.streamlets[0], scene.obstacle
    return (
        f"radius {streamlet.radius * 1000:.0f} mm, {streamlet.speed:.1f} m/s,\n"
        f"at a {body.shape}, {body.size * 2000:.0f} mm wide"
    )


def draw(columns: Sequence[Column], path: Path) -> None:
    """Draw a column a scene and a row a quantity."""
    style: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False}
    with rc_context(style):
        figure = Figure(figsize=(2.5 * len(columns), 5.8))
        grid = figure.subplots(len(ROWS), len(columns), sharex="col", squeeze=False)
        for axes, column in zip(grid.T, columns, strict=True):
            draw_column(axes, column)
        for axes, (label, _) in zip(grid[:, 0], ROWS, strict=True):
            axes.set_ylabel(label)
        figure.align_ylabels(grid[:, 0])
        names = [*STYLES, "liquid leaves the box"]
        marks = [*grid[-1, 0].get_lines(), grid[-1, 0].patches[0]]
        figure.legend(marks, names, loc="upper center", ncols=len(names), frameon=False)
        figure.tight_layout(rect=(0, 0, 1, 0.96))
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=200)


def draw_column(column: Sequence[Any], data: Column) -> None:
    """Draw the quantities of one scene, one below the other, until little liquid is left."""
    enough = [run.cells >= LEAST * run.cells[0] for run in data.runs]
    end = max(np.flatnonzero(few)[-1] for few in enough) / FPS
    leaving = data.runs[0].whole / FPS
    for axes, (_, quantity) in zip(column, ROWS, strict=True):
        for style, run, shown in zip(STYLES.values(), data.runs, enough, strict=True):
            values = quantity(run, data.scene).astype(float)
            times = np.arange(len(values)) / FPS
            if quantity is volume:
                axes.plot(times, values, **style)
            elif run is not data.runs[-1]:  # its centre of mass hides behind the first's
                axes.plot(times[shown], values[shown], **style)
        axes.axvspan(leaving, end, color="0.93", linewidth=0, zorder=0)
        axes.set_xlim(0, end)
    column[0].set_title(title(data.scene), fontsize=8)
    column[-1].set_ylim(bottom=0)
    column[-1].set_xlabel("time (s)")


def simulate(resolution: int, frames: int) -> list[Column]:
    """Return the scenes as both simulators do them."""
    scenes = [paper_scene(seed, resolution) for seed in SCENES]
    tearing = Physics(sheets=False)
    whole = in_processes(run_ours, [(scene, frames) for scene in scenes])
    torn = in_processes(run_ours, [(scene, frames, tearing) for scene in scenes])
    mantaflow = [run_mantaflow(scene, frames) for scene in scenes]
    return [
        Column(scene, runs)
        for scene, runs in zip(scenes, zip(whole, mantaflow, torn, strict=True), strict=True)
    ]


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="the picture")
    parser.add_argument("--resolution", type=int, default=LOCAL_CELLS, help="cells along the box")
    parser.add_argument("--frames", type=int, default=FRAMES, help=f"at {FPS} a second")
    args = parser.parse_args()
    if blender_command() is None:
        print("There is no Blender: run 'make blender' as root or set BLENDER.", file=sys.stderr)
        return 1
    draw(simulate(args.resolution, args.frames), args.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
