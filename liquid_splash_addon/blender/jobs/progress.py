# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress reports of work that is a part of some larger work."""

from __future__ import annotations

from ...core.progress import Report, part_of

__all__ = ["labelled", "part_of"]


def labelled(report: Report, label: str) -> Report:
    """Make a report that puts ``label`` before each stage."""
    return lambda stage, share: report(f"{label}: {stage}", share)
