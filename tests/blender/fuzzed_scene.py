# SPDX-License-Identifier: GPL-3.0-or-later
"""Random things that artists do to random scenes, and what must hold whatever they do."""

from __future__ import annotations

import contextlib
import hashlib
import io
import random
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.blender.data.model import is_model
from liquid_splash_addon.blender.data.properties import is_splash, to_settings
from liquid_splash_addon.blender.scene import places
from liquid_splash_addon.blender.scene.mesh_space import liquid_matrix
from liquid_splash_addon.blender.scene.stroke_objects import read_sketch
from liquid_splash_addon.blender.scene.targets import others_of
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.refinement.stored_splash import strokes_of
from liquid_splash_addon.core.sketch.drawing import usable_drawings
from tests.blender.sketching import add_sketch, fan, splashes, vertices

LENGTH = 8
"""Operations in a sequence."""

MOST_OFF = 1e-4
"""Share of its size by which a splash may be off its sketch."""

NEAR = 0.15
"""Share of the sketch's size within which the mesh of tubes around its strokes lies."""

KINDS = ("meshes", "objects", "materials", "node_groups", "collections", "scenes", "curves")
"""Kinds of data that may be left behind."""


def leaves(way: Callable[..., Any]) -> Callable[..., Any]:
    """Mark an operation by which Blender itself leaves data behind, until the file is saved."""
    way.leaves = True  # type: ignore[attr-defined]
    return way


def travels(way: Callable[..., Any]) -> Callable[..., Any]:
    """Mark an operation that goes to another state of the file, and is no undo step itself."""
    way.travels = True  # type: ignore[attr-defined]
    return way


def rarely(way: Callable[..., Any]) -> Callable[..., Any]:
    """Mark an operation that takes long, and is done a twentieth as often as others."""
    way.weight = 0.05  # type: ignore[attr-defined]
    return way


class State(NamedTuple):
    """A state of the file, as undo is to bring it back.

    Attributes
    ----------
    sketch, splash : names of the two that it is about
    is_offset : whether the artist had moved the splash away from its sketch
    hashes : of every object and its parts: its mesh or strokes, its place, its settings
    """

    sketch: str
    splash: str
    is_offset: bool
    hashes: dict[str, str]


