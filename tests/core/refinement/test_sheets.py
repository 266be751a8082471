# SPDX-License-Identifier: GPL-3.0-or-later
"""Films, rims, beads, fingers and drops against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import griddata
from scipy.spatial import cKDTree

from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.mesh.self_intersection import crossing_faces
from liquid_splash_addon.core.numeric.triangles import enclosed_volume
from liquid_splash_addon.core.refinement.drop_meshes import DropCloud
from liquid_splash_addon.core.refinement.fingers import cloud_of
from liquid_splash_addon.core.refinement.settings import SheetSettings
from liquid_splash_addon.core.refinement.sheet_mesh import (
    MOST_FAIRING,
    USUAL_AGE,
    flight_times,
    prepare_sheets,
)
from liquid_splash_addon.core.refinement.sheets import DENSITY, TENSION, add_sheets
from liquid_splash_addon.core.sketch.strokes import Stroke
from tests.core.refinement.level_meshes import CELL, bowl, mesh_of, planet
from tests.core.refinement.test_remeshing import is_manifold

RADIUS, THICK = 20.0, 2.6
PLAIN = SheetSettings(stretch=0, beads=0, fingers=0)


def disc(noise: float = 0.0, half: int = 26) -> Mesh:
    """Return a round sheet, RADIUS cells wide and THICK cells thick, with bumps of 6 cells."""

    def level(x, y, z):
        bumps = noise * np.sin(x) * np.sin(y + z)
        return np.hypot(np.maximum(np.hypot(x, y) - RADIUS, 0), z) - THICK / 2 + bumps

    return mesh_of(level, half)


@pytest.fixture(scope="module")
def flat():
    return prepare_sheets(disc(), CELL)


def rim_formula(film: float, age: float = USUAL_AGE) -> float:
    """Return the radius (m) of a rim that has eaten a film (m) at the Taylor-Culick speed."""
    return np.sqrt(film * np.sqrt(2 * TENSION / (DENSITY * film)) * age / np.pi)


def middles_and_edge(made):
    """Return the vertices in cells, and their distance from the disc's axis."""
    cells = made.mesh.vertices / CELL
    return cells, np.hypot(cells[:, 0], cells[:, 1])


@pytest.mark.parametrize("millimetres", [0.5, 1.0, 2.0])
def test_film_has_the_thickness_that_was_asked_for(flat, millimetres):
    cells, radius = middles_and_edge(add_sheets(flat, replace(PLAIN, film=millimetres)))
    inner = radius < RADIUS - 5
    thickness = 2 * np.abs(cells[inner, 2]) * CELL * 1000
    np.testing.assert_allclose(thickness, millimetres, rtol=0.15)


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.5])
def test_rim_has_the_radius_of_the_formula(flat, factor):
    made = add_sheets(flat, replace(PLAIN, rims=factor))
    cells, radius = middles_and_edge(made)
    wanted = factor * rim_formula(0.001) / CELL
    # The highest point of each part of the rim is its radius above the middle.
    angle = np.floor(np.arctan2(cells[:, 1], cells[:, 0]) / (np.pi / 12)).astype(int)
    edge = radius > RADIUS - 4
    heights = [np.abs(cells[edge & (angle == part), 2]).max() for part in range(-12, 12)]
    np.testing.assert_allclose(heights, wanted, rtol=0.25)
    assert np.median(made.rim[flat.rim >= 0]) / CELL == pytest.approx(wanted, rel=0.02)


def test_mesh_stays_closed_and_does_not_cross():
    for mesh in (disc(), bowl(), planet()):
        made = add_sheets(prepare_sheets(mesh, CELL), SheetSettings())
        assert is_manifold(made.mesh.faces)
        assert not crossing_faces(made.mesh.vertices, made.mesh.faces).any()
        assert len(made.room) == len(made.mesh.vertices)
        volume = enclosed_volume(made.mesh.vertices, made.mesh.faces) + made.cloud.volume
        before = enclosed_volume(mesh.vertices, mesh.faces)
        assert made.volume_change == pytest.approx(volume / before - 1, abs=0.01)


