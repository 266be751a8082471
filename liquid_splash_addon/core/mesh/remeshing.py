# SPDX-License-Identifier: GPL-3.0-or-later
"""Isotropic remeshing: the same surface in triangles of one size (Botsch and Kobbelt 2004).

Long edges are split, short ones collapsed, edges flipped towards six at a vertex, vertices moved
along the surface towards their neighbours' mean. Every vertex lies on a known face of the old mesh,
so the surface cannot drift, and values at the old vertices are interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numeric.triangles import vertex_normals
from .halfedge import anchor, connect
from .remeshing_passes import collapse_short, flip_edges, move_vertices, split_long, weights_at

PHONG_SHARE = 0.75
"""Share of the way to the curved surface, alpha in the paper on Phong tessellation: at 3/4 the
middle of a face lands on the ball whose normals its corners have."""

REMESHING_ROUNDS = 3
"""Rounds of split, collapse, flip and move."""


@dataclass(frozen=True)
class Remeshed:
    """A new mesh and where its vertices lie on the old one.

    Attributes
    ----------
    vertices : float64 ``(n, 3)``, in the unit of the old ones
    faces : int32 ``(m, 3)``
    corners : int32 ``(n, 3)``, the old vertices of the face on which each vertex lies
    weights : float32 ``(n, 3)``, barycentric weights of these corners
    """

    vertices: np.ndarray
    faces: np.ndarray
    corners: np.ndarray
    weights: np.ndarray

    def carry(self, values: np.ndarray) -> np.ndarray:
        """Interpolate values of the old vertices ``(old, ...)`` at the new ones, float32."""
        parts = [
            values[self.corners[:, k]] * self.weights[:, k].reshape(-1, *[1] * (values.ndim - 1))
            for k in range(3)
        ]
        return np.asarray(parts[0] + parts[1] + parts[2], dtype=np.float32)


def unchanged(vertices: np.ndarray, faces: np.ndarray) -> Remeshed:
    """Return a surface whose triangles are to stay as they are, as if it were remeshed."""
    corners = np.repeat(np.arange(len(vertices), dtype=np.int32)[:, None], 3, axis=1)
    weights = np.zeros((len(vertices), 3), dtype=np.float32)
    weights[:, 0] = 1
    return Remeshed(vertices.astype(np.float64), faces, corners, weights)


def isotropic(vertices: np.ndarray, faces: np.ndarray, target: float) -> Remeshed:
    """Return the surface with edges of about ``target``: a closed manifold, oriented as before.

    vertices : ``(n, 3)``; faces : ``(m, 3)``, every edge with one face along it in each
    direction, else NotClosedError; target : in the vertices' unit, above 0, else ValueError.
    Where the surface itself is finer than the target, as on a smaller drop, edges stay shorter.
    """
    if not target > 0:
        raise ValueError(f"the target length must be above 0, not {target}")
    start, twin, old = connect(faces, len(vertices))
    if not len(faces):
        nothing = np.zeros((0, 3), dtype=np.float32)
        none = np.zeros((0, 3), dtype=np.int32)
        return Remeshed(np.zeros((0, 3)), none, none, nothing)
    # In target lengths, around the middle: nothing below depends on the unit.
    middle = vertices.mean(axis=0, dtype=np.float64)
    surface = (vertices[old].astype(np.float64) - middle) / target
    work = _Work(surface, start, twin)
    for _ in range(REMESHING_ROUNDS):
        work.split()
        work.collapse()
        work.flip()
        work.move()
    work.flip(even=False)
    points, new_faces, home, weights = work.result()
    corners = start.reshape(-1, 3)[home]
    points = curved(
        points, surface, vertex_normals(surface, start.reshape(-1, 3)), corners, weights
    )
    return Remeshed(points * target + middle, new_faces, old[corners], weights)


def curved(
    points: np.ndarray,
    surface: np.ndarray,
    normals: np.ndarray,
    corners: np.ndarray,
    weights: np.ndarray,
) -> np.ndarray:
    """Return points of flat faces ``(n, 3)`` on the curved surface that the faces approximate.

    Phong tessellation (Boubekeur and Alexa 2008): each point is pulled towards its projections on
    the tangent planes at its face's corners. Without it, finer triangles would show the old ones.

    surface, normals : the old vertices; corners, weights : as in :class:`Remeshed`.
    """
    pulled = np.zeros_like(points)
    for k in range(3):
        normal = normals[corners[:, k]]
        away = ((points - surface[corners[:, k]]) * normal).sum(axis=1)
        pulled -= (weights[:, k] * away)[:, None] * normal
    return np.asarray(points + PHONG_SHARE * pulled)


class _Work:
    """The mesh being remeshed, in target lengths, and the surface that it lies on."""

    def __init__(self, surface: np.ndarray, start: np.ndarray, twin: np.ndarray) -> None:
        self.surface = (surface, start, twin)
        count = len(surface)
        self.points = surface.copy()
        self.home = np.zeros(count, dtype=np.int32)
        self.home[start] = np.arange(len(start), dtype=np.int32) // 3
        self.out = np.empty(count, dtype=np.int32)
        self.valence = np.empty(count, dtype=np.int32)
        anchor(start, twin, self.out, self.valence)
        self.links = (start.copy(), twin.copy())
        self.count, self.faces = count, len(start) // 3

    def split(self) -> None:
        while True:
            self._enlarge()
            finished, self.count, self.faces = split_long(
                self.points, self.home, *self.links, self.out, self.valence,
                self.count, self.faces, *self.surface,
            )  # fmt: skip
            if finished:
                return

    def _enlarge(self) -> None:
        """Make the arrays hold half as many vertices and faces again."""
        vertices, faces = self.count + self.count // 2 + 64, self.faces + self.faces // 2 + 128
        self.points = _extended(self.points, vertices, self.count)
        self.home = _extended(self.home, vertices, self.count)
        self.out = _extended(self.out, vertices, self.count)
        self.valence = _extended(self.valence, vertices, self.count)
        start, twin = self.links
        self.links = (
            _extended(start, 3 * faces, 3 * self.faces),
            _extended(twin, 3 * faces, 3 * self.faces),
        )

    def collapse(self) -> None:
        collapse_short(self.points, *self.links, self.out, self.valence, self.faces)

    def flip(self, even: bool = True) -> None:
        flip_edges(self.points, *self.links, self.out, self.valence, self.faces, even)

    def move(self) -> None:
        move_vertices(self.points, self.home, *self.links, self.out, self.count, *self.surface)

    def result(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return points, faces, and old face and weights of each vertex, without deleted ones."""
        faces = self.links[0][: 3 * self.faces].reshape(-1, 3)
        faces = faces[faces[:, 0] >= 0]
        kept = np.flatnonzero(self.out[: self.count] >= 0)
        # In the order of the old faces: neighbours on the surface are neighbours in memory.
        kept = kept[np.argsort(self.home[kept], kind="stable")]
        name = np.zeros(self.count, dtype=np.int32)
        name[kept] = np.arange(len(kept), dtype=np.int32)
        faces = name[faces]
        faces = faces[np.argsort(faces[:, 0], kind="stable")]
        points, home = self.points[kept], self.home[kept]
        weights = weights_at(points, home, *self.surface)
        return points, faces, home, weights


def _extended(array: np.ndarray, size: int, used: int) -> np.ndarray:
    larger = np.full((size, *array.shape[1:]), -1, dtype=array.dtype)
    larger[:used] = array[:used]
    return larger
