# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingers that grow from the beads of a rim along the outward flow, and the drops that they shed.

A finger is a tube in the place of the faces around one vertex of its bead, so that the mesh stays
closed. Its tip is that vertex.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..mesh.mesh import Mesh
from ..mesh.self_intersection import crossing_faces
from ..mesh.spheres import spheres
from ..numeric.cell_list import counting_sort
from .drop_meshes import DropCloud
from .settings import SMALLEST_RADIUS, SheetSettings

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

LENGTH = 12.0
"""Length of a finger at full strength, radii of its rim."""

THIN = 0.62
"""Radius of a finger over that of its rim."""

TIP = 1.3
"""Radius of its round tip over its own."""

OUTWARD = 0.3
"""Share of the flow's speed that must lead out of the sheet."""

TILT = 0.12
"""Spread of the fingers' directions, radians."""

DROP_RADIUS = 1.9
"""Radius of shed drops over that of their finger (Rayleigh)."""

DROP_GAP = 6.0
"""Distance of drops over the radius of their finger."""

MOST_DROPS = 3
"""Drops ahead of a finger."""

NECK_STEPS, CAP_STEPS = 0.8, 4
"""Distance of the rings of a finger over its radius, and rings of its tip."""


@dataclass(frozen=True)
class Root:
    """Where a finger grows.

    Attributes
    ----------
    tip : number of the vertex that becomes its tip
    ring : numbers of the vertices around it, counterclockwise from outside
    place : ``(3,)``, middle of its bead, m
    along, aside : ``(3,)``, unit, its direction and one across it
    radius, length : m
    velocity : ``(3,)``, m/s
    """

    tip: int
    ring: list[int]
    place: np.ndarray
    along: np.ndarray
    aside: np.ndarray
    radius: float
    length: float
    velocity: np.ndarray


def grow(
    mesh: Mesh, middles: np.ndarray, found: np.ndarray, rim: np.ndarray, settings: SheetSettings,
    cell: float, drops: DropCloud,
) -> tuple[Mesh, np.ndarray, DropCloud]:  # fmt: skip
    """Return the mesh with fingers, the fingers' radius at each new vertex, and their drops.

    middles : float32 ``(n, 3)``, of the sheet at each vertex, m; found : the vertices of beads;
    rim : the rim's radius at each vertex, m; cell : m; drops : that fly free already. Fingers
    that would meet other liquid are left out.
    """
    rng = np.random.default_rng([settings.seed, 1])
    tree = quick_tree(mesh.vertices)
    roots = find_roots(mesh, tree, middles, found, rim, settings, rng)
    roots = [root for root in roots if is_clear(root, drops)]
    if not roots:
        return mesh, np.zeros(0, dtype=np.float32), DropCloud.empty()
    tubes = [tube(root, mesh.vertices[root.ring].astype(np.float64)) for root in roots]
    for _ in range(3):
        grown, radii, owner = with_fingers(mesh, roots, tubes)
        close = beside(grown, tree, roots)
        bad = np.unique(owner[close][crossing_faces(grown.vertices, grown.faces[close])])
        bad = set(bad[bad >= 0].tolist())
        if not bad:
            break
        left = [number for number in range(len(roots)) if number not in bad]
        roots, tubes = [roots[n] for n in left], [tubes[n] for n in left]
    else:
        return mesh, np.zeros(0, dtype=np.float32), DropCloud.empty()
    others = quick_tree(grown.vertices[len(mesh.vertices) :])
    return grown, radii, shed(grown, [tree, others], roots, settings, cell, rng, drops)


def quick_tree(points: np.ndarray) -> cKDTree:
    """Return a tree of points ``(n, 3)`` that is built faster than it is searched."""
    from scipy.spatial import cKDTree

    return cKDTree(points, balanced_tree=False, compact_nodes=False)


def is_clear(root: Root, drops: DropCloud) -> bool:
    """Return whether a finger would touch no drop."""
    off = drops.positions - root.place
    along = np.clip(off @ root.along, 0, root.length + 3 * root.radius)
    away = np.linalg.norm(off - along[:, None] * root.along, axis=1)
    return bool((away > drops.radii + 2.5 * root.radius).all())


