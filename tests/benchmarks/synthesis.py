# SPDX-License-Identifier: GPL-3.0-or-later
"""From strokes to mesh on the processor, as the Generate Splash button does it."""

import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.generator.precision import fastest_in_use
from liquid_splash_addon.core.pipeline import Splash, make_splash
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import example_sketch

REPEATS = 5


def prepared(resolution: str) -> Callable[[], Splash]:
    """Return a call that makes the example's splash, with all that is loaded once loaded."""
    settings = SplashSettings(resolution=resolution, device="CPU")
    generator = load_generator(device="CPU", precision=fastest_in_use("cpu"))
    strokes, _ = strokes_from_drawings(example_sketch(), settings)
    return lambda: make_splash(strokes, settings, generator)


def median_seconds(call: Callable[[], object]) -> float:
    """Return the median time of ``call`` after once to warm up."""
    call()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def peak_mb() -> float:
    """Return the peak memory in MB of a fresh process that makes one splash at full resolution."""
    root = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-m", "tests.benchmarks.synthesis"]
    return float(subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE).stdout)


def own_peak_mb() -> float:
    """Return the peak memory of this process in MB."""
    status = Path("/proc/self/status")
    if not status.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20  # macOS: bytes
    # Not ru_maxrss, which on Linux starts with the peak of the process that started this one.
    (line,) = [line for line in status.read_text().splitlines() if line.startswith("VmHWM")]
    return float(line.split()[1]) / 2**10


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    return {
        "synthesis.seconds_128": median_seconds(prepared("128")),
        "synthesis.seconds_64": median_seconds(prepared("64")),
        "synthesis.peak_mb": peak_mb(),
    }


if __name__ == "__main__":
    prepared("128")()
    print(own_peak_mb())
