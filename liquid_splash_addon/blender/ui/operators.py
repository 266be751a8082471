# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that make a splash or a sketch; jobs.generate and scene.sketch do the work."""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy
from bpy.props import EnumProperty

from ...core.settings import SplashSettings
from ...core.sketch.drawing import fault_of
from ..data.properties import assign_settings, settings_properties, to_settings
from ..data.start import ABOUT as START
from ..jobs import dependencies, generate
from ..jobs.problems import Check
from ..jobs.work_queue import Work
from ..scene import sketch, targets
from ..scene.objects import Handle, enter_object_mode, select_only
from ..scene.stroke_objects import read_object, select_strokes
from .queued_operator import QueuedOperator

NO_SKETCH = "Select a Grease Pencil sketch, curves, or a splash whose sketch still exists"


class SplashMaker(QueuedOperator):
    """What the operators that make a splash share.

    Their properties are the settings, for the redo panel and for scripts. Those that are not set
    are taken from the splash, or from the scene for a new splash.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    # Not remembered from one splash to the next: each has settings of its own.
    __annotations__ = settings_properties(options={"SKIP_SAVE"})
    realign = False
    needs_splash = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a sketch to start from, and no other run."""
        target = targets.find_target(context)
        if not cls.is_free():
            return False
        if target is None:
            cls.poll_message_set(NO_SKETCH)
        elif cls.needs_splash and target.splash is None:
            cls.poll_message_set("This sketch has no splash yet: generate one first")
        else:
            return True
        return False

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of sketch and splash, and of the settings that were given to the operator."""
        sketch, splash, self._layer, others = targets.find_target(context)
        self._sketch = Handle.of(sketch)
        self._others = tuple(map(Handle.of, others))
        self._splash = None if splash is None else Handle.of(splash)
        self._given = {
            name: value
            for name, value in vars(to_settings(self)).items()
            if self.properties.is_property_set(name)
        }

    def owner(self) -> int:
        """Return the splash that is made anew, if there is one."""
        return 0 if self._splash is None else self._splash.uid

    def read(self) -> Work:
        """Take a snapshot of the scene, and set the operator's properties to the settings used."""
        target = self.found()
        owner = target.splash if target.splash is not None else bpy.context.scene
        settings = self.chosen_settings(to_settings(owner.splash.settings))
        request = generate.snapshot(
            bpy.context, target, settings, self.realign, start=self.chosen_start()
        )
        self._digest = request.digest
        assign_settings(self, settings)
        return Work(
            request.key, partial(generate.compute, request), partial(self.write_result, request)
        )

    def chosen_start(self) -> str:
        """Return what a new splash starts with; empty for what its scene says."""
        return ""

    def found(self) -> targets.Target:
        """Find sketch and splash again. Raises SceneError if one was deleted meanwhile."""
        return generate.found(self._sketch, self._splash, self._layer, self._others)

    def chosen_settings(self, stored: SplashSettings) -> SplashSettings:
        """Return the stored settings, replaced by those that this operator was given."""
        return SplashSettings(**(vars(stored) | self._given))

    def write_result(self, request: Any, result: Any) -> None:
        """Write the result and report what was made."""
        splash = generate.write(bpy.context, request, result)
        self.report({"INFO"}, f"{splash.name}: {result.summary}")
        for warning in result.warnings:
            self.report({"WARNING"}, warning)

    def about(self) -> int:
        """Return the sketch: errors are shown with it and with its splash."""
        return self._sketch.uid

    def tried(self) -> str:
        """Return one name for all ways of making a splash: one success clears all errors."""
        return SPLASH_OT_generate.bl_idname

    def cause(self) -> Check:
        """Return what looks whether the splash could be made now."""
        handles = self._sketch, self._splash, self._layer, self._others
        digest = getattr(self, "_digest", "")
        return partial(generate.check, handles, self._given, self.realign, digest)


