# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiled arithmetic that knows nothing of liquids; imports no other room."""
