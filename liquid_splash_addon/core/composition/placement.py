# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the splashes of a composition are, and their mirrored and rotated copies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..liquid.level_set import LevelSet
from ..mesh.mesh import Mesh
from ..sketch.local_frame import Frame

MOST_COPIES = 360


class CompositionError(ValueError):
    """Splashes cannot be composed; the message says what to do."""


@dataclass(frozen=True)
class Placed:
    """A splash and its place in the drawing.

    Attributes
    ----------
    liquid : in local metres
    frame : of the local box in the drawing; its axes may be mirrored (determinant -1)
    mesh : surface to join, in local metres, closed; its parts may overlap (drops on the splash).
        None stands for the liquid's own surface
    """

    liquid: LevelSet
    frame: Frame
    mesh: Mesh | None = None

    @property
    def cell(self) -> float:
        """Edge of a cell in drawing units."""
        return self.frame.scale.lengths_to_drawing(self.liquid.grid.spacing)

    def moved(self, turn: np.ndarray, point: np.ndarray) -> Placed:
        """Return the splash rotated or mirrored about ``point``; turn : orthogonal ``(3, 3)``."""
        centre = turn @ (self.frame.centre - point) + point
        return replace(self, frame=Frame(self.frame.axes @ turn.T, centre, self.frame.scale))


def mirrored(
    parts: Sequence[Placed],
    normal: Sequence[float] = (1.0, 0.0, 0.0),
    point: Sequence[float] = (0.0, 0.0, 0.0),
) -> list[Placed]:
    """Return the splashes and their mirror images.

    normal, point : of the mirror plane, in the drawing. CompositionError for a normal of length 0.
    """
    n = unit(normal, "The mirror's normal")
    turn = np.eye(3) - 2 * np.outer(n, n)
    return [*parts, *(part.moved(turn, np.asarray(point, dtype=np.float64)) for part in parts)]


def radial(
    parts: Sequence[Placed],
    count: int,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    point: Sequence[float] = (0.0, 0.0, 0.0),
) -> list[Placed]:
    """Return ``count`` copies of the splashes, evenly around an axis; the first are unmoved.

    axis, point : direction and a point of the axis, in the drawing. CompositionError for an axis
    of length 0 or a count outside 1..MOST_COPIES.
    """
    if not 1 <= count <= MOST_COPIES:
        raise CompositionError(f"Radial symmetry takes 1 to {MOST_COPIES} copies, not {count}")
    n = unit(axis, "The axis of the symmetry")
    cross = np.cross(np.eye(3), n)
    copies = list(parts)
    for step in range(1, count):
        angle = 2 * np.pi * step / count
        # Rodrigues' formula; the rows of ``cross`` are e_i x n, so v -> n x v.
        turn = (
            np.cos(angle) * np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(n, n)
        )
        copies += [part.moved(turn, np.asarray(point, dtype=np.float64)) for part in parts]
    return copies


def unit(vector: Sequence[float], name: str) -> np.ndarray:
    """Return the vector scaled to length 1; CompositionError, with its name, if that is 0."""
    length = float(np.linalg.norm(vector))
    if not 0 < length < np.inf:
        raise CompositionError(f"{name} has no direction: choose one that is not zero")
    return np.asarray(vector, dtype=np.float64) / length
