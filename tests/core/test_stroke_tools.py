# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools on strokes, against closed forms."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import Drawing, backward, strokes_from_drawings
from liquid_splash_addon.core.sketch.strokes import arc_length
from liquid_splash_addon.core.sketch.tools import TOOLS
from liquid_splash_addon.core.sketch.tools.evening import Resample, Reverse, smoothed_path
from liquid_splash_addon.core.sketch.tools.filling import Fill
from liquid_splash_addon.core.sketch.tools.lifting import Lift
from liquid_splash_addon.core.sketch.tools.symmetry import Mirror, Spin
from liquid_splash_addon.core.sketch.tools.tool import Derived, Place, sampled_at

EXACT = {"dip": 0.0, "lean": 0.0, "variation": 0.0}
SOMEWHERE = Place(
    np.array([0.3, -2.0, 1.0]), Rotation.from_rotvec([0.4, -0.8, 1.9]).as_matrix(), None
)


def line(start, stop, seconds=1.0, points=40) -> Drawing:
    """Return a straight stroke at constant speed, its speed stored too."""
    share = np.linspace(0, 1, points)
    start, stop = np.asarray(start, float), np.asarray(stop, float)
    speed = np.full(points, np.linalg.norm(stop - start) / seconds)
    return Drawing(
        start + share[:, None] * (stop - start), share * seconds, 0.01 + 0 * share, speed
    )


def scrawl(seed=0, points=50) -> Drawing:
    """Return a stroke without any symmetry, drawn unevenly."""
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.normal(size=(points, 3)), axis=0)
    times = np.append(0.0, np.cumsum(rng.uniform(0.001, 0.02, points - 1)))
    return Drawing(path, times, rng.uniform(0.1, 1, points), rng.uniform(1, 2, points))


def placed(points, place=SOMEWHERE) -> np.ndarray:
    """Return points of the space of ``place`` in the world."""
    return np.asarray(points, float) @ place.axes + place.pivot


def speeds_of(drawings, source) -> list[np.ndarray]:
    """Return the speeds that the pipeline reads from drawings."""
    settings = SplashSettings(real_size=0.0, speed_source=source)
    strokes, warnings = strokes_from_drawings(drawings, settings)
    assert not warnings
    return [np.linalg.norm(stroke.velocities, axis=1) for stroke in strokes]


def same(one: Drawing, other: Drawing, tolerance=1e-9) -> bool:
    """Whether two drawings agree in everything."""
    names = ("points", "times", "pressures", "speeds")
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return all(np.allclose(a, b, atol=tolerance) for a, b in pairs)


@pytest.mark.parametrize("place", [Place(), SOMEWHERE], ids=["world", "somewhere"])
@pytest.mark.parametrize("axis", "XYZ")
def test_spin_turns_a_radial_line_by_exact_angles_at_its_speed(axis, place):
    order = np.roll(np.eye(3), -1 - "XYZ".index(axis), axis=0)  # local u, v, axis to x, y, z
    radial = line(*placed([(1, 0, 0), (3, 0, 1)] @ order, place), seconds=0.5)
    made = Spin(axis=axis, count=8, **EXACT).apply([radial], place)
    assert len(made) == 8
    for n, derived in enumerate(made):
        u, v, w = ((derived.drawing.points - place.pivot) @ place.axes.T @ order.T).T
        turn = 2 * np.pi * n / 8
        np.testing.assert_allclose(np.cos(turn) * np.hypot(u, v), u, atol=1e-9)
        np.testing.assert_allclose(np.sin(turn) * np.hypot(u, v), v, atol=1e-9)
        np.testing.assert_allclose(w, np.linspace(0, 1, 40), atol=1e-9)
    for source in ("TIME", "ATTRIBUTE"):
        for speed in speeds_of([derived.drawing for derived in made], source):
            np.testing.assert_allclose(speed, np.sqrt(5) / 0.5, rtol=1e-5)


