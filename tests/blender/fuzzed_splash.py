# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fuzzer does to a splash, each in a method of its own."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from liquid_splash_addon.blender.data.properties import is_splash
from liquid_splash_addon.blender.scene import places
from liquid_splash_addon.core.liquids import LIQUIDS
from liquid_splash_addon.core.refinement.presets import PRESETS
from liquid_splash_addon.core.refinement.settings import KINDS
from tests.blender.fuzzed_scene import FuzzedScene, leaves, rarely


class OnSplash(FuzzedScene):
    """What artists do to make a splash, and to what was made."""

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
        if len(self.splash.splash_stack.items) < 4:
            bpy.ops.splash.refinement_add(kind=self.dice.choice(sorted(KINDS)))

    def do_unrefine(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_remove()

    def do_drops(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.drop_points()

    def do_follow(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.follow(on=self.dice.random() < 0.5)

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
        self.take_in_hand(self.splash)
        self.splash.matrix_world = self.place()
        self.is_offset = True

    def do_scale_splash(self) -> None:
        self.take_in_hand(self.splash)
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
        self.splash_name = copy.name

    def do_copy(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.duplicate()
        self.splash_name = bpy.context.view_layer.objects.active.name

    def do_generate(self) -> None:
        self.activate(self.sketch)
        bpy.ops.splash.generate()

    def do_preset_list(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_preset(preset=self.dice.choice(sorted(PRESETS)))

    def do_refinement_slider(self) -> None:
        for item in self.splash.splash_stack.items:
            if hasattr(item.group, "seed"):
                item.group.seed = self.dice.randrange(9)
            elif hasattr(item.group, "amplitude"):
                item.group.amplitude = self.dice.uniform(0, 0.003)

    def do_eye_of_refinement(self) -> None:
        for item in self.splash.splash_stack.items:
            item.show = self.dice.random() < 0.5

    def do_move_refinement(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_move(direction=self.dice.choice(("UP", "DOWN")))

    def do_apply_refinements(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_apply()

    def do_update_refinements(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.refinement_update()

    def do_flow_on(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.flow_on()

    def do_delete_drops(self) -> None:
        if (drops := self.splash.splash_stack.points) is not None:
            for home in [*drops.users_collection]:
                home.objects.unlink(drops)

    def do_settings(self) -> None:
        settings = self.splash.splash.settings
        settings.seed, settings.variation = self.dice.randrange(99), self.dice.random()
        settings.surface_threshold = self.dice.uniform(0.4, 0.6)
        settings.breakup = self.dice.choice((0.0, 1.0))
        settings.reach = self.dice.choice((0.0, 0.05))

    def do_constant_speed(self) -> None:
        self.splash.splash.settings.speed_source = "CONSTANT"

    def do_divergence_free(self) -> None:
        self.splash.splash.settings.divergence_free = True

    def do_live(self) -> None:
        scene = bpy.context.scene.splash
        scene.live = not scene.live

    @leaves
    def do_liquid(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.liquid(liquid=self.dice.choice(sorted(LIQUIDS)))

    def do_time_scale(self) -> None:
        self.splash.splash_motion.time_scale = self.dice.uniform(0.02, 1.0)

    def do_ballistic_preview(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.ballistic_preview()

    def do_no_ballistic_preview(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.ballistic_remove()

    def do_two_poses(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.two_pose_mesh()

    @rarely
    def do_simulate(self) -> None:
        settings = self.splash.splash_simulation.settings
        settings.frames, settings.resolution = 1, "64"
        self.activate(self.splash)
        bpy.ops.splash.simulate()

    def do_delete_simulation(self) -> None:
        self.activate(self.splash)
        bpy.ops.splash.simulation_delete()

    def do_rename_splash(self) -> None:
        splash = self.splash
        splash.name = "Всплеск 1"
        self.splash_name = splash.name

    def do_modifier(self) -> None:
        self.splash.modifiers.new("Own", self.dice.choice(("DECIMATE", "DISPLACE", "SMOOTH")))

    @leaves
    def do_convert_splash(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.convert(target="MESH")

    def do_own_attribute(self) -> None:
        name, kind = self.dice.choice((("foam", "FLOAT"), ("position_before", "FLOAT_VECTOR")))
        self.splash.data.attributes.new(name, kind, "POINT")

    @leaves
    def do_no_materials(self) -> None:
        self.splash.data.materials.clear()

    def do_shape_key(self) -> None:
        self.splash.shape_key_add(name="Basis")

    def do_shade(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.shade_flat()

    def do_through_edit_mode(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.object.mode_set(mode="OBJECT")

    def do_empty_mesh(self) -> None:
        self.splash.data.clear_geometry()

    @leaves
    def do_join(self) -> None:
        bpy.ops.mesh.primitive_cube_add(size=0.01)
        cube = bpy.context.active_object
        self.activate(self.splash)
        cube.select_set(True)
        bpy.ops.object.join()

    @leaves
    def do_single_user(self) -> None:
        self.splash.data = self.splash.data.copy()

    def do_constrain_splash(self) -> None:
        target = self.link_new("Splash Target")
        target.matrix_world = self.place()
        self.splash.constraints.new("COPY_LOCATION").target = target
        self.is_offset = True

    def do_free_splash(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.parent_clear(type="CLEAR_KEEP_TRANSFORM")

    def do_exclude_splash(self) -> None:
        name = self.to_collection(self.splash).name
        bpy.context.view_layer.layer_collection.children[name].exclude = True

    def do_hide_render(self) -> None:
        self.splash.hide_render = True

    def do_custom_property(self) -> None:
        self.splash["mine"] = [1.0, 2.0]
        self.splash.data["mine"] = "text"

    @leaves
    def do_delete_and_generate(self) -> None:
        self.activate(self.splash)
        bpy.ops.object.delete()
        self.activate(self.sketch)
        bpy.ops.splash.generate()
        active = bpy.context.view_layer.objects.active
        if is_splash(active):  # a hidden one was not deleted, and its model is active
            self.splash_name = active.name
        self.is_offset = False
