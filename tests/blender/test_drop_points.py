# SPDX-License-Identifier: GPL-3.0-or-later
"""The free drops as a point cloud that follows its splash, and as vertices for exporters."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.scene import drop_points
from liquid_splash_addon.blender.scene.material import water_material
from liquid_splash_addon.core.refinement.settings import SMALLEST_RADIUS
from tests.blender.modelling import single
from tests.blender.sketching import SIZE, add_sketch, evaluated_mesh, fan, generate, vertices

CELL = 0.4 / 64
"""Of a draft, metres."""


@pytest.fixture
def splash(tubes) -> bpy.types.Object:
    """A splash with many drops, some of them too small for a mesh."""
    add_sketch(fan())
    splash = generate()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    drops = splash.splash_stack.items[0].droplets
    drops.amount, drops.flight, drops.cohesion, drops.spread = 0.03, 0.1, 0.4, 1.0
    return splash


def cloud(item: bpy.types.Object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return positions, radii and velocities of the point cloud that an object shows."""
    bpy.context.view_layer.update()
    shown = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    geometry = shown.evaluated_geometry()  # owns the point cloud
    data = geometry.pointcloud
    count = 0 if data is None else len(data.points)
    found = []
    for name, field, width in (("position", "vector", 3), ("radius", "value", 1),
                               ("velocity", "vector", 3)):  # fmt: skip
        values = np.empty(count * width, dtype=np.float32)
        if count:
            data.attributes[name].data.foreach_get(field, values)
        found.append(values.reshape(-1, width))
    return found[0], found[1][:, 0], found[2]


@pytest.fixture
def drops() -> SimpleNamespace:
    """Return drops by hand, of which two in three are in no mesh."""
    rng = np.random.default_rng(3)
    return SimpleNamespace(
        positions=rng.uniform(-1, 1, (30, 3)).astype(np.float32),
        velocities=rng.normal(size=(30, 3)).astype(np.float32),
        radii=rng.uniform(0.05, 0.1, 30).astype(np.float32),
        meshed=np.arange(30) % 3 == 0,
    )


def of_version_1(drops: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> bpy.types.Object:
    """Return the object for ``drops`` as it was made before vertices passed its modifier."""
    owner = bpy.data.objects.new("Splash", bpy.data.meshes.new("Splash"))
    bpy.context.scene.collection.objects.link(owner)
    with monkeypatch.context() as patch:
        patch.setattr(drop_points, "update_group", lambda group: None)
        drop_points.ensure(owner)
    drop_points.write(owner, drops)
    return owner.splash_stack.points


def rendered(folder: Path) -> np.ndarray:
    """Return a small picture of the scene, its drops glowing before black."""
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.camera.location = (0, 0, 6)
        scene.collection.objects.link(scene.camera)
    inputs = water_material().node_tree.nodes["Principled BSDF"].inputs
    inputs["Emission Color"].default_value = (1, 1, 1, 1)
    inputs["Emission Strength"].default_value = 1.0
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.render.filepath = str(folder / "drops.png")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    bpy.data.images.remove(image)
    return pixels


def switch(modifier: bpy.types.Modifier, identifier: str) -> None:
    """Switch an input of a node group's modifier on."""
    if hasattr(modifier, "properties"):  # Blender 5.2
        getattr(modifier.properties.inputs, identifier).value = True
    else:
        modifier[identifier] = True


def test_points_are_the_small_drops_or_all(splash):
    before = vertices(splash)
    assert bpy.ops.splash.drop_points() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), before)
    item = splash.splash_stack.points
    assert item.parent == splash and bpy.context.active_object == splash
    _, radii, velocities = cloud(item)
    # The fan is one unit and a bit long; its real size is SIZE.
    cell = CELL / SIZE
    assert 3 < len(radii) and 0 < radii.max() < 1.2 * SMALLEST_RADIUS * cell
    assert 0 < np.linalg.norm(velocities, axis=1).max() < 20
    socket = next(
        s for s in item.modifiers[0].node_group.interface.items_tree if s.name == drop_points.ALL
    )
    switch(item.modifiers[0], socket.identifier)
    item.update_tag()
    places, every, _ = cloud(item)
    assert len(every) == len(item.data.vertices) > len(radii)
    assert every.max() > SMALLEST_RADIUS * cell
    # Those that the mesh holds are where its vertices are.
    large = places[np.argmax(every)]
    away = np.linalg.norm(before - large, axis=1).min()
    assert away < 1.5 * every.max()


