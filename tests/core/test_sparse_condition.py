# SPDX-License-Identifier: GPL-3.0-or-later
"""Conditions as the networks are shown them: the crossed cells alone."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.condition.channels import (  # noqa: E402
    CHANNELS,
    PATCH_CLOSENESS,
    PATCH_VELOCITY,
    STROKE_OFFSET,
    STROKE_VELOCITY,
)
from liquid_splash_addon.core.generator.layers import convolution  # noqa: E402
from liquid_splash_addon.core.generator.sparse import (  # noqa: E402
    SparseCondition,
    block_means,
    diffused_velocity,
    halved,
    strided_stem,
)
from liquid_splash_addon.core.grid import Grid  # noqa: E402
from tests.core.batches import random_condition, sparse_condition  # noqa: E402
from tests.core.sketching import condition_of, fan, moved, sparse  # noqa: E402


def test_a_batch_is_its_conditions_one_after_the_other():
    strokes, grid = fan(), Grid.local(32)
    rotated = moved(strokes, np.eye(3)[[1, 0, 2]], np.zeros(3))
    conditions = [condition_of(strokes, grid), condition_of(rotated, grid)]
    batch = SparseCondition.batched(conditions)
    dense = np.stack([condition.dense() for condition in conditions])
    assert batch.shape == (2, 32, 32, 32) and np.array_equal(batch.dense().numpy(), dense)
    assert np.array_equal(batch.stroke_occupancy().numpy(), dense[:, 0])
    # In the order of the dense array, whichever stroke came first: sums are the same to the bit.
    searched = sparse_condition(batch.dense())
    assert torch.equal(batch.where, searched.where) and torch.equal(batch.values, searched.values)
    nothing = SparseCondition.batched([sparse(np.zeros((1, 4, 4, 4), np.float32))] * 2)
    assert nothing.dense().shape == (2, CHANNELS, 4, 4, 4) and not nothing.dense().any()


def test_halving_a_condition_keeps_strokes_their_velocity_and_place():
    x = torch.zeros(1, CHANNELS, 4, 4, 4)
    x[0, :PATCH_CLOSENESS, 0, 0, 0] = torch.tensor([1.0, 2.0, 0.0, 0.0, 0.5, 0.0, -0.5])
    x[0, :PATCH_CLOSENESS, 1, 1, 0] = torch.tensor([1.0, 4.0, 0.0, -6.0, 0.5, 0.5, 0.0])
    x[0, PATCH_CLOSENESS:, 1, 1, 0] = torch.tensor(
        [0.5, 1.0, 0.25, 0.5, 0.75, 1.0, 2.0, 3.0, 0.5, 0.0, -0.5]
    )
    x[0, PATCH_CLOSENESS:, 1, 0, 0] = torch.tensor(
        [0.25, 0.0, 0.75, 0.0, 0.25, 1.0, 0.0, 1.0, 0.5, 0.0, 0.5]
    )
    half = halved(sparse_condition(x)).dense()
    # The places of both in the cell twice as large: (0, -1/4, -1/2) and (1/2, 1/2, -1/4).
    strokes, patches = (
        half[0, :PATCH_CLOSENESS, 0, 0, 0].tolist(),
        half[0, PATCH_CLOSENESS:, 0, 0, 0].tolist(),
    )
    assert strokes == pytest.approx([1, 3, 0, -3, 0.25, 0.125, -0.375])
    # Of the patches: (1/2, 1/4, -1/2) and (1/2, -1/4, 0).
    assert patches == pytest.approx([0.375, 0.5, 0.5, 0.25, 0.5, 1, 1, 2, 0.5, 0, -0.25])
    assert half.abs().sum() == pytest.approx(sum(map(abs, strokes + patches)))


def test_crossed_cells_are_the_whole_condition():
    x = random_condition(16, 0.05)
    crossed = sparse_condition(x)
    assert torch.equal(crossed.dense(), x)
    box = (slice(2, 10), slice(0, 16), slice(5, 16))
    assert torch.equal(crossed.part(box).dense(), x[:, :, 2:10, :, 5:16])


def velocities(crossed):
    """Return the velocities of strokes and patches, ``(n, 2, 3)``."""
    return torch.stack(
        [crossed.values[:, which] for which in (STROKE_VELOCITY, PATCH_VELOCITY)], dim=1
    )


def test_only_fast_strokes_are_shortened_and_keep_their_direction():
    crossed = sparse_condition(random_condition(16, 0.05))
    velocity, scaled = (velocities(c) for c in (crossed, crossed.scaled(5.0, 1.5)))
    speed = velocity.norm(dim=2, keepdim=True)
    assert (speed > 1.5).any() and (speed < 1.5).any()
    assert torch.allclose(scaled, velocity * (1.5 / speed.clamp_min(1.5)) / 5.0, atol=1e-6)
    others = [
        c.values[:, (*range(4, 12), *range(15, 18))] for c in (crossed, crossed.scaled(5.0, 1.5))
    ]
    assert torch.equal(*others)


def test_a_stem_of_few_cells_is_the_convolution_of_all():
    x = random_condition(16, 0.05)
    torch.manual_seed(0)
    stem = convolution(CHANNELS, 4, 2, 2)  # its bias is zero
    total = torch.rand(1, stem.out_channels, 8, 8, 8)
    with torch.no_grad():
        for given in (total, total.contiguous(memory_format=torch.channels_last_3d)):
            seen = strided_stem(stem, sparse_condition(x), given.clone())
            assert torch.allclose(seen, stem(x) + total, atol=1e-5)
    strided_stem(stem, sparse_condition(x), total).square().sum().backward()
    few = stem.weight.grad.clone()
    stem.weight.grad = None
    (stem(x) + total).square().sum().backward()
    assert torch.allclose(few, stem.weight.grad, rtol=1e-4, atol=1e-4)
    with torch.no_grad():
        assert torch.equal(
            strided_stem(stem, sparse_condition(torch.zeros_like(x)), total.clone()), total
        )


def test_a_draft_sees_the_same_strokes_as_the_full_result():
    strokes = fan()
    fine, coarse = (condition_of(strokes, Grid.local(n)) for n in (128, 64))
    half, coarse = halved(SparseCondition.of(fine)).dense()[0].numpy(), coarse.dense()
    assert np.array_equal(half[0], coarse[0]) and coarse[0].any()
    speed = np.abs(coarse[STROKE_VELOCITY]).max()
    crossed = coarse[:1] > 0
    assert (
        np.abs(half[STROKE_VELOCITY] - coarse[STROKE_VELOCITY]).mean(where=crossed) < 0.05 * speed
    )
    assert np.abs(half[STROKE_OFFSET] - coarse[STROKE_OFFSET]).mean(where=crossed) < 0.05
    patched = coarse[PATCH_CLOSENESS : PATCH_CLOSENESS + 1] > 0
    assert np.array_equal(half[PATCH_CLOSENESS] > 0, coarse[PATCH_CLOSENESS] > 0) and patched.any()
    assert np.abs(half[PATCH_CLOSENESS:] - coarse[PATCH_CLOSENESS:]).mean(where=patched) < 0.05


def test_diffused_velocity_of_one_flow_is_that_flow_everywhere():
    x = random_condition(32)
    x[:, STROKE_VELOCITY] = x[:, :1] * torch.tensor([0.5, -0.25, 1.0]).view(1, 3, 1, 1, 1)
    flow = diffused_velocity(block_means(sparse_condition(x)))
    assert torch.allclose(flow, torch.tensor([0.5, -0.25, 1.0]).view(1, 3, 1, 1, 1), atol=1e-3)
