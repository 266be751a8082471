# SPDX-License-Identifier: GPL-3.0-or-later
"""From frames and streamlines to what the network sees: strokes drawn anew for every use."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
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

from ..scenes.obstacles import Obstacle, load_obstacle
from .frames import StoredFrame, load_frame, load_parameters
from .sketching import STROKES_IN_TESTS, draw_strokes, trace_frame

SPLITS = ("train", "validation", "test")

TENTH = 10
"""One scene in ten is for validation, one for tests."""


FARTHEST = AIR - 0.1
"""Cells whose distance is greater lie in mere air, whatever is interpolated there."""


class Sample(NamedTuple):
    """One pair for the network.

    condition : of the strokes; distance : float32 ``(X, Y, Z)`` cells, clipped at
    +-AIR or, where that is less, at the stored grid's own AIR cells; velocity : float32
    ``(3, X, Y, Z)`` m/s, zero far from the liquid; grid : the cells' place.
    """

    condition: Condition
    distance: np.ndarray
    velocity: np.ndarray
    grid: Grid


@dataclass(frozen=True)
class Item:
    """One frame of the data set.

    Attributes
    ----------
    scene : its file
    number : the frame's number in it
    time : seconds since impact
    spacing : edge of the stored cells, metres
    obstacle : in metres from the corner of the simulation's box
    """

    scene: Path
    number: int
    time: float
    spacing: float
    obstacle: Obstacle = field(compare=False, repr=False)

    @property
    def seed(self) -> int:
        """Seed of the scene."""
        return int(self.scene.stem[-6:])

    def load(self) -> StoredFrame:
        """Read the frame."""
        return load_frame(self.scene, self.number)


def split_of(seed: int) -> str:
    """Return 'train', 'validation' or 'test' for a scene: fixed by its seed alone."""
    digit = hashlib.sha256(str(seed).encode()).digest()[0] % TENTH
    return {0: "test", 1: "validation"}.get(digit, "train")


def load_items(data: Path, split: str) -> list[Item]:
    """Return the frames of one split, by scene and time; ValueError if there are none."""
    items = list_items(data, split)
    if not items:
        raise ValueError(f"no {split} frames in {data}: run training.simulate with more scenes")
    return items


def list_items(data: Path, split: str) -> list[Item]:
    """Return the frames of one split, by scene and time."""
    items = []
    for scene in sorted(data.glob("scene_*.npz")):
        if split_of(int(scene.stem[-6:])) == split:
            parameters = load_parameters(scene)
            obstacle = load_obstacle(parameters["obstacle"])
            for number, time in enumerate(parameters["times"]):
                items.append(Item(scene, number, time, parameters["stored_spacing"], obstacle))
    return items


def choose(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most ``most`` of the items, evenly spread (all times and scenes alike)."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[i] for i in places]


def scenes_digest(items: Sequence[Item]) -> hashlib._Hash:
    """Return the SHA-256 of the names and contents of the scene files that the items come from."""
    digest = hashlib.sha256()
    for path in sorted({item.scene for item in items}):
        digest.update(path.name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest


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

    Strokes are in metres; they become a condition by the add-on's own path, with gain 1.
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
    """Return distance ``(X, Y, Z)`` (cells of ``grid``) and velocity ``(3, X, Y, Z)``.

    spacing : cell size of the simulation, metres.
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
                if source[int(x), int(y), int(z)] > FARTHEST:
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
    """Return the strokes of a frame for figures: as many as the paper's, the same at every call."""
    rng = np.random.default_rng([item.seed, item.number])
    lines = trace_frame(stored, item.spacing, rng)
    return draw_strokes(lines, rng, counts, jitter=False)


def held_out_sample(
    item: Item, cells: int, counts: tuple[int, int] = STROKES_IN_TESTS
) -> tuple[Sample, list[Stroke]]:
    """Return the pair and strokes of an unseen frame, the same at every call."""
    stored = item.load()
    strokes = held_out_strokes(item, stored, counts)
    grids = [Grid.local(cells)]
    return samples_on(stored, item.spacing, strokes, fit_frame(strokes), grids)[0], strokes
