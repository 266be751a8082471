# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages of core that no test of what they are about provokes."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from liquid_splash_addon import api
from liquid_splash_addon.core.animation.streamline_settings import StreamlineSettings
from liquid_splash_addon.core.animation.streamlines_of_surface import FlowError, strokes_in
from liquid_splash_addon.core.composition.placement import CompositionError, radial
from liquid_splash_addon.core.generator import int8_conv
from liquid_splash_addon.core.generator.loading import pick_device
from liquid_splash_addon.core.generator.precision import prepare
from liquid_splash_addon.core.generator.weights_file import (
    WeightsError,
    check_format,
    check_names,
    read_metadata,
)
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.mesh.remeshing import isotropic
from liquid_splash_addon.core.progress import silent
from liquid_splash_addon.core.sketch.strokes import StrokeError
from liquid_splash_addon.core.stroke_files.apa import MAGIC, VERSION, read_apa
from liquid_splash_addon.core.stroke_files.limits import (
    MOST_POINTS,
    MOST_STROKES,
    StrokeFileError,
    check_counts,
)
from tests.core.stroke_files.making import apa, arches

FILE = Path("w.safetensors")


def test_a_device_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(WeightsError, match="finds no CUDA device here: set Device to Automatic"):
        pick_device("CUDA")


def test_eight_bits_are_for_processors():
    with pytest.raises(ValueError, match="'int8' is for processors, not for cuda"):
        prepare(torch.nn.Conv3d(1, 1, 1), "cuda", "int8")


def test_a_torch_without_eight_bits_says_so(monkeypatch):
    def missing(_network: torch.nn.Module) -> None:
        raise NotImplementedError("no such kernel")

    monkeypatch.setattr(int8_conv, "quantize_convolutions", missing)
    with pytest.raises(ValueError, match="PyTorch cannot compute in 'int8' here: no such kernel"):
        prepare(torch.nn.Conv3d(1, 1, 1), "cpu", "int8")


def test_liquid_without_a_line_along_it_is_too_thin_to_trace():
    grid = Grid((16, 16, 16), 0.1, (0.0, 0.0, 0.0))
    distance = np.full(grid.shape, 2.0, dtype=np.float32)  # sheets that no cell holds
    flow = np.ones((8, 8, 8, 3), dtype=np.float32)
    with pytest.raises(FlowError, match="Its liquid is too thin to trace: choose a higher"):
        strokes_in(distance, flow, grid, StreamlineSettings(), silent)


def test_weights_for_another_version_are_refused():
    with pytest.raises(WeightsError, match="has the format 'a', this version reads 'b': choose"):
        check_format({"format": "a"}, "b", FILE)
    header = {"header": json.dumps({"stroke_channels": ["x"]})}
    with pytest.raises(WeightsError, match="is for other stroke channels than this version has"):
        check_names(header, {"stroke_channels": ["y"]}, FILE)
    with pytest.raises(WeightsError, match="is damaged") as refusal:
        read_metadata(b"12345678", FILE)
    assert "shorter than its header says" in str(refusal.value.__cause__)


@pytest.mark.parametrize("count", [0, 1000])
def test_radial_symmetry_has_a_bounded_number_of_copies(count):
    with pytest.raises(CompositionError, match=rf"Radial symmetry takes 1 to \d+ .*not {count}"):
        radial([], count)


@pytest.mark.parametrize("target", [0.0, -1.0, np.nan])
def test_edges_have_a_length(target):
    with pytest.raises(ValueError, match="the target length must be above 0, not"):
        isotropic(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32), target)


@pytest.mark.parametrize("counts", [(MOST_STROKES + 1, 0), (1, MOST_POINTS + 1)])
def test_files_that_claim_too_much_are_not_read(counts):
    with pytest.raises(StrokeFileError, match=r"by its own account, at most [\d,]+ are read"):
        check_counts(*counts)


def test_another_version_of_a_painting_is_read_with_a_warning():
    data = bytearray(apa(arches()))
    struct.pack_into("<H", data, len(MAGIC), VERSION + 1)
    drawings, warnings = read_apa(bytes(data))
    assert len(drawings) == len(arches())
    assert warnings[0].startswith(f"Version {VERSION + 1} of the .apa format is not known: read as")


def test_strokes_of_another_shape_are_named():
    with pytest.raises(StrokeError, match=r"Stroke 3 needs points of shape \(n, 3\), not \(4, 2\)"):
        api.as_stroke(3, np.zeros((4, 2)))
