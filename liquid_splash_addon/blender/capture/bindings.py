# SPDX-License-Identifier: GPL-3.0-or-later
"""Which button of which controller does what (OpenXR 1.0, 6.4: interaction profiles)."""

from __future__ import annotations

from typing import NamedTuple

HANDS = ("/user/hand/left", "/user/hand/right")
"""OpenXR's names for the hands, in the order in which Blender numbers controllers."""

SIDES = ("Left", "Right")

GRIP, AIM, HAPTIC, GRAB = "splash_grip", "splash_aim", "splash_haptic", "splash_grab"
DRAW, UNDO, GENERATE, GAIN = "splash_draw", "splash_undo", "splash_generate", "splash_gain"

BUTTONS = {
    DRAW: "Draw",
    UNDO: "Undo Stroke",
    GENERATE: "Generate Splash",
    GAIN: "Speed Gain",
}
"""What the buttons do, as shown to users."""

MOVED = ("thumbstick", "trackpad")
"""Parts that are moved as well as pressed."""

GRAB_LABEL = "Move, Turn, Scale"

Inputs = tuple[str, str]
"""The component of the left and of the right hand; "" where there is none."""


def both(path: str) -> Inputs:
    """Return the same component for both hands."""
    return path, path


class Controller(NamedTuple):
    """A kind of controller: an interaction profile, and what its inputs do."""

    label: str
    profile: str
    inputs: dict[str, Inputs]
    grab: Inputs


CONTROLLERS = {
    "TOUCH": Controller(
        "Meta Touch",
        "/interaction_profiles/oculus/touch_controller",
        {
            DRAW: both("/input/trigger/value"),
            UNDO: ("/input/x/click", "/input/a/click"),
            GENERATE: ("/input/y/click", "/input/b/click"),
            GAIN: both("/input/thumbstick/click"),
        },
        both("/input/squeeze/value"),
    ),
    "INDEX": Controller(
        "Valve Index",
        "/interaction_profiles/valve/index_controller",
        {
            DRAW: both("/input/trigger/value"),
            UNDO: both("/input/a/click"),
            GENERATE: both("/input/b/click"),
            GAIN: both("/input/thumbstick/click"),
        },
        both("/input/squeeze/force"),
    ),
    "VIVE": Controller(
        "HTC Vive",
        "/interaction_profiles/htc/vive_controller",
        {
            DRAW: both("/input/trigger/value"),
            UNDO: ("/input/menu/click", ""),
            GENERATE: ("", "/input/menu/click"),
            GAIN: both("/input/trackpad/click"),
        },
        both("/input/squeeze/click"),
    ),
    "WMR": Controller(
        "Windows Mixed Reality",
        "/interaction_profiles/microsoft/motion_controller",
        {
            DRAW: both("/input/trigger/value"),
            UNDO: both("/input/menu/click"),
            GENERATE: both("/input/trackpad/click"),
            GAIN: both("/input/thumbstick/click"),
        },
        both("/input/squeeze/click"),
    ),
    "SIMPLE": Controller(
        "Other (Simple Controller)",
        "/interaction_profiles/khr/simple_controller",
        {
            DRAW: both("/input/select/click"),
            UNDO: ("/input/menu/click", ""),
            GENERATE: ("", "/input/menu/click"),
            GAIN: both(""),
        },
        both(""),
    ),
}


def name_of(action: str, hand: int) -> str:
    """Return the name of a button's action for a hand: each has its own, to act at once."""
    return f"{action}_{SIDES[hand].lower()}"


def component(path: str) -> str:
    """Return which part of a controller a path is about: ``/input/trigger/value`` the trigger.

    Pressing a stick or pad is another part than moving it.
    """
    _, _, part, what = path.split("/")
    return f"{part}/{what}" if part in MOVED else part


def used_inputs() -> set[tuple[str, str, str]]:
    """List the parts that our buttons use: (profile, hand, part)."""
    return {
        (kind.profile, hand, component(path))
        for kind in CONTROLLERS.values()
        for paths in kind.inputs.values()
        for hand, path in zip(HANDS, paths, strict=True)
        if path
    }


def shown(path: str) -> str:
    """Return a component as words: ``/input/x/click`` is X."""
    _, _, part, what = path.split("/")
    if part in MOVED and what == "click":
        return f"Press {part}"
    return part.upper() if len(part) == 1 else part.capitalize()


def described(kind: str) -> list[tuple[str, str]]:
    """List what a controller's buttons do, and which they are, as shown to users."""
    controller = CONTROLLERS[kind]
    rows = [(BUTTONS[action], paths) for action, paths in controller.inputs.items()]
    return [(label, in_words(paths)) for label, paths in [*rows, (GRAB_LABEL, controller.grab)]]


def in_words(paths: Inputs) -> str:
    """Return the inputs of both hands as words."""
    words = [shown(path) if path else "" for path in paths]
    if words[0] == words[1]:
        return words[0] or "none: use the panel"
    sided = [f"{word} ({side.lower()})" for word, side in zip(words, SIDES, strict=True) if word]
    return ", ".join(sided)
