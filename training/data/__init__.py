# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames on disk and training samples made of them; imports figures and below."""