def test_spin_over_a_part_of_the_circle_includes_both_ends():
    made = Spin(count=5, angle=-90, **EXACT).apply([line((1, 0, 0), (2, 0, 0))], Place())
    tips = np.array([derived.drawing.points[-1] for derived in made])
    angles = np.degrees(np.arctan2(tips[:, 1], tips[:, 0]))
    np.testing.assert_allclose(angles, [0, -22.5, -45, -67.5, -90], atol=1e-9)


def test_profiles_take_turns_at_the_places():
    """The second was drawn elsewhere: it is turned to its place, with its own height and speed."""
    profiles = [line((1, 0, 0), (2, 0, 1), 1.0), line((0, -1, 0), (0, -3, 0), 0.25)]
    made = Spin(count=6, **EXACT).apply(profiles, Place())
    assert [derived.source for derived in made] == [0, 1] * 3
    tips = np.array([derived.drawing.points[-1] for derived in made])
    np.testing.assert_allclose(np.hypot(tips[:, 0], tips[:, 1]), [2, 3] * 3)
    np.testing.assert_allclose(tips[:, 2], [1, 0] * 3, atol=1e-12)
    angles = np.degrees(np.unwrap(np.arctan2(tips[:, 1], tips[:, 0])))
    np.testing.assert_allclose(angles, 60 * np.arange(6), atol=1e-9)
    speeds = speeds_of([derived.drawing for derived in made], "TIME")
    np.testing.assert_allclose(speeds[1], 8, rtol=1e-5)


def test_several_profiles_stand_evenly_and_whole():
    """They have points of their own: dips and pairs on top would tear what spans them."""
    profiles = [line((1, 0, 0), (2, 0, 1)), line((1, 0, 0), (1.6, 0, 0.7))]
    made = Spin(count=8, dip=0.5, lean=0.4, variation=0.0).apply(profiles, Place())
    tips = np.array([derived.drawing.points[-1] for derived in made])
    np.testing.assert_allclose(np.hypot(tips[:, 0], tips[:, 1]), [2, 1.6] * 4)
    np.testing.assert_allclose(
        np.degrees(np.unwrap(np.arctan2(tips[:, 1], tips[:, 0]))), 45 * np.arange(8), atol=1e-9
    )


def test_spin_moves_out_swirls_and_dips():
    profile = line((0.5, 0, 0), (1.5, 0, 0))
    made = Spin(count=4, radius=1.0, swirl=90, dip=0.5, lean=0.0, variation=0.0).apply(
        [profile], Place()
    )
    for n, derived in enumerate(made):
        x, y, _ = derived.drawing.points.T
        end = 2.5 - 0.5 * (n % 2)
        np.testing.assert_allclose(np.hypot(x, y), np.linspace(1.5, end, 40))
        angle = np.degrees(np.unwrap(np.arctan2(y, x)))
        np.testing.assert_allclose(np.ptp(angle), 90, rtol=1e-9)
        assert derived.places[-1] == pytest.approx(39 * (1 - 0.5 * (n % 2)))
    # Half a stroke, drawn in half the time.
    assert made[1].drawing.times[-1] == pytest.approx(0.5)


def test_variation_is_seeded_and_leaves_the_first_as_it_was():
    stroke = line((0.5, 0, 0), (1.5, 0, 1))
    tips = []
    for seed in (0, 0, 1):
        made = Spin(variation=0.5, seed=seed).apply([stroke], Place())
        assert same(made[0].drawing, stroke)
        tips.append(np.array([derived.drawing.points[-1] for derived in made]))
    np.testing.assert_array_equal(tips[0], tips[1])
    assert np.abs(tips[2] - tips[0]).max() > 0.01
    durations = [derived.drawing.times[-1] for derived in made]
    assert np.ptp(durations) > 0.05 and min(durations) > 0.2


