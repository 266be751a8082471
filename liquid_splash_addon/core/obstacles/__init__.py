# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that liquid keeps out of; imports mesh and below."""