class FuzzedScene:
    """One sequence on one scene.

    Attributes
    ----------
    done : names of the operations so far
    refused : what Blender and the add-on have refused, in their words
    is_offset : whether the artist has moved the splash away from its sketch
    made_last : whether the splash could be made when it was last tried
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.dice = random.Random(seed)
        self.done: list[str] = []
        self.is_offset, self.made_last = False, True
        self.refused: list[str] = []
        self.states: list[State] = []
        self.at = 0
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.context.scene.splash.settings.resolution = "64"
        bpy.context.scene.splash.settings.real_size = 0.32
        bpy.context.scene.splash.start = BARE
        bpy.context.scene.splash.follow = self.dice.random() < 0.5
        bpy.context.scene.unit_settings.scale_length = self.dice.choice((1.0, 0.01))
        self.extent = self.dice.choice((0.02, 1.0, 1.0, 30.0))
        sketch = add_sketch(fan(size=self.extent)[: self.dice.choice((2, 6))], self.place())
        self.sketch_name = sketch.name
        bpy.context.view_layer.update()
        assert bpy.ops.splash.generate() == {"FINISHED"}
        self.splash_name = splashes()[0].name
        self.push("Begin")

    @property
    def sketch(self) -> bpy.types.Object:
        """The sketch, found by its name: undo and opening files make it another object."""
        return bpy.data.objects[self.sketch_name]

    @property
    def splash(self) -> bpy.types.Object:
        """The splash that is watched."""
        return bpy.data.objects[self.splash_name]

    def ways(self) -> dict[str, float]:
        """Return the names of all operations, with how often each is done."""
        names = [name for name in dir(self) if name.startswith("do_")]
        return {name: getattr(getattr(self, name), "weight", 1.0) for name in names}

    def chosen(self) -> list[str]:
        """Return the operations of this sequence."""
        ways = self.ways()
        return self.dice.choices(list(ways), list(ways.values()), k=LENGTH)

    def run(self, names: Sequence[str] | None = None) -> None:
        """Do the operations, make the splash again, check everything, and undo it all.

        names : of the operations; by default they follow from the seed
        """
        for name in self.chosen() if names is None else names:
            # Of its own, so that the others of a kept sequence may be left out.
            self.dice = random.Random(f"{self.seed} {self.done.count(name)} {name}")
            self.do(name)
            if self.is_over:
                break
        else:
            self.attempt(self.do_show_splash)  # type: ignore[attr-defined]
            self.do("do_regenerate")
            self.check()
        while self.at:
            self.step(-1)

    @property
    def is_over(self) -> bool:
        """Whether the sketch or the splash is gone for good."""
        return not {self.sketch_name, self.splash_name} <= set(bpy.data.objects.keys())

    def check(self) -> None:
        """Check that the splash is on its sketch, unless it could not be made or was moved away."""
        if self.made_last and not self.is_offset:
            off, far = self.off()
            assert off <= MOST_OFF, f"off its sketch by {off:.2g} of its size"
            assert far <= NEAR, f"the mesh is {far:.2g} of its size away from the strokes"

    def do(self, name: str) -> None:
        """Do an operation as an undo step, and check that it leaves nothing behind."""
        self.done.append(name)
        way = getattr(self, name)
        before = unused()
        printed = io.StringIO()
        with contextlib.redirect_stderr(printed):
            self.attempt(way)
            bpy.context.view_layer.update()
        assert "Traceback" not in printed.getvalue(), printed.getvalue()
        assert not [scene for scene in bpy.data.scenes if places.MARK in scene], "a scene is left"
        probes = [item for item in bpy.data.objects if item.name.startswith(places.NAME)]
        assert not probes, "a probe is left"
        if hasattr(way, "travels"):
            return
        if not hasattr(way, "leaves"):
            left = unused() - before
            assert not left, f"{left} are left"
        self.push(name)

    def attempt(self, way: Callable[[], object]) -> bool:
        """Do something that Blender or the add-on may refuse, in words."""
        try:
            way()
            return True
        except RuntimeError as error:
            assert "Traceback" not in str(error) and "Unexpected error" not in str(error), error
            self.refused.append(str(error))
            return False

    # Undo

    def push(self, name: str) -> None:
        """End an undo step, and remember the state after it."""
        bpy.ops.ed.undo_push(message=name)
        del self.states[self.at + 1 :]
        self.states.append(self.state())
        self.at = len(self.states) - 1

    def state(self) -> State:
        """Return the state of the file as it is now."""
        hashes = {
            f"{part} of {item.name_full}": value
            for item in bpy.data.objects
            for part, value in hashes_of(item).items()
        }
        return State(self.sketch_name, self.splash_name, self.is_offset, hashes)

    def begin_anew(self) -> None:
        """Remember no state before this one: a file was opened."""
        self.states.clear()
        self.push("Opened")

    def step(self, by: int) -> None:
        """Undo (-1) or redo (1) a step, and check that the state is what it was."""
        if not 0 <= self.at + by < len(self.states):
            return
        (bpy.ops.ed.undo if by < 0 else bpy.ops.ed.redo)()
        bpy.context.view_layer.update()
        self.at += by
        wanted = self.states[self.at]
        self.sketch_name, self.splash_name, self.is_offset, _ = wanted
        found = self.state()
        names = {*wanted.hashes, *found.hashes}
        wrong = sorted(name for name in names if wanted.hashes.get(name) != found.hashes.get(name))
        assert not wrong, f"{'undo' if by < 0 else 'redo'} does not bring back {wrong}"

    def off(self) -> tuple[float, float]:
        """Return how far the stored strokes, and the mesh, are from the drawn ones, of its size."""
        record = self.splash.splash
        objects = record.sketch, *others_of(self.splash)
        drawn, _ = read_sketch(objects, record.layer, record.settings.use_modifiers, np.eye(4))
        drawn, _, _ = usable_drawings(drawn)
        strokes = strokes_of(stored_liquid.read(self.splash.data)[0])
        frame, matrix = frame_from_text(record.frame), np.array(liquid_matrix(self.splash))
        world = np.concatenate([drawing.points for drawing in drawn])
        kept = np.concatenate([frame.points_to_drawing(s.points.astype(float)) for s in strokes])
        kept = kept @ matrix[:3, :3].T + matrix[:3, 3]
        place = np.array(places.world_matrix(self.splash), dtype=float)
        mesh = vertices(self.splash) @ place[:3, :3].T + place[:3, 3]
        size = np.linalg.norm(np.ptp(world, axis=0))
        # Drops may be farther away.
        far = np.quantile(cKDTree(world).query(mesh)[0], 0.9) / size
        assert len(kept) == len(world), "the strokes are others"
        return float(np.linalg.norm(kept - world, axis=1).max() / size), float(far)

    # Helpers

    def place(self) -> Matrix:
        """Return a random place and turn."""
        where = Vector(self.dice.uniform(-5, 5) for _ in range(3))
        turn = Euler([self.dice.uniform(-3, 3) for _ in range(3)])
        return Matrix.LocRotScale(where, turn, None)

    def take_in_hand(self, item: bpy.types.Object) -> None:
        """Refuse what is hidden: nobody moves it, and Blender says nothing of its moves."""
        if not item.visible_get():
            raise RuntimeError("it is hidden")

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
        drawing = self.drawing()
        attribute = drawing.attributes["position"]
        values = np.empty(3 * len(attribute.data), dtype=np.float32)
        attribute.data.foreach_get("vector", values)
        moved = change(values.reshape(-1, 3).astype(float)).astype(np.float32)
        attribute.data.foreach_set("vector", moved.ravel())
        self.sketch.data.update_tag()

    def size(self) -> float:
        """Return the size that the sketch was drawn in."""
        return float(self.extent)

    def drawing(self) -> Any:
        """Return the strokes of the first layer."""
        frame = self.sketch.data.layers[0].current_frame()
        if frame is None:
            raise RuntimeError("it has no strokes at this frame")
        return frame.drawing


def unused() -> set[tuple[str, str]]:
    """Return the data that nothing uses, by kind and name."""
    found = ((kind, item) for kind in KINDS for item in getattr(bpy.data, kind))
    return {
        (kind, item.name_full)
        for kind, item in found
        if not item.users or (item.users == 1 and item.use_fake_user)
    }


def hashes_of(item: bpy.types.Object) -> dict[str, str]:
    """Return hashes of an object's parts: its mesh or strokes, its place, its settings."""
    parent = item.parent.name if item.parent is not None else ""
    homes = sorted(home.name for home in item.users_collection)
    slots = [slot.material and slot.material.name for slot in item.material_slots]
    is_keyed = item.animation_data is not None  # then its place is the frame's
    place = () if is_keyed else [tuple(row) for row in item.matrix_basis]
    return {
        "geometry": hashlib.sha256(geometry_of(item)).hexdigest()[:12],
        "place": repr(place),
        "flags": repr((item.hide_viewport, item.hide_render, parent, item.mode, homes)),
        "materials": repr(slots),
        "settings": repr(record_of(item)),
    }


