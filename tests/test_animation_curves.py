# SPDX-License-Identifier: GPL-3.0-or-later
"""What is measured of an animation's frames, against closed forms."""

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.mesh import directed_edges
from scripts.animation_curves import above


def ball(radius: float, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a ball of triangles, normals outward: an octahedron, divided."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4],
                      [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])  # fmt: skip
    for _ in range(5):
        edges = np.unique(np.sort(directed_edges(faces), axis=1), axis=0)
        number = {(a, b): n + len(points) for n, (a, b) in enumerate(edges.tolist())}
        points = np.concatenate([points, points[edges].mean(axis=1)])
        middles = [[number[min(a, b), max(a, b)] for a, b in ((f[0], f[1]), (f[1], f[2]),
                   (f[2], f[0]))] for f in faces.tolist()]  # fmt: skip
        (a, b, c), (d, e, f) = faces.T, np.array(middles).T
        faces = np.concatenate(
            [np.stack(three, axis=1) for three in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
        )
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points * radius + centre, faces


def test_half_a_ball_is_measured_above_its_middle():
    centre = np.array([0.3, -0.2, 1.0])
    found = above(*ball(0.5, centre), 1.0, centre[:2])
    assert found.volume == pytest.approx(2 / 3 * np.pi * 0.5**3, rel=0.01)
    assert found.centre == pytest.approx(centre + [0, 0, 3 / 8 * 0.5], abs=0.002)
    assert found.radius == pytest.approx(3 * np.pi / 16 * 0.5, rel=0.01)


def test_what_lies_below_does_not_count():
    points, faces = ball(0.5, np.array([0.0, 0.0, 1.0]))
    deep, more = ball(0.5, np.array([5.0, 0.0, -3.0]))
    both = above(np.concatenate([points, deep]), np.concatenate([faces, more + len(points)]),
                 0.0, np.zeros(2))  # fmt: skip
    alone = above(points, faces, 0.0, np.zeros(2))
    assert both.volume == pytest.approx(alone.volume)
    assert both.centre == pytest.approx(alone.centre)
    assert both.radius == pytest.approx(alone.radius)
