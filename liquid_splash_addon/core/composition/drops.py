# SPDX-License-Identifier: GPL-3.0-or-later
"""A finished liquid in drawing units: its mesh and its free drops."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..mesh.mesh import Mesh
from ..sketch.local_frame import Frame

if TYPE_CHECKING:
    from ..refinement.drop_meshes import DropCloud


class Drops(NamedTuple):
    """Drops that fly free, in drawing units where nothing else is said.

    Attributes
    ----------
    positions, velocities : float32 ``(n, 3)``
    radii : float32 ``(n,)``
    meshed : bool ``(n,)``, which of them are in the splash's mesh
    """

    positions: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray
    meshed: np.ndarray


def drops_to_drawing(cloud: DropCloud | Drops, frame: Frame) -> Drops:
    """Convert free drops from local metres to drawing units."""
    return Drops(
        frame.points_to_drawing(cloud.positions.astype(np.float64)).astype(np.float32),
        frame.vectors_to_drawing(cloud.velocities.astype(np.float64)).astype(np.float32),
        frame.scale.lengths_to_drawing(cloud.radii).astype(np.float32),
        cloud.meshed,
    )


def drops_to_local(drops: Drops, frame: Frame) -> Drops:
    """Convert free drops from drawing units to local metres."""
    return Drops(
        frame.points_to_local(drops.positions.astype(np.float64)).astype(np.float32),
        frame.vectors_to_local(drops.velocities.astype(np.float64)).astype(np.float32),
        frame.scale.lengths_to_local(drops.radii).astype(np.float32),
        drops.meshed,
    )


def mesh_to_drawing(mesh: Mesh, frame: Frame) -> Mesh:
    """Convert a mesh from local metres to drawing units; its faces go on facing outward."""
    vertices = frame.points_to_drawing(mesh.vertices.astype(np.float64))
    velocities = frame.vectors_to_drawing(mesh.velocities.astype(np.float64))
    faces = np.ascontiguousarray(mesh.faces[:, ::-1]) if frame.is_mirrored else mesh.faces
    return Mesh(vertices.astype(np.float32), faces, velocities.astype(np.float32))
