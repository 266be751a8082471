# SPDX-License-Identifier: GPL-3.0-or-later
"""Capillary waves on the finished mesh (paper, 5.2)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..compiling import njit
from ..mesh.laplacian import Laplacian, laplacian, mean_curvature, pieces
from ..mesh.local_thickness import thickness_and_clearance
from ..mesh.mesh import Mesh
from ..mesh.remeshing import isotropic, unchanged
from ..mesh.self_intersection import take_back
from ..numeric.triangles import enclosed_volume, face_areas, vertex_normals
from .settings import WaveSettings
from .sheet_mesh import EDGE

DAMPING_TIME = 1 / 60
"""Seconds after which the paper's damping coefficient has acted once: a frame."""

EDGES_PER_WAVE = 6
"""Least number of edges in a wavelength."""

MOST_TRIANGLES = 250_000
"""Triangles up to which edges may be finer than a cell."""

MOST_WAVE_STEPS = 400
"""Most steps of one propagation."""

CURVATURE_BLUR = 1.0
"""Width of the Gaussian that smooths the curvature, cells."""

CURVATURE_CLAMP = 0.5
"""Largest mean curvature that counts, 1 / cells: a rim two cells thick has it."""

QUIET_SHARE = 0.15
"""Share of the clamp below which curvature makes no waves: they come from fronts, not from every
unevenness of a sheet."""

CLEARANCE_REACH = 3.0
"""Distance in cells within which other parts of the surface limit the waves."""

CLEARANCE_SHARE = 0.45
"""Share of the local thickness and clearance that waves may take: below half, the sides of a sheet
stay apart even if both move, and a fold keeps its orientation."""

STEP_SHARE = 0.98
"""Share of the largest stable time step that is used."""


@dataclass(frozen=True)
class WaveMesh:
    """A mesh prepared for waves; it depends on the edge length, not on the other settings.

    Attributes
    ----------
    mesh : even triangles, local metres
    edge : target length of their edges, metres
    spacing : the grid's cell, metres
    operator : the mesh's Laplacian
    normals : float32 ``(n, 3)``, unit, outward
    curvature : float32 ``(n,)``, smoothed mean curvature over its clamp, -1..1, QUIET_SHARE off
    inward, outward : float32 ``(n,)``, how far waves may move a vertex, metres
    piece : int32 ``(n,)``, number of the connected piece
    areas : float64 ``(n,)``, a third of the area of the faces around, m^2
    films : whether it has films, thinner than its edges: then no face may cross another
    """

    mesh: Mesh
    edge: float
    spacing: float
    operator: Laplacian
    normals: np.ndarray
    curvature: np.ndarray
    inward: np.ndarray
    outward: np.ndarray
    piece: np.ndarray
    areas: np.ndarray
    films: bool = False


@dataclass(frozen=True)
class WaveReport:
    """The waves that were made.

    Attributes
    ----------
    wavelength, reach : metres, as far as the mesh and the number of steps allow
    steps : of the propagation
    volume_change : volume that the waves added, over that of the mesh
    warnings : sentences for the user
    """

    wavelength: float
    reach: float
    steps: int
    volume_change: float
    warnings: list[str] = field(default_factory=list)


def add_waves(mesh: Mesh, settings: WaveSettings, spacing: float) -> tuple[Mesh, WaveReport]:
    """Return ``mesh`` (closed, local metres) with waves, on even triangles, and a report.

    spacing : the grid's cell, metres. Raises NotClosedError.
    """
    return propagate(prepare(mesh, wave_edge(mesh, settings, spacing), spacing), settings)


