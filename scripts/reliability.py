# SPDX-License-Identifier: GPL-3.0-or-later
"""Write docs/reliability.md anew from what fuzzer, soak and injections have found.

    python -m scripts.reliability             the page, from docs/results/reliability.json
    python -m scripts.reliability out/found   takes what a run has left there into it first

A run leaves fuzzer*.json, soak.json and injections*.xml (pytest's), see `make reliability`.
"""

from __future__ import annotations

import argparse
import json
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reliability.md"
RESULTS = ROOT / "docs" / "results" / "reliability.json"
BEGIN, END = "<!-- figures: make reliability writes them -->\n", "<!-- end of figures -->\n"

COLUMNS = 120
"""Of a line of the page."""


def taken_in(known: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the results with those of the files in a folder in place of older ones."""
    found = dict(known)
    if runs := [json.loads(path.read_text()) for path in sorted(folder.glob("fuzzer*.json"))]:
        found["fuzzer"] = runs
    if (path := folder / "soak.json").is_file():
        found["soak"] = json.loads(path.read_text())
    for path in sorted(folder.glob("injections*.xml")):
        root = ElementTree.parse(path).getroot()
        found["injections"] = {
            case.get("name", ""): outcome(case) for case in root.iter("testcase")
        }
    return found


def outcome(case: ElementTree.Element) -> str:
    """Return what came of a test, of pytest's XML."""
    tags = {child.tag for child in case}
    if tags & {"failure", "error"}:
        return "failed"
    return "not here" if "skipped" in tags else "held"


def figures(results: Mapping[str, Any]) -> str:
    """Return the tables."""
    return "\n".join(
        (
            "## Fuzzer\n",
            fuzzer_table(results.get("fuzzer", ())),
            "## Soak\n",
            soak_table(results.get("soak", {})),
            "## Injections\n",
            injections_table(results.get("injections", {})),
        )
    )


def fuzzer_table(runs: Any) -> str:
    """Return a row for each run of the fuzzer."""
    head = (
        "| Blender | sequences | faults | operations | of kinds | splashes found on their sketch "
        "| minutes |\n|---|---|---|---|---|---|---|\n"
    )
    return head + "".join(
        f"| {run['blender']} | {run['sequences']:,} | {run['faults']} | {run['operations']:,} | "
        f"{run['kinds']} | {run['placed']:,} | {run['seconds'] / 60:.0f} |\n"
        for run in runs
    )


def soak_table(run: Mapping[str, Any]) -> str:
    """Return the memory after each tenth of the rounds."""
    if not run:
        return "Not run yet.\n"
    about = (
        f"{run['rounds']} rounds in {run['seconds'] / 60:.0f} minutes, Blender {run['blender']}: "
        f"{run['orphans']} data without a user and {run['more_data']} more objects and meshes "
        f"after the last round than after the first. After the first {run['warm']} the memory "
        f"grows by {run['growth']:.2%} in a hundred rounds (a line through all)."
    )
    rows = "".join(f"| {number} | {size:,.0f} MB |\n" for number, size in run["megabytes"].items())
    return f"{textwrap.fill(about, COLUMNS)}\n\n| after round | memory |\n|---|---|\n{rows}"


def injections_table(found: Mapping[str, str]) -> str:
    """Return a row for each injection."""
    rows = "".join(f"| {named(name)} | {came} |\n" for name, came in found.items())
    return f"| what goes wrong | came of it |\n|---|---|\n{rows}"


def named(test: str) -> str:
    """Return a test's name as words."""
    name, _, variant = test.removeprefix("test_").partition("[")
    words = name.replace("_", " ")
    said = variant.removesuffix("]").partition(",")[0].partition(".")[0]
    return f"{words} ({said})" if said else words


def page(text: str, results: Mapping[str, Any]) -> str:
    """Return the page with its figures replaced."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{figures(results)}\n{END}{after}"


def stored() -> dict[str, Any]:
    """Return the results that the page shows."""
    return dict(json.loads(RESULTS.read_text(encoding="utf-8")))


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="what a run has left")
    folder = parser.parse_args().folder
    results = stored() if RESULTS.is_file() else {}
    if folder is not None:
        results = taken_in(results, folder)
        RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), results), encoding="utf-8")


if __name__ == "__main__":
    main()
