# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches as a graph, and the network that classifies which lie in liquid."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.condition.patches.features import (  # noqa: E402
    EDGE_FEATURES,
    _gradient,
    patch_graph,
)
from liquid_splash_addon.core.condition.patches.gabriel import find_patches, sample_points_of  # noqa: E402
from liquid_splash_addon.core.generator.patch_classifier import (  # noqa: E402
    GraphTensors,
    PatchClassifier,
    bundled_patch_classifier,
    load_patch_classifier,
    mean_and_most,
    save_patch_classifier,
)
from liquid_splash_addon.core.generator.weights_file import WeightsError, default_weights_path  # noqa: E402
from liquid_splash_addon.core.sketch.strokes import Stroke  # noqa: E402

from .sketching import fan, line, patches_between  # noqa: E402


def graph(strokes):
    samples = sample_points_of(strokes)
    return patch_graph(samples, find_patches(samples))


def rotation(angle=0.7):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array(
        [[1, 0, 0], [0, c, -s], [0, s, c]]
    )


def triangle(flow):
    """Return the corners of a triangle in a slanted plane, their velocities, its normal."""
    plane = rotation()
    corners = np.array([[0.0, 0, 0], [0.02, 0, 0], [0.01, 0.03, 0]])
    velocities = corners @ np.asarray(flow).T
    return (corners @ plane.T)[None], (velocities @ plane.T)[None], plane[:, 2][None]


@pytest.mark.parametrize("side", [1, -1])
def test_a_flow_that_draws_apart_has_its_divergence_and_curl(side):
    corners, flow, normal = triangle([[3.0, -5, 0], [7, 2, 0], [0, 0, 0]])
    divergence, curl, area = _gradient(corners, flow, side * normal)
    assert divergence[0] == pytest.approx(5) and curl[0] == pytest.approx(side * 12)
    assert area[0] == pytest.approx(0.02 * 0.03 / 2)


def test_a_graph_is_the_same_wherever_the_sketch_lies_and_however_it_is_turned():
    samples = sample_points_of(fan())
    patches = find_patches(samples)
    turn = rotation()
    there = patch_graph(
        samples._replace(
            points=samples.points @ turn.T + 0.05, velocities=samples.velocities @ turn.T
        ),
        patches._replace(faces=patches.faces @ turn.T, normals=patches.normals @ turn.T),
    )
    for one, other in zip(patch_graph(samples, patches), there, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-4)


def test_a_graph_does_not_know_which_way_a_normal_points():
    samples = sample_points_of(fan())
    patches = find_patches(samples)
    other = patch_graph(samples, patches._replace(faces=-patches.faces, normals=-patches.normals))
    for one, two in zip(patch_graph(samples, patches), other, strict=True):
        np.testing.assert_allclose(one, two, atol=1e-5)


def test_strokes_are_chains_with_ends():
    strokes = [line((0, 0, 0), (0.1, 0, 0)), line((0, 0.02, 0), (0.1, 0.02, 0))]
    made, samples = graph(strokes), sample_points_of(strokes)
    ends = np.flatnonzero(made.after == np.arange(len(samples.points)))
    starts = np.flatnonzero(made.before == np.arange(len(samples.points)))
    assert len(ends) == len(starts) == 2 and starts[0] == 0 and ends[1] == len(samples.points) - 1
    assert samples.stroke[ends].tolist() == samples.stroke[starts].tolist() == [0, 1]
    # Third and fourth feature: metres to the start and to the end.
    np.testing.assert_allclose(made.points[starts, 2], 0, atol=1e-6)
    np.testing.assert_allclose(made.points[starts, 3], 0.1, atol=1e-3)


