# SPDX-License-Identifier: GPL-3.0-or-later
"""The local frame: the strokes' own axes, found by PCA (paper, 4.2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..grid import LOCAL_SPACING
from ..scale import Scale
from .strokes import Stroke, check_strokes, resample, resampled_points

PROVISIONAL_POINTS = 256
"""Samples across the sketch while its scale, and so the half-cell step, is still unknown."""

NEAR_EQUAL = 1.15
"""Ratio of variances below which two axes could as well be any two in their plane."""

LEAST_SIZE, MOST_SIZE = 0.1, 1.0
"""Metres of sketches between which they are measured at steps of half a cell."""

DEFINITE_FLOW = 0.05
"""Share of the mean speed from which the mean flow along an axis decides the axis's sign."""

DEFINITE_SKEWNESS = 0.2
"""Skewness from which it decides, where the flow does not. A sketch drawn symmetric by hand is
not quite symmetric; its axes must not turn round with every small edit."""


@dataclass(frozen=True)
class Frame:
    """Similarity transform between the drawing and the local box.

    ``local = scale.length * axes @ (drawn - centre)``, and
    ``drawn = axes.T @ local / scale.length + centre``.

    Attributes
    ----------
    axes : float64 ``(3, 3)``, rows are the local x, y, z axes in the drawing's space
    centre : float64 ``(3,)``, the local origin, in drawing units
    scale : local metres and seconds per drawing unit and second
    """

    axes: np.ndarray
    centre: np.ndarray
    scale: Scale

    def points_to_local(self, points: np.ndarray) -> np.ndarray:
        """Map positions ``(..., 3)`` from drawing units to local metres."""
        return self.scale.lengths_to_local(points - self.centre) @ self.axes.T

    def points_to_drawing(self, points: np.ndarray) -> np.ndarray:
        """Map positions ``(..., 3)`` from local metres to drawing units."""
        return self.scale.lengths_to_drawing(points @ self.axes) + self.centre

    def vectors_to_local(self, vectors: np.ndarray) -> np.ndarray:
        """Map velocities ``(..., 3)`` from drawing units per drawing second to local m/s."""
        return self.scale.velocities_to_local(vectors) @ self.axes.T

    def vectors_to_drawing(self, vectors: np.ndarray) -> np.ndarray:
        """Map velocities ``(..., 3)`` from local m/s to drawing units per drawing second."""
        return self.scale.velocities_to_drawing(vectors @ self.axes)

    def strokes_to_local(self, strokes: Sequence[Stroke], gain: float = 1.0) -> list[Stroke]:
        """Map strokes to local metres and m/s; velocities are multiplied by ``gain``."""
        return [
            Stroke(
                self.points_to_local(stroke.points.astype(np.float64)),
                gain * self.vectors_to_local(stroke.velocities.astype(np.float64)),
            )
            for stroke in strokes
        ]

    def moved(self, matrix: np.ndarray) -> Frame:
        """Return the frame of the same liquid where the drawing is moved by ``matrix`` ``(4, 4)``.

        A similarity; a reflection makes the axes left-handed, and the liquid its mirror image.
        """
        turn = matrix[:3, :3]
        size = float(np.cbrt(abs(np.linalg.det(turn))))
        return Frame(
            self.axes @ (turn / size).T,
            turn @ self.centre + matrix[:3, 3],
            self.scale.resized(size),
        )

    def seen_as(self, model: Scale) -> Frame:
        """Return the frame that turns the drawing into a model of the liquid.

        model : how the liquid's metres and seconds are measured there
        """
        return Frame(self.axes, self.centre, self.scale.then(model))

    @property
    def is_mirrored(self) -> bool:
        """Whether the axes are left-handed."""
        return bool(np.linalg.det(self.axes) < 0)

    def turned(self, rotation: np.ndarray) -> Frame:
        """Return the frame whose local space is turned by ``rotation`` ``(3, 3)``."""
        return Frame(rotation @ self.axes, self.centre, self.scale)


