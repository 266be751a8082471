# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiling ahead: what it leaves is found, and it stays out of the way."""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread
from types import SimpleNamespace

import bpy
import pytest

from liquid_splash_addon.blender.jobs import child_process, compile_ahead
from liquid_splash_addon.blender.ui.panels import SPLASH_PT_main
from liquid_splash_addon.core import compiled_code
from tests.blender.test_extension import ROOT, extension  # noqa: F401 (a fixture)
from tests.blender.test_panels import drawn
from tests.blender.test_window import pytestmark as needs_window
from tests.blender.test_window import screen  # noqa: F401 (a fixture)

SCRIPT = Path(__file__).with_name("compiled_ahead.py")
PLAIN, INSTALLED = "liquid_splash_addon", "bl_ext.user_default.liquid_splash"

SMALL = {
    "compiled_code.py": "note = str\ndef share(folder): pass",
    "rehearsal.py": (
        "from numba import njit\n"
        "@njit(cache=True)\n"
        "def inner(x): return x + 1\n"
        "@njit(cache=True)\n"
        "def outer(x): return 2 * inner(x)\n"
        "def rehearse(report, reached=None):\n"
        "    report('Compiling', 0.5)\n"
        "    outer(1)\n"
    ),
}
"""The core of a package with little to compile."""

USE_SMALL = """
import sys, types
sys.path.insert(0, {parent!r})
sys.modules["bl_ext"] = types.ModuleType("bl_ext"); sys.modules["bl_ext"].__path__ = [{parent!r}]
from bl_ext.repository.small.core.rehearsal import outer, rehearse
rehearse(lambda *_: None)
print(dict(outer.stats.cache_hits), dict(outer.stats.cache_misses))
"""


@pytest.fixture
def small(tmp_path, monkeypatch) -> Path:
    """Have a small package compiled in place of the add-on; return where it is."""
    folder = tmp_path / "repository" / "small"
    (folder / "core").mkdir(parents=True)
    (folder / "__init__.py").write_text("import bpy, nowhere_to_be_found")
    for name, content in SMALL.items():
        (folder / "core" / name).write_text(content)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.setattr(child_process, "ADDON", "bl_ext.repository.small")
    monkeypatch.setattr(child_process, "addon_folder", lambda: str(folder))
    monkeypatch.setattr(compile_ahead, "_ahead", None)
    monkeypatch.setattr(compiled_code, "_folder", tmp_path)
    monkeypatch.setattr(compiled_code, "_note", "")
    yield folder
    if compile_ahead._ahead is not None:
        compile_ahead._ahead.stop()


def rehearsal(folder: Path, *lines: str) -> None:
    """Have a rehearsal do something else."""
    body = "".join(f"    {line}\n" for line in lines)
    (folder / "core" / "rehearsal.py").write_text(f"def rehearse(report, reached):\n{body}")


def wait_until(is_so, seconds: float = 600.0) -> None:
    """Wait for something that is to come true."""
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_what_it_compiles_is_found_under_the_names_that_blender_has(small, tmp_path):
    ahead = compile_ahead.start()
    ahead.wait(120)
    assert ahead.is_done and not compile_ahead.note() and ahead.share == 0.5
    assert compiled_code.is_complete()
    (small / "__init__.py").write_text("")
    script = USE_SMALL.format(parent=str(tmp_path))
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stdout == "{(int64,): 1} {}\n", done.stdout + done.stderr


def test_where_code_is_kept_is_told_and_what_is_reached_is_noted(small, tmp_path):
    (small / "core" / "compiled_code.py").write_text("note = str\nshare = print")
    rehearsal(small, "reached('first')", "report('Kept', 0.3)")
    assert not compiled_code.has_reached("first")
    ahead = compile_ahead.start()
    ahead.wait(120)
    assert ahead.last == str(tmp_path) and ahead.code == 0, ahead.failed
    compiled_code.marker(tmp_path).unlink()
    assert compiled_code.has_reached("first") and not compiled_code.has_reached("refined")


@pytest.mark.skipif(not hasattr(os, "nice"), reason="Windows has classes of priority instead")
@pytest.mark.parametrize("is_awaited", [True, False])
def test_what_nobody_waits_for_any_more_lets_all_else_go_first(small, is_awaited):
    if not is_awaited:
        compiled_code.note_reached(compiled_code.REFINED)
    rehearsal(small, "import os", "report(str(os.nice(0)), 0.5)", "reached('refined')",
              "report(str(os.nice(0)), 0.6)")  # fmt: skip
    heard = []
    ahead = compile_ahead.start()
    hear = ahead.hear
    ahead.hear = lambda said: (heard.append(said.get("stage")), hear(said))
    assert (ahead._helper is not None) == (is_awaited and (os.cpu_count() or 1) > 1)
    ahead.wait(120)
    ours = os.nice(0)
    later = min(ours + 10, 19)
    assert [stage for stage in heard if stage] == [str(ours if is_awaited else later), str(later)]


def test_a_job_waits_for_what_it_needs_and_for_nothing_else(small, tmp_path):
    said = []
    report = lambda *what: said.append(what)  # noqa: E731
    assert compile_ahead.wait_for("first", report) is report and not said, "nothing runs"
    go = tmp_path / "go"
    rehearsal(
        small, "import os, time", "report('Some', 0.11)",
        f"while not os.path.exists({str(go)!r}): time.sleep(0.01)", "reached('first')",
        "time.sleep(600)",
    )  # fmt: skip
    ahead = compile_ahead.start()
    waiting = Thread(target=lambda: compile_ahead.wait_for("first", report)("After", 0.5))
    waiting.start()
    wait_until(lambda: said and said[-1][1] == 0.4)
    assert waiting.is_alive() and said[-1][0] == compile_ahead.PREPARING
    go.touch()
    waiting.join(60)
    assert said[-1] == ("After", 0.9) and ahead is compile_ahead.running()
    ahead.stop()
    assert compile_ahead.wait_for("refined", report) is report


