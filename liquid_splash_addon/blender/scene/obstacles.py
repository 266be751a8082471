# SPDX-License-Identifier: GPL-3.0-or-later
"""The obstacles of a splash: from Blender's objects to core's Obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..data.model import is_model
from ..data.properties import is_splash, plain
from .mesh_object import read_triangles
from .raw_strokes import rigid_matrix

if TYPE_CHECKING:
    from ...core.obstacles.obstacles import Obstacle

SOLID_TYPES = ("MESH", "CURVE", "SURFACE", "META", "FONT")
"""Types of objects that have faces once their modifiers are evaluated."""


def obstacles_of(splash: bpy.types.Object) -> tuple[list[Obstacle], float]:
    """Read the obstacles of ``splash``, in its own space, and the clearance in cells.

    Modifiers count, hidden objects do not. Raises ObstacleError for a mesh that cannot be one.
    """
    group = splash.splash_obstacles
    if group.collection is None:
        return [], plain(group.clearance)
    from ...core.obstacles.obstacles import obstacle_from_mesh

    to_splash = np.array(rigid_matrix(splash).inverted())
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    for item in solids(group.collection, splash):
        vertices, faces = evaluated_mesh(item, graph)
        points = vertices @ to_splash[:3, :3].T + to_splash[:3, 3]
        found.append(obstacle_from_mesh(points, faces, item.name))
    return found, plain(group.clearance)


def obstacles_key(obstacles: Sequence[Obstacle], clearance: float) -> tuple[str, float]:
    """Identify obstacles and clearance: equal keys, equal effect on the liquid."""
    from ...core.obstacles.obstacles import digest

    return digest(obstacles), clearance


def solids(
    collection: bpy.types.Collection, splash: bpy.types.Object
) -> Iterator[bpy.types.Object]:
    """Yield the visible objects that have faces, except splashes and models."""
    for item in collection.all_objects:
        is_liquid = is_splash(item) or is_model(item)
        if item.type in SOLID_TYPES and item.visible_get() and not is_liquid:
            yield item


def shown_triangles(shown: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Read the vertices ``(n, 3)`` of an evaluated object, in its space, and its triangles."""
    try:
        return read_triangles(shown.to_mesh())
    finally:
        shown.to_mesh_clear()


def evaluated_mesh(
    item: bpy.types.Object, graph: bpy.types.Depsgraph
) -> tuple[np.ndarray, np.ndarray]:
    """Read an object's vertices ``(n, 3)`` in the world and its triangles ``(m, 3)``."""
    vertices, faces = shown_triangles(item.evaluated_get(graph))
    matrix = np.array(item.matrix_world)
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], faces
