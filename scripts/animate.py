# SPDX-License-Identifier: GPL-3.0-or-later
"""Animate two splashes, with and without their velocity, as in the paper's Figs. 16 and 17.

    python scripts/animate.py crown letter_s --out docs/images --cache out/animation

Each is simulated by the project's own solver and by Blender's (Mantaflow), and rendered. What is
in the cache already is not made again: a run that was stopped goes on.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import animation_curves as curves
import animation_film as film
import bpy
import make_models as models
import numpy as np
import scene as table
from mathutils import Vector

import liquid_splash_addon
from liquid_splash_addon.blender.data.properties import assign_settings, plain
from liquid_splash_addon.blender.jobs import (
    bake_mantaflow,
    export_mantaflow,
    simulate,
    solver_start,
)
from liquid_splash_addon.core.animation.solver_start import SolverStart
from liquid_splash_addon.core.mantaflow.settings import MantaflowSettings
from liquid_splash_addon.core.progress import Report, silent
from liquid_splash_addon.core.simulation.frames import read_frame
from liquid_splash_addon.core.simulation.run import run
from liquid_splash_addon.core.simulation.settings import SimulationSettings
from tests.blender.manta_module import mend

FRAMES = 24
POOL_DEPTH = 0.02
"""Metres at real size."""

SOLVERS = ("ours", "mantaflow")
FLOWS = ("moving", "still")
"""With the splash's own velocity, and without any."""


@dataclass(frozen=True)
class Subject:
    """What is animated.

    Attributes
    ----------
    preset : of the sketch
    controls, settings : of the sketch and the splash
    pool : height of the pool's surface, Blender units
    view : where the camera looks
    liquid : inputs of the material
    width : of what the camera shows, over the splash's own width
    exposure : of the picture, stops
    """

    preset: str
    controls: dict[str, Any]
    settings: dict[str, Any]
    pool: float
    view: Vector
    liquid: dict[str, Any]
    width: float
    exposure: float


PAINT = models.MILK | {"Base Color": (0.75, 0.11, 0.07, 1.0), "Subsurface Weight": 0.05}

SUBJECTS = {
    "crown": Subject(
        "CROWN",
        {"asymmetry": 0.35},
        {"speed_source": "CONSTANT", "stroke_speed": 0.4},
        0.08,
        Vector((0.2, 1.0, -0.5)).normalized(),
        models.MILK,
        1.85,
        -1.05,
    ),
    "letter_s": Subject(
        "LETTER_S",
        {"asymmetry": 0.25},
        {"speed_source": "CONSTANT", "stroke_speed": 0.3, "reach": 0.02},
        -1.1,
        Vector((0.12, 1.0, -0.3)).normalized(),
        PAINT,
        1.7,
        -1.3,
    ),
}


class Place(NamedTuple):
    """Where a film's files are: in a folder of the cache, of one subject, solver and flow."""

    folder: Path
    subject: str
    solver: str
    flow: str

    def frame(self, number: int) -> Path:
        """Return the file of a frame's mesh."""
        return self.folder / f"mesh_{number:03d}.npz"


def main() -> None:
    """Run the command."""
    options = read_options()
    liquid_splash_addon.register()
    for name in options.subjects:
        wanted = [
            Place(options.cache / name / f"{solver}_{flow}", name, solver, flow)
            for solver, flow in product(options.solvers, FLOWS)
        ]
        for place in wanted:
            make_meshes(place, options)
        if options.no_pictures:
            continue
        for place in wanted:
            film.render_strip(place, SUBJECTS[name], options)
        if set(options.solvers) == set(SOLVERS):
            film.make_pictures(name, wanted, SUBJECTS[name], options)
    sys.stdout.flush()
    # Mantaflow in Blender's Python module cannot be taken down again.
    os._exit(0)


def read_options() -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("subjects", nargs="+", choices=SUBJECTS)
    parser.add_argument("--out", type=Path, default=Path("docs/images"), help="of the pictures")
    parser.add_argument("--cache", type=Path, default=Path("out/animation"), help="of the rest")
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--cells", type=int, default=96, help="of Mantaflow's domain")
    parser.add_argument("--resolution", default="96", help="of our solver, cells of the splash")
    parser.add_argument("--samples", type=int, default=12, help="of Cycles, per pixel")
    parser.add_argument("--size", type=int, nargs=2, default=(320, 240), metavar="PIXELS")
    parser.add_argument("--solvers", nargs="+", choices=SOLVERS, default=list(SOLVERS))
    parser.add_argument("--no-pictures", action="store_true", help="fill the cache, and no more")
    options = parser.parse_args()
    options.cache, options.out = options.cache.resolve(), options.out.resolve()
    return options


def make_meshes(place: Place, options: argparse.Namespace) -> None:
    """Simulate a film into files of its frames' meshes, unless they are there."""
    if all(place.frame(number).is_file() for number in range(options.frames + 1)):
        return
    print(f"{place.subject}: {place.solver}, {place.flow}", flush=True)
    place.folder.mkdir(parents=True, exist_ok=True)
    {"ours": by_ours, "mantaflow": by_mantaflow}[place.solver](place, options)


