# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that turns lengths, velocities and times of a drawing into those of the liquid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

GRAVITY = 9.81
"""m/s^2, down."""

Values = TypeVar("Values", float, np.ndarray)


@dataclass(frozen=True)
class Scale:
    """How a drawing is measured in the liquid's metres and seconds.

    "Local" is the liquid: metres and seconds, in which networks and solvers know it. "Drawing" is
    the scene: its units and the seconds of its timeline.

    Attributes
    ----------
    length : local metres per drawing unit
    time : local seconds per drawing second
    """

    length: float
    time: float = 1.0

    @classmethod
    def of_length(cls, length: float) -> Scale:
        """Return the scale by which strokes are read: the law that gives ``time`` for ``length``.

        Time is never scaled: drawing faster gives a faster splash (paper, Fig. 7).
        """
        return cls(length)

    @classmethod
    def similar(cls, ratio: float) -> Scale:
        """Return the scale of a model ``ratio`` times as large as the real liquid (Froude).

        Gravity is the same in both, so speeds and times go by the root of the ratio.
        """
        return cls(ratio, ratio**0.5)

    def then(self, other: Scale) -> Scale:
        """Return the scale of what ``other`` makes of this one's metres and seconds."""
        return Scale(self.length * other.length, self.time * other.time)

    def slowed(self, time_scale: float) -> Scale:
        """Return the scale of slow motion.

        At 1/20 a drawing second shows 1/20 s of liquid: velocities in the drawing are 1/20 of what
        they were, and gravity is 1/400.
        """
        return Scale(self.length, self.time * time_scale)

    def resized(self, size: float) -> Scale:
        """Return the scale of the same liquid where a drawing unit is ``size`` of the new ones."""
        return Scale(self.length / size, self.time)

    @property
    def speed(self) -> float:
        """Local m/s per drawing unit per drawing second."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """Local m/s^2 per drawing unit per drawing second squared."""
        return self.speed / self.time

    @property
    def gravity(self) -> float:
        """The earth's gravity in the drawing, in drawing units per drawing second squared."""
        return self.accelerations_to_drawing(GRAVITY)

    def lengths_to_local(self, lengths: Values) -> Values:
        """Turn drawing units into local metres."""
        return lengths * self.length

    def lengths_to_drawing(self, lengths: Values) -> Values:
        """Turn local metres into drawing units."""
        return lengths / self.length

    def velocities_to_local(self, velocities: Values) -> Values:
        """Turn drawing units per drawing second into local m/s."""
        return velocities * self.speed

    def velocities_to_drawing(self, velocities: Values) -> Values:
        """Turn local m/s into drawing units per drawing second."""
        return velocities / self.speed

    def accelerations_to_local(self, accelerations: Values) -> Values:
        """Turn drawing units per drawing second squared into local m/s^2."""
        return accelerations * self.acceleration

    def accelerations_to_drawing(self, accelerations: Values) -> Values:
        """Turn local m/s^2 into drawing units per drawing second squared."""
        return accelerations / self.acceleration

    def durations_to_local(self, seconds: Values) -> Values:
        """Turn seconds of the timeline into seconds of the liquid."""
        return seconds * self.time

    def durations_to_drawing(self, seconds: Values) -> Values:
        """Turn seconds of the liquid into seconds of the timeline."""
        return seconds / self.time
