# SPDX-License-Identifier: GPL-3.0-or-later
"""From samples to weights; imports simulation and below."""
