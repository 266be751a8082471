# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracked motion of controllers, as A-Frame's motion capture records it (JSON).

For each device (``camera``, ``left``, ``right``) a list of poses: position in metres, y up, and
timestamp in milliseconds; for controllers also events with a name and a timestamp. What lies
between ``triggerdown`` and ``triggerup`` is a stroke. Recordings without these names have
``buttondown`` and ``buttonup`` with the number of the button.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..sketch.drawing import Drawing
from .axes import to_blender
from .limits import StrokeFileError, check_counts

DOWN, UP = 0, 1
"""Places in the names of a pair of events."""

TRIGGER, BUTTON = ("triggerdown", "triggerup"), ("buttondown", "buttonup")

HEAD = "camera"
"""The device that does not draw."""


def is_tracking(content: Any) -> bool:
    """Whether parsed JSON is tracked motion: some device has poses."""
    return isinstance(content, dict) and any(
        isinstance(device, dict) and isinstance(device.get("poses"), list)
        for device in content.values()
    )


def read_tracking(content: dict[str, Any]) -> tuple[list[Drawing], list[str]]:
    """Return the strokes of all controllers, in the order in which they began, and warnings.

    Raises StrokeFileError where no controller has poses.
    """
    found: list[tuple[float, Drawing]] = []
    warnings: list[str] = []
    devices = 0
    for name, device in content.items():
        if name == HEAD or not isinstance(device, dict):
            continue
        poses = read_poses(device.get("poses"))
        if not len(poses):
            continue
        devices += 1
        check_counts(0, len(poses))
        downs, ups = trigger_times(device)
        if not len(downs):
            warnings.append(f"'{name[:40]}' has no trigger events: its whole motion is one stroke")
            found.append((poses[0, 3], to_drawing(poses)))
        check_counts(len(found) + len(downs))
        found += [(down, cut(poses, down, ups)) for down in downs.tolist()]
    if not devices:
        raise StrokeFileError("No controller in the file has poses: nothing was drawn")
    found.sort(key=lambda entry: entry[0])
    return [drawing for _, drawing in found], warnings


def read_poses(poses: Any) -> np.ndarray:
    """Return position and time (ms) of each pose, float64 ``(n, 4)``; NaN where it has none."""
    if not isinstance(poses, list):
        return np.zeros((0, 4))
    rows = []
    for pose in poses:
        pose = pose if isinstance(pose, dict) else {}
        place = pose.get("position")
        place = place if isinstance(place, dict) else {}
        rows.append([*(number(place.get(axis)) for axis in "xyz"), number(pose.get("timestamp"))])
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def number(value: Any) -> float:
    """Return a JSON number; NaN for anything else."""
    try:
        return float(value) if isinstance(value, (int, float)) else float("nan")
    except OverflowError:
        return float("nan")


def trigger_times(device: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return when the trigger went down and when it went up, ms, sorted; float64 ``(n,)`` each."""
    events = device.get("events")
    events = [e for e in events if isinstance(e, dict)] if isinstance(events, list) else []
    named = any(event.get("name") in TRIGGER for event in events)
    if not named:
        trigger = trigger_button(device.get("gamepad"))
        events = [event for event in events if button_of(event) == trigger]
    names = TRIGGER if named else BUTTON
    return event_times(events, names[DOWN]), event_times(events, names[UP])


def trigger_button(gamepad: Any) -> int:
    """Return the number of the trigger: 0 by WebXR's standard, 1 in the gamepads before it."""
    return 0 if isinstance(gamepad, dict) and gamepad.get("mapping") == "xr-standard" else 1


def button_of(event: dict[str, Any]) -> Any:
    """Return the number of the button that an event is about; None if there is none."""
    detail = event.get("detail")
    return detail.get("id") if isinstance(detail, dict) else None


def event_times(events: list[dict[str, Any]], name: str) -> np.ndarray:
    """Return when the events of a name happened, ms, sorted; float64 ``(n,)``."""
    found = [number(event.get("timestamp")) for event in events if event.get("name") == name]
    times = np.sort(np.array(found, dtype=np.float64))
    return times[np.isfinite(times)]


def cut(poses: np.ndarray, down: float, ups: np.ndarray) -> Drawing:
    """Return what was drawn from ``down`` until the trigger's next release, or the end."""
    later = ups[ups > down]
    until = later[0] if len(later) else np.inf
    return to_drawing(poses[(poses[:, 3] >= down) & (poses[:, 3] <= until)])


def to_drawing(poses: np.ndarray) -> Drawing:
    """Return the stroke of some poses ``(n, 4)``."""
    return Drawing(to_blender(poses[:, :3], "y-up"), poses[:, 3] / 1000.0)
