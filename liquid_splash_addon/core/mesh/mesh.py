# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes with a velocity at every vertex."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh, watertight, normals outward.

    Attributes
    ----------
    vertices : float32 ``(n, 3)``
    faces : int32 ``(m, 3)``
    velocities : float32 ``(n, 3)``, in the unit of the vertices per second
    """

    vertices: np.ndarray
    faces: np.ndarray
    velocities: np.ndarray

    @classmethod
    def empty(cls) -> Mesh:
        """Return a mesh without faces."""
        nothing = np.zeros((0, 3), dtype=np.float32)
        return cls(nothing, np.zeros((0, 3), dtype=np.int32), nothing)

    @cached_property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Its edges, int32 ``(e, 2)``, and the one that begins at each corner, int32 ``(m, 3)``."""
        from .edges import unique_edges

        return unique_edges(self.faces, len(self.vertices))

    def with_edges(self) -> Mesh:
        """Return itself, its edges known: so that whoever needs them later need not wait."""
        assert len(self.edges) == 2
        return self

    def joined(self, other: Mesh) -> Mesh:
        """Return both meshes as one."""
        return Mesh(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.faces, other.faces + np.int32(len(self.vertices))]),
            np.concatenate([self.velocities, other.velocities]),
        )


def directed_edges(faces: np.ndarray) -> np.ndarray:
    """Return start and end vertex of the edges of ``faces`` ``(m, 3)``, ``(3 m, 2)``."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def edge_counts(faces: np.ndarray, count: int) -> csr_matrix:
    """Return how many faces run along each edge in each direction, ``(count, count)``.

    In a closed manifold mesh it is one everywhere.
    """
    from scipy.sparse import coo_matrix

    ends = directed_edges(faces).T
    return coo_matrix((np.ones(ends.shape[1]), ends), shape=(count, count)).tocsr()
