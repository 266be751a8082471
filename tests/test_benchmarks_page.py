# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of benchmarks is what its figures give."""

import json

import pytest

pytest.importorskip("torch")

from tests.benchmarks import page
from tests.benchmarks.figures import FIGURES
from tests.benchmarks.machine import describe


def stored() -> dict:
    """Return the figures that the page shows."""
    return json.loads(page.RESULTS.read_text(encoding="utf-8"))


def test_the_page_shows_the_figures_that_are_stored() -> None:
    text = page.PAGE.read_text(encoding="utf-8")
    assert page.page(text, stored()) == text, "make bench-page writes it"
    assert text.count(page.BEGIN) == text.count(page.END) == 1


def test_every_absolute_figure_is_compared_with_something() -> None:
    assert [key for key, figure in FIGURES.items() if figure.unit and not figure.over] == []
    named = {figure.over for figure in FIGURES.values() if isinstance(figure.over, str)} - {""}
    assert named <= set(FIGURES)
    known = [key for part in stored().values() for key in part["numbers"]]
    assert [key for key in known if key not in FIGURES] == []


def test_an_area_is_replaced_in_whole_and_compared_on_its_own_machine_only() -> None:
    old = {"date": "2026-01-01", "machine": "old"}
    results = page.taken_in({}, {"synthesis.seconds_128": 2.0, "synthesis.peak_mb": 100}, old)
    results = page.taken_in(results, {"refinement.seconds_default": 1.0}, old)
    assert "| 1 s | 0.5 of the splash itself |" in page.figures(results)
    results = page.taken_in(results, {"synthesis.seconds_128": 4.0}, describe())
    assert set(results["synthesis"]["numbers"]) == {"synthesis.seconds_128"}
    shown = page.figures(results)
    assert "| 1 s | `synthesis.seconds_128` was not measured beside it |" in shown
    assert describe()["date"] in shown and "2026-01-01, old." in shown


def test_a_figure_that_nothing_is_said_of_is_shown_by_its_name() -> None:
    results = page.taken_in({}, {"synthesis.new_thing": 1234.5}, describe())
    assert "| `synthesis.new_thing` | new thing | 1,234 |  |" in page.figures(results)
