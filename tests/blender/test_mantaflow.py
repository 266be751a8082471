# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own solver goes on from the splash: its shape, and its velocity everywhere."""

import numpy as np
import pytest

from liquid_splash_addon.core.scale import GRAVITY
from tests.blender.flowing import (
    LENGTH,
    baked,
    ball,
    compared,
    crown,
    curling,
    exported,
    mean_place,
    mean_radius,
    turning,
    uniform,
)
from tests.blender.manta_module import mend

FLOWS = {"uniform": uniform, "turning": turning, "curling": curling}


@pytest.fixture(autouse=True)
def solver():
    """Make the solver work in Blender's Python module."""
    mend()


def check(flow, shell: float, resolution: int, cache) -> None:
    """Check the first solved frame of a ball or shell, 1 ms later and without gravity."""
    start = ball(flow, shell=shell)
    item = exported(start, cache, 1000, resolution=resolution, frames=1, gravity=0.0)
    found = compared(item)
    print(flow.__name__, shell, found)
    assert found.error < 0.06
    assert 0.98 < found.slope < 1.02
    assert found.volume == pytest.approx(1, abs=0.05)
    assert found.momentum == pytest.approx(1, abs=0.05) or flow is not uniform


@pytest.mark.parametrize("shell", [0.0, 0.015], ids=["thick", "thin"])
@pytest.mark.parametrize("flow", FLOWS.values(), ids=FLOWS)
def test_the_first_solved_frame_has_our_velocity(flow, shell, tmp_path):
    check(flow, shell, 40, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("shell", [0.0, 0.01], ids=["thick", "thin"])
@pytest.mark.parametrize("flow", FLOWS.values(), ids=FLOWS)
def test_the_same_with_finer_cells(flow, shell, tmp_path):
    check(flow, shell, 96, tmp_path)


def test_gravity_is_the_earths_at_the_splashs_size(tmp_path):
    frames, fps, time = 5, 24, 0.1
    item = exported(ball(uniform, 0.04, time=time), tmp_path, fps, frames=frames, margin=1.5)
    baked(item)
    seconds = frames / fps * time
    moved = mean_place(item, 1 + frames) - mean_place(item, 1)
    path = uniform(np.zeros(3)) * seconds - (0, 0, GRAVITY * seconds**2 / 2)
    assert moved * LENGTH == pytest.approx(path, abs=0.05 * np.linalg.norm(path))


def test_with_velocity_a_crown_rises_and_spreads_and_without_it_collapses(tmp_path):
    heights, radii = {}, {}
    for speed in (0.0, 2.0):
        item = exported(
            crown(speed, 0.1), tmp_path / str(speed), 24,
            frames=8, margin=1.0, ground="FLOOR", ground_height=-0.035 / LENGTH,
        )  # fmt: skip
        baked(item)
        heights[speed] = mean_place(item, 9)[2] - mean_place(item, 1)[2]
        radii[speed] = mean_radius(item, 9) - mean_radius(item, 1)
    assert heights[2.0] > 0.1 > 0 > heights[0.0]
    assert radii[2.0] > radii[0.0] + 0.05
