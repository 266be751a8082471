# SPDX-License-Identifier: GPL-3.0-or-later
"""Obstacles against solids whose distance is known."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.generator.sparse import closeness
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.mesh.hole_filling import films
from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from liquid_splash_addon.core.numeric.triangles import face_normals, triangle_areas
from liquid_splash_addon.core.numeric.trilinear import sample_field
from liquid_splash_addon.core.obstacles.contact import push_out
from liquid_splash_addon.core.obstacles.obstacles import (
    GENERATOR_REACH,
    MOST_HOLES,
    Obstacle,
    ObstacleError,
    carve,
    clearance,
    depth_of_points,
    generator_obstacle,
    obstacle_from_mesh,
    outside_obstacles,
    signed_distance,
)
from liquid_splash_addon.core.obstacles.openness import enclosed_share, solid_angles
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.sketch.local_frame import Frame

from .solids import box, box_distance, is_closed, sphere, torus, volume

CELL = 0.01
GRID = Grid((64, 64, 64), CELL, (-0.32, -0.32, -0.32))
MIDDLE = np.array([0.013, -0.021, 0.008])
TURN = Rotation.from_rotvec([0.3, 0.5, 0.2]).as_matrix()
BOX = ((-0.1, -0.17, -0.04), (0.153, 0.1, 0.0811))


def flow(direction=(1.0, 0.0, 0.0)) -> np.ndarray:
    """Return a constant velocity field."""
    return np.broadcast_to(np.float32(direction)[:, None, None, None], (3, *GRID.shape)).copy()


def slab(thickness=8.0, direction=(1.0, 0.0, 0.0)) -> LevelSet:
    """Return a sheet across the grid, ``thickness`` cells thick."""
    height = GRID.centres()[..., 2] / CELL
    level = np.abs(height) - thickness / 2
    return LevelSet(level.astype(np.float32), flow(direction), GRID)


def off(distance, true, band, within=1.9):
    """Return the largest error of a clipped distance: near the surface, and anywhere."""
    error = np.abs(distance - np.clip(true, -band, band))
    return error[np.abs(true) < within].max(), error.max()


@pytest.mark.parametrize("band", [1.5, 6.0])
def test_distance_of_a_sphere(band):
    obstacle = obstacle_from_mesh(*sphere(0.2, MIDDLE))
    true = (np.linalg.norm(GRID.centres() - MIDDLE, axis=-1) - 0.2) / CELL
    near, far = off(signed_distance(obstacle, GRID, band), true, band)
    assert near < 0.03  # the polyhedron itself is up to 0.02 cells inside the sphere
    assert far < 0.15


def test_distance_of_a_torus():
    obstacle = obstacle_from_mesh(*torus(0.2, 0.07))
    x, y, z = np.moveaxis(GRID.centres(), -1, 0)
    true = (np.hypot(np.hypot(x, y) - 0.2, z) - 0.07) / CELL
    near, far = off(signed_distance(obstacle, GRID, 6.0), true, 6.0)
    assert near < 0.03
    assert far < 0.15


@pytest.mark.parametrize("turn", [np.eye(3), TURN])
@pytest.mark.parametrize("outward", [True, False])
def test_distance_of_a_box_is_exact_at_its_edges(turn, outward):
    vertices, faces = box(*BOX)
    obstacle = obstacle_from_mesh(vertices @ turn.T, faces if outward else faces[:, ::-1])
    true = box_distance(GRID.centres().astype(float) @ turn, *BOX) / CELL
    near, far = off(signed_distance(obstacle, GRID, 6.0), true, 6.0)
    assert near < 1e-3
    assert far < 0.05


def test_edges_through_cell_centres_do_not_confuse_the_sign():
    low, high = (-0.155, -0.155, -0.155), (0.105, 0.105, 0.105)
    true = box_distance(GRID.centres().astype(float), low, high) / CELL
    found = signed_distance(obstacle_from_mesh(*box(low, high)), GRID)
    assert np.abs(found - np.clip(true, -4, 4)).max() < 1e-3


def test_a_mesh_that_reaches_out_of_the_grid():
    low, high = (-0.5, -0.5, -0.5), (0.6, 0.5, 0.01)
    true = box_distance(GRID.centres().astype(float), low, high) / CELL
    found = signed_distance(obstacle_from_mesh(*box(low, high)), GRID)
    assert np.abs(found - np.clip(true, -4, 4)).max() < 1e-3


def test_overlapping_parts_are_one_solid():
    (a, faces), (b, _) = sphere(0.15, (-0.06, 0, 0)), sphere(0.15, (0.06, 0, 0))
    together = np.concatenate([a, b]), np.concatenate([faces, faces + len(a)])
    found = signed_distance(obstacle_from_mesh(*together), GRID)
    points = GRID.centres()
    true = np.minimum(
        np.linalg.norm(points + (0.06, 0, 0), axis=-1),
        np.linalg.norm(points - (0.06, 0, 0), axis=-1),
    )
    clear = np.abs(true - 0.15) > 0.1 * CELL
    assert ((found < 0) == (true < 0.15))[clear].all()


def test_a_figure_without_a_bottom_is_solid():
    vertices, faces = sphere(0.2, from_angle=0.4)
    obstacle = obstacle_from_mesh(vertices, faces)
    assert obstacle.solid and not obstacle.warning
    points = GRID.centres()
    inside = (np.linalg.norm(points, axis=-1) < 0.19) & (points[..., 2] < 0.2 * np.cos(0.4) - CELL)
    assert (signed_distance(obstacle, GRID)[inside] < 0).all()


def test_missing_and_flipped_faces_do_not_matter():
    vertices, faces = sphere(0.2)
    whole = signed_distance(obstacle_from_mesh(vertices, faces), GRID)
    holed = np.delete(faces, [500, 3000, 3001, 7000], axis=0)
    holed[1000] = holed[1000, ::-1]
    found = signed_distance(obstacle_from_mesh(vertices, holed), GRID)
    assert np.abs(found - whole).max() < 0.1


def test_doubled_vertices_are_joined():
    vertices, faces = box(*BOX)
    loose = obstacle_from_mesh(vertices[faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert loose.solid
    assert len(loose.triangles) == 12


def test_an_open_surface_is_a_sheet_with_a_warning():
    corners = np.array([[-0.2, -0.2, 0.013], [0.2, -0.2, 0.013], [0.2, 0.2, 0.013]])
    obstacle = obstacle_from_mesh(corners, np.array([[0, 1, 2]]), "Floor")
    assert not obstacle.solid
    assert "'Floor' is not closed" in obstacle.warning and "fill its holes" in obstacle.warning
    found = signed_distance(obstacle, GRID)[40, 24]  # above the middle of the triangle
    height = (GRID.centres()[40, 24, :, 2] - 0.013) / CELL
    assert np.allclose(found, np.clip(np.abs(height) - 1, -1, 4), atol=1e-3)
    bowl = obstacle_from_mesh(*sphere(0.2, from_angle=np.pi / 2))
    assert not bowl.solid


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "'Ball' has no faces"),
        (np.zeros((3, 3)), np.array([[0, 1, 2]]), "has no area"),
        (np.full((3, 3), np.nan), np.array([[0, 1, 2]]), "invalid coordinates"),
        (np.eye(3), np.array([[0, 1, 7]]), "missing vertices: repair the mesh"),
    ],
)
def test_meshes_that_cannot_be_obstacles_are_refused(vertices, faces, message):
    with pytest.raises(ObstacleError, match=message):
        obstacle_from_mesh(vertices, faces, "Ball")


def test_distance_at_points():
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.3, 0.3, (5000, 3))
    true = box_distance(points, *BOX) / CELL
    found, nearest = depth_of_points(obstacle_from_mesh(*box(*BOX)), points, CELL, 5.0)
    assert np.allclose(found, np.clip(true, -5, 5), atol=1e-9)
    known = np.abs(true) < 5
    away = np.linalg.norm(points - nearest, axis=1)[known] / CELL
    assert np.allclose(away, np.abs(true[known]))


def test_points_outside_are_those_beyond_the_offset_of_every_obstacle():
    solids = [obstacle_from_mesh(*box((x, 0, 0), (x + 0.1, 0.1, 0.1))) for x in (0, 0.2)]
    points = np.array([[0.05, 0.05, 0.05], [0.25, 0.05, 0.05], [0.15, 0.05, 0.05], [0.31, 0, 0]])
    assert outside_obstacles(points, solids, CELL, 0.25).tolist() == [False, False, True, True]
    assert outside_obstacles(points, solids, CELL, 2.0).tolist() == [False, False, True, False]
    assert outside_obstacles(points, [], CELL, 2.0).all()


@pytest.mark.parametrize("offset", [0.0, 0.5])
@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_no_vertex_lies_in_an_obstacle(shape, offset):
    vertices, faces = sphere(0.15, MIDDLE) if shape == "sphere" else box(*BOX)
    vertices = vertices @ TURN.T
    obstacle = obstacle_from_mesh(vertices, faces)
    carved = carve(slab(), [obstacle], offset)
    mesh = level_surface(carved.level, carved.velocity, GRID)
    assert depth_of_points(obstacle, mesh.vertices, CELL, 3.0)[0].min() < offset - 0.01
    out = push_out(mesh.vertices, mesh.faces, [obstacle], CELL, offset)
    if shape == "sphere":
        depth = (np.linalg.norm(out - MIDDLE @ TURN.T, axis=1) - 0.15) / CELL
    else:
        depth = box_distance(out.astype(float) @ TURN, *BOX) / CELL
    assert depth.min() > offset - 0.05
    assert np.abs(out - mesh.vertices).max() < CELL
    before, after = face_normals(mesh.vertices, mesh.faces), face_normals(out, mesh.faces)
    assert (np.einsum("ij,ij->i", before, after) > 0).all()
    assert is_closed(mesh.faces)


def test_the_cut_is_where_the_obstacle_is():
    obstacle = obstacle_from_mesh(*box((-1, -1, -1), (0.0123, 1, 1)))
    carved = carve(slab(), [obstacle])
    mesh = level_surface(carved.level, carved.velocity, GRID)
    whole = 0.64 * 0.64 * 0.08
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(
        whole * (0.32 - 0.0123) / 0.64, rel=0.02
    )
    cut = (np.abs(mesh.vertices[:, 2]) < 0.02) & (np.abs(mesh.vertices[:, 1]) < 0.25)
    cut &= mesh.vertices[:, 0] < 0.1
    assert np.abs(mesh.vertices[cut, 0] - 0.0123).max() < 0.05 * CELL


def test_liquid_away_from_the_obstacle_stays():
    obstacle = obstacle_from_mesh(*sphere(0.1, (-0.2, 0, 0)))
    before, after = slab(), carve(slab(), [obstacle])
    away = GRID.centres()[..., 0] > 0
    assert (before.level == after.level)[away].all()
    assert (before.velocity == after.velocity)[:, away].all()


def test_velocity_runs_along_the_obstacle():
    obstacle = obstacle_from_mesh(*sphere(0.15, MIDDLE))
    carved = carve(slab(direction=(1.0, 0.5, 0.0)), [obstacle])
    rng = np.random.default_rng(1)
    outward = rng.normal(size=(2000, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    points = MIDDLE + 0.15 * outward
    velocity = sample_field(carved.velocity, GRID.to_cells(points))
    into = (velocity * outward).sum(axis=1)
    undisturbed = outward @ [1.0, 0.5, 0.0]
    assert into.min() > -0.08
    leaving = undisturbed > 0.3
    assert np.allclose(velocity[leaving], [1.0, 0.5, 0.0], atol=1e-6)
    sliding = undisturbed < -0.3
    along = [1.0, 0.5, 0.0] - undisturbed[:, None] * outward
    assert np.abs(velocity - along)[sliding].max() < 0.15


def test_a_swallowed_splash_is_reported():
    obstacle = obstacle_from_mesh(*box((-1, -1, -1), (1, 1, 1)))
    with pytest.raises(ObstacleError, match="swallow the whole splash: move them"):
        carve(slab(), [obstacle])


def test_no_obstacle_changes_nothing():
    liquid = slab()
    assert carve(liquid, []) is liquid
    assert generator_obstacle([], GRID) is None


def test_vertices_deep_between_two_obstacles_come_out():
    left = obstacle_from_mesh(*sphere(0.15, (-0.1, 0, 0)))
    right = obstacle_from_mesh(*sphere(0.15, (0.12, 0, 0)))
    vertices, faces = sphere(0.1, (0, 0, 0.17))
    assert depth_of_points(left, vertices, CELL, 5.0)[0].min() < -3
    out = push_out(vertices, faces, [left, right], CELL)
    for obstacle in (left, right):
        assert depth_of_points(obstacle, out, CELL, 3.0)[0].min() > -0.05


def test_vertices_leave_a_sheet_on_their_side():
    corners = np.array([[-1, -1, 0.0], [1, -1, 0.0], [0, 1, 0.0]])
    sheet = obstacle_from_mesh(corners, np.array([[0, 1, 2]]))
    points = np.array([[0, 0, 0.004], [0, 0.01, -0.004], [0.01, 0, 0.03]])
    out = push_out(points, np.array([[0, 1, 2]]), [sheet], CELL)
    assert np.allclose(out[:, 2], [CELL, -CELL, 0.03], atol=1e-6)


def test_the_generator_sees_what_training_showed():
    obstacle = obstacle_from_mesh(*sphere(0.1, MIDDLE))
    shown = generator_obstacle([obstacle], GRID)
    true = (np.linalg.norm(GRID.centres() - MIDDLE, axis=-1) - 0.1) / CELL
    expected = closeness(torch.from_numpy(true), CELL)
    assert shown.shape == GRID.shape and np.abs(shown).max() <= GENERATOR_REACH / CELL
    assert (closeness(torch.from_numpy(shown), CELL) - expected).abs().max() < 0.03


def test_an_obstacle_in_the_local_frame():
    frame = Frame(TURN, np.array([1.0, 2.0, 3.0]), Scale(0.1))
    vertices, faces = box(*BOX)
    drawn = obstacle_from_mesh(frame.points_to_drawing(vertices), faces)
    local = drawn.seen_from(frame)
    assert np.allclose(local.triangles, obstacle_from_mesh(vertices, faces).triangles)


def test_nearest_of_several_obstacles():
    parts = [obstacle_from_mesh(*sphere(0.1, (x, 0, 0))) for x in (-0.15, 0.15)]
    both = clearance(parts, GRID).distance
    assert (both == np.minimum(*(signed_distance(part, GRID) for part in parts))).all()
    assert isinstance(parts[0], Obstacle)


def cylinder(length: float, around: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """Return a tube of radius 1 without caps."""
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(around)], axis=1)
    points = np.concatenate([ring, ring + (0, 0, length)])
    at = np.arange(around)
    after = np.roll(at, -1)
    lower = np.stack([at, after, after + around], axis=1)
    return points, np.concatenate([lower, np.stack([at, after + around, at + around], axis=1)])


def test_solid_angle_of_a_square_is_that_of_the_closed_form():
    corners = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]], dtype=float)
    square = corners[np.array([[0, 1, 2], [0, 2, 3]])]
    seen = solid_angles(np.zeros((1, 3)), square)[0]
    assert abs(seen) == pytest.approx(4 * np.pi / 6), "a cube's face, seen from its middle"


@pytest.mark.parametrize("length", [4.0, 8.0, 16.0])
def test_the_share_that_a_tube_encloses_falls_with_its_length(length):
    vertices, faces = cylinder(length)
    share = enclosed_share(vertices[faces], films(vertices, faces))
    z = np.linspace(0, length, 401)[1:-1]
    ends = sum((1 - away / np.hypot(1, away)) / 2 for away in (z, length - z))
    # On the axis each open end takes (1 - cos a) / 2 of the view; beside it about as much.
    assert share == pytest.approx(1 - ends.mean(), abs=0.05)


def test_an_open_mesh_that_encloses_its_inside_is_solid_and_can_be_chosen():
    vertices, faces = sphere(1.0)
    middle = vertices[faces].mean(axis=1)
    pot = faces[middle[:, 2] < 0.75]
    assert obstacle_from_mesh(vertices, pot).solid
    open_pot, lid = faces[middle[:, 2] < 0.6], faces[middle[:, 2] >= 0.6]
    assert not obstacle_from_mesh(vertices, open_pot).solid
    both = np.concatenate([vertices, vertices + (0, 0, 0.03)])
    lidded = np.concatenate([open_pot, lid + len(vertices)])
    caps = films(both, lidded)
    assert triangle_areas(caps).sum() > MOST_HOLES * triangle_areas(both[lidded]).sum()
    assert enclosed_share(both[lidded], caps) == pytest.approx(0.99, abs=0.01)
    assert obstacle_from_mesh(both, lidded).solid
    bowl = faces[middle[:, 2] < 0]
    assert not obstacle_from_mesh(vertices, bowl).solid
    assert obstacle_from_mesh(vertices, bowl, kind="SOLID").solid
    assert not obstacle_from_mesh(vertices, pot, kind="SHEET").solid
    plane = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    flat = obstacle_from_mesh(plane, np.array([[0, 1, 2]]), kind="SOLID")
    assert not flat.solid and "encloses nothing" in flat.warning
