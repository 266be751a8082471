# SPDX-License-Identifier: GPL-3.0-or-later
"""Obstacles that move: their triangles at every frame, read one frame at a time.

They are evaluated in a scene of their own that holds nothing else: the user's scene stays at its
frame, and what else is in it costs no time. Rigid bodies are known to their own scene alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..data import opened_files
from .objects import Handle
from .obstacles import chosen_kind, pieces_of

NAME = "Splash Obstacles (temporary)"
MARK = "splash_obstacles_only"
"""Custom property of a scene that is to be removed, should a file have been saved with it."""


@dataclass
class Moving:
    """An obstacle as it is read.

    Attributes
    ----------
    name : of the object
    kind : what it is to count as, see core's obstacles
    poses : its vertices, float32 ``(n, 3)``, at every frame so far
    faces : int32 ``(m, 3)``
    is_changing : whether its triangles are not the same ones at every frame: then it is taken to
        stand still
    """

    name: str
    kind: str = "AUTO"
    poses: list[np.ndarray] = field(default_factory=list)
    faces: np.ndarray | None = None
    is_changing: bool = False

    def add(self, points: np.ndarray, faces: np.ndarray) -> None:
        """Add what it is at the next frame."""
        if self.faces is None:
            self.faces = faces
        elif len(points) != len(self.poses[0]) or not np.array_equal(faces, self.faces):
            self.is_changing = True
            points = self.poses[0]
        is_same = bool(self.poses) and np.array_equal(points, self.poses[-1])
        self.poses.append(self.poses[-1] if is_same else points)

    def stacked(self) -> np.ndarray:
        """Return its poses ``(p, n, 3)``, a single one where it does not move."""
        if all(pose is self.poses[0] for pose in self.poses):
            return self.poses[0][None]
        return np.stack(self.poses)


class Sampler:
    """Reads obstacles frame by frame, in Blender's own thread; :meth:`end` must follow."""

    def __init__(
        self, scene: bpy.types.Scene, items: Sequence[bpy.types.Object], to_splash: np.ndarray
    ) -> None:
        """Take the obstacles; to_splash : ``(4, 4)``, from the world to where they are wanted."""
        self._items = [Handle.of(item) for item in items]
        self._found: dict[tuple[object, ...], Moving] = {}
        self._count = 0
        self._scene = scene.name
        self._own = ""
        self._is_physical = any(item.rigid_body is not None for item in items)
        self._frame = scene.frame_current
        self._to_splash = to_splash

    @property
    def moving(self) -> list[Moving]:
        """The obstacles: the objects' own meshes and their instances."""
        return list(self._found.values())

    def sample(self, frame: int) -> None:
        """Read the obstacles at a frame of the scene; one that is gone stays as it was."""
        graph = self._evaluated(frame).view_layers[0].depsgraph
        items = [item for item in (handle.find() for handle in self._items) if item is not None]
        for piece in pieces_of(graph, items):
            key = (piece.item.session_uid, piece.source.session_uid, piece.number)
            new = Moving(piece.source.name, chosen_kind(piece))
            moving = self._found.setdefault(key, new)
            place = self._to_splash @ piece.matrix
            points = piece.vertices @ place[:3, :3].T + place[:3, 3]
            while len(moving.poses) <= self._count:  # more than one where it was not there before
                moving.add(points.astype(np.float32), piece.faces)
        self._count += 1
        for moving in self.moving:
            if len(moving.poses) < self._count:
                moving.poses.append(moving.poses[-1])

    def end(self) -> None:
        """Remove the scene; with rigid bodies, show the frame that was shown."""
        if self._is_physical and self._scene in bpy.data.scenes:
            bpy.data.scenes[self._scene].frame_set(self._frame)
        scene = bpy.data.scenes.get(self._own)
        if scene is not None and MARK in scene:
            bpy.data.scenes.remove(scene)
        self._own = ""

    def _evaluated(self, frame: int) -> bpy.types.Scene:
        """Return the scene in which the obstacles are as they are at ``frame``."""
        real = bpy.data.scenes[self._scene]
        if self._is_physical:
            real.frame_set(frame)
            return real
        scene = bpy.data.scenes.get(self._own) or self._new_scene(real)  # undo may have removed it
        scene.frame_set(frame)
        return scene

    def _new_scene(self, real: bpy.types.Scene) -> bpy.types.Scene:
        scene = bpy.data.scenes.new(NAME)
        scene[MARK] = True
        self._own = scene.name
        for name in ("fps", "fps_base", "frame_map_old", "frame_map_new"):
            setattr(scene.render, name, getattr(real.render, name))
        for handle in self._items:
            item = handle.find()
            if item is not None:
                scene.collection.objects.link(item)
        return scene


@bpy.app.handlers.persistent
def remove_left_over(_file: object = None, _unused: object = None) -> None:
    """Remove the scene from a file that was saved while obstacles were read."""
    for scene in [*bpy.data.scenes]:
        if MARK in scene and scene.is_editable:
            bpy.data.scenes.remove(scene)


def register() -> None:
    """Look for it in files that are opened."""
    opened_files.listen(remove_left_over)


def unregister() -> None:
    """Leave files alone."""
    opened_files.ignore(remove_left_over)
