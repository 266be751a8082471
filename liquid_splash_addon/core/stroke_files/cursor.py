# SPDX-License-Identifier: GPL-3.0-or-later
"""A place in the bytes of a file, that never goes beyond their end."""

from __future__ import annotations

import struct
from typing import Any

from .limits import StrokeFileError


class TruncatedError(StrokeFileError):
    """The bytes end, or stop making sense, before what was to be read."""


class Cursor:
    """Reads little-endian values one after the other.

    Attributes
    ----------
    data : the bytes
    at : where the next value begins
    """

    def __init__(self, data: bytes, at: int = 0) -> None:
        self.data, self.at = memoryview(data), at

    def take(self, size: int) -> memoryview:
        """Return the next ``size`` bytes. Raises TruncatedError where there are fewer."""
        if size < 0 or self.at + size > len(self.data):
            raise TruncatedError("The file is damaged, or was not written to its end")
        self.at += size
        return self.data[self.at - size : self.at]

    def read(self, layout: str) -> tuple[Any, ...]:
        """Return the next values, as :mod:`struct` names them."""
        return struct.unpack("<" + layout, self.take(struct.calcsize("<" + layout)))

    def number(self, layout: str) -> Any:
        """Return the next value."""
        return self.read(layout)[0]

    def text(self) -> bytes:
        """Return bytes that follow their number, a byte."""
        return bytes(self.take(self.number("B")))
