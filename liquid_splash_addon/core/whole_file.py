# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are there in whole or not at all, whenever writing them is interrupted."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the name of a file beside ``path`` that takes its place if all goes well.

    What was at ``path`` stays as it was otherwise. Raises OSError, which names ``path``.
    """
    beside = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield beside
        os.replace(beside, path)
    except BaseException as error:
        if isinstance(error, OSError) and error.errno is not None:
            error.filename = str(path)  # what was meant; a full disk names none at all
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
        raise


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in whole or not at all. Raises OSError."""
    with whole_file(path) as beside:
        beside.write_bytes(content)
