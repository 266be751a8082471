# SPDX-License-Identifier: GPL-3.0-or-later
"""Holes in the oldest and thinnest film, each with a rim of the film that it has eaten.

A hole of radius R in a film h has a rim of radius a with pi a^2 2 pi R = pi R^2 h, so
a = sqrt(h R / (2 pi)). Both sides of the film are opened around it and joined by a ring whose
section is that rim.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.mesh import Mesh
from ..mesh.self_intersection import crossing_faces
from .fingers import basis
from .settings import SheetSettings
from .sheet_mesh import SheetMesh

SMALLEST_HOLE, LARGEST_HOLE = 1.5, 4.0
"""Radii of holes, cells."""

AREA = 120.0
"""Cells^2 of film, both sides, for each hole at full strength."""

OLDEST = 0.5
"""Share of the film, by time of flight over thickness, that may open."""

LEAST_RIM = 0.35
"""Radius of the thinnest rim, cells."""

APRON = np.array([2.4, 1.7, 1.2, 0.8, 0.4])
"""Distances of the rings of film around a rim from its line, over the rim's radius."""

SEGMENT = 0.6
"""Length of the segments of a ring, cells."""


@dataclass(frozen=True)
class Hole:
    """A hole to be.

    Attributes
    ----------
    place, normal : ``(3,)``, its middle, m, and the film's unit normal
    inner, rim : radius of the hole and of its rim's section, m
    film : the film's thickness, m
    """

    place: np.ndarray
    normal: np.ndarray
    inner: float
    rim: float
    film: float

    @property
    def cut(self) -> float:
        """Distance from its middle, m, up to which film is replaced."""
        return self.inner + self.rim * (1 + float(APRON[0]))


def choose_holes(prepared: SheetMesh, film: np.ndarray, settings: SheetSettings) -> list[Hole]:
    """Return holes in the oldest and thinnest parts of the film, away from rims and each other.

    film : thickness at each vertex, m.
    """
    cell = prepared.spacing
    inside = (prepared.share > 0.98) & (prepared.rim_distance > 3.5 * cell)
    candidates = np.flatnonzero(inside)
    wanted = round(settings.holes * len(candidates) * 0.4 / AREA)
    if not wanted:
        return []
    score = prepared.age[candidates] / film[candidates]
    order = candidates[np.argsort(-score, kind="stable")[: round(OLDEST * len(candidates)) + 1]]
    rng = np.random.default_rng([settings.seed, 2])
    holes: list[Hole] = []
    for vertex in rng.permutation(order).tolist():
        inner = cell * rng.uniform(SMALLEST_HOLE, LARGEST_HOLE)
        room = float(prepared.rim_distance[vertex])
        inner = min(inner, 0.4 * room if np.isfinite(room) else inner)
        thick = float(film[vertex])
        rim = max(float(np.sqrt(thick * inner / (2 * np.pi))) * settings.rims, LEAST_RIM * cell)
        place = prepared.faired[vertex].astype(np.float64)
        hole = Hole(place, prepared.away[vertex].astype(np.float64), inner, rim, thick)
        apart = [np.linalg.norm(place - o.place) > hole.cut + o.cut + 2 * cell for o in holes]
        if inner >= SMALLEST_HOLE * cell and all(apart):
            holes.append(hole)
        if len(holes) == wanted:
            break
    return holes


def punch(
    mesh: Mesh, room: np.ndarray, prepared: SheetMesh, holes: list[Hole]
) -> tuple[Mesh, np.ndarray]:
    """Return the mesh with holes, and half its thickness at each vertex.

    The first vertices are those of ``prepared``. A hole that does not fit (the film around it is
    no disc, or its ring would cross other liquid) is left out.
    """
    for hole in holes:
        opened = opened_at(mesh, prepared, hole)
        if opened is not None:
            made, width = opened
            box = np.abs(made.vertices - hole.place).max(axis=1) < 2 * hole.cut
            close = made.faces[box[made.faces].any(axis=1)]
            if not crossing_faces(made.vertices, close).any():
                mesh, room = made, np.concatenate([room, width])
    return without_loose(mesh, room)


