# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes and models are found at once among any number of objects, whatever happens to them."""

import random
from collections.abc import Iterator

import bpy
import pytest

from liquid_splash_addon.blender.data import index
from liquid_splash_addon.blender.data.model import is_model
from liquid_splash_addon.blender.data.properties import is_splash
from liquid_splash_addon.blender.scene import targets
from liquid_splash_addon.blender.scene.objects import select_only
from tests.blender.drawing_panels import FOREIGN_GROUPS, add_objects, draw_all
from tests.blender.modelling import crossing, generate_layers, the_model
from tests.blender.sketching import add_sketch, fan, generate

UNDO = ("undo", "redo")
STEPS = 150
"""Of a random walk."""


@pytest.fixture
def looks(monkeypatch) -> Iterator[list[int]]:
    """Count how often an object is looked at, and how often all of them are."""
    counts = [0, 0]
    carries, scan = index.carries, index.scan

    def counted_carries(*args):
        counts[0] += 1
        return carries(*args)

    def counted_scan():
        counts[1] += 1
        return scan()

    monkeypatch.setattr(index, "carries", counted_carries)
    monkeypatch.setattr(index, "scan", counted_scan)
    yield counts


def names() -> list[str]:
    """Return the names of the splashes that the index knows, after an update as Blender does it."""
    bpy.context.view_layer.update()
    return sorted(item.name for item in index.splashes())


def by_hand(name: str = "Splash", link: bool = True) -> bpy.types.Object:
    """Return an object that is marked as a splash, without a generator."""
    splash = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    if link:
        bpy.context.scene.collection.objects.link(splash)
    splash.splash.version = "1"
    return splash


def chosen(item: bpy.types.Object) -> bpy.types.Object:
    """Select an object alone, as a click does."""
    bpy.context.view_layer.update()
    select_only(bpy.context, item)
    return item


def test_panels_look_at_no_more_objects_where_there_are_many(tubes, looks):
    add_sketch(fan())
    generate()
    found = []
    for count in (0, 500):
        add_objects(count)
        draw_all()
        looks[:] = [0, 0]
        draw_all()
        found.append(list(looks))
    assert found[0] == found[1] and found[0][1] == 0


def test_moving_and_selecting_start_no_search(looks):
    splash = by_hand()
    add_objects(20)
    assert names() == ["Splash"]
    looks[:] = [0, 0]
    for step in range(5):
        splash.location.x = step
        chosen(bpy.data.objects["Other.003"]).location.y = step
        bpy.context.scene.frame_set(step)
        assert names() == ["Splash"]
    assert looks[1] == 0


def test_renamed_and_marked():
    splash = by_hand()
    assert names() == ["Splash"]
    splash.name = "Wave"
    assert names() == ["Wave"]
    by_hand("Foam")
    assert [item.name for item in index.splashes()] == ["Wave", "Foam"], "at once"
    splash.splash.version = ""
    assert names() == ["Foam"]


def test_removed_by_script_and_by_hand():
    for name in "ABC":
        by_hand(name)
    assert names() == ["A", "B", "C"]
    bpy.data.objects.remove(bpy.data.objects["A"])
    assert sorted(item.name for item in index.splashes()) == ["B", "C"], "at once"
    holder = bpy.data.objects.new("Holder", None)
    holder.splash.owner = bpy.data.objects["B"]
    chosen(bpy.data.objects["B"])
    assert bpy.ops.object.delete() == {"FINISHED"}
    assert names() == ["C"]
    assert "B" in bpy.data.objects and not index.is_in_scene(bpy.data.objects["B"])
    bpy.context.scene.collection.objects.link(bpy.data.objects["B"])
    assert names() == ["B", "C"]


def test_a_mesh_that_became_a_curve_is_no_splash():
    splash = by_hand()
    splash.data.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    assert names() == ["Splash"]
    chosen(splash)
    assert bpy.ops.object.convert(target="CURVE") == {"FINISHED"}
    assert names() == []


def test_copied():
    chosen(by_hand())
    assert names() == ["Splash"]
    assert bpy.ops.object.duplicate() == {"FINISHED"}
    assert names() == ["Splash", "Splash.001"]


def test_undone_and_redone():
    by_hand("A")
    bpy.ops.ed.undo_push(message="A")
    by_hand("B")
    bpy.ops.ed.undo_push(message="B")
    bpy.data.objects["A"].name = "C"
    bpy.ops.ed.undo_push(message="C")
    assert names() == ["B", "C"]
    bpy.ops.ed.undo()
    assert names() == ["A", "B"]
    bpy.ops.ed.undo()
    assert names() == ["A"]
    bpy.ops.ed.redo()
    assert names() == ["A", "B"]
    assert all(item == bpy.data.objects[item.name] for item in index.splashes())