def test_triangles_are_paired_across_their_edges():
    made = graph([line((0, 0, 0), (0.1, 0, 0)), line((0, 0.02, 0), (0.1, 0.02, 0))])
    common = [
        len(set(a) & set(b))
        for a, b in zip(made.corners[made.source], made.corners[made.target], strict=True)
    ]
    assert set(common) == {2}
    both = set(zip(made.source.tolist(), made.target.tolist(), strict=True))
    assert all((b, a) in both for a, b in both) and len(both) == len(made.source)
    # A flat strip: each goes straight on (the arms on both sides of the edge are opposite).
    np.testing.assert_allclose(made.pairs[:, 0], -1, atol=0.01)
    # A strip of m triangles has m - 1 inner edges.
    assert len(made.source) == 2 * (len(made.corners) - 1)
    assert made.pairs.shape[1] == len(EDGE_FEATURES)


def test_what_goes_to_a_place_is_averaged_and_its_greatest_kept():
    x = torch.tensor([[1.0, 2.0], [3.0, 0.0], [5.0, 4.0]])
    found = mean_and_most(x, torch.tensor([2, 0, 2]), 3)
    assert found.tolist() == [[3, 0, 3, 0], [0, 0, 0, 0], [3, 3, 5, 4]]


def test_a_classifierment_reaches_along_the_sheet():
    """What is said of a triangle depends on others that touch it, not on ones far away."""
    torch.manual_seed(0)
    classifier = PatchClassifier(width=8, rounds=2).eval()
    made = graph([line((0, 0, 0), (0.3, 0, 0)), line((0, 0.02, 0), (0.3, 0.02, 0))])
    other = made._replace(triangles=made.triangles.copy())
    other.triangles[0] += 1.0
    change = np.abs(classifier.classify(made) - classifier.classify(other)).max(axis=1)
    touching = (np.isin(made.corners, made.corners[0]).sum(axis=1) > 0) & (change > 0)
    assert change[0] > 0 and touching.sum() > 1
    assert (change == 0).any()


def test_the_bundled_classifier_prefers_patches_that_go_on():
    """A sheet of seven strokes beside one another, and one stroke far across from it."""
    sheet = [line((0, y, 0), (0.12, y, 0), 2.0) for y in np.linspace(0, 0.06, 7)]
    far = [line((0.06, 0.03, 0.05), (0.06, 0.03, 0.15), 2.0)]
    patches = patches_between(sheet + far)
    on = np.abs(patches.points[:, 2]) < 0.001
    off = (patches.points[:, 2] > 0.01) & (patches.points[:, 2] < 0.045)
    likely = patches.values[:, 3]
    assert on.any() and off.any() and np.median(likely[on]) > np.median(likely[off]) + 0.3
    # Near liquid is all that is in it.
    assert (patches.values[:, 4] > patches.values[:, 3]).mean() > 0.95


def test_a_classifier_comes_back_from_its_file(tmp_path):
    path = tmp_path / "classifier.safetensors"
    save_patch_classifier(bundled_patch_classifier(), path, {})
    made = graph(fan())
    assert np.array_equal(
        load_patch_classifier(path).classify(made), bundled_patch_classifier().classify(made)
    )


def test_a_damaged_classifier_is_refused(tmp_path):
    path = tmp_path / "classifier.safetensors"
    with pytest.raises(WeightsError, match="No network at"):
        load_patch_classifier(path)
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(WeightsError, match="install the add-on again"):
        load_patch_classifier(path)
    save_patch_classifier(PatchClassifier(width=8), path, {})
    with pytest.raises(WeightsError, match="install the add-on again"):
        load_patch_classifier(path)
    with pytest.raises(WeightsError, match=r"liquid-splash-generator-.*this version reads"):
        load_patch_classifier(default_weights_path())


def test_strokes_of_one_point_have_no_patches():
    patches = patches_between([Stroke(np.zeros((2, 3)), np.ones((2, 3)))])
    assert len(patches.points) == 0 and patches.values.shape[1] == 8


def test_tensors_share_the_graph():
    made = graph(fan())
    assert GraphTensors.of(made).corners.data_ptr() == made.corners.ctypes.data
