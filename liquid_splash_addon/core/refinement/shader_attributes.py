# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaders and geometry nodes can know of every vertex of a finished mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..mesh.laplacian import laplacian, mean_curvature
from ..mesh.local_thickness import thickness_and_clearance
from ..mesh.mesh import Mesh
from ..numeric.triangles import vertex_normals
from ..sketch.strokes import Stroke
from .flow_coordinates import flow_coordinates
from .sheet_loops import spread
from .sheet_mesh import EDGE, RIM_BEND, RIM_ROOM, THICKEST, averaged, smoothed

NO_RIM = 1.0
"""Metres that *rim* says where no free edge is connected: far away."""

NAMES = ("thickness", "rim", "age", "stroke", "along", "across", "tint", "tinted")
"""All attributes, beside velocity."""

Attributes = dict[str, np.ndarray]
"""Values by name: float32 or int32 ``(n,)``, or float32 ``(n, 4)`` for a colour."""


class Look(NamedTuple):
    """What shaders want to know of a mesh: all attributes.

    Attributes
    ----------
    colours : float32 ``(strokes, 4)``, linear, alpha 0 for strokes without one; None for no *tint*
    """

    colours: np.ndarray | None = None


def shader_attributes(
    mesh: Mesh, spacing: float, strokes: Sequence[Stroke] = (),
    room: np.ndarray | None = None, colours: np.ndarray | None = None,
) -> Attributes:  # fmt: skip
    """Return the attributes of a closed mesh in local metres, at real size.

    *thickness* (m) is the diameter of the largest ball inside that touches the vertex, up to six
    cells; *rim* (m) the distance to the nearest free edge, where the surface turns around the end
    of a sheet or of a tube; the others are those of :func:`flow_coordinates`.

    spacing : the grid's cell, m; room : float32 ``(k,)``, half the thickness of the first k
    vertices, m, where films are too thin to be measured between vertices; colours : of strokes.
    """
    if not len(mesh.vertices):
        none = np.zeros(0, dtype=np.float32)
        found: Attributes = dict.fromkeys(("thickness", "rim", "age", "along", "across"), none)
        found["stroke"] = none.astype(np.int32)
        tint = {"tint": np.zeros((0, 4), dtype=np.float32), "tinted": none}
        return found if colours is None else found | tint
    half, rim = half_and_rim(mesh, spacing, room)
    return {"thickness": 2 * half, "rim": rim} | flow_coordinates(mesh.vertices, strokes, colours)


def half_and_rim(
    mesh: Mesh, spacing: float, room: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return half the thickness and the distance to the nearest free edge, float32 ``(n,)``, m.

    A free edge is where mean curvature times half the thickness is that of an edge (0.5 on a tube).
    """
    points = mesh.vertices
    operator = laplacian(points, mesh.faces, EDGE * spacing)
    first, near = operator.first, operator.near
    known = 0 if room is None else len(room)
    half = np.empty(len(points), dtype=np.float32)
    if room is not None:
        half[:known] = room
    if known < len(points):
        normals = vertex_normals(points, mesh.faces)
        measured, _ = thickness_and_clearance(points, normals, THICKEST * spacing)
        least = np.float32(0.05 * spacing)
        measured = np.exp(averaged(np.log(np.maximum(measured, least)), first, near, 2))
        half[known:] = measured[known:]
    calm = smoothed(points, first, near, 2)
    bend = mean_curvature(operator, calm, vertex_normals(calm, mesh.faces))
    bend = averaged(bend, first, near, 3) * np.minimum(half, np.float32(RIM_ROOM * spacing))
    edges = (bend > RIM_BEND) & (half < RIM_ROOM * spacing)
    distance, _ = spread(points, first, near, edges, np.float32(NO_RIM))
    return half, np.minimum(distance, np.float32(NO_RIM))


def carried_room(before: Mesh, room: np.ndarray, mesh: Mesh, drops: np.ndarray) -> np.ndarray:
    """Return half the thickness at each vertex of a mesh with films, and then of drops, m.

    before, room : the mesh and its half thickness before waves; waves of short length have made
    it anew. drops : radius at each vertex of the drops' meshes, m.
    """
    if len(before.vertices) != len(mesh.vertices):
        from scipy.spatial import cKDTree

        room = room[cKDTree(before.vertices).query(mesh.vertices)[1]]
    return np.concatenate([room, drops]).astype(np.float32)
