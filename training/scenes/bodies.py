# SPDX-License-Identifier: GPL-3.0-or-later
"""Analytic solids as signed distances (paper, 4.2.1: sphere, cube, cylinder and cone; or none)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit

SHAPES = ("sphere", "cube", "cylinder", "cone")
"""Solids that liquid is shot at."""

KINDS = (*SHAPES, "tank")

NOWHERE = 1e6
"""Distance of the shape "none" from everything."""


@dataclass(frozen=True)
class Body:
    """A solid body at rest: a ``Solid`` to the liquid's solver (``core.fluid.collision``).

    Attributes
    ----------
    shape : one of KINDS, or "none"; a tank is solid outside, free inside
    size : radius of the sphere, of the cylinder or of the cone's base; half edge of the cube;
        half width of the tank along its first two axes
    height : half height of the cylinder, the cone and the tank (along the third axis)
    centre : ``(3,)``
    axes : ``(3, 3)`` rotation; rows are the body's own axes, the third its axis of symmetry

    All lengths share one unit (cells inside a simulation).
    """

    shape: str
    size: float
    height: float
    centre: np.ndarray
    axes: np.ndarray

    def packed(self) -> tuple[int, float, float, np.ndarray, np.ndarray]:
        """The body as the compiled functions take it."""
        centre, axes = np.asarray(self.centre, float), np.asarray(self.axes, float)
        kind = -1 if self.shape == "none" else KINDS.index(self.shape)
        return kind, float(self.size), float(self.height), centre, axes

    def scaled(self, factor: float) -> Body:
        """Return the body with all lengths times ``factor``."""
        return replace(
            self,
            size=self.size * factor,
            height=self.height * factor,
            centre=np.asarray(self.centre) * factor,
        )

    def shifted(self, by: np.ndarray) -> Body:
        """Return the body moved by ``by`` ``(3,)``."""
        return replace(self, centre=np.asarray(self.centre) + by)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance ``(n,)`` at ``points`` ``(n, 3)``, negative inside."""
        return np.asarray(_distances(points, *self.packed()))

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Velocity ``(n, 3)`` at ``points`` ``(n, 3)``: zero, the body is at rest."""
        return np.zeros(points.shape)


def load_body(fields: Mapping[str, Any]) -> Body:
    """Return the body that ``fields``, in a scene's parameters, describe."""
    arrays = {name: np.asarray(fields[name], dtype=float) for name in ("centre", "axes")}
    return Body(fields["shape"], fields["size"], fields["height"], **arrays)


NOTHING = Body("none", 0.0, 0.0, np.zeros(3), np.eye(3))


@njit(cache=True)
def body_distance(kind, size, height, x, y, z):
    """Return the signed distance of a body in its own axes, centred on the origin."""
    if kind < 0:
        return NOWHERE
    if kind == 0:
        return np.sqrt(x * x + y * y + z * z) - size
    if kind == 1:
        return _box_distance(size, size, x, y, z)
    if kind == 4:
        return -_box_distance(size, height, x, y, z)
    radial = np.sqrt(x * x + y * y)
    if kind == 2:
        a, b = radial - size, abs(z) - height
        return np.sqrt(max(a, 0.0) ** 2 + max(b, 0.0) ** 2) + min(max(a, b), 0.0)
    return _cone_distance(size, height, radial, z)


@njit(cache=True)
def _box_distance(size, height, x, y, z):
    a, b, c = abs(x) - size, abs(y) - size, abs(z) - height
    outside = np.sqrt(max(a, 0.0) ** 2 + max(b, 0.0) ** 2 + max(c, 0.0) ** 2)
    return outside + min(max(a, b, c), 0.0)


@njit(cache=True)
def _cone_distance(size, height, radial, z):
    """Return the distance to a cone with its base at z = -height and its tip at z = +height."""
    # Nearest point of the slanted side, a segment from (size, -height) to (0, height).
    t = ((radial - size) * -size + (z + height) * 2 * height) / (size * size + 4 * height * height)
    t = min(max(t, 0.0), 1.0)
    side = np.hypot(radial - size * (1 - t), z - height * (2 * t - 1))
    base = np.hypot(max(radial - size, 0.0), z + height)
    inside = z > -height and radial * 2 * height < size * (height - z)
    return -min(side, base) if inside else min(side, base)


@njit(cache=True)
def world_distance(kind, size, height, centre, axes, x, y, z):
    """Return the signed distance of a body at (x, y, z)."""
    x, y, z = x - centre[0], y - centre[1], z - centre[2]
    return body_distance(
        kind,
        size,
        height,
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z,
        axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z,
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z,
    )


@njit(cache=True)
def _distances(points, kind, size, height, centre, axes):
    out = np.empty(len(points))
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        out[p] = world_distance(kind, size, height, centre, axes, x, y, z)
    return out
