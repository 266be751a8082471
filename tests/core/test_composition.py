# SPDX-License-Identifier: GPL-3.0-or-later
"""Several splashes as one liquid, and its symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

from liquid_splash_addon.core.composition.placement import CompositionError, Placed
from liquid_splash_addon.core.composition.sparse_blocks import (
    LEAST_LEVEL,
    SIDE,
    with_shared_vertices,
)
from liquid_splash_addon.core.composition.union import compose
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.liquid.smooth_csg import smooth_union
from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from liquid_splash_addon.core.obstacles.contact import push_out
from liquid_splash_addon.core.obstacles.obstacles import (
    ObstacleError,
    depth_of_points,
    obstacle_from_mesh,
)
from liquid_splash_addon.core.progress import Cancelled
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.sketch.local_frame import Frame

from .solids import box, is_closed, sphere, volume

GRID = Grid((40, 40, 40), 0.01, (-0.2, -0.2, -0.2))
RADIUS = 0.12
BALL = 4 / 3 * np.pi * RADIUS**3
TURN = Rotation.from_rotvec([0.3, 0.5, 0.2]).as_matrix()
HERE = Frame(np.eye(3), np.zeros(3), Scale(1.0))


def ball(radius=RADIUS, velocity=(1.0, 0.0, 0.0), stretch=(1.0, 1.0, 1.0), grid=GRID) -> LevelSet:
    """Return a ball, or an ellipsoid (its level no distance then), with a constant velocity."""
    length = np.linalg.norm(grid.centres() / np.float32(stretch), axis=-1)
    field = np.broadcast_to(np.float32(velocity)[:, None, None, None], (3, *grid.shape))
    return LevelSet(((length - radius) / grid.spacing).astype(np.float32), field.copy(), grid)


def at(x, y=0.0, z=0.0, scale=1.0, axes=None) -> Frame:
    """Return a frame centred there."""
    return Frame(np.eye(3) if axes is None else axes, np.array([x, y, z]), Scale(scale))


def pieces(mesh) -> int:
    """Return the number of connected parts of a mesh."""
    links = coo_matrix(
        (np.ones(len(mesh.faces)), (mesh.faces[:, 0], mesh.faces[:, 1])),
        shape=(len(mesh.vertices),) * 2,
    )
    links += coo_matrix(
        (np.ones(len(mesh.faces)), (mesh.faces[:, 1], mesh.faces[:, 2])), links.shape
    )
    return int(connected_components(links, directed=False)[0])


def test_a_splash_alone_stays_as_it_is():
    liquid = ball()
    alone = level_surface(liquid.level, liquid.velocity, liquid.grid)
    for axes in (np.eye(3), TURN):
        blocks = compose([Placed(liquid, at(0.3, -0.1, 0.02, axes=axes))])
        mesh = blocks.mesh()
        away = np.linalg.norm(mesh.vertices - (0.3, -0.1, 0.02), axis=1)
        expected = np.linalg.norm(alone.vertices, axis=1).mean()
        assert np.abs(away - expected).max() < 0.1 * GRID.spacing
        assert volume(mesh.vertices, mesh.faces) == pytest.approx(
            volume(alone.vertices, alone.faces), rel=0.01
        )
        assert is_closed(mesh.faces)


def test_a_splash_joined_with_itself_is_itself():
    part = Placed(ball(stretch=(1, 0.6, 0.8)), at(0, axes=TURN))
    once, twice = compose([part]), compose([part, part])
    assert (once.level == twice.level).all()
    near = once.level < 3
    before, after = (np.moveaxis(b.velocity, 1, -1)[near] for b in (once, twice))
    assert np.allclose(before, after, atol=1e-5)


@pytest.mark.parametrize("blend", [1.0, 4.0])
def test_a_blend_moves_the_surface_by_a_quarter_of_it_at_most(blend):
    part = Placed(ball(), HERE)
    before, after = compose([part]).mesh(), compose([part, part], blend).mesh()
    grown = np.linalg.norm(after.vertices, axis=1) - np.linalg.norm(before.vertices, axis=1).mean()
    assert grown.max() <= (blend / 4 + 0.05) * GRID.spacing
    assert grown.min() >= (blend / 4 - 0.05) * GRID.spacing


def test_a_blend_leaves_what_is_far_away():
    parts = [Placed(ball(), at(-0.1)), Placed(ball(), at(0.1))]
    sharp, smooth = compose(parts), compose(parts, 4.0)
    assert volume(*surface(smooth)) > 1.002 * volume(*surface(sharp))
    far = smooth.mesh().vertices
    far = far[np.abs(far[:, 0]) > 0.1]
    away = np.linalg.norm(far - np.sign(far[:, :1]) * [0.1, 0, 0], axis=1)
    assert np.abs(away - RADIUS).max() < 0.1 * GRID.spacing


def surface(blocks):
    """Return vertices and faces."""
    mesh = blocks.mesh()
    return mesh.vertices, mesh.faces


@pytest.mark.parametrize("blend", [0.0, 3.0])
def test_two_balls_that_overlap_are_one(blend):
    parts = [Placed(ball(), at(-0.08)), Placed(ball(), at(0.08))]
    mesh = compose(parts, blend).mesh()
    height = RADIUS - 0.08
    lens = 2 * np.pi * height**2 * (3 * RADIUS - height) / 3
    assert pieces(mesh) == 1
    assert is_closed(mesh.faces)
    found = volume(mesh.vertices, mesh.faces)
    assert 0.98 * (2 * BALL - lens) < found < (1.01 + 0.02 * blend) * (2 * BALL - lens)


def test_two_balls_apart_are_two():
    parts = [Placed(ball(), at(-2.0)), Placed(ball(), at(2.0, 3.0))]
    blocks = compose(parts, 2.0)
    mesh = blocks.mesh()
    assert pieces(mesh) == 2
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(2 * BALL, rel=0.02)
    assert len(blocks.starts) * SIDE**3 < 0.05 * np.prod(blocks.grid.shape)


def test_a_turned_splash_keeps_volume_and_velocity():
    liquid = ball(stretch=(1, 0.5, 0.7), velocity=(2.0, 0.0, 1.0))
    frame = at(0.5, 0.2, 0.1, scale=0.25, axes=TURN)
    mesh = compose([Placed(liquid, frame)]).mesh()
    alone = level_surface(liquid.level, liquid.velocity, GRID)
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(
        volume(alone.vertices, alone.faces) / 0.25**3, rel=0.01
    )
    assert np.allclose(mesh.velocities, TURN.T @ [2.0, 0.0, 1.0] / 0.25, atol=1e-3)


def test_the_finest_cell_decides():
    parts = [Placed(ball(), at(0.0)), Placed(ball(), at(0.5, scale=2.0))]
    blocks = compose(parts)
    assert blocks.grid.spacing == pytest.approx(0.005)
    mesh = blocks.mesh()
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(BALL * (1 + 1 / 8), rel=0.02)
    coarse = np.linalg.norm(mesh.vertices[mesh.vertices[:, 0] < 0.2], axis=1)
    assert np.abs(coarse - RADIUS).max() < 0.1 * GRID.spacing


def test_the_deeper_splash_decides_about_the_velocity():
    parts = [
        Placed(ball(velocity=(1, 0, 0)), at(-0.08)),
        Placed(ball(velocity=(0, 1, 0)), at(0.08)),
    ]
    mesh = compose(parts).mesh()
    left, right = mesh.vertices[:, 0] < -0.06, mesh.vertices[:, 0] > 0.06
    assert np.allclose(mesh.velocities[left], [1, 0, 0], atol=0.02)
    assert np.allclose(mesh.velocities[right], [0, 1, 0], atol=0.02)
    joint = mesh.velocities[np.abs(mesh.vertices[:, 0]) < 0.002]
    assert np.abs(joint - [0.5, 0.5, 0]).max() < 0.2


def test_blocks_meet_without_cracks():
    liquid = ball(stretch=(1, 0.7, 1.3))
    blocks = compose([Placed(liquid, at(0.001, 0.002, 0.003))], cell=0.003)
    assert len(blocks.starts) > 20
    points, faces = blocks.marched()
    whole = blocks.whole()
    expected, triangles, _, _ = marching_cubes(whole.level, 0.0, gradient_direction="descent")
    assert len(points) == len(expected) and len(faces) == len(triangles)
    # Where the surface runs along an edge of the grid, a vertex may be anywhere on it.
    assert np.abs(map_coordinates(whole.level, points.T, order=1)).max() < 2 * LEAST_LEVEL
    assert is_closed(faces)


def test_vertices_of_one_edge_are_joined():
    points = np.array([[1, 2, 0.5], [1, 2, 0.5], [1, 0.5, 2], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5]])
    found, faces = with_shared_vertices(points, np.array([[0, 2, 3], [1, 2, 4]]))
    assert len(found) == 4
    assert (found[faces] == points[[[0, 2, 3], [1, 2, 4]]]).all()


def test_thick_liquid_has_no_hollow_blocks():
    grid = Grid((20, 20, 20), 0.02, (-0.2, -0.2, -0.2))
    blocks = compose([Placed(ball(0.18, grid=grid), HERE)], cell=0.0025)
    assert (
        (np.abs(blocks.starts + SIDE / 2 - np.array(blocks.grid.shape) / 2) < SIDE / 2 + 1)
        .all(1)
        .any()
    )
    inside = np.linalg.norm(blocks.whole().grid.centres(), axis=-1) < 0.15
    assert (blocks.whole().level[inside] < 0).all()
    assert np.allclose(blocks.whole().velocity[0][inside], 1.0, atol=1e-4)


def test_too_much_memory_says_what_to_do():
    parts = [Placed(ball(), at(0.0)), Placed(ball(), at(0.5, scale=200.0))]
    with pytest.raises(CompositionError, match=r"GB .* compose fewer splashes, use a preview"):
        compose(parts)
    few = [Placed(ball(), at(x)) for x in range(4)]
    with pytest.raises(CompositionError, match="compose fewer"):
        compose(few, most_memory=1 << 22)
    assert len(compose(few, most_memory=1 << 26).starts) > 8


def test_splashes_too_far_apart_are_refused():
    with pytest.raises(CompositionError, match="too far apart"):
        compose([Placed(ball(), at(0)), Placed(ball(), at(1e4, 1e4, 1e4))])


def test_nothing_to_compose():
    with pytest.raises(CompositionError, match="no splash to compose: draw"):
        compose([])
    dry = ball()
    dry = replace(dry, level=np.full_like(dry.level, 3.0))
    with pytest.raises(CompositionError, match="lower their Thinness"):
        compose([Placed(dry, HERE)])
    wet = compose([Placed(dry, HERE), Placed(ball(), HERE)]).mesh()
    assert volume(wet.vertices, wet.faces) == pytest.approx(BALL, rel=0.02)
    with pytest.raises(CompositionError, match="Blend"):
        compose([Placed(ball(), HERE)], blend=-1.0)
    with pytest.raises(CompositionError, match="The voxel must be larger"):
        compose([Placed(ball(), HERE)], cell=0.0)


def test_composing_can_be_cancelled():
    def stop(stage, share):
        assert stage == "Joining splashes" and 0 <= share < 1
        raise Cancelled

    with pytest.raises(Cancelled):
        compose([Placed(ball(), HERE)], report=stop)


def test_the_order_of_splashes_does_not_matter():
    rng = np.random.default_rng(0)
    levels = [rng.normal(size=(4, 4, 4)).astype(np.float32) for _ in range(4)]
    assert (smooth_union(levels, 2.0) == smooth_union(levels[::-1], 2.0)).all()
    lowest = np.minimum.reduce(levels)
    assert (smooth_union(levels, 0.0) == lowest).all()
    assert (smooth_union(levels, 2.0) >= lowest - 0.5).all() and (
        smooth_union(levels, 2.0) <= lowest
    ).all()


def test_a_mesh_of_the_splash_is_joined_in_its_place():
    vertices, faces = sphere(0.05, (0.15, 0, 0))
    liquid = ball()
    own = level_surface(liquid.level, liquid.velocity, GRID)
    drop = type(own)(vertices.astype(np.float32), faces.astype(np.int32), vertices * 0)
    mesh = compose([Placed(liquid, HERE, own.joined(drop))]).mesh()
    assert pieces(mesh) == 1
    assert mesh.vertices[:, 0].max() == pytest.approx(0.2, abs=0.002)


def test_obstacles_carve_a_composition():
    blocks = compose([Placed(ball(velocity=(0, 0, -1)), at(x)) for x in (-0.08, 0.08)], 2.0)
    cell = blocks.grid.spacing
    obstacle = obstacle_from_mesh(*box((-1, -1, -1), (1, 1, 0.0123)))
    carved = blocks.carved([obstacle], 0.25)
    mesh = carved.mesh()
    out = push_out(mesh.vertices, mesh.faces, [obstacle], cell, 0.25)
    assert depth_of_points(obstacle, out, cell, 3.0)[0].min() > 0.25 - 0.01
    assert is_closed(mesh.faces)
    flat = mesh.vertices[:, 2] < 0.0123 + 0.5 * cell
    assert np.abs(mesh.velocities[flat]).max() < 0.05
    assert np.allclose(mesh.velocities[mesh.vertices[:, 2] > 0.08], [0, 0, -1], atol=1e-3)
    assert blocks.carved([]) is blocks
    with pytest.raises(ObstacleError, match="swallow"):
        blocks.carved([obstacle_from_mesh(*sphere(1.0))])


def test_liquid_that_runs_out_along_an_obstacle_ends_in_a_smooth_rim():
    height = np.abs(GRID.centres()[..., 2] / GRID.spacing) - 1.5
    sheet = replace(ball(), level=height.astype(np.float32))
    turn = Rotation.from_euler("yz", [0.05, 0.5]).as_matrix()
    vertices, faces = box((-1, -1, -1), (1, 1, 0))
    below = obstacle_from_mesh(vertices @ turn.T, faces)
    mesh = compose([Placed(sheet, HERE)]).carved([below]).mesh()
    along, across, _ = (mesh.vertices @ Rotation.from_euler("z", 0.5).as_matrix()).T
    strips = np.round(across / GRID.spacing).astype(int)
    rim = [along[strips == n].min() / GRID.spacing for n in range(-9, 10)]
    assert np.ptp(rim) < 1.5  # 20 with a sharp maximum: islands and teeth
