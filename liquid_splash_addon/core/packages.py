# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python packages that core computes with: whether they are there, and whether they work."""

from __future__ import annotations

import ctypes
import importlib
import importlib.machinery
import importlib.util
import os
import re
import sys
from importlib import metadata
from pathlib import Path
from types import ModuleType

PACKAGES = {
    "torch": "torch",
    "safetensors": "safetensors",
    "skimage": "scikit-image",
    "scipy": "scipy",
    "numba": "numba",
}
"""Names in the package index, by the names of the modules."""

OLDEST = {
    "torch": "2.13",
    "safetensors": "0.8",
    "skimage": "0.26",
    "scipy": "1.17",
    "numba": "0.68",
}
"""The oldest versions that the tests run with, by module. Older ones may work all the same."""

ADVICE = "The Splash tab in the sidebar shows how"

_broken: dict[str, str] = {}
"""Why modules did not load, by name. A second try would fail elsewhere, without the reason."""


class PackageError(ImportError):
    """A package is missing or broken; the message says what to do."""


def is_installed(module: str) -> bool:
    """Tell whether a module of the top level can be found, without importing it."""
    try:
        spec = importlib.util.find_spec(module)
    except ValueError:  # some other add-on's stand-in of this name was imported, without a spec
        spec = importlib.machinery.PathFinder.find_spec(module)
    # Any folder of that name, even an empty one, is a package without an origin.
    return spec is not None and spec.origin is not None


def version_of(module: str) -> str:
    """Return the version of a module's package, without importing it; nothing if not known."""
    try:
        return metadata.version(PACKAGES[module])
    except metadata.PackageNotFoundError:
        return ""


def is_too_old(module: str) -> bool:
    """Whether a package is older than OLDEST; not where its version is not known."""
    version = version_of(module)
    return bool(version) and numbers_of(version) < numbers_of(OLDEST[module])


def numbers_of(version: str) -> tuple[int, ...]:
    """Return what a version begins with, for comparing: (2, 13) for 2.13rc1."""
    found = re.match(r"\d+(\.\d+)*", version)
    return tuple(map(int, found[0].split("."))) if found else ()


def broken_packages() -> list[str]:
    """List the packages that did not load, by their names in the package index."""
    return [PACKAGES[module] for module in _broken]


def load(module: str) -> ModuleType:
    """Import a module of PACKAGES. Raises PackageError where it is missing or broken."""
    if module not in _broken:
        if not is_installed(module):
            raise PackageError(f"Not installed: {PACKAGES[module]}. {ADVICE}")
        try:
            if module == "torch" and module not in sys.modules:
                preload_torch()
            return importlib.import_module(module)
        except Exception as error:  # of any kind: ValueError where it is for another NumPy
            _broken[module] = first_line(error)
            raise broken(module) from error
    raise broken(module)


def preload_torch() -> None:
    """Load torch's largest library without holding Python's lock, so that importing it is short.

    It takes half a second, in which Blender's interface would stand still. On Windows torch does
    the like itself. Where this fails, the import says why.
    """
    spec = importlib.util.find_spec("torch")
    if os.name != "posix" or spec is None or spec.origin is None:
        return
    ending = "dylib" if sys.platform == "darwin" else "so"
    library = Path(spec.origin).parent / "lib" / f"libtorch_cpu.{ending}"
    # Called as a function of the C library, for which ctypes lets go of the lock in any version.
    dlopen = ctypes.CDLL(None).dlopen
    dlopen.argtypes, dlopen.restype = (ctypes.c_char_p, ctypes.c_int), ctypes.c_void_p
    if library.is_file():
        dlopen(os.fsencode(library), os.RTLD_NOW)


def broken(module: str) -> PackageError:
    """Return the error for a module that did not load."""
    return PackageError(
        f"The package {PACKAGES[module]} is broken ({_broken[module]}): install it again, then "
        f"restart Blender. {ADVICE}"
    )


def advice_for(error: ImportError) -> str:
    """Return what to tell a user of any error of importing."""
    module = (error.name or "").partition(".")[0]
    if isinstance(error, PackageError) or module not in PACKAGES:
        return str(error)
    _broken.setdefault(module, first_line(error))
    return str(broken(module))


def first_line(error: Exception) -> str:
    """Return the beginning of an error's message, or its kind if it has none."""
    return next(iter(str(error).strip().splitlines()), "") or type(error).__name__
