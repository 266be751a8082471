# SPDX-License-Identifier: GPL-3.0-or-later
"""Before and after composition, symmetry and obstacles, as in the paper's Figs. 1, 11 and 13.

python scripts/make_models.py --out docs/images/models.png
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
import make_demo as demo
import numpy as np
import scene as table
from figurine import add_dancer
from materials import pour
from mathutils import Vector
from PIL import Image

import liquid_splash_addon
from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.blender.ui.sketch_presets import property_name
from liquid_splash_addon.core.refinement.presets import BARE
from training.figures.picture import contact_sheet, titled

FRONT = Vector((0.06, 1.0, -0.23)).normalized()
ABOVE = Vector((0.25, 1.0, -0.55)).normalized()

UPRIGHT, LEANING = (0.0, -np.pi / 2, 0.0), (0.0, -0.95, 0.0)
BODY = (
    ((0.0, 0.0, -0.05), UPRIGHT, {"length": 1.0, "height": 0.0, "thickness": 0.12}),
    ((0.2, 0.0, 0.68), LEANING, {"length": 0.8, "height": 0.12, "thickness": 0.06}),
)
"""Place, turn and shape of the streamlets that are a butterfly's body and antenna."""

KNEES = -1.3
"""Height below which the dancer is not to be seen."""

Shots = Iterator[str]


def main() -> None:
    """Render all shots into one sheet."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/models.png"))
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--size", type=int, nargs=2, default=(480, 360), metavar="PIXELS")
    parser.add_argument("--only", choices=SUBJECTS, nargs="+", default=list(SUBJECTS))
    options = parser.parse_args()
    liquid_splash_addon.register()
    pictures = []
    for name in options.only:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        pictures += [shot(title) for title in SUBJECTS[name](options)]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    contact_sheet(pictures, columns=2).save(options.out, optimize=True)


def shot(title: str) -> Image.Image:
    """Return a picture of the scene as it is, with a title."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shot.png"
        demo.render(path)
        print(title, flush=True)
        return titled(Image.open(path).convert("RGB"), title)


def butterfly(options: argparse.Namespace) -> Shots:
    """Mirror what makes up one side: two wings, body, antenna."""
    sketch = add_sketch("BUTTERFLY", asymmetry=0.15, lift=25.0)
    for layer in sketch.data.layers:
        layer.hide = layer.name.startswith("Left")
    model = generate_layers()
    for place, turn, shape in BODY:
        add_sketch("STREAMLET", place, turn, asymmetry=0.0, **shape)
        add_to(model, generate(real_size=0.2))
    refine(model)
    # Ripples all over the wings: flat water shows little.
    model.splash_model.waves.reach = 0.3
    pour(model, "ink")
    settings = model.splash_model.settings
    settings.blend = 5.0
    settings.mirror_x = True
    set_table(model, options, FRONT, margin=0.15, glow=studio.WARM)
    settings.mirror_x = False
    yield "wings, body, antenna: a splash each"
    settings.mirror_x = True
    yield "one model, mirrored (Fig. 1)"


def heart(options: argparse.Namespace) -> Shots:
    """Pour a streamlet of wine into a heart of wine."""
    add_sketch("HEART", asymmetry=0.1, pour=1.4, thickness=0.22)
    model = generate_layers()
    pour(model, "wine")
    model.splash_model.settings.blend = 5.0
    set_table(model, options, FRONT, margin=0.15, glow=studio.WARM)
    splashes = [part.splash for part in model.splash_model.parts]
    # Of another colour at first, so that one sees where it ends in the heart.
    streamlet = splashes[1].data.materials
    streamlet[0] = streamlet[0].copy()
    pour(splashes[1], "rose")
    show_only(splashes, [model])
    yield "heart and streamlet: a splash each"
    show_only([model], splashes)
    refine(model)
    yield "blended and refined (Fig. 13)"


