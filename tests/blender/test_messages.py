# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages that no test of what they are about provokes: each is said where its cause is."""

from types import SimpleNamespace

import bpy
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.jobs import compile_ahead, dependencies, work_queue
from liquid_splash_addon.blender.scene import places
from liquid_splash_addon.blender.scene.objects import SceneError
from tests.blender.sketching import add_sketch, fan, generate, line

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
