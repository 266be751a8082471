# SPDX-License-Identifier: GPL-3.0-or-later
"""A model whose answers are known, for tests of what measures models."""

import numpy as np

from liquid_splash_addon.core.liquid.fields import AIR, Fields


class Slabs:
    """A model with known answers: liquid in a slab an eighth of the box thick.

    Its place, in thicknesses along x, is the latent's first number, 0 without one. Cells must
    be at least ``finest`` thousandths of the box, or it cannot answer.
    """

    def __init__(self, finest: float = 0.0) -> None:
        self.finest = finest

    def generate(self, condition, grid, latent=None):
        if grid.spacing < self.finest * 0.4:
            raise ValueError("the grid is too fine")
        cells = grid.shape[0]
        first = 0.0 if latent is None else cells / 8 * float(latent[0])
        x = np.arange(cells) + 0.5
        depth = np.maximum(first - x, x - first - cells / 8)
        distance = np.broadcast_to(depth[:, None, None], grid.shape).astype(np.float32)
        velocity = np.zeros((3, *grid.shape), np.float32)
        velocity[0] = 2.0
        occupancy = (distance < 0).astype(np.float32)
        return Fields(occupancy, np.clip(distance, -AIR, AIR), velocity, grid)
