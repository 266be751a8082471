# SPDX-License-Identifier: GPL-3.0-or-later
"""Models that are measured: how they are loaded by name, and their thresholds."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.generator.weights_file import default_weights_path  # noqa: E402
from liquid_splash_addon.core.grid import Grid  # noqa: E402
from liquid_splash_addon.core.liquid.fields import Fields  # noqa: E402
from tests.training.answering import Slabs  # noqa: E402
from training.data.items import load_items  # noqa: E402
from training.data.samples import held_out_sample  # noqa: E402
from training.evaluation import answers as answers_module  # noqa: E402
from training.evaluation.answers import ByGrid, calibrate, load_answers  # noqa: E402
from training.learning.thresholds import best_threshold  # noqa: E402


def test_models_are_loaded_by_kind(tmp_path: Path, monkeypatch):
    run, finer = tmp_path / "run", tmp_path / "finer"
    papers = {run: Slabs(), finer: Slabs()}
    for cells, (path, paper) in zip((32, 64), papers.items(), strict=True):
        path.mkdir()
        paper.cells = cells
        torch.save({"kind": "paper"}, path / "checkpoint.pt")
    monkeypatch.setattr(answers_module, "load_paper", lambda path: papers[path])
    answers, hashes = load_answers([f"a={run}", f"a={finer}"])
    assert list(answers) == ["a"] and len(hashes["a"].split()) == 2
    grid, condition = Grid.local(64), None
    assert answers["a"].answers == {32: papers[run], 64: papers[finer]}
    assert answers["a"].generate(condition, grid).grid == grid
    with pytest.raises(ValueError, match=r"no run of it for 64\^3"):
        load_answers([f"a={run}"])[0]["a"].generate(condition, grid)
    with pytest.raises(ValueError, match="two runs for the same grid"):
        load_answers([f"a={run}", f"a={run}"])
    with pytest.raises(ValueError, match="No network at"):
        load_answers([f"b={tmp_path / 'none'}"])
    file = default_weights_path()
    for requests in (["a"], [f"nearest={run}"], [f"={run}"], [f"a={run}", f"a={file}"]):
        with pytest.raises(ValueError, match="name of its own"):
            load_answers(requests)
    torch.save({"kind": "splash"}, run / "checkpoint.pt")
    with pytest.raises(ValueError, match="python -m training export"):
        load_answers([f"a={run}"])
    (run / "checkpoint.pt").unlink()
    with pytest.raises(ValueError, match="holds no training run"):
        load_answers([f"a={run}"])


class Timid:
    """An answer that knows the truth of some frames, but gives it between two numbers only."""

    def __init__(self, items, cells: int, low: float, high: float) -> None:
        truths = [held_out_sample(item, cells)[0].distance < 0 for item in items]
        self.occupancies = [np.where(truth, high, low).astype(np.float32) for truth in truths]
        self.cells, self.threshold = cells, 0.5

    def generate(self, condition, grid, latent=None):
        occupancy = self.occupancies.pop(0)
        return Fields(occupancy, -occupancy, np.zeros(3), grid)


def test_the_best_threshold_is_found(toy_data: Path):
    items = load_items(toy_data, "validation")[:2]
    timid = Timid(items, 32, 0.3, 0.6)
    assert best_threshold(timid, items, 32, [0.1, 0.2, 0.4, 0.7]) == 0.4


def test_a_model_of_the_papers_is_calibrated_on_each_of_its_grids(toy_data: Path):
    items = load_items(toy_data, "validation")[:1]
    runs = [Timid(items, 32, 0.0, 0.12), Timid(items, 16, 0.82, 0.93)]
    calibrate(ByGrid(runs), items, [32, 16, 64])
    assert 0.0 < runs[0].threshold <= 0.12 and 0.82 <= runs[1].threshold < 0.93
    runs[0].threshold = 0.7
    calibrate(ByGrid(runs), items, [64])  # not asked for
    assert runs[0].threshold == 0.7
    ours = Slabs()
    calibrate(ours, items, [32])
    assert not hasattr(ours, "threshold")
