# SPDX-License-Identifier: GPL-3.0-or-later
"""What each figure of the benchmarks means, and with what it is compared on the page.

Seconds and bytes say little of another machine; their ratio to something measured beside them does.
"""

from __future__ import annotations

from typing import NamedTuple


class Figure(NamedTuple):
    """A figure of ``out/bench.json``.

    Attributes
    ----------
    meaning : what was measured, for the page
    unit : of the number; "" for a ratio, which needs no other beside it
    over : the figure that it is divided by, or a number in the same unit
    beside : what that is, for the page
    """

    meaning: str
    unit: str = ""
    over: str | float = ""
    beside: str = ""


FIGURES = {
    "synthesis.seconds_128": Figure(
        "strokes to mesh, the example crown, 128^3, median of 5", "s",
        "synthesis.paper_network_seconds_128", "of the paper's network alone",
    ),
    "synthesis.seconds_64": Figure(
        "the same as a 64^3 draft", "s", "synthesis.seconds_128", "of full resolution",
    ),
    "synthesis.peak_mb": Figure(
        "peak memory of a process that makes one splash at 128^3", "MB",
        5 * 4 * 128**3 / 1e6, "times the fields of a whole box (42 MB)",
    ),
    "synthesis.network_seconds_128": Figure(
        "our networks alone, one whole box at 128^3, in the fastest format", "s",
        "synthesis.paper_network_seconds_128", "of the paper's network",
    ),
    "synthesis.paper_network_seconds_128": Figure(
        "the paper's network, the same (its encoder in eight bits too; torch has no transposed "
        "convolution in eight bits)", "s",
        "synthesis.network_seconds_128", "times ours",
    ),
    "synthesis.speedup_over_paper_net": Figure("the second over the first"),
    "refinement.seconds_default": Figure(
        "the default refinements (droplets and waves) of the crown at 128^3, nothing kept from "
        "before, code already compiled", "s",
        "synthesis.seconds_128", "of the splash itself",
    ),
    "refinement.seconds_fresh": Figure(
        "the preset Fresh Water (droplets, sheets and waves), the same", "s",
        "refinement.seconds_default", "times droplets and waves alone",
    ),
    "refinement.seconds_sheets": Figure(
        "sheets of the crown's surface at 128^3", "s",
        "refinement.seconds_default", "of the default refinements",
    ),
    "refinement.seconds_sheet_slider": Figure(
        "one slider of sheets changed, fingers included", "s",
        "refinement.seconds_sheets", "of all sheets",
    ),
    "refinement.seconds_wave_slider": Figure(
        "one wave slider of it changed", "s", "refinement.seconds_default", "of all refinements",
    ),
    "simulation.speedup_over_mantaflow_128": Figure(
        "two scenes of 128^3 cells and 40 frames: Mantaflow's time (one after the other, 2 "
        "threads) over ours (both at once, a core each)",
    ),
    "simulation.seconds_128": Figure(
        "ours, both scenes", "s", "simulation.mantaflow_seconds_128", "of Mantaflow's",
    ),
    "simulation.mantaflow_seconds_128": Figure(
        "Mantaflow, both scenes", "s", "simulation.seconds_128", "times ours",
    ),
    "simulation.box_256_over_64_time": Figure(
        "time for a step of the same liquid in a box of 256^3 cells, over that in one of 64^3",
    ),
    "simulation.box_256_over_64_memory": Figure(
        "the same for the memory that the run adds to the process",
    ),
    "simulation.halved_cells_time_ratio": Figure(
        "how much longer a step takes with cells half as large, over how many more cells hold "
        "liquid",
    ),
    "animation.seconds_crown_60": Figure(
        "the example crown above a floor, 60 frames at 24 fps and 1/20 speed, 128^3, with meshes "
        "and files, 2 cores", "s",
        2.5, "times the film's own length (2.5 s)",
    ),
    "animation.seconds_crown_60_full_speed": Figure(
        "the same at full speed, 2.5 s of the liquid's time, most of which it lies on the floor or "
        "has left the box", "s",
        2.5, "times the film's own length (2.5 s)",
    ),
    "animation.speedup_over_mantaflow": Figure(
        "the crown above a floor for 12 frames in 159^3 cells, from the same particles: two scenes "
        "of ours at once over twice Mantaflow's time (2 threads), no meshes",
    ),
    "animation.speedup_alone": Figure("the same, one scene of ours, on one core"),
    "animation.seconds_crown_12": Figure(
        "ours alone, these frames", "s",
        "animation.mantaflow_seconds_crown_12", "of Mantaflow's",
    ),
    "animation.mantaflow_seconds_crown_12": Figure(
        "Mantaflow, these frames", "s", "animation.seconds_crown_12", "times ours",
    ),
    "animation.centres_apart": Figure(
        "greatest distance of both centres of mass in these frames, over the splash's size",
    ),
    "interface.longest_stall_ms": Figure(
        "longest time for which Python's lock or one of our calls held Blender's window while a "
        "splash was made and refined at 128^3, 800 by 600 pixels, drawn by the processor", "ms",
        50.0, "of the 50 ms that are felt",
    ),
    "interface.longest_stall_ms_while_compiling": Figure(
        "the same while another process compiles", "ms", 50.0, "of 50 ms",
    ),
    "interface.first_splash_stall_ms": Figure(
        "the same for the first splash of a process: ours", "ms", 50.0, "of 50 ms",
    ),
    "interface.import_stall_ms": Figure(
        "and by imports of libraries", "ms", 50.0, "times 50 ms",
    ),
    "interface.first_splash_seconds": Figure(
        "the first splash of a new process, compiled before, 128^3, imports included", "s",
        "interface.first_splash_imports_seconds", "times the imports in it",
    ),
    "interface.first_refined_seconds": Figure(
        "until it also has the films, drops and waves that new splashes start with", "s",
        "interface.first_splash_seconds", "times that",
    ),
    "interface.first_splash_imports_seconds": Figure(
        "the imports in it", "s", "interface.first_splash_seconds", "of that first splash",
    ),
    "capture.live_seconds": Figure(
        "from the release of the pen until the draft is in the viewport, drawn by the processor",
        "s", "synthesis.seconds_64", "times the draft alone",
    ),
    "capture.live_stall_ms": Figure(
        "longest stall meanwhile", "ms", 50.0, "of 50 ms",
    ),
    "product.first_splash_seconds": Figure(
        "from the click to the first splash after installing, nothing compiled before, 128^3, in a "
        "window drawn by the processor", "s", 60.0, "of 60 s",
    ),
    "product.first_progress_still_seconds": Figure(
        "longest time for which its line of progress stands still", "s",
        "product.first_splash_seconds", "of all of it",
    ),
    "product.first_stall_ms": Figure(
        "longest stall meanwhile that is ours", "ms", 50.0, "of 50 ms",
    ),
    "product.new_blender_seconds": Figure(
        "the first splash of a new Blender later, besides imports", "s", 3.0, "of 3 s",
    ),
    "product.again_seconds": Figure("one more", "s", 0.5, "of 0.5 s"),
    "interface.panel_draw_ms_8": Figure(
        "drawing all panels of the tab, in a file of 8 objects", "ms",
        "interface.panel_draw_ms_8000", "of 8,000 objects",
    ),
    "interface.panel_draw_ms_8000": Figure(
        "the same in a file of 8,000", "ms", "interface.panel_draw_ms_8", "of 8 objects",
    ),
    "interface.panel_draw_ms_8000_over_8": Figure("the second over the first"),
    "interface.handler_ms_8": Figure(
        "what the add-on does after every change of the scene, 8 objects", "ms",
        1000 / 60, "of a frame of 1/60 s",
    ),
    "interface.handler_ms_8000": Figure(
        "the same, 8,000 objects", "ms", 1000 / 60, "of a frame of 1/60 s",
    ),
    "interface.undo_ms_8000_50": Figure(
        "what the add-on does in one Ctrl+Z, 8,000 objects and 50 splashes", "ms",
        50.0, "of 50 ms",
    ),
    "interface.undo_piece_ms_8000_50": Figure(
        "the longest piece of what it does after that, in timers", "ms", 20.0, "of 20 ms",
    ),
    "interface.search_ms_8": Figure(
        "one search of all objects, 8 of them", "ms", 1000 / 60, "of a frame of 1/60 s",
    ),
    "interface.search_ms_8000": Figure(
        "the same, 8,000 objects", "ms", 1000 / 60, "of a frame of 1/60 s",
    ),
}  # fmt: skip
"""All figures that the page explains; others are listed by their names, without a ratio."""