def test_the_tab_shows_how_far_it_is(small):
    said = drawn(SPLASH_PT_main)
    assert "Preparing" not in said and compile_ahead._ahead is None, "none without a window"
    rehearsal(small, "import time", "report('Long', 0.25)", "time.sleep(600)")
    ahead = compile_ahead.start()
    assert compile_ahead.start() is ahead is compile_ahead.running()
    assert "Preparing (first time only)" in drawn(SPLASH_PT_main)
    wait_until(lambda: ahead.share == 0.25)
    ahead.stop()
    assert compile_ahead.running() is None and not compile_ahead.note()
    assert "Preparing" not in drawn(SPLASH_PT_main) and not compiled_code.is_complete()


def test_a_failure_is_told_and_tried_again_another_time(small):
    rehearsal(small, "raise MemoryError('no more')")
    compile_ahead.start().wait(60)
    assert "Preparing the first splash failed" in drawn(SPLASH_PT_main)
    assert "failed (MemoryError: no more): it will take longer" in compile_ahead.note()
    assert not compiled_code.is_complete()


def test_what_libraries_print_does_no_harm_and_a_crash_is_told(small):
    rehearsal(
        small, "import os", "print('[1]', flush=True)", "print('oh', flush=True)", "os._exit(3)"
    )
    compile_ahead.start().wait(60)
    assert "failed (oh)" in compile_ahead.note()


def test_it_ends_when_blender_ends_in_any_way(small, tmp_path):
    """Its input ends with the process that holds the other end."""
    write = f"open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))"
    rehearsal(small, "import os, time", write, "time.sleep(600)")
    ahead = compile_ahead.start()
    pid = tmp_path / "pid"
    wait_until(lambda: pid.exists() and pid.read_text())
    ahead._process.stdin.close()
    ahead.wait(30)
    assert ahead.is_done and ahead._process.returncode == 1


def test_it_is_asked_for_once_and_started_where_there_is_something_to_do(small, monkeypatch):
    started = []
    registered = []
    timers = SimpleNamespace(
        is_registered=lambda function: False,
        register=lambda function, **options: registered.append(function),
    )
    window = SimpleNamespace(background=False, timers=timers)
    monkeypatch.setattr(compile_ahead, "bpy", SimpleNamespace(app=window))
    monkeypatch.setattr(compile_ahead, "_is_asked", False)
    monkeypatch.setattr(compile_ahead, "start", lambda: started.append(1))
    compile_ahead.ask()
    compile_ahead.ask()
    assert registered == [compile_ahead._tick] and not started
    assert registered[0]() is None and started == [1]
    compiled_code.marker(compiled_code.folder()).touch()
    assert compile_ahead._tick() is None and started == [1]


def blender(folder: Path, *arguments: str | Path, **environment: str) -> dict[str, object]:
    """Run the script in a Blender with settings of its own; return what it found."""
    (folder / "resources").mkdir(exist_ok=True)
    environment = {"BLENDER_USER_RESOURCES": str(folder / "resources"), **environment}
    command = [sys.executable, SCRIPT]
    if not bpy.app.module:
        command = [bpy.app.binary_path, "-b", "--python-exit-code", "1", "--python", SCRIPT]
    done = subprocess.run(
        [*command, "--", *arguments],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=1800,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("found: "))
    return json.loads(line.removeprefix("found: "))


@pytest.mark.slow
def test_nothing_is_left_to_compile_in_the_checkout(tmp_path):
    kept = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    prepared = blender(tmp_path, "prepare", PLAIN, **kept)
    assert prepared["share"] == 1.0 and not prepared["note"], prepared
    used = blender(tmp_path, "use", PLAIN, **kept)
    print(prepared, used)
    assert used["missed"] == {}


def install(path: Path, folder: Path) -> dict[str, str]:
    """Install the extension for a Blender program with settings in ``folder``; return those."""
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "resources")}
    (folder / "resources").mkdir()
    options = ["--command", "extension", "install-file", "-r", "user_default", "-e"]
    command = [bpy.app.binary_path, *options, path]
    subprocess.run(command, env=environment, check=True, timeout=900)
    return environment


@pytest.mark.slow
def test_nothing_is_left_to_compile_for_the_installed_extension(extension, tmp_path):  # noqa: F811
    if not bpy.app.module:
        install(extension, tmp_path)
    prepared = blender(tmp_path, "prepare", INSTALLED, extension)
    assert prepared["complete"] and prepared["share"] == 1.0 and not prepared["note"], prepared
    assert Path(prepared["folder"]).is_relative_to(tmp_path / "resources")
    used = blender(tmp_path, "use", INSTALLED, extension)
    print(prepared, used)
    assert used["missed"] == {}


@needs_window
def test_the_first_look_at_the_tab_starts_it_and_quitting_ends_it(
    extension,  # noqa: F811
    screen,  # noqa: F811
    tmp_path,
):
    environment = install(extension, tmp_path) | {"DISPLAY": screen, "LIBGL_ALWAYS_SOFTWARE": "1"}
    environment.pop("WAYLAND_DISPLAY", None)
    command = [bpy.app.binary_path, "--gpu-backend", "opengl", "--window-geometry", "0", "0"]
    done = subprocess.run(
        [*command, "800", "600", "--python", SCRIPT.with_name("compile_ahead_window.py")],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=900,
    )
    found = re.search(r"window: works, pid (\d+), note ''", done.stdout)
    assert found and "Traceback" not in done.stdout, done.stdout
    with pytest.raises(ProcessLookupError):
        os.kill(int(found[1]), 0)
