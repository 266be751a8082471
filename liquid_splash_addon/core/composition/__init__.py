# SPDX-License-Identifier: GPL-3.0-or-later
"""Several splashes as one liquid; imports refinement and the rooms before it."""
