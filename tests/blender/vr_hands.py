# SPDX-License-Identifier: GPL-3.0-or-later
"""For the scenes of vr_script.py: hands that are sent and seen, and what they have drawn."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import bpy
import numpy as np

from liquid_splash_addon.blender.capture import feedback, hands, vr_drawing
from liquid_splash_addon.blender.scene.grease_pencil import read_drawings
from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.sketch.strokes import arc_length
from tests.blender.monado import Feeder, Hand

TIP = 0.05
LEFT, RIGHT = Hand((-0.3, 1.3, -0.5)), Hand((0.3, 1.3, -0.5))

Condition = Callable[[], bool]
Steps = Iterator[Condition]


class Hands:
    """Both hands, as they were last sent."""

    def __init__(self) -> None:
        self.feeder = Feeder(int(os.environ["VR_PORT"]))
        self.last = [LEFT, RIGHT]

    def send(self, left: Hand | None = None, right: Hand | None = None) -> Condition:
        """Send what has changed; return the condition that Blender has seen it."""
        self.last = [left or self.last[0], right or self.last[1]]
        self.feeder.send(*self.last)
        return self.seen

    def seen(self) -> bool:
        """Whether the session shows both hands where they were sent, with their triggers."""
        drawing = vr_drawing.current()
        if drawing is None or not all(drawing.poses):
            return False
        context = bpy.context
        return all(
            np.allclose(pose.point, in_world(hand.in_blender(tip())), atol=1e-4 * pose.scale)
            and abs(pose.pressure - hand.trigger) < 1e-3
            and abs(hands.value_of(context, "splash_undo", side) - hand.a) < 1e-3
            and abs(hands.value_of(context, "splash_generate", side) - hand.b) < 1e-3
            and abs(hands.value_of(context, "splash_gain", side) - hand.stick) < 1e-3
            for side, (pose, hand) in enumerate(zip(drawing.poses, self.last, strict=True))
        )

    def draw(self, side: int, path: np.ndarray, trigger: float = 0.8) -> Steps:
        """Draw along a path ``(n, 3)``, OpenXR's axes, seen point by point."""
        for place in path:
            hand = replace(self.last[side], place=tuple(map(float, place)), trigger=trigger)
            yield self.send(**{("left", "right")[side]: hand})
        yield self.lift(side)

    def lift(self, side: int) -> Condition:
        """Release a trigger."""
        return self.send(**{("left", "right")[side]: replace(self.last[side], trigger=0.0)})

    def press(self, side: int, button: str) -> Steps:
        """Press and release a button."""
        for value in (True, False):
            hand = replace(self.last[side], **{button: value})
            yield self.send(**{("left", "right")[side]: hand})


def tip() -> float:
    return bpy.context.scene.splash_capture.tip


def in_world(point: np.ndarray) -> np.ndarray:
    """Return where the session's navigation has taken a point, with its scale."""
    state = bpy.context.window_manager.xr_session_state
    matrix = np.array(state.navigation_rotation.to_matrix())
    moved = matrix @ (hands.scale_of(bpy.context) * np.asarray(point))
    return moved + np.array(state.navigation_location)


def blender_path(path: np.ndarray, reach: float = TIP) -> np.ndarray:
    """Return the world path of the tip of an unturned hand along ``path``, both ``(n, 3)``."""
    return np.array([in_world(Hand(tuple(place)).in_blender(reach)) for place in path])


def circle(centre: Sequence[float], radius: float = 0.2, count: int = 12) -> np.ndarray:
    """Return points on three quarters of a circle, upright before the viewer."""
    angles = np.linspace(0.0, 1.5 * np.pi, count)
    ring = np.stack([np.cos(angles), np.sin(angles), 0.3 * angles], axis=1)
    return np.asarray(centre) + radius * ring


def in_view(operator: Callable[..., set[str]]) -> set[str]:
    """Run an operator as a button of the 3D view's sidebar does."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "UI")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return operator()


def sketches() -> list[bpy.types.Object]:
    return [
        item
        for item in bpy.context.scene.objects
        if item.type == "GREASEPENCIL" and not feedback.is_ours(item)
    ]


def strokes() -> list[Drawing]:
    """Return all strokes in the world."""
    bpy.context.view_layer.update()
    found = []
    for sketch in sketches():
        place = np.array(sketch.matrix_world.to_3x3().normalized())
        for drawing in read_drawings(sketch)[0]:
            points = drawing.points @ place.T + np.array(sketch.matrix_world.translation)
            found.append(replace(drawing, points=points))
    return found


def away(points: np.ndarray, path: np.ndarray) -> float:
    """Return the largest distance of points ``(n, 3)`` from a polyline ``(m, 3)``."""
    start, step = path[:-1], np.diff(path, axis=0)
    along = np.einsum("nmk,mk->nm", points[:, None] - start, step)
    share = np.clip(along / np.maximum((step**2).sum(1), 1e-30), 0, 1)
    nearest = start + share[..., None] * step
    return float(np.linalg.norm(points[:, None] - nearest, axis=2).min(1).max())


def mean_speed(drawing: Drawing) -> float:
    return float(arc_length(drawing.points)[-1] / (drawing.times[-1] - drawing.times[0]))
