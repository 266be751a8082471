# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of strokes in Blender: imported with their times, made a splash, written and read back."""

import json
import warnings
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.jobs import stroke_files
from liquid_splash_addon.blender.scene.grease_pencil import read_drawings
from liquid_splash_addon.blender.scene.stroke_objects import read_sketch
from liquid_splash_addon.core.progress import silent
from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.stroke_files.reading import read_strokes, write_strokes
from tests.blender.sketching import add_sketch, bend, fan, generate, line, splashes
from tests.blender.test_curves import new_curves
from tests.core.stroke_files.making import SHARED, apa, arches, sketch_bytes, tilt, tracking


def csv_text() -> bytes:
    rows = [f"{n},{x},{y},{z}" for n, arch in enumerate(arches()) for x, y, z in arch]
    return ("# axes: y-up\nstroke,x,y,z\n" + "\n".join(rows)).encode()


FILES = {
    "painting.apa": lambda: apa(arches()),
    "sketch.tilt": lambda: tilt(sketch_bytes([10 * arch for arch in arches()], 1.0)),
    "motion.json": lambda: json.dumps(tracking()).encode(),
    "table.csv": csv_text,
}
"""A file of every kind: arches of 0.6 m, or two straight strokes."""


def stored(folder: Path, name: str) -> Path:
    path = folder / name
    path.write_bytes(FILES[name]())
    return path


def in_world(item: bpy.types.Object) -> list[Drawing]:
    """Return an object's strokes in the world."""
    bpy.context.view_layer.update()
    return read_sketch([item], to_space=np.eye(4))[0]


@pytest.mark.usefixtures("tubes")
@pytest.mark.parametrize("name", FILES)
def test_a_file_becomes_a_sketch_where_it_was_drawn_and_then_a_splash(tmp_path, name):
    path = stored(tmp_path, name)
    assert bpy.ops.splash.import_strokes(filepath=str(path), at_cursor=False) == {"FINISHED"}
    sketch = bpy.context.active_object
    assert sketch.type == "GREASEPENCIL" and sketch.name == path.stem and sketch.select_get()
    for found, expected in zip(in_world(sketch), stroke_files.read_recording(path).drawings,
                               strict=True):  # fmt: skip
        np.testing.assert_allclose(found.points, expected.points, atol=1e-5)
        if expected.times is not None:
            np.testing.assert_allclose(found.times, expected.times, atol=1e-5)
    splash = generate()
    assert splash.splash.sketch == sketch and len(splash.data.polygons) > 200
    assert ("no recorded time" in splash.splash.warnings) == (name == "table.csv")


@pytest.mark.usefixtures("tubes")
@pytest.mark.parametrize("kind", ("grease pencil", "curves"))
def test_an_svg_file_becomes_a_splash_by_way_of_blender_s_import(tmp_path, kind):
    path = tmp_path / "drawing.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100" viewBox="0 0 200 100">'
        '<path d="M10 10 C60 90 120 -20 190 60" stroke="black" fill="none"/>'
        '<path d="M10 40 L 180 90" stroke="black" fill="none"/></svg>'
    )
    before = set(bpy.data.objects)
    if kind == "curves":
        bpy.ops.import_curve.svg(filepath=str(path))
    else:
        bpy.ops.wm.grease_pencil_import_svg(filepath=str(path), directory=str(tmp_path),
                                            files=[{"name": path.name}])  # fmt: skip
    made = [item for item in bpy.data.objects if item not in before]
    for item in made:
        item.select_set(True)
    bpy.context.view_layer.objects.active = made[0]
    splash = generate(speed_source="CONSTANT")
    assert len(splash.data.polygons) > 500
    assert "no recorded time" not in splash.splash.warnings


def test_the_middle_comes_to_the_cursor_and_metres_to_units(tmp_path):
    path = stored(tmp_path, "painting.apa")
    bpy.context.scene.cursor.location = (5, 6, 7)
    bpy.ops.splash.import_strokes(filepath=str(path), scale=10.0)
    points = np.concatenate([d.points for d in in_world(bpy.context.active_object)])
    np.testing.assert_allclose((points.min(axis=0) + points.max(axis=0)) / 2, (5, 6, 7), atol=1e-4)
    np.testing.assert_allclose(np.ptp(points, axis=0)[0], 6.0, rtol=1e-4)


def test_a_file_that_cannot_be_read_does_not_stand_in_the_way_of_others(tmp_path):
    stored(tmp_path, "painting.apa")
    (tmp_path / "broken.tilt").write_bytes(b"tilT")
    names = ("broken.tilt", "painting.apa", "absent.csv")
    bpy.ops.splash.import_strokes(directory=str(tmp_path), files=[{"name": n} for n in names])
    assert bpy.context.active_object.name == "painting"
    paths = [tmp_path / name for name in names]
    (found,), errors = stroke_files.read_files(paths, 1.0, silent)
    assert found.name == "painting" and len(errors) == 2
    assert errors[0].startswith("broken.tilt: ") and "could not be read" in errors[1]
    objects = len(bpy.data.objects)
    with pytest.raises(RuntimeError, match=r"broken\.tilt: The \.tilt file is damaged"):
        bpy.ops.splash.import_strokes(filepath=str(tmp_path / "broken.tilt"))
    with pytest.raises(RuntimeError, match="No file was chosen"):
        bpy.ops.splash.import_strokes()
    assert len(bpy.data.objects) == objects


