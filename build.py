# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the extension's zip in dist/, validated by Blender's own tool.

BLENDER names the Blender to use; without it, the tool inside the bpy module does the same.
"""

import argparse
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent
MANIFEST = ROOT / "blender_manifest.toml"


def stage(folder: Path) -> None:
    """Put the extension together: the add-on's code, its manifest, the licence and its wheels."""
    ignored = shutil.ignore_patterns("__pycache__", ".*")
    shutil.copytree(ROOT / "liquid_splash_addon", folder, ignore=ignored)
    shutil.copy(MANIFEST, folder)
    shutil.copy(ROOT / "LICENSE", folder)
    for wheel in tomllib.loads(MANIFEST.read_text())["wheels"]:
        (folder / wheel).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / wheel, folder / wheel)


def extension_tool() -> list[str | Path]:
    """Return the command that builds and validates extensions."""
    if blender := os.environ.get("BLENDER"):
        return [blender, "--command", "extension"]
    module = importlib.util.find_spec("bpy")
    if module is None or module.origin is None:
        raise SystemExit("Building needs BLENDER=/path/to/blender or the bpy module")
    scripts = Path(module.origin).parent.glob("*/scripts")
    return [sys.executable, next(scripts) / "addons_core/bl_pkg/cli/blender_ext.py"]


def run(*command: str | Path) -> None:
    """Run a command, and end with its exit code if it fails: it has said why."""
    code = subprocess.run(command).returncode
    if code != 0:
        raise SystemExit(code)


def build(output: Path) -> None:
    """Build the zips, one a platform where the wheels are several, and validate them."""
    tool = extension_tool()
    output.mkdir(parents=True, exist_ok=True)
    for path in output.glob("liquid_splash-*.zip"):
        path.unlink()
    several = ["--split-platforms"] if "platforms" in tomllib.loads(MANIFEST.read_text()) else []
    workspace = ROOT / "build"
    workspace.mkdir(exist_ok=True)
    # A folder of its own: nothing else of the checkout can end up in the zip.
    with tempfile.TemporaryDirectory(dir=workspace) as folder:
        staged = Path(folder) / "extension"
        stage(staged)
        run(*tool, "build", "--source-dir", staged, "--output-dir", output, *several)
    for path in output.glob("liquid_splash-*.zip"):
        # Building does not check everything that installing needs.
        run(*tool, "validate", path)


def main() -> None:
    """Build the extension where the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="folder for the zip")
    build(parser.parse_args().output.resolve())


if __name__ == "__main__":
    main()
