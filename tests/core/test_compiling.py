# SPDX-License-Identifier: GPL-3.0-or-later
"""No trouble with kept code ends a computation."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core import caching, config

from liquid_splash_addon.core import compiled_code
from liquid_splash_addon.core.compiled_code import VARIABLE
from liquid_splash_addon.core.compiling import njit

CORE = Path(compiled_code.__file__).parent
WHOLE, HALVES = np.arange(4), np.arange(4) / 2


def twice(x):
    """Return the sum of an array, doubled."""
    return 2 * x.sum()


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    """Have compiled code kept in a folder of the test's own."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled_code, "_note", "")
    return tmp_path


def compiled(*arrays):
    """Return how often ``twice`` was found and not found among kept code, for some arrays."""
    function = njit(cache=True)(twice)
    for values in arrays:
        assert function(values) == 2 * values.sum()
    return sum(function.stats.cache_hits.values()), sum(function.stats.cache_misses.values())


def files(folder: Path, ending: str) -> list[Path]:
    return sorted(folder.rglob(f"*.{ending}"))


def test_code_is_kept(folder):
    assert compiled(WHOLE, HALVES) == (0, 2)
    assert len(files(folder, "nbc")) == 2
    assert compiled(WHOLE, HALVES) == (2, 0)
    assert not compiled_code.note()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full disk at hand")
def test_a_full_disk_is_no_error(folder, monkeypatch):
    def open_full(path, mode="r"):
        return open("/dev/full" if "w" in mode else path, mode)

    monkeypatch.setattr(caching, "open", open_full, raising=False)
    assert compiled(WHOLE) == (0, 1)
    assert not files(folder, "nb?")
    assert compiled_code.note().startswith("Compiled code cannot be kept (No space left on device)")


def test_a_folder_that_is_none_is_no_error(folder, monkeypatch):
    (folder / "file").touch()
    monkeypatch.setattr(config, "CACHE_DIR", str(folder / "file"))
    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [caching.UserProvidedCacheLocator])
    assert compiled(WHOLE) == (0, 1)
    assert "cannot be kept" in compiled_code.note()


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("content", [b"", b"not a pickle", b"\x80\x04\x95"])
def test_damaged_files_are_made_anew(folder, ending, content):
    compiled(WHOLE)
    for path in files(folder, ending):
        path.write_bytes(content)
    assert compiled(WHOLE)[1] == 1
    compiled(WHOLE)  # where the index was damaged, it was emptied before
    assert compiled(WHOLE) == (1, 0)


def test_files_that_two_processes_mixed_up_are_not_run(folder):
    compiled(WHOLE, HALVES)
    first, second = files(folder, "nbc")
    whole, halves = first.read_bytes(), second.read_bytes()
    first.write_bytes(halves)
    second.write_bytes(whole)
    assert compiled(WHOLE, HALVES) == (0, 2)
    assert compiled(WHOLE, HALVES) == (2, 0)


def test_core_compiles_with_nothing_else():
    """Else a full disk would end a computation."""
    for path in CORE.rglob("*.py"):
        source = path.read_text(encoding="utf-8")
        names = {
            name
            for node in ast.walk(ast.parse(source))
            for name in (
                [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0
                else [alias.name for alias in node.names] if isinstance(node, ast.Import)
                else []
            )
        }  # fmt: skip
        is_it = path.name == "compiling.py"
        assert is_it or not any(re.match(r"numba\b", name or "") for name in names), path


WRITER = """
import sys; sys.path.insert(0, {root!r})
import numpy as np
from liquid_splash_addon.core.compiled_code import VARIABLE
from liquid_splash_addon.core.compiling import njit

@njit(cache=True)
def twice(x):
    return 2 * x.sum()

sys.stdin.read(1)  # all start at once
for kind in sys.argv[1:]:
    assert twice(np.arange(4).astype(kind) / 1) == 12
    assert twice(np.arange(4).astype(kind)) == 12
print(sum(twice.stats.cache_hits.values()), sum(twice.stats.cache_misses.values()))
"""


def test_several_processes_may_write_at_once(folder):
    """As compiling ahead and a splash do; all kinds of numbers, in other orders."""
    kinds = ["int8", "int16", "int32", "float32", "float64"]
    (folder / "writer.py").write_text(WRITER.format(root=str(CORE.parents[1])))
    command = [sys.executable, folder / "writer.py"]
    options = {
        "stdin": subprocess.PIPE,
        "stdout": subprocess.PIPE,
        "env": {**os.environ, "NUMBA_CACHE_DIR": str(folder)},
        "text": True,
    }
    writers = [
        subprocess.Popen([*command, *kinds[n:], *kinds[:n]], **options) for n in range(len(kinds))
    ]
    for writer in writers:
        writer.stdin.write("x")
        writer.stdin.flush()
    for writer in writers:
        writer.communicate()
        assert writer.returncode == 0
    for _ in range(2):  # what was mixed up is compiled once more
        last = subprocess.run([*command, *kinds], input="x", check=True, **{
            name: value for name, value in options.items() if name != "stdin"})  # fmt: skip
    assert last.stdout.split()[1] == "0"


SHARER = """
import sys; sys.path.insert(0, {root!r})
from pathlib import Path
import numpy as np
from liquid_splash_addon.core import compiled_code
{use}
from liquid_splash_addon.core.sketch.polyline import interpolated
interpolated(np.ones(1), np.arange(2.0), np.ones((2, 3)))
print(sum(interpolated.stats.cache_hits.values()), compiled_code.folder())
"""


def test_blender_finds_what_compiling_ahead_has_kept(tmp_path):
    """One process has the folder as the extension does, the other is told of it."""
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}

    def said(use: str, **more: str) -> list[str]:
        script = SHARER.format(root=str(CORE.parents[1]), use=use)
        command = [sys.executable, "-c", script]
        done = subprocess.run(
            command, env=environment | more, capture_output=True, text=True, check=True
        )
        return done.stdout.split()

    parent = f"compiled_code.keep_below(Path({str(tmp_path)!r}))"
    _, folder = said(parent)
    for path in list(Path(folder).iterdir()):
        shutil.rmtree(path)
    assert said(f"compiled_code.share({folder!r})", **{VARIABLE: folder}) == ["0", folder]
    assert said(parent) == ["1", folder]


CALLER = """
import sys; sys.path.insert(0, {root!r})
from liquid_splash_addon.core.compiled_code import VARIABLE
from liquid_splash_addon.core.compiling import njit
from .callee import inner

@njit(cache=True)
def outer(x):
    return inner(x) + 1

print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""

CALLEE = """
from liquid_splash_addon.core.compiled_code import VARIABLE
from liquid_splash_addon.core.compiling import njit

@njit(cache=True)
def inner(x):
    return {factor} * x
"""


def test_a_changed_callee_in_another_source_is_noticed(folder):
    package = folder / "package"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "caller.py").write_text(CALLER.format(root=str(CORE.parents[1])))

    def said(factor):
        (package / "callee.py").write_text(CALLEE.format(factor=factor))
        command = [sys.executable, "-B", "-m", "package.caller"]
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kept")}
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout.split()

    assert said(2) == ["3.0", "0"]
    assert said(2) == ["3.0", "1"]
    assert said(5) == ["6.0", "0"]