def open_splash(place: Place, options: argparse.Namespace) -> bpy.types.Object:
    """Return the splash of a subject, active, in a file of its own."""
    path = options.cache / place.subject / "splash.blend"
    if path.is_file():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        return next(item for item in bpy.data.objects if item.splash.summary)
    subject = SUBJECTS[place.subject]
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.render.fps = curves.FPS
    models.add_sketch(subject.preset, **subject.controls)
    splash = models.generate(**subject.settings)
    bpy.ops.splash.refinement_preset(preset="MILK")
    splash.splash_motion.time_scale = curves.TIME_SCALE
    points = table.world_points(splash)
    scale = solver_start.compute_start(solver_start.read_start(splash), silent).world.scale
    facts = {
        "centre": ((points.min(axis=0) + points.max(axis=0)) / 2).tolist(),
        "size": np.ptp(points, axis=0).tolist(),
        "length": scale.length,
        "pool": subject.pool,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    (path.parent / "facts.json").write_text(json.dumps(facts))
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    print(f"{place.subject}: {splash.splash.summary}, {facts}", flush=True)
    return splash


def start_of(task: solver_start.StartTask, flow: str, report: Report = silent) -> SolverStart:
    """Return what a solver starts from, its velocity taken away for the flow "still"."""
    made = solver_start.compute_start(task, report)
    if flow == "moving":
        return made
    liquid = replace(made.liquid, velocity=np.zeros_like(made.liquid.velocity))
    return replace(
        made, liquid=liquid, drops=made.drops._replace(velocities=0 * made.drops.velocities)
    )


def by_ours(place: Place, options: argparse.Namespace) -> None:
    """Simulate by the project's own solver."""
    splash, subject = open_splash(place, options), SUBJECTS[place.subject]
    settings = SimulationSettings(
        frames=options.frames, resolution=options.resolution, ground="POOL",
        ground_height=subject.pool, pool_depth=POOL_DEPTH, margin=0.6,
    )  # fmt: skip
    assign_settings(splash.splash_simulation.settings, settings)
    order = simulate.read_order(bpy.context, splash)
    made = start_of(order.start, place.flow)
    folder = place.folder / "frames"

    def tell(label: str, _share: float) -> None:
        print(f"{place.subject} {place.solver} {place.flow}: {label}", flush=True)

    run(simulate.start_of(order, made, []), settings, folder, tell)
    for number in range(options.frames + 1):
        frame = read_frame(folder, number)
        save_mesh(
            place.frame(number),
            made.world.points_to_drawing(frame.mesh.vertices.astype(np.float64)),
            frame.mesh.faces,
            made.world.points_to_drawing(frame.drops.positions.astype(np.float64)),
            made.world.scale.lengths_to_drawing(frame.drops.radii),
        )


def by_mantaflow(place: Place, options: argparse.Namespace) -> None:
    """Simulate by Blender's own solver: exported, baked or baked on, and read back."""
    path, subject = place.folder / "domain.blend", SUBJECTS[place.subject]
    if path.is_file():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        mend()
    else:
        splash = open_splash(place, options)
        bpy.ops.wm.save_as_mainfile(filepath=str(path) + ".part")
        mend()
        facts = curves.facts_of(place)
        settings = MantaflowSettings(
            resolution=options.cells, margin=0.4, frames=options.frames, ground="POOL",
            ground_height=subject.pool, pool_depth=POOL_DEPTH / facts["length"],
        )  # fmt: skip
        assign_settings(bpy.context.scene.splash_mantaflow.settings, settings)
        shutil.rmtree(place.folder / "splash_mantaflow", ignore_errors=True)
        task = export_mantaflow.read_task(bpy.context, splash, "domain")
        start = start_of(task.start, place.flow)
        made = export_mantaflow.stage(task, start, silent)
        domain = export_mantaflow.write(bpy.context, task, made, splash)
        print(domain.splash_domain.summary, flush=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    domain = next(item for item in bpy.data.objects if item.splash_domain.source)
    bake_mantaflow.bake(bpy.context, domain)
    print(domain.splash_domain.verified, flush=True)
    save_baked(place, domain, options.frames)


def save_baked(place: Place, domain: bpy.types.Object, frames: int) -> None:
    """Save the meshes of a domain that is baked."""
    first = plain(domain.splash_domain.frame)
    for number in range(frames + 1):
        bpy.context.scene.frame_set(first + number)
        graph = bpy.context.evaluated_depsgraph_get()
        shown = domain.evaluated_get(graph)
        mesh = shown.to_mesh()
        mesh.calc_loop_triangles()
        faces = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", faces.ravel())
        points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
        mesh.vertices.foreach_get("co", points.ravel())
        matrix = np.array(shown.matrix_world)
        save_mesh(
            place.frame(number), points @ matrix[:3, :3].T + matrix[:3, 3], faces,
            np.zeros((0, 3)), np.zeros(0),
        )  # fmt: skip
        shown.to_mesh_clear()


def save_mesh(path: Path, vertices: Any, faces: Any, drops: Any, radii: Sequence[float]) -> None:
    """Write a frame, whole or not at all."""
    part = path.with_suffix(".part.npz")
    np.savez_compressed(
        part, vertices=np.float32(vertices), faces=np.int32(faces), drops=np.float32(drops),
        radii=np.float32(radii),
    )  # fmt: skip
    part.replace(path)


if __name__ == "__main__":
    main()
