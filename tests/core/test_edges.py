# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of triangle meshes."""

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.edges import unique_edges
from liquid_splash_addon.core.mesh.mesh import Mesh
from tests.core.solids import torus

OPEN = np.array([[0, 1, 2], [2, 1, 3], [5, 3, 1]], dtype=np.int32)
"""A strip of three faces; vertex 4 is none of theirs."""

RING = torus(1.0, 0.3, rings=24)


def sorted_pairs(faces):
    """Return both ends of what begins at each corner, the lower first, ``(3 m, 2)``."""
    return np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)


@pytest.mark.parametrize("faces", [OPEN, OPEN[:, ::-1], RING[1]], ids=["open", "turned", "closed"])
def test_each_edge_is_there_once_and_each_corner_knows_its_own(faces):
    edges, of_corners = unique_edges(faces, int(faces.max()) + 1)
    pairs = sorted_pairs(faces)
    np.testing.assert_array_equal(np.unique(edges, axis=0), np.unique(pairs, axis=0))
    assert len(edges) == len(np.unique(pairs, axis=0))
    np.testing.assert_array_equal(edges[of_corners.ravel()], pairs)


def test_a_closed_surface_obeys_euler():
    vertices, faces = RING
    edges, of_corners = unique_edges(faces, len(vertices))
    assert len(vertices) - len(edges) + len(faces) == 0
    assert (np.bincount(of_corners.ravel()) == 2).all(), "two faces at each edge"


def test_a_mesh_keeps_its_edges():
    empty = Mesh.empty()
    assert [part.shape for part in empty.edges] == [(0, 2), (0, 3)]
    points = np.zeros((6, 3), dtype=np.float32)
    mesh = Mesh(points, OPEN, points)
    assert mesh.with_edges() is mesh and mesh.edges is mesh.edges
