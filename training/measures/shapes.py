# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash looks like in figures: pieces, holes, and how it keeps to its strokes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt, label, map_coordinates
from skimage.measure import euler_number

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR, Fields
from liquid_splash_addon.core.liquid.level_set import surface_level
from liquid_splash_addon.core.mesh.marching_cubes import LEVEL_BAND
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.sketch.local_frame import Frame

from .metrics import iou

AROUND_A_CELL = np.ones((3, 3, 3), dtype=bool)
"""A cell and the 26 around it."""


def pieces(occupied: np.ndarray, least: int = 1) -> list[int]:
    """Return the sizes in cells, largest first, of the pieces of at least ``least`` cells.

    occupied : bool ``(X, Y, Z)``; cells that share a corner belong together.
    """
    labels, _ = label(occupied, AROUND_A_CELL)
    sizes = np.sort(np.bincount(labels.ravel())[1:])[::-1]
    return [int(size) for size in sizes if size >= least]


def tunnels(occupied: np.ndarray) -> int:
    """Return the number of holes that go through the liquid (its first Betti number).

    From Euler's number: pieces - tunnels + bubbles. A sheet with two holes has two tunnels, and so
    has a figure eight.
    """
    padded = np.pad(occupied, 1)
    _, airs = label(~padded)
    return len(pieces(padded)) + int(airs) - 1 - int(euler_number(padded, connectivity=3))


def surface_to_volume(mesh: Mesh) -> float:
    """Return the area of a closed mesh over its volume, in 1 / unit of the mesh."""
    a, b, c = (mesh.vertices[mesh.faces[:, n]].astype(float) for n in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return float(area / ((np.cross(a, b) * c).sum() / 6))


def coverage(occupied: np.ndarray, drawn: np.ndarray, within: int = 0) -> float:
    """Return the share of the stroke cells that hold liquid, or have some ``within`` cells.

    occupied, drawn : bool ``(X, Y, Z)``.
    """
    if within:
        occupied = binary_dilation(occupied, AROUND_A_CELL, iterations=within)
    return float(occupied[drawn].mean())


def attached_share(occupied: np.ndarray, drawn: np.ndarray) -> float:
    """Return the share of the liquid in pieces that touch a stroke cell; 0 without liquid."""
    labels, count = label(occupied, AROUND_A_CELL)
    touching = np.zeros(count + 1, dtype=bool)
    touching[labels[binary_dilation(drawn, AROUND_A_CELL)]] = True
    return float(touching[labels[occupied]].mean()) if count else 0.0


def far_share(occupied: np.ndarray, drawn: np.ndarray, cells: float) -> float:
    """Return the share of the liquid farther than ``cells`` from any stroke cell."""
    away = distance_transform_edt(~drawn)
    return float((away[occupied] > cells).mean()) if occupied.any() else 0.0


def shifted_iou(occupied: np.ndarray) -> float:
    """Return the mean IoU of the liquid with itself moved by one cell along x, y or z.

    A yardstick for other IoUs: thin liquid shares little with itself one cell aside.
    """
    padded = np.pad(occupied, 1)
    shared = [(padded & np.roll(padded, 1, axis)).sum() / occupied.sum() for axis in range(3)]
    return float(np.mean([share / (2 - share) for share in shared]))


def level_of(fields: Fields) -> np.ndarray:
    """Return the level whose zero is the splash's surface, ``(X, Y, Z)``."""
    return np.clip(surface_level(fields, 0.5), -LEVEL_BAND, LEVEL_BAND)


def halved(level: np.ndarray) -> np.ndarray:
    """Return the liquid on a grid of cells twice as large, bool ``(X / 2, Y / 2, Z / 2)``.

    level : of a splash (:func:`level_of`), or the distance of true liquid. A large cell's centre
    lies in the middle of eight small ones: it is liquid if the level, interpolated there, is
    negative. For the truth that comes nearest what it is on the coarse grid itself (IoU 0.94; at
    least four of eight occupied 0.87, any 0.59).
    """
    x, y, z = (n // 2 for n in level.shape)
    return np.asarray(level.reshape(x, 2, y, 2, z, 2).mean(axis=(1, 3, 5)) < 0)


def resampled(field: np.ndarray, grid: Grid, frame: Frame, other: Frame, to: Grid) -> np.ndarray:
    """Return a field of the local box of ``frame``, seen in that of ``other``.

    field : ``(X, Y, Z)`` on ``grid``, such as a distance in cells; trilinear, AIR beyond the
    box. Returns ``(X', Y', Z')`` on the grid ``to`` of the other frame.
    """
    points = frame.points_to_local(other.points_to_drawing(to.centres().astype(np.float64)))
    where = np.moveaxis(grid.to_cells(points) - 0.5, -1, 0)
    seen = map_coordinates(field, where, order=1, mode="constant", cval=AIR, output=np.float32)
    return np.asarray(seen)


def seen_liquid(fields: Fields, frame: Frame, other: Frame, to: Grid) -> np.ndarray:
    """Return the liquid of a splash in ``frame``, seen in ``other``: bool, on the grid ``to``."""
    return resampled(level_of(fields), fields.grid, frame, other, to) < 0


def mean_pair_iou(masks: Sequence[np.ndarray]) -> float:
    """Return the mean IoU over all pairs of bool arrays of one shape."""
    return float(np.mean([iou(a, b) for a, b in combinations(masks, 2)]))
