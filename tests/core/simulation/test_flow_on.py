# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash a few milliseconds later."""

from __future__ import annotations

import numpy as np
import pytest

from liquid_splash_addon.core.progress import Cancelled
from liquid_splash_addon.core.simulation.flow_on import flow_on
from liquid_splash_addon.core.simulation.start import LooseDrops, MovingObstacle
from tests.core.simulation import starts
from tests.core.solids import box


def middle(liquid):
    """Return the centre of the liquid, metres."""
    return liquid.grid.to_metres(np.argwhere(liquid.level < 0) + 0.5).mean(axis=0)


def test_a_ball_flies_on_and_keeps_shape_speed_and_volume():
    speed, up = np.array([0.8, -0.5, 0.6]), np.array([0.6, 0.0, 0.8])
    begun = starts.start(starts.ball(0.06, speed=speed), up=up)
    later = flow_on(begun, 50.0)
    assert later.grid == begun.liquid.grid and later.level.dtype == np.float32
    path = 0.05 * speed - 0.5 * 9.81 * up * 0.05**2
    assert middle(later) == pytest.approx(path, abs=0.1 * later.grid.spacing)
    assert later.volume == pytest.approx(begun.liquid.volume, rel=0.08)
    near = later.level < 2
    flow = later.velocity[:, near].T
    assert flow == pytest.approx(np.tile(speed - 9.81 * up * 0.05, (len(flow), 1)), abs=0.05)


def test_no_time_is_no_change_and_little_time_is_little_change():
    begun = starts.start(starts.crown(1.0))
    assert flow_on(begun, 0.0) is begun.liquid
    soon = flow_on(begun, 0.1, gravity=0.0)
    surface = np.abs(begun.liquid.level) < 1
    assert np.abs(soon.level - begun.liquid.level)[surface].mean() < 0.25


def test_drops_and_obstacles_are_part_of_it():
    places = np.array([[0.12, 0, 0]], dtype=np.float32)
    drops = LooseDrops(places, np.zeros((1, 3), np.float32), np.array([0.025], np.float32))
    vertices, faces = box((-0.1, -0.1, -0.12), (0.1, 0.1, -0.06))
    obstacle = MovingObstacle(vertices[None].astype(np.float32), faces, "Table")
    begun = starts.start(starts.ball(0.05, speed=(0, 0, -1.5)), drops=drops, obstacles=(obstacle,))
    later = flow_on(begun, 60.0, gravity=0.0)
    inside = later.grid.to_metres(np.argwhere(later.level < 0) + 0.5)
    assert (inside[:, 0] > 0.1).any()
    table = (np.abs(inside[:, :2]) < 0.09).all(axis=1)
    assert inside[table, 2].min() > -0.06 and np.ptp(inside[table, 0]) > 0.12


def test_the_grid_grows_with_what_flies_beyond_it():
    begun = starts.start(starts.ball(0.05, (0.1, 0, 0), speed=(3.0, 0, 0)))
    later = flow_on(begun, 50.0)
    assert later.grid.shape[0] > begun.liquid.grid.shape[0]
    assert later.grid.shape[1] == begun.liquid.grid.shape[1]
    assert middle(later)[0] == pytest.approx(0.25, abs=0.002)
    assert later.volume == pytest.approx(begun.liquid.volume, rel=0.1)
    off = np.subtract(later.grid.origin, begun.liquid.grid.origin) / later.grid.spacing
    assert off == pytest.approx(np.round(off), abs=1e-9)


def test_it_is_stopped_and_refused():
    def stop(stage, share):
        if share > 0.3:
            raise Cancelled

    begun = starts.start(starts.ball())
    with pytest.raises(Cancelled):
        flow_on(begun, 50.0, stop)
    with pytest.raises(ValueError, match="from 0 to 10000 ms"):
        flow_on(begun, 10_001.0)
    with pytest.raises(ValueError, match="no liquid"):
        flow_on(starts.start(starts.ball(-1.0)), 10.0)
