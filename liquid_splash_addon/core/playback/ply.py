# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid at one moment as a PLY file (Turk 1994), which Blender's nodes import frame by frame."""

from __future__ import annotations

import numpy as np

from ..composition.drops import Drops
from ..mesh.mesh import Mesh
from .files import RADIUS, VELOCITY

VERTEX = ("x", "y", "z", *VELOCITY, RADIUS)
FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])

BYTES_PER_VERTEX = 4 * len(VERTEX) + 2 * FACE.itemsize
"""Of a closed surface, which has two triangles for every vertex."""


def ply_bytes(mesh: Mesh, drops: Drops | None = None) -> bytes:
    """Return a binary PLY file of a mesh and of the ``drops`` that are in no mesh.

    Those drops are vertices without faces, after those of the mesh. All in the mesh's own units.
    """
    vertices = table(mesh.vertices, mesh.velocities, np.zeros(len(mesh.vertices)))
    if drops is not None:
        free = ~drops.meshed
        points = table(drops.positions[free], drops.velocities[free], drops.radii[free])
        vertices = np.concatenate([vertices, points])
    faces = np.empty(len(mesh.faces), dtype=FACE)
    faces["count"], faces["corners"] = 3, mesh.faces
    return header(len(vertices), len(faces)) + vertices.tobytes() + faces.tobytes()


def table(positions: np.ndarray, velocities: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return the vertices as rows of numbers, float32 ``(n, 7)``."""
    return np.concatenate([positions, velocities, radii[:, None]], axis=1).astype("<f4")


def header(vertices: int, faces: int) -> bytes:
    """Return what a PLY file begins with."""
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {vertices}",
        *(f"property float {name}" for name in VERTEX),
        f"element face {faces}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return "".join(f"{line}\n" for line in lines).encode()