def test_bumps_are_faired_on_both_sides_together():
    prepared = prepare_sheets(disc(noise=0.25), CELL)
    rough = prepared.mesh.vertices / CELL
    inner = np.hypot(rough[:, 0], rough[:, 1]) < RADIUS - 5
    cells, _ = middles_and_edge(add_sheets(prepared, PLAIN))
    middle = np.abs(prepared.faired[inner, 2] / CELL)
    assert np.std(np.abs(rough[inner, 2])) > 0.06
    assert middle.max() < 0.1
    up, down = cells[inner & (rough[:, 2] > 0)], cells[inner & (rough[:, 2] < 0)]
    below = griddata(down[:, :2], down[:, 2], up[:, :2])
    thickness = (up[:, 2] - below)[np.isfinite(below)] * CELL
    assert np.mean(np.abs(thickness / 0.001 - 1) < 0.15) > 0.95
    moved = np.linalg.norm(prepared.faired - prepared.middle, axis=1)
    assert np.percentile(moved, 95) < 1.5 * MOST_FAIRING * CELL


def test_stretched_film_is_thinner():
    mesh = disc()
    # A source in the plane: divergence 2 / s times the rate, whatever the turn about the axis.
    flow = np.float32(8.0) * mesh.vertices * np.array([1, 1, 0], dtype=np.float32)
    prepared = prepare_sheets(replace(mesh, velocities=flow), CELL)
    made = add_sheets(prepared, replace(PLAIN, stretch=1.0))
    inner = np.hypot(*(prepared.mesh.vertices[:, :2] / CELL).T) < RADIUS - 5
    np.testing.assert_allclose(prepared.drawn[inner], 16.0, rtol=0.1)
    np.testing.assert_allclose(made.film[inner], 0.001 * np.exp(-16 * USUAL_AGE), rtol=0.1)


def test_beads_are_nine_radii_apart(flat):
    made = add_sheets(flat, SheetSettings(stretch=0))
    places = flat.faired[made.beads].astype(float)
    angles = np.sort(np.arctan2(places[:, 1], places[:, 0]))
    arc = np.hypot(places[:, 0], places[:, 1]).mean()
    gaps = arc * np.diff(angles, append=angles[0] + 2 * np.pi)
    assert len(gaps) > 8
    assert gaps.mean() == pytest.approx(9 * rim_formula(0.001), rel=0.3)
    other = add_sheets(flat, SheetSettings(stretch=0, seed=1))
    assert set(other.beads.tolist()) != set(made.beads.tolist())
    assert (add_sheets(flat, SheetSettings(stretch=0)).mesh.vertices == made.mesh.vertices).all()


def test_fingers_and_drops_follow_the_outward_flow(flat):
    still = add_sheets(flat, PLAIN)
    made = add_sheets(flat, replace(PLAIN, fingers=1.0, drops=1.0))
    fingers = made.mesh.vertices[len(still.mesh.vertices) :]
    assert np.hypot(fingers[:, 0], fingers[:, 1]).max() > (RADIUS + 3) * CELL
    cloud = made.cloud
    assert len(cloud.radii) > 3
    outward = cloud.positions / np.linalg.norm(cloud.positions, axis=1, keepdims=True)
    assert ((cloud.velocities * outward).sum(axis=1) > 0).all()
    away = cKDTree(made.mesh.vertices).query(cloud.positions)[0]
    assert (away > cloud.radii).all()
    # Without a flow that leads out of the sheet there are none.
    calm = replace(flat, mesh=replace(flat.mesh, velocities=-flat.mesh.velocities))
    assert not len(add_sheets(calm, replace(PLAIN, fingers=1.0)).cloud.radii)


def test_holes_open_the_film_and_have_rims(flat):
    whole = add_sheets(flat, PLAIN)
    made = add_sheets(flat, replace(PLAIN, holes=1.0))
    mesh = made.mesh
    assert is_manifold(mesh.faces) and not crossing_faces(mesh.vertices, mesh.faces).any()
    assert len(made.room) == len(mesh.vertices)

    def holes(mesh):  # the Euler characteristic of a disc's surface is 2; each hole takes 2 off
        edges = len(mesh.faces) * 3 // 2
        return (2 - (len(mesh.vertices) - edges + len(mesh.faces))) // 2

    assert holes(whole.mesh) == 0
    assert holes(mesh) >= 2
    assert made.volume_change == pytest.approx(whole.volume_change, abs=0.03)


