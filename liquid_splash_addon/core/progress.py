# SPDX-License-Identifier: GPL-3.0-or-later
"""How long work tells what it is doing, and how it is stopped."""

from __future__ import annotations

from collections.abc import Callable

Report = Callable[[str, float], None]
"""Called between stages with what comes next and the share done, 0..1; may raise Cancelled."""


class Cancelled(Exception):  # noqa: N818 (not an error: the user wished it)
    """Raised by a report to stop the work; nothing has changed."""


def silent(stage: str, share: float) -> None:
    """Be the report that tells nobody and never stops."""


def part_of(report: Report, first: float, last: float) -> Report:
    """Make the report for a part of the work that goes from ``first`` to ``last``, within 0..1."""
    return lambda stage, share: report(stage, first + share * (last - first))
