# SPDX-License-Identifier: GPL-3.0-or-later
"""Films with rims: what a sheet of liquid is where a grid can hold only slabs.

A film's free edge is drawn in by surface tension at the Taylor-Culick speed
u = sqrt(2 sigma / (rho h)); the liquid that it has swept up is a rim of radius
a = sqrt(h u t / pi). Rims swell into beads some 9 a apart (Rayleigh-Plateau: the fastest mode has
2 pi sqrt(2) a).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..mesh.mesh import Mesh
from ..mesh.self_intersection import take_back
from ..numeric.triangles import enclosed_volume
from .drop_meshes import DropCloud
from .fingers import grow
from .holes import choose_holes, punch
from .rim_beads import bead_swelling, beads
from .settings import RefinementSettings, SheetSettings
from .sheet_mesh import SheetMesh, averaged

TENSION, DENSITY = 0.072, 1000.0
"""Surface tension (N/m) and density (kg/m^3) of water."""

LEAST_FILM, LEAST_RIM, MOST_RIM = 0.1, 0.35, 3.0
"""Thickness of the thinnest film, and radii of the thinnest and thickest rims that the mesh can
show, cells."""

THINNEST = 0.35
"""Share of its thickness that stretching leaves a film at least."""

ROUND = 1.08
"""Radius on which a rim's vertices lie, over its own: the faces between them are chords, six or
seven around a thin rim."""

NECK = 0.85
"""Width of the Gaussian by which a rim goes over into its film, over the rim's radius: half as
thick as a circle at its radius, as thick at half of it."""

Flow = Callable[[np.ndarray], np.ndarray]
"""Returns the liquid's velocity (m/s) at points ``(n, 3)``, m."""


@dataclass(frozen=True)
class Sheeted:
    """A mesh with films and rims.

    Attributes
    ----------
    mesh : local metres
    room : float32 ``(n,)``, half the thickness that was asked for at each vertex, m
    cloud : the drops that fingers have shed
    beads : numbers of the vertices in the middles of beads
    film : float32 ``(n,)``, thickness that films were to have, m
    rim : float32 ``(n,)``, radius of the nearest rim, without beads, m; 0 where none is near
    volume_change : volume that was added, over that of the mesh
    warnings : sentences for the user
    """

    mesh: Mesh
    room: np.ndarray
    cloud: DropCloud
    beads: np.ndarray
    film: np.ndarray
    rim: np.ndarray
    volume_change: float
    warnings: list[str] = field(default_factory=list)


def last_sheets(steps: Sequence[RefinementSettings]) -> SheetSettings | None:
    """Return the last sheets of a list: a film cannot be made of a film."""
    found = [step for step in steps if isinstance(step, SheetSettings)]
    return found[-1] if found else None


def repeated_sheets(steps: Sequence[RefinementSettings]) -> list[str]:
    """Return a warning if a list has several sheets."""
    if sum(isinstance(step, SheetSettings) for step in steps) < 2:
        return []
    return ["Only the last Sheets of the list is used: remove the others"]


def add_sheets(
    prepared: SheetMesh, settings: SheetSettings, flow: Flow | None = None,
    drops: DropCloud | None = None,
) -> Sheeted:  # fmt: skip
    """Return the mesh with its sheets thinned to films, with rims at their edges.

    Bulk liquid, jets and what touches obstacles stay. Faces do not cross.

    flow : the velocity at the vertices' new places; by default they keep their own; drops : that
    fly free already: fingers keep clear of them.
    """
    mesh = prepared.mesh
    if not len(mesh.vertices):
        none = np.zeros(0, dtype=np.float32)
        return Sheeted(mesh, none, DropCloud.empty(), none.astype(np.int32), none, none, 0.0)
    film, warnings = film_thickness(prepared, settings)
    rim = rim_radius(prepared, settings, film)
    found, away = beads(prepared, rim, settings)
    half = half_thickness(prepared, film, rim, bead_swelling(prepared, rim, away, settings))
    middle = prepared.middle + np.float32(settings.fairing) * (prepared.faired - prepared.middle)
    there = middle + half[:, None] * prepared.away
    moved = mesh.vertices + prepared.share[:, None] * (there - mesh.vertices)
    moved = take_back(mesh.vertices, moved, mesh.faces).astype(np.float32)
    velocities = mesh.velocities if flow is None else flow(moved).astype(np.float32)
    made, cloud = Mesh(moved, mesh.faces, velocities), DropCloud.empty()
    room = (prepared.room + prepared.share * (half - prepared.room)).astype(np.float32)
    if settings.fingers > 0:
        around = DropCloud.empty() if drops is None else drops
        made, radii, cloud = grow(made, middle, found, rim, settings, prepared.spacing, around)
        room = np.concatenate([room, radii])
    if settings.holes > 0:
        made, room = punch(made, room, prepared, choose_holes(prepared, film, settings))
    before = enclosed_volume(mesh.vertices, mesh.faces)
    change = (enclosed_volume(made.vertices, made.faces) + cloud.volume) / max(before, 1e-30) - 1
    return Sheeted(made, room, cloud, found, film, rim, change, warnings + nothing_thin(prepared))


