# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's claims on the bundled weights, and whether they are measured well."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.spatial.transform import Rotation

pytest.importorskip("torch")

from liquid_splash_addon.core.condition.patches.sampling import PatchSamples
from liquid_splash_addon.core.condition.voxelize import voxelize
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import Fields
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.sketch.local_frame import Frame, fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke
from tests.core.stroke_files.making import apa, arches
from training.evaluation import claims
from training.evaluation.letters import (
    LETTERS,
    PAGE_FRAME,
    letter_drawings,
    letter_page,
    read_letter,
    template,
)
from training.evaluation.sketch_bench import BENCH_SIZE, SketchBench
from training.measures import shapes

GRIDS = {"speed": 128, "letters": 128, "variation": 128}
"""Grids of the claims that drafts are too coarse for; the others are tried on drafts."""


@cache
def measured(claim: str) -> dict[str, object]:
    """Return the figures of one claim, measured once a session."""
    bench = SketchBench(load_generator(device="CPU"), GRIDS.get(claim, 64))
    return claims.CLAIMS[claim](bench)


def box(shape, low, high):
    """Return a box of liquid in cells."""
    occupied = np.zeros(shape, dtype=bool)
    occupied[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    return occupied


def fields_of(distance, grid) -> Fields:
    """Return fields that hold the liquid of a signed distance in cells."""
    still = np.zeros((3, *grid.shape), dtype=np.float32)
    occupancy = 1 / (1 + np.exp(np.clip(2 * distance, -20, 20)))
    return Fields(occupancy, np.clip(distance, -3, 3), still, grid)


def ball(cells=64, centre=(0.03, 0.0, -0.05), radius=0.06) -> Fields:
    """Return a ball of liquid in the local box, metres."""
    grid = Grid.local(cells)
    away = np.linalg.norm(grid.centres() - np.array(centre), axis=-1)
    return fields_of((away - radius) / grid.spacing, grid)


LONG = ("letters.read",)
"""Claims that take minutes."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in claims.BOUNDS],
)
def test_the_bundled_weights_keep_to_the_bounds(name):
    claim, figure = name.split(".")
    value = measured(claim)[figure]
    assert claims.holds(name, value), f"{name} = {value}, must be {claims.BOUNDS[name]}"


def test_published_figures_are_those_of_the_bundled_weights():
    root = Path(__file__).resolve().parents[2]
    published = json.loads((root / "docs" / "results" / "claims.json").read_text())
    assert published["about"]["weights_hash"] == load_generator(device="CPU").weights_hash
    assert set(published) == {"about", *claims.CLAIMS}


def test_pieces_of_known_boxes():
    two = box((20, 20, 20), (2, 2, 2), (6, 6, 6)) | box((20, 20, 20), (10, 10, 10), (12, 12, 12))
    assert shapes.pieces(two) == [64, 8]
    assert shapes.pieces(two, least=9) == [64]
    corner = two | box((20, 20, 20), (6, 6, 6), (10, 10, 10))
    assert shapes.pieces(corner) == [136]
    assert shapes.pieces(np.zeros((4, 4, 4), dtype=bool)) == []


def test_tunnels_are_holes_through_and_not_bubbles():
    sheet = box((16, 16, 8), (1, 1, 3), (15, 15, 5))
    assert shapes.tunnels(sheet) == 0
    sheet[3:6, 3:6] = sheet[9:12, 9:12] = False
    assert shapes.tunnels(sheet) == 2
    hollow = box((12, 12, 12), (1, 1, 1), (11, 11, 11))
    hollow[5:7, 5:7, 5:7] = False
    assert shapes.tunnels(hollow) == 0
    assert shapes.tunnels(np.ones((5, 5, 5), dtype=bool)) == 0


def test_surface_to_volume_of_an_octahedron():
    vertices = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    upper = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]]
    faces = np.array(upper + [[b, a, 5] for a, b, _ in upper], dtype=np.int32)
    octahedron = Mesh(vertices, faces, np.zeros_like(vertices))
    assert shapes.surface_to_volume(octahedron) == pytest.approx(3 * np.sqrt(3))


def test_liquid_away_from_its_strokes_is_noticed():
    drawn = box((40, 12, 12), (2, 5, 5), (22, 6, 6))
    half = box((40, 12, 12), (2, 4, 4), (12, 7, 7))
    assert shapes.coverage(half, drawn) == pytest.approx(0.5)
    assert shapes.coverage(half, drawn, within=2) == pytest.approx(0.6)
    assert shapes.attached_share(half, drawn) == 1 and shapes.far_share(half, drawn, 2) == 0
    lost = box((40, 12, 12), (36, 4, 4), (39, 7, 7))
    assert shapes.attached_share(half | lost, drawn) == pytest.approx(90 / 117)
    assert shapes.far_share(half | lost, drawn, 5) == pytest.approx(27 / 117)
    nothing = np.zeros_like(drawn)
    assert shapes.attached_share(nothing, drawn) == shapes.far_share(nothing, drawn, 5) == 0


def test_a_moved_cube_shares_what_geometry_says():
    assert shapes.shifted_iou(box((9, 9, 9), (0, 0, 0), (5, 5, 5))) == pytest.approx(4 / 6)
    assert shapes.mean_pair_iou([box((4, 4, 4), (0, 0, 0), (2, 2, 2))] * 3) == 1


def test_a_full_ball_halved_is_the_draft_ball():
    assert shapes.iou(shapes.halved(shapes.level_of(ball(128))), ball(64).occupancy > 0.5) > 0.97


def test_a_ball_seen_from_a_turned_frame_is_the_turned_ball():
    frame = Frame(np.eye(3), np.array([1.0, 2.0, 3.0]), Scale(0.1))
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    grid = Grid.local(64)
    seen = shapes.seen_liquid(ball(), frame, frame.turned(turn), grid)
    expected = ball(centre=turn @ [0.03, 0.0, -0.05]).occupancy > 0.5
    assert shapes.iou(seen, expected) > 0.99
    moved = Frame(frame.axes, frame.centre + [100.0, 0, 0], frame.scale)
    assert not shapes.seen_liquid(ball(), frame, moved, grid).any()


@pytest.mark.parametrize("area", (150, 400, 800))
def test_every_template_is_nearest_to_itself(area):
    assert all(read_letter(template(letter, 64, area)) == letter for letter in LETTERS)


@pytest.mark.parametrize("letter", LETTERS)
def test_a_letter_of_liquid_is_read_as_itself(letter):
    strokes = [Stroke(d.points, np.ones_like(d.points)) for d in letter_drawings(letter)]
    frame, grid = fit_frame(strokes, BENCH_SIZE), Grid.local(64)
    drawn = voxelize(frame.strokes_to_local(strokes), grid, PatchSamples.none()).drawn
    liquid = fields_of(distance_transform_edt(~drawn) - 1.8, grid)
    seen = shapes.seen_liquid(liquid, frame, PAGE_FRAME, letter_page(64)).any(axis=2)
    assert read_letter(seen) == letter


def test_bounds_are_read_the_right_way_round():
    assert claims.holds("letters.read", 23) and not claims.holds("letters.read", 22)
    assert claims.holds("disorder.far", 0.04) and not claims.holds("disorder.far", 0.05)
    assert not claims.holds("speed.pieces_ratio", 1.0)


def test_recordings_are_measured_and_drawn(tmp_path: Path, run_command, capsys):
    (tmp_path / "arches.apa").write_bytes(apa(arches()))
    sheet, out = tmp_path / "sheet.png", tmp_path / "out.json"
    arguments = ("--strokes", tmp_path, "--cells", 64, "--pixels", 40, "--sheet", sheet)
    assert run_command(claims.main, *arguments, "--out", out) == 0
    assert sheet.stat().st_size > 500
    assert "recorded.coverage" in capsys.readouterr().out
    assert json.loads(out.read_text())["recorded"]["sketches"]["arches"]["coverage"] > 0.9


def test_a_directory_without_recordings_is_refused(tmp_path: Path, run_command, capsys):
    assert run_command(claims.main, "--strokes", tmp_path) == 1
    assert "no recording" in capsys.readouterr().err