def opened_at(mesh: Mesh, prepared: SheetMesh, hole: Hole) -> tuple[Mesh, np.ndarray] | None:
    """Return the mesh with one hole, and half the thickness at its new vertices; None if it cannot.

    Vertices that it leaves without faces stay in their places.
    """
    count = len(prepared.faired)
    off = prepared.faired - hole.place
    within = np.zeros(len(mesh.vertices), dtype=bool)
    side = prepared.away @ hole.normal
    within[:count] = ((off**2).sum(axis=1) < hole.cut**2) & (np.abs(side) > 0.6)
    up = np.zeros(len(mesh.vertices), dtype=bool)
    up[:count] = side > 0
    gone = within[mesh.faces].any(axis=1)
    upper = gone & up[mesh.faces].all(axis=1)
    lower = gone & ~up[mesh.faces].any(axis=1)
    loops = [boundary(mesh.faces[part]) for part in (upper, lower)]
    if (gone & ~upper & ~lower).any() or not all(loops):
        return None
    first, second = basis(hole.normal)
    polar = []
    for loop in (loops[0], loops[1][::-1]):
        away = mesh.vertices[loop] - hole.place
        x, y, z = away @ first, away @ second, away @ hole.normal
        angle = np.unwrap(np.arctan2(y, x))
        if not (np.diff(angle) > 0).all() or angle[-1] - angle[0] >= 2 * np.pi:
            return None
        polar.append((np.array(loop), angle, np.hypot(x, y), z))
    start = float(polar[0][1][0])
    points, width, rings = ring_of(hole, polar, prepared.spacing)
    new = len(mesh.vertices) + np.arange(len(points)).reshape(rings, -1)
    faces = [
        mesh.faces[~gone],
        zipped(*polar[0][:2], new[0], start),
        bands(new),
        zipped(*polar[1][:2], new[-1], start)[:, ::-1],
    ]
    velocity = mesh.velocities[polar[0][0]].mean(axis=0)
    made = Mesh(
        np.concatenate([mesh.vertices, points.astype(np.float32)]),
        np.concatenate(faces).astype(np.int32),
        np.concatenate([mesh.velocities, np.tile(velocity, (len(points), 1))]).astype(np.float32),
    )
    return made, width.astype(np.float32)


def boundary(faces: np.ndarray) -> list[int]:
    """Return the boundary of a part of a mesh, counterclockwise; empty if it is no single ring."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()
    known = {(a, b) for a, b in ends}
    after = {a: b for a, b in ends if (b, a) not in known}
    if len(after) < 6 or len(after) != sum((b, a) not in known for a, b in ends):
        return []
    begin = next(iter(after))
    ring = [begin]
    while (at := after.get(ring[-1], -1)) != begin and at >= 0 and len(ring) <= len(after):
        ring.append(at)
    return ring if at == begin and len(ring) == len(after) else []


def ring_of(
    hole: Hole, polar: Sequence[tuple[np.ndarray, ...]], cell: float
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the vertices of the ring between both sides, half its thickness, and its rings.

    polar : for either side, its vertices, their angles, distances from the axis and heights. The
    middle between both sides is taken to be a paraboloid in every direction.
    """
    line = hole.inner + hole.rim
    around = max(16, int(np.ceil(2 * np.pi * line / (SEGMENT * cell))))
    start = polar[0][1][0]
    angles = start + np.arange(around) * 2 * np.pi / around
    bend = np.zeros(around)
    for _, angle, radius, height in polar:
        bend += 0.5 * np.interp(angles, angle, height / radius**2, period=2 * np.pi)
    neck = np.exp(-0.5 * (APRON / 0.85) ** 2)
    high = hole.film / 2 + (hole.rim - hole.film / 2) * neck
    turn = np.linspace(0, np.pi, 9)
    radii = np.concatenate(
        [line + hole.rim * APRON, line - hole.rim * np.sin(turn), line + hole.rim * APRON[::-1]]
    )
    heights = np.concatenate([high, hole.rim * np.cos(turn), -high[::-1]])
    width = np.concatenate([high, np.full(len(turn), hole.rim), high[::-1]])
    first, second = basis(hole.normal)
    outward = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
    lift = heights[:, None] + bend[None] * radii[:, None] ** 2
    points = hole.place + radii[:, None, None] * outward + lift[:, :, None] * hole.normal
    return points.reshape(-1, 3), np.repeat(width, around), len(radii)


def bands(rings: np.ndarray) -> np.ndarray:
    """Return the faces between rings ``(m, k)`` of vertices, outer before inner."""
    outer, inner = rings[:-1], rings[1:]
    outer_next, inner_next = np.roll(outer, -1, axis=1), np.roll(inner, -1, axis=1)
    first = np.stack([outer, outer_next, inner_next], axis=-1)
    second = np.stack([outer, inner_next, inner], axis=-1)
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


def zipped(loop: np.ndarray, angle: np.ndarray, ring: np.ndarray, start: float) -> np.ndarray:
    """Return the faces between a loop and the ring inside it, by angle.

    angle : of the loop's vertices, growing; start : that of the ring's first, the others are even.
    """
    first = 2 * np.pi * np.arange(len(ring) + 1) / len(ring)
    turned = (angle - start) % (2 * np.pi)
    begin = int(turned.argmin())
    loop, turned = np.roll(loop, -begin), np.roll(turned, -begin)
    outer = np.append(turned, turned[0] + 2 * np.pi)
    faces, i, j = [], 0, 0
    while i < len(loop) or j < len(ring):
        v, r = int(loop[i % len(loop)]), int(ring[j % len(ring)])
        if j == len(ring) or (i < len(loop) and outer[i + 1] <= first[j + 1]):
            faces.append((v, int(loop[(i + 1) % len(loop)]), r))
            i += 1
        else:
            faces.append((v, int(ring[(j + 1) % len(ring)]), r))
            j += 1
    return np.array(faces, dtype=np.int64)


def without_loose(mesh: Mesh, room: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """Return the mesh and its half thickness without vertices that no face has."""
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.faces] = True
    number = (np.cumsum(used) - 1).astype(np.int32)
    return Mesh(mesh.vertices[used], number[mesh.faces], mesh.velocities[used]), room[used]
