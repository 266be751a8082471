# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of fields and shapes; imports core only."""
