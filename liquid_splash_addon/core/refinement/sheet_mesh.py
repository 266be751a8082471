# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of a finished mesh, found: their middle surface, their rims, what is film and what not.

Both sides of a sheet share one middle: the centres of the largest balls that fit under the surface
(the medial axis), averaged over both sides. A rim is where these balls reach the edge: there the
middle ends in a line, around which the surface turns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.laplacian import Laplacian, laplacian, mean_curvature
from ..mesh.local_thickness import half_thickness
from ..mesh.mesh import Mesh
from ..mesh.remeshing import isotropic
from ..numeric.cell_list import counting_sort
from ..numeric.triangles import vertex_normals
from ..sketch.strokes import Stroke, arc_length
from .sheet_loops import around, smooth, spread, stretching

EDGE = 0.8
"""Edges of the mesh, cells: finer than a grid's, as rims are round and as thick as a cell."""

THICKEST = 6.0
"""Cells up to which thickness is measured."""

FILM_ROOM, BULK_ROOM = 1.7, 2.8
"""Half the thickness in cells up to which liquid is film, and from which it stays as it is. The
switch is wide and smooth: a sharp one shows as a crease."""

RIM_BEND, FLAT_BEND = 0.28, 0.17
"""Mean curvature times half the thickness: more is a rim (0.5 on a tube), less is flat."""

RIM_ROOM = 2.4
"""Half the thickness in cells of the thickest rim."""

RIM_REACH = 6.0
"""Distance in cells within which a film knows of its rim, and a rim of its film."""

MIDDLE_WIDTH = 1.2
"""Width in cells of the Gaussian over which both sides' middles become one."""

RIM_WIDTH = 0.8
"""Width in cells of the Gaussian that draws the middles of a rim into one line."""

MOST_FAIRING = 0.5
"""Cells by which the middle surface is moved at most."""

LEAST_AGE, MOST_AGE = 0.01, 0.5
"""Seconds between which the times of flight are kept."""

USUAL_AGE = 0.05
"""Seconds of flight where no strokes are known: of a splash of 10 cm at 2 m/s."""

LOW_PASS = np.array([0.5, -0.53], dtype=np.float32)
"""Taubin's pair of steps: takes away bumps of up to 6 edges and keeps what is larger."""


@dataclass(frozen=True)
class SheetMesh:
    """A mesh prepared for sheets; it depends on none of the settings.

    Attributes
    ----------
    mesh : even triangles, local metres
    spacing : the grid's cell, metres
    first, near : int32, the neighbours of each vertex, see :class:`~..mesh.laplacian.Laplacian`
    middle : float32 ``(n, 3)``, where the vertex's middle is, m
    faired : float32 ``(n, 3)``, where it is after smoothing, m
    away : float32 ``(n, 3)``, unit, from the middle to the vertex
    room : float32 ``(n,)``, half the thickness, m, smoothed
    share : float32 ``(n,)``, 1 on film and its rims, 0 on what stays as it is
    rim_distance : float32 ``(n,)``, to the line in the middle of the nearest rim, m; or infinite
    rim : int32 ``(n,)``, the nearest vertex of a rim; -1
    age : float32 ``(n,)``, time of flight, s
    drawn : float32 ``(n,)``, divergence of the flow along the sheet, 1/s
    """

    mesh: Mesh
    spacing: float
    first: np.ndarray
    near: np.ndarray
    middle: np.ndarray
    faired: np.ndarray
    away: np.ndarray
    room: np.ndarray
    share: np.ndarray
    rim_distance: np.ndarray
    rim: np.ndarray
    age: np.ndarray
    drawn: np.ndarray


Kept = Callable[[np.ndarray], np.ndarray]
"""Returns for points ``(n, 3)``, m, how far they may be changed, 0..1: 0 at obstacles."""


def prepare_sheets(
    mesh: Mesh, spacing: float, strokes: Sequence[Stroke] = (), free: Kept | None = None
) -> SheetMesh:
    """Find the sheets of ``mesh`` (closed, local metres).

    spacing : the grid's cell, metres; strokes : from which times of flight come, local metres and
    m/s; free : where liquid may be changed. Raises NotClosedError.
    """
    remeshed = isotropic(mesh.vertices, mesh.faces, EDGE * spacing)
    even = Mesh(
        remeshed.vertices.astype(np.float32), remeshed.faces, remeshed.carry(mesh.velocities)
    )
    points = even.vertices
    if not len(points):
        none, whole = np.zeros(0, dtype=np.float32), np.zeros(0, dtype=np.int32)
        return SheetMesh(
            even, spacing, whole, whole, points, points, points, none, none, none, whole, none, none
        )  # fmt: skip
    calm, operator = calmed(even, spacing)
    first, near = operator.first, operator.near
    normals = vertex_normals(calm, even.faces)
    room = rooms(calm, normals, first, near, spacing)
    bend = mean_curvature(operator, calm, normals)
    bend = averaged(bend, first, near, 3) * room
    rims = (bend > RIM_BEND) & (room < RIM_ROOM * spacing)
    flat = (np.abs(bend) < FLAT_BEND) & (room < FILM_ROOM * spacing)
    flat = averaged(flat, first, near, 6) > 0.6  # an uneven jet has flat places too, but small ones
    middle = points - room[:, None] * normals
    faired, away, share = both_sides(middle, normals, room, rims, flat, first, near, spacing)
    if free is not None:
        share *= averaged(free(points).astype(np.float32), first, near, 3)
    distance, rim = spread(faired, first, near, rims, np.float32(RIM_REACH * spacing))
    away = turned_away(normals, away, distance / np.float32(spacing))
    return SheetMesh(
        even, spacing, first, near, points - room[:, None] * away, faired, away, room, share,
        distance, rim, ages(faired, strokes, first, near),
        averaged(stretching(points, even.velocities, even.faces), first, near, 12),
    )  # fmt: skip


