# SPDX-License-Identifier: GPL-3.0-or-later
"""Slow motion, the ballistic preview and the two-pose mesh, against closed forms."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.blender.scene import ballistics, drop_points, motion, two_poses
from liquid_splash_addon.core.scale import GRAVITY
from tests.blender.sketching import add_sketch, evaluated_mesh, fan, generate, vertices

DEFAULT = 0.05


@pytest.fixture
def splash(tubes) -> bpy.types.Object:
    """Return a splash with free drops, turned in space; 25 frames a second."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 25, 1.0
    scene.frame_set(10)
    add_sketch(fan(), Matrix.LocRotScale((1, 2, 3), Euler((0.5, 1.1, -0.3)), None))
    splash = generate()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    drops = splash.splash_stack.items[0].droplets
    drops.amount, drops.flight, drops.cohesion, drops.spread = 0.03, 0.1, 0.4, 1.0
    bpy.ops.splash.drop_points()
    assert len(splash.splash_stack.points.data.vertices) > 3
    return splash


def velocity(item: bpy.types.Object) -> np.ndarray:
    """Return the stored velocities of a mesh object."""
    return vertices(item, "velocity")


def test_a_new_splash_is_in_slow_motion(splash):
    slow, drops = velocity(splash), velocity(splash.splash_stack.points)
    assert splash.splash_motion.time_scale == pytest.approx(DEFAULT)
    splash.splash_motion.time_scale = 1.0
    assert slow == pytest.approx(velocity(splash) * DEFAULT, rel=1e-6)
    assert drops == pytest.approx(velocity(splash.splash_stack.points) * DEFAULT, rel=1e-6)


def test_the_time_scale_only_rescales_and_never_drifts(splash):
    splash.splash_motion.time_scale = 1.0
    before, shape = velocity(splash), vertices(splash)
    key, liquid = splash.splash_stack.evaluated, splash.splash.made_of
    for value in np.linspace(0.013, 3.7, 200):
        splash.splash_motion.time_scale = value
    splash.splash_motion.time_scale = 0.3
    assert np.array_equal(velocity(splash), (before.astype(np.float64) * 0.3).astype(np.float32))
    assert np.array_equal(vertices(splash), shape)
    assert (splash.splash_stack.evaluated, splash.splash.made_of) == (key, liquid)
    splash.splash_stack.items[0].show = False  # refined anew
    speed = np.linalg.norm(velocity(splash), axis=1).max()
    splash.splash_motion.time_scale = 1.0
    assert np.linalg.norm(velocity(splash), axis=1).max() == pytest.approx(speed / 0.3, rel=1e-6)


def test_velocities_follow_after_edit_mode(splash):
    before = velocity(splash)
    bpy.context.view_layer.objects.active = splash
    bpy.ops.object.mode_set(mode="EDIT")
    splash.splash_motion.time_scale = 0.1
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert velocity(splash) == pytest.approx(2 * before, rel=1e-6)


def test_undo_takes_the_velocities_back(splash):
    before, name = velocity(splash), splash.name
    bpy.ops.ed.undo_push(message="made")
    splash.splash_motion.time_scale = 0.7
    bpy.ops.ed.undo_push(message="faster")
    bpy.ops.ed.undo()
    splash = bpy.data.objects[name]
    assert splash.splash_motion.time_scale == pytest.approx(DEFAULT)
    assert np.array_equal(velocity(splash), before)


def test_a_splash_from_before_keeps_real_time(splash):
    splash.splash_motion.property_unset("time_scale")
    assert splash.splash_motion.time_scale == 1.0


def test_gravity_goes_through_the_scale(splash):
    scale = frame_from_text(splash.splash.frame).scale
    assert motion.scale_of(splash).gravity == pytest.approx(
        GRAVITY / scale.length * DEFAULT**2, rel=1e-6
    )


def flown(item, start, speed, gravity, frames, fps=25.0):
    """Return positions and velocities after so many frames, in the object's own space."""
    turn = np.array(item.matrix_world.to_3x3().normalized())
    g = turn.T @ [0.0, 0.0, -gravity]
    t = frames / fps
    return start + speed * t + g * t**2 / 2, speed + g * t