class SPLASH_OT_generate(SplashMaker, bpy.types.Operator):
    """Turn the strokes of the active sketch into a splash, or update its splash"""

    bl_idname = "splash.generate"
    bl_label = "Generate Splash"
    needs_splash = False
    __annotations__ = {"start": EnumProperty(options={"SKIP_SAVE"}, **START)}

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of what a new splash starts with, too."""
        super().begin(context)
        if not self.properties.is_property_set("start"):
            self.start = context.scene.splash.start

    def chosen_start(self) -> str:
        """Return what was given, or what the scene says."""
        return str(self.start)


class SPLASH_OT_regenerate(SplashMaker, bpy.types.Operator):
    """Make the splash again from its sketch and settings, in the same place"""

    bl_idname = "splash.regenerate"
    bl_label = "Regenerate"


class SPLASH_OT_realign(SplashMaker, bpy.types.Operator):
    """Fit the splash to its redrawn strokes and make it again"""

    bl_description = (
        "Fit the splash to redrawn strokes and make it again. Otherwise it keeps its place and its "
        "voxels while you edit the strokes, so that it does not jump"
    )
    bl_idname = "splash.realign"
    bl_label = "Refit to Sketch"
    realign = True


class SPLASH_OT_new_sketch(bpy.types.Operator):
    """Add a Grease Pencil object at the 3D cursor and start to draw"""

    bl_description = (
        "Add a Grease Pencil object at the 3D cursor and start to draw. How fast you draw is how "
        "fast the liquid moves"
    )
    bl_idname = "splash.new_sketch"
    bl_label = "New Sketch"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    placement: EnumProperty(
        items=[(key, item.label, item.about) for key, item in sketch.PLACEMENTS.items()],
        name="Strokes Lie",
        description="Where in space strokes lie",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """Return the tooltip, with where strokes will lie."""
        return f"{cls.bl_description}. {sketch.PLACEMENTS[properties.placement].about}"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the mode of the active object can be left."""
        active = context.active_object
        if active is not None and active.mode == "EDIT" and active.type != "GREASEPENCIL":
            cls.poll_message_set("Leave Edit Mode first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the object and enter draw mode."""
        sketch.start_drawing(context, sketch.new_sketch(context), self.placement)
        return {"FINISHED"}


class SPLASH_OT_select_strokes(bpy.types.Operator):
    """Select the strokes of the sketch that cannot be used, in Edit Mode"""

    bl_idname = "splash.select_strokes"
    bl_label = "Select Strokes"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a sketch."""
        if targets.find_target(context) is not None:
            return True
        cls.poll_message_set(NO_SKETCH)
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select what would be left out."""
        target = targets.find_target(context)
        layer = "" if target.splash is None else target.splash.splash.layer
        for item in (target.sketch, *target.others):
            drawings, _ = read_object(item, layer)
            unusable = [number for number, drawing in enumerate(drawings) if fault_of(drawing)]
            if unusable:
                enter_object_mode(context)
                select_only(context, item)
                bpy.ops.object.mode_set(mode="EDIT")
                select_strokes(item, layer, unusable)
                self.report({"INFO"}, f"Selected {len(unusable)} stroke(s) that cannot be used")
                return {"FINISHED"}
        self.report({"INFO"}, "All strokes can be used")
        return {"CANCELLED"}


class SPLASH_OT_copy_install_command(bpy.types.Operator):
    """Copy the command that installs the missing packages, to run it in a terminal"""

    bl_idname = "splash.copy_install_command"
    bl_label = "Copy Command"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy the command."""
        context.window_manager.clipboard = dependencies.install_command()
        self.report({"INFO"}, "Command copied. Run it in a terminal, then restart Blender")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (
        SPLASH_OT_generate,
        SPLASH_OT_regenerate,
        SPLASH_OT_realign,
        SPLASH_OT_new_sketch,
        SPLASH_OT_select_strokes,
        SPLASH_OT_copy_install_command,
    )
)
