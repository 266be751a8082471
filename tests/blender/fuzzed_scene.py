# SPDX-License-Identifier: GPL-3.0-or-later
"""Random things that artists do to random scenes, and what must hold whatever they do.

python -m tests.blender.scene_fuzzer FIRST COUNT    sequences by their seeds, in Blender's module
"""

from __future__ import annotations

import random
from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.blender.scene import places
from liquid_splash_addon.blender.scene.mesh_space import liquid_matrix
from liquid_splash_addon.blender.scene.stroke_objects import read_sketch
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.refinement.stored_splash import strokes_of
from tests.blender.sketching import add_sketch, fan, splashes, vertices

LENGTH = 7
"""Operations in a sequence."""

MOST_OFF = 1e-4
"""Share of its size by which a splash may be off its sketch."""

NEAR = 0.15
"""Share of the sketch's size within which the mesh of tubes around its strokes lies."""


class FuzzedScene:
    """One sequence on one scene.

    Attributes
    ----------
    done : names of the operations so far
    is_offset : whether the artist has moved the splash away from its sketch
    """

    made_last = True

    def __init__(self, seed: int) -> None:
        self.dice = random.Random(seed)
        self.done: list[str] = []
        self.is_offset = False
        self.refused: list[str] = []
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.context.scene.splash.settings.resolution = "64"
        bpy.context.scene.splash.settings.real_size = 0.32
        bpy.context.scene.splash.start = BARE
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
