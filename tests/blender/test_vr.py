# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing in virtual reality: in a real session, where Monado can be had, and what needs none."""

import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.capture import action_set, bindings, feedback, vr_drawing
from liquid_splash_addon.blender.capture.bindings import CONTROLLERS, DRAW, HANDS
from liquid_splash_addon.blender.data.capture import SplashCaptureGroup
from liquid_splash_addon.blender.jobs import draft_then_full, work_queue
from liquid_splash_addon.blender.scene import world_strokes
from liquid_splash_addon.blender.ui import vr_panel
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.sketch.drawing import Drawing
from tests.blender.sketching import add_sketch, fan, line, splashes
from tests.blender.test_panels import drawn
from tests.blender.vr_motion import RECORDING

HARNESS = Path(__file__).with_name("vr_harness.py")
SCRIPT = Path(__file__).with_name("vr_script.py")
SKIP = 77

needs_program = pytest.mark.skipif(
    not bpy.app.binary_path or bpy.app.version < (5, 1), reason="needs a Blender program of 5.1"
)


def play(*scenes: str) -> None:
    """Play scenes in a Blender with a window and a VR runtime."""
    command = [sys.executable, HARNESS, bpy.app.binary_path, SCRIPT, *scenes]
    environment = {**os.environ, "VR_SECONDS": "900"}
    done = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    if done.returncode == SKIP:
        pytest.skip(done.stdout.strip().split("\n")[-1])
    lines = [text for text in done.stdout.split("\n") if text.startswith("vr: ")]
    print("\n".join(lines))
    assert "vr: works" in lines and "Traceback" not in done.stdout, done.stdout


@needs_program
def test_one_draws_undoes_and_generates():
    play("one_stroke")


@needs_program
@pytest.mark.slow
def test_both_hands_navigation_the_stock_add_on_and_a_runtime_that_dies():
    play("two_hands", "stock", "killed")


@needs_program
@pytest.mark.slow
def test_strokes_of_a_person_are_drawn_as_they_were():
    if not RECORDING.exists():
        pytest.skip(f"{RECORDING.name} is not here")
    play("recorded")


class Items(list):
    """A collection as the session's action maps have it, with what of it is used here."""

    def __init__(self, make) -> None:
        super().__init__()
        self.make = make

    def new(self, name: str, _replace: bool = False) -> SimpleNamespace:
        """Add an item."""
        self.append(self.make(name))
        return self[-1]

    def find(self, *words: object) -> SimpleNamespace | None:
        """Return the item of a name."""
        return next((item for item in self if item.name == words[-1]), None)


def map_item(name: str) -> SimpleNamespace:
    """Return an empty action."""
    return SimpleNamespace(
        name=name,
        type="FLOAT",
        op="",
        pose_is_controller_grip=False,
        pose_is_controller_aim=False,
        user_paths=Items(lambda path: SimpleNamespace(path=path)),
        bindings=Items(
            lambda name: SimpleNamespace(
                name=name,
                profile="",
                component_paths=Items(lambda path: SimpleNamespace(path=path)),
            )
        ),
    )


def empty_map() -> SimpleNamespace:
    """Return an empty action map."""
    return SimpleNamespace(name="", actionmap_items=Items(map_item))


def bound(made) -> dict[tuple[str, str, str], str]:
    """Return what each input of a map does: (profile, hand, path) to the name of the action."""
    return {
        (binding.profile, hand.path, path.path): item.name
        for item in made.actionmap_items
        for binding in item.bindings
        for hand, path in zip(item.user_paths, binding.component_paths, strict=True)
    }


def test_a_map_of_our_own_has_poses_and_all_buttons():
    made = empty_map()
    action_set.add_poses(made)
    action_set.add_buttons(made)
    inputs = bound(made)
    for controller in CONTROLLERS.values():
        for hand, path in enumerate(HANDS):
            for kind in ("grip", "aim"):
                assert inputs[controller.profile, path, f"/input/{kind}/pose"]
            for action, paths in controller.inputs.items():
                if paths[hand]:
                    name = inputs[controller.profile, path, paths[hand]]
                    assert name == bindings.name_of(action, hand)
    assert action_set.has_poses(made)


def test_what_was_on_our_inputs_rests_and_the_rest_stays():
    profile = CONTROLLERS["TOUCH"].profile
    made = empty_map()
    stock = {
        "teleport": "/input/trigger/value",
        "reset": "/input/a/click",
        "fly": "/input/thumbstick/y",
        "grab": "/input/squeeze/value",
    }
    for name, path in stock.items():
        item = action_set.new_item(made, name, "FLOAT", HANDS)
        action_set.bind(item, "oculus", profile, [path, path])
    action_set.leave_out_conflicts(made)
    assert {item.name for item in made.actionmap_items} == {"fly", "grab"}
    action_set.add_buttons(made)
    assert len(bound(made)) == len(set(bound(made)))


