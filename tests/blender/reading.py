# SPDX-License-Identifier: GPL-3.0-or-later
"""Read exported files without Blender: vertices ``(n, 3)`` as they are written."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np

READER = Path(__file__).with_name("read_archive.py")


def archive(path: Path) -> dict[str, np.ndarray]:
    """Return what ``read_archive.py`` finds in an Alembic or USD file."""
    out = path.with_suffix(path.suffix + ".npz")
    command = [sys.executable, str(READER), str(path), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    with np.load(out) as found:
        return dict(found)


def gltf(path: Path) -> list[np.ndarray]:
    """Return the vertices of each primitive of a binary glTF file."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    content = json.loads(data[20 : 20 + length])
    binary = data[20 + length + 8 :]
    found = []
    for mesh in content["meshes"]:
        for primitive in mesh["primitives"]:
            accessor = content["accessors"][primitive["attributes"]["POSITION"]]
            view = content["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            flat = np.frombuffer(binary, np.float32, accessor["count"] * 3, start)
            found.append(flat.reshape(-1, 3))
    return found


def fbx(path: Path) -> list[np.ndarray]:
    """Return the vertices of each mesh of a binary FBX file: arrays of doubles, often packed."""
    data, found = path.read_bytes(), []
    for match in re.finditer(rb"\x08Verticesd", data):
        count, is_packed, length = struct.unpack_from("<III", data, match.end())
        values = data[match.end() + 12 :][: length if is_packed else 8 * count]
        flat = np.frombuffer(zlib.decompress(values) if is_packed else values, np.float64)
        found.append(flat.reshape(-1, 3))
    return found


def obj(path: Path) -> list[np.ndarray]:
    """Return the vertices of an OBJ file."""
    rows = [line.split()[1:4] for line in path.read_text().splitlines() if line.startswith("v ")]
    return [np.array(rows, dtype=np.float64)]


def ply(path: Path) -> list[np.ndarray]:
    """Return the vertices of a binary PLY file."""
    data = path.read_bytes()
    header, _, rest = data.partition(b"end_header\n")
    text = header.decode().split("element face")[0]
    count = int(re.search(r"element vertex (\d+)", text)[1])
    names = re.findall(r"property (\w+) (\w+)", text)
    sizes = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "short": "<i2"}
    table = np.frombuffer(rest, [(name, sizes[kind]) for kind, name in names], count)
    return [np.stack([table[axis] for axis in "xyz"], axis=1)]


def stl(path: Path) -> list[np.ndarray]:
    """Return the corners of the triangles of a binary STL file."""
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    return [np.frombuffer(path.read_bytes(), kind, offset=84)["corners"].reshape(-1, 3)]
