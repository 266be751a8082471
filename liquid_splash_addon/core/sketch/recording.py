# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses of a tracked controller to drawings: what a hand draws in virtual reality.

A session delivers the same pose again while its runtime has no newer one, and jumps where one
teleports or tracking was lost. All points are in the world as the session shows it, so navigation
and scale are in them; speeds of the hand are the world's, divided by that scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..settings import Settings, setting
from .drawing import Drawing, estimate_velocity
from .strokes import arc_length

PRESS, RELEASE = 0.3, 0.2
"""Trigger values at which a stroke begins and ends: apart, so that a light finger draws one."""

REST = 0.15
"""Seconds that a pose must stay the same to count as a rest; runtimes repeat poses for less."""

JUMP, FASTEST = 0.25, 12.0
"""Metres and metres a second beyond which no hand moves from one pose to the next: a jump."""

SHORTEST = 0.002
"""Metres that a hand must cover to draw a stroke: less is a tap of the trigger."""

TAIL = 24
"""Poses at the end of an unfinished stroke whose speed is estimated anew with each pose."""

GAINS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Presets of the speed gain: liquid speed over hand speed."""


@dataclass(frozen=True)
class RecordingSettings(Settings):
    """How hands draw."""

    tip: float = setting(
        0.05,
        "Tip (m)",
        "Distance from the controller's aim, forward, at which strokes are drawn",
        low=0.0,
        high=0.5,
        soft=0.2,
    )


class Pose(NamedTuple):
    """A pen tip at one moment.

    Attributes
    ----------
    time : seconds, from any start
    point : tip in the world, ``(x, y, z)``
    pressure : how far the trigger is pulled, 0..1
    scale : world units per metre that the hand moves
    """

    time: float
    point: Sequence[float]
    pressure: float
    scale: float = 1.0


def tip_of(
    location: np.ndarray, rotation: np.ndarray, reach: float, scale: float = 1.0
) -> np.ndarray:
    """Return the pen tip ``(3,)``: ``reach`` metres in front of an aim pose, in the world.

    location : ``(3,)``; rotation : unit quaternion ``(w, x, y, z)``. A pose looks along its own
    -Z (OpenXR 1.0, 2.16).
    """
    w, x, y, z = np.asarray(rotation, dtype=np.float64)
    ahead = -np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    return np.asarray(np.asarray(location, dtype=np.float64) + reach * scale * ahead)


def next_gain(gain: float) -> float:
    """Return the preset after ``gain``; the first after the last."""
    return next((preset for preset in GAINS if preset > gain * 1.001), GAINS[0])


class Recording:
    """A stroke being drawn."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.poses: list[Pose] = []
        self.speeds: list[float] = []
        self._repeated: float | None = None

    def add(self, pose: Pose) -> bool:
        """Append a pose; False for one like the last, of which only a rest is kept."""
        if not self.poses:
            self._append(pose)
            return True
        last = self.poses[-1]
        if np.array_equal(last.point, pose.point):
            self._repeated = pose.time
            return False
        if self._repeated is not None and self._repeated - last.time > REST:
            self._append(last._replace(time=self._repeated))
        self._repeated = None
        self._append(pose)
        return True

    def jumps_to(self, pose: Pose) -> bool:
        """Whether no hand can have moved from the last pose to this one."""
        if not self.poses:
            return False
        last = self.poses[-1]
        step = float(np.linalg.norm(np.subtract(pose.point, last.point))) / pose.scale
        since = max(pose.time - (self._repeated or last.time), 1e-6)
        return step > JUMP and step > FASTEST * since

    def drawing(self) -> Drawing:
        """Return what was drawn so far, in the world; times from zero."""
        poses = self.poses
        times = np.array([pose.time for pose in poses]) - (poses[0].time if poses else 0.0)
        pressures = np.array([pose.pressure for pose in poses])
        return Drawing(self.points(), times, pressures)

    def points(self) -> np.ndarray:
        """Return the points ``(n, 3)``, float64."""
        return np.array([pose.point for pose in self.poses], dtype=np.float64).reshape(-1, 3)

    def is_stroke(self) -> bool:
        """Whether it is longer than a tap of the trigger."""
        if len(self.poses) < 2:
            return False
        return float(arc_length(self.points())[-1]) >= SHORTEST * self.poses[-1].scale

    def _append(self, pose: Pose) -> None:
        self.poses.append(pose)
        tail = self.poses[-TAIL:]
        self.speeds[len(self.poses) - len(tail) :] = hand_speeds(tail)


def hand_speeds(poses: Sequence[Pose]) -> list[float]:
    """Return the speed of the hand at each pose, metres per second; zero where nothing is known."""
    points = np.array([pose.point for pose in poses], dtype=np.float64)
    times = np.array([pose.time for pose in poses])
    if len(poses) < 2 or np.ptp(times) <= 0 or not np.ptp(points, axis=0).any():
        return [0.0] * len(poses)
    speeds = np.linalg.norm(estimate_velocity(points, times), axis=1)
    return [float(v) for v in speeds / np.array([pose.scale for pose in poses])]


class Pen:
    """One hand: its trigger begins and ends strokes."""

    def __init__(self) -> None:
        """Begin with the trigger released."""
        self.recording: Recording | None = None

    @property
    def is_down(self) -> bool:
        """Whether a stroke is being drawn."""
        return self.recording is not None

    def move(self, pose: Pose) -> Recording | None:
        """Follow the hand; return a stroke that ends here, if there is one.

        A stroke consists of the poses with the trigger held. A jump ends it, and the next begins.
        """
        if self.recording is None:
            if pose.pressure > PRESS:
                self.recording = Recording()
                self.recording.add(pose)
            return None
        if pose.pressure < RELEASE:
            return self.lift()
        ended = None
        if self.recording.jumps_to(pose):
            ended, self.recording = self.lift(), Recording()
        self.recording.add(pose)
        return ended

    def lift(self) -> Recording | None:
        """End the stroke, as where the session ends; return it unless it is only a tap."""
        ended, self.recording = self.recording, None
        return ended if ended is not None and ended.is_stroke() else None
