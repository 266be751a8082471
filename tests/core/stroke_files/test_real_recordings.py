# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings that people made in VR, where they lie beside the checkout."""

import json

import numpy as np
import pytest

from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import estimate_velocity, strokes_from_drawings
from liquid_splash_addon.core.sketch.strokes import check_strokes
from liquid_splash_addon.core.stroke_files.controllers import read_poses, to_drawing
from liquid_splash_addon.core.stroke_files.reading import KINDS, read_recording
from liquid_splash_addon.core.stroke_files.recording import segment_speeds
from tests.core.stroke_files.making import SHARED

pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason=f"no recordings in {SHARED}")

FILES = {
    "a-painter-demo.apa": (28, 1771, 0.50, {50: 0.496, 90: 0.86, 99: 1.656}),
    "a-painter-dancer.apa": (101, 6298, 0.22, {50: 0.22, 90: 0.939, 99: 1.909}),
    "open-brush-sketch1.tilt": (5, 912, 0.51, {50: 0.512, 90: 1.392, 99: 2.149}),
    "tiltbrush-splatter.tilt": (67, 1231, 6.5, {50: 6.487}),
    "tiltbrush-simple.tilt": (3, 32, 0.05, {50: 0.049}),
    "tiltbrush-one-stroke.tilt": (1, 4, 0.02, {50: 0.0206}),
    "tiltbrush-blue-tit.tilt": (471, 9403, 1.09, {50: 1.094, 90: 1.923}),
    "tiltbrush-mech.tilt": (869, 21393, 0.41, {50: 0.41, 90: 1.70, 99: 12.97}),
    "tiltbrush-hello-world.tilt": (65, 2895, None, {}),
}
"""Strokes, points, and raw speeds: the median as published, with its rounding, and percentiles as
measured by another reader of the same bytes."""


def rounded(value: float, published: float) -> float:
    """Return a value to the decimals that were published."""
    return round(value, max(len(f"{published:g}".partition(".")[2]), 1))


@pytest.mark.parametrize("name", FILES)
def test_counts_and_raw_speeds_are_those_published(name):
    strokes, points, median, percentiles = FILES[name]
    raw, _ = KINDS[name[name.rindex(".") :]].read((SHARED / name).read_bytes())
    assert (len(raw), sum(len(d.points) for d in raw)) == (strokes, points)
    speeds = segment_speeds(raw)
    if median is None:
        assert len(speeds) == 0
        return
    assert rounded(float(np.median(speeds)), median) == pytest.approx(median, rel=0.01)
    for percent, expected in percentiles.items():
        assert np.percentile(speeds, percent) == pytest.approx(expected, rel=0.012)


def test_the_controllers_poses_and_strokes_are_those_published():
    path = SHARED / "controllers-recording.json"
    right = to_drawing(read_poses(json.loads(path.read_text())["right"]["poses"]))
    assert len(right.points) == 2568 and np.ptp(right.times) == pytest.approx(29, abs=0.3)
    assert np.median(segment_speeds([right])) == pytest.approx(0.69, rel=0.01)
    found = read_recording(path)
    assert len(found.drawings) == 18 and found.warnings == []


WARNINGS = {
    "tiltbrush-hello-world.tilt": "65 of 65 strokes have no recorded time",
    "tiltbrush-splatter.tilt": "6.49 m/s fast in the median, which no hand is",
    "tiltbrush-mech.tilt": "40 of 869 strokes faster than 4 m/s",
    "tiltbrush-blue-tit.tilt": "471 of 471 strokes do not say at which zoom",
}


@pytest.mark.parametrize("name", WARNINGS)
def test_what_is_wrong_with_a_recording_is_said(name):
    assert any(WARNINGS[name] in line for line in read_recording(SHARED / name).warnings)


@pytest.mark.parametrize("name", [*FILES, "controllers-recording.json"])
def test_every_recording_gives_strokes_with_a_hand_s_speed(name):
    found = read_recording(SHARED / name)
    strokes, _ = strokes_from_drawings(found.drawings, SplashSettings(real_size=0.0))
    check_strokes(strokes)
    speeds = np.concatenate([np.linalg.norm(s.velocities, axis=1) for s in strokes])
    assert len(strokes) == len(found.drawings) and np.median(speeds) < 2
    assert np.quantile(speeds, 0.99) < 4


def hand(number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times (s), places (m) and the sensor's own velocities (m/s) of a tracked finger."""
    lines = (SHARED / f"leap-digit-{number}.lmr").read_text().replace("#", ";").splitlines()
    table = np.array([[float(cell) for cell in line.split(";")] for line in lines if line.strip()])
    return table[:, 0] / 1000, table[:, 1:4] / 1000, table[:, 7:10] / 1000


def travelled(times: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Return the displacement since the start that velocities add up to, ``(n, 3)``."""
    steps = np.diff(times)[:, None] * (velocities[1:] + velocities[:-1]) / 2
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def contradiction(times: np.ndarray, places: np.ndarray, velocities: np.ndarray) -> float:
    """Return how far velocities miss the way covered in 0.3 s, over that way (both RMS)."""
    ends = np.searchsorted(times, times + 0.3)
    starts = np.flatnonzero(ends < len(times))
    ends = ends[starts]
    way, sums = places[ends] - places[starts], travelled(times, velocities)
    miss = sums[ends] - sums[starts] - way
    return float(np.sqrt((miss**2).sum() / (way**2).sum()))


@pytest.mark.parametrize(("number", "agreement"), ((0, 0.88), (3, 0.98)))
def test_our_velocity_adds_up_to_the_way_and_the_sensor_s_does_not(number, agreement):
    """Both point the same way and rise and fall together, but the sensor's is twice too large:
    its own places and times contradict it (docs/stroke-files.md)."""
    times, places, sensed = hand(number)
    ours = estimate_velocity(places, times)
    assert contradiction(times, places, ours) < 0.05
    assert contradiction(times, places, sensed) > 1.0
    correlation = (ours * sensed).sum() / np.sqrt((ours**2).sum() * (sensed**2).sum())
    factor = (ours * sensed).sum() / (ours**2).sum()
    assert correlation > agreement and 1.6 < factor < 2.3
