# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file keeps of a splash."""

import io

import numpy as np
import pytest

from liquid_splash_addon.core.refinement import stored_splash
from liquid_splash_addon.core.refinement.settings import (
    DropletSettings,
    SheetSettings,
    WaveSettings,
)
from liquid_splash_addon.core.refinement.stack import Refiner
from liquid_splash_addon.core.refinement.stored_splash import Flowed, StoredSplash
from tests.core.refinement.shapes import sheet
from tests.core.sketching import fan

STEPS = (DropletSettings(amount=0.01), WaveSettings(frequency=4.0))


@pytest.fixture(scope="module")
def fields():
    """Return a splash as it is stored."""
    return sheet().fields().round_off()


def same(one, other):
    """Whether two records of arrays are equal in every bit."""
    names = one.__dataclass_fields__
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return all(np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b for a, b in pairs)


def test_fields_and_strokes_come_back(fields):
    again = StoredSplash.from_bytes(StoredSplash(fields, fan()).to_bytes())
    assert same(again.fields, fields) and again.applied is None
    assert len(again.strokes) == len(fan())
    assert all(same(one, other) for one, other in zip(again.strokes, fan(), strict=True))


def test_a_splash_without_strokes_comes_back(fields):
    assert StoredSplash.from_bytes(StoredSplash(fields).to_bytes()).strokes == ()


def test_containers_from_before_versions_are_read(fields):
    """They held the arrays of the fields alone."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **fields.to_arrays())
    again = StoredSplash.from_bytes(buffer.getvalue())
    assert same(again.fields, fields) and not again.strokes and again.seed == 0


def test_the_seed_that_details_follow_comes_back(fields):
    assert StoredSplash.from_bytes(StoredSplash(fields, fan(), seed=7).to_bytes()).seed == 7
    with np.load(io.BytesIO(StoredSplash(fields, fan(), seed=7).to_bytes())) as stored:
        before = {name: stored[name] for name in stored.files if name != "seed"}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **before)
    assert StoredSplash.from_bytes(buffer.getvalue()).seed == 0, "files from before it was kept"


def test_applied_refinements_come_back_and_change_nothing(fields):
    """Applied, stored and read, a list gives what it gave, to the last bit."""
    refiner = Refiner(fields)
    before = refiner.refine(STEPS)
    stored = StoredSplash(fields, fan(), refiner.applied(STEPS))
    again = StoredSplash.from_bytes(stored.to_bytes())
    assert again.applied.waves == STEPS[1:]
    after = Refiner(again.fields, applied=again.applied).refine(())
    assert len(before.cloud.radii) > 0
    assert np.array_equal(after.cloud.positions, before.cloud.positions)
    for name in ("vertices", "faces", "velocities"):
        assert np.array_equal(getattr(after.mesh, name), getattr(before.mesh, name))


def test_applied_sheets_come_back(fields):
    steps = (SheetSettings(film=2.0), WaveSettings())
    stored = StoredSplash(fields, fan(), Refiner(fields).applied(steps))
    again = StoredSplash.from_bytes(stored.to_bytes())
    assert again.applied.sheets == steps[0] and again.applied.waves == steps[1:]
    before = Refiner(fields).refine(steps)
    after = Refiner(again.fields, applied=again.applied).refine(())
    assert np.array_equal(after.mesh.vertices, before.mesh.vertices)


def test_what_is_applied_comes_before_what_is_added_later(fields):
    first, second = DropletSettings(amount=0.01), DropletSettings(amount=0.01, seed=5)
    applied = Refiner(fields).applied((first,))
    both = Refiner(fields, applied=applied).refine((second,))
    kept = len(applied.cloud.radii)
    assert 0 < kept < len(both.cloud.radii)
    assert np.array_equal(both.cloud.positions[:kept], applied.cloud.positions)


@pytest.mark.parametrize("cut", [0, 1, 1000, -1], ids=["nothing", "a byte", "a part", "the end"])
def test_damaged_containers_are_refused(fields, cut):
    with pytest.raises(ValueError, match="generate the splash again"):
        StoredSplash.from_bytes(StoredSplash(fields, fan()).to_bytes()[:cut])


def test_a_splash_that_was_flown_on_comes_back(fields):
    """Refinements start from it, waves that were applied before are kept."""
    refiner = Refiner(fields)
    later = Flowed(refiner.liquid(STEPS[:1]).liquid, 12.5)
    stored = StoredSplash(fields, fan(), refiner.applied(STEPS), later)
    again = StoredSplash.from_bytes(stored.to_bytes())
    assert again.flowed.milliseconds == 12.5
    assert again.applied.waves == STEPS[1:]
    one, other = (
        Refiner(fields, applied=from_.applied, flowed=from_.flowed).refine(())
        for from_ in (stored, again)
    )
    bare = Refiner(fields).refine(())
    assert one.mesh.vertices.shape != bare.mesh.vertices.shape
    for name in ("vertices", "faces", "velocities"):
        assert np.array_equal(getattr(one.mesh, name), getattr(other.mesh, name))


def test_only_what_was_flown_on_or_has_sheets_needs_a_later_add_on(fields):
    later = Flowed(Refiner(fields).base.liquid, 1.0)
    sheets = Refiner(fields).applied([SheetSettings()])
    for flowed, applied, version in ((None, None, 1), (later, None, 2), (later, sheets, 3)):
        data = StoredSplash(fields, applied=applied, flowed=flowed).to_bytes()
        with np.load(io.BytesIO(data)) as arrays:
            assert int(arrays["version"]) == version


def test_containers_of_later_versions_say_so(fields, monkeypatch):
    monkeypatch.setattr(stored_splash, "VERSION", 99)
    data = StoredSplash(fields, applied=Refiner(fields).applied([SheetSettings()])).to_bytes()
    monkeypatch.undo()
    with pytest.raises(ValueError, match="later version"):
        StoredSplash.from_bytes(data)