def calmed(mesh: Mesh, spacing: float) -> tuple[np.ndarray, Laplacian]:
    """Return the vertices ``(n, 3)`` of a mesh without its short bumps, and its Laplacian there."""
    order, first = counting_sort(mesh.faces.reshape(-1), len(mesh.vertices))
    # The next vertex of every corner, by its own: in a closed mesh these are the neighbours.
    near = np.roll(mesh.faces, -1, axis=1).reshape(-1)[order]
    calm = smoothed(mesh.vertices, first, near, 6)
    return calm, laplacian(calm, mesh.faces, EDGE * spacing)


def smoothed(values: np.ndarray, first: np.ndarray, near: np.ndarray, rounds: int) -> np.ndarray:
    """Return values ``(n, k)`` without their short waves (LOW_PASS)."""
    out = values.astype(np.float32)
    smooth(out, first, near, np.tile(LOW_PASS, rounds))
    return out


def averaged(values: np.ndarray, first: np.ndarray, near: np.ndarray, rings: int) -> np.ndarray:
    """Return values ``(n,)``, each averaged with its neighbours, ``rings`` times."""
    out = values.astype(np.float32).reshape(-1, 1)
    smooth(out, first, near, np.full(rings, 0.7, dtype=np.float32))
    return out[:, 0]


def rooms(
    points: np.ndarray, normals: np.ndarray, first: np.ndarray, near: np.ndarray, spacing: float
) -> np.ndarray:
    """Return half the thickness at each vertex, m: of the inner ball, its logarithm averaged."""
    inward = half_thickness(points, normals, THICKEST * spacing)
    least = np.float32(0.05 * spacing)
    return np.exp(averaged(np.log(np.maximum(inward, least)), first, near, 6))


def both_sides(
    middle: np.ndarray, normals: np.ndarray, room: np.ndarray, rims: np.ndarray,
    flat: np.ndarray, first: np.ndarray, near: np.ndarray, spacing: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Return the faired middles ``(n, 3)``, the sheets' normals ``(n, 3)`` and shares ``(n,)``.

    The middle surface is smoothed along the mesh, and then drawn onto the planes through the
    middles of both sides. A rim's middles are drawn into one line.
    """
    wanted = smoothed(middle, first, near, 10)
    thin = np.clip((BULK_ROOM * spacing - room) / ((BULK_ROOM - FILM_ROOM) * spacing), 0, 1)
    thin = thin * thin * (3 - 2 * thin)
    touching, _ = spread(middle, first, near, flat, np.float32(RIM_REACH * spacing))
    beside = np.clip(2 - touching / np.float32(2 * spacing), 0, 1)  # a jet has no film beside it
    share = averaged(thin * beside, first, near, 5)
    weight = np.where(rims, 0.3, 1.0).astype(np.float32) * np.maximum(share, 1e-3)
    planes = np.zeros_like(wanted)
    changed = np.flatnonzero(share > 0.01)
    if len(changed):
        own = np.where(rims, 0, share)[changed].astype(np.float32)
        means, found = around(
            wanted[changed], wanted[changed], MIDDLE_WIDTH * spacing,
            weight[changed].astype(np.float32), own, normals[changed],
        )  # fmt: skip
        planes[changed] = found
        wanted[changed] -= ((wanted[changed] - means) * found).sum(axis=1, keepdims=True) * found
    if rims.any():
        line = wanted[rims]
        ones = np.ones(len(line), dtype=np.float32)
        for _ in range(2):
            line, _ = around(line, line, RIM_WIDTH * spacing, ones, ones, line)
        wanted[rims] = line
    move = wanted - middle
    size = np.linalg.norm(move, axis=1, keepdims=True)
    most = np.float32(MOST_FAIRING * spacing)
    move *= most * np.tanh(size / most) / np.maximum(size, 1e-12)
    return (middle + move).astype(np.float32), planes, share


def turned_away(normals: np.ndarray, planes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return unit vectors ``(n, 3)`` that are a sheet's normal, and the surface's own at a rim.

    cells : float32 ``(n,)``, distance to the rim.
    """
    side = np.sign((normals * planes).sum(axis=1, keepdims=True))
    film = 1 - np.exp(-((np.minimum(cells, 9) / 1.2) ** 2))[:, None]
    out = normals + film * (side * planes - normals)
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    return out.astype(np.float32)


def ages(
    points: np.ndarray, strokes: Sequence[Stroke], first: np.ndarray, near: np.ndarray
) -> np.ndarray:
    """Return the time of flight at each point ``(n, 3)``, s: that at the nearest points of strokes.

    Liquid comes from where a stroke begins, and has flown along it at its speed.
    """
    from scipy.spatial import cKDTree

    known = [(stroke.points, flight_times(stroke)) for stroke in strokes if len(stroke.points) > 1]
    if not known:
        return np.full(len(points), USUAL_AGE, dtype=np.float32)
    places = np.concatenate([place for place, _ in known])
    times = np.concatenate([time for _, time in known])
    _, nearest = cKDTree(places).query(points)
    return averaged(np.clip(times[nearest], LEAST_AGE, MOST_AGE), first, near, 12)


def flight_times(stroke: Stroke) -> np.ndarray:
    """Return the time (s) that liquid takes from a stroke's beginning to each of its points."""
    speed = np.linalg.norm(stroke.velocities.astype(np.float64), axis=1)
    steps = np.diff(arc_length(stroke.points))
    pace = np.maximum(0.5 * (speed[1:] + speed[:-1]), 0.01)
    return np.concatenate([[0.0], np.cumsum(steps / pace)])
