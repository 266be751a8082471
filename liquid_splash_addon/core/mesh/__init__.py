# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes and the surface of a liquid; imports generator and the rooms before it."""
