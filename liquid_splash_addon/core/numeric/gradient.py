# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradients of scalar fields."""

from __future__ import annotations

import numpy as np


def unit_gradient(field: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the unit gradient of ``field`` ``(X, Y, Z)`` at ``cells`` ``(n, 3)``, ``(n, 3)``.

    By central differences, one-sided at the field's walls; 0 where the field is flat.
    """
    columns = []
    for axis in range(3):
        ahead, behind = cells.copy(), cells.copy()
        ahead[:, axis] = np.minimum(cells[:, axis] + 1, field.shape[axis] - 1)
        behind[:, axis] = np.maximum(cells[:, axis] - 1, 0)
        width = (ahead - behind)[:, axis].astype(field.dtype)
        columns.append((field[tuple(ahead.T)] - field[tuple(behind.T)]) / width)
    gradient = np.stack(columns, axis=1)
    return np.asarray(gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-6))