def test_a_profile_on_the_axis_spins_too():
    made = Spin(radius=1.0, count=4, **EXACT).apply([line((0, 0, 0), (0, 0, 1))], Place())
    feet = np.array([derived.drawing.points[0] for derived in made])
    np.testing.assert_allclose(feet, [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], atol=1e-9)


@pytest.mark.parametrize("axis", "XYZ")
def test_mirror_twice_is_identity(axis):
    stroke = scrawl()
    tool = Mirror(axis=axis, keep=False)
    (once,) = tool.apply([stroke], SOMEWHERE)
    (twice,) = tool.apply([once.drawing], SOMEWHERE)
    assert same(twice.drawing, stroke)
    before, after = (
        (d.points - SOMEWHERE.pivot) @ SOMEWHERE.axes.T for d in (stroke, once.drawing)
    )
    signs = np.where(np.arange(3) == "XYZ".index(axis), -1, 1)
    np.testing.assert_allclose(after, signs * before, atol=1e-9)


def test_strokes_in_the_mirror_get_no_image_beside_them():
    inside, beside = line((0, 0, 0), (0, 1, 1)), line((0, 0, 0), (1, 1, 1))
    made = Mirror(axis="X").apply([inside, beside], Place())
    assert [derived.source for derived in made] == [1]
    assert len(Mirror(axis="X", keep=False).apply([inside, beside], Place())) == 2


def flat_fan(order) -> list[Drawing]:
    """Return strokes of length 2 that fan out in the plane y = 0, in some order."""
    tips = [(np.cos(a), 0, np.sin(a)) for a in np.linspace(0.4, 2.7, 5)]
    return [line((0, 0, 0), np.multiply(2, tips[n])) for n in order]


def test_lift_bends_out_of_the_plane_with_the_square_of_the_length():
    fan = flat_fan(range(5))
    place = Place(towards=np.array([0.1, -0.9, 0.3]))
    size = np.ptp(np.concatenate([s.points for s in fan]), axis=0).max()
    for derived in Lift(bend=0.3, alternate=0.0).apply(fan, place):
        expected = -0.3 * size * np.linspace(0, 1, 40) ** 2  # the viewer is at negative y
        np.testing.assert_allclose(derived.drawing.points[:, 1], expected, atol=1e-9)
        np.testing.assert_allclose(
            derived.drawing.points[:, [0, 2]], fan[derived.source].points[:, [0, 2]], atol=1e-9
        )
        assert derived.drawing.times is fan[derived.source].times


def test_lifted_strokes_are_as_fast_by_stored_speed_as_by_time():
    made = [derived.drawing for derived in Lift(bend=1.0).apply(flat_fan(range(5)), Place())]
    by_time, by_speed = (speeds_of(made, source) for source in ("TIME", "ATTRIBUTE"))
    for one, other in zip(by_time, by_speed, strict=True):
        np.testing.assert_allclose(one[3:-3], other[3:-3], rtol=0.02)


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4), (3, 0, 4, 2, 1)])
def test_neighbours_are_lifted_apart_in_whatever_order_they_were_drawn(order):
    made = Lift(bend=0.0, alternate=0.2).apply(flat_fan(order), Place())
    sides = {n: np.sign(d.drawing.points[-1, 1]) for n, d in zip(order, made, strict=True)}
    assert [sides[n] * sides[0] for n in range(5)] == [1, -1, 1, -1, 1]


def test_lift_by_pressure_follows_thickness():
    stroke = line((0, 0, 0), (4, 0, 0))
    stroke = Drawing(stroke.points, stroke.times, np.linspace(0, 0.02, 40))
    (made,) = Lift(direction="Z", bend=0.0, alternate=0.0, pressure=0.5).apply([stroke], Place())
    np.testing.assert_allclose(made.drawing.points[:, 2], np.linspace(0, 2, 40), atol=1e-9)


