# SPDX-License-Identifier: GPL-3.0-or-later
"""The network and its weights file."""

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.condition.channels import (  # noqa: E402
    CHANNELS,
    PATCH_VELOCITY,
    STROKE_VELOCITY,
)
from liquid_splash_addon.core.generator.generator import Generator, bounding_box  # noqa: E402
from liquid_splash_addon.core.generator.latent import draw_latent  # noqa: E402
from liquid_splash_addon.core.generator.loading import load_generator  # noqa: E402
from liquid_splash_addon.core.generator.patch_classifier import (  # noqa: E402
    PatchClassifier,
    load_patch_classifier,
    save_patch_classifier,
)
from liquid_splash_addon.core.generator.pixel_shuffle import pixel_shuffle  # noqa: E402
from liquid_splash_addon.core.generator.precision import is_usable  # noqa: E402
from liquid_splash_addon.core.generator.sparse import (  # noqa: E402
    block_means,
    closeness,
    diffused_velocity,
    halved,
    nearness,
)
from liquid_splash_addon.core.generator.splash_unet import Draft, NetworkConfig, SplashNetwork  # noqa: E402
from liquid_splash_addon.core.generator.weights_file import (  # noqa: E402
    WeightsError,
    default_weights_path,
    save_weights,
)
from liquid_splash_addon.core.grid import LOCAL_SPACING, Grid  # noqa: E402
from liquid_splash_addon.core.liquid.fields import AIR, clip_to_band  # noqa: E402
from tests.core.batches import random_condition, sparse_condition  # noqa: E402
from tests.core.sketching import sparse  # noqa: E402

SMALL = NetworkConfig((4, 8, 8, 8), (1, 1, 1, 1), (1, 1, 1), (4, 8), (1, 1, 1), latent_channels=2)
HEADER = {
    "velocity_scale": 5.0,
    "fastest": 6.0,
    "thresholds": {"draft": 0.5, "detail": 0.5},
    "local_cells": 128,
    "local_spacing": LOCAL_SPACING,
}


def small_network():
    """Return a small network whose every layer does something."""
    torch.manual_seed(0)
    network = SplashNetwork(SMALL).eval()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.1 * torch.randn(parameter.shape))
    return network


def nothing(grid):
    """Return the condition of no strokes."""
    return sparse(np.zeros((1, *grid.shape), np.float32))


