# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes, in families: the paper's streamlet at a solid, and others for diversity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING

from .bodies import NOTHING, SHAPES, Body
from .scene import Scene, Streamlet, side_direction

STREAMLET_LENGTH = (0.05, 0.25)
STREAMLET_RADIUS = (0.005, 0.050)
STREAMLET_SPEED = (0.5, 5.0)
"""Ranges of a streamlet's length (m), radius (m) and speed (m/s): the paper's."""

SLENDER_RADIUS = (0.005, 0.030)
"""Range of the radius where several streamlets, or a streamlet and a pool, share a scene, m."""

BODY_SIZE = (0.015, 0.080)
"""Range of the body's radius or half edge, metres (the paper gives none)."""

TILT_DEG = 60.0
"""Largest angle between a streamlet and the vertical."""

LONGEST_DELAY, LONGEST_DELAY_WAY = 0.03, 0.1
"""Seconds, and metres of flight, by which other streamlets may arrive after the first."""

POOL_RADIUS = (0.05, 0.12)
POOL_DEPTH = (0.005, 0.012)
FLOOR = 0.3
"""Half edge of the cube under a pool, metres: its top is a floor as wide as the box."""

START_GAP = 1.5
"""Cells at the start between a streamlet's tip and what it will hit."""

HIT_SHARE = 0.4
"""Share of the streamlet's radius that must hit the body; a mere graze makes no splash."""

APPROACH = 0.5
"""Metres before the body's middle at which the search for the impact begins."""


def random_scene(seed: int, resolution: int = LOCAL_CELLS, family: str | None = None) -> Scene:
    """Return the scene with this seed; ``resolution`` is cells per side of the local box.

    The box has twice the local box's side and the impact lies at its middle. A coarser
    resolution widens the thinnest streamlets (radii are at least 1.5 cells) and the gap before
    the body. family : one of FAMILIES; None draws one by its weight.
    """
    rng = np.random.default_rng(seed)
    spacing = LOCAL_SPACING * LOCAL_CELLS / resolution
    names = list(FAMILIES)
    drawn = names[rng.choice(len(names), p=[FAMILIES[name][1] for name in names])]
    name = family or drawn
    streamlets, body, impact = FAMILIES[name][0](rng, spacing)
    scene = Scene(seed, name, 2 * resolution, spacing, streamlets, body, impact)
    return scene.shifted(np.full(3, resolution * spacing))


Parts = tuple[tuple[Streamlet, ...], Body, float]
"""Streamlets, body and time of the first impact; the impact is at the origin."""


def one_streamlet(rng: np.random.Generator, spacing: float) -> Parts:
    """Return the paper's scene: one streamlet, one solid of random size, turn and offset."""
    body = random_body(rng)
    streamlet = aimed(draw_streamlet(rng, spacing, STREAMLET_RADIUS), body, rng, spacing)
    there = -streamlet.tip
    return (streamlet.shifted(there),), body.shifted(there), START_GAP * spacing / streamlet.speed


def several_streamlets(rng: np.random.Generator, spacing: float) -> Parts:
    """Return two or three streamlets at one solid, up to LONGEST_DELAY seconds apart."""
    body = random_body(rng)
    first = aimed(draw_streamlet(rng, spacing, SLENDER_RADIUS), body, rng, spacing)
    streamlets = [first]
    wanted = int(rng.integers(2, 4))
    for _ in range(40):
        other = aimed(draw_streamlet(rng, spacing, SLENDER_RADIUS), body, rng, spacing)
        wait = min(rng.uniform(0, LONGEST_DELAY) * other.speed, LONGEST_DELAY_WAY)
        other = other.shifted(-wait * other.direction)
        if not any(overlap(other, s, 2 * spacing) for s in streamlets):
            streamlets.append(other)
        if len(streamlets) == wanted:
            break
    there = -first.tip
    shifted = tuple(s.shifted(there) for s in streamlets)
    return shifted, body.shifted(there), START_GAP * spacing / first.speed


