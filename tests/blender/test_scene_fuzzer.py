# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of what artists do: splashes stay on their sketches, nothing is left behind."""

import pytest

from tests.blender import scene_fuzzer

pytestmark = pytest.mark.once

FEW, MANY, PART = 50, 2000, 100

KEPT: list[int] = []
"""Seeds whose sequences once found a fault."""


@pytest.mark.parametrize("seed", [*range(FEW), *KEPT])
def test_sequence(tubes, seed: int):
    assert not scene_fuzzer.run(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(FEW, FEW + MANY, PART))
def test_many_sequences(tubes, first: int):
    faults = [fault for seed in range(first, first + PART) if (fault := scene_fuzzer.run(seed))]
    assert not faults, "\n".join(faults)
