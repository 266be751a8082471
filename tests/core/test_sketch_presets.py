# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches: what their controls do, and that liquid comes of every one."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial import cKDTree

from liquid_splash_addon.core.pipeline import make_splash, prepare_frame
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.local_frame import longest_side
from liquid_splash_addon.core.sketch.presets import HAND_SPEED, PRESETS, SKETCHES, example_sketch
from liquid_splash_addon.core.sketch.strokes import arc_length, check_strokes, resampled_points

DRAFT = SplashSettings(resolution="64", device="CPU")


def points_of(layers) -> np.ndarray:
    """Return all points of some layers, ``(n, 3)``."""
    return np.concatenate([d.points for drawings in layers.values() for d in drawings])


def extremes(kind):
    """Return the presets of a kind whose controls are at an end each, by what was set."""
    found = {"defaults": kind()}
    for item in fields(kind):
        limits = item.metadata
        values = [name for name, *_ in limits["items"]] if "items" in limits else ()
        for value in values or (limits["low"], limits["high"]):
            found[f"{item.name}={value}"] = kind(**{item.name: value})
    return found


@pytest.mark.parametrize("name", PRESETS)
def test_any_control_at_its_end_gives_strokes_that_the_generator_takes(name):
    for what, preset in extremes(PRESETS[name]).items():
        layers = preset.layers()
        for layer, drawings in layers.items():
            strokes, warnings = strokes_from_drawings(drawings, DRAFT)
            check_strokes(strokes)
            assert warnings == [], what
            assert 5 <= len(drawings) <= 20, (what, layer)
            prepare_frame(strokes, DRAFT, None)  # raises where it does not fit the box
        together = [d for drawings in layers.values() for d in drawings]
        prepare_frame(strokes_from_drawings(together, DRAFT)[0], DRAFT, None)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_about_two_units_wide(name):
    points = points_of(PRESETS[name]().layers())
    assert 1.6 < np.ptp(points, axis=0).max() < 2.9
    wild = points_of(PRESETS[name](asymmetry=1.0).layers())
    assert np.ptp(wild, axis=0).max() < 1.3 * np.ptp(points, axis=0).max()


def radius(points):
    """Return the largest distance from the z axis."""
    return np.hypot(points[:, 0], points[:, 1]).max()


SIDES = [
    ("CROWN", "width", lambda p: 2 * radius(p)),
    ("CROWN", "height", lambda p: p[:, 2].max()),
    ("JET", "width", lambda p: 2 * radius(p)),
    ("JET", "height", lambda p: p[:, 2].max()),
    ("STREAMLET", "length", lambda p: p[0, 0] - p[127, 0]),
    ("STREAMLET", "height", lambda p: np.ptp(p[:128, 2])),
    ("SHEET", "length", lambda p: p[:, 0].max()),
    ("SHEET", "width", lambda p: np.ptp(p[:, 1])),
    ("SHEET", "height", lambda p: p[5 * 48 - 1, 2] - p[4 * 48, 2]),
    ("WAVE", "width", lambda p: np.ptp(p[:, 1])),
    ("WAVE", "height", lambda p: p[:, 2].max()),
    ("SKIRT", "width", lambda p: 2 * radius(p)),
    ("SKIRT", "height", lambda p: -p[:, 2].min()),
    ("SKIRT", "waist", lambda p: 2 * np.hypot(*p[:, :2].T).min()),
    ("BUTTERFLY", "width", lambda p: np.ptp(p[:, 0])),
    ("BUTTERFLY", "height", lambda p: np.ptp(p[:, 2])),
    ("LETTER_S", "width", lambda p: np.ptp(p[:, 0])),
    ("LETTER_S", "height", lambda p: np.ptp(p[:, 2])),
    ("HEART", "width", lambda p: np.ptp(p[:, 0])),
    ("HEART", "height", lambda p: np.ptp(p[:, 2])),
    ("BOTTLE_POUR", "width", lambda p: 2 * radius(p)),
    ("COLLISION", "height", lambda p: 2 * np.hypot(p[:, 1], p[:, 2]).max()),
]
STRAIGHT = {"BUTTERFLY": {"lift": 0.0}, "LETTER_S": {"slant": 0.0}, "HEART": {"pour": 0.0}}