def wave_edge(mesh: Mesh, settings: WaveSettings, spacing: float) -> float:
    """Return the edge length (m) that the settings need: ``spacing`` or a sixth of a wavelength.

    It is reduced in steps of sqrt(2), so that most changes of a slider need no new
    :class:`WaveMesh`, and not so far that there would be more than MOST_TRIANGLES. Waves of less
    than half a cell cannot be seen on a splash of that size: no triangles are spent on them.
    """
    edge, wanted = spacing, settings.wavelength / EDGES_PER_WAVE
    if settings.wavelength < spacing / 2:
        return spacing
    area = float(face_areas(mesh.vertices, mesh.faces).sum())
    while edge > 1.001 * wanted and area / (np.sqrt(3) / 4 * edge**2 / 2) < MOST_TRIANGLES:
        edge /= np.sqrt(2)
    return float(edge)


def prepare(mesh: Mesh, edge: float, spacing: float, room: np.ndarray | None = None) -> WaveMesh:
    """Return ``mesh`` remeshed to ``edge`` (m), with all that does not depend on the sliders.

    spacing : the grid's cell, metres; room : float32 ``(n,)``, half the thickness at each vertex,
    m, where sheets have made films, whose vertices lie too far apart to measure it; their mesh is
    even already, and films would cross if it were made anew. Raises NotClosedError.
    """
    if room is not None and edge > 0.99 * EDGE * spacing:
        remeshed = unchanged(mesh.vertices, mesh.faces)
    else:
        remeshed = isotropic(mesh.vertices, mesh.faces, edge)
    even = Mesh(
        remeshed.vertices.astype(np.float32), remeshed.faces, remeshed.carry(mesh.velocities)
    )
    operator = laplacian(remeshed.vertices, even.faces, edge)
    normals = vertex_normals(remeshed.vertices, even.faces)
    curvature = mean_curvature(operator, remeshed.vertices, normals)
    curvature = operator.diffuse(curvature, CURVATURE_BLUR * spacing) * (spacing / CURVATURE_CLAMP)
    # Of the old mesh: its vertices are never more than a cell apart, and not too many.
    old_normals = vertex_normals(mesh.vertices, mesh.faces)
    sides = thickness_and_clearance(mesh.vertices, old_normals, CLEARANCE_REACH * spacing)
    if room is not None:  # waves leave a film about as thick as it is
        sides = np.minimum(sides[0], room), np.minimum(sides[1], room)
    inward, outward = (
        operator.diffuse(CLEARANCE_SHARE * remeshed.carry(side), 0.5 * spacing) for side in sides
    )
    areas = np.bincount(
        even.faces.reshape(-1),
        np.repeat(face_areas(even.vertices, even.faces) / 3, 3),
        len(even.vertices),
    )
    return WaveMesh(
        even, edge, spacing, operator, normals, _seed(curvature),
        inward, outward, pieces(operator), areas, room is not None,
    )  # fmt: skip


def _seed(curvature: np.ndarray) -> np.ndarray:
    loud = np.clip((np.abs(curvature) - QUIET_SHARE) / (1 - QUIET_SHARE), 0, 1)
    return np.asarray(np.copysign(loud, curvature), dtype=np.float32)


def propagate(prepared: WaveMesh, settings: WaveSettings) -> tuple[Mesh, WaveReport]:
    """Return the mesh with its vertices moved along their normals by the waves, and a report.

    The mean over each connected piece is removed: it would only make a drop swell and shrink.
    Sheets are not pierced (CLEARANCE_SHARE). Topology and velocities stay the same.
    """
    mesh = prepared.mesh
    wavelength = max(settings.wavelength, EDGES_PER_WAVE * prepared.edge / 1.001)
    step, steps, kept = time_steps(prepared, settings)
    reach = settings.speed * step * steps
    if not len(mesh.vertices):
        return mesh, WaveReport(wavelength, reach, 0, 0.0)
    drive = np.sin(2 * np.pi * settings.speed / wavelength * step * np.arange(steps + 1))
    intensity = _intensity(prepared, settings.speed, np.diff(drive), step, kept)
    moved = _within_clearance(prepared, settings.amplitude * intensity)
    vertices = (mesh.vertices + moved[:, None] * prepared.normals).astype(np.float32)
    if prepared.films:
        vertices = take_back(mesh.vertices, vertices, mesh.faces).astype(np.float32)
    volume, before = (
        enclosed_volume(vertices, mesh.faces),
        enclosed_volume(mesh.vertices, mesh.faces),
    )
    report = WaveReport(
        wavelength, reach, steps, volume / max(before, 1e-30) - 1,
        _warnings(settings, wavelength, reach),
    )  # fmt: skip
    return Mesh(vertices, mesh.faces, mesh.velocities), report


