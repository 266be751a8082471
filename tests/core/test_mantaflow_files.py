# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash on a domain of Mantaflow, and the files of its cache."""

import gzip
import resource
import signal
import struct
from dataclasses import replace

import numpy as np
import pytest

from liquid_splash_addon.core.animation.solver_start import SolverStart
from liquid_splash_addon.core.composition.drops import Drops
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.mantaflow.cache_files import (
    CacheError,
    Timing,
    config_path,
    data_path,
    drop_later,
    has_frame,
    read_grid,
    read_particles,
    write_frame,
)
from liquid_splash_addon.core.mantaflow.comparison import compare
from liquid_splash_addon.core.mantaflow.domain import Domain, DomainError, check_memory
from liquid_splash_addon.core.mantaflow.first_frame import FirstFrame, first_frame
from liquid_splash_addon.core.mantaflow.settings import MantaflowSettings
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.sketch.local_frame import Frame

DOMAIN = Domain((12, 10, 9), 0.25, np.array([1.0, -2.0, 0.5]))
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def random_frame() -> FirstFrame:
    """Return a frame that no other is like."""
    rng = np.random.default_rng(1)
    level = rng.normal(size=DOMAIN.shape).astype(np.float32)
    faces = rng.normal(size=(3, *DOMAIN.shape)).astype(np.float32)
    points = rng.uniform(1, 8, (50, 3)).astype(np.float32)
    return FirstFrame(DOMAIN, level, faces, points, points[::-1].copy(), 0.1, 7.0)


def ball(radius: float = 0.03, drops=((0.0, 0.0, 0.06, 0.004),)) -> SolverStart:
    """Return a ball that moves along local x, in a turned frame, and drops (place, radius)."""
    grid = Grid((48,) * 3, 0.002, (-0.048,) * 3)
    away = np.linalg.norm(grid.centres(), axis=-1) - radius
    level = np.clip(away / 0.002, -3, 3).astype(np.float32)
    velocity = np.zeros((3, *grid.shape), dtype=np.float32)
    velocity[0] = level < 3
    rows = np.array(drops, dtype=np.float32).reshape(-1, 4)
    speed = np.tile(np.array([0, 0, 2], dtype=np.float32), (len(rows), 1))
    free = Drops(rows[:, :3], speed, rows[:, 3], np.ones(len(rows), dtype=bool))
    frame = Frame(TURN, np.array([5.0, 0.0, 1.0]), Scale(0.1, 0.05))
    return SolverStart(LevelSet(level, velocity, grid), free, frame, frame)


def test_what_is_written_is_read_back_to_the_bit(tmp_path):
    frame = random_frame()
    assert not has_frame(tmp_path, 3)
    size = write_frame(tmp_path, frame, Timing(3, 24.0, 0.05))
    assert has_frame(tmp_path, 3) and size > 1000
    np.testing.assert_array_equal(read_grid(data_path(tmp_path, "phi", 3)), frame.level)
    np.testing.assert_array_equal(read_grid(data_path(tmp_path, "vel", 3)), frame.faces)
    positions, velocities = read_particles(tmp_path, 3)
    np.testing.assert_array_equal(positions, frame.positions)
    np.testing.assert_array_equal(velocities, frame.velocities)


def test_headers_are_mantaflows(tmp_path):
    write_frame(tmp_path, random_frame(), Timing(3, 24.0, 0.05))
    with gzip.open(data_path(tmp_path, "vel", 3)) as file:
        head = file.read(292)
        assert head[:4] == b"MNT3"
        assert struct.unpack("<6i", head[4:28]) == (12, 10, 9, 12, 2, 12)
        assert len(file.read()) == 12 * 10 * 9 * 12
    with gzip.open(config_path(tmp_path, 3)) as file:
        content = file.read()
    assert len(content) == 204
    assert struct.unpack_from("<4i2f", content) == pytest.approx((0, 12, 10, 9, 1 / 12, 2.5 / 480))
    assert content[-4:] == b"C01\0"


@pytest.mark.parametrize("damage", ["cut off", "empty", "missing", "other"])
def test_damaged_files_say_what_to_do(damage, tmp_path):
    write_frame(tmp_path, random_frame(), Timing(3, 24.0, 1.0))
    path = data_path(tmp_path, "vel", 3)
    content = path.read_bytes()
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes({"cut off": content[:-40], "empty": b"", "other": content[::-1]}[damage])
    with pytest.raises(CacheError, match="export the splash again"):
        read_grid(path)


def test_a_folder_that_cannot_be_written_keeps_what_was_there(tmp_path):
    write_frame(tmp_path, random_frame(), Timing(3, 24.0, 1.0))
    before = data_path(tmp_path, "vel", 3).read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, limits[1]))  # as a full disk does
    try:
        with pytest.raises(CacheError, match="make room"):
            write_frame(tmp_path, random_frame(), Timing(3, 24.0, 1.0))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert data_path(tmp_path, "vel", 3).read_bytes() == before
    assert not list(tmp_path.rglob("*.part"))
    (tmp_path / "file").write_text("")
    with pytest.raises(CacheError, match="cannot be written"):
        write_frame(tmp_path / "file", random_frame(), Timing(3, 24.0, 1.0))


