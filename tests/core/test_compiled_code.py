# SPDX-License-Identifier: GPL-3.0-or-later
"""Where compiled code is kept, and what is done where that cannot be written."""

import os
import shutil
import tempfile
from pathlib import Path

import pytest

from liquid_splash_addon.core import compiled_code
from liquid_splash_addon.core.compiled_code import VARIABLE, keep_below


@pytest.fixture(autouse=True)
def untold(monkeypatch):
    """Have nobody told where compiled code is kept, and numba not told by these tests."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(compiled_code, "tell_numba", lambda folder: None)
    yield
    compiled_code.forget()


def no_room(*_args, **_options):
    """Be a function that finds the disk full."""
    raise OSError(28, "No space left on device")


def test_the_folder_has_the_name_of_the_sources(tmp_path, monkeypatch):
    keep_below(tmp_path / "compiled")
    folder = compiled_code.folder()
    assert folder == tmp_path / "compiled" / compiled_code.sources_hash()
    assert folder.is_dir() and not list(folder.iterdir()) and not compiled_code.note()
    assert os.environ[VARIABLE] == str(folder)
    compiled_code.forget()
    assert VARIABLE not in os.environ and compiled_code.folder() is None and folder.is_dir()


def test_any_change_of_a_source_or_of_numba_changes_the_name(tmp_path, monkeypatch):
    copy = tmp_path / "core"
    shutil.copytree(compiled_code.CORE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    first = compiled_code.sources_hash()
    monkeypatch.setattr(compiled_code, "CORE", copy)
    assert compiled_code.sources_hash() == first
    with (copy / "numeric" / "trilinear.py").open("a") as file:
        file.write("# more\n")
    second = compiled_code.sources_hash()
    monkeypatch.setattr(compiled_code, "numba_version", lambda: "0.0")
    assert len({first, second, compiled_code.sources_hash()}) == 3


def test_folders_of_other_versions_go_and_nothing_else_does(tmp_path):
    old, others = tmp_path / "01234567", [tmp_path / "mine", tmp_path / "0123"]
    for folder in (old, *others):
        folder.mkdir()
        (folder / "file").touch()
    keep_below(tmp_path)
    assert not old.exists() and all((folder / "file").is_file() for folder in others)


def test_what_is_complete_is_known_the_next_time(tmp_path):
    assert not compiled_code.is_complete()
    for is_complete in (False, True):
        keep_below(tmp_path)
        assert compiled_code.is_complete() == is_complete
        compiled_code.marker(compiled_code.folder()).touch()
        compiled_code.forget()


def a_file(parent: Path, monkeypatch) -> None:
    parent.touch()


def read_only(parent: Path, monkeypatch) -> None:
    make = Path.mkdir

    def mkdir(self, *args, **options):
        if self.is_relative_to(parent):
            raise PermissionError(13, "Permission denied")
        make(self, *args, **options)

    monkeypatch.setattr(Path, "mkdir", mkdir)


def full(parent: Path, monkeypatch) -> None:
    make = tempfile.TemporaryFile

    def temporary_file(*args, dir, **options):
        return no_room() if Path(dir).is_relative_to(parent) else make(*args, dir=dir, **options)

    monkeypatch.setattr(tempfile, "TemporaryFile", temporary_file)


@pytest.mark.parametrize("spoil", [a_file, read_only, full])
def test_where_it_cannot_be_kept_it_is_kept_for_now_and_that_is_said(spoil, tmp_path, monkeypatch):
    parent = tmp_path / "compiled"
    spoil(parent, monkeypatch)
    keep_below(parent)
    folder = compiled_code.folder()
    assert folder.is_dir() and not folder.is_relative_to(parent)
    assert os.environ[VARIABLE] == str(folder)
    assert compiled_code.note().startswith(f"Compiled code cannot be kept in {parent} (")
    compiled_code.forget()
    assert not folder.exists() and not compiled_code.note()


def test_where_nothing_at_all_can_be_written_it_is_not_kept(tmp_path, monkeypatch):
    (tmp_path / "compiled").touch()
    monkeypatch.setattr(tempfile, "mkdtemp", no_room)
    keep_below(tmp_path / "compiled")
    assert compiled_code.folder() is None and VARIABLE not in os.environ
    assert "cannot be kept" in compiled_code.note()


def test_the_users_own_folder_has_precedence(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "elsewhere")
    keep_below(tmp_path / "compiled")
    assert compiled_code.folder() is None and not (tmp_path / "compiled").exists()
    compiled_code.forget()
    assert os.environ[VARIABLE] == "elsewhere"
