# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples for the network: what it is shown of a frame's strokes, and the true liquid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from liquid_splash_addon.core.condition.voxelize import Condition, voxelize
from liquid_splash_addon.core.generator.patch_classifier import (
    bundled_patch_classifier,
    patch_samples,
)
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR
from liquid_splash_addon.core.numeric.trilinear import trilinear, velocity_at
from liquid_splash_addon.core.sketch.local_frame import NEAR_EQUAL, Frame, fit_frame, principal_axes
from liquid_splash_addon.core.sketch.strokes import Stroke

from .frames import StoredFrame
from .items import Item
from .sketching import STROKES_IN_TESTS, draw_strokes, trace_frame

DEEP_AIR = AIR - 0.1
"""Cells whose distance is greater lie in air only: nothing is interpolated there."""


class Sample(NamedTuple):
    """Condition and truth on one grid.

    condition : of the strokes; distance : float32 ``(X, Y, Z)`` cells, clipped at
    +-AIR or, where that is less, at AIR of the stored grid's cells; velocity : float32
    ``(3, X, Y, Z)`` m/s, zero far from the liquid; grid : where the cells lie.
    """

    condition: Condition
    distance: np.ndarray
    velocity: np.ndarray
    grid: Grid


def augmented_frame(frame: Frame, strokes: Sequence[Stroke], rng: np.random.Generator) -> Frame:
    """Return the frame with random signs, and turned in the plane of near-equal axes."""
    points = np.concatenate([frame.points_to_local(s.points.astype(np.float64)) for s in strokes])
    _, _, variances = principal_axes(points)
    turn = np.eye(3)
    for a, b in ((0, 1), (1, 2)):
        if variances[a] < NEAR_EQUAL * variances[b]:
            angle = rng.uniform(0, 2 * np.pi)
            plane = np.eye(3)
            plane[[a, b], [a, b]] = np.cos(angle)
            plane[a, b], plane[b, a] = -np.sin(angle), np.sin(angle)
            turn = plane @ turn
    return frame.turned(np.diag(rng.choice([-1.0, 1.0], 3)) @ turn)


def samples_on(
    stored: StoredFrame,
    spacing: float,
    strokes: Sequence[Stroke],
    frame: Frame,
    grids: Sequence[Grid],
) -> list[Sample]:
    """Return condition and truth of a stored frame on each grid, in the local ``frame``.

    strokes : in metres; they become a condition by the add-on's own path, with gain 1.
    spacing : cell of the stored frame, metres.
    """
    local = frame.strokes_to_local(strokes)
    patches = patch_samples(local, bundled_patch_classifier())
    return [
        Sample(voxelize(local, grid, patches), *resample(stored, spacing, frame, grid), grid)
        for grid in grids
    ]


def resample(
    stored: StoredFrame, spacing: float, frame: Frame, grid: Grid
) -> tuple[np.ndarray, np.ndarray]:
    """Return distance ``(X, Y, Z)`` (cells of ``grid``) and velocity ``(3, X, Y, Z)`` (m/s).

    spacing : cell of the stored frame, metres.
    """
    # local cell -> stored cell: one affine map for all
    steps = frame.axes.T * grid.spacing / spacing
    first = np.asarray(grid.origin) + 0.5 * grid.spacing
    start = (frame.points_to_drawing(first) / spacing) - stored.start
    ratio = spacing / grid.spacing
    distance = np.full(grid.shape, min(AIR, AIR * ratio), dtype=np.float32)
    velocity = np.zeros((3, *grid.shape), dtype=np.float32)
    _resample(
        stored.signed_distance, stored.block_velocity, steps, start, ratio, frame.axes,
        distance, velocity,
    )  # fmt: skip
    return distance, velocity


@njit(cache=True)
def _resample(source, source_velocity, steps, start, ratio, axes, distance, velocity):
    u = np.empty(3)
    for i in range(distance.shape[0]):
        for j in range(distance.shape[1]):
            for k in range(distance.shape[2]):
                x = start[0] + steps[0, 0] * i + steps[0, 1] * j + steps[0, 2] * k
                y = start[1] + steps[1, 0] * i + steps[1, 1] * j + steps[1, 2] * k
                z = start[2] + steps[2, 0] * i + steps[2, 1] * j + steps[2, 2] * k
                if x < 0.5 or y < 0.5 or z < 0.5:
                    continue
                nx, ny, nz = source.shape
                if x > nx - 0.5 or y > ny - 0.5 or z > nz - 0.5:
                    continue
                if source[int(x), int(y), int(z)] > DEEP_AIR:
                    continue
                d = trilinear(source, x, y, z) * ratio
                distance[i, j, k] = min(max(d, -AIR), distance[i, j, k])
                if d < 2.0:
                    velocity_at(source_velocity, 0.5 * x, 0.5 * y, 0.5 * z, u)
                    for a in range(3):
                        velocity[a, i, j, k] = (
                            axes[a, 0] * u[0] + axes[a, 1] * u[1] + axes[a, 2] * u[2]
                        )


def held_out_strokes(
    item: Item, stored: StoredFrame, counts: tuple[int, int] = STROKES_IN_TESTS
) -> list[Stroke]:
    """Return the strokes of a frame on which models are measured, the same at every call.

    counts : least and greatest number of strokes, the paper's by default
    """
    rng = np.random.default_rng([item.seed, item.number])
    lines = trace_frame(stored, item.spacing, rng)
    return draw_strokes(lines, rng, counts, jitter=False)


def held_out_sample(
    item: Item, cells: int, counts: tuple[int, int] = STROKES_IN_TESTS
) -> tuple[Sample, list[Stroke]]:
    """Return sample and strokes of a frame on which models are measured, the same at every call."""
    stored = item.load()
    strokes = held_out_strokes(item, stored, counts)
    grids = [Grid.local(cells)]
    return samples_on(stored, item.spacing, strokes, fit_frame(strokes), grids)[0], strokes
