# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiled loops on several cores.

Not numba's own threads: its portable layer ends the process when two Python threads use it at
once, as Blender's interface and a running splash do.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Found = TypeVar("Found")

MOST_THREADS = 4
"""More threads than this only wait for memory."""


@cache
def workers() -> ThreadPoolExecutor:
    """Return the threads, started at first use."""
    return ThreadPoolExecutor(min(os.cpu_count() or 1, MOST_THREADS), "liquid-splash")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=workers.cache_clear)  # threads stay with the parent


def in_parts(
    count: int, work: Callable[[int, int], Found], parts: int = MOST_THREADS
) -> list[Found]:
    """Return ``work(begin, end)`` for ``parts`` ranges that make up ``range(count)``, in order.

    work : compiled with ``nogil``, or the threads wait for each other. The number of parts does
    not depend on the machine, so neither do results.
    """
    ends = [count * part // parts for part in range(parts + 1)]
    return list(workers().map(work, ends[:-1], ends[1:]))
