# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes out of simulated liquid: stock splashes become sketches that can be edited."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import bpy
from bpy.props import FloatProperty
from mathutils import Matrix

from ...core.animation.streamline_settings import StreamlineSettings
from ..data.properties import plain, settings_properties, to_settings
from ..jobs.work_queue import Work
from ..scene.flow import Flow, own_time_scale, read_flow
from ..scene.objects import Handle, SceneError, enter_object_mode, select_only
from ..scene.sketch import add_strokes, new_sketch
from .queued_operator import QueuedOperator
from .sketch_presets import SPLASH_MT_preset_sketches

if TYPE_CHECKING:
    from ...core.progress import Report
    from ...core.sketch.drawing import Drawing

FLOWING = {"MESH", "POINTCLOUD"}


class SPLASH_OT_strokes_from_flow(QueuedOperator, bpy.types.Operator):
    """Make a sketch of the active object's liquid as it flows at this frame. It needs an attribute 'velocity', as baked liquids, Alembic caches and splashes have"""  # noqa: E501 (a tooltip)

    bl_idname = "splash.strokes_from_flow"
    bl_label = "Sketch from Simulation"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 (as Blender reads it)

    __annotations__ = {
        **settings_properties(StreamlineSettings),
        "time_scale": FloatProperty(
            name="Time Scale",
            description="Speed of the liquid in the scene over its real speed, as slow motion has "
            "it. 0: that of a splash of ours, real speed for other objects",
            default=0.0,
            min=0.0,
            max=10.0,
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is an object that may show liquid, and no other run."""
        if not cls.is_free():
            return False
        item = context.active_object
        if item is None or item.type not in FLOWING:
            cls.poll_message_set("Select a simulated liquid: a mesh or points with velocities")
            return False
        return True

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the object."""
        self._item = Handle.of(context.active_object)

    def owner(self) -> int:
        """Return the object that it is about."""
        return self._item.uid

    def read(self) -> Work:
        """Read the flow at this frame."""
        context, item = bpy.context, self._item.find()
        if item is None:
            raise SceneError("The object was deleted meanwhile: select another")
        settings = to_settings(self, StreamlineSettings)
        flow = read_flow(context, item, plain(self.time_scale) or own_time_scale(item))
        # A liquid is some times faster than the hand that draws it.
        gain = plain(context.scene.splash.settings.speed_gain)
        key = (flow.key, repr(settings), gain)
        return Work(key, partial(find_strokes, flow, settings, gain), self.put)

    def put(self, drawings: list[Drawing]) -> None:
        """Make the sketch, where the liquid is."""
        context, item = bpy.context, self._item.find()
        enter_object_mode(context)
        sketch = new_sketch(context, Matrix())
        add_strokes(sketch, drawings)
        if item is not None:
            sketch.name = f"{item.name} Sketch"
        context.view_layer.update()
        select_only(context, sketch)
        self.report({"INFO"}, f"{len(drawings)} strokes: Generate Splash makes a splash of them")


def find_strokes(
    flow: Flow, settings: StreamlineSettings, gain: float, report: Report
) -> list[Drawing]:
    """Return the strokes in the world, without bpy. Raises FlowError."""
    from ...core.animation import streamlines_of_surface as core

    points, faces, velocities = flow
    if len(faces):
        found = core.strokes_of_surface(points, faces, velocities, settings, report)
    else:
        found = core.strokes_of_particles(points, velocities, settings, report)
    return core.slowed(found, 1 / gain)


def menu_entry(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry after the preset sketches."""
    self.layout.separator()
    self.layout.operator(SPLASH_OT_strokes_from_flow.bl_idname, icon="MOD_FLUIDSIM")


def register() -> None:
    """Add the operator and its entry in the menu."""
    bpy.utils.register_class(SPLASH_OT_strokes_from_flow)
    SPLASH_MT_preset_sketches.append(menu_entry)


def unregister() -> None:
    """Take both away."""
    SPLASH_MT_preset_sketches.remove(menu_entry)
    bpy.utils.unregister_class(SPLASH_OT_strokes_from_flow)
