# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of each kind from which mutated ones are made: good ones, and bad ones of every sort."""

from __future__ import annotations

import json
import random

from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.stroke_files.reading import KINDS
from tests.core.stroke_files.making import apa, arches, sketch_bytes, tilt, tracking


def seeds(kind: str) -> list[bytes]:
    """Return the files of a kind; ``sketch`` is what is inside a .tilt file."""
    small = [arch[:6] for arch in arches(2)]
    stamps = [[0, 5, 5, 3, 9, 12], [7] * 6]
    sketches = [
        sketch_bytes([10 * arch for arch in small], scale, step, extension)
        for scale, step, extension in (
            (None, 45, b""), (2.0, 45, b""), (0.0, None, b""), (1.0, 1, b"newer"),
        )
    ]  # fmt: skip
    if kind == "sketch":
        return sketches
    if kind == "tilt":
        bombs = [bytes(2**21), sketches[0][:24] + b"\xff" * 2**18]
        return [tilt(content) for content in (*sketches, *bombs)]
    if kind == "apa":
        return [apa(small), apa(small, stamps), apa([[]] * 3)]
    drawings = [Drawing(arch, arch[:, 0].argsort() / 10.0, arch[:, 1].clip(0, 1)) for arch in small]
    write = KINDS[f".{kind}"].write
    assert write is not None
    tables = [write(drawings), write([Drawing(small[0])])]
    if kind == "csv":
        units = "# axes: y-up\n# length: mm\nt,x,y,z,stroke\n0,0,0,0,a\n1,1,nan,1e300,a\n"
        spaces = "x y z time\n0 0 0 5\n1 1 1 4\n\n2 2 2 0\n3 3 3 1\n"
        texts = ("1;2;3;0\n1,5;2;3;1\n", spaces, units)
        wide = "x,y,z\n0,1,2\n3,4,5\n".encode("utf-16")
        return [*tables, *(text.encode() for text in texts), wide]
    motion = tracking()
    motion["right"]["poses"] = motion["right"]["poses"][:40]
    texts = [motion, tracking(("buttondown", "buttonup")) | {"left": {"poses": [{}]}}]
    odd = ('{"strokes": [[[1, 2, 3], [1e999, null, "4"]]], "fields": ["x", "z", "y"], '
           '"units": {"length": "mm", "time": 0.5, "axes": "y-up"}}')  # fmt: skip
    return [*tables, *(json.dumps(text).encode() for text in texts), odd.encode(), b"[" * 5000]


def mutated(content: bytes, number: random.Random) -> bytes:
    """Return a file with a few random changes: bits, numbers, pieces lost, doubled, moved."""
    data = bytearray(content)
    for _ in range(number.randint(1, 6)):
        at = number.randrange(len(data) + 1)
        length = number.choice((1, 2, 4, 8, 64))
        change = number.randrange(6)
        if change == 0 and at < len(data):
            data[at] ^= 1 << number.randrange(8)
        elif change == 1:
            data[at : at + 4] = number.choice((0, 1, 2**16, 2**31 - 1, 2**32 - 1)).to_bytes(
                4, "little"
            )
        elif change == 2:
            del data[at : at + length]
        elif change == 3:
            data[at:at] = data[at : at + length]
        elif change == 4:
            data[at:at] = number.choice(
                (b"0", b"-", b"9" * 40, b"[", b"{", b",", b"\n", b"\0", b"e9")
            )
        else:
            data = data[: max(at, 1)] if number.random() < 0.2 else data
    return bytes(data)
