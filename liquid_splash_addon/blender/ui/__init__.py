# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators, panels and menus. Imports jobs, scene, data and core."""
