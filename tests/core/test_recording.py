# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses of tracked hands to drawings."""

from itertools import pairwise

import numpy as np
import pytest

from liquid_splash_addon.core.sketch.drawing import estimate_velocity
from liquid_splash_addon.core.sketch.recording import (
    FASTEST,
    GAINS,
    JUMP,
    REST,
    SHORTEST,
    Pen,
    Pose,
    Recording,
    RecordingSettings,
    hand_speeds,
    next_gain,
    tip_of,
)
from liquid_splash_addon.core.sketch.speed_colours import (
    FAST,
    LEVELS,
    RAMP,
    colours_of,
    level_colours,
    pieces_of,
)
from liquid_splash_addon.core.sketch.strokes import arc_length

RATE = 90.0


def circling(seconds=1.0, speed=1.0, radius=0.3, rate=RATE, scale=1.0, pressure=0.8) -> list[Pose]:
    """Return poses on a circle in the world, drawn at a constant speed of the hand, m/s."""
    times = np.arange(0, seconds, 1 / rate)
    angles = speed * times / radius
    return [
        Pose(
            100 + t, (scale * radius * np.cos(a), scale * radius * np.sin(a), 0.0), pressure, scale
        )
        for t, a in zip(times, angles, strict=True)
    ]


def recorded(poses) -> Recording:
    recording = Recording()
    for pose in poses:
        recording.add(pose)
    return recording


def test_every_pose_is_kept_with_its_time_and_pressure():
    poses = [pose._replace(pressure=0.3 + 0.005 * n) for n, pose in enumerate(circling())]
    drawing = recorded(poses).drawing()
    np.testing.assert_array_equal(drawing.points, [pose.point for pose in poses])
    np.testing.assert_allclose(drawing.times, np.arange(90) / RATE, atol=1e-9)
    np.testing.assert_array_equal(drawing.pressures, [pose.pressure for pose in poses])


@pytest.mark.parametrize("repeats", [1, 2, 6])
def test_poses_that_a_runtime_repeats_count_once(repeats):
    """Read faster than they come: the first time that a pose is seen is when it was true."""
    poses = circling(rate=15)
    seen = [
        pose._replace(time=pose.time + n / (15 * repeats)) for pose in poses for n in range(repeats)
    ]
    recording = recorded(seen)
    assert recording.poses == poses
    speeds = np.array(recording.speeds)
    np.testing.assert_allclose(speeds[2:-2], 1.0, atol=0.02)


def test_a_rest_is_kept_as_one():
    first, last = circling()[0], circling()[30]
    resting = [first._replace(time=first.time + n / RATE) for n in range(90)]
    recording = recorded([*resting, last._replace(time=first.time + 1.0 + 1 / RATE)])
    drawing = recording.drawing()
    assert len(drawing.points) == 3 and drawing.times[1] > 1.0 - 2 / RATE > REST
    np.testing.assert_array_equal(drawing.points[0], drawing.points[1])


@pytest.mark.parametrize("scale", [0.05, 1.0, 20.0])
def test_speeds_are_the_hands_whatever_the_scale(scale):
    recording = recorded(circling(speed=1.5, scale=scale))
    np.testing.assert_allclose(recording.speeds[5:-5], 1.5, rtol=0.01)
    length = arc_length(recording.points())[-1]
    assert length == pytest.approx(1.5 * scale * 89 / RATE, rel=1e-3), "places are the world's"


def test_speeds_of_an_unfinished_stroke_are_those_of_the_finished_one():
    poses = circling(seconds=2.0)
    at_once = np.linalg.norm(
        estimate_velocity(np.array([p.point for p in poses]), np.array([p.time for p in poses])),
        axis=1,
    )
    np.testing.assert_allclose(recorded(poses).speeds, at_once, rtol=1e-6)
    assert hand_speeds(poses[:1]) == [0.0] and hand_speeds([poses[0]] * 3) == [0.0] * 3


def test_a_pen_draws_while_the_trigger_is_held():
    pen = Pen()
    pulled = np.concatenate([np.linspace(0, 1, 20), np.ones(40), np.linspace(1, 0, 20)])
    poses = [pose._replace(pressure=value) for pose, value in zip(circling(), pulled, strict=False)]
    ended = [pen.move(pose) for pose in poses]
    (stroke,) = filter(None, ended)
    assert not pen.is_down
    assert stroke.poses[0].pressure > 0.3 and stroke.poses[-1].pressure >= 0.2
    assert all(a.time < b.time for a, b in zip(stroke.poses, stroke.poses[1:], strict=False))


