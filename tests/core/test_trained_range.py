# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a sketch leaves what the generator was trained on; and arrowheads."""

import numpy as np
import pytest

from liquid_splash_addon.core.condition.trained_range import (
    ARM,
    FARTHEST,
    FAST,
    LONELY,
    OUTSIDE,
    SHARP,
    SHARPEST,
    distances_to_others,
    faults_of,
    in_words,
    measured,
    turning,
)
from liquid_splash_addon.core.sketch.arrows import EVERY, arrowheads
from liquid_splash_addon.core.sketch.strokes import Stroke

FASTEST = 5.0


def line(start, stop, speed=1.0) -> Stroke:
    """Return a straight stroke in metres."""
    start, stop = np.asarray(start, float), np.asarray(stop, float)
    points = start + np.linspace(0, 1, 40)[:, None] * (stop - start)
    direction = (stop - start) / np.linalg.norm(stop - start)
    return Stroke(points, np.tile(speed * direction, (40, 1)))


def faults(*strokes: Stroke) -> list[int]:
    """Return all that is wrong with each stroke."""
    return [
        int(np.bitwise_or.reduce(faults_of(measures, FASTEST))) for _, measures in measured(strokes)
    ]


@pytest.mark.parametrize("radius", [0.02, 0.05])
def test_a_circle_turns_by_its_angle_over_the_arms(radius):
    """Two chords of one length from a point of a circle make the angle of one arc."""
    angle = np.linspace(0, 5, 2000)
    circle = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    np.testing.assert_allclose(turning(circle), ARM / radius, rtol=1e-2)
    assert not turning(line((0, 0, 0), (0.1, 0, 0)).points.astype(float)).max() > 1e-3
    assert not turning(circle[:3]).any()


def test_distances_to_others_are_those_of_parallel_lines():
    one, other = (np.linspace((0, y, 0), (0.1, y, 0), 21) for y in (0.0, 0.03))
    for found in distances_to_others([one, other]):
        np.testing.assert_allclose(found, 0.03)
    assert np.isinf(distances_to_others([one])[0]).all()


def test_each_fault_is_found_alone():
    near = line((0, 0.01, 0), (0.1, 0.01, 0))
    assert faults(line((0, 0, 0), (0.1, 0, 0)), near) == [0, 0]
    assert faults(line((0, 0, 0), (0.1, 0, 0), 6.0), near) == [FAST, 0]
    half = 0.6 * FARTHEST  # still in the box
    apart = [line((0, y, 0), (0.1, y, 0)) for y in (-half, half)]
    assert faults(*apart) == [LONELY, LONELY]
    assert faults(line((0.15, 0, 0), (0.25, 0, 0)), line((0.15, 0.01, 0), (0.19, 0.01, 0))) == [
        OUTSIDE,
        0,
    ]
    corner = np.concatenate(
        [
            np.linspace((0, 0, 0), (0.05, 0, 0), 20),
            np.linspace((0.049, 0.001, 0), (0, 0.002, 0), 20),
        ]
    )
    assert SHARPEST < np.pi
    assert faults(Stroke(corner, np.ones_like(corner)), near)[0] == SHARP


def test_a_single_stroke_is_not_lonely():
    assert faults(line((0, 0, 0), (0.1, 0, 0))) == [0]


def test_faults_have_names():
    assert in_words(FAST, 7.03) == "faster than 7.0 m/s"
    assert all(in_words(bit, 7.0) for bit in (SHARP, LONELY, OUTSIDE))


def test_arrowheads_point_along_the_flow():
    points = np.linspace((0, 0, 0), (3.3, 0, 0), 34)
    made = arrowheads(points, 0.1)
    tips = made.segments[:, :, 0]
    np.testing.assert_allclose(tips[:, 0, 0], 3.3 - EVERY * 0.1 * np.arange(5))
    backs = made.segments[:, :, 1]
    np.testing.assert_allclose(tips[..., 0] - backs[..., 0], 0.1)
    np.testing.assert_allclose(np.linalg.norm((backs - tips)[..., 1:], axis=-1), 0.04)
    assert len(arrowheads(points, 100.0).segments) == 1
    np.testing.assert_allclose(points[made.nearest, 0], tips[:, 0, 0], atol=0.1)
