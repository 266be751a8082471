# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist says of a stroke's speed, by every source of speed."""

import numpy as np
import pytest

from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import Drawing, backward, strokes_from_drawings
from liquid_splash_addon.core.sketch.flow import Flow, as_if_drawn


def straight(points=101, seconds=2.0) -> Drawing:
    """Return a stroke of length 4 at constant speed, thick, with stored speeds."""
    share = np.linspace(0, 1, points)
    path = share[:, None] * (4.0, 0.0, 0.0)
    return Drawing(path, seconds * share, np.full(points, 0.5), np.full(points, 4.0 / seconds))


def velocities(drawing: Drawing, source: str) -> np.ndarray:
    """Return the velocities along the stroke."""
    settings = SplashSettings(real_size=0.0, speed_source=source)
    return strokes_from_drawings([drawing], settings)[0][0].velocities[:, 0]


@pytest.mark.parametrize("source", ["TIME", "ATTRIBUTE", "PRESSURE", "CONSTANT"])
def test_factors_multiply_the_speed_of_every_source(source):
    before = velocities(straight(), source)
    after = velocities(Flow(multiplier=2.5).applied(straight()), source)
    np.testing.assert_allclose(after, 2.5 * before, rtol=1e-6)
    turned = velocities(Flow(multiplier=2.5, backward=True).applied(straight()), source)
    np.testing.assert_allclose(turned, -2.5 * before, rtol=1e-5)


def test_a_profile_goes_through_its_three_values_and_never_beyond():
    flow = Flow(start=0.5, middle=2.0, end=1.0)
    factors = flow.factors(straight().points)
    np.testing.assert_allclose(factors[[0, 50, 100]], [0.5, 2.0, 1.0])
    assert factors.min() >= 0.5 and factors.max() <= 2.0
    assert (np.diff(factors[:51]) >= 0).all() and (np.diff(factors[50:]) <= 0).all()
    even = Flow(start=0.0, middle=1.0, end=2.0).factors(straight().points)
    np.testing.assert_allclose(even, np.linspace(0, 2, 101), atol=1e-9)


def test_the_profile_of_a_backward_stroke_starts_where_the_liquid_does():
    drawing = Flow(backward=True, start=0.5, middle=0.75, end=1.0).applied(straight())
    assert drawing.points[0, 0] == 4.0 and drawing.factors[0] == 0.5


def test_nothing_said_leaves_the_drawing_as_it_is():
    drawing = straight()
    assert Flow().applied(drawing) is drawing
    np.testing.assert_array_equal(backward(Flow(end=2.0).applied(drawing)).factors[0], 2.0)


def test_files_get_times_that_say_the_same():
    drawing = Flow(multiplier=2.0, start=0.5, middle=1.0, end=2.0).applied(straight())
    written = as_if_drawn(drawing)
    assert written.factors is None and written.times[0] == 0
    for source in ("TIME", "ATTRIBUTE"):
        expected, found = velocities(drawing, source), velocities(written, source)
        np.testing.assert_allclose(found[2:-2], expected[2:-2], rtol=0.03)
    at_rest = as_if_drawn(Flow(start=0.0, middle=0.0).applied(straight()))
    assert np.isfinite(at_rest.times).all()
