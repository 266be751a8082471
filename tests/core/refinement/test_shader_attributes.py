# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaders know of every vertex, against closed forms."""

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.refinement.flow_coordinates import flow_coordinates, in_a_row
from liquid_splash_addon.core.refinement.settings import SheetSettings
from liquid_splash_addon.core.refinement.shader_attributes import (
    NAMES,
    NO_RIM,
    shader_attributes,
)
from liquid_splash_addon.core.refinement.sheet_mesh import USUAL_AGE, prepare_sheets
from liquid_splash_addon.core.refinement.sheets import add_sheets
from liquid_splash_addon.core.sketch.strokes import Stroke
from tests.core.refinement.level_meshes import CELL, mesh_of
from tests.core.refinement.test_sheets import RADIUS, THICK, disc

MILLIMETRE = 0.001


def straight(offset: float, speed: float = 2.0, length: float = 0.2) -> Stroke:
    """Return a stroke along x, ``offset`` beside the axis, metres and m/s."""
    x = np.linspace(0, length, 41)
    points = np.stack([x, np.full(41, offset), np.zeros(41)], axis=1)
    return Stroke(points, np.tile([speed, 0.0, 0.0], (41, 1)))


def between(count: int = 400) -> np.ndarray:
    """Return random points among strokes, metres."""
    rng = np.random.default_rng(0)
    low, high = (0.02, -0.045, -0.003), (0.18, 0.045, 0.003)
    return rng.uniform(low, high, (count, 3)).astype(np.float32)


def test_coordinates_of_parallel_strokes_are_those_of_the_plane():
    points = between()
    strokes = [straight(y) for y in (0.03, -0.03, 0.0, 0.015, -0.015)]
    found = flow_coordinates(points, strokes)
    np.testing.assert_allclose(found["along"], points[:, 0], atol=0.2 * MILLIMETRE)
    np.testing.assert_allclose(found["age"], points[:, 0] / 2, atol=1e-4)
    # The row may begin at either side.
    sign = np.sign(np.corrcoef(found["across"], points[:, 1])[0, 1])
    np.testing.assert_allclose(found["across"], 0.03 + sign * points[:, 1], atol=0.3 * MILLIMETRE)
    nearest = np.abs(points[:, 1, None] - [s.points[0, 1] for s in strokes]).argmin(axis=1)
    np.testing.assert_array_equal(found["stroke"], nearest)


def test_coordinates_do_not_jump_between_strokes_that_fan_out():
    angles = np.linspace(-0.5, 0.5, 6)
    way = np.linspace(0.02, 0.2, 40)[:, None]
    strokes = []
    for angle in angles:
        heading = np.array([np.cos(angle), np.sin(angle), 0.0])
        strokes.append(Stroke(way * heading, np.tile(2.0 * heading, (40, 1))))
    turn = np.linspace(-0.5, 0.5, 2001)
    arc = 0.15 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    found = flow_coordinates(arc.astype(np.float32), strokes)
    assert np.ptp(found["along"]) < 3 * MILLIMETRE and np.ptp(found["age"]) < 2e-3
    steps = np.diff(found["across"]) * np.sign(np.ptp(found["across"]))
    steps *= np.sign(steps.sum())
    assert (steps > 0).all(), "it grows from side to side"
    assert steps.max() < 3 * steps.mean()


def test_strokes_in_any_order_are_put_in_a_row():
    offsets = np.random.default_rng(1).permutation(np.linspace(-0.05, 0.05, 9))
    row, places = in_a_row([straight(y) for y in offsets])
    steps = np.diff(offsets[row])
    assert (steps > 0).all() or (steps < 0).all()
    np.testing.assert_allclose(places[row], 0.0125 * np.arange(9), atol=0.3 * MILLIMETRE)


def test_colours_are_the_strokes_own_beside_them_and_mix_between():
    strokes = [straight(0.01), straight(-0.01)]
    colours = np.array([[1, 0, 0, 1], [0, 0, 1, 1]], dtype=np.float32)
    points = np.array([[0.1, y, 0] for y in (0.011, 0.006, 0, -0.006)], dtype=np.float32)
    tint = flow_coordinates(points, strokes, colours)["tint"]
    assert tint[0, 0] > 0.99 and tint[1, 0] > 0.9 and tint[3, 2] > 0.9
    np.testing.assert_allclose(tint[2], [0.5, 0, 0.5, 1], atol=0.05)


def test_without_strokes_age_is_the_usual_one():
    found = flow_coordinates(between(5), [])
    assert (found["stroke"] == -1).all() and (found["age"] == np.float32(USUAL_AGE)).all()


def test_strokes_of_one_point_and_resting_pens_are_no_trouble():
    still = Stroke(np.zeros((3, 3)), np.zeros((3, 3)))
    found = flow_coordinates(between(9), [still, straight(0, speed=0.0)])
    assert all(np.isfinite(values).all() for values in found.values())
    assert (found["stroke"] == 1).all()


@pytest.fixture(scope="module")
def slab() -> Mesh:
    return disc()


def test_a_slab_has_its_thickness_and_its_distance_from_the_edge(slab):
    found = shader_attributes(slab, CELL)
    away = np.hypot(slab.vertices[:, 0], slab.vertices[:, 1]) / CELL
    inner = away < RADIUS - 4
    thick = found["thickness"][inner] / CELL
    np.testing.assert_allclose(np.median(thick), THICK, rtol=0.1)
    wanted = RADIUS - away[inner]
    assert np.abs(found["rim"][inner] / CELL - wanted).max() < 2.5
    assert np.median(np.abs(found["rim"][inner] / CELL - wanted)) < 1.5


def test_films_have_the_thickness_that_sheets_gave_them(slab):
    made = add_sheets(prepare_sheets(slab, CELL), SheetSettings(stretch=0, beads=0, fingers=0))
    found = shader_attributes(made.mesh, CELL, room=made.room)
    away = np.hypot(made.mesh.vertices[:, 0], made.mesh.vertices[:, 1]) / CELL
    np.testing.assert_allclose(found["thickness"][away < RADIUS - 5], MILLIMETRE, rtol=0.05)
    rim = made.mesh.vertices[found["rim"] == 0]
    assert len(rim) and (np.hypot(rim[:, 0], rim[:, 1]) / CELL > RADIUS - 4).all()


def test_a_plump_ball_has_no_edge():
    ball = mesh_of(lambda x, y, z: np.sqrt(x**2 + y**2 + z**2) - 9, 12)
    assert (shader_attributes(ball, CELL)["rim"] == NO_RIM).all()


def test_an_empty_mesh_has_empty_attributes():
    found = shader_attributes(Mesh.empty(), CELL, colours=np.zeros((0, 4)))
    assert set(found) == set(NAMES) and all(len(values) == 0 for values in found.values())
