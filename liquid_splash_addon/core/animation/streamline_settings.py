# SPDX-License-Identifier: GPL-3.0-or-later
"""How strokes are found in a flow; apart from finding them, which needs packages."""

from __future__ import annotations

from dataclasses import dataclass

from ..settings import Settings, setting


@dataclass(frozen=True)
class StreamlineSettings(Settings):
    """How strokes are found in a flow."""

    strokes: int = setting(
        12,
        "Strokes",
        "Number of strokes at most: as many as an artist would draw",
        low=1,
        high=100,
        soft=20,
    )
    cells: int = setting(
        96,
        "Resolution",
        "Voxels along the longest side in which streamlines are traced. Sheets thinner than a "
        "voxel are lost",
        low=32,
        high=256,
    )
    seed: int = setting(0, "Seed", "Other streamlines of the same flow", low=0, high=2**31 - 1)
