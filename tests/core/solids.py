# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes of solids whose distance is known, faces outward."""

from __future__ import annotations

import numpy as np


def strip(rows, columns, round_and_round=False):
    """Return the faces of a lattice of vertices, row by row, whose columns are closed rings.

    round_and_round : the last row is followed by the first.
    """
    last = rows if round_and_round else rows - 1
    i, j = (a.ravel() for a in np.meshgrid(np.arange(last), np.arange(columns), indexing="ij"))
    here, beside = i * columns, (i + 1) % rows * columns
    k = (j + 1) % columns
    one = np.stack([here + j, beside + j, here + k], axis=1)
    return np.concatenate([one, np.stack([here + k, beside + j, beside + k], axis=1)])


def sphere(radius, centre=(0.0, 0.0, 0.0), rings=96, from_angle=0.0):
    """Return a sphere, or what is left of it more than ``from_angle`` away from its upper pole."""
    polar = np.linspace(from_angle, np.pi, rings + 1)[:, None]
    turn = np.linspace(0, 2 * np.pi, rings, endpoint=False)
    place = [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar) + 0 * turn]
    vertices = radius * np.stack(place, axis=-1).reshape(-1, 3) + np.asarray(centre)
    return vertices, strip(rings + 1, rings)


def torus(radius, tube, rings=128):
    """Return a torus around z."""
    turn = np.linspace(0, 2 * np.pi, rings, endpoint=False)
    around, about = turn[:, None], turn[None, :]
    far = radius + tube * np.cos(about)
    place = [far * np.cos(around), far * np.sin(around), tube * np.sin(about) + 0 * around]
    return np.stack(place, axis=-1).reshape(-1, 3), strip(rings, rings, round_and_round=True)


def box(low, high):
    """Return a box of twelve triangles."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return low + corners * (high - low), np.array(faces)


def box_distance(points, low, high):
    """Return the signed distance to a box."""
    middle, half = (np.add(low, high)) / 2, np.subtract(high, low) / 2
    over = np.abs(points - middle) - half
    outside = np.linalg.norm(np.maximum(over, 0), axis=-1)
    return outside + np.minimum(over.max(axis=-1), 0)


def volume(vertices, faces):
    """Return the volume by the divergence theorem: positive if faces point outward."""
    a, b, c = (vertices[faces[:, n]].astype(float) for n in range(3))
    return (np.cross(a, b) * c).sum() / 6


def is_closed(faces):
    """Tell whether every edge has two faces that run along it in opposite directions."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forward = np.sort(edges[:, 0] * (faces.max() + 1) + edges[:, 1])
    backward = np.sort(edges[:, 1] * (faces.max() + 1) + edges[:, 0])
    return bool((np.diff(forward) > 0).all() and (forward == backward).all())
