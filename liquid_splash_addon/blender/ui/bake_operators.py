# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that makes a splash for each frame of the timeline."""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy

from ..data.properties import is_splash
from ..jobs import bake_frames, work_queue
from ..jobs.work_queue import Work
from ..scene.keyed import count_drawings, has_keyed_settings
from ..scene.targets import shown_splash
from .queued_operator import QueuedOperator
from .simulate_operators import FramesOperator, wanted


class SPLASH_OT_bake_frames(FramesOperator, bpy.types.Operator):
    """Make a splash for each frame, of the settings and the drawing of that frame, and play them"""

    bl_idname = "splash.bake_frames"
    bl_label = "Bake Frames"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    beside = False  # it computes in this process, with the one generator
    show, write_run = staticmethod(bake_frames.show), staticmethod(bake_frames.write)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash, and no other run."""
        if shown_splash(context) is None:
            cls.poll_message_set("Select a splash: a model's are baked one by one")
            return False
        return cls.is_free()

    @classmethod
    def is_free(cls) -> bool:
        """Whether nothing is made or simulated; else say so in the tooltip."""
        if work_queue.collecting(beside=True) is None:
            return bool(QueuedOperator.is_free.__func__(cls))  # type: ignore[attr-defined]
        cls.poll_message_set("A simulation is running: press Esc to stop it")
        return False

    def begin(self, context: bpy.types.Context) -> None:
        """Read what is meant. What cannot be baked is reported, and the others are done."""
        splashes = [item for item in wanted(context) if is_splash(item)]
        self.begin_runs(
            splashes or [shown_splash(context)],
            lambda item: bake_frames.Run(bake_frames.read_order(context, item)),
        )

    def read(self) -> Work:
        """Return the work: what was asked for at first."""
        return Work(id(self), partial(bake_frames.bake_all, self._runs), self.write)

    def done(self) -> set[str]:
        """Say how much was made, and which frames have no liquid."""
        made = sum(run.made for run in self._runs)
        self.report({"INFO"}, f"{made} splash(es) made, {self.played() - made} frame(s) were there")
        return super().done()


def line_on(splash: Any) -> str:
    """Return what the panel says of what changes over the timeline; "" if nothing does."""
    if has_keyed_settings(splash):
        return "Keyed settings do not evaluate by themselves: bake them"
    if (count := count_drawings(splash)) > 1:
        return f"The sketch has {count} drawings, the splash is of one: bake them"
    return ""


register, unregister = bpy.utils.register_classes_factory((SPLASH_OT_bake_frames,))
