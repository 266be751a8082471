# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of a data set: its scenes' files, and which of them are for training or for tests."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..scenes.bodies import Body, load_body
from .frames import SCENE_PREFIX, StoredFrame, load_frame, load_parameters, seed_of

SPLITS = ("train", "validation", "test")

HELD_OUT = 10
"""One scene in so many is for validation, and one for tests."""


@dataclass(frozen=True)
class Item:
    """One frame of the data set.

    Attributes
    ----------
    scene : its file
    number : the frame's number in it
    time : seconds since impact
    spacing : edge of the stored cells, metres
    obstacle : the scene's solid, in metres from the corner of the simulation's box
    """

    scene: Path
    number: int
    time: float
    spacing: float
    obstacle: Body = field(compare=False, repr=False)

    @property
    def seed(self) -> int:
        """Seed of the scene."""
        return seed_of(self.scene)

    def load(self) -> StoredFrame:
        """Read the frame."""
        return load_frame(self.scene, self.number)


def split_of(seed: int) -> str:
    """'train', 'validation' or 'test' for the scene with this seed, which alone decides it."""
    digit = hashlib.sha256(str(seed).encode()).digest()[0] % HELD_OUT
    return {0: "test", 1: "validation"}.get(digit, "train")


def load_items(data: Path, split: str) -> list[Item]:
    """Return the frames of one split, by scene and time; ValueError if there are none."""
    items = list_items(data, split)
    if not items:
        raise ValueError(
            f"no {split} frames in {data}: run `python -m training simulate` with more scenes"
        )
    return items


def list_items(data: Path, split: str) -> list[Item]:
    """Return the frames of one split, by scene and time."""
    items = []
    for scene in sorted(data.glob(f"{SCENE_PREFIX}*.npz")):
        if split_of(seed_of(scene)) == split:
            parameters = load_parameters(scene)
            obstacle = load_body(parameters["obstacle"])
            for number, time in enumerate(parameters["times"]):
                items.append(Item(scene, number, time, parameters["stored_spacing"], obstacle))
    return items


def choose(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most ``most`` of the items, evenly spread over scenes and times."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[i] for i in places]


def scenes_digest(items: Sequence[Item]) -> hashlib._Hash:
    """SHA-256 of the names and contents of the scene files that the items come from."""
    digest = hashlib.sha256()
    for path in sorted({item.scene for item in items}):
        digest.update(path.name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest
