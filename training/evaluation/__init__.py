# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures and pictures of what the weights do; imports learning and below."""
