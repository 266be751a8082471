# SPDX-License-Identifier: GPL-3.0-or-later
"""Specks of liquid, removed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..liquid.level_set import LevelSet
from .detail import Detail
from .settings import CleanupSettings

SPECK_LEVEL = 1.0
"""Level in cells of the air where a speck was."""


def remove_specks(liquid: LevelSet, settings: CleanupSettings) -> Detail:
    """Return the splash without pieces of liquid smaller than the least volume.

    Cells that share a face belong to one piece.
    """
    from scipy.ndimage import label

    piece, count = label(liquid.level < 0)
    sizes = np.bincount(piece.ravel(), minlength=count + 1)
    small = sizes < settings.volume
    small[0] = False
    out = np.where(small[piece], np.float32(SPECK_LEVEL), liquid.level)
    clean = replace(liquid, level=out)
    warnings = []
    if count and not (out < 0).any():
        warnings.append("Clean Up removed all of the liquid: lower its Least Volume")
    return Detail(clean, clean.volume - liquid.volume, warnings)
