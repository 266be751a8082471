# SPDX-License-Identifier: GPL-3.0-or-later
"""Drops that fly free: a point for each, and round meshes of those that a grid can resolve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grid import Grid
from ..liquid.fields import AIR
from ..mesh.isosurface import isosurface
from ..mesh.mesh import Mesh
from ..mesh.self_intersection import crossing_faces, faces_beside
from ..mesh.taubin import neighbour_mean
from ..numeric.triangles import signed_volumes
from .particle_level import FINER, FineLevel, fill_atlas
from .settings import SMALLEST_RADIUS

DROP_SMOOTHING_STEPS = 8
"""Smoothing steps that remove the staircase of the voxels and the bumps of the particles."""

ROUND_RADIUS = 1.6
"""Radius in cells up to which cohesion 1 makes a drop a ball. Larger ones, which oscillate for
longer than they have flown, keep more of their shape."""


@dataclass(frozen=True)
class DropCloud:
    """Drops that fly free of a splash, in its grid's frame.

    Attributes
    ----------
    positions : float32 ``(n, 3)``, metres
    velocities : float32 ``(n, 3)``, m/s
    radii : float32 ``(n,)``, metres, of balls of the drops' volumes
    meshed : bool ``(n,)``, which of them are in ``mesh``: those from SMALLEST_RADIUS on
    mesh : their surfaces, metres
    owner : int32 ``(vertices,)``, the drop of each vertex of the mesh
    """

    positions: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray
    meshed: np.ndarray
    mesh: Mesh
    owner: np.ndarray

    @classmethod
    def empty(cls) -> DropCloud:
        """Return a cloud without drops."""
        none = np.zeros((0, 3), dtype=np.float32)
        nobody = np.zeros(0, dtype=np.int32)
        return cls(none, none, none[:, 0], np.zeros(0, dtype=bool), Mesh.empty(), nobody)

    @property
    def volume(self) -> float:
        """Volume of all drops, cubic metres."""
        return float(4 / 3 * np.pi * (self.radii.astype(np.float64) ** 3).sum())

    def joined(self, other: DropCloud) -> DropCloud:
        """Return the drops of both clouds."""
        return DropCloud(
            np.concatenate([self.positions, other.positions]),
            np.concatenate([self.velocities, other.velocities]),
            np.concatenate([self.radii, other.radii]),
            np.concatenate([self.meshed, other.meshed]),
            self.mesh.joined(other.mesh),
            np.concatenate([self.owner, other.owner + np.int32(len(self.radii))]),
        )

    def only(self, kept: np.ndarray) -> DropCloud:
        """Return the drops for which ``kept``, bool ``(n,)``, is true."""
        stays = kept[self.owner]
        number = np.cumsum(stays) - 1
        faces = number[self.mesh.faces[stays[self.mesh.faces[:, 0]]]].astype(np.int32)
        mesh = Mesh(self.mesh.vertices[stays], faces, self.mesh.velocities[stays])
        owner = (np.cumsum(kept) - 1)[self.owner[stays]].astype(np.int32)
        return DropCloud(
            self.positions[kept], self.velocities[kept], self.radii[kept], self.meshed[kept],
            mesh, owner,
        )  # fmt: skip

    def clear_of(self, mesh: Mesh) -> np.ndarray:
        """Return which drops have surfaces that do not cross ``mesh``, bool ``(n,)``."""
        clear = np.ones(len(self.radii), dtype=bool)
        if len(self.mesh.faces):
            both = mesh.joined(self.mesh)
            is_drop = np.arange(len(both.faces)) >= len(mesh.faces)
            near = np.flatnonzero(faces_beside(both.vertices, both.faces, is_drop))
            crossed = near[crossing_faces(both.vertices, both.faces[near])]
            corners = both.faces[crossed[is_drop[crossed]], 0] - len(mesh.vertices)
            clear[self.owner[corners]] = False
        return clear


def drop_cloud(
    fine: FineLevel, label: np.ndarray, merged: np.ndarray, grid: Grid, cohesion: float
) -> DropCloud:
    """Return the drops that are not ``merged``, bool ``(drops + 1,)``.

    label : int32 ``(n,)``, the drop of each fine cell, -1 for air; grid : the splash's;
    cohesion : 0..1, how far it has rounded the drops.
    """
    free = np.flatnonzero(~merged[:-1])
    if not len(free):
        return DropCloud.empty()
    number = np.full(len(merged), -1)
    number[free] = np.arange(len(free))
    own = number[label]  # label -1 takes the last entry, which is -1
    inside = own >= 0
    drop = own[inside]
    weight = np.clip(0.5 - fine.level[inside], 0, 1)
    places = fine.cells.coordinates[inside] + fine.start + 0.5
    centre = weighted_means(places, drop, weight) / FINER
    velocity = weighted_means(fine.velocity[inside], drop, weight)
    radii = drop_radii(fine, own)
    meshed = radii >= SMALLEST_RADIUS
    mesh, owner = mesh_drops(
        fine, own, np.flatnonzero(meshed), grid, velocity * grid.spacing, cohesion
    )
    return DropCloud(
        grid.to_metres(centre).astype(np.float32),
        (velocity * grid.spacing).astype(np.float32),
        (radii * grid.spacing).astype(np.float32),
        meshed,
        mesh,
        owner,
    )


def drop_radii(fine: FineLevel, label: np.ndarray) -> np.ndarray:
    """Return radii in cells of a ball of each drop's volume; label : see :func:`drop_cloud`."""
    inside = label >= 0
    volume = np.bincount(label[inside], np.clip(0.5 - fine.level[inside], 0, 1))
    return np.asarray(np.cbrt(0.75 / np.pi * np.maximum(volume, 1e-6)) / FINER)


