# SPDX-License-Identifier: GPL-3.0-or-later
"""The Laplacian of a triangle mesh: cotangent weights, lumped mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import counting_sort
from ..numeric.triangles import cross_edges, squared_length

STIFFEST = 10.0
"""Largest sum of weights over mass at a vertex, in 1 / target edge squared; it is 4 where triangles
are equilateral. A vertex beside a sliver gets more mass instead, which slows waves there alone:
otherwise it would shorten the time step everywhere."""


@dataclass(frozen=True)
class Laplacian:
    """The operator (L u)_i = sum_j weight_ij (u_j - u_i) / mass_i.

    Attributes
    ----------
    first : int32 ``(n + 1,)``, where the neighbours of each vertex begin in ``near``
    near : int32 ``(e,)``, the neighbours
    weights : float32 ``(e,)``, (cot alpha + cot beta) / 2, symmetric, never negative
    mass : float32 ``(n,)``, a third of the area of the faces around, m^2, or more (STIFFEST)
    bound : upper bound of the eigenvalues of -L, 1 / m^2
    """

    first: np.ndarray
    near: np.ndarray
    weights: np.ndarray
    mass: np.ndarray
    bound: float

    @property
    def rows(self) -> np.ndarray:
        """Weights over the mass of their vertex, float32 ``(e,)``."""
        return np.asarray(self.weights / np.repeat(self.mass, np.diff(self.first)))

    def apply(self, values: np.ndarray) -> np.ndarray:
        """Return L ``values``, float32 ``(n,)``."""
        result = np.empty(len(values), dtype=np.float32)
        _apply(self.first, self.near, self.rows, values.astype(np.float32), result)
        return result

    def diffuse(self, values: np.ndarray, width: float) -> np.ndarray:
        """Return ``values`` blurred by a Gaussian with a standard deviation of ``width`` metres.

        values : ``(n,)``; the result is float32.
        """
        time = width * width / 2
        steps = int(np.ceil(time * self.bound))
        if steps == 0:
            return values.astype(np.float32)
        rows, blurred = self.rows, values.astype(np.float32)
        change = np.empty_like(blurred)
        for _ in range(steps):
            _apply(self.first, self.near, rows, blurred, change)
            blurred += np.float32(time / steps) * change
        return blurred


def laplacian(vertices: np.ndarray, faces: np.ndarray, edge: float) -> Laplacian:
    """Return the Laplacian of a closed mesh with edges of about ``edge`` metres.

    vertices : ``(n, 3)``, metres; faces : ``(m, 3)``.

    The eigenvalues of M^-1 B W B^T, B the incidence of vertices and edges, are those of
    B^T M^-1 B W apart from zeros. In its row of edge ij the absolute values sum to D_i + D_j,
    where D is the sum of weights over mass: Gershgorin's theorem gives the bound. It needs
    weights that are not negative, so negative ones (obtuse angles) are set to 0.
    """
    cotangents = np.empty(faces.shape, dtype=np.float64)
    mass = np.zeros(len(vertices), dtype=np.float64)
    _assemble(vertices.astype(np.float64), faces, cotangents, mass)
    order, first = counting_sort(faces.reshape(-1), len(vertices))
    near = np.empty(faces.size, dtype=np.int32)
    half = np.empty(faces.size, dtype=np.float64)
    _by_vertex(faces, cotangents, order, near, half)
    weights = np.empty_like(half)
    _symmetrise(first, near, half, weights)
    bound = _stiffness(first, near, weights, mass, STIFFEST / (edge * edge))
    # Rounding to float32 may raise an eigenvalue a little.
    return Laplacian(
        first, near, weights.astype(np.float32), mass.astype(np.float32), 1.0001 * bound
    )


@njit(cache=True)
def _assemble(points, faces, cotangents, mass):
    """Write half the cotangent opposite each face's edges k, k + 1; add the faces' area to mass."""
    for f in range(len(faces)):
        x, y, z = cross_edges(faces[f, 0], faces[f, 1], faces[f, 2], points)
        double = np.sqrt(x * x + y * y + z * z)
        for k in range(3):
            a, b, c = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
            ab, bc, ca = (
                squared_length(a, b, points),
                squared_length(b, c, points),
                squared_length(c, a, points),
            )
            # The least area stands for an angle of 0.6 degrees.
            cotangents[f, k] = 0.25 * (bc + ca - ab) / max(double, 0.01 * max(ab, bc, ca), 1e-30)
            mass[a] += double / 6


@njit(cache=True)
def _by_vertex(faces, cotangents, order, near, half):
    """Write the next vertex of every corner, and its cotangent, in the order of the vertices."""
    for n in range(len(order)):
        f, k = order[n] // 3, order[n] % 3
        near[n] = faces[f, (k + 1) % 3]
        half[n] = cotangents[f, k]


@njit(cache=True)
def _symmetrise(first, near, half, weights):
    """Add the half of the face on the other side to the weight of every edge."""
    for v in range(len(first) - 1):
        for e in range(first[v], first[v + 1]):
            other = near[e]
            total = half[e]
            for back in range(first[other], first[other + 1]):
                if near[back] == v:
                    total += half[back]
                    break
            weights[e] = max(total, 0.0)


@njit(cache=True)
def _stiffness(first, near, weights, mass, stiffest):
    """Raise masses as far as ``stiffest`` asks; return the bound of the eigenvalues."""
    count = len(first) - 1
    ratio = np.empty(count)
    for v in range(count):
        total = 0.0
        for e in range(first[v], first[v + 1]):
            total += weights[e]
        mass[v] = max(mass[v], total / stiffest, 1e-30)
        ratio[v] = total / mass[v]
    bound = 0.0
    for v in range(count):
        for e in range(first[v], first[v + 1]):
            bound = max(bound, ratio[v] + ratio[near[e]])
    return bound


@njit(cache=True, fastmath=True)
def _apply(first, near, rows, values, result):
    for v in range(len(values)):
        total = np.float32(0)
        here = values[v]
        for e in range(first[v], first[v + 1]):
            total += rows[e] * (values[near[e]] - here)
        result[v] = total


def mean_curvature(operator: Laplacian, vertices: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the mean curvature (1 / m) at every vertex, positive on a ball, float32 ``(n,)``.

    The Laplacian of the position is -2 H n.
    """
    columns = [operator.apply(vertices[:, n]) * normals[:, n] for n in range(3)]
    return np.asarray(-0.5 * (columns[0] + columns[1] + columns[2]), dtype=np.float32)


def pieces(operator: Laplacian) -> np.ndarray:
    """Return the number of the connected piece that each vertex belongs to, int32 ``(n,)``."""
    return _flood(operator.first, operator.near)


@njit(cache=True)
def _flood(first, near):
    count = len(first) - 1
    piece = np.full(count, -1, dtype=np.int32)
    waiting = np.empty(count, dtype=np.int32)
    found = 0
    for seed in range(count):
        if piece[seed] >= 0:
            continue
        waiting[0], left = seed, 1
        piece[seed] = found
        while left:
            left -= 1
            v = waiting[left]
            for e in range(first[v], first[v + 1]):
                if piece[near[e]] < 0:
                    piece[near[e]] = found
                    waiting[left] = near[e]
                    left += 1
        found += 1
    return piece
