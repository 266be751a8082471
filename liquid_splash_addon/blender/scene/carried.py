# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist added to a splash's mesh is carried over to the new one, by nearest surface.

UV layers, colours, vertex groups, other attributes and the materials of faces. A new face takes all
from the old triangle whose middle is nearest, so that seams stay seams.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import bpy
import numpy as np

FIELDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
}
"""Types of attributes that are carried: the name of their values, how many, and of what kind."""

OWN = {"position", "velocity", "custom_normal"}
"""What is written anew, or depends on it."""

FARTHEST = 1.0
"""How far beyond a triangle its UV are continued, in barycentric coordinates."""


class Layer(NamedTuple):
    """An attribute: name, type, domain, and its values ``(n, width)``."""

    name: str
    data_type: str
    domain: str
    values: np.ndarray


@dataclass
class Carried:
    """What was added to a mesh.

    Attributes
    ----------
    points : float64 ``(n, 3)``, the old vertices
    triangles, loops : ``(m, 3)``, their vertices and their corners
    polygon : ``(m,)``, which face each is of
    edges : ``(e, 2)``
    groups : of vertices, by name, with the weights ``(n,)``
    lost : names of what cannot be carried
    """

    points: np.ndarray
    triangles: np.ndarray
    loops: np.ndarray
    polygon: np.ndarray
    edges: np.ndarray
    layers: list[Layer] = field(default_factory=list)
    groups: dict[str, np.ndarray] = field(default_factory=dict)
    active: dict[str, Any] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)


def read(item: bpy.types.Object) -> Carried | None:
    """Read what was added to the mesh of an object; None if there is nothing."""
    data = item.data
    ours = data.splash_liquid.attributes.split()
    chosen = [a for a in data.attributes if is_added(a) and a.name not in ours]
    if not len(data.polygons) or not (chosen or item.vertex_groups):
        return None
    data.calc_loop_triangles()
    tables = data.loop_triangles
    found = Carried(
        values_of(data.vertices, "co", 3, np.float32).astype(np.float64),
        values_of(tables, "vertices", 3, np.int32),
        values_of(tables, "loops", 3, np.int32),
        values_of(tables, "polygon_index", 1, np.int32)[:, 0],
        values_of(data.edges, "vertices", 2, np.int32),
    )
    for attribute in chosen:
        if attribute.data_type in FIELDS:
            name, width, kind = FIELDS[attribute.data_type]
            values = values_of(attribute.data, name, width, kind)
            found.layers.append(
                Layer(attribute.name, attribute.data_type, attribute.domain, values)
            )
        else:
            found.lost.append(attribute.name)
    found.groups = weights_of(item)
    found.active = active_of(data)
    return found


def is_added(attribute: Any) -> bool:
    """Whether an attribute is an artist's."""
    is_ours = attribute.name in OWN or attribute.name.startswith(".")
    return not (is_ours or attribute.is_required or attribute.is_internal)


def values_of(owner: Any, name: str, width: int, kind: Any) -> np.ndarray:
    """Return a property of all entries of a collection, ``(n, width)``."""
    values = np.empty((len(owner), width), dtype=kind)
    owner.foreach_get(name, values.ravel())
    return values


def weights_of(item: bpy.types.Object) -> dict[str, np.ndarray]:
    """Return the weights of an object's vertex groups by name, NaN where a vertex is in none."""
    tables = [np.full(len(item.data.vertices), np.nan) for _ in item.vertex_groups]
    if tables:
        for vertex in item.data.vertices:
            for entry in vertex.groups:
                tables[entry.group][vertex.index] = entry.weight
    return {group.name: table for group, table in zip(item.vertex_groups, tables, strict=True)}


def active_of(data: bpy.types.Mesh) -> dict[str, Any]:
    """Return the names of the active UV layer and of the active colours."""
    uv, render = data.uv_layers.active, [uv.name for uv in data.uv_layers if uv.active_render]
    colours = data.color_attributes
    return {
        "uv": None if uv is None else uv.name,
        "uv render": render[0] if render else None,
        "colour": colours.active_color_name if len(colours) else "",
        "colour render": colours.default_color_name if len(colours) else "",
    }


