# SPDX-License-Identifier: GPL-3.0-or-later
"""Motions of both hands for the VR tests: one that code makes, and one that a person made.

The person's is a recording of the aframe-motion-capture project (MIT licence), which lies outside
this checkout; where it is missing, the test that plays it is skipped.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.blender.monado import Hand

RECORDING = Path(
    os.environ.get(
        "LIQUID_SPLASH_VR_RECORDING",
        Path(__file__).resolve().parents[3] / "shared/strokes/controllers-recording.json",
    )
)
PACE, RATE = 4.0, 15.0
"""Times as long as in life that motions are played, where the runtime gives RATE poses a second."""

PARTS = ((7.6, 9.0), (11.5, 14.5))
"""Seconds of the recording in which strokes of a second and more are drawn, by both hands."""

TRIGGER = 0.9
SIDES = ("left", "right")


def turned(degrees: dict[str, float]) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of Euler angles in three.js' order YXZ, degrees."""
    x, y, z = (np.radians(degrees[axis]) / 2 for axis in "xyz")
    cx, cy, cz, sx, sy, sz = np.cos(x), np.cos(y), np.cos(z), np.sin(x), np.sin(y), np.sin(z)
    return (
        float(sx * cy * cz + cx * sy * sz),
        float(cx * sy * cz - sx * cy * sz),
        float(cx * cy * sz - sx * sy * cz),
        float(cx * cy * cz + sx * sy * sz),
    )


class Motion:
    """What both hands do: at each moment (seconds at the pace of life) where they are.

    Attributes
    ----------
    moments : (seconds, left, right), from zero
    """

    def __init__(self, moments: Sequence[tuple[float, Hand, Hand]]) -> None:
        self.moments = list(moments)

    def as_sent(self, sent: Sequence[float], pace: float) -> Motion:
        """Return the motion at the times, seconds, at which it was really played."""
        return Motion(
            [
                ((now - sent[0]) / pace, *hands)
                for now, (_, *hands) in zip(sent, self.moments, strict=True)
            ]
        )

    def slowly(self, pace: float) -> list[tuple[float, Hand, Hand]]:
        """Return the moments to be played."""
        return [(pace * at, left, right) for at, left, right in self.moments]

    def strokes(self, side: int) -> list[tuple[np.ndarray, list[Hand]]]:
        """List the strokes of a hand: times, seconds at the pace of life, and hands."""
        found: list[tuple[list[float], list[Hand]]] = []
        was_down = False
        for at, *both in self.moments:
            if both[side].trigger > 0:
                if not was_down:
                    found.append(([], []))
                found[-1][0].append(at)
                found[-1][1].append(both[side])
            was_down = both[side].trigger > 0
        return [(np.array(times), hands) for times, hands in found]


def recorded_motion(parts: Sequence[tuple[float, float]] = PARTS) -> Motion | None:
    """Read what a person's hands did; None where the file is missing."""
    if not RECORDING.exists():
        return None
    content = json.loads(RECORDING.read_text(encoding="utf-8"))
    poses = [content[side]["poses"] for side in SIDES]
    downs = [held(content[side]["events"]) for side in SIDES]
    start = poses[0][0]["timestamp"]
    moments, before = [], 0.0
    for first, last in parts:
        rows = [
            n
            for n, pose in enumerate(poses[0])
            if first <= (pose["timestamp"] - start) / 1e3 < last
        ]
        for n in rows:
            stamp = poses[0][n]["timestamp"]
            both = [hand_at(poses[side][n], downs[side], stamp) for side in range(2)]
            moments.append((before + (stamp - start) / 1e3 - first, *both))
        before += last - first
    return Motion(moments)


def held(events: Sequence[dict]) -> list[tuple[float, float]]:
    """List from when to when a trigger was held, in the recording's milliseconds."""
    stamps = {
        name: [event["timestamp"] for event in events if event["name"] == name]
        for name in ("buttondown", "buttonup")
    }
    return list(zip(stamps["buttondown"], stamps["buttonup"], strict=True))


def hand_at(pose: dict, downs: Sequence[tuple[float, float]], stamp: float) -> Hand:
    """Return the hand of a pose."""
    is_down = any(first <= stamp < last for first, last in downs)
    place = tuple(pose["position"][axis] for axis in "xyz")
    return Hand(place, turned(pose["rotation"]), TRIGGER if is_down else 0.0)


def made_motion(seconds: float = 1.2) -> Motion:
    """Return two hands that draw loops at speeds that change, one hand twice as fast."""
    moments = []
    for at in np.arange(0.0, seconds + 0.3, 1 / 90):
        both = []
        for side, speed in enumerate((1.0, 2.0)):
            angle = speed * (2 * at + 0.3 * np.sin(4 * at))
            place = (
                side * 0.6 - 0.3 + 0.15 * float(np.cos(angle)),
                1.3 + 0.15 * float(np.sin(angle)),
                -0.5 - 0.1 * float(at),
            )
            turn = (0.0, float(np.sin(0.2 * at)), 0.0, float(np.cos(0.2 * at)))
            is_down = 0.1 <= at < 0.1 + seconds
            both.append(Hand(place, turn, TRIGGER if is_down else 0.0))
        moments.append((float(at), *both))
    return Motion(moments)
