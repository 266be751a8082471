# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's own networks and how they are trained, for comparison."""
