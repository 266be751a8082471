# SPDX-License-Identifier: GPL-3.0-or-later
"""Write docs/benchmarks.md anew from what `make bench` has measured.

    python -m tests.benchmarks.page                  the page, from docs/results/bench.json
    python -m tests.benchmarks.page out/bench.json   takes these figures into it first

An area's figures are replaced together, as they belong to one run on one machine.
"""

from __future__ import annotations

import argparse
import json
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.benchmarks.figures import FIGURES, Figure
from tests.benchmarks.machine import about_file

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "benchmarks.md"
RESULTS = ROOT / "docs" / "results" / "bench.json"
BEGIN, END = "<!-- figures: make bench-page writes them -->\n", "<!-- end of figures -->\n"

COLUMNS = 120
"""Of a line of the page."""


def area(name: str) -> str:
    """Return the area of a figure."""
    return name.partition(".")[0]


def taken_in(known: dict[str, Any], numbers: Mapping[str, float], about: Any) -> dict[str, Any]:
    """Return the results with the areas of a run replaced; about : its machine and date."""
    for name in dict.fromkeys(map(area, numbers)):
        mine = {key: value for key, value in numbers.items() if area(key) == name}
        known = {**known, name: {**about, "numbers": mine}}
    return known


def figures(results: Mapping[str, Any]) -> str:
    """Return the tables: one an area, with machine and date above."""
    order = {key: place for place, key in enumerate(FIGURES)}
    parts = []
    for name, part in results.items():
        rows = [
            f"| `{key}` | {explained(key).meaning} | {measured(key, value)} | "
            f"{ratio(key, value, comparable(results, part))} |\n"
            for key, value in sorted(
                part["numbers"].items(), key=lambda item: order.get(item[0], len(order))
            )
        ]
        where = f"{part['date']}, {part['machine']}."
        parts.append(
            f"### {name}\n\n{textwrap.fill(where, COLUMNS)}\n\n"
            "| key | meaning | measured | beside |\n|---|---|---|---|\n" + "".join(rows)
        )
    return "\n".join(parts)


def explained(key: str) -> Figure:
    """Return what a figure means; of one that nothing is said of, its name."""
    return FIGURES.get(key) or Figure(key.partition(".")[2].replace("_", " "))


def measured(key: str, value: float) -> str:
    """Return a number with its unit, to two or three digits."""
    digits = f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
    return f"{digits} {explained(key).unit}".strip()


def comparable(results: Mapping[str, Any], part: Mapping[str, Any]) -> dict[str, float]:
    """Return the figures that were measured on the day and machine of a part."""
    same = [p for p in results.values() if all(p[k] == part[k] for k in ("machine", "date"))]
    return {key: value for found in same for key, value in found["numbers"].items()}


def ratio(key: str, value: float, numbers: Mapping[str, float]) -> str:
    """Return a figure over the one that it is compared with; nothing where it is a ratio itself.

    numbers : those that it may be compared with, see :func:`comparable`
    """
    figure = explained(key)
    if figure.over == "":
        return ""
    other = numbers.get(figure.over) if isinstance(figure.over, str) else figure.over
    if not other:
        return f"`{figure.over}` was not measured beside it"
    return f"{value / other:.2g} {figure.beside}"


def page(text: str, results: Mapping[str, Any]) -> str:
    """Return the page with its figures replaced."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{figures(results)}\n{END}{after}"


def main() -> None:
    """Take in what the command line names, then write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bench", nargs="?", type=Path, help="what `make bench` wrote")
    measured_in = parser.parse_args().bench
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    if measured_in is not None:
        numbers = json.loads(measured_in.read_text(encoding="utf-8"))
        about = json.loads(about_file(measured_in).read_text(encoding="utf-8"))
        results = taken_in(results, numbers, about)
        RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), results), encoding="utf-8")


if __name__ == "__main__":
    main()
