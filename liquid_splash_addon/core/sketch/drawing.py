# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawings: what a pen or a controller recorded, before speed is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..scale import Scale
from ..settings import SplashSettings
from .local_frame import fit_scale
from .strokes import Stroke, StrokeError, arc_length

VELOCITY_WINDOW = 0.06
"""Seconds over which speed is estimated. Recorded times jitter by an event or two (11-45 ms)."""

STALL = 4.0
"""Speed over the stroke's mean speed from which recorded times are not believed."""


@dataclass(frozen=True)
class Drawing:
    """One recorded stroke, in the drawing's own units (Blender units).

    Attributes
    ----------
    points : float ``(n, 3)``
    times : float ``(n,)`` seconds since the stroke began, or None where none were recorded
    pressures : float ``(n,)`` in 0..1, or None
    speeds : float ``(n,)``, the hand's speed where it was stored, units per second, or None
    factors : float ``(n,)`` on the speed, wherever that comes from, see :mod:`.flow`, or None
    colour : linear red, green and blue that it was drawn in, or None
    """

    points: np.ndarray
    times: np.ndarray | None = None
    pressures: np.ndarray | None = None
    speeds: np.ndarray | None = None
    factors: np.ndarray | None = None
    colour: tuple[float, float, float] | None = None

    @property
    def is_timed(self) -> bool:
        """Whether the times say anything (scripts, fills and imports leave them all equal)."""
        return self.times is not None and len(self.times) > 1 and bool(np.ptp(self.times) > 0)


def estimate_velocity(
    points: np.ndarray, times: np.ndarray, window: float = VELOCITY_WINDOW
) -> np.ndarray:
    """Return the velocity at each point, float64 ``(n, 3)``, units per second.

    Speed is the arc length covered in ``window`` seconds (at most a quarter of the stroke)
    around the point, over the time taken; direction is that of the arc over the same window.
    Raw differences of recorded times would be noise: events are clumped, and points between
    them carry interpolated times. When the interface stalls, a second's worth of events gets
    the time of a blink: where the speed comes out above STALL times the stroke's mean, the
    window is doubled until it does not.

    points : ``(n, 3)``; times : ``(n,)`` seconds, not decreasing, not all equal.
    """
    along = arc_length(points)
    times = np.maximum.accumulate(np.asarray(times, dtype=np.float64))
    # Of points that share a time keep the last: all of them were reached by then.
    last = np.append(np.diff(times) > 0, True)
    total = float(np.ptp(times))
    windows = np.full(len(times), min(window, total / 4))
    while True:
        early = np.clip(times - windows / 2, times[0], times[-1])
        late = np.clip(times + windows / 2, times[0], times[-1])
        travelled = [np.interp(t, times[last], along[last]) for t in (early, late)]
        speed = (travelled[1] - travelled[0]) / (late - early)
        stalled = (speed > STALL * along[-1] / total) & (windows < 2 * total)
        if not stalled.any():
            return speed[:, None] * tangents(points, *travelled)
        windows[stalled] *= 2


def tangents(
    points: np.ndarray, behind: np.ndarray | None = None, ahead: np.ndarray | None = None
) -> np.ndarray:
    """Return unit tangents of a polyline, float64 ``(n, 3)``.

    points : ``(n, 3)``. behind, ahead : arc lengths ``(n,)`` between which the direction is
    taken; by default a 32nd of the stroke to either side. A stretch that closes on itself
    takes the direction of its nearest segment.
    """
    along = arc_length(points)
    if behind is None or ahead is None:
        behind, ahead = along - along[-1] / 32, along + along[-1] / 32
    # A window in which the pen rested still needs a direction.
    reach = max(float(along[-1]) * 1e-3, 1e-12)
    ends = []
    for position in (np.minimum(behind, along - reach), np.maximum(ahead, along + reach)):
        position = np.clip(position, 0.0, along[-1])
        ends.append(np.stack([np.interp(position, along, points[:, a]) for a in range(3)], axis=1))
    chord = ends[1] - ends[0]
    size = np.linalg.norm(chord, axis=1, keepdims=True)
    short = size < 1e-3 * (ends_apart(behind, ahead, along)[:, None] + reach)
    return np.where(short, segment_directions(points), chord / np.maximum(size, 1e-30))


