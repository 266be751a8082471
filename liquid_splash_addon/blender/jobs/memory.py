# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory this computer has."""

from __future__ import annotations

import ctypes
import os
import sys


class MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of Windows."""

    _fields_ = [
        ("length", ctypes.c_ulong),
        ("load", ctypes.c_ulong),
        *((f"value_{number}", ctypes.c_ulonglong) for number in range(7)),
    ]


def total_bytes() -> float:
    """Return the bytes of all memory; infinite where it cannot be known."""
    if sys.platform == "win32":
        status = MemoryStatus(length=ctypes.sizeof(MemoryStatus))
        is_known = ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
        return float(status.value_0) if is_known else float("inf")
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError):
        return float("inf")
