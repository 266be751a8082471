# SPDX-License-Identifier: GPL-3.0-or-later
"""Coordinate systems of files, turned into Blender's: right-handed, z up."""

from __future__ import annotations

import numpy as np

AXES = {"z-up": ((0, 1), (1, 1), (2, 1)), "y-up": ((0, 1), (2, -1), (1, 1)),
        "y-up-left-handed": ((0, 1), (2, 1), (1, 1))}  # fmt: skip
"""For each of Blender's axes: which of the file's it is, and its sign. Three.js and OpenXR are
``y-up``, Unity is ``y-up-left-handed``."""


def to_blender(points: np.ndarray, axes: str) -> np.ndarray:
    """Return float64 points ``(n, 3)`` in Blender's axes, from those named ``axes``."""
    return np.stack([sign * points[:, column] for column, sign in AXES[axes]], axis=1)
