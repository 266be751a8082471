# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiled arithmetic that knows nothing of liquids; imports nothing of core."""