def test_a_light_finger_draws_one_stroke():
    """Between press and release nothing changes: a trigger held at the threshold trembles."""
    pen = Pen()
    tremble = 0.3 + 0.05 * np.sin(np.arange(90))
    ended = [
        pen.move(pose._replace(pressure=value))
        for pose, value in zip(circling(), tremble, strict=True)
    ]
    assert not any(ended) and pen.is_down


def test_a_tap_of_the_trigger_is_no_stroke():
    pen, pose = Pen(), circling()[0]
    pen.move(pose)
    near = pose._replace(time=pose.time + 0.01, point=np.add(pose.point, (0, 0, SHORTEST / 2)))
    pen.move(near)
    assert pen.move(near._replace(pressure=0.0)) is None and not pen.is_down


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_a_teleport_cuts_the_stroke_and_a_fast_hand_does_not(scale):
    poses = circling(seconds=1.0, speed=6.0, scale=scale)
    jumped = [
        pose._replace(point=np.add(pose.point, (2 * JUMP * scale, 0, 0))) for pose in poses[45:]
    ]
    pen = Pen()
    assert not any(pen.move(pose) for pose in poses[:45])
    first = pen.move(jumped[0])
    assert first is not None and first.poses == poses[:45]
    assert not any(pen.move(pose) for pose in jumped[1:])
    assert pen.lift().poses[0].time == jumped[0].time
    assert 2 * JUMP * RATE > FASTEST, "a jump of this size is faster than any hand"


def test_what_was_drawn_survives_the_end_of_a_session():
    pen = Pen()
    for pose in circling():
        pen.move(pose)
    ended = pen.lift()
    assert len(ended.poses) == 90 and pen.lift() is None
    drawing = ended.drawing()
    speed = arc_length(drawing.points)[-1] / drawing.times[-1]
    assert speed == pytest.approx(1.0, rel=1e-3)


def test_the_tip_is_in_front_of_the_aim():
    quarter = np.sqrt(0.5)
    np.testing.assert_allclose(tip_of((1, 2, 3), (1, 0, 0, 0), 0.1, 2.0), (1, 2, 2.8))
    # Upright in Blender: a quarter turn about X makes -Z point along +Y.
    np.testing.assert_allclose(
        tip_of((0, 0, 0), (quarter, quarter, 0, 0), 0.1), (0, 0.1, 0), atol=1e-9
    )
    np.testing.assert_allclose(
        tip_of((0, 0, 0), (quarter, 0, quarter, 0), 0.1), (-0.1, 0, 0), atol=1e-9
    )
    assert 0 < RecordingSettings().tip < 0.2


def test_gains_come_round():
    gain, seen = GAINS[0], []
    for _ in GAINS:
        gain = next_gain(gain)
        seen.append(gain)
    assert seen == [*GAINS[1:], GAINS[0]]
    assert next_gain(3.0) == 4.0 and next_gain(100.0) == GAINS[0]


def test_colours_go_from_slow_to_fast():
    colours = colours_of(np.array([0.0, FAST / 2, FAST, 10 * FAST]))
    assert colours.shape == (4, 4) and colours.dtype == np.float32
    np.testing.assert_allclose(colours[0, :3], RAMP[0], atol=1e-6)
    np.testing.assert_allclose(colours[1, :3], RAMP[2], atol=1e-6)
    np.testing.assert_array_equal(colours[2], colours[3])


def test_a_stroke_is_cut_where_its_colour_changes():
    speeds = np.linspace(0.0, 2 * FAST, 101)
    pieces = pieces_of(speeds)
    assert [level for _, _, level in pieces] == list(range(LEVELS))
    assert pieces[0][0] == 0 and pieces[-1][1] == 100
    assert all(a[1] == b[0] for a, b in pairwise(pieces)), "they meet"
    assert pieces_of(np.zeros(2)) == [(0, 1, 0)]
    np.testing.assert_allclose(level_colours()[0], colours_of(np.array([FAST / LEVELS / 2]))[0])
