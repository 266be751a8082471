# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes as mesh objects: the mesh with its velocity, and the place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.settings import MotionSettings
from ..data.properties import assign_settings, owner_of, to_settings
from . import carried, mesh_space, places
from .liquid_materials import material_of
from .material import water_material

if TYPE_CHECKING:
    from ...core.mesh.mesh import Mesh
    from ...core.refinement.shader_attributes import Attributes


def write_mesh(data: bpy.types.Mesh, mesh: Mesh, space: np.ndarray | None = None) -> None:
    """Replace the geometry of ``data``; materials and custom properties stay.

    By the attributes themselves, a quarter of the time that vertices and loops take one by one:
    Blender's interface waits for it. New faces are smooth. Velocities are those of real time.

    mesh : in drawing space
    space : from there to the mesh, ``(4, 4)``; by default as before, wherever an artist has moved
        its vertices since
    """
    space = mesh_space.space_of(data) if space is None else space
    mesh = moved_mesh(mesh, space)
    data.clear_geometry()
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
    edges, of_corners = mesh.edges  # Blender would take longer to find them
    data.vertices.add(len(mesh.vertices))
    data.edges.add(len(edges))
    data.loops.add(faces.size)
    data.polygons.add(len(faces))
    data.attributes["position"].data.foreach_set("vector", flat(mesh.vertices))
    data.attributes[".edge_verts"].data.foreach_set("value", edges.ravel())
    data.attributes[".corner_vert"].data.foreach_set("value", faces.ravel())
    data.attributes[".corner_edge"].data.foreach_set("value", of_corners.ravel())
    data.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    velocity = data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    velocity.data.foreach_set("vector", flat(mesh.velocities))
    data.splash_liquid.time_scale = 1.0
    mesh_space.remember(data, space, mesh.vertices)
    data.update()


def replace_mesh(
    item: bpy.types.Object,
    mesh: Mesh,
    space: np.ndarray | None = None,
    moved: np.ndarray | None = None,
    attributes: Attributes | None = None,
) -> list[str]:
    """Replace the mesh of a splash or a model, with what an artist had added to the old one.

    A mesh that other objects show too, as after Alt D, stays theirs: this one gets its own.

    space : see :func:`write_mesh`; moved : how the liquid moved in drawing space, ``(4, 4)``;
    attributes : what shaders know of its vertices
    Returns warnings about what could not be carried over.
    """
    if item.data.users - item.data.use_fake_user > 1:
        item.data = item.data.copy()
    before = mesh_space.space_of(item.data)
    space = before if space is None else space
    added = carried.read(item)
    write_mesh(item.data, mesh, space)
    own = {layer.name for layer in added.layers} if added is not None else set()
    found = (attributes or {}).items()
    write_attributes(item.data, {name: values for name, values in found if name not in own})
    if added is None:
        return []
    change = space @ (np.eye(4) if moved is None else moved) @ np.linalg.inv(before)
    carried.write(item, added, change)
    return [f"Attribute '{name}' could not be carried over to the new mesh" for name in added.lost]


def write_attributes(data: bpy.types.Mesh, attributes: Attributes) -> None:
    """Write what shaders know of the vertices, and note what that is."""
    for name, values in attributes.items():
        kind = "FLOAT_COLOR" if values.ndim == 2 else "FLOAT"
        kind = "INT" if values.dtype == np.int32 else kind
        field, _, number = carried.FIELDS[kind]
        layer = data.attributes.new(name, kind, "POINT")
        layer.data.foreach_set(field, np.ascontiguousarray(values, dtype=number).ravel())
    data.splash_liquid.attributes = " ".join(attributes)


def moved_mesh(mesh: Mesh, space: np.ndarray) -> Mesh:
    """Return a mesh moved by ``space`` ``(4, 4)``, its faces still outward."""
    if np.array_equal(space, np.eye(4)):
        return mesh
    linear = space[:3, :3]
    return replace(
        mesh,
        vertices=(mesh.vertices @ linear.T + space[:3, 3]).astype(np.float32),
        faces=mesh.faces[:, ::-1] if np.linalg.det(linear) < 0 else mesh.faces,
        velocities=(mesh.velocities @ linear.T).astype(np.float32),
    )


def respace(data: bpy.types.Mesh, space: np.ndarray) -> None:
    """Move a mesh, and its velocities, to another space than it is in, see ``mesh_space``."""
    before = mesh_space.space_of(data)
    if np.array_equal(before, space):
        return
    change = space @ np.linalg.inv(before)
    points, velocities = (np.empty(3 * len(data.vertices), dtype=np.float32) for _ in range(2))
    positions = data.attributes["position"].data
    positions.foreach_get("vector", points)
    moved = points.reshape(-1, 3) @ change[:3, :3].T + change[:3, 3]
    positions.foreach_set("vector", flat(moved))
    if velocity := data.attributes.get("velocity"):
        velocity.data.foreach_get("vector", velocities)
        velocity.data.foreach_set("vector", flat(velocities.reshape(-1, 3) @ change[:3, :3].T))
    if np.linalg.det(change[:3, :3]) < 0:
        data.flip_normals()
    mesh_space.remember(data, space, moved.astype(np.float32))
    data.update()


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
    splash.data.materials.append(material_of(context.scene.splash.settings.liquid))
    collection_for(context, sketch).objects.link(splash)
    splash.matrix_world = places.rigid_matrix(sketch)
    splash.splash.sketch, splash.splash.layer = sketch, layer
    show_in_local_views(splash, sketch)
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
    """Return the collection for an object made of ``origin``: one of its own, if it is shown."""
    shown = [layer.collection for layer in shown_layers(context.view_layer.layer_collection)]
    own = [item for item in shown if item in [*origin.users_collection]]
    for collection in (*own, context.collection, *shown):
        if collection in shown and collection.is_editable:
            return collection
    return context.scene.collection


def shown_layers(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    """Yield the collections of a view layer that show what is in them."""
    if layer.exclude or layer.hide_viewport or layer.collection.hide_viewport:
        return
    yield layer
    for child in layer.children:
        yield from shown_layers(child)


def show_in_local_views(item: bpy.types.Object, origin: bpy.types.Object) -> None:
    """Show an object in all local views that show what it was made of."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.type == "VIEW_3D" and space.local_view and origin.local_view_get(space):
                item.local_view_set(space, True)


def discard(item: bpy.types.Object) -> None:
    """Delete an object that was half made, with its mesh and what belongs to it."""
    for own in [other for other in item.children if owner_of(other) == item]:
        discard(own)
    bpy.data.meshes.remove(item.data)
