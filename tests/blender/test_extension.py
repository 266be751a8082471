# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as users get it: built, installed, enabled, used."""

import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from tests.blender.bare_python import without_network

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = Path(__file__).with_name("installed_extension.py")
TIMEOUT = 600
"""Seconds for one process; a splash takes far less."""


def slow_under_the_module(test: Callable[..., None]) -> Callable[..., None]:
    """Mark a test that compiles everything: under the module the full zip's do that too."""
    return pytest.mark.slow(test) if bpy.app.module else test


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


def use(mode: str, source: str | Path, folder: Path, python: str | Path = sys.executable) -> str:
    """Install the extension without network and use it, see installed_extension.py.

    Returns what was printed.
    """
    cut = without_network()
    if bpy.app.module:
        printed = run([*cut, python, SCRIPT, mode, source], folder)
    else:
        blender = [*cut, bpy.app.binary_path]
        # Blender asks for online mode even where the repository is a folder.
        online = ["--online-mode"] if "://" in str(source) else []
        for command in install_commands(str(source)):
            run([*blender, *online, "--command", "extension", *command], folder)
        script = ["--python-exit-code", "1", "--python", SCRIPT, "--", mode, source]
        printed = run([*blender, "--background", *script], folder)
    assert "extension: works" in printed, printed
    assert "Traceback" not in printed, printed
    return printed


def install_commands(source: str) -> list[list[str]]:
    """Return what to tell Blender's command line, to install from disk or a repository."""
    if "://" not in source:
        return [["install-file", "-r", "user_default", "-e", source]]
    add = ["repo-add", "--name", "Splashes", "--url", source, "splashes"]
    return [add, ["sync"], ["install", "--enable", "splashes.liquid_splash"]]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the home of a user whose name has spaces and Cyrillic letters."""
    folder = tmp_path / "Иван Петров, Ёлкин"
    folder.mkdir()
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(folder))
    return folder


@slow_under_the_module
def test_installed_extension_makes_a_splash(extension: Path, home: Path) -> None:
    use("splash", extension, home)


@pytest.mark.skipif(sys.platform == "win32", reason="folders are made read-only as Unix does")
def test_a_user_folder_that_cannot_be_written(extension: Path, home: Path) -> None:
    """It is enabled all the same; compiled code goes to a temporary folder, and that is said."""
    use("enable", extension, home)
    resources = home / "resources"
    for path in [*resources.rglob("*"), resources]:
        path.chmod(path.stat().st_mode & ~0o222)
    try:
        options = ["--background", "--python-exit-code", "1", "--python"]
        program = [sys.executable] if bpy.app.module else [bpy.app.binary_path, *options]
        command = [*program, SCRIPT.with_name("read_only_user.py")]
        printed = subprocess.run(
            [*without_power(), *command], cwd=home, capture_output=True, text=True,
            env={**os.environ, "BLENDER_USER_RESOURCES": str(resources)}, timeout=TIMEOUT,
        )  # fmt: skip
    finally:
        for path in [resources, *resources.rglob("*")]:
            path.chmod(path.stat().st_mode | 0o200)
    assert "read-only: works" in printed.stdout, printed.stdout + printed.stderr
    assert "Traceback" not in printed.stdout + printed.stderr


def without_power() -> list[str]:
    """Return what to put before a command so that root, too, may not write everywhere."""
    if os.geteuid() != 0:
        return []
    dropped = "-dac_override,-dac_read_search,-fowner"
    return ["setpriv", f"--bounding-set={dropped}", f"--inh-caps={dropped}"]


def test_blender_subscribes_to_a_repository_and_installs_from_it(
    extension: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from scripts.extension.repository import write_repository

    monkeypatch.setenv("BLENDER", bpy.app.binary_path)  # empty: the module's own tool
    folder = tmp_path / "a repository"
    write_repository(folder, [extension])
    (entry,) = json.loads((folder / "index.json").read_text())["data"]
    assert entry["archive_url"] == f"./{extension.name}"
    assert entry["permissions"].keys() == {"files", "clipboard"}
    use("enable", (folder / "index.json").as_uri(), tmp_path)