def test_what_was_wrong_with_a_file_is_said_when_it_is_imported(tmp_path):
    path = tmp_path / "slow.csv"
    path.write_bytes(b"x,y,z,t,speed\n0,0,0,0,1\n0,0,14,1,2\n0,0,28,1,3\n")
    imports, _ = stroke_files.read_files([path], 1.0, silent)
    said = "\n".join(stroke_files.add_sketches(bpy.context, imports, True))
    assert "check the units" in said and "1 points have the time" in said
    assert "28 m across" in said and "set Speed to Attribute" in said


@pytest.mark.parametrize("kind", ("json", "csv"))
def test_what_is_exported_is_read_back_where_it_was(tmp_path, kind):
    matrix = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.7, 4, "Y") @ Matrix.Scale(2, 4)
    sketch = add_sketch([bend(), line((0, 0, 0), (1, 1, 1), 0.5, pressure=0.25)], matrix)
    curves = new_curves(speed=np.linspace(1, 2, 6))
    sketch.select_set(True)
    curves.select_set(True)
    bpy.context.view_layer.objects.active = sketch
    path = tmp_path / f"strokes.{kind}"
    assert bpy.ops.splash.export_strokes(filepath=str(path), scale=10.0) == {"FINISHED"}
    expected, _ = read_sketch([sketch, curves], to_space=np.eye(4))
    found = stroke_files.read_recording(path).drawings
    assert [d.is_timed for d in found] == [True, True, False]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(10 * one.points, other.points, atol=1e-9)
        if one.times is not None:
            np.testing.assert_allclose(one.times, other.times, atol=1e-9)
    np.testing.assert_allclose(found[1].pressures, 0.25, rtol=1e-5)
    np.testing.assert_allclose(10 * found[2].speeds, expected[2].speeds, rtol=1e-9)
    bpy.ops.splash.import_strokes(filepath=str(path), scale=10.0, at_cursor=False)
    for one, other in zip(in_world(bpy.context.active_object), expected, strict=True):
        np.testing.assert_allclose(one.points, other.points, atol=1e-5)
    assert [d.speeds is None for d in read_drawings(bpy.context.active_object)[0]] == [
        True, True, False,
    ]  # fmt: skip


def test_export_says_what_it_needs(tmp_path):
    with pytest.raises(RuntimeError, match="Select a Grease Pencil sketch"):
        bpy.ops.splash.export_strokes(filepath=str(tmp_path / "none.json"))
    add_sketch([])
    with pytest.raises(RuntimeError, match="no strokes to write"):
        bpy.ops.splash.export_strokes(filepath=str(tmp_path / "none.json"))
    add_sketch(fan())
    with pytest.raises(RuntimeError, match=r"written as .json or .csv only"):
        bpy.ops.splash.export_strokes(filepath=str(tmp_path / "none.tilt"))
    with pytest.raises(RuntimeError, match="could not be read or written"):
        bpy.ops.splash.export_strokes(filepath=str(tmp_path / "nowhere" / "none.json"))
    bpy.ops.splash.export_strokes(filepath=str(tmp_path / "unnamed"))
    assert [path.name for path in tmp_path.iterdir()] == ["unnamed.json"]


def test_blender_knows_which_files_can_be_dropped():
    handler = bpy.types.SPLASH_FH_strokes
    assert handler.bl_file_extensions == ".tilt;.apa;.json;.csv"
    assert handler.bl_import_operator == "splash.import_strokes"
    assert not handler.poll_drop(bpy.context)


def test_speeds_of_a_file_are_the_splash_s_on_request(tmp_path):
    path = tmp_path / "speeds.csv"
    points = np.linspace((0, 0, 0), (1, 0.2, 0.1), 20)
    write_strokes(path, [Drawing(points, None, None, np.full(20, 1.5)), Drawing(points + 0.1)])
    bpy.ops.splash.import_strokes(filepath=str(path), scale=2.0)
    with_speed, without = read_drawings(bpy.context.active_object)[0]
    np.testing.assert_allclose(with_speed.speeds, 3.0, rtol=1e-6)
    assert without.speeds is None


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"no recordings in {SHARED}")
@pytest.mark.usefixtures("tubes")
@pytest.mark.parametrize(
    "name",
    ("a-painter-demo.apa", "open-brush-sketch1.tilt", "tiltbrush-one-stroke.tilt",
     "tiltbrush-hello-world.tilt", "tiltbrush-mech.tilt", "controllers-recording.json"),
)  # fmt: skip
def test_real_recordings_become_splashes(name):
    assert bpy.ops.splash.import_strokes(filepath=str(SHARED / name)) == {"FINISHED"}
    splash = generate()
    assert len(splash.data.polygons) > 500 and splashes() == [splash]


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"no recordings in {SHARED}")
def test_read_strokes_from_a_script_gives_what_is_imported():
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        drawings = read_strokes(SHARED / "tiltbrush-splatter.tilt")
    assert any("which no hand is" in str(line.message) for line in said)
    assert len(drawings) == 67 and not any(drawing.is_timed for drawing in drawings)
