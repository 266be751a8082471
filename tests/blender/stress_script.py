# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_stress.py in a Blender with a window: random changes with work in flight.

    blender --python tests/blender/stress_script.py -- CHANGES SEED

After the last change and when the queue is empty, every mesh must be what its settings give.
"""

import os
import random
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

import liquid_splash_addon
from liquid_splash_addon.blender.data.model import is_model
from liquid_splash_addon.blender.data.properties import is_splash
from liquid_splash_addon.blender.jobs import compose, loaded_generator, refine, work_queue
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import add_sketch, fan, line
from tests.blender.window_script import GENERATOR, key, press

KINDS = ("DROPLETS", "RUPTURES", "WAVES", "CLEANUP")
OBJECTS_MOST = 10
"""Splashes and models beyond which copies are deleted again."""


class Stress:
    """Random changes to a file."""

    def __init__(self, seed: int) -> None:
        self.dice = random.Random(seed)
        self.done: list[str] = []
        self.refused = 0
        self.path = str(Path(tempfile.mkdtemp()) / "stress.blend")
        self.ways: list[Callable[[], object]] = [
            self.generate, self.regenerate, self.regenerate, self.layers, self.setting, self.add,
            self.setting, self.add, self.slider, self.slider, self.eye, self.remove, self.apply,
            self.drops, self.preset, self.undo, self.undo, self.redo, self.duplicate,
            self.duplicate, self.delete, self.model_setting, self.stroke, self.update,
        ]  # fmt: skip

    def change(self) -> None:
        """Make one change; what cannot be done now is refused by Blender with a RuntimeError."""
        rare = self.dice.random()
        way = self.reopen if rare < 0.02 else self.escape if rare < 0.04 else None
        way = way or self.dice.choice(self.ways)
        self.done.append(way.__name__)
        try:
            way()
        except RuntimeError as error:
            if "Traceback" in str(error):
                raise
            self.refused += 1

    def objects(self) -> list[bpy.types.Object]:
        """List the splashes and models in the scene."""
        scene = bpy.context.scene
        return [item for item in scene.objects if is_splash(item) or is_model(item)]

    def splash(self) -> bpy.types.Object | None:
        """Activate a random splash, or else the sketch, and return the splash."""
        found = [item for item in self.objects() if is_splash(item)]
        chosen = self.dice.choice(found) if found else self.sketch()
        self.activate(chosen)
        return chosen if found else None

    def sketch(self) -> bpy.types.Object:
        """Return the sketch; draw one if there is none."""
        for item in bpy.context.scene.objects:
            if item.type == "GREASEPENCIL":
                return item
        return add_sketch(fan())

    def activate(self, item: bpy.types.Object) -> None:
        """Make an object the only one selected; hidden parts of models can be active too."""
        for other in bpy.context.view_layer.objects:
            other.select_set(False)
        bpy.context.view_layer.objects.active = item
        if not item.hide_viewport:
            item.select_set(True)

    def push(self) -> None:
        """End an undo step, as Blender does after each thing a user does."""
        bpy.ops.ed.undo_push(message=self.done[-1])

    def generate(self) -> None:
        self.activate(self.sketch())
        press("splash.generate")

    def regenerate(self) -> None:
        if self.splash() is not None:
            press("splash.regenerate")

    def layers(self) -> None:
        self.activate(self.sketch())
        press("splash.generate_layers")

    def setting(self) -> None:
        splash = self.splash()
        if splash is not None:
            settings = splash.splash.settings
            settings.seed, settings.variation = self.dice.randrange(99), self.dice.random()
            self.push()

    def add(self) -> None:
        splash = self.splash()
        if splash is not None and len(splash.splash_stack.items) < 4:
            self.call("refinement_add", kind=self.dice.choice(KINDS))

    def slider(self) -> None:
        splash = self.splash()
        if splash is not None and splash.splash_stack.items:
            item = self.dice.choice(list(splash.splash_stack.items))
            group = item.group
            name = "seed" if hasattr(group, "seed") else "amplitude"
            setattr(group, name, self.dice.randrange(9) if name == "seed" else 0.001)
            self.push()

    def eye(self) -> None:
        splash = self.splash()
        if splash is not None and splash.splash_stack.items:
            item = self.dice.choice(list(splash.splash_stack.items))
            item.show = not item.show
            self.push()

    def remove(self) -> None:
        if self.splash() is not None:
            self.call("refinement_remove")

    def apply(self) -> None:
        if self.splash() is not None:
            press("splash.refinement_apply")

    def drops(self) -> None:
        if self.splash() is not None:
            press("splash.drop_points")

    def preset(self) -> None:
        if self.splash() is not None:
            self.call("refinement_preset", preset=self.dice.choice(("FRESH", "FINGERS")))

    def update(self) -> None:
        if self.splash() is not None:
            self.call("refinement_update")

    def undo(self) -> None:
        press("ed.undo")

    def redo(self) -> None:
        press("ed.redo")

    def duplicate(self) -> None:
        found = self.objects()
        if found and len(found) < OBJECTS_MOST:
            self.activate(self.dice.choice(found))
            self.call_object("duplicate")

    def delete(self) -> None:
        found = self.objects()
        if len(found) > 4:
            self.activate(self.dice.choice(found))
            self.call_object("delete")

    def model_setting(self) -> None:
        found = [item for item in self.objects() if is_model(item)]
        if found:
            self.dice.choice(found).splash_model.settings.blend = self.dice.uniform(0, 3)
            self.push()

    def stroke(self) -> None:
        from liquid_splash_addon.blender.scene.sketch import add_strokes

        x = self.dice.uniform(-0.5, 0.5)
        sketch = self.sketch()
        add_strokes(sketch, [line((x, -0.5, 0.0), (x + 0.1, 0.5, 0.2))], sketch.data.layers[0])
        self.push()

    def escape(self) -> None:
        key("ESC")

    def reopen(self) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)

    def call(self, name: str, **options: object) -> None:
        """Run one of our operators with an undo step of its own."""
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            getattr(bpy.ops.splash, name)("EXEC_DEFAULT", True, **options)

    def call_object(self, name: str) -> None:
        """Run one of Blender's operators with an undo step, without which undo may crash."""
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            getattr(bpy.ops.object, name)("EXEC_DEFAULT", True)

    def wrong(self) -> list[str]:
        """Name the objects whose mesh is not what their settings give, computed directly."""
        refine.free()
        compose.free()
        return [item.name for item in self.objects() if not is_right(item)]


