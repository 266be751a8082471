# SPDX-License-Identifier: GPL-3.0-or-later
"""numba's ``njit`` as core uses it: no trouble with kept code ever ends a computation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import compiled_code
from .packages import load

numba = load("numba")

from numba.core import event  # noqa: E402 (only where numba loads)
from numba.core.caching import FunctionCache  # noqa: E402 (only where numba loads)
from numba.core.sigutils import normalize_signature  # noqa: E402


class KeptCode(FunctionCache):
    """The code kept of one function. What cannot be read or written is compiled and not kept."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Take the code of ``function``. Raises RuntimeError where there is no folder for it."""
        super().__init__(function)
        if compiled_code.folder() is None:  # else the folder is of these very sources
            source = Path(function.__code__.co_filename)
            self._cache_file._source_stamp = compiled_code.used_hash(source)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for argument types; None if it is not there, damaged or another's."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # unpickling a damaged file raises anything
            return None
        # Two processes that save at once, for two lists of types, may mix up their files.
        is_meant = found is not None and tuple(found.signature.args) == normalize_signature(sig)[0]
        return found if is_meant else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            compiled_code.explain(f"Compiled code cannot be kept ({error.strerror})")
        except Exception:  # of a damaged index, which is read before it is written
            self.start_anew()

    def start_anew(self) -> None:
        """Empty the index; what it named is compiled once more."""
        try:
            self.flush()
        except OSError as error:
            compiled_code.explain(f"Compiled code cannot be kept ({error.strerror})")


class Told(event.Listener):
    """Calls a function at the end of every compilation."""

    def __init__(self, call: Callable[[], None]) -> None:
        """Take the function."""
        self.call = call

    def on_start(self, event: Any) -> None:
        """Do nothing yet."""

    def on_end(self, event: Any) -> None:
        """Call it."""
        self.call()


@contextmanager
def while_compiling(call: Callable[[], None]) -> Iterator[None]:
    """Call a function, which must not raise, at the end of every compilation in the block."""
    with event.install_listener("numba:compile", Told(call)):
        yield


def njit(*, cache: bool, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function, with numba's ``options``.

    Compiled loops let go of Python's lock: Blender's interface needs it meanwhile.

    cache : whether its compiled code is kept.
    """
    options = {"nogil": True, **options}

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        if cache:
            try:
                dispatcher._cache = KeptCode(function)
            except (OSError, RuntimeError):  # no folder at all that could be written
                compiled_code.explain("Compiled code cannot be kept")
        return dispatcher

    return compiled
