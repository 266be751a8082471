# SPDX-License-Identifier: GPL-3.0-or-later
"""The obstacles of a splash: from Blender's objects to core's Obstacles."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np

from ..data.model import is_model
from ..data.properties import is_splash, owner_of, plain
from .mesh_object import read_triangles
from .mesh_space import liquid_inverse

if TYPE_CHECKING:
    from ...core.obstacles.obstacles import Obstacle

SOLID_TYPES = ("MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD")
"""Types of objects that may have faces once their modifiers are evaluated."""

MOST_KEPT = 64
"""Meshes of which is remembered what they were taken for."""


class Piece(NamedTuple):
    """An evaluated mesh of an obstacle: the object's own, or an instance.

    Attributes
    ----------
    item : the object in the collection
    source : the object whose mesh it is
    number : which instance it is, the same at every frame
    vertices, faces : ``(n, 3)`` in its own space, and ``(m, 3)``
    matrix : float64 ``(4, 4)``, from there to the world
    """

    item: bpy.types.Object
    source: bpy.types.Object
    number: tuple[int, ...]
    vertices: np.ndarray
    faces: np.ndarray
    matrix: np.ndarray

    @property
    def in_world(self) -> np.ndarray:
        """Its vertices in the world."""
        return self.vertices @ self.matrix[:3, :3].T + self.matrix[:3, 3]


class Found(NamedTuple):
    """The obstacles of a splash.

    Attributes
    ----------
    obstacles : in the splash's drawing space
    clearance : cells of air around them
    left_out : a sentence for each object that cannot be one
    """

    obstacles: list[Obstacle]
    clearance: float
    left_out: list[str]


_known: dict[str, Obstacle] = {}
"""Obstacles in their own space, by digests of their meshes: the last ones that were read."""


def forget() -> None:
    """Forget the obstacles that were read."""
    _known.clear()


def obstacles_of(splash: bpy.types.Object) -> Found:
    """Read the obstacles of a splash or a model.

    Everything counts that has triangles once it is evaluated: modifiers, instances and collections
    of instances; hidden objects do not. What each was taken for is noted for the panel.
    """
    group = splash.splash_obstacles
    clearance = plain(group.clearance)
    if group.collection is None:
        note(splash, [])
        return Found([], clearance, [])
    to_splash = liquid_inverse(splash)
    found: list[Obstacle] = []
    verdicts, left_out = [], []
    together: dict[tuple[str, str], list[Obstacle]] = {}
    for piece in pieces_of(bpy.context.evaluated_depsgraph_get(), candidates(group.collection)):
        names = piece.item.name, piece.source.name
        try:
            own = own_obstacle(piece)
        except ValueError as error:
            if names not in together:
                verdicts.append((piece.source.name, "left out"))
                left_out.append(f"{error}. Left out")
            continue
        together.setdefault(names, []).append(placed(own, to_splash @ piece.matrix))
    for (_, name), parts in together.items():
        joined = join(parts)
        found += joined
        verdicts.append((name, " and ".join(dict.fromkeys(map(verdict_on, joined)))))
    for item, reason in missing(group.collection, {names[0] for names in together}):
        verdicts.append((item.name, reason))
        if reason == NO_FACES:
            left_out.append(f"Obstacle '{item.name}' {reason}: left out")
    note(splash, verdicts)
    return Found(found, clearance, list(dict.fromkeys(left_out)))


NO_FACES, HIDDEN, LIQUID, NO_SURFACE = (
    "has no faces",
    "hidden, so it does not count",
    "belongs to a splash, so it does not count",
    "has no surface",
)


def missing(
    collection: bpy.types.Collection, counted: set[str]
) -> Iterator[tuple[bpy.types.Object, str]]:
    """Yield the objects of a collection that are no obstacles, and why."""
    for item in collection.all_objects:
        if item.name in counted:
            continue
        if is_liquid(item):
            yield item, LIQUID
        elif not item.visible_get():
            yield item, HIDDEN
        else:
            yield item, NO_FACES if item.type in SOLID_TYPES else NO_SURFACE


def note(splash: bpy.types.Object, verdicts: Sequence[tuple[str, str]]) -> None:
    """Keep for the panel what the obstacles were taken for."""
    text = "\n".join(f"{name}\t{verdict}" for name, verdict in dict.fromkeys(verdicts))
    if splash.is_editable and splash.splash_obstacles.verdicts != text:
        splash.splash_obstacles.verdicts = text


def verdict_on(obstacle: Obstacle) -> str:
    """Return what an obstacle was taken for, in a word or two."""
    return "solid" if obstacle.solid else "thin sheet"


def own_obstacle(piece: Piece) -> Obstacle:
    """Return a mesh as an obstacle in its own space. Raises ObstacleError."""
    from ...core.obstacles.obstacles import obstacle_from_mesh

    kind, name = chosen_kind(piece), piece.source.name
    digest = hashlib.sha256(f"{kind} {name}".encode())
    for values in (piece.vertices, piece.faces):
        digest.update(np.ascontiguousarray(values).tobytes())
    key = digest.hexdigest()
    if key not in _known:
        while len(_known) >= MOST_KEPT:
            del _known[next(iter(_known))]
        _known[key] = obstacle_from_mesh(piece.vertices, piece.faces, name, kind)
    return _known[key]


def chosen_kind(piece: Piece) -> str:
    """Return what an artist wants a mesh to count as: its own choice before its instancer's."""
    for item in (piece.source, piece.item):
        if item.is_property_set("splash_obstacle") and item.splash_obstacle.kind != "AUTO":
            return str(item.splash_obstacle.kind)
    return "AUTO"