def time_steps(prepared: WaveMesh, settings: WaveSettings) -> tuple[float, int, float]:
    """Return length (s) and number of the steps for the waves' reach, and the damping of one step.

    Eq. 7 is stable if (c dt)^2 times the largest eigenvalue is below 2 (1 + zeta), with the zeta
    of one step, which a shorter step only makes larger.
    """
    longest = 2 / (settings.speed * np.sqrt(max(prepared.operator.bound, 1e-12)))
    least = settings.damping ** (longest / DAMPING_TIME)
    longest *= STEP_SHARE * np.sqrt((1 + least) / 2)
    duration = settings.reach / settings.speed
    steps = min(int(np.ceil(duration / longest)), MOST_WAVE_STEPS)
    step = min(longest, duration / max(steps, 1))
    return float(step), steps, float(settings.damping ** (step / DAMPING_TIME))


def _intensity(
    prepared: WaveMesh, speed: float, drive: np.ndarray, step: float, kept: float
) -> np.ndarray:
    """Return the waves' intensity, float32 ``(n,)``; 1 is that of the most curved places.

    The mean of a piece and its waves do not interact, so removing the mean at the end is the same
    as removing it from the curvature.
    """
    operator = prepared.operator
    rho = np.zeros(len(prepared.curvature), dtype=np.float32)
    leapfrog(
        rho, np.zeros_like(rho), operator.first, operator.near, operator.rows,
        prepared.curvature, drive.astype(np.float32), step, speed, kept,
    )  # fmt: skip
    share = np.bincount(prepared.piece, prepared.areas)
    mean = np.bincount(prepared.piece, prepared.areas * rho) / np.maximum(share, 1e-30)
    return np.asarray(rho - mean[prepared.piece], dtype=np.float32)


@njit(cache=True, fastmath=True)
def leapfrog(rho, rate, first, near, rows, curvature, drive, step, speed, kept):
    """Advance intensity ``rho`` and its ``rate`` by eqs. 5 and 7, one step per entry of ``drive``.

    drive : sin(omega t + omega dt) - sin(omega t); kept : zeta of one step.
    """
    step, kept = np.float32(step), np.float32(kept)
    pull = np.float32(step * speed * speed)
    for push in drive:
        for v in range(len(rho)):
            rho[v] += curvature[v] * push + step * rate[v]
        for v in range(len(rho)):
            total = np.float32(0)
            here = rho[v]
            for e in range(first[v], first[v + 1]):
                total += rows[e] * (rho[near[e]] - here)
            rate[v] = kept * rate[v] + pull * total


def _within_clearance(prepared: WaveMesh, wanted: np.ndarray) -> np.ndarray:
    """Return movements (m) that stay below the limits, and close to ``wanted`` far below them."""
    limit = np.maximum(np.where(wanted > 0, prepared.outward, prepared.inward), 1e-9)
    return np.asarray(limit * np.tanh(wanted / limit), dtype=np.float32)


def _warnings(settings: WaveSettings, wavelength: float, reach: float) -> list[str]:
    found = []
    if wavelength > 1.01 * settings.wavelength:
        found.append(
            f"Waves of {1000 * settings.wavelength:.0f} mm are too short for a mesh of this size: "
            f"they were made {1000 * wavelength:.0f} mm long (raise Speed or lower Frequency)"
        )
    if reach < 0.99 * settings.reach:
        found.append(
            f"The waves reach {1000 * reach:.0f} mm instead of {1000 * settings.reach:.0f} mm: "
            "going farther would take too long"
        )
    return found
