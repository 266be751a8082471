# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress reports of work that is a part of some larger work."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...core.progress import Report


def part_of(report: Report, first: float, last: float) -> Report:
    """Make the report for a part of the work that goes from ``first`` to ``last``, within 0..1."""
    return lambda stage, share: report(stage, first + share * (last - first))


def labelled(report: Report, label: str) -> Report:
    """Make a report that puts ``label`` before each stage."""
    return lambda stage, share: report(f"{label}: {stage}", share)
