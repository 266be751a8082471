# SPDX-License-Identifier: GPL-3.0-or-later
"""Face velocities carried from the liquid into the air around it."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .cells import Cells


def valid_faces(cells: Cells, open_share: np.ndarray) -> np.ndarray:
    """Return which faces touch liquid and are not closed by a solid, bool ``(cells, 3)``.

    open_share : ``(cells, 3)``, part of each face that is not solid, 0..1.
    """
    below = cells.neighbours[:, [0, 2, 4]]
    own = np.arange(len(cells.coordinates)) < cells.liquid
    touches = own[:, None] | ((below >= 0) & (below < cells.liquid))
    return touches & (open_share > 0)


def extrapolate(faces: np.ndarray, valid: np.ndarray, cells: Cells, layers: int = 3) -> None:
    """Fill faces that are not ``valid``, layer by layer, with the mean of their known neighbours.

    faces : ``(cells, 3)``, changed in place; valid : bool ``(cells, 3)``. Faces farther than
    ``layers`` from a valid one become zero.
    """
    faces[~valid] = 0.0
    known_since = np.where(valid, 0, 255).astype(np.uint8)
    for layer in range(1, layers + 1):
        _spread(faces, known_since, cells.neighbours, layer)


@njit(cache=True)
def _spread(faces, known_since, neighbours, layer):
    # A face must not take over from another of its own layer, so each has its layer's number.
    for c in range(len(faces)):
        for axis in range(3):
            if known_since[c, axis] != 255:
                continue
            total, count = 0.0, 0
            for side in range(6):
                n = neighbours[c, side]
                if n >= 0 and known_since[n, axis] < layer:
                    total += faces[n, axis]
                    count += 1
            if count:
                faces[c, axis] = total / count
                known_since[c, axis] = layer
