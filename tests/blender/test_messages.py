# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages that no test of what they are about provokes: each is said where its cause is."""

from functools import partial
from types import SimpleNamespace

import bpy
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.capture import hands
from liquid_splash_addon.blender.jobs import (
    compile_ahead,
    dependencies,
    loaded_generator,
    work_queue,
)
from liquid_splash_addon.blender.jobs import generate as generate_job
from liquid_splash_addon.blender.scene import frame_folder, places
from liquid_splash_addon.blender.scene.objects import Handle, SceneError, check_writable
from liquid_splash_addon.blender.ui import vr_panel
from liquid_splash_addon.blender.ui.queued_operator import QueuedOperator
from tests.blender.modelling import layered
from tests.blender.sketching import TubeGenerator, add_sketch, fan, generate, line

pytestmark = pytest.mark.once


def refused(operator, /, **options: object) -> str:
    """Return why an operator cannot be run, or fails."""
    with pytest.raises(RuntimeError) as refusal:
        operator(**options)
    return str(refusal.value)


def test_objects_that_cannot_be_selected_say_where_they_are(capfd):
    lost = bpy.data.objects.new("Lost", None)
    assert "is gone: it was deleted" in refused(bpy.ops.splash.select_named, name="Nobody")
    said = refused(bpy.ops.splash.select_named, name=lost.name)
    assert "is not in this view layer: show its collection no collection" in said
    bpy.context.scene.collection.objects.link(lost)
    lost.hide_set(True)
    assert bpy.ops.splash.select_named(name=lost.name) == {"FINISHED"}
    assert "is hidden: show it in the Outliner" in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        (Matrix.Diagonal((1, 0, 1, 1)), "is scaled to zero: clear its scale first"),
        (Matrix(((1, 1, 0, 0), (1, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))), "is sheared flat"),
    ],
)
def test_a_place_that_cannot_be_undone_is_named(matrix, said):
    with pytest.raises(SceneError, match=f"'Sketch' {said}"):
        places.inverted(matrix, "Sketch")


def test_models_want_splashes():
    add_sketch(fan())
    assert "Select splashes, or a sketch that has splashes" in refused(bpy.ops.splash.combine)
    assert "Select a model first" in refused(bpy.ops.splash.model_update)


def test_layers_without_strokes_are_nothing_to_generate():
    sketch = add_sketch(fan())
    for layer in sketch.data.layers:
        layer.hide = True
    assert "has no visible layer with strokes: draw one first" in refused(
        bpy.ops.splash.generate_layers
    )


def test_tools_say_in_which_mode_and_of_how_many_strokes():
    add_sketch([line((0, 0, 0), (1, 0, 1))])
    assert "needs 2 strokes, here is 1: draw or select another one" in refused(
        bpy.ops.splash.stroke_fill
    )
    bpy.ops.object.mode_set(mode="WEIGHT_GREASE_PENCIL")
    assert "Switch to Object, Edit or Draw Mode" in refused(bpy.ops.splash.stroke_reverse)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_where_all_strokes_can_be_used_none_is_selected(tubes, capfd):
    add_sketch(fan())
    generate()
    assert bpy.ops.splash.select_strokes() == {"CANCELLED"}
    assert "All strokes can be used" in "".join(capfd.readouterr())


def test_what_is_in_use_is_neither_freed_nor_cleared(monkeypatch):
    monkeypatch.setattr(work_queue, "running", lambda: SimpleNamespace())
    for operator in (bpy.ops.splash.free_memory, bpy.ops.splash.clear_cache):
        assert "A splash is being made: wait for it, or stop it" in refused(operator)
    monkeypatch.setattr(compile_ahead, "running", lambda: SimpleNamespace())
    assert "Code is being compiled: wait until the Splash" in refused(bpy.ops.splash.clear_cache)
    monkeypatch.setattr(dependencies, "missing_packages", lambda: ["torch"])
    assert "Packages are missing" in refused(bpy.ops.splash.test_device)


def test_copies_say_what_to_do_with_them(capfd):
    bpy.ops.splash.copy_report()
    bpy.ops.splash.copy_install_command()
    said = "".join(capfd.readouterr())
    assert "Report copied: paste it into the bug report" in said
    assert "Command copied. Run it in a terminal, then restart Blender" in said


TAP = line((0, 0, 0), (0, 0, 0))
"""A stroke without length."""


def test_weights_and_formats_other_than_last_time_are_told(monkeypatch):
    maker = TubeGenerator()
    monkeypatch.setattr(loaded_generator, "get", lambda *_: maker)
    add_sketch(fan())
    splash = generate()
    assert not splash.splash.warnings
    maker.weights_hash, maker.precision = "another", "bfloat16"
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    first, second = splash.splash.warnings.split("\n")
    assert first == "Made with another network than last time: the splash may look different"
    assert second.startswith("Made in the format bfloat16: float32 is not available on this device")


