# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of bfloat16 for compiled loops, which have no such type."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor


def bits(x: Tensor) -> tuple[np.ndarray, np.uint32]:
    """Return the bits of ``x``, contiguous, and how far to shift them for those of its float32.

    A bfloat16 is the upper half of a float32, so a loop widens each value as it reads it: a copy of
    the whole array would take as long as the loop. Other types are converted to float32.
    """
    if x.dtype == torch.bfloat16:
        return x.contiguous().view(torch.int16).numpy().view(np.uint16), np.uint32(16)
    return x.float().contiguous().numpy().view(np.uint32), np.uint32(0)