@pytest.mark.parametrize(("name", "side", "measured"), SIDES)
def test_sides_are_as_long_as_asked(name, side, measured):
    for value in (0.4, 1.2) if side == "waist" else (0.8, 1.7, 3.0):
        asked = {"asymmetry": 0.0, side: value} | STRAIGHT.get(name, {})
        points = points_of(PRESETS[name](**asked).layers())
        assert abs(measured(points)) == pytest.approx(value, rel=0.02)


def count(layers):
    """Return the number of strokes in each layer."""
    return [len(drawings) for drawings in layers.values()]


def test_numbers_of_strokes_are_as_asked():
    for name in ("STREAMLET", "JET", "SHEET", "WAVE", "LETTER_S", "BOTTLE_POUR"):
        assert count(PRESETS[name](strokes=13).layers()) == [13], name
    assert count(PRESETS["CROWN"](points=4).layers()) == [8], "two to a point"
    assert count(PRESETS["COLLISION"](strokes=7).layers()) == [14], "of two streams"
    assert count(PRESETS["HEART"](strokes=6).layers()) == [12, 6]
    assert count(PRESETS["BUTTERFLY"](strokes=15).layers()) == [7, 7, 8, 8]
    assert count(PRESETS["BUTTERFLY"](strokes=15, wings="TWO").layers()) == [15, 15]
    for folds in range(9):
        (strokes,) = count(PRESETS["SKIRT"](folds=folds).layers())
        assert 12 <= strokes <= 20 and strokes % max(folds, 1) == 0


def test_as_many_peaks_as_points_and_folds():
    def peaks(preset, best):
        ends = [d.points[-1] for d in preset(asymmetry=0.0).layers()[preset.label]]
        return sum(best(z) for z in np.array(ends)[:, 2])

    assert peaks(PRESETS["CROWN"], lambda z: z > 0.86) == 6
    assert peaks(PRESETS["SKIRT"], lambda z: z < -0.89) == 5


