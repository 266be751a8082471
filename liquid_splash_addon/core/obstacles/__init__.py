# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that the liquid keeps out of; imports mesh and the rooms before it."""
