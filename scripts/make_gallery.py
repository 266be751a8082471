# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that an artist could use, each from strokes to render: docs/gallery.md.

    python scripts/make_gallery.py --out docs/images/gallery

Every subject is drawn, generated and refined by the add-on's own operators. --liquid clay renders
all of them dull, to judge their shapes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
import make_demo as demo
import make_models as models
import numpy as np
import scene as table
from figurine import add_dancer
from glassware import add_bottle, add_tumbler
from materials import pour
from mathutils import Vector
from PIL import Image

import liquid_splash_addon
from liquid_splash_addon.blender.data.refinements import add_step
from liquid_splash_addon.blender.jobs import refine
from liquid_splash_addon.blender.scene import sketch as sketches
from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.core.refinement.presets import PRESETS
from liquid_splash_addon.core.refinement.settings import WaveSettings
from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.sketch.presets import HAND_SPEED, draw
from liquid_splash_addon.core.sketch.presets.ribbons import ribbon
from training.evaluation.letters import LETTERS
from training.figures.picture import contact_sheet, titled

FRONT, ABOVE, SIDE = models.FRONT, models.ABOVE, demo.VIEW
AHEAD = Vector((-0.75, 0.8, -0.3)).normalized()
"""Towards what flows along +x: into the curl of a wave."""

Look = dict[str, Any]
"""How a subject is shown: its liquid, the view and the glow behind it."""


def main() -> None:
    """Render the subjects, each into a file of its own, and all into one sheet."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/gallery"))
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--size", type=int, nargs=2, default=(480, 360), metavar="PIXELS")
    parser.add_argument("--only", choices=SUBJECTS, nargs="+", default=list(SUBJECTS))
    parser.add_argument("--liquid", default="", help="for all of them, for example clay")
    parser.add_argument("--sheet", type=Path, help="a picture of all of them")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    liquid_splash_addon.register()
    pictures = []
    for name in options.only:
        pictures.append(titled(picture(name, options), SUBJECTS[name].__doc__.split(".")[0]))
    if options.sheet:
        options.sheet.parent.mkdir(parents=True, exist_ok=True)
        contact_sheet(pictures, columns=4).save(options.sheet)


def picture(name: str, options: argparse.Namespace) -> Image.Image:
    """Return the picture of a subject, and write it to the folder."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    item, look = SUBJECTS[name]()
    liquid = options.liquid or look.get("liquid", "water")
    pour(item, liquid)
    points = [table.world_points(each) for each in (item, *look.get("beside", ()))]
    around = np.concatenate(points)
    around = around[around[:, 2] > look.get("from_height", -np.inf)]
    demo.set_table(
        around, options.samples, options.size, look.get("view", SIDE), margin=0.16,
        glow=look.get("glow", studio.BLUE),
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shot.png"
        demo.render(path)
        made = Image.open(path).convert("RGB")
    made.save(options.out / f"{name}.webp", quality=82, method=6)
    print(f"{name}: {liquid}", flush=True)
    return made


def splash(preset: str, reach: float = 0.0, **controls: Any):
    """Return the refined splash of a preset sketch, or the model of its layers.

    reach : the setting *Keep Near*, m; 0 for none.
    """
    sketch = models.add_sketch(preset, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), **controls)
    return refined(sketch, **({"reach": reach} if reach else {}))


def refined(sketch: bpy.types.Object, waves: bool = True, **settings: Any):
    """Return the splash of a sketch with the list Fresh, or the model of its layers.

    waves : without them for liquids that are too thick for any.
    """
    bpy.context.view_layer.objects.active = sketch
    if len(sketch.data.layers) > 1:
        model = models.generate_layers()
        for part in model.splash_model.parts if settings else ():
            for name, value in settings.items():
                setattr(part.splash.splash.settings, name, value)
            bpy.context.view_layer.objects.active = part.splash
            bpy.ops.splash.regenerate()
        model.splash_model.settings.blend = 4.0
        models.refine(model)
        return model
    made = models.generate(**settings)
    made.splash_stack.items.clear()
    for step in PRESETS["FRESH"].steps:
        if waves or not isinstance(step, WaveSettings):
            add_step(made, step)
    refine.evaluate(made)
    return made


def sketch_of(*layers: list[np.ndarray], speed: float = HAND_SPEED) -> bpy.types.Object:
    """Return a sketch of paths ``(n, 3)``, a layer for each list of them."""
    names = [f"Splash {n + 1}" for n in range(len(layers))]
    item = sketches.new_sketch(bpy.context, layers=names)
    for name, paths in zip(names, layers, strict=True):
        drawings: list[Drawing] = [draw(path, speed) for path in paths]
        sketches.add_strokes(item, drawings, item.data.layers[name])
    return item


def crown():
    """Crown."""
    return splash("CROWN"), {}


def jet():
    """Jet that lands, and its rim."""
    return splash("JET", asymmetry=0.35), {"view": ABOVE}


def streamlet():
    """Streamlet of juice."""
    return splash("STREAMLET"), {"liquid": "juice", "view": ABOVE, "glow": studio.WARM}


def sheet():
    """Water out of a cup."""
    return splash("SHEET", asymmetry=0.4), {"view": Vector((-0.5, 1.0, -0.9)).normalized()}


def wave():
    """Wave."""
    return splash("WAVE"), {"view": AHEAD}


def ligaments():
    """Wave that was drawn slowly."""
    made = models.add_sketch("WAVE")
    item = refined(made, speed_source="CONSTANT", stroke_speed=0.22)
    return item, {"view": AHEAD}


