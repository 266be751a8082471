# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that several tests draw."""

from __future__ import annotations

import numpy as np

from liquid_splash_addon.core.condition.channels import CHANNELS, PATCH_CLOSENESS
from liquid_splash_addon.core.condition.patches.sampling import PatchSamples
from liquid_splash_addon.core.condition.voxelize import Condition, voxelize
from liquid_splash_addon.core.sketch.strokes import Stroke


def line(start, stop, speed=1.0, points=20) -> Stroke:
    """Return a straight stroke drawn at constant speed."""
    start, stop = np.asarray(start, float), np.asarray(stop, float)
    direction = (stop - start) / np.linalg.norm(stop - start)
    path = start + np.linspace(0, 1, points)[:, None] * (stop - start)
    return Stroke(path, np.tile(speed * direction, (points, 1)))


def fan(count=7, length=0.2) -> list[Stroke]:
    """Return strokes that leave the origin along +x, fanned out in y and a little in z.

    Three clearly different variances and a clear mean flow: the frame is unambiguous.
    """
    strokes = []
    for n in range(count):
        angle = 0.3 * (n / (count - 1) - 0.5) * 2
        tip = length * np.array([np.cos(angle), np.sin(angle), 0.1 * np.sin(3 * n)])
        start = np.array([0.0, 0.006 * n, 0.0])
        strokes.append(line(start, start + tip, speed=2.0))
    return strokes


def patches_between(strokes) -> PatchSamples:
    """Return samples of the patches, with the bundled classifier's verdicts."""
    from liquid_splash_addon.core.generator import patch_classifier

    return patch_classifier.patch_samples(strokes, patch_classifier.bundled_patch_classifier())


def condition_of(strokes, grid) -> Condition:
    """Return what the bundled generator is shown."""
    return voxelize(strokes, grid, patches_between(strokes))


def moved(strokes, rotation, shift) -> list[Stroke]:
    """Return the strokes turned by ``rotation`` and moved by ``shift``."""
    return [Stroke(s.points @ rotation.T + shift, s.velocities @ rotation.T) for s in strokes]


def sparse(cells: np.ndarray) -> Condition:
    """Return a condition from all its cells ``(C, X, Y, Z)``; channels that miss are zero."""
    full = np.zeros((CHANNELS, *cells.shape[1:]), dtype=np.float32)
    full[: len(cells)] = cells
    where = np.argwhere(full[0] + full[PATCH_CLOSENESS] > 0).astype(np.int32)
    return Condition(where, full[:, *where.T].T.copy(), cells.shape[1:])
