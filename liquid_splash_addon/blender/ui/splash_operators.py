# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons beside Generate: other seeds, a fitting speed, following the sketch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import bpy
from bpy.props import BoolProperty, IntProperty

from ...core.settings import LATENT_SEED_MAX, SplashSettings
from ...core.sketch.drawing import strokes_from_drawings
from ...core.sketch.fit_speed import fitting_gain
from ...core.sketch.local_frame import Frame, fit_frame
from ...core.sketch.strokes import Stroke
from ..data.frame_text import frame_from_text
from ..data.properties import plain, to_settings
from ..jobs import problems
from ..scene import follow, targets
from ..scene.stroke_objects import read_sketch
from .operators import NO_SKETCH, SplashMaker

VARIED = 0.5
"""Variation that is set where there is none: without it all seeds give the same splash."""

FASTEST = 5.0
"""Fastest speed, m/s, of splashes that were made before it was noted."""


class SPLASH_OT_step_seed(SplashMaker, bpy.types.Operator):
    """Make the splash of the next or the previous seed"""

    bl_description = (
        "Make the splash that the next seed gives: another of the same strokes. Where Variation "
        "is 0, it is set to 0.5, because then all seeds give the same"
    )
    bl_idname = "splash.step_seed"
    bl_label = "Next Seed"
    bl_options = {"UNDO"}  # noqa: RUF012 (no redo panel: it would step again)
    step: IntProperty(name="Step", default=1, options={"SKIP_SAVE"})

    def chosen_settings(self, stored: SplashSettings) -> SplashSettings:
        """Return the stored settings with another seed."""
        seed = (stored.seed + self.step) % (LATENT_SEED_MAX + 1)
        return replace(stored, seed=seed, variation=stored.variation or VARIED)


class SplashButton:
    """What buttons share that need a sketch and are done at once."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a sketch."""
        if targets.find_target(context) is not None:
            return True
        cls.poll_message_set(NO_SKETCH)  # type: ignore[attr-defined]
        return False


class SPLASH_OT_fit_speed(SplashButton, bpy.types.Operator):
    """Set the speed gain so that the strokes are as fast as splashes are"""

    bl_description = (
        "Set Speed Gain so that the median stroke is as fast as splashes usually are, and hardly "
        "any is faster than the generator knows. Press Regenerate afterwards"
    )
    bl_idname = "splash.fit_speed"
    bl_label = "Fit Speed"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set it."""
        target = targets.find_target(context)
        splash = target.splash
        owner = context.scene if splash is None else splash
        group = owner.splash.settings
        settings = to_settings(group)
        layer = target.layer if splash is None else splash.splash.layer
        try:
            drawings, _ = read_sketch(
                (target.sketch, *target.others), layer, settings.use_modifiers
            )
            strokes, _ = strokes_from_drawings(drawings, settings)
            known = splash is not None and splash.splash.frame
            frame = (
                frame_from_text(splash.splash.frame)
                if known
                else fit_frame(strokes, settings.real_size)
            )
            fastest = (plain(splash.splash.fastest) if splash is not None else 0.0) or FASTEST
            gain = fitting_gain(*seen_by_generator(frame, strokes, fastest))
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        limits = SplashSettings.__dataclass_fields__["speed_gain"].metadata
        group.speed_gain = min(max(float(f"{gain:.3g}"), limits["low"]), limits["high"])
        self.report({"INFO"}, f"Speed Gain is {group.speed_gain:.3g}")
        return {"FINISHED"}


def seen_by_generator(
    frame: Frame, strokes: Sequence[Stroke], fastest: float
) -> tuple[list[Stroke], float]:
    """Return the strokes in real metres and m/s, and the fastest that the generator knows there.

    fastest : m/s, at sizes that it was trained on
    """
    from ...core.condition.similarity import model_scale

    local = frame.strokes_to_local(strokes)
    return local, model_scale(local).velocities_to_drawing(fastest)


class SPLASH_OT_follow(SplashButton, bpy.types.Operator):
    """Make the splash a child of its sketch, so that it moves along, or make it free again"""

    bl_idname = "splash.follow"
    bl_label = "Follow Sketch"
    on: BoolProperty(name="Follow", default=True, options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash of a sketch."""
        target = targets.find_target(context)
        if target is not None and target.splash is not None and target.splash.is_editable:
            return True
        cls.poll_message_set("Select a splash whose sketch still exists")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the parent; the splash stays where it stands."""
        target = targets.find_target(context)
        try:
            if self.on:
                follow.attach(target.splash, target.sketch)
            else:
                follow.detach(target.splash)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class SPLASH_OT_dismiss(bpy.types.Operator):
    """Hide this message"""

    bl_idname = "splash.dismiss"
    bl_label = "Hide Message"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Forget the problems that the panel shows."""
        problems.dismiss(shown_owners(context))
        return {"FINISHED"}


def shown_owners(context: bpy.types.Context) -> set[int]:
    """Return the session_uids of the objects whose problems the panel shows."""
    items: list[Any] = [context.active_object]
    if (target := targets.find_target(context)) is not None:
        items += [target.sketch, target.splash]
    return {0, *(item.session_uid for item in items if item is not None)}


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_OT_step_seed, SPLASH_OT_fit_speed, SPLASH_OT_follow, SPLASH_OT_dismiss)
)
