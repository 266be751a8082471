# SPDX-License-Identifier: GPL-3.0-or-later
"""A model: copies, drops and waves of several splashes, and what is kept between changes."""

from dataclasses import replace

import numpy as np
import pytest

from liquid_splash_addon.core.composition import model as models
from liquid_splash_addon.core.composition.model import Composer, Part, copies, free_drops
from liquid_splash_addon.core.composition.placement import CompositionError, Placed
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.refinement.drop_meshes import DropCloud
from liquid_splash_addon.core.refinement.settings import WaveSettings
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.settings import ModelSettings
from liquid_splash_addon.core.sketch.local_frame import Frame

from .solids import box, is_closed, volume

GRID = Grid((40, 40, 40), 0.01, (-0.2, -0.2, -0.2))
SHARP = ModelSettings(blend=0.0)


def drops(*places, radius=0.02) -> DropCloud:
    """Return drops, whose meshes are cubes, at these places, metres."""
    cloud = DropCloud.empty()
    for place in places:
        points, faces = box(np.subtract(place, radius), np.add(place, radius))
        ball = Mesh(
            points.astype(np.float32),
            faces.astype(np.int32),
            np.zeros((len(points), 3), dtype=np.float32),
        )
        cloud = cloud.joined(
            DropCloud(
                np.float32([place]), np.float32([[1, 0, 0]]), np.float32([radius]),
                np.array([True]), ball, np.zeros(len(points), dtype=np.int32),
            )
        )  # fmt: skip
    return cloud


def ball(name="ball", centre=(0.3, 0.1, 0.0), radius=0.1, scale=1.0, cloud=None) -> Part:
    """Return a ball of liquid at ``centre`` in the drawing."""
    away = np.linalg.norm(GRID.centres(), axis=-1)
    level = ((away - radius) / GRID.spacing).astype(np.float32)
    flow = np.broadcast_to(np.float32([1, 0, 0])[:, None, None, None], (3, *GRID.shape)).copy()
    frame = Frame(np.eye(3), np.array(centre, dtype=float), Scale(scale))
    return Part(name, Placed(LevelSet(level, flow, GRID), frame), cloud or DropCloud.empty())


def test_copies_stand_at_mirrors_and_around_the_axis():
    settings = ModelSettings(mirror_x=True, count=4, axis="Z")
    found = copies([ball("a"), ball("b", (0.5, 0, 0.2))], settings)
    assert [part.name for part in found] == ["a", "b"] * 8
    centres = {tuple(np.round(part.placed.frame.centre, 6) + 0.0) for part in found}
    assert (-0.3, 0.1, 0.0) in centres and (-0.1, 0.3, 0.0) in centres
    assert (0.0, 0.5, 0.2) in centres
    assert copies([], settings) == []


def test_a_change_redoes_no_more_than_it_must(monkeypatch):
    composer, count = Composer(), []
    plain = models.compose
    monkeypatch.setattr(models, "compose", lambda *a, **b: (count.append(1), plain(*a, **b))[1])
    parts = [ball(), ball("other", (0.4, 0.1, 0))]
    first = composer.compose(parts, SHARP)
    waves = composer.compose(parts, SHARP, WaveSettings())
    assert composer.compose(parts, SHARP, WaveSettings(amplitude=0.003)).mesh is not waves.mesh
    assert len(count) == 1, "waves leave the joint alone"
    again = composer.compose(parts, SHARP)
    np.testing.assert_array_equal(again.mesh.vertices, first.mesh.vertices)
    composer.compose(parts, replace(SHARP, blend=1.0))
    composer.compose([replace(parts[0], name="new"), parts[1]], SHARP)
    composer.compose([parts[0], ball("other", (0.41, 0.1, 0))], SHARP)
    assert len(count) == 4


@pytest.mark.parametrize("scale", [1.0, 0.1])
def test_waves_are_measured_in_metres_of_the_finest_part(scale):
    part = ball(scale=scale, centre=(0, 0, 0))
    stretched = replace(part.placed.liquid, level=part.placed.liquid.level.copy())
    x, y, z = (GRID.centres()[..., axis] for axis in range(3))
    stretched.level[:] = (np.sqrt((x / 1.6) ** 2 + (2 * y) ** 2 + z**2) - 0.1) / 0.01
    part = replace(part, placed=replace(part.placed, liquid=stretched))
    calm = Composer().compose([part], SHARP, WaveSettings(amplitude=0.0)).mesh
    rough = Composer().compose([part], SHARP, WaveSettings(amplitude=0.002)).mesh
    moved = scale * np.linalg.norm(rough.vertices - calm.vertices, axis=1)
    assert 1e-4 < moved.max() < 0.006


def test_drops_in_liquid_or_in_each_other_are_one():
    inside, outside = (0.03, 0.0, 0.0), (0.0, 0.18, 0.0)
    one = ball("one", (0, 0, 0), cloud=drops(outside))
    two = ball("two", (0, 0, 0), cloud=drops(inside, outside))
    composed = Composer().compose([one, two], SHARP)
    assert len(composed.drops.radii) == 1
    np.testing.assert_allclose(composed.drops.positions, [outside], atol=1e-6)
    assert is_closed(composed.mesh.faces)
    expected = 4 / 3 * np.pi * 0.1**3 + 0.04**3
    assert volume(composed.mesh.vertices, composed.mesh.faces) == pytest.approx(expected, rel=0.05)


def test_mirrored_drops_are_not_inside_out():
    part = ball(cloud=drops((0.0, 0.18, 0.0)))
    composer = Composer()
    composer.compose([part], replace(SHARP, mirror_x=True))
    blocks = composer._carved[1]
    found, balls = free_drops(copies([part], replace(SHARP, mirror_x=True)), blocks, [], 0.0)
    assert len(found.radii) == 2
    single = volume(part.cloud.mesh.vertices, part.cloud.mesh.faces)
    assert volume(balls.vertices, balls.faces) == pytest.approx(2 * single, rel=1e-3)
    np.testing.assert_allclose(found.velocities[1], [-1, 0, 0], atol=1e-6)


def test_no_parts():
    with pytest.raises(CompositionError, match="no splash"):
        Composer().compose([], ModelSettings())
