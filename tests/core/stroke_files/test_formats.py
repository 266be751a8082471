# SPDX-License-Identifier: GPL-3.0-or-later
"""What is in a file is what is read: axes, units, times, pressures; in every format."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.stroke_files.limits import StrokeFileError
from liquid_splash_addon.core.stroke_files.reading import (
    StrokeFileWarning,
    read_recording,
    read_strokes,
    write_strokes,
)
from tests.core.stroke_files.making import apa, sketch_bytes, tilt, tracking


def stored(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_a_painter_is_read_z_up_in_metres_and_seconds(tmp_path):
    path = stored(tmp_path, "drawn.apa", apa([[(1, 2, 3), (1.01, 2, 3)]]))
    (drawing,) = read_strokes(path)
    np.testing.assert_allclose(drawing.points, [[1, -3, 2], [1.01, -3, 2]], atol=1e-6)
    assert drawing.times.tolist() == [0, 0.011] and drawing.pressures.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("extension", (b"", b"newer than this reader"))
def test_tilt_brush_is_read_and_its_zoom_makes_strokes_faster(tmp_path, extension):
    data = tilt(sketch_bytes([[(1, 2, 3), (1.4, 2, 3)]], 2.0, extension=extension))
    (drawing,) = read_strokes(stored(tmp_path, "drawn.tilt", data))
    np.testing.assert_allclose(drawing.points, [[0.1, 0.3, 0.2], [0.14, 0.3, 0.2]], atol=1e-6)
    np.testing.assert_allclose(drawing.times, [0, 0.0225])
    assert drawing.pressures.tolist() == [0.5, 0.5]


def test_a_zoom_that_is_not_stored_or_no_number_is_said(tmp_path):
    strokes = [[(0, 0, 0), (0.1, 0, 0)]]
    found = read_recording(stored(tmp_path, "drawn.tilt", tilt(sketch_bytes(strokes))))
    assert any("at which zoom" in line for line in found.warnings)
    found = read_recording(stored(tmp_path, "odd.tilt", tilt(sketch_bytes(strokes, -1.0))))
    assert any("zoom that is no positive" in line for line in found.warnings)
    assert found.drawings[0].times.tolist() == [0, 0.045]


@pytest.mark.parametrize("names", (("triggerdown", "triggerup"), ("buttondown", "buttonup")))
def test_the_trigger_cuts_tracked_motion_into_strokes(tmp_path, names):
    found = read_recording(stored(tmp_path, "motion.json", json.dumps(tracking(names))))
    first, second = found.drawings
    assert found.warnings == [] and found.median_speed == pytest.approx(1.0)
    np.testing.assert_allclose(first.points[[0, -1]], [[0.1, 2, 1], [0.3, 2, 1]])
    np.testing.assert_allclose(second.points[[0, -1]], [[0.6, 2, 1], [0.8, 2, 1]])
    np.testing.assert_allclose(first.times[[0, -1]], [0, 0.2], atol=1e-9)


def test_motion_without_a_trigger_is_one_stroke_with_a_warning(tmp_path):
    motion = tracking()
    motion["right"]["events"] = []
    found = read_recording(stored(tmp_path, "motion.json", json.dumps(motion)))
    assert len(found.drawings) == 1 and "no trigger" in found.warnings[0]


def test_a_trigger_that_is_never_released_draws_to_the_end(tmp_path):
    motion = tracking()
    motion["right"]["events"] = motion["right"]["events"][:3]
    found = read_recording(stored(tmp_path, "motion.json", json.dumps(motion)))
    assert found.drawings[1].points[-1, 0] == pytest.approx(0.99)


@pytest.mark.parametrize("kind", ("json", "csv"))
def test_what_is_written_is_read_back_to_the_last_bit(tmp_path, kind):
    rng = np.random.default_rng(0)
    full = Drawing(rng.normal(size=(9, 3)), np.arange(9.0), rng.random(9), rng.random(9))
    bare = Drawing(rng.normal(size=(3, 3)))
    path = tmp_path / f"strokes.{kind}"
    write_strokes(path, [full, bare])
    with pytest.warns(StrokeFileWarning, match=r"1 of 2 strokes have no recorded time"):
        one, other = read_strokes(path)
    for name in ("points", "times", "pressures", "speeds"):
        np.testing.assert_array_equal(getattr(one, name), getattr(full, name))
    np.testing.assert_array_equal(other.points, bare.points)
    assert other.times is None and other.pressures is None and other.speeds is None


CSV = {
    "named": "x,y,z,t\n1,2,3,0\n1.1,2,3,0.5\n",
    "in another order": "t;Z;Y;X\n0;3;2;1\n0,5;3;2;1,1\n",
    "not named": "1 2 3 0\n1.1 2 3 0.5\n",
    "in other units": "# length: cm\n# time: ms\n# axes: y-up\nx\ty\tz\ttime\n"
    "100\t300\t-200\t7000\n110\t300\t-200\t7500\n",
    "with a mark and spaces": "\ufeffx, y, z, t, colour\n1, 2, 3, 0, red\n1.1, 2, 3, 0.5, red\n",
}


@pytest.mark.parametrize("text", CSV.values(), ids=CSV)
def test_csv_is_read_however_it_is_written(tmp_path, text):
    (drawing,) = read_strokes(stored(tmp_path, "strokes.csv", text))
    np.testing.assert_allclose(drawing.points, [[1, 2, 3], [1.1, 2, 3]])
    np.testing.assert_allclose(drawing.times, [0, 0.5])


def test_csv_of_a_spreadsheet_in_utf16_is_read(tmp_path):
    data = CSV["named"].replace(",", "\t").encode("utf-16")
    (drawing,) = read_strokes(stored(tmp_path, "strokes.csv", data))
    assert drawing.points.shape == (2, 3)


def test_a_column_or_an_empty_line_ends_strokes(tmp_path):
    rows = "x,y,z,t,stroke\n0,0,0,0,a\n5,0,0,0,b\n1,0,0,1,a\n6,0,0,1,b\n\n7,0,0,0,a\n8,0,0,1,a\n"
    drawings = read_strokes(stored(tmp_path, "strokes.csv", rows))
    assert [d.points[:, 0].tolist() for d in drawings] == [[0, 1], [5, 6], [7, 8]]


def test_json_units_and_fields(tmp_path):
    content = {
        "units": {"length": 0.5, "time": "ms", "axes": "y-up-left-handed"},
        "fields": ["t", "x", "y", "z", "speed"],
        "strokes": [[[0, 2, 4, 6, 1], [500, 2.2, 4, 6, 2]]],
    }
    (drawing,) = read_strokes(stored(tmp_path, "strokes.json", json.dumps(content)))
    np.testing.assert_allclose(drawing.points, [[1, 3, 2], [1.1, 3, 2]])
    np.testing.assert_allclose(drawing.times, [0, 0.5])
    np.testing.assert_allclose(drawing.speeds, [500, 1000])


UNREADABLE = {
    "other.obj": (b"v 0 0 0", "only .tilt, .apa, .json, .csv"),
    "text.apa": (b"no painting", "no painting"),
    "nothing.apa": (b"", "no painting"),
    "cut.apa": (apa([[(0, 0, 0), (1, 0, 0)]])[:50], "not written to its end"),
    "text.tilt": (b"no sketch at all", "no sketch"),
    "cut.tilt": (tilt(sketch_bytes([[(0, 0, 0), (1, 0, 0)]]))[:200], "damaged"),
    "empty.tilt": (tilt(b""), "not written to its end"),
    "other.tilt": (tilt(b"", "data.txt"), "no data.sketch"),
    "odd.tilt": (tilt(b"", compression=zipfile.ZIP_LZMA), "no sketch is"),
    "text.json": (b"{", "no JSON"),
    "list.json": (b"[1, 2]", '"strokes"'),
    "numbers.json": (b'{"strokes": [1, [2], "x"]}', "no tables of numbers"),
    "axes.json": (b'{"strokes": [], "units": {"axes": "up"}}', "axes must be one of"),
    "unit.json": (b'{"strokes": [], "units": {"length": "league"}}', "unit of length"),
    "head.json": (b'{"camera": {"poses": []}}', "No controller"),
    "none.json": (b'{"strokes": []}', "nothing was drawn"),
    "words.csv": (b"name,value\nred,1\n", "no column 'x'"),
    "nothing.csv": (b"", "no lines"),
    "head.csv": (b"x,y,z\n", "No line of the file is a point"),
    "dot.csv": (b"1,1,1\n1,1,1\n", "nothing was drawn"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNREADABLE)
def test_what_cannot_be_read_is_refused_by_name_and_reason(tmp_path, name):
    data, reason = UNREADABLE[name]
    with pytest.raises(StrokeFileError, match=reason) as found:
        read_strokes(stored(tmp_path, name, data))
    assert str(found.value).startswith(f"{name}: ")


def test_a_kind_that_is_only_read_is_not_written(tmp_path):
    with pytest.raises(StrokeFileError, match="only"):
        write_strokes(tmp_path / "strokes.tilt", [Drawing(np.eye(3))])
    with pytest.raises(StrokeFileError, match="no strokes to write"):
        write_strokes(tmp_path / "strokes.csv", [])
