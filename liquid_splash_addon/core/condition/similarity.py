# SPDX-License-Identifier: GPL-3.0-or-later
"""Any size from a thimble to a harbour wave: liquid as its model of a size that was trained on.

The generator was trained on splashes of a few decimetres in a box of 0.4 m. Liquid that inertia and
gravity move looks the same at every size where its Froude number, v^2 / (g L), is the same: lengths
go by a ratio, speeds and times by its root (Froude similarity). The liquid that was trained on had
no surface tension, so that this is as exact as the training was. What surface tension does is
computed afterwards, at the real size.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..grid import Grid
from ..scale import Scale
from ..sketch.strokes import Stroke, resampled_points
from .voxelize import outside_share

SMALLEST = 0.1
"""Metres of the smallest sketch that the generator sees as it is: 32 of its cells. Smaller ones
come out as lumps, as thin sheets are two cells thick."""

LEAST_OUTSIDE = 0.005
"""Share of the strokes' length that may lie outside the box."""

AS_IT_IS = Scale(1.0)


def model_scale(strokes: Sequence[Stroke]) -> Scale:
    """Return how real metres and seconds are measured in the model that the generator sees.

    strokes : real metres, axes and origin those of the box. Nothing is scaled where they fit it
    and are no smaller than SMALLEST.
    """
    size = extent(strokes)
    if size >= SMALLEST and outside_share(strokes, Grid.local()) < LEAST_OUTSIDE:
        return AS_IT_IS
    ratio = largest_ratio(strokes, size)
    return Scale.similar(min(ratio, SMALLEST / size) if size < SMALLEST else ratio)


def is_model(scale: Scale) -> bool:
    """Whether the generator sees another size than the real one."""
    return scale.length != AS_IT_IS.length


def extent(strokes: Sequence[Stroke]) -> float:
    """Return the longest side of the strokes' box along their own axes."""
    points = np.concatenate([stroke.points for stroke in strokes])
    return max(float(np.ptp(points, axis=0).max()), 1e-12)


def largest_ratio(strokes: Sequence[Stroke], size: float) -> float:
    """Return by how much strokes may be scaled about the box's centre for them to fit the box.

    size : of :func:`extent`
    """
    grid = Grid.local()
    first = grid.size[0] / size  # or strokes of a kilometre would be resampled at a millimetre
    points, _ = resampled_points(scaled(strokes, first), grid.spacing / 2)
    # Scaling about the centre moves a point to the wall when its largest coordinate gets there.
    reach = float(np.quantile(np.abs(points).max(axis=1), 1 - LEAST_OUTSIDE))
    ratio = first * grid.size[0] / 2 / max(reach, 1e-9)
    # At another size the strokes are resampled at other points: make sure.
    while outside_share(scaled(strokes, ratio), grid) >= 0.98 * LEAST_OUTSIDE:
        ratio *= 0.995
    return ratio


def scaled(strokes: Sequence[Stroke], ratio: float) -> list[Stroke]:
    """Return the strokes at another size, as fast as before."""
    return [
        Stroke(ratio * stroke.points.astype(np.float64), stroke.velocities) for stroke in strokes
    ]


def at_real_size(strokes: Sequence[Stroke], model: Scale) -> Sequence[Stroke]:
    """Return strokes of a model, metres and m/s, as large and fast as the real ones."""
    if not is_model(model):
        return strokes
    return [
        Stroke(
            model.lengths_to_drawing(stroke.points), model.velocities_to_drawing(stroke.velocities)
        )
        for stroke in strokes
    ]


def in_words(scale: Scale, strokes: Sequence[Stroke]) -> str:
    """Say what is computed, and what is approximate; "" where nothing is scaled.

    strokes : real metres
    """
    if not is_model(scale):
        return ""
    size, ratio = extent(strokes), scale.length
    of_model = length_in_words(size * ratio)
    model = f"1:{1 / ratio:.3g}" if ratio < 1 else f"{ratio:.3g}:1"
    cell = length_in_words(scale.lengths_to_drawing(Grid.local().spacing))
    return (
        f"{length_in_words(size)} splash, made as a {model} model ({of_model}) "
        f"by Froude's law; details below {cell} are not resolved"
    )


def length_in_words(metres: float) -> str:
    """Write a length with a unit in which it is a short number."""
    units = ((1.0, "m"), (0.01, "cm"), (0.001, "mm"))
    unit, name = next((one for one in units if metres >= 0.999 * one[0]), units[-1])
    number = metres / unit
    return f"{number:.2g} {name}" if number < 100 else f"{number:.0f} {name}"
