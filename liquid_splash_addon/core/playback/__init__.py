# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated frames as files that Blender plays: their surfaces, refined, and their free drops."""