def is_right(item: bpy.types.Object) -> bool:
    """Whether a mesh is what the settings of its object give."""
    module, record = (
        (refine, item.splash_stack) if is_splash(item) else (compose, item.splash_model)
    )
    try:
        task = module.task_of(item)
        mesh = module.compute(task, lambda stage, share: None).mesh
    except ValueError:
        return bool(record.warnings)  # it stays as it was, and says why
    vertices = np.empty((len(item.data.vertices), 3), np.float32)
    item.data.vertices.foreach_get("co", vertices.ravel())
    is_same = record.evaluated == task.key and np.array_equal(vertices, mesh.vertices)
    if not is_same:
        print(f"{item.name}: {vertices.shape} for {mesh.vertices.shape}", flush=True)
        print(f"said {record.evaluated}, wanted {task.key}", flush=True)
    return is_same


def steps(changes: int, seed: int) -> Iterator[Condition]:
    """Make the changes, wait until nothing is left to do, and look at every mesh."""
    bpy.context.scene.splash.settings.resolution = "64"
    bpy.context.scene.splash.settings.real_size = 0.32
    stress = Stress(seed)
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    stress.activate(stress.sketch())
    bpy.ops.ed.undo_push(message="Sketch")
    stress.generate()
    yield is_idle
    for number in range(changes):
        GENERATOR.seconds = stress.dice.choice((0.0, 0.1, 0.5))
        stress.change()
        if stress.dice.random() < 0.5:
            yield lambda: True
        if number % 50 == 49:
            yield is_idle
            wrong = stress.wrong()
            assert not wrong, f"{wrong} after {stress.done[-50:]}"
            count = len(stress.objects())
            told = f"{number + 1} changes, {stress.refused} refused, {count} objects"
            print(f"stress: {told}", flush=True)
    yield is_idle
    wrong = stress.wrong()
    assert not wrong, f"{wrong} after {stress.done}"


def is_idle() -> bool:
    """Whether the queue has nothing left to do."""
    return work_queue.running() is None and not work_queue.is_waiting()


if __name__ == "__main__":
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.edit.undo_steps = 64
    wanted, first = (int(word) for word in sys.argv[sys.argv.index("--") + 1 :])
    print(os.getpid(), flush=True)
    bpy.app.timers.register(run(steps(wanted, first)), first_interval=1.0, persistent=True)
