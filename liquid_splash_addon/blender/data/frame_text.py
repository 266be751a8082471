# SPDX-License-Identifier: GPL-3.0-or-later
"""The local frame of a splash as text: Blender's number properties are single precision."""

from __future__ import annotations

import numpy as np

from ...core.sketch.local_frame import Frame


def frame_to_text(frame: Frame) -> str:
    """Write a frame's 13 numbers (axes, centre, scale) as text, exactly."""
    numbers = [*np.ravel(frame.axes), *frame.centre, frame.scale]
    return " ".join(repr(float(number)) for number in numbers)


def frame_from_text(text: str) -> Frame:
    """Read the frame that :func:`frame_to_text` wrote."""
    numbers = np.array([float(word) for word in text.split()])
    return Frame(numbers[:9].reshape(3, 3), numbers[9:12], float(numbers[12]))
