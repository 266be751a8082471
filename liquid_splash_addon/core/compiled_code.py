# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the code that numba compiles is kept, so that each machine compiles it once.

numba notices when a function changes, but not when another that it calls does. So the code is kept
in a folder named by all of core's sources; in a checkout, where they change all the time, with a
hash of those sources that matter. Needs no numba: numba asks where when it is imported.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import sys
import tempfile
from functools import cache
from importlib import metadata
from pathlib import Path

CORE = Path(__file__).parent

VARIABLE = "NUMBA_CACHE_DIR"
"""Where numba reads the folder from."""

FIRST, REFINED = "first", "refined"
"""Stages of compiling ahead: all is there that a first splash needs, and one that is refined."""

REACHED = {FIRST: 0.22, REFINED: 0.37}
"""The share of compiling ahead at the end of each stage, of the time that it takes."""

DIGITS = 8
"""Of a folder's name: Windows bounds the length of a path."""

OURS = re.compile(rf"[0-9a-f]{{{DIGITS}}}")
"""Names of the folders, also those of other versions."""

IMPORT = re.compile(r"^\s*from (\.+)([\w.]*) import \(?([\w, ]+)", re.MULTILINE)
"""A relative import: dots, module, and the names on the same line."""

PROBE = bytes(1 << 20)
"""What is written to see whether there is room: a disk that is full still takes empty files."""

_folder: Path | None = None
_temporary: Path | None = None
_note = ""


def sources_hash() -> str:
    """Return what tells this core, with this numba, from any other."""
    found = hashlib.sha256(numba_version().encode())
    for path in sorted(CORE.rglob("*.py")):
        found.update(path.relative_to(CORE).as_posix().encode() + b"\0")
        found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()[:DIGITS]


@cache
def used_hash(source: Path) -> str:
    """Return what tells a source of core, and all that it imports of core, from other versions."""
    found, waiting = {source}, [source]
    while waiting:
        for path in imported(waiting.pop()) - found:
            found.add(path)
            waiting.append(path)
    digest = hashlib.sha256(numba_version().encode())
    for path in sorted(found):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def imported(source: Path) -> frozenset[Path]:
    """Return the sources that ``source`` imports by relative imports."""
    paths = set()
    for dots, module, names in IMPORT.findall(source.read_text(encoding="utf-8")):
        at = source.parents[len(dots) - 1].joinpath(*module.split("."))
        candidates = [at.with_suffix(".py"), at / "__init__.py"]
        candidates += [at / f"{name.strip().partition(' ')[0]}.py" for name in names.split(",")]
        paths |= {path for path in candidates if path.is_file()}
    return frozenset(paths)


def numba_version() -> str:
    """Return the version of numba, without importing it; nothing if it is not known."""
    try:
        return metadata.version("numba")
    except metadata.PackageNotFoundError:
        return ""


def keep_below(parent: Path) -> None:
    """Keep compiled code in a folder in ``parent``, of these sources; drop those of others.

    Where that cannot be written, it is kept in a temporary folder, and :func:`note` says so. The
    user's own NUMBA_CACHE_DIR has precedence. To be called before numba is imported by core.
    """
    global _folder
    if VARIABLE in os.environ:
        return
    name = sources_hash()
    is_new = not (parent / name).is_dir()
    try:
        check_room(parent / name)
    except OSError as error:
        _folder = temporary(parent, error)
    else:
        _folder = parent / name
        if is_new:
            drop_others(_folder)
    if _folder is not None:
        tell_numba(str(_folder))
        os.environ[VARIABLE] = str(_folder)


def share(folder: str) -> None:
    """Use the folder of the process that started this one; there is none for an empty name.

    Code is found again only where both say that it is kept for these very sources.
    """
    global _folder
    _folder = Path(folder) if folder else None


def check_room(folder: Path) -> None:
    """Make ``folder`` if it is not there. Raises OSError where nothing can be written in it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
        file.write(PROBE)


def temporary(parent: Path, error: OSError) -> Path | None:
    """Return a temporary folder, as ``parent`` cannot be written; None where none can be."""
    global _temporary
    reason = error.strerror or type(error).__name__
    try:
        # Not one of a known name: what lies in it is run, and others may write there too.
        _temporary = Path(tempfile.mkdtemp(prefix="liquid_splash_"))
        check_room(_temporary)
    except OSError:
        drop_temporary()
    explain(f"Compiled code cannot be kept in {parent} ({reason})")
    return _temporary


def drop_others(folder: Path) -> None:
    """Delete the folders of other versions beside ``folder``, as far as that is possible."""
    for path in folder.parent.iterdir():
        if path != folder and OURS.fullmatch(path.name) and path.is_dir():
            shutil.rmtree(path, ignore_errors=True)


def drop_temporary() -> None:
    """Delete the temporary folder, if there is one."""
    global _temporary
    if _temporary is not None:
        shutil.rmtree(_temporary, ignore_errors=True)
    _temporary = None


def tell_numba(folder: str) -> None:
    """Let a numba that is imported already, by another add-on, know of the folder."""
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder


def forget() -> None:
    """Undo :func:`keep_below`, except for what is kept where it can stay."""
    global _folder, _note
    if _folder is not None and os.environ.get(VARIABLE) == str(_folder):
        del os.environ[VARIABLE]
        tell_numba("")
    _folder, _note = None, ""
    drop_temporary()


def explain(reason: str) -> None:
    """Set the note."""
    global _note
    _note = f"{reason}, so the first splash after each start of Blender takes long"


def note() -> str:
    """Return a sentence for the user if compiled code is not kept, else nothing."""
    return _note


def folder() -> Path | None:
    """Return where compiled code is kept; None where that is not ours to say."""
    return _folder


def size() -> int:
    """Return how many bytes of compiled code are kept."""
    if _folder is None:
        return 0
    return sum(path.stat().st_size for path in _folder.rglob("*") if path.is_file())


def clear() -> None:
    """Delete the compiled code that is kept; what is loaded already goes on working.

    Raises OSError with the first file that could not be deleted.
    """
    if _folder is None:
        return
    for path in list(_folder.iterdir()):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def is_complete() -> bool:
    """Whether all was compiled ahead that this machine needs."""
    return _folder is not None and marker(_folder).is_file()


def has_reached(stage: str) -> bool:
    """Whether compiling ahead has come to the end of this stage, now or earlier."""
    return is_complete() or (_folder is not None and machine_file(_folder, stage).is_file())


def note_reached(stage: str) -> None:
    """Note that what this stage needs is compiled; if that cannot be kept, it is tried again."""
    if _folder is not None:
        try:
            machine_file(_folder, stage).touch()
        except OSError as error:
            explain(f"Compiled code cannot be kept ({error.strerror})")


def marker(folder: Path) -> Path:
    """Return the file that says of ``folder`` that it is complete, for this machine and Python."""
    return machine_file(folder, "complete")


def machine_file(folder: Path, name: str) -> Path:
    """Return the file ``name`` of this machine and Python in ``folder``: homes may be shared."""
    machine = f"{platform.node()} {platform.machine()} {sys.implementation.cache_tag}"
    return folder / f"{name}-{hashlib.sha256(machine.encode()).hexdigest()[:DIGITS]}"
