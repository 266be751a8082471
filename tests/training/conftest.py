# SPDX-License-Identifier: GPL-3.0-or-later
"""A toy data set, simulated once a test session by the real commands."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from training.data.frames import load_parameters, scene_path, write_whole
from training.simulation import simulate


@pytest.fixture(scope="session")
def run_command() -> Callable[..., int]:
    """Return a function that runs a command's main() with arguments, in this process."""

    def run(main: Callable[[Sequence[str]], int], *arguments: object) -> int:
        return main([*map(str, arguments)])

    return run


@pytest.fixture(scope="session")
def toy_data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a data set of one scene each for training, validation and tests, at 32 cells."""
    from training.data.items import split_of

    data = tmp_path_factory.mktemp("data")
    wanted, seed = {"train", "validation", "test"}, 0
    while wanted:
        if split_of(seed) in wanted:
            write_whole(scene_path(data, seed), simulate.simulate_scene(seed, 32, 32))
            if load_parameters(scene_path(data, seed))["times"]:
                wanted.remove(split_of(seed))
        seed += 1
    return data