@pytest.mark.parametrize("frame", [-7, 0, 10, 31])
def test_vertices_and_drops_fly_as_the_closed_form_says(splash, frame):
    assert bpy.ops.splash.ballistic_preview() == {"FINISHED"}
    assert splash.splash_motion.shape_frame == 10
    splash.splash_motion.time_scale = 0.5  # live, also for the preview
    splash.splash_motion.gravity = 2.0
    gravity = 2 * motion.scale_of(splash).gravity
    bpy.context.scene.frame_set(frame)
    for item in (splash, splash.splash_stack.points):
        seen = evaluated_mesh(item)
        start = vertices(item)
        if item is not splash:  # the drops in the splash's mesh are not shown
            meshed = np.empty(len(start), dtype=bool)
            item.data.attributes["meshed"].data.foreach_get("value", meshed)
            start, speed = start[~meshed], velocity(item)[~meshed]
        else:
            speed = velocity(item)
        place, fast = flown(item, start, speed, gravity, frame - 10)
        assert seen["position"] == pytest.approx(place, abs=1e-4 * (1 + np.abs(place).max()))
        assert seen["velocity"] == pytest.approx(fast, abs=1e-4 * (1 + np.abs(fast).max()))


def test_refining_and_generating_keep_the_preview(splash):
    bpy.ops.splash.ballistic_preview()
    splash.splash_stack.items[0].show = False
    bpy.ops.splash.regenerate(real_size=0.2)
    modifier = splash.modifiers[0]
    assert ballistics.modifier_of(splash) == modifier and len(splash.modifiers) == 1
    bpy.context.scene.frame_set(20)
    gravity = motion.scale_of(splash).gravity
    place, _ = flown(splash, vertices(splash), velocity(splash), gravity, 10)
    assert evaluated_mesh(splash)["position"] == pytest.approx(place, abs=1e-3)


def test_removing_the_preview_leaves_the_splash_as_it_was(splash):
    shape = vertices(splash)
    bpy.ops.splash.ballistic_preview()
    bpy.context.scene.frame_set(30)
    assert not np.allclose(evaluated_mesh(splash)["position"], shape)
    bpy.ops.splash.ballistic_remove()
    assert np.array_equal(evaluated_mesh(splash)["position"], shape)
    assert ballistics.modifier_of(splash.splash_stack.points) is None
    assert len(splash.splash_stack.points.modifiers) == 1


def test_drops_that_are_added_later_fly_too(tubes):
    add_sketch(fan())
    splash = generate()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    bpy.ops.splash.ballistic_preview()
    bpy.ops.splash.drop_points()
    drops = drop_points.own_points(splash)
    assert drops.modifiers[0] == ballistics.modifier_of(drops)
    assert len([group for group in bpy.data.node_groups if ballistics.MARK in group]) == 1


def test_a_model_has_a_motion_of_its_own(splash):
    splash.splash_motion.time_scale = 0.2
    bpy.ops.object.select_all(action="DESELECT")
    splash.select_set(True)
    assert bpy.ops.splash.combine() == {"FINISHED"}
    model = bpy.context.active_object
    assert model.splash_motion.time_scale == pytest.approx(0.2)
    whole = np.linalg.norm(velocity(model), axis=1).max()
    part = np.linalg.norm(velocity(splash), axis=1).max()
    assert whole == pytest.approx(part, rel=0.2)
    splash.splash_motion.time_scale = 1.0
    assert np.linalg.norm(velocity(model), axis=1).max() == whole
    assert motion.scale_of(model).time == pytest.approx(0.2)
    bpy.ops.splash.ballistic_preview()
    assert ballistics.modifier_of(model) and not ballistics.modifier_of(splash)


def test_two_poses_move_as_the_velocities_say(splash):
    splash.splash_motion.time_scale = 0.5
    bpy.ops.splash.two_pose_mesh()
    made = bpy.context.active_object
    assert made.name.endswith("Two Poses") and made.data.shape_keys.key_blocks[1].name == (
        two_poses.KEY
    )
    poses = {}
    for frame in (9, 10, 11):
        bpy.context.scene.frame_set(frame)
        poses[frame] = evaluated_mesh(made)["position"]
    assert poses[10] == pytest.approx(vertices(splash), abs=1e-6)
    for frame in (10, 11):
        speed = (poses[frame] - poses[frame - 1]) * 25
        assert speed == pytest.approx(velocity(splash), abs=2e-4)
    np.testing.assert_allclose(made.matrix_world, splash.matrix_world, atol=1e-5)


def test_errors_say_what_to_do(splash):
    splash.data.clear_geometry()
    with pytest.raises(RuntimeError, match="generate it first"):
        bpy.ops.splash.two_pose_mesh()
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = None
    assert not bpy.ops.splash.ballistic_preview.poll()