def geometry_of(item: bpy.types.Object) -> bytes:
    """Return the mesh or the strokes of an object, as bytes."""
    found = []
    if item.type == "MESH":
        points = np.empty(3 * len(item.data.vertices), dtype=np.float32)
        corners = np.empty(len(item.data.loops), dtype=np.int32)
        item.data.vertices.foreach_get("co", points)
        item.data.loops.foreach_get("vertex_index", corners)
        found += [points.tobytes(), corners.tobytes()]
        found.append(stored_liquid.identifier_of(item.data).encode())
    elif item.type == "GREASEPENCIL":
        for layer in item.data.layers:
            for frame in layer.frames:
                position = frame.drawing.attributes.get("position")
                if position is not None:
                    points = np.empty(3 * len(position.data), dtype=np.float32)
                    position.data.foreach_get("vector", points)
                    found.append(points.tobytes())
    return b" ".join(found)


def record_of(item: bpy.types.Object) -> tuple[object, ...]:
    """Return what a splash or a model remembers."""
    if is_splash(item):
        steps = [(step.settings, step.show) for step in item.splash_stack.items]
        return to_settings(item.splash.settings), item.splash.frame, steps, item.splash.made_of
    if is_model(item):
        return tuple((part.name, part.show) for part in item.splash_model.parts)
    return ()