def write(item: bpy.types.Object, carried: Carried, change: np.ndarray) -> None:
    """Give the new mesh of an object what the old one had.

    change : how the old vertices are moved to lie on the new mesh, ``(4, 4)``
    """
    from scipy.spatial import cKDTree

    data = item.data
    if not len(data.polygons):
        return
    old = carried.points @ change[:3, :3].T + change[:3, 3]
    new = values_of(data.vertices, "co", 3, np.float32).astype(np.float64)
    faces = values_of(data.loops, "vertex_index", 1, np.int32).reshape(-1, 3)
    tree = cKDTree(old[carried.triangles].mean(axis=1))
    at_face = tree.query(new[faces].mean(axis=1))[1]
    at_point = tree.query(new)[1]
    share = barycentric(new, old[carried.triangles[at_point]], 0.0)
    corners = old[carried.triangles[np.repeat(at_face, 3)]]
    corner_share = barycentric(new[faces.ravel()], corners, FARTHEST)
    for layer in carried.layers:
        if layer.domain == "POINT":
            values = mixed(layer.values[carried.triangles[at_point]], share)
        elif layer.domain == "CORNER":
            values = mixed(layer.values[carried.loops[np.repeat(at_face, 3)]], corner_share)
        elif layer.domain == "FACE":
            values = layer.values[carried.polygon[at_face]]
        elif layer.domain == "EDGE" and len(carried.edges):
            edges = values_of(data.edges, "vertices", 2, np.int32)
            middles = cKDTree(old[carried.edges].mean(axis=1))
            values = layer.values[middles.query(new[edges].mean(axis=1))[1]]
        else:
            continue
        write_layer(data, layer, values)
    for name, weights in carried.groups.items():
        of_corners = weights[carried.triangles[at_point]]
        held = np.isfinite(of_corners)
        values = np.where(held, of_corners, 0.0)
        write_group(item, name, (values * share).sum(axis=1), (held * share).sum(axis=1) >= 0.5)
    make_active(data, carried.active)


def barycentric(points: np.ndarray, corners: np.ndarray, beyond: float) -> np.ndarray:
    """Return the barycentric coordinates ``(n, 3)`` of points in triangles ``(n, 3, 3)``.

    beyond : how far outside they may be
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb = ((u * v).sum(axis=1) for u, v in ((a, a), (a, b), (b, b)))
    pa, pb = (p * a).sum(axis=1), (p * b).sum(axis=1)
    area = aa * bb - ab * ab
    flat = area <= 1e-12 * np.maximum(aa * bb, 1e-300)
    area = np.where(flat, 1.0, area)
    v = np.where(flat, 1 / 3, (bb * pa - ab * pb) / area)
    w = np.where(flat, 1 / 3, (aa * pb - ab * pa) / area)
    found = np.stack([1 - v - w, v, w], axis=1)
    far = ((found < -beyond) | (found > 1 + beyond)).any(axis=1)
    found[far] = found[far].clip(0, 1)
    return np.asarray(found / found.sum(axis=1, keepdims=True))


def mixed(values: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Mix the values ``(n, 3, width)`` of triangles' corners; those that cannot be, by nearest."""
    if values.dtype == np.float32:
        return np.asarray((values * share[:, :, None]).sum(axis=1), dtype=np.float32)
    return np.asarray(values[np.arange(len(values)), share.argmax(axis=1)])


def write_layer(data: bpy.types.Mesh, layer: Layer, values: np.ndarray) -> None:
    """Write an attribute."""
    found = data.attributes.get(layer.name)
    if found is None or found.data_type != layer.data_type or found.domain != layer.domain:
        if found is not None:
            data.attributes.remove(found)
        found = data.attributes.new(layer.name, layer.data_type, layer.domain)
    name, _, kind = FIELDS[layer.data_type]
    found.data.foreach_set(name, np.ascontiguousarray(values, dtype=kind).ravel())


def write_group(
    item: bpy.types.Object, name: str, weights: np.ndarray, members: np.ndarray
) -> None:
    """Write a vertex group."""
    group = item.vertex_groups.get(name) or item.vertex_groups.new(name=name)
    chosen = np.flatnonzero(members)
    rounded = np.round(weights[chosen], 4)
    for weight in np.unique(rounded):
        group.add(chosen[rounded == weight].tolist(), float(weight), "REPLACE")


def make_active(data: bpy.types.Mesh, active: dict[str, Any]) -> None:
    """Make those UV layers and colours active that were."""
    layers = data.uv_layers
    if active["uv"] is not None and active["uv"] in layers:
        layers.active = layers[active["uv"]]
    if active["uv render"] is not None and active["uv render"] in layers:
        layers[active["uv render"]].active_render = True
    if active["colour"] in data.color_attributes:
        data.color_attributes.active_color_name = active["colour"]
    if active["colour render"] in data.color_attributes:
        data.color_attributes.default_color_name = active["colour render"]
