# SPDX-License-Identifier: GPL-3.0-or-later
"""Number formats, and convolutions that take another form for speed."""

import copy

import pytest

torch = pytest.importorskip("torch")

from torch import nn  # noqa: E402

from liquid_splash_addon.core.generator import int8_conv, precision  # noqa: E402
from liquid_splash_addon.core.generator.layers import convolution  # noqa: E402
from liquid_splash_addon.core.generator.precision import (  # noqa: E402
    PRECISIONS,
    fastest_in_use,
    is_usable,
    prepare,
)

needs_eight_bits = pytest.mark.skipif(
    not (torch.backends.mkldnn.is_available() and hasattr(torch.ops.onednn, "qconv3d_pointwise")),
    reason="this torch has no kernels for eight bits",
)


def features(channels, cells=12, low=-1.0):
    """Return a batch of two boxes of random features."""
    return torch.empty(2, channels, cells, cells, cells).uniform_(
        low, 2.0, generator=torch.Generator().manual_seed(0)
    )


@pytest.mark.parametrize(("inputs", "size", "stride"), [(5, 3, 1), (7, 2, 2), (24, 1, 1)])
def test_the_form_that_is_fast_gives_the_same(inputs, size, stride):
    layer, x = convolution(inputs, 6, size, stride), features(inputs)
    nn.init.normal_(layer.bias)
    trained = layer(x)  # the plain form
    with torch.inference_mode():
        torch.testing.assert_close(layer(x), trained.detach(), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("size", (1, 3))
@pytest.mark.parametrize("has_bias", (True, False))
def test_more_bias_is_added(size, has_bias):
    layer, x, more = convolution(5, 6, size), features(5), torch.arange(6.0) - 2
    nn.init.normal_(layer.bias)
    if not has_bias:
        layer.bias = None
    with torch.inference_mode():
        apart = layer(x) + more[:, None, None, None]
        torch.testing.assert_close(layer(x, more), apart, rtol=1e-4, atol=1e-4)
        if size == 3 and is_usable("cpu", "int8"):
            eight = int8_conv.QuantizedConvolution(layer)
            apart = eight(x) + more[:, None, None, None]
            torch.testing.assert_close(eight(x, more), apart, rtol=1e-4, atol=1e-4)


@needs_eight_bits
@pytest.mark.parametrize("low", [-1.0, 0.0, -2.0])
@pytest.mark.parametrize("stride", [1, 2])
def test_eight_bits_are_near_the_exact(low, stride):
    """Borders too, where the zeros around the box must stay zeros."""
    near = 2.55 / int8_conv.input_steps()
    layer = nn.Sequential(nn.Conv3d(16, 8, 3, stride, padding=1))
    x = features(16, low=low)
    with torch.inference_mode():
        exact = layer(x)
        found = prepare(copy.deepcopy(layer), "cpu", "int8")(x)
    assert (found - exact).norm() < near * exact.norm()
    edge = (found - exact)[:, :, 0]
    assert edge.norm() < 1.5 * near * exact[:, :, 0].norm()


@needs_eight_bits
def test_pairs_of_products_do_not_overflow_without_vnni(monkeypatch):
    """The largest inputs and weights there are: 7 bits times 8, twice, are within 16 bits."""
    monkeypatch.setattr(torch.cpu, "_is_vnni_supported", lambda: False)
    layer = nn.Sequential(nn.Conv3d(16, 8, 3, padding=1))
    nn.init.ones_(layer[0].weight)
    x = torch.ones(1, 16, 6, 6, 6)
    values, _, _ = int8_conv.quantize(x, int8_conv.input_steps())
    assert 2 * int(values.max()) * 127 < 2**15
    with torch.inference_mode():
        exact = layer(x)
        torch.testing.assert_close(prepare(layer, "cpu", "int8")(x), exact, rtol=1e-3, atol=1e-3)


@needs_eight_bits
def test_eight_bits_repeat_exactly_and_take_empty_boxes():
    layer = prepare(nn.Sequential(nn.Conv3d(16, 8, 3, padding=1)), "cpu", "int8")
    x = features(16, cells=40)  # large enough for several threads
    with torch.inference_mode():
        assert torch.equal(layer(x), layer(x))
        empty = layer(torch.zeros_like(x))
        assert torch.equal(empty, layer[0].bias[:, None, None, None].expand_as(empty))


def test_the_fastest_format_is_one_that_works():
    assert is_usable("cpu", fastest_in_use("cpu"))


def test_a_coarser_format_must_pay(monkeypatch):
    times = {"float32": 1.0, "bfloat16": 0.9, "int8": 0.79, "int8_bfloat16": 0.1}
    monkeypatch.setattr(precision, "seconds", lambda _, name, most=0.0: times[name])
    assert fastest_in_use("cpu") == "int8"
    times["int8"] = 0.81
    assert fastest_in_use("cpu") == "float32"
    times |= {"bfloat16": 0.5, "int8_bfloat16": 0.3}
    assert fastest_in_use("cpu") == "int8_bfloat16"


@pytest.mark.parametrize("name", [name for name, kind in PRECISIONS.items() if kind.eight_bits])
def test_eight_bits_are_for_processors(name):
    with pytest.raises(ValueError, match="for processors, not for meta"):
        prepare(nn.Sequential(nn.Conv3d(4, 4, 3)), "meta", name)
    assert not is_usable("meta", name)


def test_unknown_formats_are_not_usable():
    assert not is_usable("cpu", "float8")


def test_a_format_that_is_hopeless_is_not_measured_to_the_end(monkeypatch):
    """As bfloat16 on a processor without it."""
    sides = []

    def once(layers, device, dtype, side):
        sides.append(side)
        return 0.1 if dtype == torch.bfloat16 else 1e-4

    monkeypatch.setattr(precision, "once", once)
    assert precision.seconds("cpu", "bfloat16") > precision.HOPELESS
    assert set(sides) == {precision.SMALL}
    assert precision.seconds("cpu", "float32") == 1e-4
    assert sides[-4:] == [precision.LARGE] * 4


def test_a_format_that_is_many_times_slower_is_not_measured_to_the_end(monkeypatch):
    """As bfloat16 on a processor that emulates it in a second or two."""
    sides = []

    def once(layers, device, dtype, side):
        if dtype == torch.bfloat16:
            sides.append(side)
            return 0.02
        return 0.03

    monkeypatch.setattr(precision, "once", once)
    assert precision.fastest_precision("cpu") == "float32"
    assert set(sides) == {precision.SMALL}


def test_what_was_measured_is_kept(tmp_path, monkeypatch):
    measured = []
    monkeypatch.setattr(precision.compiled_code, "folder", lambda: tmp_path)
    monkeypatch.setattr(precision, "fastest_in_use", lambda device: measured.append(1) or "int8")
    assert [precision.known_fastest("cpu") for _ in range(3)] == ["int8"] * 3
    assert len(measured) == 1
    next(tmp_path.iterdir()).write_text("damaged")
    assert precision.known_fastest("cpu") == "int8"
    assert len(measured) == 2