def fit_frame(strokes: Sequence[Stroke], real_size: float = 0.0) -> Frame:
    """Return the local frame of ``strokes``.

    The origin is the centroid, the axes are the principal axes of the strokes resampled at
    half a cell, turned where two of them are near equal (:func:`resolved_axes`). Axes 1 and 2
    point along the mean flow; where there is none along the skewness, and in symmetric sketches
    from the strokes drawn first to those drawn last. Axis 3 is their cross product.

    real_size : longest side of the strokes' box along these axes, in metres; 0 takes the
    strokes to be in metres already.

    Raises StrokeError where no frame can be found.
    """
    check_strokes(strokes)
    points = [stroke.points.astype(np.float64) for stroke in strokes]
    scale = fit_scale(points, real_size)
    step = scale.lengths_to_drawing(step_for(scale.lengths_to_local(longest_side(points))))
    dense = [resample(stroke, step) for stroke in strokes]
    positions = np.concatenate([stroke.points for stroke in dense]).astype(np.float64)
    velocities = np.concatenate([stroke.velocities for stroke in dense]).astype(np.float64)
    order = np.repeat(np.arange(len(dense)), [len(stroke.points) for stroke in dense])
    centre, axes, variances = principal_axes(positions)
    chord = strokes[0].points[-1].astype(np.float64) - strokes[0].points[0]
    axes = resolved_axes(axes, variances, chord)
    speed = np.linalg.norm(velocities, axis=1).mean()
    first, second = (
        axis_sign(velocities @ axis / max(speed, 1e-30), (positions - centre) @ axis, order) * axis
        for axis in axes[:2]
    )
    return Frame(np.stack([first, second, np.cross(first, second)]), centre, scale)


def step_for(size: float) -> float:
    """Return the metres between the points by which a sketch of ``size`` metres is measured.

    Half a cell, and for sketches that no generator sees as they are, as many points as at the
    nearest size of those that one may.
    """
    return LOCAL_SPACING / 2 * (size / min(max(size, LEAST_SIZE), MOST_SIZE))


def fit_scale(polylines: Sequence[np.ndarray], real_size: float) -> Scale:
    """Return the scale at which the longest side of ``polylines`` measures ``real_size`` metres.

    polylines : float64 ``(n, 3)`` each; real_size : 0 takes them to be in metres already.
    """
    return Scale.of_length(real_size / longest_side(polylines) if real_size > 0 else 1.0)


def principal_axes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centroid ``(3,)``, axes (rows) ``(3, 3)`` and variances ``(3,)``, largest first."""
    centre = points.mean(axis=0)
    offsets = points - centre
    variances, columns = np.linalg.eigh(offsets.T @ offsets / len(points))
    return centre, columns.T[::-1], variances[::-1]


def resolved_axes(axes: np.ndarray, variances: np.ndarray, chord: np.ndarray) -> np.ndarray:
    """Turn axes (rows) of near-equal variance in their plane, towards ``chord`` ``(3,)``.

    A crown has no principal axis in its plane: any two would do, and rounding would choose.
    The chord of the first stroke turns with the strokes.
    """
    axes = axes.copy()
    for first, second in ((0, 1), (1, 2)):
        along, across = axes[first] @ chord, axes[second] @ chord
        size = np.hypot(along, across)
        if variances[first] < NEAR_EQUAL * variances[second] and size > 1e-6 * np.linalg.norm(
            chord
        ):
            turn = np.array([[along, across], [-across, along]]) / size
            axes[[first, second]] = turn @ axes[[first, second]]
    return axes


def longest_side(polylines: Sequence[np.ndarray]) -> float:
    """Return the longest side of the polylines' box along the axes of their local frame.

    polylines : float64 ``(n, 3)`` each. The resampling step is a share of the greatest
    distance from the mean point, which a rotation does not change.
    """
    together = np.concatenate(polylines)
    radius = np.linalg.norm(together - together.mean(axis=0), axis=1).max()
    still = [Stroke(points, np.zeros_like(points)) for points in polylines]
    positions, _ = resampled_points(still, 2 * radius / PROVISIONAL_POINTS)
    _, axes, variances = principal_axes(positions.astype(np.float64))
    axes = resolved_axes(axes, variances, polylines[0][-1] - polylines[0][0])
    return float(np.ptp(together @ axes.T, axis=0).max())


def axis_sign(flow: np.ndarray, offsets: np.ndarray, order: np.ndarray) -> float:
    """Return +1 or -1, the direction of an axis; the first definite sign of those below decides.

    flow : ``(n,)``, velocity along the axis over the mean speed; offsets : ``(n,)``, position
    along it, mean zero; order : ``(n,)``, number of the stroke that each point belongs to.
    """
    spread = max(float(offsets.std()), 1e-30)
    late = (order - order.mean()) / max(float(order.std()), 1e-30)
    candidates = (
        (flow.mean(), DEFINITE_FLOW),
        ((offsets**3).mean() / spread**3, DEFINITE_SKEWNESS),
        ((offsets * late).mean() / spread, 0.0),
    )
    for value, definite in candidates:
        if abs(value) > definite:
            return float(np.sign(value))
    return 1.0
