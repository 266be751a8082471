# SPDX-License-Identifier: GPL-3.0-or-later
"""The blind sheet: its lots and its scores."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from scripts.blind_sheet import by_chance, lots, preferred

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "blind_sheet.py"


def test_each_side_comes_as_often_and_seeds_differ():
    assert lots(16, 0).count("L") == 8
    assert lots(16, 0) == lots(16, 0) != lots(16, 1)
    assert len(lots(5, 3)) == 5


def test_answers_are_counted_against_the_key():
    assert preferred("LLRR", "LRRR") == (3, 4)
    assert preferred("LLRR", "rr--") == (0, 2)
    for wrong in ("LLR", "LLRX"):
        with pytest.raises(ValueError, match="4 letters"):
            preferred("LLRR", wrong)


def test_chance():
    assert by_chance(8, 16) == pytest.approx(1.0)
    assert by_chance(16, 16) == pytest.approx(2 / 2**16)


def test_the_command_scores_viewers(tmp_path):
    (tmp_path / "key.json").write_text(json.dumps({"simulated": "LRLR"}))
    said = subprocess.run(
        [sys.executable, SCRIPT, "score", tmp_path, "LRLL", "RLR-"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert said.returncode == 0, said.stderr
    assert "viewer 1: simulated 3, ours 1, of 4" in said.stdout
    assert "simulated preferred: 42.9% of 7" in said.stdout
    failed = subprocess.run(
        [sys.executable, SCRIPT, "score", tmp_path, "LR"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert failed.returncode == 1 and "is not 4 letters" in failed.stderr
