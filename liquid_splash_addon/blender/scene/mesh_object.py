# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes as mesh objects: the mesh with its velocity, and the place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...core.settings import MotionSettings
from ..data.properties import assign_settings, to_settings
from .material import water_material
from .raw_strokes import rigid_matrix

if TYPE_CHECKING:
    from ...core.mesh.mesh import Mesh

NEAR = 1e-4
"""Two matrices whose entries differ by less (relative to their largest) count as the same."""


def write_mesh(data: bpy.types.Mesh, mesh: Mesh) -> None:
    """Replace the geometry of ``data``; materials and custom properties stay.

    By the attributes themselves, a quarter of the time that vertices and loops take one by one:
    Blender's interface waits for it. New faces are smooth. Velocities are those of real time.
    """
    data.clear_geometry()
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    data.vertices.add(len(mesh.vertices))
    data.loops.add(faces.size)
    data.polygons.add(len(faces))
    data.attributes["position"].data.foreach_set("vector", flat(mesh.vertices))
    data.attributes[".corner_vert"].data.foreach_set("value", faces.ravel())
    data.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    velocity = data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    velocity.data.foreach_set("vector", flat(mesh.velocities))
    data.splash_liquid.time_scale = 1.0
    data.update(calc_edges=True)


def read_triangles(data: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices, float32 ``(n, 3)``, and triangles, int32 ``(m, 3)``."""
    data.calc_loop_triangles()
    vertices = np.empty((len(data.vertices), 3), dtype=np.float32)
    faces = np.empty((len(data.loop_triangles), 3), dtype=np.int32)
    data.vertices.foreach_get("co", vertices.ravel())
    data.loop_triangles.foreach_get("vertices", faces.ravel())
    return vertices, faces


def flat(values: np.ndarray) -> np.ndarray:
    """Return ``values`` in the one form that ``foreach_set`` copies without converting."""
    return np.ascontiguousarray(values, dtype=np.float32).ravel()


def new_object(
    context: bpy.types.Context, sketch: bpy.types.Object, layer: str = ""
) -> bpy.types.Object:
    """Make an empty splash object at the place of ``sketch``.

    layer : the one layer of the sketch that the splash is for; empty for all visible layers.
    """
    name = f"Splash {layer}" if layer else "Splash"
    splash = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    splash.data.materials.append(water_material())
    collection_for(context, sketch).objects.link(splash)
    splash.matrix_world = rigid_matrix(sketch)
    splash.splash.sketch, splash.splash.layer = sketch, layer
    assign_settings(splash.splash_motion, to_settings(context.scene.splash_motion, MotionSettings))
    return splash


def plain_object(mesh: Mesh, name: str) -> bpy.types.Object:
    """Make an object of a mesh, drawing units, in the active collection, that is no splash."""
    data = bpy.data.meshes.new(name)
    write_mesh(data, mesh)
    data.materials.append(water_material())
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    return made


def collection_for(context: bpy.types.Context, origin: bpy.types.Object) -> bpy.types.Collection:
    """Return the collection for an object made of ``origin``: the same, if this scene shows it."""
    shown = {context.scene.collection, *context.scene.collection.children_recursive}
    for collection in origin.users_collection:
        if collection in shown and collection.is_editable:
            return collection
    return context.collection


def follow_sketch(splash: bpy.types.Object, sketch: bpy.types.Object) -> None:
    """Move the splash as its sketch has moved since the last run, keeping the user's own offset.

    A splash that has already moved along, as a child or because both were moved, stays.
    """
    then, now = matrix(splash.splash.sketch_matrix), rigid_matrix(sketch)
    moved = now @ then.inverted()
    carried = moved @ matrix(splash.splash.splash_matrix)
    place = world_matrix(splash)
    if not is_child(splash, sketch) and not is_near(place, carried):
        splash.matrix_world = moved @ place


def remember_place(splash: bpy.types.Object, sketch: bpy.types.Object) -> None:
    """Record the places of splash and sketch for the next :func:`follow_sketch`."""
    for name, place in (
        ("sketch_matrix", rigid_matrix(sketch)),
        ("splash_matrix", world_matrix(splash)),
    ):
        setattr(splash.splash, name, [value for row in place for value in row])


def world_matrix(item: bpy.types.Object) -> Matrix:
    """Return ``matrix_world``, also of hidden objects, for which Blender does not update it."""
    if item.constraints or item.parent_type != "OBJECT":
        return item.matrix_world.copy()
    if item.parent is None:
        return item.matrix_basis.copy()
    return world_matrix(item.parent) @ item.matrix_parent_inverse @ item.matrix_basis


def matrix(values: bpy.types.bpy_prop_array) -> Matrix:
    """Make a matrix from 16 ``values``, row by row."""
    return Matrix(np.reshape(values, (4, 4)).tolist())


def is_near(first: Matrix, second: Matrix) -> bool:
    """Whether two matrices are equal except for rounding."""
    one, other = np.array(first), np.array(second)
    return bool(np.abs(one - other).max() <= NEAR * np.abs(other).max())


def is_child(item: bpy.types.Object, ancestor: bpy.types.Object) -> bool:
    """Whether ``ancestor`` is among the parents of ``item``."""
    while item.parent is not None:
        item = item.parent
        if item == ancestor:
            return True
    return False
