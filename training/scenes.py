# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes: a short streamlet shot at a solid (paper, 4.2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING

from .obstacles import SHAPES, Obstacle

LENGTH = (0.05, 0.25)
RADIUS = (0.005, 0.050)
SPEED = (0.5, 5.0)
"""Ranges of the streamlet's length (m), radius (m) and speed (m/s): the paper's."""

BODY = (0.015, 0.080)
"""Range of the obstacle's radius or half edge, metres (the paper gives none)."""

TILT_DEG = 60.0
"""Largest angle between the streamlet and the vertical."""

GAP = 1.5
"""Cells between the streamlet's tip and the obstacle at the start."""


CORE = 0.4
"""Share of the streamlet's radius that must hit the body; a mere graze makes no splash."""

APPROACH = 0.5
"""Metres before the obstacle's middle at which the search for the impact begins."""


@dataclass(frozen=True)
class Scene:
    """One simulation: a cylinder of liquid flying at an obstacle. Metres, seconds, z up.

    Attributes
    ----------
    seed : the number that all random choices come from
    cells, spacing : cells along each side of the box, edge of a cell
    length, radius, speed : of the streamlet
    tip : ``(3,)``, centre of the streamlet's front
    direction : ``(3,)``, unit vector of its flight
    obstacle : in metres
    """

    seed: int
    cells: int
    spacing: float
    length: float
    radius: float
    speed: float
    tip: np.ndarray
    direction: np.ndarray
    obstacle: Obstacle


def random_scene(seed: int, resolution: int = LOCAL_CELLS) -> Scene:
    """Return the scene with this seed; ``resolution`` is cells per side of the local box.

    The box has twice the local box's side and the impact lies at its middle. A coarser
    resolution widens the thinnest streamlets (radii are at least 1.5 cells) and the gap before
    the obstacle.
    """
    rng = np.random.default_rng(seed)
    spacing = LOCAL_SPACING * LOCAL_CELLS / resolution
    length, radius, speed = (float(rng.uniform(*limits)) for limits in (LENGTH, RADIUS, SPEED))
    radius = max(radius, 1.5 * spacing)
    shape = SHAPES[rng.integers(len(SHAPES))]
    size = float(rng.uniform(*BODY))
    height = float(rng.uniform(*BODY))
    axes = Rotation.random(random_state=rng).as_matrix()
    tilt = np.radians(TILT_DEG) * np.sqrt(rng.random())
    turn = rng.uniform(0, 2 * np.pi)
    direction = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)])
    middle = np.full(3, resolution * spacing)
    body = Obstacle(shape, size, height, middle, axes)
    tip = None
    while tip is None:  # a draw that misses the body is no scene
        side = side_direction(direction, rng.uniform(0, 2 * np.pi))
        offset = side * (size + radius) * np.sqrt(rng.random())
        if touching_tip(body, middle + offset, direction, CORE * radius, 0.1 * spacing) is None:
            continue
        tip = touching_tip(body, middle + offset, direction, radius, GAP * spacing)
    # The streamlet's front, where the splash begins, goes to the middle of the box.
    shift = middle - tip
    body = Obstacle(shape, size, height, middle + shift, axes)
    return Scene(seed, 2 * resolution, spacing, length, radius, speed, tip + shift, direction, body)


def side_direction(direction: np.ndarray, angle: float) -> np.ndarray:
    """Return the unit vector across ``direction`` at ``angle`` (radians) around it."""
    helper = np.eye(3)[np.argmin(np.abs(direction))]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first)
    return np.cos(angle) * first + np.sin(angle) * np.cross(direction, first)


def touching_tip(
    body: Obstacle, target: np.ndarray, direction: np.ndarray, radius: float, gap: float
) -> np.ndarray | None:
    """Return where the front's centre is when it first comes within ``gap`` of the body.

    The front, a disc sampled at 65 points, moves along ``direction`` through ``target``.
    Returns None if it misses.
    """
    rings = [target]
    for share in (0.5, 1.0):
        for angle in np.arange(0, 2 * np.pi, np.pi / 16):
            rings.append(target + share * radius * side_direction(direction, angle))
    front = np.stack(rings) - APPROACH * direction
    travelled = 0.0
    while travelled < 2 * APPROACH:
        near = float(body.distance(front + travelled * direction).min())
        if near <= gap * 1.01:
            return front[0] + travelled * direction
        travelled += near - gap
    return None


def fill(scene: Scene, rng: np.random.Generator) -> np.ndarray:
    """Return the streamlet's particles, float32 ``(n, 3)`` in cells: 8 a cell, jittered."""
    back = scene.tip - scene.length * scene.direction
    low = (np.minimum(scene.tip, back) - scene.radius) / scene.spacing
    high = (np.maximum(scene.tip, back) + scene.radius) / scene.spacing
    low, high = np.floor(low).astype(int), np.ceil(high).astype(int)
    axes = [np.arange(low[a], high[a], 0.5) + 0.25 for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points += rng.uniform(-0.2, 0.2, points.shape)
    offset = points * scene.spacing - scene.tip
    along = offset @ scene.direction
    across = np.linalg.norm(offset - along[:, None] * scene.direction, axis=1)
    inside = (along <= 0) & (along >= -scene.length) & (across <= scene.radius)
    return points[inside].astype(np.float32)
