# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators of the preferences: testing the device, freeing memory, clearing, reporting."""

from __future__ import annotations

import gc
from typing import Any

import bpy

from ...core import compiled_code
from ..data.preferences import own_preferences
from ..jobs import bug_report, compile_ahead, dependencies, idle_memory, work_queue
from ..jobs.messages import sentence_for
from ..jobs.work_queue import Work
from .queued_operator import QueuedOperator


class SPLASH_OT_test_device(QueuedOperator, bpy.types.Operator):
    """Measure how fast the chosen device computes, in each number format"""

    bl_idname = "splash.test_device"
    bl_label = "Test"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether all packages are there, and nothing else is being made."""
        if dependencies.missing_packages():
            cls.poll_message_set("Packages are missing")
            return False
        return cls.is_free()

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the device."""
        preferences = own_preferences(context)
        self._device = str(preferences.device) if preferences else "AUTO"

    def read(self) -> Work:
        """Return what to measure, and what to do with it."""
        setting = self._device

        def compute(report: Any) -> tuple[str, dict[str, float]]:
            from ...core.generator.loading import pick_device

            report("Loading torch", 0.0)
            device = pick_device(setting)
            from ...core.generator.precision import measure_all

            return device, measure_all(device, report)

        return Work(("test", setting), compute, self.write_result)

    def write_result(self, found: tuple[str, dict[str, float]]) -> None:
        """Report what was measured, and show it in the preferences."""
        text = found_text(*found)
        preferences = own_preferences(bpy.context)
        if preferences:
            preferences.tested = text
        self.report({"INFO"}, text)


def found_text(device: str, times: dict[str, float]) -> str:
    """Return the result of a test: the fastest format first, those that do not run last."""
    ordered = sorted(times.items(), key=lambda item: item[1])
    runs = [f"{name} {1000 * t:.0f} ms" for name, t in ordered if t < float("inf")]
    not_there = [name for name, t in ordered if t == float("inf")]
    text = f"{device}: " + ", ".join(runs)
    return text + (f"; not there: {', '.join(not_there)}" if not_there else "")


class SPLASH_OT_free_memory(bpy.types.Operator):
    """Give back the memory of the loaded networks and of intermediate results, as happens by \
itself after five minutes without a splash. The next splash loads them again"""

    bl_idname = "splash.free_memory"
    bl_label = "Free Memory"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether nothing uses it."""
        return is_idle(cls)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Free it."""
        idle_memory.give_back()
        gc.collect()
        self.report({"INFO"}, "The generator's memory was given back")
        return {"FINISHED"}


class SPLASH_OT_clear_cache(bpy.types.Operator):
    """Delete the compiled code that is kept. It is compiled again after the next start"""

    bl_idname = "splash.clear_cache"
    bl_label = "Clear"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether nothing writes to it."""
        if compile_ahead.running() is not None:
            cls.poll_message_set("Code is being compiled: wait until the Splash tab is ready")
            return False
        return is_idle(cls)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Delete it."""
        try:
            compiled_code.clear()
        except OSError as error:
            self.report({"ERROR"}, sentence_for(error))
            return {"CANCELLED"}
        self.report({"INFO"}, "The compiled code was deleted")
        return {"FINISHED"}


class SPLASH_OT_copy_report(bpy.types.Operator):
    """Copy what a bug report should say: versions, device and the last error"""

    bl_idname = "splash.copy_report"
    bl_label = "Copy Report"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy it."""
        context.window_manager.clipboard = bug_report.report(context)
        self.report({"INFO"}, "Report copied: paste it into the bug report")
        return {"FINISHED"}


def is_idle(operator: Any) -> bool:
    """Whether nothing is computed; else say so in the operator's tooltip."""
    if work_queue.running() is None:
        return True
    operator.poll_message_set("A splash is being made: wait for it, or stop it with Esc")
    return False


register, unregister = bpy.utils.register_classes_factory(
    (
        SPLASH_OT_test_device,
        SPLASH_OT_free_memory,
        SPLASH_OT_clear_cache,
        SPLASH_OT_copy_report,
    )
)