def heart():
    """Heart of wine."""
    return splash("HEART", 0.016, asymmetry=0.1, pour=0.7), {
        "liquid": "wine",
        "view": FRONT,
        "glow": studio.WARM,
    }


def butterfly():
    """Butterfly of ink."""
    look = {"liquid": "ink", "view": FRONT, "glow": studio.WARM}
    model = splash("BUTTERFLY", asymmetry=0.15)
    turn = (0.0, -np.pi / 2, 0.0)
    body = {"length": 1.0, "height": 0.0, "thickness": 0.12, "asymmetry": 0.0, "jags": 0.0}
    models.add_sketch("STREAMLET", (0.0, 0.0, -0.05), turn, **body)
    models.add_to(model, models.generate(real_size=0.2))
    return model, look


def letter_s():
    """Letter S."""
    return splash("LETTER_S"), {"view": FRONT}


def dancer():
    """Dancer dressed in milk."""
    figures = bpy.data.collections.new("Figures")
    bpy.context.scene.collection.children.link(figures)
    body = add_dancer(figures)
    sketch = models.add_sketch("SKIRT", (0.0, 0.0, 0.2), asymmetry=0.3, width=2.6, height=1.1)
    made = refined(sketch)
    models.dress(made, figures)
    return made, {"liquid": "milk", "beside": (body,), "from_height": models.KNEES}


def bottle_pour():
    """Stream around a bottle."""
    glass = bpy.data.collections.new("Bottle")
    bpy.context.scene.collection.children.link(glass)
    bottle = add_bottle(glass, diameter=0.56, height=2.1, place=(0.0, 0.0, -0.25))
    made = splash("BOTTLE_POUR", height=1.4)
    models.dress(made, glass)
    return made, {"beside": (bottle,), "view": FRONT}


def collision():
    """Two streams that meet."""
    return splash("COLLISION"), {"view": Vector((-0.75, 1.0, -0.25)).normalized()}


def wine():
    """Letters of wine."""
    letters, x = [], 0.0
    for letter in "WINE":
        lines = [np.array(line, dtype=float) for line in LETTERS[letter]]
        wide = max(line[:, 0].max() for line in lines) - min(line[:, 0].min() for line in lines)
        letters.append([path for line in lines for path in pen_line(line + [x, 0.0])])
        x += wide + 0.3
    item = sketch_of(*letters, speed=2.0)
    look = {"liquid": "wine", "view": FRONT, "glow": studio.WARM}
    return refined(item, reach=0.014), look


def pen_line(line: np.ndarray) -> list[np.ndarray]:
    """Return strokes of a broad pen along a line ``(n, 2)`` of a letter one unit high."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = np.linspace(0, along[-1], 64)
    flat = np.stack([np.interp(places, along, line[:, axis]) for axis in range(2)], axis=1)
    # A hand rounds corners.
    for _ in range(6):
        flat[1:-1] = (flat[:-2] + 2 * flat[1:-1] + flat[2:]) / 4
    return ribbon(np.insert(flat, 1, 0.0, axis=1), np.full(64, 0.12), 4, (0.06, 0.06))


def thrown():
    """After a photograph: a glass is emptied to the side, and its water stretches to a tongue."""
    share = np.linspace(0, 1, 96)
    centre = np.stack(
        [2.2 * share - 1.1, 0.1 * np.sin(3 * share), 0.55 * np.sin(2.6 * share) + 0.1], axis=1
    )
    width = 0.22 + 0.62 * share**1.6 * (1.1 - 0.3 * share)
    paths = ribbon(centre, width, 9, (0.02, 0.17), 0.35, 0.2)
    glass = bpy.data.collections.new("Glass")
    bpy.context.scene.collection.children.link(glass)
    item = sketch_of(paths)
    tumbler = add_tumbler(glass, diameter=0.42, height=0.62, place=(-1.5, 0.0, -0.05), lean=1.25)
    return refined(item), {"beside": (tumbler,), "view": ABOVE}


def coronet():
    """After a photograph: a drop has fallen into milk, and a coronet of points stands up."""
    sketch = models.add_sketch(
        "CROWN", asymmetry=0.12, points=10, width=1.9, height=0.7, base=0.72, jags=0.35
    )
    return refined(sketch), {"liquid": "milk", "view": ABOVE}


def whip():
    """After a photograph: paint is flung off a brush and hangs in the air as a whip."""
    share = np.linspace(0, 1, 128)
    angle = -0.6 + 5.2 * share
    radius = 0.35 + 0.75 * share
    centre = np.stack(
        [radius * np.cos(angle), 0.5 * share - 0.25, 0.8 * radius * np.sin(angle)], axis=1
    )
    width = 0.12 + 0.4 * np.sin(np.pi * share) ** 1.5 + 0.1 * share
    paths = ribbon(centre, width, 7, (0.0, 0.45), 0.2, 0.08)
    made = refined(sketch_of(paths), waves=False)
    return made, {"liquid": "paint", "view": FRONT, "glow": studio.WARM}


SUBJECTS: dict[str, Callable[[], tuple[bpy.types.Object, Look]]] = {
    maker.__name__: maker
    for maker in (
        crown, jet, streamlet, sheet, wave, ligaments, heart, butterfly, letter_s, dancer,
        bottle_pour, collision, wine, thrown, coronet, whip,
    )
}  # fmt: skip
"""What sets up a scene and returns the liquid in it and how it is shown; its first line is the
title. Three are of sketches after described photographs of splashes (paper, Fig. 15)."""


if __name__ == "__main__":
    main()
