# SPDX-License-Identifier: GPL-3.0-or-later
"""The action set with which one draws: the session's own, with our actions in it.

A session has only one action set active at a time, and takes no new ones after its start. So at
every start a copy of the set that the session runs with is added. In the copy, what was on our
inputs (the trigger teleports) rests, and the rest works as before. Drawing makes the copy the
active set; ending it, the original. Where no other add-on has made a set, the copy is of an empty
one: poses, our buttons, and grabbing to move.
"""

from __future__ import annotations

from typing import Any

import bpy

from . import bindings
from .bindings import AIM, CONTROLLERS, GRAB, GRIP, HANDS, HAPTIC

NAME = "splash"
"""Of our action set."""

CLICK = 0.5
"""Value from which a button counts as pressed."""

_original = ""
_hands: list[str] = []


def original() -> str:
    """Return the name of the set that the session began with; "" if it has none but ours."""
    return _original


def index_of(hand: str) -> int:
    """Return the number by which the session knows a hand's controller."""
    return _hands.index(hand) if hand in _hands else HANDS.index(hand)


def is_there(state: Any) -> bool:
    """Whether the session has our set: it does not if it was started before the add-on."""
    return state.actionmaps.find(state, NAME) is not None


@bpy.app.handlers.persistent
def before_session(_scene: Any = None, _unused: Any = None) -> None:
    """Build the set after all other handlers have built theirs, in whatever order they are."""
    # Blender looks at the length of the list anew for each handler.
    bpy.app.handlers.xr_session_start_pre.append(build)


def build(_scene: Any = None, _unused: Any = None) -> None:
    """Build our set from what is there, for the session that starts now."""
    bpy.app.handlers.xr_session_start_pre.remove(build)
    context = bpy.context
    state = context.window_manager.xr_session_state
    if state is not None:
        create(context, state, action_map(state))


def action_map(state: Any) -> Any:
    """Make the map: a copy of the session's first one that has poses, and our actions."""
    global _original
    found = next((known for known in state.actionmaps if has_poses(known)), None)
    _original = found.name if found is not None else ""
    if found is None:
        made = state.actionmaps.new(state, NAME, True)
        add_poses(made)
    else:
        made = state.actionmaps.new_from_actionmap(state, found)
        made.name = NAME
        leave_out_extensions(made)
        leave_out_conflicts(made)
    add_buttons(made)
    return made


def has_poses(known: Any) -> bool:
    """Whether a map tells where the controllers are."""
    items = known.actionmap_items
    return any(i.pose_is_controller_grip for i in items) and any(
        i.pose_is_controller_aim for i in items
    )


def leave_out_conflicts(made: Any) -> None:
    """Remove from a map the bindings to our inputs, and the actions that have no other."""
    ours = bindings.used_inputs()
    for item in list(made.actionmap_items):
        if item.type in {"POSE", "VIBRATION"}:
            continue
        hands = [path.path for path in item.user_paths]
        for binding in list(item.bindings):
            paths = [path.path for path in binding.component_paths]
            parts = {
                (binding.profile, hand, bindings.component(path))
                for hand, path in zip(hands, paths, strict=False)
            }
            if parts & ours:
                item.bindings.remove(binding)
        if not len(item.bindings):
            made.actionmap_items.remove(item)


def leave_out_extensions(made: Any) -> None:
    """Remove bindings to controllers of OpenXR extensions, unless the stock add-on uses them too.

    A session in which one of them is not switched on does not start if such a binding is made.
    """
    known = {controller.profile for controller in CONTROLLERS.values()}
    for item in made.actionmap_items:
        for binding in list(item.bindings):
            is_on = getattr(bpy.context.scene, f"vr_actions_enable_{binding.name}", False)
            if binding.profile not in known and not is_on:
                item.bindings.remove(binding)


def add_poses(made: Any) -> None:
    """Add what every map needs: where the controllers are. And grabbing, to move about."""
    for name, kind in ((GRIP, "grip"), (AIM, "aim")):
        item = new_item(made, name, "POSE", HANDS)
        setattr(item, f"pose_is_controller_{kind}", True)
        for key, controller in CONTROLLERS.items():
            bind(item, key, controller.profile, [f"/input/{kind}/pose"] * 2)
    item = new_item(made, GRAB, "FLOAT", HANDS)
    item.op, item.op_mode, item.bimanual = "wm.xr_navigation_grab", "MODAL", True
    for key, controller in CONTROLLERS.items():
        if all(controller.grab):
            bind(item, key, controller.profile, controller.grab)


def add_buttons(made: Any) -> None:
    """Add our actions. They call no operators: the drawing session reads their states."""
    haptic = new_item(made, HAPTIC, "VIBRATION", HANDS)
    for key, controller in CONTROLLERS.items():
        bind(haptic, key, controller.profile, ["/output/haptic"] * 2)
    for action in bindings.BUTTONS:
        for hand, path in enumerate(HANDS):
            item = new_item(made, bindings.name_of(action, hand), "FLOAT", [path])
            for key, controller in CONTROLLERS.items():
                if controller.inputs[action][hand]:
                    bind(item, key, controller.profile, [controller.inputs[action][hand]])


def new_item(made: Any, name: str, kind: str, hands: Any) -> Any:
    """Add an action for some hands to a map."""
    item = made.actionmap_items.new(name, True)
    item.type = kind
    for hand in hands:
        item.user_paths.new(hand)
    return item


def bind(item: Any, name: str, profile: str, paths: Any) -> None:
    """Bind an action to one input for each of its hands."""
    binding = item.bindings.new(name.lower(), True)
    binding.profile = profile
    for path in paths:
        binding.component_paths.new(path)
    if item.type == "FLOAT":
        binding.threshold = CLICK


def create(context: bpy.types.Context, state: Any, made: Any) -> None:
    """Have the session create the actions of our map; it is not made the active set yet."""
    global _hands
    if not state.action_set_create(context, made):
        return
    poses = {}
    for item in made.actionmap_items:
        if not len(item.bindings) or not state.action_create(context, made, item):
            continue
        if item.type == "POSE":
            poses["grip" if item.pose_is_controller_grip else "aim"] = item.name
            _hands = [path.path for path in item.user_paths]
        for binding in item.bindings:
            state.action_binding_create(context, made, item, binding)
    state.controller_pose_actions_set(context, NAME, poses["grip"], poses["aim"])


def activate(context: bpy.types.Context, name: str) -> None:
    """Make a set the active one, at the session's next step."""
    state = context.window_manager.xr_session_state
    if state is not None and name:
        state.active_action_set_set(context, name)


def register() -> None:
    """Build our set at the start of every session."""
    bpy.app.handlers.xr_session_start_pre.append(before_session)


def unregister() -> None:
    """Leave sessions alone."""
    bpy.app.handlers.xr_session_start_pre.remove(before_session)
