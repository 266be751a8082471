# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn a checkpoint into the add-on's weights: float16, with calibrated thresholds.

python -m training export RUN --data DATA
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from liquid_splash_addon.core.generator.generator import Generator
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.generator.patch_classifier import bundled_patch_classifier
from liquid_splash_addon.core.generator.splash_unet import NetworkConfig, SplashNetwork
from liquid_splash_addon.core.generator.weights_file import default_weights_path, save_weights
from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING, Grid

from ..command_line import command_parser
from ..data.batch import VELOCITY_SCALE
from ..data.items import Item, choose, load_items, scenes_digest
from ..data.samples import held_out_sample
from .thresholds import best_threshold

EXPORT_THRESHOLDS = np.linspace(0.2, 0.5, 16)
"""Tried as occupancy from which on a cell is liquid. Not above even odds: sheets would lose liquid
for hardly any IoU."""


def load_average(run: Path) -> tuple[SplashNetwork, dict[str, Any]]:
    """Return the averaged network of a run and its checkpoint.

    Raises FileNotFoundError where there is none, ValueError where it is another model's.
    """
    state = torch.load(run / "checkpoint.pt", weights_only=True, map_location="cpu")
    if state.get("kind") != "splash":
        raise ValueError(f"{run} holds the paper's model, which the add-on cannot use")
    network = SplashNetwork(NetworkConfig(**state["learner"]["shape"]))
    network.load_state_dict(state["learner"]["average"])
    return network.eval(), state


def average_with(network: SplashNetwork, other: SplashNetwork) -> None:
    """Move the weights of ``network`` half way to those of another of its shape.

    Raises ValueError where the shapes differ.
    """
    if network.config != other.config:
        raise ValueError(f"the weights to take the mean with have another shape: {other.config}")
    with torch.no_grad():
        for mine, theirs in zip(network.parameters(), other.parameters(), strict=True):
            mine.lerp_(theirs, 0.5)


def scale_latents(network: SplashNetwork, factor: float) -> None:
    """Make the networks answer to a latent as they did to one ``factor`` times as large.

    A network that is trained on the best of several latents learns too wide a choice; by how much
    splashes of one sketch differ is known from twins.
    """
    with torch.no_grad():
        for parameter in network.coarse.modulations.parameters():
            parameter.mul_(factor)


def sketch_statistics(items: Sequence[Item]) -> dict[str, float]:
    """Return the median longest side (m) of the training sketches and their fastest speed (m/s).

    The fastest is the 99.9th percentile: single points of spray are faster.
    """
    sides, speeds = [], []
    for item in items:
        sample, strokes = held_out_sample(item, 64)
        cells = np.argwhere(sample.condition.drawn)
        sides.append((np.ptp(cells, axis=0).max() + 1) * Grid.local(64).spacing)
        speeds.append(np.concatenate([np.linalg.norm(s.velocities, axis=1) for s in strokes]))
    return {
        "real_size": float(np.median(sides)),
        "fastest": float(np.quantile(np.concatenate(speeds), 0.999)),
    }


def read_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options."""
    parser = command_parser("export", __doc__)
    parser.add_argument("run", type=Path, help="directory of the training run")
    parser.add_argument("--data", type=Path, required=True, help="directory of the data set")
    parser.add_argument("--out", type=Path, default=default_weights_path(), help="weights file")
    parser.add_argument(
        "--mean-with", type=Path, metavar="WEIGHTS",
        help="take the mean of the run and these weights, from which it began: halves what it "
        "memorised of few scenes (Wortsman et al. 2022)",
    )  # fmt: skip
    parser.add_argument(
        "--latent-scale", type=float, default=1.0,
        help="factor on what latents do, so that seeds differ as twins do (command evaluate)",
    )  # fmt: skip
    parser.add_argument("--figures", type=Path, help="JSON of the command evaluate, for the header")
    parser.add_argument("--most", type=int, default=40, help="validation frames at the most")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    args = read_arguments(arguments)
    try:
        network, state = load_average(args.run)
        if args.mean_with:
            average_with(network, load_generator(args.mean_with, "CPU").network)
        scale_latents(network, args.latent_scale)
        training = load_items(args.data, "train")
        validation = choose(load_items(args.data, "validation"), args.most)
    except (OSError, ValueError) as error:
        print(f"{error}: run `python -m training train` first, with the same data", file=sys.stderr)
        return 1
    header = describe_run(args, state, training)
    header["thresholds"] = calibrated_thresholds(network, header, validation)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    save_weights(network, header, args.out)
    print(f"{args.out}: thresholds {header['thresholds']}, real size {header['real_size']:.3f} m, "
          f"fastest {header['fastest']:.2f} m/s")  # fmt: skip
    return 0


def describe_run(
    args: argparse.Namespace, state: dict[str, Any], training: Sequence[Item]
) -> dict[str, Any]:
    """Return the header of the weights; its thresholds are not calibrated yet."""
    return {
        "local_cells": LOCAL_CELLS,
        "local_spacing": LOCAL_SPACING,
        "velocity_scale": VELOCITY_SCALE,
        "thresholds": {"draft": 0.5, "detail": 0.5},
        "data_hash": scenes_digest(training).hexdigest(),
        "patch_classifier_hash": bundled_patch_classifier().weights_hash,
        "steps": state["steps"],
        "minutes": round(state["seconds"] / 60, 1),
        "training": state["training"],
        "latent_scale": args.latent_scale,
        "mean": bool(args.mean_with),
        **sketch_statistics(choose(training, 200)),
        "figures": json.loads(args.figures.read_text()) if args.figures else {},
    }


def calibrated_thresholds(
    network: SplashNetwork, header: dict[str, Any], validation: Sequence[Item]
) -> dict[str, float]:
    """Return the occupancies from which on cells of a draft, and of a full result, are liquid."""
    generator = Generator(network, header, "", "cpu")
    grids = {"draft": header["training"]["cells"], "detail": LOCAL_CELLS}
    return {
        name: best_threshold(generator, validation, cells, EXPORT_THRESHOLDS)
        for name, cells in grids.items()
    }
