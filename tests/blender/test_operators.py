# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons: what they make, and what of the user's they leave alone."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.blender.data.properties import to_settings
from liquid_splash_addon.core.refinement.stored_splash import StoredSplash
from tests.blender.sketching import (
    TubeGenerator,
    add_sketch,
    fan,
    generate,
    in_world,
    line,
    moved,
    real_velocities,
    slower,
    splashes,
    vertices,
)

pytestmark = pytest.mark.usefixtures("tubes")


def activate(item: bpy.types.Object) -> None:
    bpy.context.view_layer.objects.active = item


def test_new_sketch_is_ready_to_draw():
    bpy.context.scene.cursor.location = (1, 2, 3)
    assert bpy.ops.splash.new_sketch() == {"FINISHED"}
    sketch = bpy.context.active_object
    assert sketch.type == "GREASEPENCIL" and sketch.mode == "PAINT_GREASE_PENCIL"
    assert tuple(sketch.location) == (1, 2, 3)
    assert sketch.data.layers.active is not None
    assert sketch.data.layers[0].current_frame() is not None
    assert bpy.context.scene.tool_settings.gpencil_stroke_placement_view3d == "CURSOR"
    assert bpy.ops.splash.new_sketch() == {"FINISHED"}, "from draw mode"
    assert bpy.context.active_object != sketch
    assert bpy.context.active_object.data.materials[0] == sketch.data.materials[0]


def test_generate_makes_a_splash():
    sketch = add_sketch(fan(), Matrix.Translation((1, 0, 2)))
    splash = generate(seed=7)
    assert splash.type == "MESH" and splash.splash.sketch == sketch
    assert bpy.context.active_object == splash and splash.select_get()
    assert splash.matrix_world.translation == sketch.matrix_world.translation
    mesh = splash.data
    assert len(mesh.polygons) > 1000 and not mesh.validate()
    assert all(polygon.use_smooth for polygon in mesh.polygons)
    velocity = mesh.attributes["velocity"]
    assert (velocity.data_type, velocity.domain) == ("FLOAT_VECTOR", "POINT")
    assert np.linalg.norm(real_velocities(splash), axis=1).max() > 1
    assert splash.data.materials[0].name == "Splash Water"


@pytest.mark.parametrize("turn", [1, -1])
def test_every_corner_knows_the_edge_that_begins_there(turn):
    add_sketch(fan())
    splash = generate()
    splash.data.transform(Matrix.Diagonal((turn, 1, 1, 1)))
    assert bpy.ops.splash.regenerate(seed=2) == {"FINISHED"}
    mesh = splash.data
    ends = flat_ints(mesh.edges, "vertices", 2).reshape(-1, 2)
    corners = flat_ints(mesh.loops, "vertex_index").reshape(-1, 3)
    of_corners = flat_ints(mesh.loops, "edge_index").reshape(-1, 3)
    here = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1), axis=-1)
    np.testing.assert_array_equal(np.sort(ends[of_corners], axis=-1), here)
    assert len(ends) == len(np.unique(ends, axis=0)) == 1.5 * len(mesh.polygons)
    assert not mesh.validate()


def flat_ints(items, name, width=1):
    values = np.empty(width * len(items), dtype=np.int32)
    items.foreach_get(name, values)
    return values


def test_normals_point_outwards_and_the_mesh_is_closed():
    import bmesh

    add_sketch(fan())
    mesh = bmesh.new()
    mesh.from_mesh(generate().data)
    assert all(edge.is_manifold for edge in mesh.edges)
    assert mesh.calc_volume(signed=True) > 0


def test_what_is_needed_to_make_it_again_is_kept_on_the_splash():
    add_sketch(fan())
    splash = generate(seed=3, variation=0.5, stroke_speed=0.01)
    memory = splash.splash
    kept = to_settings(memory.settings)
    assert (kept.seed, kept.variation, kept.stroke_speed) == (3, 0.5, 0.01)
    assert kept.resolution == "64"
    assert memory.weights_hash == TubeGenerator.weights_hash
    assert memory.precision == TubeGenerator.precision
    assert memory.version[0].isdigit()
    frame = frame_from_text(memory.frame)
    np.testing.assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-12)
    assert StoredSplash.from_bytes(stored_liquid.read(splash.data)[0]).fields.grid.shape == (
        64,
        64,
        64,
    )