def turned(angle, about):
    """Return the rotation matrix for row vectors about the z or the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    if about == "y":
        return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


SYMMETRIES = {
    "CROWN": turned(2 * np.pi / 6, "z"),
    "JET": turned(2 * np.pi / 8, "z"),
    "SKIRT": turned(2 * np.pi / 5, "z"),
    "SHEET": np.diag([1, -1, 1]),
    "WAVE": np.diag([1, -1, 1]),
    "STREAMLET": np.diag([-1, 1, 1]),
    "HEART": np.diag([-1, 1, 1]),
    "BUTTERFLY": np.diag([-1, 1, 1]),
    "LETTER_S": turned(np.pi, "y"),
    "COLLISION": np.diag([1, -1, -1]),
}


def symmetric_part(name, preset):
    """Return the points that are to be symmetric: of a wound bundle its middle."""
    layers = preset.layers()
    layers.pop("Streamlet" if name == "HEART" else "", None)
    points = points_of(layers)
    return points[: len(points) // preset.strokes] if name in ("STREAMLET", "LETTER_S") else points


@pytest.mark.parametrize("name", SYMMETRIES)
def test_without_asymmetry_it_is_symmetric_and_with_it_not(name):
    def off(asymmetry):
        chosen = {"LETTER_S": {"slant": 0.0}, "JET": {"bow": 0.0}}.get(name, {})
        points = symmetric_part(name, PRESETS[name](asymmetry=asymmetry, **chosen))
        return cKDTree(points).query(points @ SYMMETRIES[name])[0].max()

    assert off(0.0) < 1e-9
    assert off(0.5) > 0.03


@pytest.mark.parametrize("name", PRESETS)
def test_seeds_choose_the_asymmetry(name):
    def points(asymmetry, seed):
        return points_of(PRESETS[name](asymmetry=asymmetry, seed=seed).layers())

    np.testing.assert_array_equal(points(0.5, 3), points(0.5, 3))
    assert np.abs(points(0.5, 3) - points(0.5, 4)).max() > 0.03
    np.testing.assert_array_equal(points(0.0, 3), points(0.0, 4))


@pytest.mark.parametrize("name", PRESETS)
def test_each_layer_is_drawn_at_the_speed_of_a_hand(name):
    for drawings in PRESETS[name](asymmetry=0.0).layers().values():
        wide = longest_side([d.points for d in drawings])
        for drawing in drawings:
            speed = arc_length(drawing.points)[-1] / drawing.times[-1]
            assert speed == pytest.approx(HAND_SPEED * wide / 2)
            assert (np.diff(drawing.times) > 0).all()


def test_asymmetry_lets_lengths_and_speeds_differ():
    strokes = PRESETS["JET"](asymmetry=1.0).layers()["Jet"]
    lengths = np.array([arc_length(d.points)[-1] for d in strokes])
    speeds = lengths / [d.times[-1] for d in strokes]
    assert lengths.min() < 0.9 * lengths.max() and speeds.min() < 0.9 * speeds.max()


def test_asymmetry_lets_neighbours_sway_alike_from_a_source_that_stays():
    still, swaying = (
        [d.points for d in PRESETS["SHEET"](asymmetry=amount).layers()["Sheet"]]
        for amount in (0.0, 1.0)
    )
    away = [cKDTree(a).query(b)[0].max() for a, b in zip(still, swaying, strict=True)]
    assert min(away) > 0.05, "aside, not only shorter"
    for before, after in zip(still, swaying, strict=True):
        np.testing.assert_allclose(after[0], before[0])
    sides = [path[-1, 1] for path in swaying]
    assert sides == sorted(sides), "no stroke crosses another"


def test_strokes_run_with_the_flow():
    for name in ("CROWN", "JET", "SKIRT", "SHEET"):
        for drawing in next(iter(PRESETS[name]().layers().values())):
            first, last = np.hypot(*drawing.points[[0, -1], :2].T)
            assert last > first, f"{name}: outwards"
    for drawings in PRESETS["BUTTERFLY"]().layers().values():
        first, last = (np.array([d.points[n] for d in drawings]) for n in (0, -1))
        assert (np.abs(first[:, 0]) < 0.1).all(), "from the body"
        assert (np.linalg.norm(last, axis=1) > np.linalg.norm(first, axis=1) + 0.3).all()
    heart = PRESETS["HEART"](asymmetry=0.0).layers()
    cleft = np.mean([d.points[0] for d in heart["Heart"]], axis=0)
    poured = np.mean([d.points[-1] for d in heart["Streamlet"]], axis=0)
    assert np.linalg.norm(poured - cleft) < 0.1, "poured into the cleft"


def test_butterfly_layers_are_its_wings():
    layers = PRESETS["BUTTERFLY"](asymmetry=0.0).layers()
    assert list(layers) == [
        "Left Hind Wing",
        "Right Hind Wing",
        "Left Fore Wing",
        "Right Fore Wing",
    ]
    for name, drawings in layers.items():
        points = np.concatenate([d.points for d in drawings])
        assert (points[:, 0] < 0).all() == name.startswith("Left")
        assert (points[:, 2].mean() > 0) == ("Fore" in name)


def test_the_sketches_that_figures_are_measured_on_are_kept():
    assert list(SKETCHES) == ["crown", "jet", "wave"]
    ends = {
        "crown": (12, [0.995004, 0.099833, 0.87]),
        "jet": (9, [1.03, 0.0, -0.1]),
        "wave": (7, [0.713292, -0.6, -0.213144]),
    }
    for name, (strokes, end) in ends.items():
        drawings = example_sketch(name)
        assert len(drawings) == strokes
        np.testing.assert_allclose(drawings[0].points[-1], end, atol=1e-4)
        first = drawings[0]
        assert arc_length(first.points)[-1] / first.times[-1] == pytest.approx(HAND_SPEED)
    with pytest.raises(ValueError, match="there are crown, jet, "):
        example_sketch("cloud")


@pytest.mark.parametrize("name", PRESETS)
def test_liquid_comes_of_each_layer(name):
    pytest.importorskip("torch")
    from liquid_splash_addon.core.generator.loading import load_generator

    generator = load_generator(device="CPU")
    for layer, drawings in PRESETS[name]().layers().items():
        strokes, _ = strokes_from_drawings(drawings, DRAFT)
        splash = make_splash(strokes, DRAFT, generator)
        assert splash.warnings == []
        assert np.isfinite(splash.mesh.vertices).all()
        cell = splash.fields.grid.spacing / splash.frame.scale.length
        points, _ = resampled_points(strokes, cell / 2)
        away = cKDTree(splash.mesh.vertices).query(points)[0]
        assert (away < 4 * cell).mean() > 0.8, layer
