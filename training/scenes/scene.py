# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene: short cylinders of liquid in flight, a pool perhaps, and a solid (paper, 4.2.1)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.sheets import PARTICLE_SPACING
from liquid_splash_addon.core.fluid.step import Liquid, Physics, World

from .bodies import Body, load_body

START_JITTER = 0.02
"""Largest displacement of a particle along each axis at the start, cells."""

GOLDEN = (3 - np.sqrt(5)) / 2
"""The golden angle, in turns."""


@dataclass(frozen=True)
class Streamlet:
    """A cylinder of liquid with one velocity. Metres, metres per second.

    Attributes
    ----------
    length, radius, speed : numbers
    tip : ``(3,)``, centre of the front
    direction : ``(3,)``, unit vector of the flight and the axis
    """

    length: float
    radius: float
    speed: float
    tip: np.ndarray
    direction: np.ndarray

    def contains(self, points: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """Return which of ``points`` ``(n, 3)`` lie inside or within ``margin`` metres."""
        offset = points - self.tip
        along = offset @ self.direction
        across = np.linalg.norm(offset - along[:, None] * self.direction, axis=1)
        lengthwise = (along <= margin) & (along >= -self.length - margin)
        return np.asarray(lengthwise & (across <= self.radius + margin))

    def shifted(self, by: np.ndarray) -> Streamlet:
        """Return the streamlet moved by ``by`` ``(3,)`` metres."""
        return replace(self, tip=self.tip + by)

    def fill(self, spacing: float, rng: np.random.Generator) -> Particles:
        """Return its particles, in cells of ``spacing`` metres.

        They lie on rings around the axis, turned by a random angle in the first layer and by the
        golden angle from layer to layer: evenly, where a jittered lattice would have clumps at the
        grid's scale, from which sheets tear at random.
        """
        radius, length = self.radius / spacing, self.length / spacing
        rings = max(round(radius / PARTICLE_SPACING), 1)
        layers = max(round(length / PARTICLE_SPACING), 1)
        first = side_direction(self.direction, 0.0)
        second = np.cross(self.direction, first)
        depth = (np.arange(layers) + 0.5) * length / layers
        positions = []
        for ring in range(rings):
            around = max(round(np.pi * (2 * ring + 1)), 1)
            turns = rng.random() + GOLDEN * np.arange(layers)
            angle = 2 * np.pi * (np.arange(around)[None] + turns[:, None]) / around
            across = (ring + 0.5) * radius / rings
            circle = across * (np.cos(angle)[..., None] * first + np.sin(angle)[..., None] * second)
            positions.append((circle - depth[:, None, None] * self.direction).reshape(-1, 3))
        points = np.concatenate(positions) + self.tip / spacing
        points += rng.uniform(-START_JITTER, START_JITTER, points.shape)
        volume = np.pi * radius**2 * length / len(points)
        return Particles.moving(points, self.direction * self.speed / spacing, volume)


@dataclass(frozen=True)
class Scene:
    """One simulation, z up.

    Attributes
    ----------
    seed : the number that all random choices come from
    family : what kind of scene, see ``families``
    cells, spacing : cells along each side of the box; edge of a cell, metres
    streamlets : at least one; a pool is one at rest
    obstacle : the solid, in metres
    impact : seconds from the start until the liquid first meets the solid or other liquid
    """

    seed: int
    family: str
    cells: int
    spacing: float
    streamlets: tuple[Streamlet, ...]
    obstacle: Body
    impact: float

    @classmethod
    def of(cls, parameters: dict[str, Any]) -> Scene:
        """Return the scene that ``parameters``, see :meth:`parameters`, describe."""
        known = {field.name: parameters[field.name] for field in fields(cls)}
        arrays = ({k: _to_array(v) for k, v in s.items()} for s in parameters["streamlets"])
        streamlets = tuple(Streamlet(**s) for s in arrays)
        obstacle = load_body(parameters["obstacle"])
        return cls(**{**known, "streamlets": streamlets, "obstacle": obstacle})

    def shifted(self, by: np.ndarray) -> Scene:
        """Return the scene with everything in it moved by ``by`` ``(3,)`` metres."""
        return replace(
            self,
            streamlets=tuple(s.shifted(by) for s in self.streamlets),
            obstacle=self.obstacle.shifted(by),
        )

    def fill(self, jitter_seed: int = 0) -> Particles:
        """Return the particles at the start; ``jitter_seed`` : see :meth:`liquid`."""
        rng = np.random.default_rng([self.seed, jitter_seed])
        return Particles.joined(*(s.fill(self.spacing, rng) for s in self.streamlets))

    def liquid(self, jitter_seed: int = 0) -> Liquid:
        """Return the liquid at its start; another ``jitter_seed`` makes a twin of it."""
        return Liquid.at_start(self.fill(jitter_seed))

    def world(self, physics: Physics | None = None) -> World:
        """Return what the liquid moves in, in cells; physics : None for the default."""
        solid = self.obstacle.scaled(1 / self.spacing)
        return World.of_water(self.spacing, self.cells, solid, physics)

    def parameters(self) -> dict[str, Any]:
        """Return all that describes the scene, for JSON."""
        return dict(to_plain(asdict(self)))


def to_plain(value: Any) -> Any:
    """Return ``value`` with arrays as lists, all the way down."""
    if isinstance(value, dict):
        return {key: to_plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain(inner) for inner in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def _to_array(value: Any) -> Any:
    return np.asarray(value) if isinstance(value, list) else value


def side_direction(direction: np.ndarray, angle: float) -> np.ndarray:
    """Return the unit vector across ``direction`` at ``angle`` (radians) around it."""
    helper = np.eye(3)[np.argmin(np.abs(direction))]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first)
    return np.cos(angle) * first + np.sin(angle) * np.cross(direction, first)