def half_thickness(
    prepared: SheetMesh, film: np.ndarray, rim: np.ndarray, swelling: np.ndarray
) -> np.ndarray:
    """Return half the thickness (m) of film and rims at each vertex, float32 ``(n,)``.

    film, rim : thickness of the film and radius of the rim there, m; swelling : factor of that.
    """
    half = np.minimum(film / 2, prepared.room)
    beside = prepared.rim >= 0
    swollen = np.maximum(ROUND * rim * swelling, half)
    distance = np.where(beside, prepared.rim_distance, np.inf)
    neck = np.exp(-0.5 * (distance / np.maximum(NECK * swollen, 1e-9)) ** 2)
    wanted = (half + (swollen - half) * neck).astype(np.float32)
    calm = averaged(wanted, prepared.first, prepared.near, 1)
    return np.where(prepared.rim_distance == 0, wanted, calm)  # or rims would lose what they have


def film_thickness(prepared: SheetMesh, settings: SheetSettings) -> tuple[np.ndarray, list[str]]:
    """Return the thickness (m) that films are to have at each vertex, and warnings.

    A sheet that has been drawn apart at the rate D for a time t has exp(-D t) of its thickness;
    *Stretch* is the share of that which is seen, as a grid's flow knows little of the past.
    """
    cell, film = prepared.spacing, settings.film / 1000
    drawn = np.clip(prepared.drawn * prepared.age, 0, -np.log(THINNEST))
    thickness = (film * np.exp(-settings.stretch * drawn)).astype(np.float32)
    warnings = []
    if film < LEAST_FILM * cell:
        warnings.append(
            f"Films of {settings.film:.2g} mm are too thin for voxels of {1000 * cell:.2g} mm: "
            f"they were made {1000 * LEAST_FILM * cell:.2g} mm thick"
        )
    sheets = prepared.share > 0.5
    if sheets.any() and film > 1.8 * np.median(prepared.room[sheets]):
        warnings.append(
            f"Films of {settings.film:.2g} mm are as thick as the liquid: it keeps its thickness "
            "(lower Film)"
        )
    return np.maximum(thickness, np.float32(LEAST_FILM * cell)), warnings


def rim_radius(prepared: SheetMesh, settings: SheetSettings, film: np.ndarray) -> np.ndarray:
    """Return the radius (m) of the nearest rim at each vertex; 0 where none is near.

    film : thickness at each vertex, m. The rim has swept up what lay in its way: the film beside
    it, which is as thick as it is there.
    """
    speed = np.sqrt(2 * TENSION / (DENSITY * film))
    radius = settings.rims * np.sqrt(film * speed * prepared.age / np.pi)
    cell = prepared.spacing
    radius = averaged(radius, prepared.first, prepared.near, 6)
    radius = np.clip(radius, LEAST_RIM * cell, MOST_RIM * cell)
    return np.where(prepared.rim >= 0, radius[prepared.rim], 0).astype(np.float32)


def nothing_thin(prepared: SheetMesh) -> list[str]:
    """Return what to say of the mesh as a whole."""
    if (prepared.share > 0.5).any():
        return []
    return ["Sheets: there are no sheets here that are thin enough (the liquid stays as it is)"]
