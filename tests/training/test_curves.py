# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of training runs."""

import json
from pathlib import Path

from training.evaluation import curves


def write_looks(run: Path, *looks: tuple[int, float]) -> None:
    """Write a run's curve: steps and IoU of each look."""
    run.mkdir(exist_ok=True)
    lines = [
        json.dumps({"minutes": s / 10, "steps": s, "samples": 4 * s, "iou_64": iou})
        for s, iou in looks
    ]
    (run / "curve.jsonl").write_text("\n".join(lines) + "\n")


def test_looks_after_an_older_checkpoint_replace_those_before(tmp_path: Path):
    write_looks(tmp_path, (10, 0.1), (20, 0.2), (30, 0.3), (20, 0.25), (40, 0.4))
    assert [(x["steps"], x["iou_64"]) for x in curves.read_curve(tmp_path)] == [
        (10, 0.1),
        (20, 0.25),
        (40, 0.4),
    ]


def test_the_command_draws_and_says_what_is_missing(tmp_path: Path, run_command, capsys):
    from PIL import Image

    write_looks(tmp_path / "a", (10, 0.1), (20, 0.2))
    write_looks(tmp_path / "b", (10, 0.05), (40, 0.1))
    out = tmp_path / "curves.png"
    runs = (f"ours={tmp_path / 'a'}", f"cgan={tmp_path / 'b'}")
    assert run_command(curves.main, *runs, "--out", out) == 0
    with Image.open(out) as picture:
        assert min(picture.size) > 300
    assert run_command(curves.main, *runs, "--out", out, "--cells", 128) == 1
    assert "128^3" in capsys.readouterr().err
    assert run_command(curves.main, f"none={tmp_path / 'c'}", "--out", out) == 1
    assert "no run of `python -m training train`" in capsys.readouterr().err