def test_later_frames_and_meshes_go_before_a_new_start(tmp_path):
    for frame in (3, 4, 5):
        write_frame(tmp_path, random_frame(), Timing(frame, 24.0, 1.0))
    drop_later(tmp_path, 3)
    assert [has_frame(tmp_path, frame) for frame in (3, 4, 5)] == [True, False, False]


def test_a_domain_has_whole_cells_and_room_and_stands_on_its_ground():
    start = ball()
    domain = Domain.around(start, MantaflowSettings(resolution=40))
    assert domain.longest == 40
    middle = (np.array([5.0, 0.0, 1.0]) + (0, 0, 0.15)) - domain.middle
    assert np.abs(middle).max() < 0.2
    floor = MantaflowSettings(resolution=40, ground="FLOOR", ground_height=0.5)
    assert Domain.around(start, floor).corner[2] == pytest.approx(
        0.5 - Domain.around(start, floor).cell
    )
    with pytest.raises(DomainError, match="lower Height"):
        Domain.around(start, MantaflowSettings(ground="FLOOR", ground_height=9.0))
    with pytest.raises(DomainError, match="GB are free: set Resolution to"):
        check_memory(domain, free=10_000_000)
    check_memory(domain, free=1 << 34)


def test_shape_and_velocity_are_the_splashs():
    start = ball()
    domain = Domain.around(start, MantaflowSettings(resolution=48))
    first = first_frame(start, domain, MantaflowSettings(resolution=48))
    volume = 4 / 3 * np.pi * (0.3**3 + 0.04**3)
    assert first.volume * domain.cell**3 == pytest.approx(volume, rel=0.04)
    # Local x is the world's y; the time unit is 0.4 s of the liquid, a cell domain.cell * 0.1 m.
    expected = np.array([0, 1, 0]) * 0.4 / (domain.cell * 0.1)
    places = domain.grid.to_metres(first.positions)
    own = np.linalg.norm(places - (5, 0, 1), axis=1) < 0.35
    np.testing.assert_allclose(first.velocities[own].mean(axis=0), expected, atol=0.02)
    drop = np.linalg.norm(places - (5, 0, 1.6), axis=1) < 0.06
    assert 0 < drop.sum() < 40
    np.testing.assert_allclose(first.velocities[drop][:, 2], 2 * expected[1], rtol=0.05)
    assert first.removed < 0.05


def test_a_pool_joins_the_splash_and_is_still():
    start = ball(drops=())
    settings = MantaflowSettings(
        resolution=40, ground="POOL", ground_height=0.9, pool_depth=0.4, divergence_free=False
    )
    domain = Domain.around(start, settings)
    first = first_frame(start, domain, settings)
    top = (0.9 - domain.corner[2]) / domain.cell
    assert first.level[3, 3, int(top) - 2] < -1
    assert first.level[3, 3, int(top) + 2] > 1
    assert np.abs(first.faces[:, 3, 3, int(top) - 2]).max() == 0


def test_the_same_frame_twice_compares_as_equal(tmp_path):
    start = ball(drops=())
    settings = MantaflowSettings(resolution=40)
    first = first_frame(start, Domain.around(start, settings), settings)
    for frame in (1, 2):
        write_frame(tmp_path, first, Timing(frame, 24.0, 1.0))
    found = compare(tmp_path, 1)
    assert (found.slope, found.correlation) == pytest.approx((1, 1), abs=1e-6)
    assert found.error < 1e-6 and found.is_good
    assert (found.volume, found.momentum) == pytest.approx((1, 1), abs=1e-6)
    with pytest.raises(CacheError, match="export the splash again"):
        compare(tmp_path, 2)


def test_a_splash_at_rest_has_no_velocity_to_compare(tmp_path):
    start = ball(drops=())
    start.liquid.velocity[:] = 0
    settings = MantaflowSettings(resolution=40)
    first = first_frame(start, Domain.around(start, settings), settings)
    write_frame(tmp_path, first, Timing(1, 24.0, 1.0))
    falling = replace(first, faces=first.faces - np.float32(1))
    write_frame(tmp_path, falling, Timing(2, 24.0, 1.0))
    found = compare(tmp_path, 1)
    assert found.is_still and found.is_good
    assert str(found) == "No velocity to compare: the splash was at rest. Volume 100.0%"


def test_too_thin_or_too_near_the_sides_is_said():
    start = ball(drops=())
    settings = MantaflowSettings(resolution=16)
    with pytest.raises(DomainError, match="raise Resolution"):
        first_frame(ball(0.0012, drops=()), Domain.around(start, settings), settings)
    small = Domain((12, 12, 12), 0.04, np.array([5 - 0.24, -0.24, 0.76]))
    with pytest.raises(DomainError, match="raise Margin"):
        first_frame(start, small, settings)
