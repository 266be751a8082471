# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames that are baked one by one: none is made twice, and none is taken for another."""

import json

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.playback.baked import BakedFrames
from liquid_splash_addon.core.playback.files import FILE, MANIFEST
from liquid_splash_addon.core.playback.playback import played
from liquid_splash_addon.core.playback.ply import ply_bytes


def liquid(number: int) -> Mesh:
    """Return a triangle that tells its number."""
    corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, number]])
    return Mesh(corners, np.int32([[0, 1, 2]]), 2 * corners)


class Maker:
    """Bakes lists of keys, and counts what it had to make."""

    def __init__(self, folder) -> None:
        self.folder, self.asked = folder, []

    def bake(self, keys: str) -> list[str]:
        """Bake a frame for each letter; return the letters that had to be made."""
        self.asked.clear()
        baked = BakedFrames(self.folder)
        for key in keys:
            baked.add(key, lambda key=key: self.make(key))
        assert baked.made == len(self.asked)
        return list(self.asked)

    def make(self, key: str) -> tuple[Mesh, None]:
        self.asked.append(key)
        if key == "!":
            raise ValueError("no liquid")
        return liquid(ord(key)), None

    def files(self) -> str:
        """Return the letters that are played."""
        known = {ply_bytes(liquid(number)): chr(number) for number in range(ord("a"), ord("z"))}
        count = played(self.folder)
        paths = [self.folder / FILE.format(number=number) for number in range(count)]
        return "".join(known[path.read_bytes()] for path in paths)


@pytest.fixture
def maker(tmp_path) -> Maker:
    return Maker(tmp_path)


def test_what_is_the_same_is_made_once(maker):
    assert maker.bake("aabba") == ["a", "b"] and maker.files() == "aabba"


def test_only_what_has_changed_is_made_again(maker):
    maker.bake("abcd")
    assert maker.bake("abxd") == ["x"] and maker.files() == "abxd"
    assert maker.bake("abxde") == ["e"] and maker.files() == "abxde"
    assert maker.bake("bab") == ["b", "a"] and maker.files() == "bab"


def test_after_a_stop_old_frames_are_no_longer_played_but_kept(maker):
    maker.bake("abcd")
    with pytest.raises(ValueError):
        maker.bake("a!")
    assert maker.files() == "a"
    assert maker.bake("abcd") == [] and maker.files() == "abcd"


def test_files_that_are_gone_or_of_a_simulation_are_made(maker):
    maker.bake("abc")
    (maker.folder / FILE.format(number=1)).unlink()
    assert maker.bake("abc") == ["b"]
    (maker.folder / MANIFEST).write_text(json.dumps({"key": "0123", "frames": 3, "left": 0.0}))
    assert maker.bake("abc") == ["a", "b", "c"]


def test_an_empty_mesh_is_a_file_too(tmp_path):
    empty = np.zeros((0, 3), dtype=np.float32)
    baked = BakedFrames(tmp_path)
    baked.add("nothing", lambda: (Mesh(empty, empty.astype(np.int32), empty), None))
    assert b"element vertex 0" in (tmp_path / FILE.format(number=0)).read_bytes()
