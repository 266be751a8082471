# SPDX-License-Identifier: GPL-3.0-or-later
"""The physics of liquid on a sparse grid, one term a file; imports numeric.

Lengths are in cells: positions in cell coordinates (cell i spans [i, i + 1)), velocities in cells
per second. Face ``a`` of a cell is its lower face along axis ``a``; velocities are stored as
``(cells, 3)``, one column for each face (a MAC grid).
"""
