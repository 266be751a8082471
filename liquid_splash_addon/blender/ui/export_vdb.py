# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the liquid of a splash or a model as an OpenVDB file."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import bpy
from bpy.props import StringProperty

from ..jobs import solver_start
from ..jobs.work_queue import Work
from ..scene.objects import Handle, SceneError
from ..scene.openvdb import load_openvdb
from ..scene.targets import shown_liquid
from .queued_operator import QueuedOperator

if TYPE_CHECKING:
    from ...core.progress import Report


class SPLASH_OT_export_vdb(QueuedOperator, bpy.types.Operator):
    """Write the liquid as an OpenVDB file: signed distance and velocity, without waves"""

    bl_idname = "splash.export_vdb"
    bl_label = "Liquid Splash Volume (.vdb)"

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.vdb", options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash or a model, and no other run."""
        if not cls.is_free():
            return False
        if shown_liquid(context) is None:
            cls.poll_message_set("Select a splash or a model, or the sketch of a splash")
            return False
        return True

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask for the file; with one, write it while Blender stays usable."""
        if self.filepath:
            return super().invoke(context, event)
        name = bpy.path.clean_name(shown_liquid(context).name)
        self.filepath = bpy.path.ensure_ext(name, ".vdb")
        if bpy.data.filepath:
            self.filepath = str(Path(bpy.data.filepath).parent / self.filepath)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write at once for scripts; what the file browser calls begins anew, in the queue."""
        if bpy.app.background or not self.options.is_invoke:
            return super().execute(context)
        bpy.app.timers.register(
            partial(write_beside, context.window, self.filepath), first_interval=0
        )
        return {"FINISHED"}

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the object and the file."""
        item = shown_liquid(context)
        if not self.filepath:
            raise SceneError("Give a file to write to")
        self._item = Handle.of(item)
        self._path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), ".vdb"))
        if not self._path.parent.is_dir():
            raise SceneError(f"There is no folder {self._path.parent}: choose another")
        self._openvdb = load_openvdb()

    def owner(self) -> int:
        """Return the object that is exported."""
        return self._item.uid

    def read(self) -> Work:
        """Read the liquid's recipe from the scene."""
        start = solver_start.read_start(self._item.find())
        return Work(start.key, partial(write, start, self._openvdb, self._path), self.tell)

    def tell(self, warnings: list[str]) -> None:
        """Say what was written, and what was not."""
        self.report({"INFO"}, f"Wrote {self._path.name}")
        for warning in warnings:
            self.report({"WARNING"}, warning)


def write_beside(window: bpy.types.Window, path: str) -> None:
    """Write in the queue, after the file browser is gone."""
    with bpy.context.temp_override(window=window):
        if SPLASH_OT_export_vdb.poll(bpy.context):
            bpy.ops.splash.export_vdb("INVOKE_DEFAULT", filepath=path)


def write(
    start: solver_start.StartTask, openvdb: ModuleType, path: Path, report: Report
) -> list[str]:
    """Compute the liquid and write it, without bpy; return what to warn of.

    Raises SceneError where the file cannot be written, and what ``compute_start`` raises.
    """
    from ...core.animation.vdb import write_vdb

    made = solver_start.compute_start(start, report)
    report("Writing the volume", 0.9)
    try:
        write_vdb(openvdb, path, made)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SceneError(f"{path} cannot be written ({reason}): choose another place") from error
    left = len(made.drops.radii)
    drops = f"{left:,} free drops are not in the volume: export Splash Drops as Alembic or USD"
    return [*made.warnings, *([drops] if left else [])]


def menu_entry(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry in File > Export."""
    self.layout.operator(SPLASH_OT_export_vdb.bl_idname)


def register() -> None:
    """Add the operator and its entry in the menu."""
    bpy.utils.register_class(SPLASH_OT_export_vdb)
    bpy.types.TOPBAR_MT_file_export.append(menu_entry)


def unregister() -> None:
    """Take both away."""
    bpy.types.TOPBAR_MT_file_export.remove(menu_entry)
    bpy.utils.unregister_class(SPLASH_OT_export_vdb)
