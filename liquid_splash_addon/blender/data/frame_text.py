# SPDX-License-Identifier: GPL-3.0-or-later
"""The local frame of a splash as text: Blender's number properties are single precision."""

from __future__ import annotations

import numpy as np

from ...core.scale import Scale
from ...core.sketch.local_frame import Frame


def frame_to_text(frame: Frame) -> str:
    """Write a frame's 14 numbers (axes, centre, scale of length and of time) as text, exactly."""
    numbers = [*np.ravel(frame.axes), *frame.centre, frame.scale.length, frame.scale.time]
    return " ".join(repr(float(number)) for number in numbers)


def frame_from_text(text: str) -> Frame:
    """Read the frame that :func:`frame_to_text` wrote; before time had a scale there were 13."""
    numbers = [float(word) for word in text.split()]
    scale = Scale(numbers[12], *numbers[13:])
    return Frame(np.reshape(numbers[:9], (3, 3)), np.array(numbers[9:12]), scale)
