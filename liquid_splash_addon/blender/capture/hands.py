# SPDX-License-Identifier: GPL-3.0-or-later
"""What a running session tells of the hands: where the pens are, and which buttons are pressed."""

from __future__ import annotations

import time
from typing import Any

import bpy
import numpy as np

from ...core.sketch.recording import Pose, tip_of
from .action_set import CLICK, NAME, index_of
from .bindings import BUTTONS, DRAW, HANDS, HAPTIC, name_of

TICK_SECONDS, TICK_STRENGTH = 0.03, 0.6
"""Of the vibration at both ends of a stroke; the frequency is the controller's best."""


def scale_of(context: bpy.types.Context) -> float:
    """Return world units per metre that a hand moves."""
    manager = context.window_manager
    state = manager.xr_session_state
    # Since 5.2 the session's own view scale and the scene's units count too.
    viewed = getattr(state, "viewer_scale", 0.0) or state.navigation_scale
    return float(manager.xr_session_settings.base_scale * viewed)


def pose_of(context: bpy.types.Context, hand: int, reach: float) -> Pose | None:
    """Return a hand's pen tip now; None before the session knows where the hand is.

    reach : metres from the aim to the tip
    """
    state = context.window_manager.xr_session_state
    index = index_of(HANDS[hand])
    location = np.array(state.controller_aim_location_get(context, index))
    if not location.any():  # nothing was drawn yet: all poses are zero
        return None
    rotation = np.array(state.controller_aim_rotation_get(context, index))
    scale = scale_of(context)
    tip = tip_of(location, rotation, reach, scale)
    pressure = float(np.clip(value_of(context, DRAW, hand), 0.0, 1.0))
    return Pose(time.perf_counter(), tuple(tip), pressure, scale)


def value_of(context: bpy.types.Context, action: str, hand: int) -> float:
    """Return how far one of our buttons is pressed, 0..1."""
    state = context.window_manager.xr_session_state
    return float(state.action_state_get(context, NAME, name_of(action, hand), HANDS[hand])[0])


def tick(context: bpy.types.Context, hand: int, strength: float = TICK_STRENGTH) -> bool:
    """Have a controller vibrate for a moment; whether the session took it."""
    state = context.window_manager.xr_session_state
    return bool(
        state.haptic_action_apply(context, NAME, HAPTIC, HANDS[hand], TICK_SECONDS, 0.0, strength)
    )


class Buttons:
    """Notices when buttons go down."""

    def __init__(self) -> None:
        """Begin with all of them up."""
        self._down: dict[tuple[str, int], bool] = {}

    def pressed(self, context: bpy.types.Context) -> list[tuple[str, int]]:
        """List the buttons, with their hands, that have gone down since the last look."""
        found: list[tuple[str, int]] = []
        for action in BUTTONS:
            for hand in range(len(HANDS)):
                if action == DRAW:
                    continue
                is_down = value_of(context, action, hand) > CLICK
                if is_down and not self._down.get((action, hand), False):
                    found.append((action, hand))
                self._down[action, hand] = is_down
        return found


def is_running(context: bpy.types.Context) -> bool:
    """Whether there is a session."""
    kind: Any = bpy.types.XrSessionState
    return bool(kind.is_running(context))


def is_ending(context: bpy.types.Context) -> bool:
    """Whether a session was told to end and the runtime has not let go of it yet."""
    return context.window_manager.xr_session_state is not None and not is_running(context)