@pytest.mark.parametrize("towards", [None, np.array([0.0, 0.0, 1.0])])
def test_a_straight_stroke_is_lifted_across_itself(towards):
    (made,) = Lift().apply([line((0, 0, 0), (0, 0, 3))], Place(towards=towards))
    moved = made.drawing.points[-1] - (0, 0, 3)
    assert abs(moved[2]) < 1e-9 and np.linalg.norm(moved) > 0.1


def test_fill_between_two_lines_is_linear():
    one, other = line((0, 0, 0), (1, 0, 0), 1.0), line((0, 4, 0), (3, 4, 0), 2.0, points=25)
    for rounded in (False, True):
        made = Fill(count=3, rounded=rounded).apply([one, other], Place())
        assert [derived.source for derived in made] == [0, 0, 1]
        for share, derived in zip((0.25, 0.5, 0.75), made, strict=True):
            drawing = derived.drawing
            steps = np.linspace(0, 1, 40)
            expected = np.stack([steps * (1 + 2 * share), 0 * steps + 4 * share, 0 * steps], axis=1)
            np.testing.assert_allclose(drawing.points, expected, atol=1e-9)
            np.testing.assert_allclose(drawing.times, steps * (1 + share), atol=1e-9)
            np.testing.assert_allclose(drawing.speeds, 1 + 0.5 * share, atol=1e-9)


def test_fill_around_a_circle_is_nearly_round():
    """A Catmull-Rom spline through eight points of a circle: 0.6 % off; straight lines 7.6 %."""
    spokes = Spin(count=8, **EXACT).apply([line((1, 0, 0), (1, 0, 1))], Place())
    strokes = [derived.drawing for derived in spokes]
    errors = []
    for rounded in (True, False):
        made = Fill(count=3, close=True, rounded=rounded).apply(strokes, Place())
        assert len(made) == 24
        radii = [np.hypot(*derived.drawing.points[:, :2].T) for derived in made]
        errors.append(np.abs(np.array(radii) - 1).max())
    assert errors[0] < 0.01 and errors[1] == pytest.approx(1 - np.cos(np.pi / 8), abs=1e-9)


def test_fill_reads_strokes_that_run_against_each_other_alike():
    one, other = line((0, 0, 0), (1, 0, 0)), backward(line((0, 2, 0), (1, 2, 0)))
    (made,) = Fill(count=1).apply([one, other], Place())
    np.testing.assert_allclose(made.drawing.points[[0, -1]], [(0, 1, 0), (1, 1, 0)], atol=1e-9)
    (crossed,) = Fill(count=1, match=False).apply([one, other], Place())
    np.testing.assert_allclose(crossed.drawing.points[:, 0], 0.5, atol=1e-9)


def test_fill_without_times_in_one_of_two_has_none():
    (made,) = Fill(count=1).apply(
        [line((0, 0, 0), (1, 0, 0)), Drawing(line((0, 2, 0), (1, 2, 0)).points)], Place()
    )
    assert made.drawing.times is None and made.drawing.pressures is None


