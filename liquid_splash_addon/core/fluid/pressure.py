# SPDX-License-Identifier: GPL-3.0-or-later
"""Pressure that makes face velocities divergence-free, with a free surface and solids."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiling import njit
from .cells import Cells

SEPARATION_PASSES = 2
"""Rough solves, after each of which cells that a wall would pull at are released."""

ROUGH_RESIDUAL = 1e-2
"""Residual at which a solution shows where walls pull."""

PULL_SHARE = 1e-4
"""A wall pulls where q is below minus this share of the largest |q|."""


class Poisson(NamedTuple):
    """The matrix of the pressure problem: minus the divergence of the gradient through open faces.

    Attributes
    ----------
    coefficients : ``(liquid, 6)``, open share towards liquid neighbours, 0 towards air and solids
    diagonal : ``(liquid,)``, sum of the open shares
    walled : ``(liquid,)``, whether a solid closes a part of the cell's faces
    neighbours : ``(cells, 6)``, see :class:`~.cells.Cells`
    """

    coefficients: np.ndarray
    diagonal: np.ndarray
    walled: np.ndarray
    neighbours: np.ndarray

    @classmethod
    def assemble(cls, cells: Cells, open_share: np.ndarray) -> Poisson:
        """Return the matrix of the liquid cells; open_share : float32 ``(cells, 3)``."""
        coefficients, diagonal, walled = _assemble(cells.neighbours, open_share, cells.liquid)
        return cls(coefficients, diagonal, walled, cells.neighbours)

    def solve(
        self, rhs: np.ndarray, letting_go: bool, rtol: float = 5e-4, maxiter: int = 400
    ) -> np.ndarray:
        """Return q ``(liquid,)`` with A q = ``rhs``, q = 0 in the air, by conjugate gradients.

        The preconditioner is the diagonal: thin liquid needs few iterations.

        letting_go : set q to 0 where a wall would pull the liquid (q < 0), and solve again, so
        that liquid may separate from a solid. rtol : residual over the right-hand side, RMS.
        """
        pinned = self.diagonal <= 0
        q = np.zeros(len(rhs), dtype=np.float32)
        for _ in range(SEPARATION_PASSES if letting_go else 0):
            self._improve(q, rhs, pinned, max(ROUGH_RESIDUAL, rtol), maxiter)
            # A threshold, so that rounding does not decide about cells in free flight (q = 0).
            pulled = self.walled & (q < -PULL_SHARE * np.abs(q).max(initial=0)) & ~pinned
            if not pulled.any():
                break
            pinned |= pulled
        self._improve(q, rhs, pinned, rtol, maxiter)
        return q

    def _improve(
        self, q: np.ndarray, rhs: np.ndarray, pinned: np.ndarray, rtol: float, maxiter: int
    ) -> None:
        """Iterate from ``q``, in place, until the residual is small."""
        _solve(self.coefficients, self.diagonal, self.neighbours, rhs, pinned, q, rtol, maxiter)


def project(
    faces: np.ndarray,
    cells: Cells,
    open_share: np.ndarray,
    matrix: Poisson,
    outside: np.ndarray | None = None,
    walls: np.ndarray | None = None,
) -> np.ndarray:
    """Return ``faces`` minus the gradient of the pressure that makes them divergence-free.

    Solves ``div(s (u - grad q) + (1 - s) w) = 0`` in liquid cells for q = dt p / (rho h), with s
    the open share of each face and w the speed of the wall across the rest of it (Batty, Bertails
    and Bridson 2007). Closed faces are unchanged.

    faces : float32 ``(cells, 3)``, cells/s; open_share : float32 ``(cells, 3)``; outside :
    ``(cells,)``, q of the air cells (from surface tension) instead of 0, cells^2/s; walls :
    float32 ``(cells, 3)``, w, cells/s; None where all are at rest.
    """
    rhs = _divergence(faces, cells.neighbours, open_share, cells.liquid)
    if walls is not None:
        rhs += _divergence(walls, cells.neighbours, 1 - open_share, cells.liquid)
    q = np.zeros(len(faces), dtype=np.float32)
    if outside is not None:
        _add_outside(rhs, outside, cells.neighbours, open_share)
        q[:] = outside
    q[: cells.liquid] = matrix.solve(rhs, letting_go=True)
    out = faces.copy()
    _subtract_gradient(out, q, cells.neighbours, open_share, cells.liquid)
    return out


def spread_apart(
    crowding: np.ndarray, cells: Cells, open_share: np.ndarray, matrix: Poisson
) -> np.ndarray:
    """Return displacements of the faces ``(cells, 3)``, in cells, that remove crowding.

    Their divergence in each liquid cell is ``crowding`` ``(liquid,)``, see
    :func:`.density.crowding` (Kugelstadt et al. 2019, density projection).
    """
    q = np.zeros(len(cells.coordinates), dtype=np.float32)
    q[: cells.liquid] = matrix.solve(crowding, letting_go=False, rtol=1e-2)
    out = np.zeros_like(open_share)
    _subtract_gradient(out, q, cells.neighbours, open_share, cells.liquid)
    return out


def divergence(faces: np.ndarray, cells: Cells, open_share: np.ndarray) -> np.ndarray:
    """Return the outflow of each liquid cell through its open faces, ``(liquid,)``, 1/s."""
    return -_divergence(faces, cells.neighbours, open_share, cells.liquid)


@njit(cache=True)
def _assemble(neighbours, open_share, liquid):
    coefficients = np.zeros((liquid, 6), dtype=np.float32)
    diagonal = np.zeros(liquid, dtype=np.float32)
    walled = np.zeros(liquid, dtype=np.bool_)
    for c in range(liquid):
        for side in range(6):
            n = neighbours[c, side]
            share = open_share[n if side & 1 else c, side >> 1]
            diagonal[c] += share
            walled[c] |= share < 1
            if n < liquid:
                coefficients[c, side] = share
    return coefficients, diagonal, walled


@njit(cache=True)
def _divergence(faces, neighbours, open_share, liquid):
    """Return minus the divergence: the right-hand side."""
    out = np.empty(liquid, dtype=np.float32)
    for c in range(liquid):
        total = 0.0
        for axis in range(3):
            n = neighbours[c, 2 * axis + 1]
            total += open_share[c, axis] * faces[c, axis] - open_share[n, axis] * faces[n, axis]
        out[c] = total
    return out


@njit(cache=True, fastmath=True)
def _multiply(coefficients, diagonal, neighbours, pinned, x, out):
    """Write A x into ``out``, return x . A x."""
    total = 0.0
    for c in range(len(x)):
        if pinned[c]:
            out[c] = 0.0
            continue
        value = diagonal[c] * x[c]
        for side in range(6):
            share = coefficients[c, side]
            if share != 0:
                value -= share * x[neighbours[c, side]]
        out[c] = value
        total += value * x[c]
    return total


@njit(cache=True, fastmath=True)
def _solve(coefficients, diagonal, neighbours, rhs, pinned, x, rtol, maxiter):
    """Solve A x = rhs by preconditioned conjugate gradients from the given x; 0 where pinned."""
    count = len(x)
    r = np.zeros(count, dtype=np.float32)
    z, d, q = np.zeros_like(r), np.zeros_like(r), np.zeros_like(r)
    target = 1e-20
    for c in range(count):
        target += rtol * rtol * rhs[c] * rhs[c]
        if pinned[c]:
            x[c] = 0.0
    _multiply(coefficients, diagonal, neighbours, pinned, x, q)
    rz, rr = 0.0, 0.0
    for c in range(count):
        if not pinned[c]:
            r[c] = rhs[c] - q[c]
            z[c] = r[c] / diagonal[c]
            d[c] = z[c]
            rz += r[c] * z[c]
            rr += r[c] * r[c]
    iteration = 0
    while rr > target and iteration < maxiter:
        curvature = _multiply(coefficients, diagonal, neighbours, pinned, d, q)
        if curvature <= 0 or rz <= 0:  # lost to rounding: this is the best there is
            break
        alpha = rz / curvature
        new, rr = 0.0, 0.0
        for c in range(count):
            if not pinned[c]:
                x[c] += alpha * d[c]
                r[c] -= alpha * q[c]
                z[c] = r[c] / diagonal[c]
                new += r[c] * z[c]
                rr += r[c] * r[c]
        beta = new / rz
        rz = new
        for c in range(count):
            d[c] = z[c] + beta * d[c]
        iteration += 1
    return iteration


@njit(cache=True)
def _add_outside(rhs, outside, neighbours, open_share):
    """Add the pressure of the air to the right-hand side."""
    liquid = len(rhs)
    for c in range(liquid):
        for side in range(6):
            n = neighbours[c, side]
            if n >= liquid:
                rhs[c] += open_share[n if side & 1 else c, side >> 1] * outside[n]


@njit(cache=True)
def _subtract_gradient(faces, pressure, neighbours, open_share, liquid):
    for c in range(len(faces)):
        for axis in range(3):
            n = neighbours[c, 2 * axis]
            if n >= 0 and (c < liquid or n < liquid) and open_share[c, axis] > 0:
                faces[c, axis] -= pressure[c] - pressure[n]
