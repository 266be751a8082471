# SPDX-License-Identifier: GPL-3.0-or-later
"""Random things that artists do to random scenes.

python -m tests.blender.scene_fuzzer FIRST COUNT    sequences by seed, Blender's module
"""

from __future__ import annotations

import os
import sys

import bpy
import numpy as np
from mathutils import Matrix

from liquid_splash_addon.blender.scene import places
from liquid_splash_addon.blender.scene.sketch import add_strokes
from tests.blender.fuzzed_scene import FuzzedScene
from tests.blender.sketching import line


class Fuzz(FuzzedScene):
    """All that is done, each in a method of its own."""

    # What artists do: making

    def do_regenerate(self) -> None:
        self.made_last = False
        self.activate(self.splash)
        bpy.ops.splash.regenerate()
        self.made_last = True

    def do_realign(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.realign()

    def do_next_seed(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.step_seed(step=self.dice.choice((-1, 1)))

    def do_real_size(self) -> None:
        self.splash.splash.settings.real_size = self.dice.uniform(0.2, 0.35)

    def do_fit_speed(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.fit_speed()

    def do_refine(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_add(kind=self.dice.choice(("WAVES", "CLEANUP")))

    def do_unrefine(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_remove()

    def do_drops(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.drop_points()

    def do_follow(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.follow(on=self.dice.random() < 0.5)

    # The sketch

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
        drawn = self.sketch.data.layers[0].current_frame().drawing.attributes["position"]
        size = max(abs(drawn.data[-1].vector[0]), 1e-3)
        middle = np.array(drawn.data[0].vector)
        ends = middle + (0.2 * size, -0.1 * size, 0), middle + (0.5 * size, 0.2 * size, 0)
        add_strokes(self.sketch, [line(*ends, speed=size)])
        self.sketch.data.update_tag()

    def do_delete_stroke(self) -> None:
        drawing = self.sketch.data.layers[0].current_frame().drawing
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

    # The splash

    def do_apply_splash(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.transform_apply()

    def do_origin_of_splash(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.origin_set(type="ORIGIN_GEOMETRY")

    def do_parent_splash_to_sketch(self) -> None:
        place = np.array(places.world_matrix(self.splash), dtype=float)
        self.splash.parent = self.sketch
        inverse = np.linalg.inv(np.array(places.world_matrix(self.sketch), dtype=float))
        self.splash.matrix_parent_inverse = Matrix(inverse.tolist())
        places.move_to(self.splash, place)

    def do_offset_splash(self) -> None:
        self.splash.matrix_world = self.place()
        self.is_offset = True

    def do_scale_splash(self) -> None:
        self.splash.scale = [self.dice.choice((-1.0, 0.5, 3.0))] * 3
        self.is_offset = True

    def do_both_moved(self) -> None:
        """Move both, as both selected would be, and make the splash again."""
        if places.is_child(self.splash, self.sketch) or places.is_driven(self.sketch):
            return
        change = self.place()
        for item in (self.sketch, self.splash):
            if item.parent is None:
                item.matrix_basis = change @ item.matrix_basis
            else:
                self.is_offset = True
        bpy.context.view_layer.update()
        self.do_regenerate()

    def do_hide_splash(self) -> None:
        self.splash.hide_viewport = True

    def do_show_splash(self) -> None:
        self.splash.hide_viewport = False

    def do_key_splash(self) -> None:
        self.splash.keyframe_insert("location", frame=1)
        self.is_offset = True

    def do_decorate(self) -> None:
        data = self.splash.data
        data.uv_layers.new(name="Map")
        data.materials.append(bpy.data.materials.new("Second"))
        self.splash.vertex_groups.new(name="Some").add([0, 1], 1.0, "REPLACE")

    def do_linked_copy(self) -> None:
        copy = self.splash.copy()
        bpy.context.scene.collection.objects.link(copy)
        self.splash = copy

    def do_copy(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.duplicate()
        self.splash = bpy.context.view_layer.objects.active

    # Obstacles

    def do_obstacle(self) -> None:
        kind = self.dice.choice(("cube", "empty", "curve", "plane"))
        if kind in ("cube", "plane"):
            getattr(bpy.ops.mesh, f"primitive_{kind}_add")(size=0.1, location=(7, 7, 7))
            item = bpy.context.active_object
        else:
            data = None if kind == "empty" else bpy.data.curves.new("Bare", "CURVE")
            item = self.link_new("Bare", data)
        self.splash.splash_obstacles.collection = self.to_collection(item)

    def do_obstacle_kind(self) -> None:
        collection = self.splash.splash_obstacles.collection
        for item in collection.all_objects if collection is not None else ():
            item.splash_obstacle.kind = self.dice.choice(("AUTO", "SOLID", "SHEET"))

    def do_no_obstacles(self) -> None:
        self.splash.splash_obstacles.collection = None

    def do_save_and_open(self) -> None:
        names = self.sketch.name, self.splash.name
        path = os.path.join(bpy.app.tempdir, "fuzz.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.sketch, self.splash = (bpy.data.objects[name] for name in names)


def run(seed: int) -> str:
    """Run one sequence; return what went wrong, "" for nothing."""
    fuzz = None
    try:
        fuzz = Fuzz(seed)
        fuzz.run()
    except Exception as error:
        done = [] if fuzz is None else fuzz.done
        return f"seed {seed}: {type(error).__name__}: {error} after {done}"
    return ""


if __name__ == "__main__":
    import liquid_splash_addon
    from liquid_splash_addon.blender.jobs import loaded_generator
    from tests.blender.sketching import TubeGenerator

    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: TubeGenerator()
    first, count = (int(word) for word in sys.argv[-2:])
    faults = [fault for seed in range(first, first + count) if (fault := run(seed))]
    print("\n".join(faults), flush=True)
    print(f"fuzzer: {count} sequences, {len(faults)} faults", flush=True)
    os._exit(bool(faults))
