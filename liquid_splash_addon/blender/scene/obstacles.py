# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that a splash keeps out of: a collection of them on each splash."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..data.properties import plain
from .grease_pencil import rigid_matrix

if TYPE_CHECKING:
    from ...core.obstacles.obstacles import Obstacle

SOLID_TYPES = ("MESH", "CURVE", "SURFACE", "META", "FONT")
"""Objects whose evaluated form has faces."""


def obstacles_of(splash: bpy.types.Object) -> tuple[list[Obstacle], float]:
    """Return the obstacles of ``splash`` in its own units, and the clearance in cells.

    Modifiers count, hidden objects do not. Raises ObstacleError for meshes that are none.
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


def solids(
    collection: bpy.types.Collection, splash: bpy.types.Object
) -> Iterator[bpy.types.Object]:
    """Yield the visible objects with faces; liquid is no obstacle."""
    for item in collection.all_objects:
        is_liquid = item.splash.is_splash or item.splash_model.is_model
        if item.type in SOLID_TYPES and item.visible_get() and not is_liquid:
            yield item


def evaluated_mesh(
    item: bpy.types.Object, graph: bpy.types.Depsgraph
) -> tuple[np.ndarray, np.ndarray]:
    """Return an object's vertices ``(n, 3)`` in the world and its triangles ``(m, 3)``."""
    shown = item.evaluated_get(graph)
    mesh = shown.to_mesh()
    try:
        mesh.calc_loop_triangles()
        vertices = np.empty((len(mesh.vertices), 3), dtype=np.float32)
        faces = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
        mesh.vertices.foreach_get("co", vertices.ravel())
        mesh.loop_triangles.foreach_get("vertices", faces.ravel())
    finally:
        shown.to_mesh_clear()
    matrix = np.array(item.matrix_world)
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], faces
