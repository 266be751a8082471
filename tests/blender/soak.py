# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes made again and again in one process: memory stays flat, no data is left.

python -m tests.blender.soak [--rounds N] [--seconds S] [--out FILE]

A round changes the strokes, makes the splash anew by the real weights, refines it by another list
and is an undo step. Every other one changes it live too (by the queue, in a thread), and every
fifth has a model of two layers joined again. No round is begun after some seconds. FILE gets the
figures, as JSON, for docs/reliability.md.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import time
from pathlib import Path

import bpy
import numpy as np

from liquid_splash_addon.blender.jobs import draft_then_full, live, work_queue
from liquid_splash_addon.core.refinement.presets import PRESETS
from tests.blender.fuzzed_scene import unused
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import add_sketch, fan, generate

ROUNDS = 300
HUNDRED = 100

GROWTH = 0.02
"""Of the memory that may be added by a hundred rounds, after the warm-up."""

PARTS = 10
"""Of a run, at whose ends its memory is told."""


class Soak:
    """The scene and what a round does to it."""

    def __init__(self) -> None:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.context.preferences.edit.undo_steps = 16
        bpy.context.scene.splash.settings.resolution = "64"
        self.model = generate_layers(crossing())
        self.sketch = add_sketch(fan())
        self.splash = self.made()

    def made(self) -> bpy.types.Object:
        """Return the splash of the sketch."""
        bpy.context.view_layer.objects.active = self.sketch
        before = {item.name for item in bpy.data.objects}
        generate()
        return next(item for item in bpy.data.objects if item.name not in before)

    def round(self, number: int) -> None:
        """Do all that a round is."""
        bpy.context.view_layer.objects.active = self.splash
        self.nudge(0.004 * (-1) ** number)
        assert bpy.ops.splash.regenerate(seed=number, variation=0.5) == {"FINISHED"}
        names = sorted(PRESETS)
        preset = names[number % len(names)]
        assert bpy.ops.splash.refinement_preset(preset=preset) == {"FINISHED"}
        if number % 2 == 0:
            self.nudge(0.003 * (-1) ** (number // 2))
            self.follow()
        if number % 5 == 0:
            self.model.splash_model.settings.blend = 1.0 + number % 4 / 4
        bpy.ops.ed.undo_push(message=str(number))

    def follow(self) -> None:
        """Make the splash as it follows the hand in a window, by the queue."""
        is_immediate = work_queue.is_immediate
        work_queue.is_immediate = lambda: False  # type: ignore[assignment]
        bpy.context.scene.splash.live = True
        try:
            live.look()
            while work_queue.tick() is not None or is_waiting():
                time.sleep(0.001)
        finally:
            bpy.context.scene.splash.live = False
            work_queue.is_immediate = is_immediate
        making = draft_then_full.making()
        assert making is not None and making.stage == "done", live.said()

    def nudge(self, by: float) -> None:
        """Move the strokes a little against each other, as an edit does."""
        drawing = self.sketch.data.layers[0].current_frame().drawing
        values = np.empty(len(drawing.attributes["position"].data) * 3, dtype=np.float32)
        drawing.attributes["position"].data.foreach_get("vector", values)
        values[::3] *= 1 + by
        drawing.attributes["position"].data.foreach_set("vector", values)
        self.sketch.data.update_tag()
        bpy.context.view_layer.update()


def is_waiting() -> bool:
    """Whether the queue has more to do."""
    return work_queue.is_waiting() or work_queue.running() is not None


def memory() -> int:
    """Return the bytes that this process has in memory."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def soak(rounds: int, seconds: float = float("inf")) -> dict[str, object]:
    """Do the rounds, as far as the seconds last, and return the figures."""
    begun, scene, sizes = time.monotonic(), Soak(), []
    counts = []
    for number in range(rounds):
        if time.monotonic() - begun > seconds:
            break
        scene.round(number)
        sizes.append(memory())
        counts.append(sum(len(getattr(bpy.data, kind)) for kind in ("meshes", "objects")))
    warm = min(HUNDRED, len(sizes) // 2)
    slope, _ = np.polyfit(np.arange(warm, len(sizes)), sizes[warm:], 1)
    ends = sorted({(part + 1) * len(sizes) // PARTS - 1 for part in range(PARTS)} - {-1})
    return {
        "blender": bpy.app.version_string,
        "rounds": len(sizes),
        "seconds": round(time.monotonic() - begun),
        "megabytes": {str(end + 1): round(sizes[end] / 2**20, 1) for end in ends},
        "warm": warm,
        "growth": round(float(slope) * HUNDRED / sizes[warm], 4),
        "orphans": len(unused()),
        "more_data": counts[-1] - counts[0],
    }


def main() -> int:
    """Do what the command line says."""
    import liquid_splash_addon

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path)
    wanted = parser.parse_args()
    liquid_splash_addon.register()
    came = soak(wanted.rounds, wanted.seconds)
    print(f"soak: {came}", flush=True)
    if wanted.out is not None:
        wanted.out.parent.mkdir(parents=True, exist_ok=True)
        wanted.out.write_text(json.dumps(came))
    is_flat = came["growth"] < GROWTH  # type: ignore[operator]
    return int(not (is_flat and came["orphans"] == came["more_data"] == 0))


if __name__ == "__main__":
    os._exit(main())
