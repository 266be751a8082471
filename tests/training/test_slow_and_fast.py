# SPDX-License-Identifier: GPL-3.0-or-later
"""How ruptured answers are, by speed."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import Fields
from liquid_splash_addon.core.sketch.strokes import Stroke
from training.data.frames import scene_path
from training.data.items import load_items, split_of
from training.research import slow_and_fast


def test_strokes_drawn_at_a_speed_keep_how_their_speeds_compare():
    rng = np.random.default_rng(0)
    strokes = [Stroke(rng.normal(size=(9, 3)), size * rng.normal(size=(9, 3))) for size in (1, 3)]
    drawn = slow_and_fast.drawn_at(strokes, 0.6)
    together = np.concatenate([stroke.velocities for stroke in drawn])
    assert np.linalg.norm(together, axis=1).mean() == pytest.approx(0.6)
    ratios = [d.velocities / s.velocities for d, s in zip(drawn, strokes, strict=True)]
    np.testing.assert_allclose(ratios, ratios[0][0, 0], rtol=1e-5)


def test_a_sheet_with_a_hole_and_a_drop_is_more_ruptured_than_a_block():
    sheet = np.zeros((24, 24, 24), dtype=bool)
    sheet[2:20, 2:20, 6:8] = True
    sheet[8:12, 8:12] = False
    sheet[16:20, 16:20, 14:18] = True
    block = np.zeros_like(sheet)
    block[4:16, 4:16, 4:16] = True
    ruptured, whole = (slow_and_fast.figures(fields_of(cells)) for cells in (sheet, block))
    assert (ruptured["pieces"], ruptured["holes"]) == (2, 1)
    assert (whole["pieces"], whole["holes"]) == (1, 0)
    assert whole["volume"] == 12**3
    # A sheet two cells thick has 1 / cell of 1 / h; a cube of 12 cells, half of that.
    cells = 100 * Grid.local(128).spacing
    assert ruptured["surface"] * cells > 0.8 > 0.6 > whole["surface"] * cells > 0.4


def fields_of(liquid: np.ndarray) -> Fields:
    """Return fields of such cells at rest."""
    distance = np.where(liquid, -1.0, 1.0).astype(np.float32)
    still = np.zeros((3, *liquid.shape), dtype=np.float32)
    grid = Grid.local(128).crop((0, 0, 0), liquid.shape)
    return Fields(liquid.astype(np.float32), distance, still, grid)


def test_the_difference_counts_scenes_not_frames():
    rows = [({"x": value}, {"x": 0.0}) for value in (1.0, 1.0, 1.0, 3.0)]
    mean, error = slow_and_fast.difference(rows, [7, 7, 7, 8], "x")
    assert mean == 2 and error == pytest.approx(1.0)


def test_the_command(toy_data: Path, tmp_path: Path, run_command, capsys):
    (scene,) = {item.scene for item in load_items(toy_data, "train")}
    seed = int(scene.stem[-6:])
    other = next(n for n in range(seed + 1, seed + 99) if split_of(n) == "train")
    for number in (seed, other):
        shutil.copy(scene, scene_path(tmp_path, number))
    where = ("--split", "train", "--cells", 64)
    assert run_command(slow_and_fast.main, tmp_path, "--most", 2, *where) == 0
    said = capsys.readouterr().out.splitlines()
    names = ["pieces", "holes", "surface", "volume"]
    names += [f"{name}, broken up" for name in names]
    assert [line.split(" slow ")[0].strip() for line in said] == names
    assert run_command(slow_and_fast.main, tmp_path, "--most", 1, *where) == 1
    assert "give more of them" in capsys.readouterr().err