def beside(mesh: Mesh, tree: cKDTree, roots: list[Root]) -> np.ndarray:
    """Return which faces have a vertex near a finger, bool ``(m,)``: only they may be crossed.

    tree : of the vertices before the fingers grew, which come first.
    """
    near = np.zeros(len(mesh.vertices), dtype=bool)
    near[tree.n :] = True
    if not roots:
        return np.asarray(near[mesh.faces].any(axis=1))
    middles = [root.place + 0.5 * root.length * root.along for root in roots]
    reaches = [0.7 * (root.length + 6 * root.radius) for root in roots]
    for found in tree.query_ball_point(middles, reaches, p=np.inf):
        near[found] = True
    return np.asarray(near[mesh.faces].any(axis=1))


def find_roots(
    mesh: Mesh, tree: cKDTree, middles: np.ndarray, found: np.ndarray, rim: np.ndarray,
    settings: SheetSettings, rng: np.random.Generator,
) -> list[Root]:  # fmt: skip
    """Return where fingers grow: at beads from which the flow leads outward.

    Every bead takes its random numbers, whether it has a finger or not: a change of one does not
    change the others.
    """
    corners, first = counting_sort(mesh.faces.reshape(-1), len(mesh.vertices))
    roots, taken = [], np.zeros(len(mesh.vertices), dtype=bool)
    for bead in found.tolist():
        lengths, tilt = rng.uniform(0.2, 1.0) ** 2, TILT * rng.normal(size=2)
        place, radius = middles[bead].astype(np.float64), float(rim[bead])
        close = np.array(tree.query_ball_point(place, 3.5 * radius), dtype=np.int64)
        if len(close) < 12:
            continue
        flow = mesh.velocities[close].mean(axis=0).astype(np.float64)
        speed = float(np.linalg.norm(flow))
        if speed == 0:
            continue
        out = place - mesh.vertices[close].mean(axis=0)
        out /= max(np.linalg.norm(out), 1e-12)
        lead = float(flow @ out) / speed
        if lead < OUTWARD:
            continue
        along = out + lead * flow / speed
        along /= np.linalg.norm(along)
        near = close[np.linalg.norm(mesh.vertices[close] - place, axis=1) < 2 * radius]
        if not len(near):
            continue
        tip = int(near[np.argmax((mesh.vertices[near] - place) @ along)])
        ring = ring_around(mesh.faces, corners[first[tip] : first[tip + 1]])
        if not ring or taken[tip] or taken[ring].any():
            continue
        along, aside = tilted(along, mesh.vertices[ring[0]] - mesh.vertices[tip], tilt)
        if not turns_once(mesh.vertices, ring, along):
            continue
        taken[ring], taken[tip] = True, True
        length = settings.fingers * LENGTH * radius * lengths * lead
        roots.append(Root(tip, ring, place, along, aside, THIN * radius, length, flow))
    return [root for root in roots if root.length > 2 * root.radius]