def test_points_follow_the_splash(splash):
    bpy.ops.splash.drop_points()
    item = splash.splash_stack.points
    first = vertices(item)
    splash.splash_stack.items[0].droplets.seed = 3
    assert not np.array_equal(vertices(item), first)
    splash.splash_stack.items[0].droplets.seed = 0
    np.testing.assert_array_equal(vertices(item), first)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(item), first)
    splash.splash_stack.items[0].show = False
    assert len(item.data.vertices) == 0
    splash.splash_stack.items[0].show = True
    assert bpy.ops.splash.drop_points() == {"FINISHED"}
    assert splash.splash_stack.points == item, "no second one"


def test_points_that_were_deleted_or_are_edited_do_no_harm(splash):
    bpy.ops.splash.drop_points()
    item = splash.splash_stack.points
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    splash.splash_stack.items[0].droplets.seed = 3
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects.remove(item)
    splash.splash_stack.items[0].droplets.seed = 4
    assert not splash.splash_stack.warnings
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.drop_points() == {"FINISHED"}
    assert len(splash.splash_stack.points.data.vertices) > 0


@pytest.mark.usefixtures("thick_drafts")
def test_a_model_has_points_of_its_own():
    model = single()
    bpy.context.view_layer.objects.active = model
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    drops = model.splash_model.parts[0].splash.splash_stack.items[0].droplets
    drops.amount, drops.flight, drops.spread = 0.01, 0.1, 1.0
    assert bpy.ops.splash.drop_points() == {"FINISHED"}
    item = model.splash_stack.points
    assert item.parent == model and len(item.data.vertices) > 0
    count = len(item.data.vertices)
    model.splash_model.settings.count = 2
    assert count < len(item.data.vertices) <= 2 * count
    model.splash_model.parts[0].splash.splash_stack.items[0].show = False
    assert len(item.data.vertices) == 0


def test_an_old_node_group_lets_vertices_pass_once_its_file_is_open(drops, monkeypatch, tmp_path):
    item = of_version_1(drops, monkeypatch)
    assert len(evaluated_mesh(item)["position"]) == 0
    name, path = item.name, str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    item = bpy.data.objects[name]
    points, radii, velocities = cloud(item)
    found = evaluated_mesh(item)
    np.testing.assert_array_equal(found["position"], drops.positions[~drops.meshed])
    np.testing.assert_array_equal(found["velocity"], drops.velocities[~drops.meshed])
    np.testing.assert_array_equal(found["radius"], drops.radii[~drops.meshed])
    for attribute, values in (("position", points), ("radius", radii), ("velocity", velocities)):
        np.testing.assert_array_equal(found[attribute], values)
    group = item.modifiers[0].node_group
    count = len(group.nodes)
    drop_points.update_groups()
    assert len(group.nodes) == count and drop_points.node_group() == group


def test_vertices_do_not_show_in_renders(drops, monkeypatch, tmp_path):
    item = of_version_1(drops, monkeypatch)
    before = rendered(tmp_path)
    assert 0.005 < (before > 0.5).mean() < 0.5, "drops in front of nothing"
    drop_points.update_groups()
    assert len(evaluated_mesh(item)["position"]) == (~drops.meshed).sum()
    np.testing.assert_array_equal(rendered(tmp_path), before)
