# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid on a grid, as fields and as a level set; imports condition and below."""
