# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_window.py in a Blender with a window: the buttons as a user presses them.

Steps are a generator that yields conditions; a timer resumes it once the condition holds, so
that Blender's main loop, and with it the modal operators, goes on between them.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

import liquid_splash_addon
from liquid_splash_addon.blender.data.properties import to_settings
from liquid_splash_addon.blender.jobs import (
    compose,
    generate,
    loaded_generator,
    refine,
    scheduler,
    work_queue,
)
from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.blender.scene.targets import Target
from liquid_splash_addon.core.refinement.presets import BARE
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import TubeGenerator, add_sketch, fan, line, splashes


class SlowGenerator(TubeGenerator):
    """Takes long enough to be interrupted."""

    seconds = 0.0

    def generate(self, *inputs, **options):
        time.sleep(self.seconds)
        return super().generate(*inputs, **options)


GENERATOR = SlowGenerator()


def press(name: str) -> set[str]:
    """Run an operator as its button does, in the 3D viewport."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        space, operator = name.split(".")
        return getattr(getattr(bpy.ops, space), operator)("INVOKE_DEFAULT")


def key(kind: str) -> None:
    """Press and release a key over the 3D viewport."""
    window = bpy.context.window_manager.windows[0]
    x, y = window.width // 3, window.height // 2
    window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(kind, value, x=x, y=y)


def idle() -> bool:
    return work_queue.collecting() is None


def draw(start: str = BARE) -> bpy.types.Object:
    """Return a new sketch, in an otherwise empty file, as an undo step of its own.

    start : the refinements that its splash will start with
    """
    group = bpy.context.scene.splash
    group.settings.resolution, group.settings.real_size, group.start = "64", 0.32, start
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    sketch = add_sketch(fan())
    bpy.ops.ed.undo_push(message="Sketch")
    return sketch


def steps() -> Iterator[Condition]:
    """Check the buttons; every yield lets Blender run until the condition holds."""
    draw()
    GENERATOR.seconds = 1.0
    assert press("splash.generate") == {"RUNNING_MODAL"}
    assert not idle() and not splashes(), "Blender stays usable meanwhile"
    yield idle
    assert len(splashes()) == 1
    last = bpy.context.window_manager.operators[-1]
    assert last.bl_idname == "SPLASH_OT_generate", "the redo panel shows it"
    assert last.properties.resolution == "64", "with the settings that were used"
    press("ed.undo")
    assert not splashes() and len(bpy.context.scene.objects) == 1, "one undo step"
    press("ed.redo")
    assert len(splashes()) == 1

    for mode in ("PAINT_GREASE_PENCIL", "EDIT"):
        sketch = draw()
        bpy.ops.object.mode_set(mode=mode)
        bpy.ops.ed.undo_push(message="Mode")
        press("splash.generate")
        yield idle
        assert len(splashes()) == 1 and bpy.context.active_object.mode == mode
        press("ed.undo")
        assert not splashes() and bpy.context.active_object.mode == mode
        bpy.ops.object.mode_set(mode="OBJECT")

    draw()
    press("splash.generate")
    key("ESC")
    yield lambda: idle() or work_queue.collecting().is_stopping
    yield idle
    assert not splashes(), "Esc leaves nothing"

    sketch = draw()
    press("splash.generate")
    bpy.data.objects.remove(sketch)
    yield idle
    assert not splashes(), "a sketch that was deleted meanwhile"

    draw()
    press("splash.generate")
    yield idle
    (splash,) = splashes()
    before, mesh = len(splash.data.vertices), splash.data
    splash.splash.settings.real_size = 0.15
    press("splash.regenerate")
    yield idle
    assert splash.data == mesh and len(mesh.vertices) != before
    press("ed.undo")
    assert len(splashes()[0].data.vertices) == before

    press("splash.generate")
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield idle
    assert not splashes(), "another file was opened meanwhile"


def starting() -> Iterator[Condition]:
    """Check that a new splash is shown bare at once, then with its list; all is one undo step."""

    def is_refined() -> bool:
        (splash,) = splashes()
        return len(splash.data.vertices) != bare and not splash.splash_stack.pending

    draw("FRESH")
    press("splash.generate")
    yield idle
    (splash,) = splashes()
    bare = len(splash.data.vertices)
    assert [item.kind for item in splash.splash_stack.items] == ["DROPLETS", "SHEETS", "WAVES"]
    assert splash.splash_stack.pending and not splash.splash_stack.summary, "its list comes after"
    yield is_refined
    refined = len(splash.data.vertices)
    press("ed.undo")
    assert not splashes(), "one undo step"
    press("ed.redo")
    yield is_refined
    assert len(splashes()[0].data.vertices) == refined


def refining() -> Iterator[Condition]:
    """Check that the refinement list is live: by buttons, by sliders, through undo and redo."""
    draw()
    press("splash.generate")
    yield idle
    (splash,) = splashes()
    plain = len(splash.data.vertices)

    def is_evaluated() -> bool:
        (splash,) = splashes()
        now = refine.task_of(splash).key
        return splash.splash_stack.evaluated == now and not scheduler.stage_of(splash)

    def count() -> int:
        return len(splashes()[0].data.vertices)

    bpy.ops.ed.undo_push(message="Splash")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        bpy.ops.splash.refinement_add("EXEC_DEFAULT", True, kind="DROPLETS")
    assert count() == plain, "Blender does not wait"
    yield is_evaluated
    assert count() != plain
    item = splashes()[0].splash_stack.items[0]
    item.droplets.amount = 0.02
    item.droplets.size = 2.0  # before the first change was evaluated
    bpy.ops.ed.undo_push(message="Size")
    yield is_evaluated
    large = count()
    item.show = False
    yield is_evaluated
    assert count() == plain
    item.show = True
    yield is_evaluated
    assert count() == large
    while splashes()[0].splash_stack.items:
        press("ed.undo")
    yield is_evaluated
    assert count() == plain, "undo takes the refined mesh along"
    press("ed.redo")
    yield is_evaluated
    assert len(splashes()[0].splash_stack.items) == 1 and count() != plain
    splashes()[0].splash_stack.items[0].droplets.size = 1.0
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield lambda: True
    assert not splashes(), "another file was opened meanwhile"


def in_flight() -> Iterator[Condition]:
    """Change settings while a splash is made: nothing is lost, and the mesh is what they give."""
    draw()
    press("splash.generate")
    yield idle
    (splash,) = splashes()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.splash.refinement_add("EXEC_DEFAULT", True, kind="DROPLETS")
    yield lambda: not scheduler.stage_of(splash)
    assert press("splash.regenerate") == {"RUNNING_MODAL"}
    yield lambda: work_queue.running() is not None
    splash.splash.settings.seed, splash.splash.settings.variation = 7, 1.0
    splash.splash_stack.items[0].droplets.amount = 0.02
    yield idle
    yield lambda: not scheduler.stage_of(splash)
    settings = splash.splash.settings
    assert (settings.seed, settings.variation) == (7, 1.0)
    assert splash.splash_stack.evaluated == refine.task_of(splash).key
    mesh = np.empty((len(splash.data.vertices), 3), np.float32)
    splash.data.vertices.foreach_get("co", mesh.ravel())
    np.testing.assert_array_equal(mesh, directly(splash))

    # Applied while a change waits, and undone after it: the list is back, and what it gives.
    bpy.ops.ed.undo_push(message="Droplets")
    splash.splash_stack.items[0].droplets.seed = 5
    press("splash.refinement_apply")
    yield idle
    yield lambda: not scheduler.stage_of(splash)
    assert not splash.splash_stack.items
    applied = len(splash.data.vertices)
    press("ed.undo")
    (splash,) = splashes()
    yield lambda: not scheduler.stage_of(splashes()[0])
    (splash,) = splashes()
    assert len(splash.splash_stack.items) == 1
    press("ed.redo")
    yield lambda: not scheduler.stage_of(splashes()[0])
    assert len(splashes()[0].data.vertices) == applied


def directly(splash: bpy.types.Object) -> np.ndarray:
    """Return the vertices that a splash has by its strokes and settings, computed at once."""
    target = Target(splash.splash.sketch, splash, splash.splash.layer)
    request = generate.snapshot(bpy.context, target, to_settings(splash.splash.settings))
    return generate.compute(request, lambda stage, share: None).mesh.vertices


def mistaken() -> Iterator[Condition]:
    """Check that bad input is reported and keeps the mesh; undo and redo at each step."""
    draw()
    press("splash.generate")
    yield idle
    name = splashes()[0].name

    def splash() -> bpy.types.Object:
        return bpy.data.objects[name]

    def is_evaluated() -> bool:
        return not scheduler.stage_of(splash())

    def state() -> tuple[int, str, int]:
        stack = splash().splash_stack
        return len(splash().data.vertices), stack.warnings, len(stack.items)

    # No undo steps of the operators' own: one a change, pushed when it is evaluated.
    def nothing() -> None:
        """An empty list, evaluated."""
        bpy.ops.splash.refinement_update("EXEC_DEFAULT")

    def zero() -> None:
        bpy.ops.splash.refinement_add("EXEC_DEFAULT", kind="DROPLETS")
        splash().splash_stack.items[0].droplets.amount = 0.0

    def huge() -> None:
        item = splash().splash_stack.items[0].droplets
        item.amount, item.particles = 1.0, 300

    def swallowed() -> None:
        mesh = bpy.data.meshes.new("Box")
        corners = [(x, y, z) for x in (-9, 9) for y in (-9, 9) for z in (-9, 9)]
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        mesh.from_pydata(corners, [], quads)
        collection = bpy.data.collections.new("Obstacles")
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(bpy.data.objects.new("Box", mesh))
        splash().splash_obstacles.collection = collection

    window = bpy.context.window_manager.windows[0]
    bpy.ops.ed.undo_push(message="Splash")
    seen = [state()]
    for change in (nothing, zero, huge, swallowed):
        with bpy.context.temp_override(window=window):
            change()
        bpy.context.view_layer.update()
        yield is_evaluated
        bpy.ops.ed.undo_push(message=change.__name__)
        seen.append(state())
    plain, empty, none, many, gone = seen
    assert empty == plain and none[:2] == plain[:2] and none[2] == 1
    assert "Most Particles" in many[1] and many[0] != plain[0]
    assert "swallow the whole splash" in gone[1] and gone[0] == many[0], "the mesh stays"
    for name_of, wanted in (("undo", seen[-2::-1]), ("redo", seen[1:])):
        for then in wanted:
            press(f"ed.{name_of}")
            yield is_evaluated
            assert state() == then, (name_of, state(), then)

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield lambda: True


def joining() -> Iterator[Condition]:
    """Check that a model of two layers is live, and that deleting it gives the splashes back."""

    def model() -> bpy.types.Object:
        return next(item for item in bpy.context.scene.objects if item.splash_model.is_model)

    def is_evaluated() -> bool:
        now = compose.task_of(model()).key
        return model().splash_model.evaluated == now and not scheduler.stage_of(model())

    def hidden() -> list[bool]:
        return [item.hide_viewport and item.hide_render for item in splashes()]

    sketch = draw()
    layer = sketch.data.layers.new("Second")
    layer.frames.new(bpy.context.scene.frame_current)
    add_strokes(sketch, [line((0.5, -0.6, 0), (0.5, 0.6, 0))], layer)
    bpy.ops.ed.undo_push(message="Layer")
    assert press("splash.generate_layers") == {"RUNNING_MODAL"}
    yield idle
    assert len(splashes()) == 2 and hidden() == [False, False], "until the model shows them"
    yield is_evaluated
    assert hidden() == [True, True] and bpy.context.active_object == model()
    count = len(model().data.vertices)
    assert count > 0
    bpy.ops.ed.undo_push(message="Model")
    settings = model().splash_model.settings
    settings.blend = 0.5
    settings.mirror_x = True  # before the first change was evaluated
    yield is_evaluated
    assert len(model().data.vertices) > 1.5 * count
    settings.blend, settings.mirror_x = 2.0, False
    yield is_evaluated
    assert len(model().data.vertices) == count
    part = model().splash_model.parts[1].splash  # the active one, which the panels show
    part.splash.settings.surface_threshold = 0.2
    assert press("splash.regenerate") == {"RUNNING_MODAL"}
    yield idle
    yield is_evaluated
    assert len(model().data.vertices) != count, "it follows its splashes"
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        bpy.ops.object.delete("EXEC_DEFAULT", True)
    yield lambda: hidden() == [False, False]
    press("ed.undo")
    yield lambda: hidden() == [True, True]
    yield is_evaluated
    while splashes():
        press("ed.undo")
    yield lambda: True
    assert len(bpy.context.scene.objects) == 1
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield lambda: True


def everything() -> Iterator[Condition]:
    """Check it all."""
    yield from steps()
    yield from starting()
    yield from refining()
    yield from in_flight()
    yield from mistaken()
    yield from joining()


if __name__ == "__main__":
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(run(everything()), first_interval=1.0, persistent=True)
