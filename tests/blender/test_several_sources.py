# SPDX-License-Identifier: GPL-3.0-or-later
"""Several objects as one sketch: Grease Pencil and curves of every kind, mixed."""

import json

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.scene import targets
from liquid_splash_addon.core.refinement.stored_splash import StoredSplash
from tests.blender.sketching import add_sketch, fan, generate, in_world, line, splashes
from tests.blender.test_curves import new_curves, old_curve

pytestmark = pytest.mark.usefixtures("tubes")


def select(active, *others):
    """Select objects; the first becomes active."""
    for item in bpy.context.selected_objects:
        item.select_set(False)
    for item in (active, *others):
        item.select_set(True)
    bpy.context.view_layer.objects.active = active


def three():
    """Return a Grease Pencil sketch, an old and a new curve, apart from each other."""
    sketch = add_sketch(fan(), Matrix.Translation((1, 0, 0)))
    old = old_curve("BEZIER", matrix=Matrix.Translation((0, 2, 0)))
    return sketch, old, new_curves(count=2, matrix=Matrix.Translation((0, -2, 0)))


def strokes_in(splash):
    """Return how many strokes a splash was made of."""
    from liquid_splash_addon.blender.data import stored_liquid

    return len(StoredSplash.from_bytes(stored_liquid.read(splash.data)[0]).strokes)


def test_selected_objects_are_one_sketch():
    sketch, old, new = three()
    select(sketch, old, new)
    splash = generate()
    assert splash.splash.sketch == sketch
    assert {entry.sketch for entry in splash.splash.others} == {old, new}
    assert strokes_in(splash) == len(fan()) + 1 + 2
    points = in_world(splash)
    assert points[:, 1].max() > 2 and points[:, 1].min() < -1.9


def test_each_of_them_finds_the_splash_again_and_none_makes_a_second():
    items = three()
    select(*items)
    splash = generate()
    for item in items:
        select(item)
        assert targets.shown_splash(bpy.context) == splash
        assert bpy.ops.splash.regenerate() == {"FINISHED"}
    select(items[2], items[0], items[1])
    assert bpy.ops.splash.generate() == {"FINISHED"}
    assert splashes() == [splash] and splash.splash.sketch == items[0]
    assert strokes_in(splash) == 9


def test_a_change_of_any_of_them_is_followed_and_nothing_else_changes_the_key():
    bpy.context.scene.splash.follow = False
    sketch, old, new = three()
    select(sketch, old, new)
    splash = generate()
    keys = [splash.splash.made_of]
    select(splash)

    def again():
        assert bpy.ops.splash.regenerate() == {"FINISHED"}
        keys.append(splash.splash.made_of)
        return keys[-1] != keys[-2]

    assert not again()
    old.location.z += 0.5
    assert again()
    new.data.attributes["position"].data[0].vector = (0, 0, 0.3)
    assert again()
    for item in (sketch, old, new):
        item.location.x += 1
    bpy.context.view_layer.update()
    assert strokes_in(splash) == 9
    place = in_world(splash).mean(axis=0)
    bpy.ops.splash.regenerate()
    np.testing.assert_allclose(in_world(splash).mean(axis=0) - place, (1, 0, 0), atol=0.05)


def test_a_sketch_has_a_splash_alone_beside_that_with_others():
    sketch, old, _ = three()
    select(sketch, old)
    both = generate()
    select(old)
    assert targets.shown_splash(bpy.context) == both
    for item in bpy.context.selected_objects:
        item.select_set(False)
    select(sketch, old)
    assert targets.find_target(bpy.context).splash == both
    other = add_sketch([line((0, 0, 0), (0, 1, 3)), line((0, 1, 0), (1, 1, 2))])
    select(sketch, other)
    assert targets.find_target(bpy.context).splash is None
    generate()
    assert len(splashes()) == 2


def test_what_was_deleted_is_left_out_with_a_warning():
    sketch, old, new = three()
    select(sketch, old, new)
    splash = generate()
    bpy.data.objects.remove(new)
    bpy.context.collection.objects.unlink(old)
    select(splash)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    assert strokes_in(splash) == len(fan())
    assert "1 object(s) of the sketch were deleted" in splash.splash.warnings


def test_a_saved_file_remembers_all_of_them(tmp_path):
    select(*three())
    generate()
    path = str(tmp_path / "several.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    (splash,) = splashes()
    select(splash)
    before = splash.splash.made_of
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    assert splash.splash.made_of == before and strokes_in(splash) == 9


def test_export_writes_what_is_selected_or_all_that_a_splash_is_made_of(tmp_path):
    sketch, old, new = three()
    select(sketch, old, new)
    splash = generate()
    for count, chosen in ((9, (splash,)), (1, (old,)), (3, (old, new)), (6, (sketch,))):
        select(*chosen)
        path = tmp_path / f"{count}.json"
        assert bpy.ops.splash.export_strokes(filepath=str(path)) == {"FINISHED"}
        assert len(json.loads(path.read_text())["strokes"]) == count


def test_undo_and_redo_keep_them():
    items = three()
    select(*items)
    bpy.ops.ed.undo_push(message="selected")
    generate()
    bpy.ops.ed.undo_push(message="made")
    bpy.ops.ed.undo()
    assert splashes() == []
    bpy.ops.ed.redo()
    (splash,) = splashes()
    assert len(targets.others_of(splash)) == 2
