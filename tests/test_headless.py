# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip alone, in a Python that has no Blender: interface and command line."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from liquid_splash_addon import api
from liquid_splash_addon.core.packages import PACKAGES
from tests.blender.bare_python import bare_python
from tests.test_commands_in_docs import ROOT, blocks, commands_of

PAGE = ROOT / "docs" / "api.md"


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder above the light zip's content."""
    folder = tmp_path_factory.mktemp("zip")
    done = subprocess.run(
        [sys.executable, ROOT / "build.py", "--output", folder], capture_output=True, text=True
    )
    if done.returncode != 0 and "No module named 'bpy'" in done.stderr:
        pytest.skip("Blender's tool packs the zip, and there is none here")
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(next(folder.glob("*.zip"))) as archive:
        archive.extractall(folder / "here" / "liquid_splash_addon")
    return folder / "here"


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a Python that has what the page asks for, and no Blender."""
    found = bare_python(tmp_path_factory.mktemp("python"), ("numpy", *PACKAGES.values()))
    has = "import importlib.util as u; print(*(u.find_spec(n) is None for n in ('bpy', 'torch')))"
    done = subprocess.run([found, "-c", has], cwd=found.parent, capture_output=True, text=True)
    assert done.stdout == "True False\n"
    return found


def run(python: Path, unpacked: Path, folder: Path, *arguments: str) -> str:
    """Run Python in ``folder`` and return what it said, errors last."""
    environment = {**os.environ, "PYTHONPATH": str(unpacked)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [python, *arguments], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_interface_and_command_line_are_there(python, unpacked, tmp_path) -> None:
    where = "from liquid_splash_addon import api; print(api.__file__, api.__version__)"
    said = run(python, unpacked, tmp_path, "-c", where)
    assert said == f"{unpacked / 'liquid_splash_addon' / 'api.py'} {api.__version__}\n"
    said = run(python, unpacked, tmp_path, "-m", "liquid_splash_addon", "--list-refinements")
    assert said.startswith("FRESH ")


@pytest.mark.slow
def test_the_five_lines_and_the_command_of_the_page_make_splashes(
    python, unpacked, tmp_path
) -> None:
    script = blocks(PAGE, "python")[0]
    assert len([line for line in script.splitlines() if line]) == 5
    run(python, unpacked, tmp_path, "-c", script)
    first = (tmp_path / "splash.ply").read_bytes()
    assert first.startswith(b"ply\nformat binary_little_endian") and len(first) > 100_000

    api.write_strokes(tmp_path / "strokes.csv", api.preset_sketch("WAVE"))
    line = next(line for block in blocks(PAGE, "") for line in commands_of(block))
    program, *arguments = line.split()
    assert program == "python" and "--seeds 8" in line
    run(python, unpacked, tmp_path, *arguments)
    sizes = [(tmp_path / f"splash_{seed}.ply").stat().st_size for seed in range(8)]
    assert min(sizes) > 100_000 and len(set(sizes)) == 8


@pytest.mark.slow
def test_every_script_of_the_page_runs(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    for script in blocks(PAGE, "python"):
        exec(compile(script, PAGE.name, "exec"), {})
    assert "(3,)" not in capsys.readouterr().out
    assert np.fromfile(tmp_path / "splash.ply", dtype="u1", count=3).tobytes() == b"ply"
