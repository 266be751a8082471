# SPDX-License-Identifier: GPL-3.0-or-later
"""On what the benchmarks were measured, and when."""

from __future__ import annotations

import datetime
import os
import platform
from pathlib import Path

import psutil
import torch


def about_file(bench: Path) -> Path:
    """Return where it is kept: beside the figures, which are numbers only."""
    return bench.with_name(f"{bench.stem}_machine.json")


def describe() -> dict[str, str]:
    """Return machine and date in words."""
    memory = psutil.virtual_memory().total / 2**30
    parts = [
        f"{len(os.sched_getaffinity(0))} cores of {processor()}",
        f"{memory:.0f} GB",
        f"{platform.system()}",
        f"Python {platform.python_version()}",
        f"torch {torch.__version__}",
    ]
    return {"date": datetime.date.today().isoformat(), "machine": ", ".join(parts)}


def processor() -> str:
    """Return the processor's name as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
