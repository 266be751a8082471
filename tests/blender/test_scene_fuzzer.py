# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of what artists do: splashes stay on their sketches, nothing is left behind."""

import bpy
import pytest

from tests.blender import scene_fuzzer

pytestmark = pytest.mark.once

FEW, MANY, PART = 50, 2000, 100

WAYS = ((4, 5), (5, 0), (5, 2))
"""Versions of Blender that share the many sequences, each a third."""

KEPT: dict[str, tuple[int, tuple[str, ...]]] = {
    "undo meshed with a threshold that waited for Regenerate": (0, ("do_settings",)),
    "undo joined a model before it was known where its splash stands": (
        441,
        ("do_origin_of_splash", "do_combine"),
    ),
}
"""Sequences that once found a fault, by that fault: seed and operations."""


def seeds() -> range:
    """Return the seeds of this Blender's share; of all, where it is none of the WAYS."""
    version = bpy.app.version[:2]
    if version not in WAYS:
        return range(FEW, FEW + MANY)
    return range(FEW + WAYS.index(version), FEW + MANY, len(WAYS))


def test_there_are_more_than_sixty_kinds_of_operations():
    names = [name for name in dir(scene_fuzzer.Fuzz) if name.startswith("do_")]
    assert len(names) >= 60


@pytest.mark.parametrize("seed", range(FEW))
def test_sequence(tubes, seed: int):
    assert not scene_fuzzer.run(seed)


@pytest.mark.parametrize("fault", KEPT)
def test_kept_sequence(tubes, fault: str):
    seed, names = KEPT[fault]
    assert not scene_fuzzer.run(seed, names)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(0, len(seeds()), PART))
def test_many_sequences(tubes, part: int):
    faults = [fault for seed in seeds()[part : part + PART] if (fault := scene_fuzzer.run(seed))]
    assert not faults, "\n".join(faults)
