# SPDX-License-Identifier: GPL-3.0-or-later
"""The page on reliability shows what runs have found."""

import json
from pathlib import Path

from scripts import reliability

XML = """<testsuites><testsuite>
<testcase name="test_a_full_disk"/>
<testcase name="test_out_of_memory"><failure message="no"/></testcase>
<testcase name="test_said[CUDA out of memory. Tried]"><skipped/></testcase>
</testsuite></testsuites>"""


def test_the_page_shows_the_figures_that_are_stored() -> None:
    text = reliability.PAGE.read_text(encoding="utf-8")
    assert reliability.page(text, reliability.stored()) == text, "python -m scripts.reliability"
    assert text.count(reliability.BEGIN) == text.count(reliability.END) == 1


def test_nothing_that_is_shown_has_failed() -> None:
    found = reliability.stored()
    assert sum(run["sequences"] for run in found["fuzzer"]) >= 50
    assert not any(run["faults"] for run in found["fuzzer"])
    if soak := found.get("soak"):
        assert soak["growth"] < 0.02 and soak["orphans"] == soak["more_data"] == 0
    assert set(found["injections"].values()) <= {"held", "not here"}


def test_what_a_run_left_takes_the_place_of_what_was_known(tmp_path: Path) -> None:
    soak = {"rounds": 200, "seconds": 90, "blender": "4.5", "orphans": 0, "more_data": 0}
    soak |= {"megabytes": {"100": 1000.0, "200": 1010.0}, "growth": 0.0125, "warm": 100}
    (tmp_path / "soak.json").write_text(json.dumps(soak))
    (tmp_path / "injections.xml").write_text(XML)
    found = reliability.taken_in({"fuzzer": [1], "soak": 2}, tmp_path)
    assert found["fuzzer"] == [1] and found["soak"] == soak
    assert found["injections"] == {
        "test_a_full_disk": "held",
        "test_out_of_memory": "failed",
        "test_said[CUDA out of memory. Tried]": "not here",
    }
    said = reliability.figures({**found, "fuzzer": []})
    assert "| a full disk | held |" in said and "| said (CUDA out of memory) | not here |" in said
    assert "| 200 | 1,010 MB |" in said and "1.25% in a hundred" in said
