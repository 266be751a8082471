# SPDX-License-Identifier: GPL-3.0-or-later
"""A ball's fields, stored and meshed."""

import numpy as np
import pytest

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR, Fields, clip_to_band
from liquid_splash_addon.core.mesh.marching_cubes import surface

GRID = Grid((32, 32, 32), 0.01, (-0.16, -0.16, -0.16))
RADIUS = 0.1


def ball(centre=(0.0, 0.0, 0.0)) -> Fields:
    """Return a ball of RADIUS, its velocity that of a rotation about z at 3 rad/s."""
    points = GRID.centres() - np.asarray(centre, np.float32)
    distance = (np.linalg.norm(points, axis=-1) - RADIUS) / GRID.spacing
    velocity = 3 * np.stack([-points[..., 1], points[..., 0], 0 * points[..., 0]])
    occupancy = 1 / (1 + np.exp(2 * distance))
    clipped = np.clip(distance, -AIR, AIR).astype(np.float32)
    return Fields(occupancy.astype(np.float32), clipped, velocity.astype(np.float32), GRID)


def signed_volume(mesh):
    """Return the volume by the divergence theorem: positive if normals point outward."""
    a, b, c = (mesh.vertices[mesh.faces[:, n]].astype(float) for n in range(3))
    return (np.cross(a, b) * c).sum() / 6


def is_closed(mesh):
    """Return whether every edge has two faces that run along it in opposite directions."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    forward = {tuple(edge) for edge in edges.tolist()}
    return len(forward) == len(edges) and all((b, a) in forward for a, b in forward)


def test_the_surface_lies_on_the_ball():
    mesh = surface(ball())
    radius = np.linalg.norm(mesh.vertices, axis=1)
    assert np.abs(radius - RADIUS).max() < 0.1 * GRID.spacing
    assert signed_volume(mesh) == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.02)
    assert is_closed(mesh)


def test_velocity_is_that_of_the_field():
    mesh = surface(ball())
    expected = 3 * np.stack([-mesh.vertices[:, 1], mesh.vertices[:, 0], 0 * mesh.vertices[:, 0]], 1)
    assert np.abs(mesh.velocities - expected).max() < 1e-3


def test_liquid_at_the_wall_is_closed():
    mesh = surface(ball(centre=(0.16, 0, 0)))
    assert is_closed(mesh)
    assert signed_volume(mesh) > 0


@pytest.mark.parametrize(("threshold", "grows"), [(0.3, True), (0.7, False)])
def test_threshold_moves_the_surface(threshold, grows):
    volume = signed_volume(surface(ball(), threshold))
    assert (volume > signed_volume(surface(ball()))) == grows


def test_no_liquid_is_an_empty_mesh():
    cells = (8, 8, 8)
    nothing = np.zeros(cells, np.float32)
    still = np.zeros((3, *cells), np.float32)
    air = Fields(nothing, nothing + np.float32(AIR), still, Grid(cells, 1.0, (0.0, 0.0, 0.0)))
    assert len(surface(air).faces) == 0


def test_stored_fields_come_back():
    fields = ball()
    again = Fields.from_arrays(fields.to_arrays())
    assert again.grid == fields.grid
    near = fields.distance < AIR
    assert np.abs(again.distance - fields.distance).max() < 2e-3
    assert np.abs(again.velocity - fields.velocity)[:, near].max() < 2e-3
    assert np.abs(again.occupancy - fields.occupancy).max() <= 0.5 / 255 + 1e-6


def test_phi_is_half_at_the_surface():
    fields = ball()
    assert fields.phi.min() >= 0 and fields.phi.max() <= 1
    assert ((fields.phi > 0.5) == (fields.distance < 0)).all()


def test_volume_is_continuous_and_falls_with_the_threshold():
    volumes = [signed_volume(surface(ball(), t)) for t in (0.4, 0.49, 0.5, 0.51, 0.6)]
    assert (np.diff(volumes) < 0).all()
    assert volumes[1] / volumes[3] == pytest.approx(1, abs=0.02)


def test_a_sheet_two_cells_thick_stays_whole():
    depth = np.abs(GRID.centres()[..., 2] - 0.003) / GRID.spacing - 1.0
    occupancy = (1 / (1 + np.exp(2 * depth))).astype(np.float32)
    sheet = Fields(occupancy, np.clip(depth, -AIR, AIR).astype(np.float32),
                   np.zeros((3, 32, 32, 32), np.float32), GRID)  # fmt: skip
    mesh = surface(sheet)
    expected = 0.32 * 0.32 * 2 * GRID.spacing
    assert signed_volume(mesh) == pytest.approx(expected, rel=0.15)
    assert is_closed(mesh)


@pytest.mark.parametrize("sure", [0.6, 0.8, 0.99])
@pytest.mark.parametrize("sides", [(1, 1, 1), (1, 9, 1), (1, 9, 9)])
def test_what_is_one_cell_thick_is_not_blurred_away(sides, sure):
    occupancy = np.zeros(GRID.shape, np.float32)
    occupancy[tuple(slice(12, 12 + n) for n in sides)] = sure
    still = np.zeros((3, *GRID.shape), np.float32)
    mesh = surface(
        Fields(occupancy, np.where(occupancy > 0.5, -1, 1).astype(np.float32), still, GRID)
    )
    assert is_closed(mesh)
    low, high = GRID.cell_of(mesh.vertices).min(0), GRID.cell_of(mesh.vertices).max(0)
    assert (low >= 11).all() and (high <= 12 + np.array(sides)).all()
    assert 0 < signed_volume(mesh) < 1.1 * np.prod(sides) * GRID.spacing**3


def clipped(fields: Fields) -> Fields:
    return clip_to_band(fields.occupancy, fields.distance, fields.velocity, fields.grid)


def test_a_part_is_put_into_air():
    part = clipped(ball())
    grid = Grid((40, 48, 36), GRID.spacing, (0.0, 0.0, 0.0))
    whole = clip_to_band(part.occupancy, part.distance, part.velocity, grid, start=(4, 10, 0))
    box = (slice(4, 36), slice(10, 42), slice(0, 32))
    np.testing.assert_array_equal(whole.distance[box], part.distance)
    np.testing.assert_array_equal(whole.velocity[(slice(None), *box)], part.velocity)
    assert whole.occupancy.sum() == pytest.approx(part.occupancy.sum(), rel=1e-5)
    assert (whole.distance == AIR).sum() == 40 * 48 * 36 - (part.distance < AIR).sum()


def test_rounded_fields_are_what_a_file_gives_back():
    fields = clipped(ball())
    stored, rounded = Fields.from_arrays(fields.to_arrays()), clipped(ball()).round_off()
    np.testing.assert_array_equal(rounded.occupancy, stored.occupancy)
    np.testing.assert_array_equal(rounded.distance, stored.distance)
    np.testing.assert_array_equal(rounded.velocity, stored.velocity)
    assert rounded.grid == stored.grid
    assert np.abs(rounded.distance - fields.distance).max() < 2e-3
    turned = Fields(*(np.asfortranarray(array) for array in (
        fields.occupancy, fields.distance, fields.velocity)), fields.grid).round_off()  # fmt: skip
    np.testing.assert_array_equal(turned.velocity, stored.velocity)
    np.testing.assert_array_equal(turned.distance, stored.distance)
    np.testing.assert_array_equal(turned.occupancy, stored.occupancy)
