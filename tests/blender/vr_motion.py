# SPDX-License-Identifier: GPL-3.0-or-later
"""Motions of two tracked hands, for tests: recorded by a person."""

from __future__ import annotations


def recorded_motion():
    return None
