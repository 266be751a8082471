# SPDX-License-Identifier: GPL-3.0-or-later
"""What each channel of a condition tells, by name; the names stand in the weights' header."""

from __future__ import annotations

STROKE_CHANNELS = (
    "stroke_occupancy",
    "stroke_velocity_x", "stroke_velocity_y", "stroke_velocity_z",
    "stroke_offset_x", "stroke_offset_y", "stroke_offset_z",
)  # fmt: skip
"""Of the strokes in a cell: 1 where there are any, their mean velocity (m/s), and their mean offset
from the cell's centre (cells, -0.5..0.5). The paper's condition has the first four."""

PATCH_CHANNELS = (
    "patch_closeness", "patch_fairness", "patch_coherence",
    "patch_in_liquid", "patch_near_liquid",
    "patch_velocity_x", "patch_velocity_y", "patch_velocity_z",
    "patch_offset_x", "patch_offset_y", "patch_offset_z",
)  # fmt: skip
"""Of the patches in a cell, see ``patches.sampling.PatchSamples``: closeness is 0 where there is
none; the offset is as that of the strokes."""

CHANNEL_NAMES = STROKE_CHANNELS + PATCH_CHANNELS
CHANNELS = len(CHANNEL_NAMES)


def _columns(prefix: str) -> slice:
    """Return the channels whose names begin like this, which lie side by side."""
    found = [i for i, name in enumerate(CHANNEL_NAMES) if name.startswith(prefix)]
    return slice(found[0], found[-1] + 1)


STROKE = _columns("stroke_")
STROKE_OCCUPANCY = CHANNEL_NAMES.index("stroke_occupancy")
STROKE_VELOCITY = _columns("stroke_velocity")
STROKE_OFFSET = _columns("stroke_offset")
PATCH = _columns("patch_")
PATCH_CLOSENESS = CHANNEL_NAMES.index("patch_closeness")
PATCH_VELOCITY = _columns("patch_velocity")
PATCH_OFFSET = _columns("patch_offset")

OUTPUT_NAMES = ("logit", "distance", "velocity_x", "velocity_y", "velocity_z")
"""Outputs of a generator's network: of the occupancy, over the band, over the velocity scale."""