def weighted_means(values: np.ndarray, group: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the weighted mean of ``values`` ``(n, 3)`` in each group, ``(groups, 3)``."""
    total = np.maximum(np.bincount(group, weight), 1e-9)
    columns = [np.bincount(group, weight * values[:, axis]) / total for axis in range(3)]
    return np.stack(columns, axis=1)


def mesh_drops(
    fine: FineLevel,
    label: np.ndarray,
    drops: np.ndarray,
    grid: Grid,
    velocity: np.ndarray,
    cohesion: float,
) -> tuple[Mesh, np.ndarray]:
    """Return the surfaces of ``drops`` (numbers in ``label``), and the drop of each vertex.

    Their boxes of fine cells are placed side by side in one array, with air between them.

    velocity : ``(k, 3)``, m/s, of each number in ``label``; cohesion : see :func:`drop_cloud`.
    """
    if not len(drops):
        return Mesh.empty(), np.zeros(0, dtype=np.int32)
    low, high = drop_boxes(fine, label, drops)
    sizes = high - low
    offsets = np.concatenate([[0], sizes[:, 0].cumsum()])
    atlas = np.full((offsets[-1], *sizes[:, 1:].max(axis=0)), AIR, dtype=np.float32)
    place = np.full(label.max() + 2, -1, dtype=np.int32)
    place[drops] = np.arange(len(drops))
    table, leaves = fine.cells.table, fine.cells.leaves
    fill_atlas(place[label], fine.level, table, leaves, low, sizes, offsets, atlas)
    vertices, faces = isosurface(atlas, 0.0)
    drop = np.searchsorted(offsets, vertices[:, 0], side="right") - 1
    moved = rounded(vertices.astype(np.float64), faces, drop, cohesion)
    moved[:, 0] -= offsets[drop]
    cells = (moved + low[drop] + fine.start + 0.5) / FINER
    points = grid.to_metres(cells).astype(np.float32)
    owner = drops[drop].astype(np.int32)
    mesh = Mesh(points, faces.astype(np.int32), velocity[owner].astype(np.float32))
    return mesh, owner


def drop_boxes(
    fine: FineLevel, label: np.ndarray, drops: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first cell and the one after the last of each drop's box, with air around it."""
    wanted = np.isin(label, drops)
    order = np.searchsorted(drops, label[wanted])
    places = fine.cells.coordinates[wanted].astype(np.int64)
    low = np.full((len(drops), 3), np.iinfo(np.int64).max)
    high = np.zeros((len(drops), 3), dtype=np.int64)
    np.minimum.at(low, order, places)
    np.maximum.at(high, order, places + 1)
    return low - 2, high + 2


def rounded(
    vertices: np.ndarray, faces: np.ndarray, drop: np.ndarray, cohesion: float
) -> np.ndarray:
    """Return vertices ``(n, 3)`` (fine cells) of smoother, rounder drops of the same volumes.

    Each drop is scaled along its principal axes towards a ball: smoothing alone would draw flat
    or long ones out into threads. drop : ``(n,)``, the drop of each vertex, from 0 on.
    """
    mean = neighbour_mean(faces, len(vertices))
    before = drop_volumes(vertices, faces, drop)
    moved = vertices
    for _ in range(DROP_SMOOTHING_STEPS):
        moved = 0.5 * (moved + mean @ moved)
    offsets = moved - weighted_means(moved, drop, np.ones(len(moved)))[drop]
    centre = moved - offsets
    products = (offsets[:, :, None] * offsets[:, None, :]).reshape(-1, 9)
    spread = [np.bincount(drop, column) for column in products.T]
    squares, axes = np.linalg.eigh(np.stack(spread, axis=1).reshape(-1, 3, 3))
    radii = np.cbrt(0.75 / np.pi * np.maximum(before, 1e-9)) / FINER
    share = cohesion * np.minimum(ROUND_RADIUS / radii, 1.0)
    scale = np.maximum(squares, 1e-9) ** (-0.5 * share[:, None])
    turned = np.einsum(
        "nij,nj->ni", (axes * scale[:, None, :])[drop], np.einsum("nij,ni->nj", axes[drop], offsets)
    )
    after = drop_volumes(turned, faces, drop)
    growth = np.cbrt(np.maximum(before, 1e-9) / np.maximum(after, 1e-12))
    return centre + growth[drop, None] * turned


def drop_volumes(vertices: np.ndarray, faces: np.ndarray, drop: np.ndarray) -> np.ndarray:
    """Return the volume inside each drop's faces, ``(drops,)``, in the vertices' unit cubed."""
    return np.bincount(drop[faces[:, 0]], signed_volumes(vertices, faces), drop.max() + 1)
