# SPDX-License-Identifier: GPL-3.0-or-later
"""Run all benchmarks and write their numbers as one flat JSON object, "area.name": number.

An area is a module beside this one with a function ``measure``; list it in AREAS.
"""

import argparse
import json
from pathlib import Path

from tests.benchmarks import (
    animation,
    capture,
    interface,
    networks,
    product,
    refinement,
    simulation,
    synthesis,
)
from tests.benchmarks.machine import about_file, describe

AREAS = (synthesis.measure, networks.measure, refinement.measure, simulation.measure,
         animation.measure, interface.measure, capture.measure,
         product.measure)  # fmt: skip


def main() -> None:
    """Measure one area after the other: side by side they would take each other's cores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/bench.json"))
    out = parser.parse_args().out
    numbers: dict[str, float] = {}
    for measure in AREAS:
        for name, value in measure().items():
            numbers[name] = round(value, 4)
            print(f"{name:40} {value:10.3f}", flush=True)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(numbers, indent=2) + "\n")
    about_file(out).write_text(json.dumps(describe(), indent=2) + "\n")


if __name__ == "__main__":
    main()