def free_jets(rng: np.random.Generator, spacing: float) -> Parts:
    """Return two streamlets that meet in the air, at 60 to 180 degrees."""
    first, second = (draw_streamlet(rng, spacing, SLENDER_RADIUS) for _ in range(2))
    turn = rng.uniform(np.pi / 3, np.pi)
    flight = first.direction
    across = side_direction(flight, rng.uniform(0, 2 * np.pi))
    second = Streamlet(
        second.length,
        second.radius,
        second.speed,
        rng.uniform(0, 0.5) * min(first.radius, second.radius) * np.cross(flight, across),
        np.cos(turn) * flight + np.sin(turn) * across,
    )
    step = 0.25 * min(first.radius, second.radius)
    while overlap(first, second, START_GAP * spacing / 2):
        first = first.shifted(-step * first.direction)
        second = second.shifted(-step * second.direction)
    return (first, second), NOTHING, START_GAP * spacing / (first.speed + second.speed)


def into_pool(rng: np.random.Generator, spacing: float) -> Parts:
    """Return a streamlet that falls into a shallow pool on a floor: a crown."""
    streamlet = draw_streamlet(rng, spacing, SLENDER_RADIUS)
    radius = float(rng.uniform(*POOL_RADIUS))
    depth = max(float(rng.uniform(*POOL_DEPTH)), 2 * spacing)
    away = 0.4 * radius * np.sqrt(rng.random())
    angle = rng.uniform(0, 2 * np.pi)
    # A pool is a streamlet at rest that points upwards: its tip is the water's surface.
    surface = np.array([away * np.cos(angle), away * np.sin(angle), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    pool = Streamlet(depth, radius, 0.0, surface, up)
    floor = Body("cube", FLOOR, FLOOR, np.array([0, 0, -FLOOR - depth]), np.eye(3))
    sine = np.sqrt(1 - streamlet.direction[2] ** 2)
    height = START_GAP * spacing + streamlet.radius * sine  # of the tip's middle; its rim is lower
    streamlet = streamlet.shifted(streamlet.direction / streamlet.direction[2] * height)
    return (streamlet, pool), floor, START_GAP * spacing / streamlet.speed


FAMILIES: dict[str, tuple[Callable[[np.random.Generator, float], Parts], float]] = {
    "streamlet": (one_streamlet, 0.70),
    "streamlets": (several_streamlets, 0.12),
    "jets": (free_jets, 0.08),
    "pool": (into_pool, 0.10),
}
"""Families of scenes and how often each is drawn."""


def draw_streamlet(
    rng: np.random.Generator, spacing: float, radii: tuple[float, float]
) -> Streamlet:
    """Return a random streamlet that ends at the origin, within TILT_DEG of straight down."""
    length, radius, speed = (
        float(rng.uniform(*limits)) for limits in (STREAMLET_LENGTH, radii, STREAMLET_SPEED)
    )
    tilt = np.radians(TILT_DEG) * np.sqrt(rng.random())
    turn = rng.uniform(0, 2 * np.pi)
    direction = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)])
    return Streamlet(length, max(radius, 1.5 * spacing), speed, np.zeros(3), direction)


def random_body(rng: np.random.Generator) -> Body:
    """Return a random solid around the origin."""
    shape = SHAPES[rng.integers(len(SHAPES))]
    size, height = (float(rng.uniform(*BODY_SIZE)) for _ in range(2))
    return Body(shape, size, height, np.zeros(3), Rotation.random(random_state=rng).as_matrix())


def aimed(streamlet: Streamlet, body: Body, rng: np.random.Generator, spacing: float) -> Streamlet:
    """Return the streamlet START_GAP cells before it hits ``body``, randomly off its middle."""
    while True:  # draws that miss the body are no scenes
        side = side_direction(streamlet.direction, rng.uniform(0, 2 * np.pi))
        offset = side * (body.size + streamlet.radius) * np.sqrt(rng.random())
        target, direction, radius = body.centre + offset, streamlet.direction, streamlet.radius
        if touching_tip(body, target, direction, HIT_SHARE * radius, 0.1 * spacing) is None:
            continue
        tip = touching_tip(body, target, direction, radius, START_GAP * spacing)
        if tip is not None:
            return streamlet.shifted(tip - streamlet.tip)


def overlap(first: Streamlet, second: Streamlet, margin: float) -> bool:
    """Return whether two streamlets come within about ``margin`` metres of each other."""
    sample = 2 * margin
    points = first.fill(sample, np.random.default_rng(0)).positions * sample
    return bool(second.contains(points, margin).any())


def touching_tip(
    body: Body, target: np.ndarray, direction: np.ndarray, radius: float, gap: float
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
            return np.asarray(front[0] + travelled * direction)
        travelled += near - gap
    return None
