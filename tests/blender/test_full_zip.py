# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip with wheels, in a Blender that has nothing else and no network."""

import sys
from pathlib import Path

import bpy
import pytest

from tests.blender.bare_python import bare_python, without_network
from tests.blender.test_extension import ROOT, run, use

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="the zips of other platforms run there"),
    pytest.mark.skipif(not bpy.app.module, reason="a Blender program has a Python of its own"),
]
TARGET = f"linux-x64-py{sys.version_info.major}{sys.version_info.minor}"


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the zip for this Blender."""
    folder = tmp_path_factory.mktemp("full")
    said = run([sys.executable, ROOT / "build.py", "--output", folder, "--target", TARGET], folder)
    found = list(folder.glob(f"*-{TARGET}.zip"))
    return found[0] if found else pytest.skip(said)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a Python that has Blender's module alone."""
    python = bare_python(tmp_path_factory.mktemp("bare"))
    missing = (
        "import importlib.util as u; print(*map(u.find_spec, 'torch skimage scipy numba'.split()))"
    )
    assert run([python, "-c", missing], python.parent) == "None None None None\n"
    return python


@pytest.mark.parametrize("way", ["disk", "repository"])
def test_it_needs_nothing_but_blender(way: str, full: Path, bare: Path, tmp_path: Path) -> None:
    from scripts.extension.repository import write_repository

    if not without_network():
        pytest.skip("this system cannot cut the network for one process")
    if way == "disk":
        printed = use("everything", full, tmp_path, bare)
        assert f"of {tmp_path}" in printed, "torch came from elsewhere"
    else:
        write_repository(tmp_path / "repository", [full])
        use("enable", (tmp_path / "repository" / "index.json").as_uri(), tmp_path, bare)
