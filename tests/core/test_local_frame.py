# SPDX-License-Identifier: GPL-3.0-or-later
"""The local frame."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.local_frame import fit_frame, principal_axes
from liquid_splash_addon.core.sketch.presets import example_sketch
from liquid_splash_addon.core.sketch.strokes import Stroke, StrokeError, resampled_points

from .sketching import fan, line, moved


def test_forth_and_back_is_the_identity():
    frame = fit_frame(fan(), real_size=0.25)
    points = np.random.default_rng(0).normal(size=(30, 3))
    assert np.allclose(frame.points_to_drawing(frame.points_to_local(points)), points)
    assert np.allclose(frame.vectors_to_drawing(frame.vectors_to_local(points)), points)


def test_axes_are_right_handed_and_follow_the_flow():
    frame = fit_frame(fan())
    assert np.allclose(frame.axes @ frame.axes.T, np.eye(3))
    assert np.linalg.det(frame.axes) == pytest.approx(1.0)
    assert frame.axes[0] @ [1, 0, 0] > 0.9


def test_longest_side_becomes_the_real_size():
    frame = fit_frame(fan(), real_size=0.3)
    local = np.concatenate([s.points for s in frame.strokes_to_local(fan())])
    assert np.ptp(local, axis=0).max() == pytest.approx(0.3, rel=0.01)


def test_size_zero_means_metres():
    assert fit_frame(fan(), real_size=0).scale == Scale(1.0)


@pytest.mark.parametrize("seed", range(5))
def test_frame_turns_and_moves_with_the_strokes(seed):
    rng = np.random.default_rng(seed)
    rotation, shift = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3)
    here, there = fit_frame(fan(), 0.25), fit_frame(moved(fan(), rotation, shift), 0.25)
    assert np.allclose(there.axes, here.axes @ rotation.T, atol=1e-3)
    assert np.allclose(there.centre, rotation @ here.centre + shift, atol=1e-4)
    assert there.scale.length == pytest.approx(here.scale.length, rel=1e-3)


def wave():
    """Return the bundled wave: flat, symmetric across, drawn from one side to the other."""
    return strokes_from_drawings(example_sketch("wave"), SplashSettings())[0]


@pytest.mark.parametrize("draw", [fan, wave])
def test_a_small_jitter_turns_the_frame_little(draw):
    strokes = draw()
    points, _ = resampled_points(strokes, 0.005 * np.ptp(strokes[0].points, axis=0).max())
    variances = principal_axes(points.astype(float))[2]
    assert (variances[:-1] / variances[1:] > 1.15).all()
    frame = fit_frame(strokes)
    size = np.ptp(np.concatenate([s.points for s in strokes]), axis=0).max()
    for seed in range(10):
        rng = np.random.default_rng(seed)
        shaken = [
            Stroke(s.points + rng.normal(0, 0.01 * size, s.points.shape), s.velocities)
            for s in strokes
        ]
        turn = fit_frame(shaken).axes @ frame.axes.T
        angle = np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
        assert angle < 5


def test_sampling_density_does_not_matter():
    sparse = fit_frame(
        [line((0, 0, 0), (0.2, 0.01, 0), points=3), line((0, 0, 0), (0, 0.05, 0.01))]
    )
    dense = fit_frame(
        [line((0, 0, 0), (0.2, 0.01, 0), points=500), line((0, 0, 0), (0, 0.05, 0.01))]
    )
    assert np.allclose(sparse.axes, dense.axes, atol=1e-3)


def test_empty_sketch_is_refused():
    with pytest.raises(StrokeError, match="Draw at least one stroke"):
        fit_frame([])