def test_resampled_points_are_evenly_spaced_and_speeds_stay():
    along = np.linspace(0, 1, 60) ** 3
    bend = np.stack([np.cos(2 * along), np.sin(2 * along), along], axis=1)
    uneven = Drawing(bend, 0.7 * along)
    (made,) = Resample(count=200, smooth=0.0).apply([uneven], Place())
    steps = np.diff(arc_length(made.drawing.points))
    assert len(steps) == 199 and np.ptp(steps) < 0.02 * steps.mean()
    np.testing.assert_allclose(made.drawing.points[[0, -1]], bend[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(speeds_of([made.drawing], "TIME")[0], np.sqrt(5) / 0.7, rtol=0.01)


def test_resampling_by_spacing_is_no_coarser_than_that():
    (made,) = Resample(by="SPACING", spacing=0.3, smooth=0.0).apply(
        [line((0, 0, 0), (1, 0, 0))], Place()
    )
    assert len(made.drawing.points) == 5
    np.testing.assert_allclose(np.diff(made.drawing.points[:, 0]), 0.25)


def test_smoothing_leaves_a_line_and_damps_a_wave_as_binomial_passes_do():
    count, waves, passes = 65, 6, 5
    share = np.linspace(0, 1, count)
    wave = np.stack([3 * share, np.sin(np.pi * waves * share), 0 * share], axis=1)
    width = np.sqrt(passes / 2) / (count - 1)
    found = smoothed_path(wave, width)
    by_hand = wave.copy()
    for _ in range(passes):
        by_hand[1:-1] = (by_hand[:-2] + 2 * by_hand[1:-1] + by_hand[2:]) / 4
    np.testing.assert_allclose(found, by_hand, atol=1e-12)
    damped = np.cos(np.pi * waves / (count - 1) / 2) ** (2 * passes)
    np.testing.assert_allclose(found[:, 1], damped * wave[:, 1], atol=1e-12)
    np.testing.assert_allclose(found[:, 0], wave[:, 0], atol=1e-12)


def test_reverse_is_as_fast_at_each_place_and_twice_is_identity():
    stroke = scrawl()
    (once,) = Reverse().apply([stroke], Place())
    (twice,) = Reverse().apply([once.drawing], Place())
    assert same(twice.drawing, stroke)
    drawing = once.drawing
    np.testing.assert_array_equal(drawing.points[0], stroke.points[-1])
    assert drawing.times[0] == 0 and (np.diff(drawing.times) > 0).all()
    np.testing.assert_allclose(np.diff(drawing.times), np.diff(stroke.times)[::-1], atol=1e-12)
    np.testing.assert_array_equal(drawing.speeds, stroke.speeds[::-1])


@pytest.mark.parametrize("name", TOOLS)
def test_places_say_where_each_point_comes_from(name):
    """Other properties of points are read there: as many places as points, inside the source."""
    strokes = [scrawl(0), scrawl(1, 30), scrawl(2, 70)]
    made = TOOLS[name]().apply(strokes, SOMEWHERE)
    assert made
    for derived in made:
        count = len(strokes[derived.source].points)
        assert len(derived.places) == len(derived.drawing.points)
        assert derived.places.min() >= 0 and derived.places.max() <= count - 1
        assert np.isfinite(derived.drawing.points).all()


@pytest.mark.parametrize("name", TOOLS)
def test_strokes_without_anything_but_points_can_be_used(name):
    strokes = [Drawing(scrawl(n).points) for n in range(2)]
    for derived in TOOLS[name]().apply(strokes, Place()):
        drawing = derived.drawing
        assert drawing.times is None and drawing.pressures is None and drawing.speeds is None


def extremes(kind) -> list[dict[str, object]]:
    """Return the settings of a tool with one of them at each end in turn."""
    found: list[dict[str, object]] = []
    for item in fields(kind):
        items = item.metadata.get("items")
        ends = [i[0] for i in items] if items else [item.metadata[end] for end in ("low", "high")]
        found += [{item.name: end} for end in ends]
    return found


@pytest.mark.parametrize("name", TOOLS)
def test_tools_hold_at_the_ends_of_every_slider(name):
    strokes = [scrawl(0), line((0, 0, 0), (0, 0, 1), points=2)]
    for settings in extremes(TOOLS[name]):
        for derived in TOOLS[name](**settings).apply(strokes, SOMEWHERE):
            drawing = derived.drawing
            assert np.isfinite(drawing.points).all(), settings
            assert drawing.times is None or (np.diff(drawing.times) >= 0).all(), settings
            assert arc_length(drawing.points)[-1] > 0, settings


def test_a_sample_between_points_is_the_mean_of_both():
    drawing = sampled_at(line((0, 0, 0), (3, 0, 0), points=4), np.array([0.5, 2.0]))
    np.testing.assert_allclose(drawing.points[:, 0], [0.5, 2.0])
    np.testing.assert_allclose(drawing.times, [1 / 6, 2 / 3])
    assert isinstance(Derived(drawing, 0, np.zeros(2)), tuple)
