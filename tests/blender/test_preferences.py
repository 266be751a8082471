# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences tell what is there, measure, free, clear and report."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from liquid_splash_addon.blender.data import preferences
from liquid_splash_addon.blender.jobs import (
    bug_report,
    compile_ahead,
    dependencies,
    loaded_generator,
    messages,
    work_queue,
)
from liquid_splash_addon.blender.ui import preferences_operators, preferences_panel
from liquid_splash_addon.core import compiled_code, packages
from tests.blender.drawing_panels import Recorder


@pytest.fixture(autouse=True)
def own(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Return preferences as Blender would give them to an installed extension."""
    stored = SimpleNamespace(
        weights_path="", device="AUTO", precision="AUTO", measured="", tested=""
    )
    for module in (preferences, preferences_operators, preferences_panel, bug_report):
        monkeypatch.setattr(module, "own_preferences", lambda _context: stored)
    monkeypatch.setattr(preferences_panel, "_read", None)
    return stored


def shown() -> str:
    """Return all that the preferences show now."""
    said: list[str] = []
    panel = SimpleNamespace(layout=Recorder(said))
    preferences.SPLASH_AP_preferences.draw(panel, bpy.context)
    return " ".join(said)


def test_what_is_installed_is_listed_with_its_version() -> None:
    said = shown()
    for module, name in packages.PACKAGES.items():
        assert f"{name} {packages.version_of(module)}" in said
    assert "older than tested" not in said, "OLDEST is newer than what the tests run with"
    for button in ("test_device", "clear_cache", "free_memory", "copy_report"):
        assert f"splash.{button}" in said


def test_what_is_missing_or_too_old_is_told_with_what_to_do(monkeypatch) -> None:
    monkeypatch.setitem(packages.PACKAGES, "nowhere_to_be_found", "its-package")
    monkeypatch.setitem(packages.OLDEST, "scipy", "99.1")
    said = shown()
    assert "its-package missing" in said
    assert "pip install" in said and "splash.copy_install_command" in said
    assert "older than tested: install 99.1 or later" in said


@pytest.mark.parametrize(
    ("version", "numbers"),
    [("2.13.0+cpu", (2, 13, 0)), ("2.14.1", (2, 14, 1)), ("3rc1", (3,)), ("odd", ())],
)
def test_versions_are_compared_by_their_numbers(version, numbers) -> None:
    assert packages.numbers_of(version) == numbers


def test_the_device_is_measured_in_every_format(own) -> None:
    own.device = "CPU"
    assert bpy.ops.splash.test_device() == {"FINISHED"}
    assert own.tested.startswith("cpu: ") and "float32" in own.tested and " ms" in own.tested
    assert own.tested in shown()


def test_the_fastest_format_comes_first_and_what_does_not_run_last() -> None:
    times = {"a": 0.2, "b": 0.0123, "c": float("inf")}
    assert preferences_operators.found_text("cpu", times) == "cpu: b 12 ms, a 200 ms; not there: c"


def test_automatic_is_the_device_of_the_preferences(own) -> None:
    own.device = "CPU"
    assert preferences.device_for(bpy.context, "AUTO") == "CPU"
    assert preferences.device_for(bpy.context, "CUDA") == "CUDA"


def test_memory_is_given_back_unless_it_is_in_use(monkeypatch) -> None:
    monkeypatch.setitem(loaded_generator._loaded, ("any", 0, "CPU", ""), object())
    monkeypatch.setattr(work_queue, "running", lambda: object())
    assert not bpy.ops.splash.free_memory.poll()
    monkeypatch.setattr(work_queue, "running", lambda: None)
    assert bpy.ops.splash.free_memory() == {"FINISHED"}
    assert not loaded_generator._loaded


def test_compiled_code_is_measured_and_cleared(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setattr(compiled_code, "_folder", tmp_path)
    (tmp_path / "core").mkdir()
    (tmp_path / "core" / "code.nbc").write_bytes(bytes(2_000_000))
    (tmp_path / "complete-1").touch()
    assert "Compiled code: 2 MB" in shown()
    monkeypatch.setattr(compile_ahead, "running", lambda: object())
    assert not bpy.ops.splash.clear_cache.poll()
    monkeypatch.setattr(compile_ahead, "running", lambda: None)
    assert bpy.ops.splash.clear_cache() == {"FINISHED"}
    assert list(tmp_path.iterdir()) == [] and compiled_code.size() == 0


def test_the_report_has_versions_device_and_last_error_but_not_the_users_folder() -> None:
    messages.sentence_for(ValueError(f"No such file: {Path.home() / 'sketch.csv'}"))
    said = bug_report.report(bpy.context)
    for text in (bpy.app.version_string, packages.version_of("torch"), "Last error: No such file"):
        assert text in said
    assert str(Path.home()) not in said and "~" in said
    # Without a window there is no clipboard to read back from.
    assert bpy.ops.splash.copy_report() == {"FINISHED"}


def test_without_packages_the_device_cannot_be_tested(monkeypatch) -> None:
    monkeypatch.setattr(dependencies, "missing_packages", lambda: ["torch"])
    assert not bpy.ops.splash.test_device.poll()
