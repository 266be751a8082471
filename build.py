# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the extension's zips in dist/, each validated by Blender's own tool.

    python build.py            the light zip, without wheels
    python build.py --all      that one, and one with all wheels for each platform and Python

BLENDER names the Blender to use; without it, the tool inside the bpy module does the same.
"""

import argparse
import re
import shutil
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

from scripts.extension.blender_tool import run
from scripts.extension.lock import Unavailable
from scripts.extension.notices import write_notices
from scripts.extension.targets import CUDA_TARGETS, TARGETS, Target
from scripts.extension.wheels import have, place

ROOT = Path(__file__).resolve().parent
MANIFEST = ROOT / "blender_manifest.toml"


def stage(folder: Path) -> None:
    """Put the extension together: the add-on's code, its manifest and the licence."""
    ignored = shutil.ignore_patterns("__pycache__", ".*")
    shutil.copytree(ROOT / "liquid_splash_addon", folder, ignore=ignored)
    shutil.copy(MANIFEST, folder)
    shutil.copy(ROOT / "LICENSE", folder)


def add_wheels(folder: Path, target: Target, wheels: Sequence[Path]) -> None:
    """Add a target's wheels and what is to be said of them."""
    (folder / "wheels").mkdir()
    for path in wheels:
        place(path, folder / "wheels")
    # NVIDIA's licence is not one for code under the GPL: such a zip is for oneself.
    write_notices(wheels, folder, is_for_others=not target.cuda)
    path = folder / MANIFEST.name
    text = manifest_for(path.read_text(encoding="utf-8"), target, [p.name for p in wheels])
    path.write_text(text, encoding="utf-8")


def manifest_for(text: str, target: Target, wheels: Sequence[str]) -> str:
    """Return the manifest with what depends on the platform and Python; the rest as it is."""
    listed = "".join(f'  "./wheels/{name}",\n' for name in sorted(wheels))
    lines = {
        "wheels": f"wheels = [\n{listed}]",
        "blender_version_min": (
            f'blender_version_min = "{target.python.first}"\n'
            f'blender_version_max = "{target.python.end}"\n'
            f'platforms = ["{target.platform.blender}"]'
        ),
    }
    for key, line in lines.items():
        text, count = re.subn(rf"^{key} = .*$", lambda _, line=line: line, text, flags=re.M)
        assert count == 1, f"{MANIFEST.name} must set {key} once, in one line"
    return text


def pack(path: Path, target: Target | None = None, wheels: Sequence[Path] = ()) -> None:
    """Build one zip and validate it; ``target`` None: the light one."""
    workspace = ROOT / "build"
    workspace.mkdir(exist_ok=True)
    # A folder of its own: nothing else of the checkout can end up in the zip.
    with tempfile.TemporaryDirectory(dir=workspace) as folder:
        staged = Path(folder) / "extension"
        stage(staged)
        if target:
            add_wheels(staged, target, wheels)
        run("build", "--source-dir", staged, "--output-filepath", path)
    # Building does not check everything that installing needs.
    run("validate", path)


def build(output: Path, targets: Sequence[Target], folder: Path | None = None) -> None:
    """Build the light zip, and those of ``targets`` whose wheels can be had."""
    output.mkdir(parents=True, exist_ok=True)
    for path in output.glob("liquid_splash-*.zip"):
        path.unlink()
    version = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]
    pack(output / f"liquid_splash-{version}.zip")
    for target in targets:
        try:
            path = output / f"liquid_splash-{version}-{target.name}.zip"
            pack(path, target, have(target, folder))
        except Unavailable as reason:
            print(f"Left out: {target.name}. {reason}", flush=True)


def chosen_targets(arguments: argparse.Namespace) -> list[Target]:
    """Return the zips with wheels that the command line asks for."""
    known = {target.name: target for target in [*TARGETS, *CUDA_TARGETS]}
    every = (CUDA_TARGETS if arguments.cuda else TARGETS) if arguments.all else []
    return [*every, *(known[name] for name in arguments.target)]


def main() -> None:
    """Build what the command line says, where it says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    names = [target.name for target in [*TARGETS, *CUDA_TARGETS]]
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="folder for the zips")
    parser.add_argument("--all", action="store_true", help="also the zips with wheels")
    parser.add_argument("--cuda", action="store_true", help="with --all: wheels for NVIDIA GPUs")
    parser.add_argument("--target", action="append", default=[], choices=names, metavar="NAME",
                        help=f"also this zip with wheels: {', '.join(names)}")  # fmt: skip
    parser.add_argument("--wheels", type=Path, help="folder with wheels to use first")
    arguments = parser.parse_args()
    build(arguments.output.resolve(), chosen_targets(arguments), arguments.wheels)


if __name__ == "__main__":
    main()