def test_where_no_stroke_is_left_the_first_reason_is_told(tubes):
    sketch = add_sketch(fan())
    sketch.data.layers[0].lock = True
    assert "No stroke is left to make a splash of. " in refused(bpy.ops.splash.generate)


def test_an_error_stays_as_long_as_nothing_has_changed(tubes):
    sketch = add_sketch(fan())
    generate()
    ask = partial(generate_job.check, (Handle.of(sketch), None, "", ()), {}, False)
    target = generate_job.found(Handle.of(sketch), None, "", ())
    settings = generate_job.SplashSettings(
        **vars(generate_job.to_settings(bpy.context.scene.splash.settings))
    )
    digest = generate_job.snapshot(bpy.context, target, settings).digest
    with pytest.raises(SceneError, match="Nothing has changed since it could not be made"):
        ask(digest)
    ask("of something else")


def test_a_layer_that_gives_no_splash_is_named_beside_the_others(tubes, capfd):
    sketch = layered(fan(), [TAP])
    bpy.context.scene.splash.settings.resolution = "64"
    generate_layers_of = bpy.ops.splash.generate_layers
    bpy.context.view_layer.objects.active = sketch
    assert generate_layers_of() == {"FINISHED"}
    said = "".join(capfd.readouterr())
    assert "1 layer(s) made, 0 unchanged" in said
    assert "Layer 'B': None of the" in said


def test_selected_strokes_of_a_locked_layer_are_not_worked_on():
    sketch = add_sketch(fan())
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.grease_pencil.select_all(action="SELECT")
    sketch.data.layers[0].lock = True
    assert ": the selected strokes are in it" in refused(bpy.ops.splash.stroke_reverse)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_curves_without_a_curve_ask_for_one():
    item = bpy.data.objects.new("Curves", bpy.data.hair_curves.new("Curves"))
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    assert "Draw a curve first: there is none in this object" in refused(
        bpy.ops.splash.stroke_reverse
    )


def test_strokes_without_length_are_selected_and_counted(tubes, capfd):
    add_sketch([*fan(), TAP])
    assert bpy.ops.splash.select_strokes() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "Selected 1 stroke(s) that cannot be used" in "".join(capfd.readouterr())


def test_what_is_no_mesh_any_more_cannot_be_written():
    curve = bpy.data.objects.new("Splash", bpy.data.curves.new("Splash", "CURVE"))
    with pytest.raises(SceneError, match="'Splash' is no longer a mesh: make a new splash from"):
        check_writable(curve)


def test_a_liquid_that_cannot_be_changed_stays_and_a_copy_says_when_it_moves(tubes, capfd):
    add_sketch(fan())
    splash = generate()
    bpy.context.scene.frame_set(7)
    assert bpy.ops.splash.two_pose_mesh() == {"FINISHED"}
    assert ": moves from frame 6 to 8" in "".join(capfd.readouterr())
    bpy.context.view_layer.objects.active = splash
    splash.shape_key_add()
    assert bpy.ops.splash.liquid(liquid="HONEY") == {"CANCELLED"}
    said = "".join(capfd.readouterr())
    assert "remove them first. It stays as it is" in said


def test_frames_of_an_unsaved_file_stay_where_they_are(tubes, tmp_path, monkeypatch):
    add_sketch(fan())
    splash = generate()
    assert "Save the file first" in refused(bpy.ops.splash.simulation_keep)
    splash.splash_simulation.folder = str(tmp_path)

    def fails(_folder: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(frame_folder, "delete", fails)
    said = refused(bpy.ops.splash.simulation_delete)
    assert f"The frames in {tmp_path} cannot be deleted (Permission denied)" in said
    assert splash.splash_simulation.folder == str(tmp_path), "they are known still"


def test_esc_says_that_nothing_was_changed():
    told = []
    operator = QueuedOperator()
    operator.report = lambda kinds, text: told.append((kinds, text))
    assert operator.stopped() == {"CANCELLED"}
    assert told == [({"INFO"}, "Stopped: nothing was changed")]


def test_a_session_that_is_ending_is_waited_for(monkeypatch):
    told = []
    monkeypatch.setattr(hands, "is_ending", lambda _context: True)
    operator = SimpleNamespace(poll_message_set=told.append)
    context = SimpleNamespace()
    has_xr = bpy.app.build_options.xr_openxr
    assert not vr_panel.SPLASH_OT_vr_drawing.poll.__func__(operator, context)
    assert told == ["The last VR session is still ending" if has_xr else vr_panel.NO_XR]