def placed(obstacle: Obstacle, matrix: np.ndarray) -> Obstacle:
    """Return an obstacle moved by ``matrix`` ``(4, 4)``."""
    triangles = obstacle.triangles @ matrix[:3, :3].T + matrix[:3, 3]
    return replace(obstacle, triangles=triangles)


def join(parts: Sequence[Obstacle]) -> list[Obstacle]:
    """Return solids as one obstacle and sheets as another."""
    joined = []
    for solid in (True, False):
        same = [part for part in parts if part.solid == solid]
        if same:
            triangles = np.concatenate([part.triangles for part in same])
            joined.append(replace(same[0], triangles=triangles))
    return joined


def obstacles_key(obstacles: Sequence[Obstacle], clearance: float) -> tuple[str, float]:
    """Identify obstacles and clearance: equal keys, equal effect on the liquid."""
    from ...core.obstacles.obstacles import digest

    return digest(obstacles), clearance


def is_liquid(item: bpy.types.Object) -> bool:
    """Whether an object is a splash or a model, or belongs to one."""
    return is_splash(item) or is_model(item) or owner_of(item) is not None


def candidates(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """List the visible objects of a collection that are no liquid."""
    return [item for item in collection.all_objects if item.visible_get() and not is_liquid(item)]


def pieces_of(graph: bpy.types.Depsgraph, items: Sequence[bpy.types.Object]) -> Iterator[Piece]:
    """Yield the meshes of objects and of all that they instance, as they are evaluated.

    Some types of objects are listed twice, as themselves and as an instance of their surface.
    """
    wanted = {item.session_uid: item for item in items}
    seen = set()
    for instance in graph.object_instances:
        source = instance.object.original
        top = instance.parent.original if instance.is_instance else source
        item = wanted.get(top.session_uid)
        if item is None or instance.object.type not in SOLID_TYPES or is_liquid(source):
            continue
        if not instance.is_instance and source.type == "MESH" and not instance.show_self:
            continue
        triangles = shown_triangles(instance.object)
        if triangles is None or not len(triangles[1]):
            continue
        matrix = np.array(instance.matrix_world, dtype=np.float64)
        if source == item:
            mark = (item.session_uid, len(triangles[0]), len(triangles[1]), matrix.tobytes())
            if mark in seen:
                continue
            seen.add(mark)
        number = tuple(instance.persistent_id) if instance.is_instance else ()
        yield Piece(item, source, number, *triangles, matrix)


def solids(
    collection: bpy.types.Collection, splash: bpy.types.Object
) -> Iterator[bpy.types.Object]:
    """Yield the visible objects of a collection that may be obstacles, or instance some."""
    for item in candidates(collection):
        if item != splash and (item.type in SOLID_TYPES or item.is_instancer):
            yield item


def shown_triangles(shown: bpy.types.Object) -> tuple[np.ndarray, np.ndarray] | None:
    """Read the vertices ``(n, 3)`` of an evaluated object, in its space, and its triangles."""
    try:
        mesh = shown.to_mesh()
        return None if mesh is None else read_triangles(mesh)
    except RuntimeError:  # a type without geometry
        return None
    finally:
        shown.to_mesh_clear()
