# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's objects to arrays and back. Imports data and core."""
