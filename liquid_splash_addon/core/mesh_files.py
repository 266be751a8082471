# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash as a file that other programs read; the end of its name says of which kind it is."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .composition.drops import Drops
from .mesh.mesh import Mesh
from .playback.ply import ply_bytes
from .whole_file import write_whole


class MeshKind(NamedTuple):
    """A kind of file.

    Attributes
    ----------
    to_bytes : returns a file of a mesh and of its free drops
    about : what such a file holds, for an interface
    """

    to_bytes: Callable[[Mesh, Drops | None], bytes]
    about: str


def obj_bytes(mesh: Mesh, drops: Drops | None = None) -> bytes:
    """Return a Wavefront OBJ file of a mesh. The format has no place for velocities and drops."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}\n" for a, b, c in (mesh.faces.astype(np.int64) + 1).tolist()]
    return "".join(lines).encode()


def npz_bytes(mesh: Mesh, drops: Drops | None = None) -> bytes:
    """Return an archive of NumPy's: the arrays of the mesh and, as ``drop_...``, of the drops."""
    arrays = {"vertices": mesh.vertices, "faces": mesh.faces, "velocities": mesh.velocities}
    if drops is not None:
        arrays |= {f"drop_{name}": values for name, values in drops._asdict().items()}
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


KINDS = {
    ".ply": MeshKind(ply_bytes, "mesh, velocities, small drops as points with a radius; binary"),
    ".obj": MeshKind(obj_bytes, "mesh alone"),
    ".npz": MeshKind(npz_bytes, "the arrays, for NumPy"),
}
"""Kinds of files, by the ends of their names."""


def write_mesh(path: str | Path, mesh: Mesh, drops: Drops | None = None) -> None:
    """Write a splash in whole or not at all, in the units of the mesh.

    Raises ValueError for a name that says nothing of KINDS, OSError.
    """
    path = Path(path)
    write_whole(path, mesh_kind(path).to_bytes(mesh, drops))


def mesh_kind(path: Path) -> MeshKind:
    """Return the kind of a file. Raises ValueError for others."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise ValueError(f"{path.name}: splashes are written as {', '.join(KINDS)} only")
    return kind