def in_scenes() -> list[str]:
    """Return what :func:`names` should, by a walk through all objects."""
    bpy.context.view_layer.update()
    return sorted(item.name for item in bpy.data.objects if is_splash(item) and item.users_scene)


def test_any_edits_undone_and_redone_while_others_ask():
    """Edits are pushed for undo at once, as Blender's operators do."""

    def ask(*_):
        index.splashes()

    moments = [getattr(bpy.app.handlers, f"{do}_{when}") for do in UNDO for when in ("pre", "post")]
    for moment in moments:
        moment.append(ask)
    try:
        dice = random.Random(3)
        bpy.ops.ed.undo_push(message="start")
        for _ in range(STEPS):
            edit_by(dice)
            assert names() == in_scenes()
    finally:
        for moment in moments:
            moment.remove(ask)


def edit_by(dice: random.Random) -> None:
    """Add, remove, delete or rename a splash, or undo or redo that."""
    known = list(filter(None, bpy.context.view_layer.objects))
    choice = dice.choice(("add", "remove", "delete", "rename", *UNDO)) if len(known) > 3 else "add"
    if choice in UNDO:
        operator = getattr(bpy.ops.ed, choice)
        if operator.poll():
            operator()
        return
    if choice == "add":
        by_hand().splash.owner = dice.choice(known) if known else None
    elif choice == "remove":
        bpy.data.objects.remove(dice.choice(known))
    elif choice == "delete":
        chosen(dice.choice(known))
        bpy.ops.object.delete()
    else:
        dice.choice(known).name = f"Other {dice.randrange(9)}"
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message=choice)


def test_in_several_scenes():
    first = bpy.context.scene
    shared = by_hand("Shared")
    second = bpy.data.scenes.new("Second")
    second.collection.objects.link(shared)
    only = by_hand("Only", link=False)
    second.collection.objects.link(only)
    assert names() == ["Only", "Shared"]
    assert index.splashes(first) == [shared] and index.splashes(second) == [shared, only]
    bpy.data.scenes.remove(second)
    assert names() == ["Shared"] and not index.is_in_scene(only)


def test_of_a_hidden_or_excluded_collection():
    collection = bpy.data.collections.new("Away")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(by_hand(link=False))
    bpy.context.view_layer.layer_collection.children["Away"].exclude = True
    collection.hide_viewport = True
    assert names() == ["Splash"]
    bpy.context.scene.collection.children.unlink(collection)
    assert names() == []


def test_appended_and_linked(tmp_path):
    path = str(tmp_path / "library.blend")
    chosen(by_hand())
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert names() == []
    by_hand()
    for link in (False, True):
        with bpy.data.libraries.load(path, link=link) as (_, data):
            data.objects = ["Splash"]
        bpy.context.scene.collection.objects.link(data.objects[0])
    assert names() == ["Splash", "Splash", "Splash.001"], "one of them linked"
    assert all(map(index.is_in_scene, index.splashes()))
    assert [item.library is None for item in index.splashes()].count(False) == 1
    bpy.data.libraries[0].reload()
    assert names() == ["Splash", "Splash", "Splash.001"]
    bpy.data.libraries.remove(bpy.data.libraries[0])
    assert names() == ["Splash", "Splash.001"]


@pytest.mark.usefixtures("thick_drafts")
def test_a_model_and_its_copy():
    model = generate_layers(crossing())
    assert index.models() == [model] and index.is_in_scene(model)
    chosen(model)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = bpy.context.view_layer.objects.active
    assert index.models() == [model, copy] and len(index.splashes()) == 4
    bpy.ops.object.delete()
    assert index.models() == [model] and the_model() == model


@pytest.mark.usefixtures("thick_drafts")
def test_other_objects_are_given_no_properties(tmp_path):
    path = str(tmp_path / "crowd.blend")
    others = add_objects(20)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    others = [bpy.data.objects[name] for name in others]
    bpy.ops.ed.undo_push(message="opened")
    generate_layers(crossing())
    solids = bpy.data.collections.new("Solids")
    bpy.context.scene.collection.children.link(solids)
    for item in others[:3]:
        solids.objects.link(item)
    the = index.models()[0]
    the.splash_obstacles.collection = solids
    bpy.ops.splash.model_update()
    for item in [*others[:4], *index.splashes(), the]:
        chosen(item)
        draw_all()
        assert targets.find_target(bpy.context) is None or is_splash(item) or is_model(item)
    bpy.ops.ed.undo_push(message="all")
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    draw_all()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=path)
    bpy.context.view_layer.update()
    draw_all()
    liquid = [*index.splashes(), *index.models()]
    given = [
        (item.name, group)
        for item in bpy.data.objects
        for group in FOREIGN_GROUPS
        if item not in liquid and item.is_property_set(group)
    ]
    assert given == []
