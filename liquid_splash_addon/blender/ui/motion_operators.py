# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators on the motion of a splash or a model."""

from __future__ import annotations

import bpy

from ..scene import ballistics, motion, two_poses
from ..scene.objects import select_only
from ..scene.targets import shown_liquid


class MotionOperator:
    """What these operators share."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash or a model that can be changed."""
        item = shown_liquid(context)
        if item is None:
            cls.poll_message_set("Select a splash or a model, or the sketch of a splash")
        elif not item.is_editable:
            cls.poll_message_set("It is linked from another file: make it local first")
        else:
            return True
        return False


class SPLASH_OT_ballistic_preview(MotionOperator, bpy.types.Operator):
    """Let the splash fly on over the timeline, every drop by itself"""

    bl_description = (
        "Let the splash fly on over the timeline, every drop by itself with its velocity and "
        "gravity. It has the drawn shape at the current frame; before, it flies backwards. Nothing "
        "is baked"
    )
    bl_idname = "splash.ballistic_preview"
    bl_label = "Ballistic Preview"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the modifier to mesh and drops."""
        item = shown_liquid(context)
        if motion.scale_of(item) is None:
            self.report({"ERROR"}, f"'{item.name}' has no liquid yet: generate it first")
            return {"CANCELLED"}
        item.splash_motion.shape_frame = context.scene.frame_current
        motion.preview(item)
        return {"FINISHED"}


class SPLASH_OT_ballistic_remove(MotionOperator, bpy.types.Operator):
    """Remove the ballistic preview: the splash stands still again"""

    bl_idname = "splash.ballistic_remove"
    bl_label = "Remove Ballistic Preview"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove the modifiers."""
        motion.end_preview(shown_liquid(context))
        return {"FINISHED"}


class SPLASH_OT_two_pose_mesh(MotionOperator, bpy.types.Operator):
    """Make a copy of the mesh that moves with its velocity for one frame, for fluid solvers"""

    bl_description = (
        "Make a copy of the mesh that moves with its velocity around the current frame, by a shape "
        "key. FLIP Fluids and other solvers read an object's velocity from its moving vertices"
    )
    bl_idname = "splash.two_pose_mesh"
    bl_label = "Two-Pose Mesh"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make the object."""
        item = shown_liquid(context)
        velocity = item.data.attributes.get("velocity")
        if item.mode == "EDIT" or velocity is None or not len(velocity.data):
            self.report({"ERROR"}, f"'{item.name}' has no velocity to read: leave Edit Mode, or "
                        "generate it first")  # fmt: skip
            return {"CANCELLED"}
        frame = context.scene.frame_current
        if ballistics.modifier_of(item) is not None:
            frame = item.splash_motion.shape_frame
        made = two_poses.new_object(context, item, frame)
        if context.mode == "OBJECT":
            select_only(context, made)
        self.report({"INFO"}, f"{made.name}: moves from frame {frame - 1} to {frame + 1}")
        return {"FINISHED"}


CLASSES = (SPLASH_OT_ballistic_preview, SPLASH_OT_ballistic_remove, SPLASH_OT_two_pose_mesh)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
