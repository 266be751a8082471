# SPDX-License-Identifier: GPL-3.0-or-later
"""Drops, ruptures and waves (paper, 5); imports obstacles and the rooms before it."""
