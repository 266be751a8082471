# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fuzzer does to obstacles, models, scenes and files, each in a method of its own."""

from __future__ import annotations

import os

import bpy

from liquid_splash_addon.blender.data.model import is_model
from tests.blender.drawing_panels import draw_all
from tests.blender.fuzzed_scene import FuzzedScene, leaves, travels


class InFile(FuzzedScene):
    """What artists do around a splash."""

    # Obstacles

    def do_obstacle(self) -> None:
        item = self.obstacle(
            self.dice.choice(("MESH", "CURVE", "EMPTY", "FONT", "META", "SURFACE"))
        )
        self.splash.splash_obstacles.collection = self.to_collection(item)

    def do_instanced_obstacle(self) -> None:
        held = self.to_collection(self.obstacle("MESH"))
        bpy.context.scene.collection.children.unlink(held)
        item = self.link_new("Instance")
        item.instance_type, item.instance_collection = "COLLECTION", held
        self.splash.splash_obstacles.collection = self.to_collection(item)

    def do_splash_as_obstacle(self) -> None:
        found = bpy.data.collections.new("Own")
        bpy.context.scene.collection.children.link(found)
        found.objects.link(self.splash)
        self.splash.splash_obstacles.collection = found

    def do_spoil_obstacle(self) -> None:
        for item in self.obstacles():
            way = self.dice.randrange(4)
            if way == 0:
                item.scale = (0, 0, 0)
            elif way == 1:
                item.hide_viewport = True
            elif way == 2:
                item.modifiers.new("Subdivision", "SUBSURF")
            elif item.type == "MESH" and item != self.splash:
                item.data.clear_geometry()

    def do_obstacle_in_the_way(self) -> None:
        for item in self.obstacles():
            if item != self.splash:
                item.matrix_world = self.sketch.matrix_world
                item.scale = [0.2 * self.size()] * 3

    def do_clearance(self) -> None:
        self.splash.splash_obstacles.clearance = self.dice.uniform(0, 0.01)

    @leaves
    def do_delete_obstacle(self) -> None:
        for item in self.obstacles():
            if item not in (self.splash, self.sketch):
                bpy.data.objects.remove(item)

    def do_obstacle_kind(self) -> None:
        collection = self.splash.splash_obstacles.collection
        for item in collection.all_objects if collection is not None else ():
            item.splash_obstacle.kind = self.dice.choice(("AUTO", "SOLID", "SHEET"))

    def do_no_obstacles(self) -> None:
        self.splash.splash_obstacles.collection = None

    def obstacle(self, kind: str) -> bpy.types.Object:
        """Return a new object of a type, away from the splash."""
        where = {"location": (7, 7, 7)}
        if kind == "EMPTY":
            return self.link_new("Bare")
        if kind == "MESH":
            shape = self.dice.choice(("cube", "plane", "uv_sphere"))
            getattr(bpy.ops.mesh, f"primitive_{shape}_add")(**where)
        elif kind == "CURVE":
            bpy.ops.curve.primitive_bezier_circle_add(**where)
            bpy.context.active_object.data.bevel_depth = self.dice.choice((0.0, 0.1))
        elif kind == "FONT":
            bpy.ops.object.text_add(**where)
        elif kind == "META":
            bpy.ops.object.metaball_add(**where)
        else:
            bpy.ops.surface.primitive_nurbs_surface_sphere_add(**where)
        return bpy.context.active_object

    def obstacles(self) -> list[bpy.types.Object]:
        """List the obstacles of the splash."""
        collection = self.splash.splash_obstacles.collection
        return [] if collection is None else [*collection.all_objects]

    # Models

    def do_layers_model(self) -> None:
        self.activate(self.sketch)
        bpy.ops.splash.generate_layers()

    def do_combine(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.combine()

    def do_model_settings(self) -> None:
        for model in self.models():
            model.splash_model.settings.blend = self.dice.uniform(0, 3)
            model.splash_model.settings.mirror_x = self.dice.random() < 0.3

    def do_hide_part(self) -> None:
        for model in self.models():
            for part in model.splash_model.parts:
                part.show = self.dice.random() < 0.7

    def do_remove_part(self) -> None:
        for model in self.models()[:1]:
            self.activate(model)
            bpy.ops.splash.part_remove()

    def do_update_model(self) -> None:
        for model in self.models()[:1]:
            self.activate(model)
            bpy.ops.splash.model_update()

    def do_copy_model(self) -> None:
        for model in self.models()[:1]:
            self.activate(model)
            bpy.ops.object.duplicate()

    @leaves
    def do_delete_model(self) -> None:
        for model in self.models()[:1]:
            self.activate(model)
            bpy.ops.object.delete()

    def models(self) -> list[bpy.types.Object]:
        """List the models of the scene."""
        return [item for item in bpy.context.scene.objects if is_model(item)]

    # Scenes and settings of the file

    def do_other_scene(self) -> None:
        other = bpy.data.scenes.new("Second")
        for item in bpy.context.scene.objects:
            if self.dice.random() < 0.8:
                other.collection.objects.link(item)
        bpy.context.window.scene = other

    def do_first_scene(self) -> None:
        bpy.context.window.scene = bpy.data.scenes[0]

    def do_view_layer(self) -> None:
        bpy.context.window.view_layer = bpy.context.scene.view_layers.new("Second")

    def do_units(self) -> None:
        bpy.context.scene.unit_settings.scale_length = self.dice.choice((0.001, 1.0, 100.0))

    def do_frame_rate(self) -> None:
        bpy.context.scene.render.fps = self.dice.choice((24, 25, 60))

    def do_preset_sketch(self) -> None:
        bpy.ops.splash.preset_sketch()

    def do_new_sketch(self) -> None:
        bpy.ops.splash.new_sketch()
        bpy.ops.object.mode_set(mode="OBJECT")

    def do_dismiss(self) -> None:
        bpy.ops.splash.dismiss()

    def do_panels(self) -> None:
        self.activate(self.dice.choice((self.sketch, self.splash)))
        draw_all()

    # Files and undo

    def do_save(self) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=self.path(), copy=True)

    @travels
    def do_save_and_open(self) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=self.path())
        bpy.ops.wm.open_mainfile(filepath=self.path())
        self.begin_anew()

    def do_append(self) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=self.path(), copy=True)
        with bpy.data.libraries.load(self.path()) as (_, wanted):
            wanted.objects = [self.splash_name]
        for item in wanted.objects:
            bpy.context.scene.collection.objects.link(item)

    @leaves
    def do_purge(self) -> None:
        bpy.ops.outliner.orphans_purge(do_recursive=True)

    @travels
    def do_undo(self) -> None:
        self.step(-1)

    @travels
    def do_undo_twice(self) -> None:
        self.step(-1)
        self.step(-1)

    @travels
    def do_redo(self) -> None:
        self.step(1)

    def path(self) -> str:
        """Return where the file is saved."""
        return os.path.join(bpy.app.tempdir, "fuzz.blend")
