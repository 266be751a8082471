# SPDX-License-Identifier: GPL-3.0-or-later
"""How simulated splashes move: height and radius of the liquid above a pool, over time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

FPS, TIME_SCALE = 24, 0.1
"""Of the film, and seconds of the liquid in one of the film's."""

FRAME_MS = 1000 * TIME_SCALE / FPS
"""Milliseconds of the liquid from frame to frame."""

COMPARED = 12
"""Frames over which the solvers' centres are compared."""

CLEAR = 0.06
"""Units above the pool's surface from which liquid counts as the splash."""

TITLES = {
    "moving": "with initial velocity",
    "still": "without",
    "ours": "our solver",
    "mantaflow": "Mantaflow",
}


class Measured(NamedTuple):
    """The liquid above a height: volume, centre ``(3,)`` and mean distance from an axis."""

    volume: float
    centre: np.ndarray
    radius: float


def facts_of(place: Any) -> dict[str, Any]:
    """Return what is known of a subject's splash."""
    return dict(json.loads((place.folder.parent / "facts.json").read_text()))


def above(vertices: np.ndarray, faces: np.ndarray, height: float, axis: np.ndarray) -> Measured:
    """Measure what a closed mesh holds above ``height``; axis : x and y of an upright axis.

    By Gauss's theorem with fields along z: the volume above is the integral of
    ``n_z max(z - height, 0)`` over the surface, the moments likewise.
    """
    corners = vertices[faces].astype(np.float64)
    edges = corners[:, 1:, :2] - corners[:, :1, :2]
    flat = (edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]) / 2
    middle = corners.mean(axis=1)
    top = np.maximum(middle[:, 2], height)
    share = flat * (top - height)
    volume = share.sum()
    level = (flat * (top**2 - height**2)).sum() / 2
    places = middle[:, :2] - axis
    radius = (share * np.linalg.norm(places, axis=1)).sum() / volume
    flatly = (share[:, None] * places).sum(axis=0) / volume + axis
    return Measured(volume, np.array([*flatly, level / volume]), radius)


def read_mesh(place: Any, number: int) -> tuple[np.ndarray, ...]:
    """Return vertices, faces, drops and their radii of a frame."""
    with np.load(place.frame(number)) as file:
        return tuple(file[name] for name in ("vertices", "faces", "drops", "radii"))


def measured(place: Any, frames: int) -> list[Measured]:
    """Measure the frames of a film; drops beside the mesh count, too."""
    facts, found = facts_of(place), []
    axis = np.array(facts["centre"][:2])
    for number in range(frames + 1):
        vertices, faces, drops, radii = read_mesh(place, number)
        mesh = above(vertices, faces, facts["pool"] + CLEAR, axis)
        weights = np.append(4 / 3 * np.pi * radii.astype(float) ** 3, mesh.volume)
        centres = np.vstack([drops, mesh.centre])
        away = np.append(np.linalg.norm(drops[:, :2] - axis, axis=1), mesh.radius)
        weights[:-1] *= drops[:, 2] > facts["pool"] + CLEAR
        found.append(
            Measured(
                weights.sum(),
                np.average(centres, axis=0, weights=weights),
                float(np.average(away, weights=weights)),
            )
        )
    return found


def draw_curves(places: Sequence[Any], options: Any, path: Path) -> dict[str, float]:
    """Draw height and radius over time; return the solvers' greatest distance over the size."""
    found = {(place.solver, place.flow): measured(place, options.frames) for place in places}
    times = np.arange(options.frames + 1) * FRAME_MS
    style: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False}
    lines = {"ours": "-", "mantaflow": (0, (4, 1.5))}
    colours = {"moving": "#0072b2", "still": "#d55e00"}
    with rc_context(style):
        figure = Figure(figsize=(7.5, 3.2))
        height, radius = figure.subplots(1, 2)
        for (solver, flow), film in found.items():
            label = f"{TITLES[solver]}, {TITLES[flow]}"
            look = {"color": colours[flow], "linestyle": lines[solver], "label": label}
            height.plot(times, [one.centre[2] for one in film], **look)
            radius.plot(times, [one.radius for one in film], **look)
        height.set_ylabel("height of the centre of mass (units)")
        radius.set_ylabel("mean radius (units)")
        for axes in (height, radius):
            axes.set_xlabel("time of the liquid (ms)")
        figure.legend(*height.get_legend_handles_labels(), loc="upper center", ncols=2,
                      frameon=False)  # fmt: skip
        figure.tight_layout(rect=(0, 0, 1, 0.86))
        figure.savefig(path, dpi=150)
    size = max(facts_of(places[0])["size"])
    report = {}
    for flow in ("moving", "still"):
        a, b = (
            np.array([one.centre for one in found[solver, flow]])[: COMPARED + 1]
            for solver in ("ours", "mantaflow")
        )
        report[f"{flow}_apart"] = float(np.linalg.norm(a - b, axis=1).max() / size)
    for (solver, flow), film in found.items():
        report[f"{solver}_{flow}_rises"] = float(film[-1].centre[2] - film[0].centre[2])
        report[f"{solver}_{flow}_spreads"] = float(film[-1].radius - film[0].radius)
        report[f"{solver}_{flow}_volume"] = float(film[-1].volume / film[0].volume)
    return report