def test_a_splash_is_made_again_in_its_own_precision(monkeypatch):
    from liquid_splash_addon.blender.jobs import loaded_generator

    asked = []
    monkeypatch.setattr(
        loaded_generator, "get", lambda *given: asked.append(given) or TubeGenerator()
    )
    add_sketch(fan())
    splash = generate()
    splash.splash.precision = "bfloat16"
    activate(splash)
    bpy.ops.splash.regenerate()
    assert [given[2] for given in asked] == ["", "bfloat16"]


def test_another_format_than_the_recorded_one_is_a_warning(monkeypatch):
    from liquid_splash_addon.blender.jobs import loaded_generator

    monkeypatch.setattr(loaded_generator, "get", lambda *given: TubeGenerator())
    add_sketch(fan())
    splash = generate()
    assert "format" not in splash.splash.warnings
    splash.splash.precision = "int8"
    activate(splash)
    bpy.ops.splash.regenerate()
    assert "int8 is not available on this device" in splash.splash.warnings


def test_everything_survives_a_file(tmp_path):
    add_sketch(fan())
    splash = generate(seed=3)
    name, before, fields = splash.name, vertices(splash), stored_liquid.read(splash.data)[0]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "splash.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "splash.blend"))
    splash = bpy.data.objects[name]
    assert stored_liquid.read(splash.data)[0] == fields
    activate(splash)
    bpy.ops.splash.regenerate()
    np.testing.assert_array_equal(vertices(splash), before)


def test_same_seed_same_mesh():
    add_sketch(fan())
    splash = generate(seed=5, variation=1)
    first, velocity = vertices(splash), vertices(splash, "velocity")
    bpy.ops.splash.regenerate()
    np.testing.assert_array_equal(vertices(splash), first)
    np.testing.assert_array_equal(vertices(splash, "velocity"), velocity)
    bpy.ops.splash.regenerate(seed=6)
    other = vertices(splash)
    assert other.shape != first.shape or not np.array_equal(other, first)


def test_regenerating_keeps_what_the_user_added():
    add_sketch(fan())
    splash = generate()
    mesh, glass = splash.data, bpy.data.materials.new("mine")
    mesh.materials[0] = glass
    mesh.materials.append(None)
    splash.modifiers.new("Smooth", "SMOOTH")
    mesh["note"] = "keep"
    bpy.ops.splash.regenerate(real_size=0.2)
    assert splash.data == mesh and list(mesh.materials) == [glass, None]
    assert [m.type for m in splash.modifiers] == ["SMOOTH"] and mesh["note"] == "keep"
    assert len(splashes()) == 1


def test_generate_again_updates_the_splash_of_the_sketch():
    sketch = add_sketch(fan())
    splash = generate()
    activate(sketch)
    assert generate(seed=9) == splash and len(splashes()) == 1
    assert splash.splash.settings.seed == 9
    add_sketch(fan())
    generate()
    assert len(splashes()) == 2, "another sketch, another splash"
    assert splashes()[0].data.materials[0] == splashes()[1].data.materials[0]


def test_new_splashes_take_the_settings_of_the_scene_and_keep_their_own():
    bpy.context.scene.splash.settings.seed = 11
    bpy.context.scene.splash.settings.resolution = "64"
    add_sketch(fan())
    bpy.ops.splash.generate()
    splash = splashes()[0]
    assert splash.splash.settings.seed == 11
    bpy.context.scene.splash.settings.seed = 12
    splash.splash.settings.variation = 0.25
    bpy.ops.splash.regenerate()
    kept = to_settings(splash.splash.settings)
    assert (kept.seed, kept.variation, kept.resolution) == (11, 0.25, "64")
    assert bpy.context.scene.splash.settings.seed == 12


