# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals, areas and volumes of triangles."""

import numpy as np
import pytest

from liquid_splash_addon.core.numeric.triangles import (
    enclosed_volume,
    face_areas,
    face_normals,
    signed_volumes,
    triangle_areas,
    vertex_normals,
)

POINTS = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]], dtype=np.float32)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32)
"""A corner of a box, normals outward."""


def test_normals_are_outward_and_unit():
    slanted = np.array([1 / 2, 1 / 3, 1 / 4]) / np.linalg.norm([1 / 2, 1 / 3, 1 / 4])
    np.testing.assert_allclose(
        face_normals(POINTS, FACES), [[0, 0, -1], [0, -1, 0], [-1, 0, 0], slanted], atol=1e-12
    )
    normals = vertex_normals(POINTS, FACES)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(normals[0], -np.array([6, 4, 3]) / np.linalg.norm([6, 4, 3]))


def test_a_face_without_area_has_no_normal():
    assert not face_normals(POINTS, np.array([[0, 1, 1]])).any()


def test_areas_and_volumes():
    np.testing.assert_allclose(face_areas(POINTS, FACES)[:3], [3, 4, 6])
    np.testing.assert_array_equal(face_areas(POINTS, FACES), triangle_areas(POINTS[FACES]))
    assert enclosed_volume(POINTS, FACES) == pytest.approx(4)
    assert enclosed_volume(POINTS + np.float32(7), FACES) == pytest.approx(4)
    np.testing.assert_allclose(signed_volumes(POINTS, FACES), [0, 0, 0, 4])
