# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches: Grease Pencil objects that are drawn by core's presets."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty

from ...core.sketch.presets import PRESETS, SketchPreset
from ..data.properties import plain, settings_properties
from ..scene import sketch
from ..scene.objects import enter_object_mode, select_only
from . import operators

ITEMS = [(name, preset.label, preset.about) for name, preset in PRESETS.items()]

SHARED = [item.name for item in SketchPreset.controls()]
"""Controls that all presets have; their values stay when another preset is chosen."""


def property_name(identifier: str, control: str) -> str:
    """Return the name of the operator's property for a control of a preset."""
    return control if control in SHARED else f"{identifier.lower()}_{control}"


def control_properties() -> dict[str, Any]:
    """Make a Blender property for every control of every preset, by name."""
    found = {}
    for identifier, preset in PRESETS.items():
        # Not remembered from one sketch to the next: the menu adds each preset as it is.
        made = settings_properties(preset, options={"SKIP_SAVE"})
        found |= {property_name(identifier, name): made[name] for name in made}
    return found


def add_preset(context: bpy.types.Context, preset: SketchPreset) -> bpy.types.Object:
    """Make a Grease Pencil object with the preset's strokes at the 3D cursor, and select it."""
    layers = preset.layers()
    enter_object_mode(context)
    item = sketch.new_sketch(context, layers=list(layers))
    item.name = item.data.name = f"{preset.label} Sketch"
    for name, drawings in layers.items():
        sketch.add_strokes(item, drawings, item.data.layers[name])
    select_only(context, item)
    return item


class SPLASH_OT_preset_sketch(bpy.types.Operator):
    """Add a ready-made sketch at the 3D cursor"""

    bl_idname = "splash.preset_sketch"
    bl_label = "Preset Sketch"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    __annotations__ = {
        "preset": EnumProperty(items=ITEMS, name="Preset", description="What is drawn"),
        **control_properties(),
    }

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """Return the tooltip of the preset's entry in the menu."""
        about = PRESETS[properties.preset].about
        return f"{about}. The strokes are added at the 3D cursor; the redo panel has their controls"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the mode of the active object can be left."""
        return bool(operators.SPLASH_OT_new_sketch.poll(context))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the sketch."""
        add_preset(context, self.chosen())
        return {"FINISHED"}

    def chosen(self) -> SketchPreset:
        """Return the chosen preset with the values of its controls."""
        kind = PRESETS[self.preset]
        names = [item.name for item in kind.controls()]
        return kind(**{name: plain(getattr(self, self.property_of(name))) for name in names})

    def property_of(self, control: str) -> str:
        """Return the property that holds a control of the chosen preset."""
        return property_name(self.preset, control)

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the preset and its own controls."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "preset")
        column = layout.column()
        for item in PRESETS[self.preset].controls():
            column.prop(self, self.property_of(item.name))


class SPLASH_MT_preset_sketches(bpy.types.Menu):
    """Add a ready-made sketch"""

    bl_idname = "SPLASH_MT_preset_sketches"
    bl_label = "Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the presets."""
        for identifier, preset in PRESETS.items():
            entry = self.layout.operator(SPLASH_OT_preset_sketch.bl_idname, text=preset.label)
            entry.preset = identifier


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_OT_preset_sketch, SPLASH_MT_preset_sketches)
)
