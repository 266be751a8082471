# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrored and radial copies of splashes."""

import numpy as np
import pytest

from liquid_splash_addon.core.composition.placement import (
    CompositionError,
    Placed,
    mirrored,
    radial,
)
from liquid_splash_addon.core.composition.union import compose

from .solids import volume
from .test_composition import BALL, HERE, TURN, at, ball, pieces, surface


# Beyond two cells distances, and so blends, depend a little on the order of the triangles.
@pytest.mark.parametrize(("blend", "error"), [(0.0, 1e-4), (2.0, 0.01)])
def test_a_mirror_image_is_symmetric_to_rounding(blend, error):
    part = Placed(ball(stretch=(1, 0.5, 0.7), velocity=(2, 0, 1)), at(0.08, 0.02, 0.01, axes=TURN))
    both = mirrored([part])
    assert len(both) == 2 and both[0] is part
    blocks = compose(both, blend)
    whole = blocks.whole()
    low = np.round(np.array(blocks.grid.origin) / blocks.grid.spacing).astype(int)
    assert low[0] == -(low[0] + blocks.grid.shape[0])  # blocks lie symmetric about x = 0
    known = np.abs(whole.level) < 1.5
    assert np.abs(whole.level - whole.level[::-1])[known].max() < error
    image = whole.velocity[:, ::-1] * np.float32([-1, 1, 1])[:, None, None, None]
    assert np.abs(whole.velocity - image)[:, known].max() < 0.02
    assert volume(*surface(blocks)) > 0


def test_radial_copies_are_turned_about_the_axis():
    part = Placed(ball(velocity=(1, 0, 0)), at(0.5, 0.1, 0.2, axes=TURN))
    copies = radial([part], 4, axis=(0, 0, 2), point=(0.1, 0.1, 7))
    assert [copy.frame.centre.round(9).tolist() for copy in copies] == [
        [0.5, 0.1, 0.2],
        [0.1, 0.5, 0.2],
        [-0.3, 0.1, 0.2],
        [0.1, -0.3, 0.2],
    ]
    first = part.frame.vectors_to_drawing(np.array([1.0, 0, 0]))
    second = copies[1].frame.vectors_to_drawing(np.array([1.0, 0, 0]))
    assert np.allclose(second, [-first[1], first[0], first[2]])
    mesh = compose(copies).mesh()
    assert pieces(mesh) == 4
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(4 * BALL, rel=0.02)
    assert radial([part], 1) == [part]


@pytest.mark.parametrize(("count", "axis"), [(0, (0, 0, 1)), (1000, (0, 0, 1)), (3, (0, 0, 0))])
def test_senseless_symmetries_are_refused(count, axis):
    with pytest.raises(CompositionError, match=r"copies|direction"):
        radial([Placed(ball(), HERE)], count, axis)
