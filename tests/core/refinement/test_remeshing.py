# SPDX-License-Identifier: GPL-3.0-or-later
"""Even triangles on known shapes."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from liquid_splash_addon.core.mesh.halfedge import NotClosedError, connect
from liquid_splash_addon.core.mesh.remeshing import isotropic
from liquid_splash_addon.core.numeric.triangles import enclosed_volume
from tests.core.refinement.level_meshes import CELL, bowl, mesh_of, planet

OCTAHEDRON = (
    np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float),
    np.array(
        [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]]
    ),
)


@pytest.fixture(scope="module")
def old():
    return planet()


@pytest.fixture(scope="module", params=[1.0, 0.5, 1.6])
def remeshed(old, request):
    return isotropic(old.vertices, old.faces, request.param * CELL), request.param * CELL


def edges(faces):
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def is_manifold(faces):
    """Return whether every edge has two faces along it both ways, and every vertex one fan."""
    ends = edges(faces)
    forward = {tuple(edge) for edge in ends.tolist()}
    closed = len(forward) == len(ends) and all((b, a) in forward for a, b in forward)
    turn = {(a, b): (a, c) for f in faces.tolist() for a, b, c in (f, f[1:] + f[:1], f[2:] + f[:2])}
    seen, fans = set(), 0
    for begin in turn:
        fans += begin not in seen
        while begin not in seen:
            seen.add(begin)
            begin = turn[begin]
    return closed and fans == len(np.unique(faces))


def samples(vertices, faces, number=8):
    """Return random points on every face, ``(n, 3)``."""
    shares = np.random.default_rng(0).dirichlet([1, 1, 1], (len(faces), number))
    return np.einsum("fnk,fkc->fnc", shares, vertices[faces]).reshape(-1, 3)


def crossing_faces(vertices, faces):
    """Return how many faces of a mesh cut through others."""
    # Not above: bpy does not load after pymeshlab, only before it.
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices.astype(float), faces))
    meshes.compute_selection_by_self_intersections_per_face()
    return meshes.current_mesh().selected_face_number()


def test_edges_are_of_one_length(remeshed):
    new, target = remeshed
    ends = edges(new.faces)
    length = np.linalg.norm(new.vertices[ends[:, 0]] - new.vertices[ends[:, 1]], axis=1) / target
    assert np.mean((length > 0.5) & (length < 1.5)) > 0.999
    assert 0.85 < length.mean() < 1.05


def test_there_are_no_slivers(remeshed):
    new, _ = remeshed
    corners = new.vertices[new.faces]
    double = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    longest = (np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2) ** 2).max(axis=1)
    # Height over the longest edge; 0.87 in an equilateral triangle.
    assert np.mean(double / longest > 0.35) > 0.999
    assert (double / longest).min() > 0.1


def test_mesh_stays_a_manifold_turned_outward(old, remeshed):
    new, _ = remeshed
    assert is_manifold(new.faces)
    assert enclosed_volume(new.vertices, new.faces) == pytest.approx(
        enclosed_volume(old.vertices, old.faces), rel=0.03
    )
    assert crossing_faces(new.vertices, new.faces) == 0


def test_surface_stays_where_it_was(old, remeshed):
    new, target = remeshed
    there = cKDTree(samples(old.vertices.astype(float), old.faces, 30))
    here = cKDTree(samples(new.vertices, new.faces, 30))
    moved, _ = there.query(new.vertices)
    lost, _ = here.query(old.vertices)
    # The samples' own spacing is about 0.1 cells.
    assert moved.max() < 0.3 * CELL
    assert np.quantile(moved, 0.99) < 0.2 * CELL
    assert np.quantile(lost, 0.99) < max(0.25 * target, 0.2 * CELL)


def test_values_are_carried_over(old, remeshed):
    new, _ = remeshed
    # Known at the old vertices: ten times their place.
    assert np.abs(new.carry(old.velocities) / 10 - new.vertices).max() < 0.2 * CELL
    assert new.carry(np.ones(len(old.vertices))).shape == (len(new.vertices),)
    assert new.weights.sum(axis=1) == pytest.approx(1, abs=1e-5)


def test_a_splash_like_shape_does_not_fold():
    mesh = bowl()
    new = isotropic(mesh.vertices, mesh.faces, CELL)
    assert is_manifold(new.faces)
    assert crossing_faces(new.vertices, new.faces) == 0


def test_a_thread_finer_than_the_target_stays_open():
    mesh = mesh_of(
        lambda x, y, z: np.minimum(
            np.sqrt((np.abs(x) - 14) ** 2 + y**2 + z**2) - 6,
            np.maximum(np.hypot(y, z) - 0.9, np.abs(x) - 14),
        ),
        24,
    )
    for target in (2, 3, 4):
        assert is_manifold(isotropic(mesh.vertices, mesh.faces, target * CELL).faces)


def test_faces_without_area_go():
    axes = np.arange(-9, 10.0)
    box = np.max(np.abs(np.meshgrid(axes, axes, axes)), axis=0) - 6
    # Where the level is 0 at a grid point, several vertices lie on it.
    vertices, faces, _, _ = marching_cubes(box, 0.0, gradient_direction="descent")
    new = isotropic(vertices, faces, 1.0)
    assert is_manifold(new.faces)
    ends = edges(new.faces)
    length = np.linalg.norm(new.vertices[ends[:, 0]] - new.vertices[ends[:, 1]], axis=1)
    assert np.mean(length > 0.4) > 0.99


def test_no_mesh_is_no_mesh():
    nothing = isotropic(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32), 1.0)
    assert len(nothing.vertices) == len(nothing.faces) == 0
    assert nothing.carry(np.zeros((0, 3))).shape == (0, 3)


def test_an_open_mesh_is_refused():
    vertices, faces = OCTAHEDRON
    with pytest.raises(NotClosedError, match="not closed"):
        isotropic(vertices, faces[1:], 0.3)
    with pytest.raises(ValueError, match="above 0"):
        isotropic(vertices, faces, 0.0)


def test_far_too_coarse_and_far_too_fine():
    vertices, faces = OCTAHEDRON
    coarse = isotropic(vertices, faces, 50.0)
    assert is_manifold(coarse.faces)
    assert enclosed_volume(coarse.vertices, coarse.faces) > 0
    fine = isotropic(vertices, faces, 0.03)
    assert is_manifold(fine.faces)
    assert 8000 < len(fine.faces) < 40000


def test_vertices_without_faces_are_no_trouble():
    """There may be more of them than half-edges."""
    vertices, faces = OCTAHEDRON
    stray = np.concatenate([vertices, np.random.default_rng(0).normal(size=(500, 3))])
    start, twin, old = connect(faces, len(stray))
    assert len(old) == len(stray) and (old == np.arange(len(stray))).all()
    assert (twin[twin] == np.arange(len(start))).all()
    new = isotropic(stray, faces, 0.4)
    assert is_manifold(new.faces) and np.isfinite(new.vertices).all()
    alone = isotropic(vertices, faces, 0.4)
    volumes = [enclosed_volume(mesh.vertices, mesh.faces) for mesh in (new, alone)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-6)


def test_a_vertex_where_two_bodies_touch_is_parted():
    vertices, faces = OCTAHEDRON
    # The second octahedron shares the first one's vertex 0.
    second = np.where(faces == 2, 0, faces + 6)
    both = np.concatenate([vertices, vertices + [2, 0, 0]])
    new = isotropic(both, np.concatenate([faces, second]), 0.4)
    assert is_manifold(new.faces)
