# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fuzzer does to a sketch, each in a method of its own."""

from __future__ import annotations

import os

import bpy
import numpy as np

from liquid_splash_addon.blender.scene import world_strokes
from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.core.sketch.tools import TOOLS
from tests.blender.fuzzed_scene import FuzzedScene
from tests.blender.sketching import line


class OnSketch(FuzzedScene):
    """What artists do to strokes, layers and the object that has them."""

    def do_move_sketch(self) -> None:
        self.sketch.matrix_world = self.place()

    def do_turn_sketch(self) -> None:
        self.sketch.rotation_euler = [self.dice.uniform(-3, 3) for _ in range(3)]

    def do_scale_sketch(self) -> None:
        self.sketch.scale = [self.dice.choice((0.1, 0.5, 2.0, 7.0))] * 3

    def do_mirror_sketch(self) -> None:
        self.sketch.scale[self.dice.randrange(3)] *= -1

    def do_apply_sketch(self) -> None:
        self.activate(self.sketch)
        bpy.ops.object.transform_apply()

    def do_apply_scale_of_sketch(self) -> None:
        self.activate(self.sketch)
        bpy.ops.object.transform_apply(location=False, rotation=False)

    def do_origin_of_sketch(self) -> None:
        bpy.context.scene.cursor.location = self.place().translation
        self.activate(self.sketch)
        bpy.ops.object.origin_set(type=self.dice.choice(("ORIGIN_CURSOR", "ORIGIN_GEOMETRY")))

    def do_move_points(self) -> None:
        matrix = np.array(self.place())
        self.points(lambda p: p @ matrix[:3, :3].T + matrix[:3, 3])

    def do_scale_points(self) -> None:
        factor = self.dice.uniform(0.3, 3)
        self.points(lambda p: p * factor)

    def do_delta_of_sketch(self) -> None:
        self.sketch.delta_location = self.place().translation

    def do_add_stroke(self) -> None:
        drawn = self.drawing().attributes["position"]
        size = max(abs(drawn.data[-1].vector[0]), 1e-3)
        middle = np.array(drawn.data[0].vector)
        ends = middle + (0.2 * size, -0.1 * size, 0), middle + (0.5 * size, 0.2 * size, 0)
        add_strokes(self.sketch, [line(*ends, speed=size)])
        self.sketch.data.update_tag()

    def do_delete_stroke(self) -> None:
        drawing = self.drawing()
        if len(drawing.strokes) > 1:
            drawing.remove_strokes(indices=[0])
            self.sketch.data.update_tag()

    def do_parent_sketch(self) -> None:
        parent = self.link_new("Parent")
        parent.matrix_world = self.place()
        self.sketch.parent = parent
        parent.hide_viewport = self.dice.random() < 0.5

    def do_move_parent(self) -> None:
        if self.sketch.parent is not None:
            self.sketch.parent.matrix_world = self.place()

    def do_clear_parent_of_sketch(self) -> None:
        self.sketch.parent = None

    def do_constrain_sketch(self) -> None:
        target = self.link_new("Target")
        target.matrix_world = self.place()
        kind = self.dice.choice(("COPY_LOCATION", "COPY_ROTATION", "CHILD_OF"))
        self.sketch.constraints.new(kind).target = target

    def do_mute_constraints(self) -> None:
        for constraint in self.sketch.constraints:
            constraint.mute = True

    def do_key_sketch(self) -> None:
        self.sketch.keyframe_insert("location", frame=1)
        self.sketch.location.x += 2
        self.sketch.keyframe_insert("location", frame=9)

    def do_other_frame(self) -> None:
        bpy.context.scene.frame_set(self.dice.randrange(1, 12))

    def do_parent_layer(self) -> None:
        parent = self.link_new("Layer Parent")
        parent.matrix_world = self.place()
        self.sketch.data.layers[0].parent = parent
        parent.hide_viewport = self.dice.random() < 0.5

    def do_move_layer(self) -> None:
        self.sketch.data.layers[0].translation = self.place().translation

    def do_hide_sketch(self) -> None:
        self.sketch.hide_viewport = True

    def do_eye_of_sketch(self) -> None:
        self.sketch.hide_set(True)

    def do_show_sketch(self) -> None:
        self.sketch.hide_viewport = False
        self.sketch.hide_set(False)

    def do_exclude_sketch(self) -> None:
        name = self.to_collection(self.sketch).name
        bpy.context.view_layer.layer_collection.children[name].exclude = True

    def do_sketch_in_two_collections(self) -> None:
        name = self.to_collection(self.sketch).name
        bpy.context.scene.collection.objects.link(self.sketch)
        bpy.context.view_layer.layer_collection.children[name].exclude = True

    def do_unlink_sketch(self) -> None:
        for home in [*self.sketch.users_collection]:
            home.objects.unlink(self.sketch)

    def do_offset_modifier(self) -> None:
        self.sketch.modifiers.new("Offset", "GREASE_PENCIL_OFFSET").location = (0.1, 0, 0)

    def do_use_modifiers(self) -> None:
        settings = self.splash.splash.settings
        settings.use_modifiers = not settings.use_modifiers

    def do_stretch_sketch(self) -> None:
        self.sketch.scale = [self.dice.uniform(0.5, 2) for _ in range(3)]

    def do_frame_of_drawing(self) -> None:
        layer = self.sketch.data.layers[0]
        if layer.get_frame_at(7) is None or layer.get_frame_at(7).frame_number != 7:
            layer.frames.copy(layer.current_frame().frame_number, 7)

    def do_hide_layer(self) -> None:
        self.sketch.data.layers[-1].hide = True

    def do_lock_layer(self) -> None:
        self.sketch.data.layers[-1].lock = True

    def do_fade_layer(self) -> None:
        self.sketch.data.layers[-1].opacity = 0.0

    def do_show_layers(self) -> None:
        for layer in self.sketch.data.layers:
            layer.hide, layer.lock, layer.opacity = False, False, 1.0

    def do_add_layer(self) -> None:
        layer = self.sketch.data.layers.new("More")
        layer.frames.new(bpy.context.scene.frame_current)
        size = self.size()
        ends = (0.1 * size, 0, 0.1 * size), (0.8 * size, 0.3 * size, 0.1 * size)
        add_strokes(self.sketch, [line(*ends, speed=2 * size)], layer)
        self.sketch.data.update_tag()

    def do_rename_layer(self) -> None:
        self.sketch.data.layers[0].name = "Other"

    def do_rename_sketch(self) -> None:
        sketch = self.sketch
        sketch.name = "Эскиз волны"
        self.sketch_name = sketch.name

    def do_hide_ink(self) -> None:
        for slot in self.sketch.material_slots:
            if slot.material is not None and slot.material.grease_pencil is not None:
                slot.material.grease_pencil.hide = self.dice.random() < 0.5

    def do_mirror_modifier(self) -> None:
        self.sketch.modifiers.new("Mirror", "GREASE_PENCIL_MIRROR")

    def do_no_modifiers(self) -> None:
        self.sketch.modifiers.clear()

    def do_copy_of_sketch(self) -> None:
        self.activate(self.sketch)
        bpy.ops.object.duplicate()
        bpy.context.view_layer.objects.active.matrix_world = self.place()

    def do_linked_copy_of_sketch(self) -> None:
        copy = self.sketch.copy()
        bpy.context.scene.collection.objects.link(copy)
        copy.matrix_world = self.place()

    def do_through_modes(self) -> None:
        self.activate(self.sketch)
        for mode in ("EDIT", "PAINT_GREASE_PENCIL", "OBJECT"):
            bpy.ops.object.mode_set(mode=mode)

    def do_stroke_tool(self) -> None:
        self.activate(self.sketch)
        name = self.dice.choice(sorted(TOOLS))
        if len(self.drawing().strokes) < 40:  # spinning what was spun takes long
            getattr(bpy.ops.splash, f"stroke_{name.lower()}")()

    def do_reverse_strokes(self) -> None:
        self.activate(self.sketch)
        bpy.ops.splash.stroke_reverse()

    def do_speed_of_strokes(self) -> None:
        self.activate(self.sketch)
        bpy.ops.splash.stroke_speed(multiplier=self.dice.uniform(0.3, 2.0))

    def do_hand_stroke(self) -> None:
        size, middle = self.size(), np.array(self.sketch.matrix_world.translation)
        drawn = line(middle, middle + np.array((0.4, 0.3, 0.1)) * size, speed=size)
        self.written = world_strokes.write_stroke(bpy.context, self.sketch, drawn)

    def do_take_back_hand_stroke(self) -> None:
        if (written := getattr(self, "written", None)) is not None:
            world_strokes.remove_stroke(written)

    def do_tap(self) -> None:
        add_strokes(self.sketch, [line((0, 0, 0), (0, 0, 0), points=1)])
        self.sketch.data.update_tag()

    def do_select_unusable(self) -> None:
        self.activate(self.sketch)
        bpy.ops.splash.select_strokes()
        if bpy.context.object is not None and bpy.context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")

    def do_strokes_to_file_and_back(self) -> None:
        self.activate(self.sketch)
        path = os.path.join(bpy.app.tempdir, "strokes.json")
        bpy.ops.splash.export_strokes(filepath=path)
        bpy.ops.splash.import_strokes(filepath=path)

    def do_second_sketch(self) -> None:
        if not self.splash.splash.others:
            other = self.sketch.copy()
            other.data = self.sketch.data.copy()
            bpy.context.scene.collection.objects.link(other)
            other.matrix_world = self.sketch.matrix_world
            self.splash.splash.others.add().sketch = other

    def do_move_second_sketch(self) -> None:
        for entry in self.splash.splash.others:
            if entry.sketch is not None:
                entry.sketch.location.x += 0.1 * self.size()

    def do_delete_second_sketch(self) -> None:
        for entry in self.splash.splash.others:
            if entry.sketch is not None and entry.sketch.users_scene:
                for home in [*entry.sketch.users_collection]:
                    home.objects.unlink(entry.sketch)