def ends_apart(behind: np.ndarray, ahead: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the arc length ``(n,)`` between both ends, clipped to the stroke."""
    return np.clip(ahead, 0, along[-1]) - np.clip(behind, 0, along[-1])


def segment_directions(points: np.ndarray) -> np.ndarray:
    """Return at each point ``(n, 3)`` the unit direction of the segment that leads to it.

    Segments without length take the direction of the last one that has some.
    """
    steps = np.diff(points.astype(np.float64), axis=0)
    size = np.linalg.norm(steps, axis=1)
    moving = np.flatnonzero(size > 0)
    latest = np.searchsorted(moving, np.arange(len(steps)), side="right") - 1
    chosen = moving[np.concatenate([latest[:1], latest]).clip(0)]
    return np.asarray(steps[chosen] / size[chosen, None])


def strokes_from_drawings(
    drawings: Sequence[Drawing], settings: SplashSettings, scale: Scale | None = None
) -> tuple[list[Stroke], list[str]]:
    """Give every drawing its velocities by ``settings.speed_source``.

    scale : of the drawing; by default from ``settings.real_size``.

    Returns the strokes (drawing units, drawing units per second) and warnings for the user.
    Drawings that cannot be used are left out with a warning. Raises StrokeError where none is left.
    """
    drawings, _, left_out = usable_drawings(drawings)
    if scale is None:
        scale = drawing_scale(drawings, settings.real_size)
    strokes: list[Stroke] = []
    lacking = 0
    hand_speed = scale.velocities_to_drawing(settings.stroke_speed)
    for drawing in drawings:
        velocities = known_velocity(drawing, settings, hand_speed)
        if velocities is None:
            lacking += 1
            velocities = hand_speed * tangents(drawing.points)
        if drawing.factors is not None:
            velocities = drawing.factors[:, None] * velocities
        strokes.append(Stroke(drawing.points, velocities))
    warnings = left_out
    if lacking:
        warnings.append(
            f"{lacking} of {len(drawings)} strokes have no {LACKS[settings.speed_source]}: "
            f"drawn at a constant {settings.stroke_speed:g} m/s"
        )
    return strokes, warnings


LACKS = {"TIME": "recorded time", "ATTRIBUTE": "stored speed or time", "PRESSURE": "pressure"}
"""What strokes without a speed do not have, by the source of speed."""


def known_velocity(
    drawing: Drawing, settings: SplashSettings, hand_speed: float
) -> np.ndarray | None:
    """Return a drawing's velocities ``(n, 3)`` by ``settings.speed_source``, in its own units.

    hand_speed : the setting Stroke Speed, in the drawing's units per second
    None where it lacks what that needs. Stored speeds take their place before times.
    """
    source = settings.speed_source
    if source == "CONSTANT":
        return hand_speed * tangents(drawing.points)
    if source == "PRESSURE" and drawing.pressures is not None:
        speed = hand_speed * np.asarray(drawing.pressures)
        return speed[:, None] * tangents(drawing.points)
    if source == "ATTRIBUTE" and drawing.speeds is not None:
        return np.asarray(drawing.speeds)[:, None] * tangents(drawing.points)
    if source in ("TIME", "ATTRIBUTE") and drawing.is_timed:
        return estimate_velocity(drawing.points, np.asarray(drawing.times))
    return None


def backward(drawing: Drawing) -> Drawing:
    """Return a drawing drawn the other way: at each place as fast as before."""

    def turned(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else values[::-1]

    times = None if drawing.times is None else drawing.times[-1] - drawing.times[::-1]
    return Drawing(
        drawing.points[::-1],
        times,
        turned(drawing.pressures),
        turned(drawing.speeds),
        turned(drawing.factors),
        drawing.colour,
    )


def drawing_scale(drawings: Sequence[Drawing], real_size: float) -> Scale:
    """Return the scale at which the longest side measures ``real_size``, see :func:`fit_scale`."""
    return fit_scale([np.asarray(d.points, dtype=np.float64) for d in drawings], real_size)


def fault_of(drawing: Drawing) -> str:
    """Return why no stroke can be made of a drawing, in a few words; "" if one can."""
    points = np.asarray(drawing.points, dtype=np.float64)
    if len(points) < 2:
        return "of a single point"
    given = [v for v in (drawing.times, drawing.pressures, drawing.speeds) if v is not None]
    if not all(np.isfinite(values).all() for values in (points, *given)):
        return "with a position, time or pressure that is not a number"
    if arc_length(points.astype(np.float32))[-1] <= 0:
        return "without length"
    return ""


def usable_drawings(drawings: Sequence[Drawing]) -> tuple[list[Drawing], list[int], list[str]]:
    """Leave out the drawings of which no stroke can be made: a tap of the pen leaves one.

    Returns the others, the places in ``drawings`` of those left out, and warnings about them.
    Raises StrokeError, with advice, where none is left.
    """
    faults = [fault_of(drawing) for drawing in drawings]
    usable = [drawing for drawing, fault in zip(drawings, faults, strict=True) if not fault]
    if not drawings:
        raise StrokeError("Draw at least one stroke first")
    if not usable:
        raise StrokeError(
            f"None of the {len(drawings)} stroke(s) can be used, the first is one {faults[0]}: "
            "draw a longer one"
        )
    warnings = [
        f"Left out {faults.count(fault)} stroke(s) {fault}"
        for fault in dict.fromkeys(filter(None, faults))
    ]
    return usable, [n for n, fault in enumerate(faults) if fault], warnings
