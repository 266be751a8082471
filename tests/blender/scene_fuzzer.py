# SPDX-License-Identifier: GPL-3.0-or-later
"""Random things that artists do to random scenes, and what must hold whatever they do.

python -m tests.blender.scene_fuzzer FIRST COUNT    sequences by their seeds, in Blender's module
"""

from __future__ import annotations

import os
import random
import sys
from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.blender.scene import places
from liquid_splash_addon.blender.scene.mesh_space import liquid_matrix
from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.blender.scene.stroke_objects import read_sketch
from liquid_splash_addon.core.refinement.stored_splash import strokes_of
from tests.blender.sketching import add_sketch, fan, line, splashes, vertices

LENGTH = 7
"""Operations in a sequence."""

MOST_OFF = 1e-4
"""Share of its size by which a splash may be off its sketch."""

NEAR = 0.15
"""Share of the sketch's size within which the mesh of tubes around its strokes lies."""


class Fuzz:
    """One sequence on one scene.

    Attributes
    ----------
    done : names of the operations so far
    is_offset : whether the artist has moved the splash away from its sketch
    """

    def __init__(self, seed: int) -> None:
        self.dice = random.Random(seed)
        self.done: list[str] = []
        self.is_offset = False
        self.refused: list[str] = []
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.context.scene.splash.settings.resolution = "64"
        bpy.context.scene.splash.settings.real_size = 0.32
        bpy.context.scene.splash.follow = self.dice.random() < 0.5
        bpy.context.scene.unit_settings.scale_length = self.dice.choice((1.0, 0.01))
        size = self.dice.choice((0.02, 1.0, 1.0, 30.0))
        self.sketch = add_sketch(fan(size=size)[: self.dice.choice((2, 6))], self.place())
        bpy.context.view_layer.update()
        assert bpy.ops.splash.generate() == {"FINISHED"}
        (self.splash,) = splashes()

    def run(self) -> None:
        """Do the operations, make the splash again, and check everything."""
        names = [name for name in dir(self) if name.startswith("do_")]
        for _ in range(LENGTH):
            name = self.dice.choice(names)
            self.done.append(name)
            self.attempt(getattr(self, name))
            bpy.context.view_layer.update()
        self.attempt(self.do_show_splash)
        self.attempt(self.do_regenerate)
        bpy.context.view_layer.update()
        self.check()

    def attempt(self, way: Callable[[], object]) -> bool:
        """Do something that Blender or the add-on may refuse, in words."""
        try:
            way()
            return True
        except RuntimeError as error:
            assert "Traceback" not in str(error) and "Unexpected error" not in str(error), error
            self.refused.append(str(error))
            return False

    def check(self) -> None:
        """Check that the splash is on its sketch and that nothing was left behind."""
        assert not [scene for scene in bpy.data.scenes if places.MARK in scene], "a scene is left"
        probes = [item for item in bpy.data.objects if item.name.startswith(places.NAME)]
        assert not probes, "a probe is left"
        orphans = [mesh.name for mesh in bpy.data.meshes if not mesh.users]
        assert not orphans, f"meshes {orphans} are left"
        if self.refused and "splash.generate" not in self.refused[-1] and self.failed_last():
            return
        if not self.is_offset:
            off, far = self.off()
            assert off <= MOST_OFF, f"off its sketch by {off:.2g} of its size"
            assert far <= NEAR, f"the mesh is {far:.2g} of its size away from the strokes"

    def failed_last(self) -> bool:
        """Whether the splash could not be made at the end: then it stays as it was."""
        return not self.made_last

    def off(self) -> tuple[float, float]:
        """Return how far the stored strokes, and the mesh, are from the drawn ones, of its size."""
        record = self.splash.splash
        drawn, _ = read_sketch(
            (record.sketch,), record.layer, record.settings.use_modifiers, np.eye(4)
        )
        strokes = strokes_of(stored_liquid.read(self.splash.data)[0])
        frame, matrix = frame_from_text(record.frame), np.array(liquid_matrix(self.splash))
        world = np.concatenate([drawing.points for drawing in drawn])
        kept = np.concatenate([frame.points_to_drawing(s.points.astype(float)) for s in strokes])
        kept = kept @ matrix[:3, :3].T + matrix[:3, 3]
        place = np.array(places.world_matrix(self.splash), dtype=float)
        mesh = vertices(self.splash) @ place[:3, :3].T + place[:3, 3]
        size = np.linalg.norm(np.ptp(world, axis=0))
        from scipy.spatial import cKDTree

        far = cKDTree(world).query(mesh)[0].max() / size
        assert len(kept) == len(world), "the strokes are others"
        return float(np.linalg.norm(kept - world, axis=1).max() / size), float(far)

    # Helpers

    def place(self) -> Matrix:
        """Return a random place and turn."""
        where = Vector(self.dice.uniform(-5, 5) for _ in range(3))
        turn = Euler([self.dice.uniform(-3, 3) for _ in range(3)])
        return Matrix.LocRotScale(where, turn, None)

    def activate(self, item: bpy.types.Object) -> None:
        """Make an object the only selected one."""
        if bpy.context.view_layer.objects.get(item.name) != item:
            raise RuntimeError("it is not in the view layer")
        if bpy.context.object is not None and bpy.context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        for other in bpy.context.view_layer.objects:
            other.select_set(False)
        bpy.context.view_layer.objects.active = item
        if item.visible_get():
            item.select_set(True)

    def link_new(self, name: str, data: object = None) -> bpy.types.Object:
        """Return a new object in the scene."""
        item = bpy.data.objects.new(name, data)
        bpy.context.scene.collection.objects.link(item)
        return item

    def to_collection(self, item: bpy.types.Object) -> bpy.types.Collection:
        """Move an object to a new collection."""
        found = bpy.data.collections.new("Own")
        bpy.context.scene.collection.children.link(found)
        for home in [*item.users_collection]:
            home.objects.unlink(item)
        found.objects.link(item)
        return found

    def points(self, change: Callable[[np.ndarray], np.ndarray]) -> None:
        """Move the sketch's points."""
        drawing = self.sketch.data.layers[0].current_frame().drawing
        attribute = drawing.attributes["position"]
        values = np.empty(3 * len(attribute.data), dtype=np.float32)
        attribute.data.foreach_get("vector", values)
        moved = change(values.reshape(-1, 3).astype(float)).astype(np.float32)
        attribute.data.foreach_set("vector", moved.ravel())
        self.sketch.data.update_tag()

    # What artists do: making

    made_last = True

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
        self.splash.parent = self.sketch
        inverse = np.linalg.inv(np.array(places.world_matrix(self.sketch), dtype=float))
        self.splash.matrix_parent_inverse = Matrix(inverse.tolist())

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