def tilted(along: np.ndarray, to: np.ndarray, tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a direction that is tilted by two angles, and a unit vector across it.

    to : ``(3,)``, towards which the first angle tilts: it turns as the mesh turns.
    """
    aside = cross(along, cross(to, along))
    aside /= max(np.linalg.norm(aside), 1e-12)
    out = along + tilt[0] * aside + tilt[1] * cross(along, aside)
    out /= np.linalg.norm(out)
    aside = cross(out, cross(aside, out))
    return out, aside / max(np.linalg.norm(aside), 1e-12)


def ring_around(faces: np.ndarray, corners: np.ndarray) -> list[int]:
    """Return the vertices around one, counterclockwise; empty if they are no single ring.

    corners : numbers of its corners, three times the face and the corner.
    """
    after = {}
    for corner in corners.tolist():
        face, k = divmod(corner, 3)
        after[int(faces[face, (k + 1) % 3])] = int(faces[face, (k + 2) % 3])
    begin = next(iter(after))
    ring = [begin]
    while (at := after.get(ring[-1], -1)) != begin and at >= 0 and len(ring) <= len(after):
        ring.append(at)
    return ring if at == begin and len(ring) == len(after) and len(ring) >= 4 else []


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of two vectors ``(3,)``, to the last bit as NumPy, but at once."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def basis(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors that are a right-handed frame together with ``along``."""
    axis = np.zeros(3)
    axis[np.argmin(np.abs(along))] = 1
    first = cross(along, axis)
    first /= np.linalg.norm(first)
    return first, cross(along, first)


def angles_of(points: np.ndarray, middle: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the angles of ``points`` around an axis, growing from the first by less than a turn.

    Growing steps that are not between 0 and half a turn are left as they are.
    """
    first, second = basis(along)
    off = points - middle
    angles = np.arctan2(off @ second, off @ first)
    steps = (np.diff(angles, append=angles[0]) + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(angles[0] + np.concatenate([[0.0], np.cumsum(steps)]))


def turns_once(points: np.ndarray, ring: list[int], along: np.ndarray) -> bool:
    """Return whether a ring goes once around the axis through its middle, without turning back."""
    angles = angles_of(points[ring], points[ring].mean(axis=0), along)
    steps = np.diff(angles)
    return bool((steps > 0.2).all() and abs(angles[-1] - angles[0] - 2 * np.pi) < 1e-3)


def with_fingers(
    mesh: Mesh, roots: list[Root], tubes: Sequence[tuple[np.ndarray, ...]]
) -> tuple[Mesh, np.ndarray, np.ndarray]:
    """Return the mesh with fingers, their radius at each new vertex and the owner of each face.

    tubes : of :func:`tube`, for each root.
    The owner is the number of the root, -1 for the faces of the mesh.
    """
    vertices, velocities = [mesh.vertices.copy()], [mesh.velocities]
    tips = [root.tip for root in roots]
    is_tip = np.zeros(len(mesh.vertices), dtype=bool)
    is_tip[tips] = True
    kept = ~is_tip[mesh.faces].any(axis=1)
    faces, owner = [mesh.faces[kept]], [np.full(int(kept.sum()), -1)]
    radii, count = [np.zeros(0, dtype=np.float32)], len(mesh.vertices)
    for number, (root, made) in enumerate(zip(roots, tubes, strict=True)):
        points, triangles, end = made
        triangles = np.where(triangles < 0, -1 - triangles, triangles + count)
        vertices[0][root.tip] = end
        vertices.append(points.astype(np.float32))
        velocities.append(np.tile(root.velocity, (len(points), 1)).astype(np.float32))
        faces.append(triangles)
        owner.append(np.full(len(triangles), number))
        radii.append(np.full(len(points), root.radius, dtype=np.float32))
        count += len(points)
    grown = Mesh(
        np.concatenate(vertices), np.concatenate(faces).astype(np.int32),
        np.concatenate(velocities).astype(np.float32),
    )  # fmt: skip
    return grown, np.concatenate(radii), np.concatenate(owner)


def tube(root: Root, ring: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the vertices ``(m, 3)`` and faces of a finger, and the place of its tip.

    ring : ``(k, 3)``, places of the ring's vertices. Faces number the finger's own vertices from 0;
    a vertex v that was there before is -1 - v.
    """
    middle = ring.mean(axis=0)
    angles = angles_of(ring, middle, root.along)
    angles = np.interp(np.arange(2 * len(ring)) / 2, np.arange(len(angles)), angles)
    first, second = basis(root.along)
    around = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
    wide = float(np.linalg.norm(ring - middle, axis=1).mean())
    lift = float(((ring - middle) @ root.along).max())
    heights, widths = profile(root, wide, lift)
    points = middle + heights[:, None, None] * root.along + widths[:, None, None] * around
    faces = tube_faces(root, len(heights), len(angles))
    return points.reshape(-1, 3), faces, middle + (heights[-1] + 0.35 * widths[-1]) * root.along


def profile(root: Root, wide: float, lift: float) -> tuple[np.ndarray, np.ndarray]:
    """Return height and radius of the rings of a finger, m.

    wide, lift : radius of the ring that it grows from, and how far that reaches up.
    """
    r, end = root.radius, TIP * root.radius
    begin = lift + 0.5 * r
    top = max(begin + root.length, begin + 2 * end)
    straight = np.arange(begin, top - 1.2 * end, NECK_STEPS * r)
    turn = np.linspace(-0.75, 1, CAP_STEPS + 3)[:-1] * np.pi / 2
    neck = r + (wide - r) * np.exp(-(((straight - lift) / r) ** 2))
    neck += 0.12 * r * np.sin((straight - begin) * 2 * np.pi / (8 * r)) * (straight > begin + r)
    cap = np.maximum(end * np.cos(turn), np.where(turn < 0, r, 0))
    heights = np.concatenate([straight, top - end + end * np.sin(turn)])
    return heights, np.concatenate([neck, cap])


def tube_faces(root: Root, rings: int, around: int) -> np.ndarray:
    """Return the faces of a tube of ``rings`` rings of ``around`` vertices, and its tip."""
    here = np.arange(around)
    after = (here + 1) % around
    low = around * np.arange(rings - 1)[:, None]
    high = low + around
    sides = [
        np.stack(np.broadcast_arrays(low + here, low + after, high + after), axis=-1),
        np.stack(np.broadcast_arrays(low + here, high + after, high + here), axis=-1),
    ]
    v = -1 - np.array(root.ring)
    w, a = np.roll(v, -1), here[::2]
    foot = [(v, a + 1, a), (v, w, a + 1), (w, after[1::2], a + 1)]
    tip = np.full(around, -1 - root.tip)
    last = (rings - 1) * around
    parts = [*(np.stack(part, axis=1) for part in foot), *(part.reshape(-1, 3) for part in sides)]
    return np.concatenate([*parts, np.stack([last + here, last + after, tip], axis=1)])


def shed(
    mesh: Mesh, trees: list[cKDTree], roots: list[Root], settings: SheetSettings, cell: float,
    rng: np.random.Generator, drops: DropCloud,
) -> DropCloud:  # fmt: skip
    """Return the drops ahead of the fingers that touch neither liquid nor other drops.

    trees : of all vertices; drops : that fly free already.
    """
    places, speeds, radii = [], [], []
    for root in roots:
        wanted = min(int(rng.poisson(2 * settings.drops)), MOST_DROPS)
        tip = mesh.vertices[root.tip].astype(np.float64)
        way = 0.0
        for number in range(MOST_DROPS):
            size = DROP_RADIUS * root.radius * rng.uniform(0.45, 1.0)
            way += DROP_GAP * root.radius * rng.uniform(0.7, 1.3)
            off = 0.1 * way * rng.normal(size=2)
            if number < wanted:
                across = off[0] * root.aside + off[1] * cross(root.along, root.aside)
                places.append(tip + way * root.along + across)
                speeds.append(root.velocity * (1 + 0.05 * number))
                radii.append(size)
    if not places:
        return DropCloud.empty()
    positions, sizes = np.array(places), np.array(radii)
    away = np.min([tree.query(positions)[0] for tree in trees], axis=0)
    clear = away > sizes + 0.7 * cell
    kept: list[int] = []
    for n in np.flatnonzero(clear).tolist():
        away = np.linalg.norm(positions[kept] - positions[n], axis=1)
        others = np.linalg.norm(drops.positions - positions[n], axis=1) > drops.radii + sizes[n]
        if others.all() and (away > sizes[kept] + sizes[n]).all():
            kept.append(n)
    return cloud_of(positions[kept], np.array(speeds)[kept], sizes[kept], cell)


def cloud_of(
    positions: np.ndarray, velocities: np.ndarray, radii: np.ndarray, cell: float
) -> DropCloud:
    """Return round drops; those that a grid could resolve have a surface."""
    meshed = radii >= SMALLEST_RADIUS * cell
    balls = spheres(
        positions[meshed].astype(np.float32), velocities[meshed].astype(np.float32), radii[meshed]
    )
    each = len(balls.vertices) // max(int(meshed.sum()), 1)
    return DropCloud(
        positions.astype(np.float32), velocities.astype(np.float32), radii.astype(np.float32),
        meshed, balls, np.repeat(np.flatnonzero(meshed), each).astype(np.int32),
    )  # fmt: skip
