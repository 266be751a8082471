# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes with a velocity at every vertex."""

from __future__ import annotations

from dataclasses import dataclass
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

    def joined(self, other: Mesh) -> Mesh:
        """Return both meshes as one."""
        return Mesh(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.faces, other.faces + np.int32(len(self.vertices))]),
            np.concatenate([self.velocities, other.velocities]),
        )


def edge_counts(faces: np.ndarray, count: int) -> csr_matrix:
    """Return how many faces run along each edge in each direction, ``(count, count)``.

    Once wherever a closed mesh is a manifold.
    """
    from scipy.sparse import coo_matrix

    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    return coo_matrix((np.ones(ends.shape[1]), ends), shape=(count, count)).tocsr()
