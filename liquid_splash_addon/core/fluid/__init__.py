# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid's physics on a sparse grid, one term a file.

``cells`` finds the active cells, ``transfer`` moves velocity between particles and faces,
``extrapolation`` carries it into the air, ``pressure`` makes it divergence-free, ``advection``
moves the particles, ``surface`` turns particles into a signed distance, ``streamlines`` traces
the flow. Work is proportional to the liquid, not to the box.

Everything here measures space in cells: positions in cell coordinates (cell i spans
[i, i + 1)), velocities in cells per second. Face ``a`` of a cell is its lower face along axis
``a``; velocities are stored as ``(cells, 3)``, one column a face (a MAC grid).
"""
