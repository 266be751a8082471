# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools that make strokes of strokes; each is a list of settings that changes drawings."""

from __future__ import annotations

from .evening import Resample, Reverse
from .filling import Fill
from .lifting import Lift
from .symmetry import Mirror, Spin
from .tool import StrokeTool

TOOLS: dict[str, type[StrokeTool]] = {
    "SPIN": Spin,
    "MIRROR": Mirror,
    "LIFT": Lift,
    "FILL": Fill,
    "RESAMPLE": Resample,
    "REVERSE": Reverse,
}
"""By identifier, in the order in which they are shown."""