def test_unfolding_is_the_inverse_of_taking_every_second_cell():
    fine = torch.arange(2 * 4 * 6 * 8.0).reshape(1, 2, 4, 6, 8)
    parts = [fine[:, :, a::2, b::2, c::2] for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    packed = torch.stack(parts, dim=2).flatten(1, 2)
    assert (pixel_shuffle(packed) == fine).all()


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_unfolding_onto_a_base_is_the_same_in_use_and_in_training(dtype):
    x, whole = torch.randn(2, 24, 4, 6, 5).to(dtype), torch.randn(2, 3, 8, 6, 5)
    base = whole[:, :, 2:6]  # a part, as the generator's box is
    trained = pixel_shuffle(x, base)
    with torch.inference_mode():
        used = pixel_shuffle(x, base)
    assert torch.equal(used, trained) and used.dtype == torch.float32
    assert torch.equal(
        pixel_shuffle(x).float() + pixel_shuffle(base.repeat_interleave(8, 1)), trained
    )


def test_latent_zero_is_the_deterministic_answer():
    network, x = small_network(), sparse_condition(random_condition(32))
    with torch.no_grad():
        plain = network(x)
        assert torch.allclose(plain, network(x, torch.zeros(1, 2, 8, 8, 8)), atol=1e-5)
        assert not torch.allclose(plain, network(x, torch.ones(1, 2, 8, 8, 8)), atol=1e-3)


def test_an_obstacle_that_is_not_there_is_one_that_is_not_known():
    network, x = small_network(), sparse_condition(random_condition(16))
    with torch.no_grad():
        far = closeness(torch.full((1, 1, 16, 16, 16), 100.0), 0.006)
        near = closeness(torch.full((1, 1, 16, 16, 16), -1.0), 0.006)
        unknown = network.draft(x).output
        assert torch.equal(unknown, network.draft(x, None, far).output)
        assert not torch.allclose(unknown, network.draft(x, None, near).output, atol=1e-3)


def test_the_draft_begins_as_one_convolution_of_all_it_sees():
    draft, x = small_network().coarse, random_condition(16, 0.05)
    crossed, obstacle = sparse_condition(x), torch.rand(1, 1, 16, 16, 16)
    blocks = block_means(crossed)
    assert torch.allclose(blocks, torch.nn.functional.avg_pool3d(x[:, :4], 2), atol=1e-6)
    flow, near = diffused_velocity(blocks), nearness(blocks)
    assert flow.shape == (1, 3, 16, 16, 16) and near.shape == (1, 2, 16, 16, 16)
    with torch.no_grad():
        draft.stem.bias.normal_()
        begun = draft.begin(crossed, obstacle, flow, near)
        expected = draft.stem(torch.cat([x, obstacle, flow, near], dim=1))
    assert torch.allclose(begun, expected, atol=1e-4)


def test_details_of_a_part_are_those_of_the_whole():
    network, x = small_network(), random_condition(128, 0.001)
    with torch.no_grad():
        crossed = sparse_condition(x)
        draft = network.draft(halved(crossed))
        whole = network.detail(crossed, draft)
        part = Draft(draft.output[..., 8:56, 8:56, 8:56], draft.features[..., 4:28, 4:28, 4:28])
        crop = network.detail(crossed.part((slice(16, 112),) * 3), part)
    inside = slice(24, -24)  # the borders of the part look into nothing
    expected = whole[..., 16:112, 16:112, 16:112][..., inside, inside, inside]
    assert torch.allclose(crop[..., inside, inside, inside], expected, atol=1e-4)


def test_bounding_box_has_a_margin_and_even_bounds():
    wanted = torch.zeros(32, 32, 32, dtype=torch.bool)
    assert bounding_box(wanted) == (slice(10, 24),) * 3  # nothing: some box in the middle
    wanted[9:12, 0, 30] = True
    assert bounding_box(wanted) == (slice(2, 18), slice(0, 8), slice(24, 32))


def test_network_can_learn_a_pair_by_heart():
    torch.manual_seed(0)
    network = SplashNetwork(SMALL).train()
    x = sparse_condition(random_condition(32, 0.02))
    truth = torch.zeros(1, 32, 32, 32)
    truth[:, 4:19, 3:22, 6:12] = 1
    optimiser = torch.optim.Adam(network.parameters(), 3e-3)
    for _ in range(90):
        logit = network(x)[:, 0]
        loss = torch.nn.functional.binary_cross_entropy_with_logits(
            logit, truth, pos_weight=torch.tensor(4.0)
        )
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    guess, there = logit[0] > 0, truth[0] > 0
    assert (guess & there).sum() / (guess | there).sum() > 0.9


def test_saved_weights_load_as_they_were(tmp_path):
    network = small_network()
    save_weights(network, HEADER, tmp_path / "w.safetensors")
    loaded = load_generator(tmp_path / "w.safetensors", "CPU")
    for name, tensor in network.state_dict().items():
        assert torch.allclose(loaded.network.state_dict()[name], tensor, atol=1e-3)
    assert loaded.config == network.config
    assert len(loaded.weights_hash) == 64


def test_bad_weights_files_say_what_to_do(tmp_path):
    good = tmp_path / "good.safetensors"
    save_weights(small_network(), HEADER, good)
    data = good.read_bytes()
    size = int.from_bytes(data[:8], "little")
    head = json.loads(data[8 : 8 + size])
    head["__metadata__"]["format"] = "something else"
    other = json.dumps(head).encode()
    cases = {
        "truncated": (data[: len(data) // 2], "damaged"),
        "cut in the header": (data[:20], "damaged"),
        "empty": (b"", "damaged"),
        "pickle": (b"\x80\x04" + bytes(100), "damaged"),
        "foreign": (len(other).to_bytes(8, "little") + other + data[8 + size :], "format"),
    }
    for name, (content, word) in cases.items():
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(WeightsError, match=word):
            load_generator(path)
    with pytest.raises(WeightsError, match="No network at"):
        load_generator(tmp_path / "missing")


def test_weights_for_a_space_of_another_size_are_refused(tmp_path):
    path = tmp_path / "w.safetensors"
    save_weights(small_network(), {**HEADER, "local_cells": 96}, path)
    with pytest.raises(WeightsError, match=r"was trained in another space \(96 voxels of 0\.\d+ m"):
        load_generator(path, "CPU")


def test_weights_of_other_trainings_are_refused_together(tmp_path):
    """A generator is shown its own classifier's verdicts, from beside it or the bundled one."""
    path = tmp_path / "w.safetensors"
    classifier = PatchClassifier()
    beside = tmp_path / "patch_classifier.safetensors"
    save_patch_classifier(classifier, beside, {"figures": {}})
    own = load_patch_classifier(beside).weights_hash
    save_weights(small_network(), {**HEADER, "patch_classifier_hash": own}, path)
    assert load_generator(path, "CPU").classifier.weights_hash == own
    # What is written into the header later changes nothing.
    save_patch_classifier(classifier, beside, {"figures": {"auc": 0.8}})
    assert load_generator(path, "CPU").classifier.weights_hash == own
    beside.unlink()
    with pytest.raises(WeightsError, match="another patch classifier"):
        load_generator(path, "CPU")
    # Weights from before the classifier's tensors were hashed still load.
    save_weights(small_network(), HEADER, path)
    assert load_generator(path, "CPU").classifier.weights_hash


@pytest.mark.parametrize("name", ["input_channels", "output_channels"])
def test_weights_for_other_channels_are_refused(tmp_path, name):
    path = tmp_path / "w.safetensors"
    save_weights(small_network(), HEADER, path)
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    head = json.loads(data[8 : 8 + size])
    header = json.loads(head["__metadata__"]["header"])
    header[name][0] = "colour"
    head["__metadata__"]["header"] = json.dumps(header)
    other = json.dumps(head).encode()
    path.write_bytes(len(other).to_bytes(8, "little") + other + data[8 + size :])
    with pytest.raises(WeightsError, match=name.replace("_", " ")):
        load_generator(path)


def test_bundled_weights_fit_the_grid_and_the_size_limit():
    generator = load_generator(device="CPU")
    assert generator.header["local_spacing"] == LOCAL_SPACING
    assert default_weights_path().stat().st_size <= 25e6


def test_generator_refuses_what_it_cannot_use():
    generator = Generator(small_network(), HEADER, "", "cpu")
    for spacing, multiple in ((2 * LOCAL_SPACING, 16), (LOCAL_SPACING, 32)):
        grid = Grid((multiple * 3 // 2, 32, 32), spacing, (0, 0, 0))
        with pytest.raises(ValueError, match=f"multiple of {multiple}"):
            generator.generate(nothing(grid), grid)
    grid = Grid.local(32)
    with pytest.raises(ValueError, match="obstacle's grid"):
        generator.generate(nothing(grid), grid, obstacle=np.zeros((16, 16, 16)))


def test_full_result_is_the_whole_network_where_there_may_be_liquid():
    network = small_network()
    condition = random_condition(128, 0.001)[0].numpy()
    fields = Generator(network, HEADER, "", "cpu").generate(sparse(condition), Grid.local())
    scaled = torch.from_numpy(condition)[None].clone()
    for which in (STROKE_VELOCITY, PATCH_VELOCITY):
        scaled[:, which] /= 5.0
    with torch.no_grad():
        expected = torch.sigmoid(network(sparse_condition(scaled))[0, 0]).numpy()
    assert np.abs(fields.occupancy - expected).max() < 1e-3


def test_where_no_detail_is_worked_out_is_air():
    network = small_network()
    with torch.no_grad():
        network.coarse.head.weight[:8] = 0.0
        network.coarse.head.bias[:8] = -20.0  # no liquid, were it not for the strokes
    condition = np.zeros((CHANNELS, 128, 128, 128), np.float32)
    condition[:, 100:110, 30:40, 64] = 1.0
    fields = Generator(network, HEADER, "", "cpu").generate(sparse(condition), Grid.local())
    near = np.zeros((128,) * 3, bool)
    near[88:124, 16:52, 52:80] = True  # the margin is 6 draft cells
    assert fields.grid == Grid.local()
    assert not fields.occupancy[~near].any() and not fields.velocity[:, ~near].any()
    assert (fields.distance[~near] == AIR).all()
    assert fields.occupancy[near].any() and fields.velocity[:, near].any()
    empty = Generator(network, HEADER, "", "cpu").generate(nothing(Grid.local()), Grid.local())
    assert empty.occupancy.max() < 0.5


def test_half_precision_gives_nearly_the_same():
    condition = sparse(random_condition(64)[0].numpy())
    exact, half = (
        Generator(small_network(), HEADER, "", "cpu", p).generate(condition, Grid.local(64))
        for p in ("float32", "bfloat16")
    )
    assert np.abs(exact.occupancy - half.occupancy).mean() < 0.01
    assert ((exact.occupancy > 0.5) == (half.occupancy > 0.5)).mean() > 0.97


@pytest.mark.parametrize("precision", ["int8", "int8_bfloat16"])
@pytest.mark.parametrize(("cells", "seed"), [(64, None), (64, 3), (128, None)])
def test_eight_bits_give_nearly_the_same(precision, cells, seed):
    """With a seed too, whose latent makes features negative."""
    if not is_usable("cpu", precision):
        pytest.skip("no kernels for eight bits here")
    condition = sparse(random_condition(cells, 0.001)[0].numpy())
    exact, rounded = (
        Generator(network, HEADER, "", "cpu", p).generate(
            condition, Grid.local(cells), None if seed is None else draw_latent(SMALL, seed, 1.0)
        )
        for p, network in (("float32", small_network()), (precision, small_network()))
    )
    assert np.abs(exact.occupancy - rounded.occupancy).mean() < 0.02
    assert ((exact.occupancy > 0.5) == (rounded.occupancy > 0.5)).mean() > 0.97


def test_threshold_is_taken_from_the_header():
    network, condition = small_network(), sparse(random_condition(32)[0].numpy())
    plain = Generator(network, HEADER, "", "cpu").generate(condition, Grid.local(32))
    header = {**HEADER, "thresholds": {"draft": 0.3, "detail": 0.5}}
    shifted = Generator(network, header, "", "cpu").generate(condition, Grid.local(32))
    assert np.array_equal(shifted.occupancy > 0.5, plain.occupancy > 0.3)


def test_distance_agrees_with_occupancy():
    rng = np.random.default_rng(0)
    occupancy = rng.random((8, 8, 8), dtype=np.float32)
    distance = rng.uniform(-3, 3, (8, 8, 8)).astype(np.float32)
    fields = clip_to_band(
        occupancy, distance, np.ones((3, 8, 8, 8), np.float32), Grid((8,) * 3, 1, (0,) * 3)
    )
    assert ((fields.distance < 0) == (occupancy > 0.5)).all()
    assert (np.abs(fields.distance) >= 0.1 - 1e-6).all()
