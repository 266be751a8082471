# SPDX-License-Identifier: GPL-3.0-or-later
"""The zips that contain wheels: for which platform, which Python and so which Blenders."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import NamedTuple

from liquid_splash_addon.core.packages import PACKAGES

ROOT = Path(__file__).resolve().parents[2]
LOCKS = Path(__file__).with_name("locks")
PINS = ROOT / "requirements.txt"


class Platform(NamedTuple):
    """A platform: its name in Blender, in uv, and the tags of wheels that fit, the best first."""

    blender: str
    uv: str
    tags: tuple[str, ...]


class BlenderPython(NamedTuple):
    """A Python, the Blenders with it (``first`` to before ``end``) and their NumPy."""

    version: str
    first: str
    end: str
    numpy: str


PLATFORMS = (
    # Blender 4.5 needs glibc 2.28.
    Platform(
        "linux-x64",
        "x86_64-manylinux_2_28",
        (*(f"manylinux_2_{n}_x86_64" for n in range(28, 4, -1)), "manylinux2014_x86_64"),
    ),
    Platform("windows-x64", "x86_64-pc-windows-msvc", ("win_amd64",)),
    # torch's own minimum; Blender itself starts on macOS 11.
    Platform("macos-arm64", "aarch64-apple-darwin", ("macosx_14_0_arm64",)),
)

PYTHONS = (
    BlenderPython("3.11", "4.5.0", "5.1.0", "==1.26.4"),
    BlenderPython("3.13", "5.1.0", "5.3.0", ">=2.2,<3"),
)

CUDA_PLATFORMS = ("linux-x64", "windows-x64")

LEFT_OUT = {
    # Blender's own, which nothing may shadow. What the wheels ask of it is checked all the same.
    "numpy": "Blender's own",
    # What torch declares and only imports to compile, to download or to write in parallel.
    "filelock": "torch.hub and torch.compile",
    "fsspec": "distributed checkpoints",
    "jinja2": "torch.compile",
    "markupsafe": "jinja2",
    "networkx": "torch.compile, and graphs of scikit-image",
    "setuptools": "C++ extensions of torch",
    # What scikit-image declares and only imports to read and write images.
    "imageio": "image files",
    "packaging": "checks of optional packages",
    "pillow": "image files",
    "tifffile": "image files",
}
"""Packages that are declared but not imported by what the add-on does; and by what they would be.

test_wheels.py runs the add-on without them.
"""


class Target(NamedTuple):
    """One zip with wheels."""

    platform: Platform
    python: BlenderPython
    cuda: bool = False

    @property
    def name(self) -> str:
        """Return the name, as in the zip's file name."""
        tail = "-cuda" if self.cuda else ""
        return f"{self.platform.blender}-py{self.python.version.replace('.', '')}{tail}"

    @property
    def lock(self) -> Path:
        """Return the file that lists its wheels."""
        return LOCKS / f"{self.name}.txt"

    @property
    def pip_options(self) -> list[str]:
        """Return what makes pip choose wheels for it, whatever machine this is."""
        abi = f"cp{self.python.version.replace('.', '')}"
        pairs = [("--platform", tag) for tag in self.platform.tags]
        pairs += [("--abi", name) for name in (abi, "abi3", "none")]
        pairs += [("--implementation", "cp"), ("--python-version", self.python.version)]
        return ["--only-binary=:all:", "--no-deps", *itertools.chain.from_iterable(pairs)]

    @property
    def torch(self) -> str:
        """Return which build of torch it contains, as a requirement.

        On Linux the package index's own build is the one for CUDA, on Windows the one for CPUs.
        The others are on PyTorch's index, under a local version.
        """
        version = pinned()["torch"]
        if self.platform.blender == "linux-x64" and not self.cuda:
            return f"torch=={version}+cpu"
        if self.platform.blender == "windows-x64" and self.cuda:
            return f"torch=={version}+cu130"
        return f"torch==={version}"


def pinned() -> dict[str, str]:
    """Return the versions that the project is tested with, by package."""
    lines = PINS.read_text(encoding="utf-8").splitlines()
    return {m[1]: m[2] for line in lines if (m := re.match(r"([\w.-]+)==(\S+)", line))}


def roots(target: Target) -> list[str]:
    """Return what the add-on imports, as requirements; all else follows from it."""
    others = [name for name in PACKAGES.values() if name != "torch"]
    return [target.torch, *others, f"numpy{target.python.numpy}"]


TARGETS = [Target(platform, python) for python in PYTHONS for platform in PLATFORMS]
CUDA_TARGETS = [
    Target(platform, python, cuda=True)
    for python in PYTHONS
    for platform in PLATFORMS
    if platform.blender in CUDA_PLATFORMS
]
