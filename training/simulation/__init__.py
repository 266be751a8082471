# SPDX-License-Identifier: GPL-3.0-or-later
"""From scenes to frames; imports data and below."""
