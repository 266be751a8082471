# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences for errors that were not foreseen."""

from __future__ import annotations

from ...core import packages

_last = ""


def last_sentence() -> str:
    """Return what :func:`sentence_for` last said; nothing if there was no error."""
    return _last


def sentence_for(error: Exception) -> str:
    """Return what to tell a user of an error, and keep it for the report of a bug."""
    global _last
    _last = worded(error)
    return _last


def worded(error: Exception) -> str:
    """Put an error into words. Those of ours are such sentences."""
    if isinstance(error, ImportError):
        return packages.advice_for(error)
    if isinstance(error, ValueError):
        return str(error)
    if isinstance(error, MemoryError):
        return (
            "Not enough memory: choose a lower resolution or fewer particles, or close other "
            "programs, then try again"
        )
    if isinstance(error, OSError):
        return f"A file could not be read or written ({error}): check the disk, then try again"
    return (
        f"Unexpected error, {type(error).__name__}: {error}. Please report it: the system console "
        "shows the details"
    )