def skirt(options: argparse.Namespace) -> Shots:
    """Dress a dancer in milk, and look at the dress without her."""
    figures = bpy.data.collections.new("Figures")
    bpy.context.scene.collection.children.link(figures)
    dancer = add_dancer(figures)
    sketch = add_sketch("SKIRT", (0.0, 0.0, 0.2), asymmetry=0.3, width=2.6, height=1.1)
    splash = generate()
    bpy.ops.splash.refinement_preset(preset="MILK")
    pour(splash, "milk")
    joints = table.world_points(dancer)
    around = np.concatenate([table.world_points(splash), joints[joints[:, 2] > KNEES]])
    demo.set_table(around, options.samples, options.size, margin=0.15)
    lines = demo.show_strokes(sketch, 0.02)
    show_only([dancer, *lines], [splash])
    yield "a figure, and strokes"
    dress(splash, figures)
    show_only([dancer, splash], lines)
    yield "milk around the figure (Fig. 11)"
    close = studio.widened(table.world_points(splash), 0.1)
    scene = bpy.context.scene
    studio.add_camera(scene, scene.collection, close, ABOVE, studio.LENS)
    show_only([splash], [dancer])
    dress(splash, None)
    yield "the milk alone, without obstacle"
    dress(splash, figures)
    yield "with the figure as its obstacle"


def fountain(options: argparse.Namespace) -> Shots:
    """Set copies of one splash around an axis."""
    add_sketch("STREAMLET", asymmetry=0.2, length=1.6, height=1.3, thickness=0.18)
    splash = generate()
    bpy.ops.splash.combine()
    model = bpy.context.active_object
    # Aside, so that the stream begins at the model's axis.
    splash.location.x += 0.85
    bpy.ops.splash.model_update()
    refine(model)
    settings = model.splash_model.settings
    settings.blend = 4.0
    settings.count = 10
    set_table(model, options, ABOVE)
    settings.count = 1
    yield "one splash"
    settings.count = 10
    yield "ten copies around an axis"


SUBJECTS: dict[str, Callable[[argparse.Namespace], Shots]] = {
    "butterfly": butterfly,
    "heart": heart,
    "skirt": skirt,
    "fountain": fountain,
}
"""What sets up a scene, and yields a title whenever there is something to render."""


def add_sketch(
    preset: str,
    place: Sequence[float] = (0.0, 0.0, 0.0),
    turn: Sequence[float] = (0.0, 0.0, 0.0),
    **controls: Any,
) -> bpy.types.Object:
    """Return a preset sketch, active, at a place and turned by Euler angles."""
    controls = {property_name(preset, name): value for name, value in controls.items()}
    bpy.ops.splash.preset_sketch(preset=preset, **controls)
    sketch = bpy.context.active_object
    sketch.location, sketch.rotation_euler = place, turn
    bpy.context.view_layer.update()
    return sketch


def generate(**settings: Any) -> bpy.types.Object:
    """Return the splash of the active sketch, active."""
    bpy.ops.splash.generate(start=BARE, **settings)
    return bpy.context.active_object


def generate_layers() -> bpy.types.Object:
    """Return the model of the active sketch's layers, active."""
    bpy.context.scene.splash.start = BARE
    bpy.ops.splash.generate_layers()
    return bpy.context.active_object


def add_to(model: bpy.types.Object, splash: bpy.types.Object) -> None:
    """Add a splash to a model."""
    model.select_set(True)
    splash.select_set(True)
    bpy.ops.splash.combine()


def refine(model: bpy.types.Object) -> None:
    """Give each splash of a model drops, and the model waves."""
    bpy.context.view_layer.objects.active = model
    group = model.splash_model
    for number in range(len(group.parts)):
        group.active = number
        bpy.ops.splash.refinement_preset(preset="FRESH")
    group.use_waves = True


def dress(splash: bpy.types.Object, figures: bpy.types.Collection | None) -> None:
    """Make the splash anew, around the figures."""
    splash.splash_obstacles.collection = figures
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()


def set_table(
    item: bpy.types.Object, options: argparse.Namespace, view: Vector, **more: Any
) -> None:
    """Put table, lights and camera around an object."""
    demo.set_table(table.world_points(item), options.samples, options.size, view, **more)


def show_only(shown: Sequence[bpy.types.Object], hidden: Sequence[bpy.types.Object]) -> None:
    """Render some objects and not others."""
    for item in (*shown, *hidden):
        item.hide_render = item in hidden


if __name__ == "__main__":
    main()
