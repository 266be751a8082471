# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as users get it: built, installed, enabled, used."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = Path(__file__).with_name("installed_extension.py")
TIMEOUT = 300
"""Seconds for one process; a splash takes far less."""


def run(command: list[str | Path], folder: Path, **environment: str) -> str:
    """Run a command in ``folder`` with a user's settings of its own; return what it printed."""
    resources = folder / "resources"
    resources.mkdir(exist_ok=True)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(resources), **environment}
    result = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT,
    )
    assert result.returncode == 0, f"exit code {result.returncode} of {command}\n{result.stdout}"
    return result.stdout


@pytest.fixture(scope="module")
def extension(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the built zip."""
    folder = tmp_path_factory.mktemp("extension")
    # The module has no binary; build.py then uses the tool inside the module.
    binary = {"BLENDER": bpy.app.binary_path}
    run([sys.executable, ROOT / "build.py", "--output", folder], folder, **binary)
    (path,) = folder.glob("*.zip")
    return path


def test_zip_holds_the_addon_alone(extension: Path) -> None:
    names = zipfile.ZipFile(extension).namelist()
    top = {name.split("/")[0] for name in names}
    assert {"__init__.py", "blender_manifest.toml", "core", "blender", "weights"} <= top
    assert not top & {"training", "tests", "docs", "liquid_splash_addon"}
    assert not [name for name in names if "__pycache__" in name]


def test_installed_extension_makes_a_splash(extension: Path, tmp_path: Path) -> None:
    if bpy.app.module:
        printed = run([sys.executable, SCRIPT, extension], tmp_path)
    else:
        blender = bpy.app.binary_path
        install = ["--command", "extension", "install-file", "-r", "user_default", "-e"]
        run([blender, *install, extension], tmp_path)
        script = ["--python-exit-code", "1", "--python", SCRIPT, "--", extension]
        printed = run([blender, "--background", *script], tmp_path)
    assert "extension: works" in printed, printed
    assert "Traceback" not in printed, printed