def test_controllers_of_extensions_are_left_out_unless_they_are_switched_on():
    made = empty_map()
    item = action_set.new_item(made, "teleport", "FLOAT", HANDS)
    action_set.bind(item, "huawei", "/interaction_profiles/huawei/controller", ["/a/b"] * 2)
    action_set.bind(item, "oculus", CONTROLLERS["TOUCH"].profile, ["/input/a/click"] * 2)
    action_set.leave_out_extensions(made)
    assert [binding.name for binding in item.bindings] == ["oculus"]


def test_every_controller_draws_with_both_hands_and_is_described():
    chosen = SplashCaptureGroup.bl_rna.properties["controller"].enum_items
    assert [item.identifier for item in chosen] == list(CONTROLLERS)
    for kind, controller in CONTROLLERS.items():
        assert all(controller.inputs[DRAW])
        rows = dict(bindings.described(kind))
        assert set(bindings.BUTTONS.values()) < set(rows) and all(rows.values())
    assert dict(bindings.described("TOUCH"))["Undo Stroke"] == "X (left), A (right)"
    assert dict(bindings.described("TOUCH"))["Speed Gain"] == "Press thumbstick"
    assert dict(bindings.described("VIVE"))["Generate Splash"] == "Menu (right)"


def test_without_a_session_nothing_is_drawn_and_the_panel_says_so():
    assert vr_drawing.current() is None and vr_drawing.look() is None
    vr_drawing.stop(bpy.context)
    shown = drawn(vr_panel.SPLASH_PT_vr)
    assert "No VR session" in shown or "without virtual reality" in shown
    for word in ("tip", "Trigger", "Undo Stroke"):
        assert word in shown
    handlers = bpy.app.handlers.xr_session_start_pre
    assert action_set.before_session in handlers and action_set.build not in handlers


def test_the_set_is_built_after_all_other_handlers_whatever_their_order(monkeypatch):
    handlers = bpy.app.handlers.xr_session_start_pre
    before = list(handlers)
    action_set.before_session()
    assert list(handlers) == [*before, action_set.build]
    action_set.build()  # as Blender calls it; there is no session here
    assert list(handlers) == before


def test_wet_ink_and_pens_go_when_drawing_ends():
    objects, collections = len(bpy.data.objects), len(bpy.data.collections)
    feedback.make(bpy.context)
    feedback.make(bpy.context)
    ours = [item for item in bpy.data.objects if feedback.is_ours(item)]
    assert len(ours) == 4 and all(item.hide_render for item in ours)
    assert bpy.context.active_object not in ours
    feedback.hide()
    assert len(bpy.data.objects) == objects and len(bpy.data.collections) == collections


def test_a_draft_comes_first_and_the_settings_stay(tubes):
    bpy.context.scene.splash.start = BARE
    bpy.context.scene.splash.settings.real_size = 0.32
    sketch = add_sketch(fan())
    told = []
    draft_then_full.request(bpy.context, told.append)
    # In the background nothing runs the queue's timer: its rounds are done by hand.
    counts = []
    end = time.monotonic() + 600
    while draft_then_full.making().is_busy and time.monotonic() < end:
        work_queue.tick()
        time.sleep(0.02)
        if splashes():
            counts.append(len(splashes()[0].data.vertices))
    (splash,) = splashes()
    assert counts[-1] > 2 * counts[0] > 0 and len(told) == 2
    assert splash.splash.settings.resolution == "128" and splash.splash.sketch == sketch
    draft_then_full.forget()


def test_a_newer_request_takes_the_place_of_an_older_one(tubes):
    bpy.context.scene.splash.settings.resolution = "64"
    add_sketch(fan())
    draft_then_full.request(bpy.context, lambda _: None)
    first = draft_then_full.making()
    draft_then_full.request(bpy.context, lambda _: None)
    assert first.entry.is_stopping and not first.is_busy
    draft_then_full.making().cancel()
    work_queue.stop()
    assert not splashes()


def test_the_last_stroke_is_found_again_wherever_the_sketch_stands():
    matrix = Matrix.LocRotScale((1, 2, 3), Matrix.Rotation(0.5, 3, "Z"), (2, 2, 2))
    sketch = add_sketch([line((0, 0, 0), (1, 0, 0))], matrix)
    drawing: Drawing = line((0, 0, 0), (0, 0, 1), points=20, pressure=0.5)
    bpy.context.view_layer.update()
    assert world_strokes.sketch_to_draw_on(bpy.context) == sketch
    written = world_strokes.write_stroke(bpy.context, sketch, drawing)
    layer = sketch.data.layers[0]
    inside = written.points @ world_strokes.layer_matrix(sketch, layer)[:3, :3].T
    assert abs(inside[-1] - inside[0] - (0, 0, 1)).max() < 1e-6
    strokes = layer.current_frame().drawing
    assert len(strokes.curve_offsets) == 3
    assert world_strokes.remove_stroke(written) and len(strokes.curve_offsets) == 2
    assert not world_strokes.remove_stroke(written), "it is gone already"
    layer.lock = True
    other = world_strokes.layer_to_draw_on(sketch, 1)
    assert other != layer and other.current_frame() is not None
