# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings as they are: damaged, huge, with times that stand still, fall, or cannot be."""

import io
import json
import struct
import zipfile

import numpy as np
import pytest

from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.stroke_files import limits
from liquid_splash_addon.core.stroke_files.limits import StrokeFileError
from liquid_splash_addon.core.stroke_files.reading import KINDS, read_bytes
from liquid_splash_addon.core.stroke_files.recording import checked, size_warnings
from tests.core.stroke_files.making import apa, arches, sketch_bytes, tilt


def line(times, length=0.5):
    """Return a straight stroke with these times."""
    points = np.zeros((len(times), 3))
    points[:, 0] = np.linspace(0, length, len(times))
    return Drawing(points, np.asarray(times, dtype=float))


def check(*drawings, by_hand=True):
    return checked(drawings, [], by_hand)


def test_equal_times_are_no_times():
    found = check(line(np.full(20, 7.0)), line(np.arange(20) / 20))
    assert found.drawings[0].times is None and found.drawings[1].is_timed
    assert found.warnings == ["1 of 2 strokes have no recorded time that can be used: their speed "
                              "is the setting Stroke Speed"]  # fmt: skip


def test_times_that_fall_go_on_at_the_usual_step_and_are_counted():
    found = check(line([10.0, 10.1, 10.2, 3.0, 3.1, 3.2, 12.0]))
    np.testing.assert_allclose(found.drawings[0].times[:6], np.arange(6) / 10)
    assert "Times fall 1 times, in 1 strokes" in found.warnings[0]


def test_points_that_share_a_time_are_counted():
    found = check(line([0, 0.1, 0.1, 0.1, 0.2]))
    assert "2 points have the time of the point before" in found.warnings[0]


def test_times_too_fast_for_a_hand_are_not_passed_on():
    found = check(line([0, 0.01], 1.0), line([0, 0.01], 1.0), line([0, 1.0], 1.0))
    assert all(d.times is None for d in found.drawings) and found.median_speed > 90
    assert "which no hand is: they are not used" in found.warnings[0]
    found = check(line([0, 0.01], 1.0), line([0, 1.0], 1.0), line([0, 1.0], 1.0))
    assert [d.times is None for d in found.drawings] == [True, False, False]
    assert "1 of 3 strokes faster than 4 m/s" in found.warnings[0]


def test_tables_keep_their_times_but_unlikely_units_are_said():
    found = check(line([0, 0.01], 1.0), by_hand=False)
    assert found.drawings[0].is_timed and "check the units" in found.warnings[0]
    found = check(line([0, 5000.0], 1.0), by_hand=False)
    assert "0.2 mm/s in the median: check the units" in found.warnings[0]


def test_points_that_are_no_numbers_or_beyond_all_rooms_are_left_out():
    drawing = line(np.arange(6) / 10)
    drawing.points[1, 2] = np.nan
    drawing.points[2, 0] = 1e30
    drawing.times[3] = np.inf
    found = check(drawing, Drawing(np.ones((4, 3))), Drawing(np.zeros((0, 3))))
    assert len(found.drawings) == 1 and len(found.drawings[0].points) == 3
    assert found.warnings == [
        "3 points have a value that is not a number, or lie over 1,000 km away: left out",
        "2 of 3 strokes have no length: left out",
    ]


def test_pressures_and_speeds_are_brought_into_their_ranges():
    drawing = Drawing(np.eye(3), None, np.array([-1, 0.5, 9]), np.array([-2, 0, 1.0]))
    (kept,) = check(drawing).drawings
    assert kept.pressures.tolist() == [0, 0.5, 1] and kept.speeds.tolist() == [2, 0, 1]


@pytest.mark.parametrize("kind", (".apa", ".tilt"))
def test_what_comes_before_a_damaged_place_is_kept(kind):
    if kind == ".apa":
        data = apa(arches())[:-100]
    else:
        data = tilt(sketch_bytes([10 * arch for arch in arches()], 1.0)[:-100])
    found = read_bytes(data, KINDS[kind])
    assert len(found.drawings) == 3
    assert "3 of 4 strokes were read" in found.warnings[0]


