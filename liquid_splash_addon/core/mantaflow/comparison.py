# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver made of the splash in its first frame, against what it was given."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .cache_files import data_path, read_grid, read_particles
from .first_frame import BAND, SAMPLES

STILL = 1e-6
"""RMS speed, cells per unit of Mantaflow's time, below which a splash is at rest."""


@dataclass(frozen=True)
class Comparison:
    """The velocity of the first solved frame against that of the splash.

    Attributes
    ----------
    slope : of the solver's velocity over ours, through the origin: 1 where nothing is lost
    correlation : R^2, the share of the solver's velocity that ours explains
    error : RMS of the difference over the RMS of ours
    momentum : of the liquid, over that of the splash along its direction
    volume : of the liquid, over that of the splash
    is_still : whether the splash had no velocity; then only ``volume`` says something
    """

    slope: float
    correlation: float
    error: float
    momentum: float
    volume: float
    is_still: bool = False

    @property
    def is_good(self) -> bool:
        """Whether the solver goes on from the splash."""
        if self.is_still:
            return 0.9 < self.volume < 1.1
        return 0.95 <= self.slope <= 1.05 and self.correlation > 0.95 and 0.9 < self.volume < 1.1

    def __str__(self) -> str:
        if self.is_still:
            return f"No velocity to compare: the splash was at rest. Volume {self.volume:.1%}"
        return (
            f"Slope {self.slope:.3f}, R² {self.correlation:.3f}, error {self.error:.1%}, "
            f"momentum {self.momentum:.1%}, volume {self.volume:.1%}"
        )


def compare(
    cache: Path, frame: int, fall: tuple[float, float, float] | np.ndarray = (0.0, 0.0, 0.0)
) -> Comparison:
    """Compare frame ``frame``, which was written, with the next one, which was solved.

    fall : what gravity adds to the velocity in a frame, cells per unit of time; it is taken off.
    Raises CacheError where one of them is not there.
    """
    ours, solved = (read_grid(data_path(cache, "vel", n)) for n in (frame, frame + 1))
    before, after = (read_grid(data_path(cache, "phi", n)) for n in (frame, frame + 1))
    a, b = [], []
    for axis in range(3):
        wet = (before < 0) & (after < 0)
        both = np.zeros_like(wet)
        upper = (slice(None),) * axis + (slice(1, None),)
        lower = (slice(None),) * axis + (slice(None, -1),)
        both[upper] = wet[upper] & wet[lower]
        a.append(ours[axis][both].astype(np.float64))
        b.append(solved[axis][both].astype(np.float64) - fall[axis])
    own, other = np.concatenate(a), np.concatenate(b)
    square = max(float(own @ own), 1e-30)
    slope = float(own @ other) / square
    left = float(((other - slope * own) ** 2).sum())
    correlation = 1 - left / max(float(other @ other), 1e-30)
    error = float(np.sqrt(((other - own) ** 2).sum() / square))
    mass, moment = carried(cache, frame, before, ours)
    mass_after, moment_after = carried(cache, frame + 1, after, solved)
    moment_after = moment_after - mass_after * np.asarray(fall)
    momentum = float(moment @ moment_after) / max(float(moment @ moment), 1e-30)
    still = square <= STILL**2 * len(own)
    return Comparison(slope, correlation, error, momentum, mass_after / max(mass, 1e-30), still)


def carried(
    cache: Path, frame: int, level: np.ndarray, faces: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the volume (cells^3) of a frame's liquid, and the sum ``(3,)`` of its velocity.

    Cells with particles count by how many they have, deeper ones as full: Mantaflow keeps particles
    only near the surface.
    """
    positions, velocities = read_particles(cache, frame)
    held = np.zeros(level.shape, dtype=bool)
    cells = np.clip(positions.astype(int), 0, np.array(level.shape) - 1)
    held[tuple(cells.T)] = True
    deep = (level < 1 - BAND) & ~held
    volume = len(positions) / SAMPLES**3 + float(deep.sum())
    inside = faces[:, deep].sum(axis=1, dtype=np.float64)
    return volume, velocities.sum(axis=0, dtype=np.float64) / SAMPLES**3 + inside
