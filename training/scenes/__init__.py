# SPDX-License-Identifier: GPL-3.0-or-later
"""Streamlets, the bodies that they hit, and random scenes of them; imports core only."""
