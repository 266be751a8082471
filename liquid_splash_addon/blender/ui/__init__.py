# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and panels; imports all other rooms."""