@pytest.mark.parametrize("count", (2**31 - 1, 2**32 - 1, 2**20))
def test_a_count_beyond_the_bytes_costs_nothing(count):
    whole = apa([[(0, 0, 0), (1, 0, 0)]])
    with pytest.raises(StrokeFileError, match="at most"):
        read_bytes(whole.replace(struct.pack("<I", 1), struct.pack("<I", count), 1), KINDS[".apa"])
    at = whole.index(struct.pack("<I", 2))
    with pytest.raises(StrokeFileError, match="not written to its end"):
        read_bytes(whole[:at] + struct.pack("<I", count) + whole[at + 4 :], KINDS[".apa"])


def test_a_zip_bomb_is_refused(monkeypatch):
    monkeypatch.setattr("liquid_splash_addon.core.stroke_files.tilt.SKETCH_BYTES", 2**20)
    bomb = tilt(bytes(2**24))
    assert len(bomb) < 2**16
    with pytest.raises(StrokeFileError, match="unpacks to more than"):
        read_bytes(bomb, KINDS[".tilt"])


def test_a_zip_of_thousands_of_files_is_refused():
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as bundle:
        for n in range(2000):
            bundle.writestr(str(n), b"")
    with pytest.raises(StrokeFileError, match="lists more than"):
        read_bytes(b"tilT" + bytes(12) + packed.getvalue(), KINDS[".tilt"])


@pytest.mark.parametrize("text", ("{},", "[],", '{"":1},', "0.1,", '"\U0001f30a",'))
def test_json_that_would_fill_the_memory_is_refused_before_it_is_parsed(monkeypatch, text):
    monkeypatch.setattr("liquid_splash_addon.core.stroke_files.json_file.MEMORY", 2**20)
    data = b'{"strokes":[' + text.encode() * 60_000 + b"0]}"
    with pytest.raises(StrokeFileError, match="would take more than"):
        read_bytes(data, KINDS[".json"])


@pytest.mark.parametrize("text", ("[" * 200_000, '{"a":' * 100_000, "1" * 9000, '"\ud83d"'))
def test_json_nested_without_end_and_numbers_without_end_are_refused(text):
    with pytest.raises(StrokeFileError):
        read_bytes(text.encode("utf-8", "surrogatepass"), KINDS[".json"])


def test_a_stroke_that_is_no_table_does_not_stand_in_the_way():
    good = [[0, 0, 0, 0], [1, 0, 0, 1]]
    odd = [[[0, 0]], [[0, 0, 0], [1]], "stroke", [["a", "b", "c"]], [[10**400, 0, 0]], [{}], None]
    found = read_bytes(json.dumps({"strokes": [*odd, good]}).encode(), KINDS[".json"])
    assert len(found.drawings) == 1
    assert "7 of 8 strokes are no tables of numbers: left out" in found.warnings[0]


def test_lines_that_are_no_points_are_counted():
    text = "x,y,z,t\n0,0,0,0\n# a remark\nnan,0,0,0\n1,1\n1,0,0,1\n"
    found = read_bytes(text.encode(), KINDS[".csv"])
    assert len(found.drawings[0].points) == 2
    assert found.warnings[0] == "2 lines are no points: left out"


@pytest.mark.parametrize("kind", (".json", ".csv"))
def test_more_than_the_limits_is_refused(monkeypatch, kind):
    monkeypatch.setattr(limits, "MOST_POINTS", 50)
    data = KINDS[kind].write([line(np.arange(40)), line(np.arange(40))])
    with pytest.raises(StrokeFileError, match="at most 50 are read"):
        read_bytes(data, KINDS[kind])


def test_thousands_of_strokes_are_read():
    rng = np.random.default_rng(3)
    strokes = [np.cumsum(0.01 * rng.normal(size=(20, 3)), axis=0) for _ in range(5000)]
    found = read_bytes(apa(strokes), KINDS[".apa"])
    assert len(found.drawings) == 5000 and found.points == 100_000


@pytest.mark.parametrize(("length", "word"), ((0.01, "larger"), (14.0, "smaller")))
def test_another_size_than_the_splash_is_said(length, word):
    found = check(line(np.arange(20.0), length))
    (said,) = size_warnings(found, 0.33)
    assert word in said and f"{length:g} m across" in said
    assert size_warnings(found, length) == [] == size_warnings(found, 0.0)
