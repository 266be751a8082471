# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences for errors that were not foreseen."""

from __future__ import annotations

from ...core import packages

NO_MEMORY = (
    "Not enough memory: choose a lower resolution or fewer particles, or close other programs, "
    "then try again"
)

NO_MEMORY_SAID = ("not enough memory", "can't allocate memory", "out of memory", "start new thread")
"""What libraries say who have no error of their own for memory that is not there: PyTorch, CUDA,
Python's threads."""

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
    if is_no_memory(error):
        return NO_MEMORY
    if isinstance(error, OSError):
        return f"A file could not be read or written ({error}): check the disk, then try again"
    return (
        f"Unexpected error, {type(error).__name__}: {error}. Please report it: the system console "
        "shows the details"
    )


def is_no_memory(error: Exception) -> bool:
    """Whether an error says that memory has run out."""
    if isinstance(error, MemoryError):
        return True
    said = str(error).lower()
    return isinstance(error, RuntimeError) and any(words in said for words in NO_MEMORY_SAID)