def test_turned_liquid_gives_turned_sheets():
    mesh = disc()
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], dtype=np.float32)
    other = Mesh(mesh.vertices @ turn.T, mesh.faces, mesh.velocities @ turn.T)
    made, turned = (add_sheets(prepare_sheets(m, CELL), SheetSettings()) for m in (mesh, other))
    np.testing.assert_allclose(turned.mesh.vertices, made.mesh.vertices @ turn.T, atol=0.01 * CELL)


def test_thick_liquid_and_jets_stay():
    def level(x, y, z):
        ball = np.sqrt((x - 8) ** 2 + y**2 + z**2) - 9
        jet = np.hypot(np.maximum(np.abs(z) - 14, 0), np.hypot(x + 12, y)) - 2
        return np.minimum(ball, jet)

    prepared = prepare_sheets(mesh_of(level, 22), CELL)
    made = add_sheets(prepared, SheetSettings())
    moved = np.linalg.norm(made.mesh.vertices - prepared.mesh.vertices, axis=1)
    assert moved.max() < 0.05 * CELL
    assert "no sheets" in made.warnings[-1]


def test_what_may_not_change_stays(flat):
    def free(points):
        return (points[:, 0] > 0).astype(float)

    prepared = prepare_sheets(disc(), CELL, free=free)
    made = add_sheets(prepared, PLAIN)
    moved = np.linalg.norm(made.mesh.vertices - prepared.mesh.vertices, axis=1)
    x = prepared.mesh.vertices[:, 0] / CELL
    assert moved[x < -5].max() < 0.02 * CELL
    assert np.median(moved[x > 5]) > 0.5 * CELL


def test_bad_input_is_reported(flat):
    thick = add_sheets(flat, replace(PLAIN, film=10.0))
    assert any("as thick as the liquid" in text for text in thick.warnings)
    kept = enclosed_volume(thick.mesh.vertices, thick.mesh.faces)
    assert kept == pytest.approx(enclosed_volume(flat.mesh.vertices, flat.mesh.faces), rel=0.1)
    none = add_sheets(flat, replace(PLAIN, film=0.0))
    assert any("mm are too thin for voxels of" in text for text in none.warnings)
    huge = add_sheets(flat, SheetSettings(rims=4.0, beads=1.0, fingers=2.0, drops=2.0))
    for made in (thick, none, huge):
        assert is_manifold(made.mesh.faces)
        assert not crossing_faces(made.mesh.vertices, made.mesh.faces).any()
    empty = add_sheets(prepare_sheets(Mesh.empty(), CELL), SheetSettings())
    assert not len(empty.mesh.faces) and not empty.warnings


def test_time_of_flight_is_distance_over_speed():
    points = np.linspace([0, 0, 0], [0.1, 0, 0], 11)
    times = flight_times(Stroke(points, np.tile([2.0, 0, 0], (11, 1))))
    np.testing.assert_allclose(times, np.linspace(0, 0.05, 11), rtol=1e-5)


def test_velocity_of_a_turning_disc_stays_right(flat):
    # v = omega x r, everywhere: what moves along a normal must take the velocity of its new place.
    def flow(points):
        return np.stack([-points[:, 1], points[:, 0], 0 * points[:, 0]], axis=1)

    made = add_sheets(flat, PLAIN, flow)
    np.testing.assert_allclose(made.mesh.velocities, flow(made.mesh.vertices), atol=1e-6)


def test_drops_that_a_surface_has_come_to_touch_are_found():
    places = np.array([[0, 0, 0], [RADIUS, 0, 0], [RADIUS + 6, 0, 0]], dtype=np.float32) * CELL
    drops = cloud_of(places, np.zeros((3, 3)), np.full(3, 2 * CELL), CELL)
    clear = drops.clear_of(disc())
    assert clear.tolist() == [False, False, True]
    assert DropCloud.empty().clear_of(disc()).shape == (0,)
    kept = drops.only(clear)
    assert len(kept.radii) == 1 and kept.clear_of(disc()).all()