def test_the_artist_stays_in_draw_mode():
    sketch = add_sketch(fan())
    bpy.ops.object.mode_set(mode="PAINT_GREASE_PENCIL")
    splash = generate()
    assert bpy.context.active_object == sketch and sketch.mode == "PAINT_GREASE_PENCIL"
    assert not splash.select_get()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_buttons_say_why_they_are_off():
    with pytest.raises(RuntimeError, match="Select a Grease Pencil sketch"):
        bpy.ops.splash.generate()
    add_sketch(fan())
    for name in ("regenerate", "realign"):
        with pytest.raises(RuntimeError, match="has no splash yet"):
            getattr(bpy.ops.splash, name)()


def test_one_undo_step():
    add_sketch(fan())
    bpy.ops.ed.undo_push(message="sketch")
    bpy.ops.splash.generate("EXEC_DEFAULT", True, resolution="64")
    before = vertices(splashes()[0])
    bpy.ops.splash.regenerate("EXEC_DEFAULT", True, speed_gain=1.0, real_size=0.15)
    assert vertices(splashes()[0]).shape != before.shape
    bpy.ops.ed.undo()
    np.testing.assert_array_equal(vertices(splashes()[0]), before)
    assert splashes()[0].splash.settings.speed_gain == 3
    bpy.ops.ed.undo()
    assert not splashes()


def test_the_frame_stays_until_realign():
    sketch = add_sketch(fan())
    splash = generate()
    first = frame_from_text(splash.splash.frame)
    sketches_drawing = sketch.data.layers[0].frames[0].drawing
    sketches_drawing.remove_strokes(indices=[0, 1])
    bpy.ops.splash.regenerate()
    same = frame_from_text(splash.splash.frame)
    np.testing.assert_array_equal(same.axes, first.axes)
    assert same.scale == first.scale
    bpy.ops.splash.realign()
    assert not np.allclose(frame_from_text(splash.splash.frame).centre, first.centre, atol=0.01)


def test_another_sketch_gets_a_frame_of_its_own():
    add_sketch(fan())
    splash = generate()
    far = moved(fan(), Matrix.Translation((50, 0, 0)))
    splash.splash.sketch = add_sketch(far, active=False)
    activate(splash)
    bpy.ops.splash.regenerate()
    assert in_world(splash)[:, 0].min() > 40


def test_another_real_size_takes_effect_at_once():
    add_sketch(fan())
    splash = generate(real_size=0.3)
    first = frame_from_text(splash.splash.frame)
    bpy.ops.splash.regenerate(real_size=0.15)
    second = frame_from_text(splash.splash.frame)
    np.testing.assert_array_equal(second.axes, first.axes)
    assert second.scale.length == pytest.approx(first.scale.length / 2)


def test_warnings_reach_the_panel():
    add_sketch([*slower(fan(), 0.1), *(type(d)(d.points) for d in fan())])
    warnings = generate().splash.warnings.split("\n")
    assert any("no recorded time" in line for line in warnings)
    assert any("m/s" in line and "Speed Gain" in line for line in warnings)


def test_faster_strokes_make_faster_splashes():
    speeds = []
    for speed in (1.0, 2.0):
        add_sketch(fan(speed))
        generate()
        speeds.append(np.median(np.linalg.norm(real_velocities(splashes()[-1]), axis=1)))
    assert speeds[1] == pytest.approx(2 * speeds[0], rel=1e-3)
    assert speeds[0] == pytest.approx(4.0, rel=0.1), "gain times the drawn speed"


def test_a_larger_sketch_is_a_larger_splash():
    """Size in the scene is not size in the world: that is what Real Size says."""
    add_sketch(fan(size=1.0), active=True)
    small = in_world(generate())
    add_sketch(slower(moved(fan(size=1.0), Matrix.Diagonal((10, 10, 10, 1))), 1))
    large = in_world(max((generate(), *splashes()), key=lambda item: max(item.dimensions)))
    np.testing.assert_allclose(np.ptp(large, axis=0), 10 * np.ptp(small, axis=0), rtol=0.02)


def test_a_single_stroke_is_enough():
    add_sketch([line((0, 0, 0), (1, 0.2, 0.4))])
    assert len(generate().data.vertices) > 100
