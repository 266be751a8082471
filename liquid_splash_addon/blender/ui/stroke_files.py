# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import and Export of strokes, and dropping such files into the viewport.

A file browser cannot wait for a thread: an operator for it takes the choice and starts the one that
does the work, which scripts and dropped files start themselves.
"""

from __future__ import annotations

import hashlib
from functools import partial
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...core.stroke_files.reading import KINDS
from ...core.whole_file import write_whole
from ..jobs import stroke_files
from ..jobs.work_queue import Work
from ..scene import targets
from ..scene.objects import Handle, SceneError
from .operators import NO_SKETCH
from .queued_operator import QueuedOperator

READ = ";".join(KINDS)
PATTERN = ";".join(f"*{ending}" for ending in KINDS)
WRITTEN = ";".join(f"*{ending}" for ending, kind in KINDS.items() if kind.write)

HIDDEN = {"HIDDEN", "SKIP_SAVE"}


def scale_property() -> Any:
    """Make the property for the size of a metre."""
    return FloatProperty(
        name="Units per Metre",
        description="Blender units for a metre of the file. Speeds change with it",
        default=1.0,
        min=1e-4,
        max=1e4,
        soft_min=0.01,
        soft_max=100.0,
    )


class ImportSettings:
    """What the operators for import share."""

    __annotations__ = {
        "filepath": StringProperty(subtype="FILE_PATH", options=HIDDEN),
        "directory": StringProperty(subtype="DIR_PATH", options=HIDDEN),
        "files": CollectionProperty(type=bpy.types.OperatorFileListElement, options=HIDDEN),
        "scale": scale_property(),
        "at_cursor": BoolProperty(
            name="At 3D Cursor",
            description="Put the middle of the strokes at the 3D cursor, instead of where they "
            "were in the room",
            default=True,
        ),
    }

    def paths(self) -> list[Path]:
        """Return the chosen files."""
        folder = bpy.path.abspath(self.directory)
        several = [Path(folder, entry.name) for entry in self.files if entry.name]
        single = [Path(bpy.path.abspath(self.filepath))] if self.filepath else []
        return several or single


class SPLASH_OT_import_strokes(ImportSettings, QueuedOperator, bpy.types.Operator):
    """Make Grease Pencil sketches of files with strokes, with the times at which they were drawn"""

    bl_idname = "splash.import_strokes"
    bl_label = "Import Strokes"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether no other work is waited for."""
        return cls.is_free()

    def begin(self, _context: bpy.types.Context) -> None:
        """Take note of the files."""
        self._paths = self.paths()

    def read(self) -> Work:
        """Describe the work: the files are read in its thread."""
        key = (tuple(map(str, self._paths)), self.scale)
        return Work(
            key, partial(stroke_files.read_files, self._paths, self.scale), self.write_result
        )

    def write_result(self, result: Any) -> None:
        """Add the sketches and say what was read."""
        imports, errors = result
        warnings = stroke_files.add_sketches(bpy.context, imports, self.at_cursor)
        for found in imports:
            self.report({"INFO"}, f"{found.name}: {found.recording.summary}")
        for line in (*errors, *warnings):
            self.report({"WARNING"}, line)


class SPLASH_OT_choose_stroke_files(ImportSettings, ImportHelper, bpy.types.Operator):
    """Make Grease Pencil sketches of files with strokes, with the times at which they were drawn"""

    bl_description = (
        "Make Grease Pencil sketches of files with strokes: Open Brush and Tilt Brush (.tilt), "
        "A-Painter (.apa), tracked controllers (.json), tables of points (.json, .csv). The times "
        "at which they were drawn are kept, for the speed of the liquid"
    )
    bl_idname = "splash.choose_stroke_files"
    bl_label = "Import Strokes"
    __annotations__ = {
        **ImportSettings.__annotations__,
        "filter_glob": StringProperty(default=PATTERN, options={"HIDDEN"}),
    }

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Start the import."""
        files = [{"name": entry.name} for entry in self.files]
        return bpy.ops.splash.import_strokes(
            "INVOKE_DEFAULT",
            filepath=self.filepath,
            directory=self.directory,
            files=files,
            scale=self.scale,
            at_cursor=self.at_cursor,
        ) & {"CANCELLED"} or {"FINISHED"}


class ExportSettings:
    """What the operators for export share."""

    __annotations__ = {
        "filepath": StringProperty(subtype="FILE_PATH", options=HIDDEN),
        "scale": scale_property(),
        "use_modifiers": BoolProperty(
            name="Modifiers",
            description="Write the strokes as the modifiers of the sketch leave them",
            default=False,
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a sketch."""
        if targets.find_target(context) is not None:
            return True
        cls.poll_message_set(NO_SKETCH)  # type: ignore[attr-defined]
        return False


class SPLASH_OT_export_strokes(ExportSettings, QueuedOperator, bpy.types.Operator):
    """Write the strokes of the sketch, with times and pressures, as JSON or CSV"""

    bl_idname = "splash.export_strokes"
    bl_label = "Export Strokes"
    bl_options = {"REGISTER"}  # noqa: RUF012

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the sketch and the file."""
        self._objects = [Handle.of(item) for item in targets.chosen_sketches(context)]
        path = Path(bpy.path.abspath(self.filepath))
        self._path = path if path.suffix else path.with_suffix(".json")

    def read(self) -> Work:
        """Read the strokes."""
        found = [handle.find() for handle in self._objects]
        if None in found:
            raise SceneError("The sketch was deleted meanwhile, so nothing was written")
        bpy.context.view_layer.update()
        drawings, warnings = stroke_files.world_strokes(found, self.use_modifiers)
        digest = hashlib.sha256()
        for drawing in drawings:
            digest.update(drawing.points.tobytes())
        return Work(
            (digest.hexdigest(), str(self._path)),
            lambda _report: stroke_files.content_of(self._path, drawings, self.scale),
            partial(self.write_result, len(drawings), warnings),
        )

    def write_result(self, count: int, warnings: list[str], content: bytes) -> None:
        """Write the file and say what is in it."""
        write_whole(self._path, content)
        self.report({"INFO"}, f"{self._path.name}: {count:,} strokes")
        for line in warnings:
            self.report({"WARNING"}, line)


class SPLASH_OT_choose_export_file(ExportSettings, ExportHelper, bpy.types.Operator):
    """Write the strokes of the sketch, with times and pressures, as JSON or CSV"""

    bl_description = (
        "Write the strokes of the sketch, in metres and seconds, with times, pressures and speeds. "
        "The end of the name says whether it is JSON or CSV"
    )
    bl_idname = "splash.choose_export_file"
    bl_label = "Export Strokes"
    filename_ext = ".json"
    check_extension = None  # the end of the name is the user's choice
    __annotations__ = {
        **ExportSettings.__annotations__,
        "filter_glob": StringProperty(default=WRITTEN, options={"HIDDEN"}),
    }

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Start the export."""
        return bpy.ops.splash.export_strokes(
            "INVOKE_DEFAULT",
            filepath=self.filepath,
            scale=self.scale,
            use_modifiers=self.use_modifiers,
        ) & {"CANCELLED"} or {"FINISHED"}


class SPLASH_FH_strokes(bpy.types.FileHandler):
    """Files with strokes that are dropped into the viewport."""

    bl_idname = "SPLASH_FH_strokes"
    bl_label = "Strokes"
    bl_import_operator = SPLASH_OT_import_strokes.bl_idname
    bl_export_operator = SPLASH_OT_choose_export_file.bl_idname
    bl_file_extensions = READ

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Whether they are dropped where they can be seen."""
        return context.area is not None and context.area.type == "VIEW_3D"


def draw_import(menu: Any, _context: bpy.types.Context) -> None:
    """Add the entry to File > Import."""
    menu.layout.operator(
        SPLASH_OT_choose_stroke_files.bl_idname, text="Strokes (.tilt/.apa/.json/.csv)"
    )


def draw_export(menu: Any, _context: bpy.types.Context) -> None:
    """Add the entry to File > Export."""
    menu.layout.operator(SPLASH_OT_choose_export_file.bl_idname, text="Strokes (.json/.csv)")


register_classes, unregister_classes = bpy.utils.register_classes_factory(
    (
        SPLASH_OT_import_strokes,
        SPLASH_OT_choose_stroke_files,
        SPLASH_OT_export_strokes,
        SPLASH_OT_choose_export_file,
        SPLASH_FH_strokes,
    )
)


def register() -> None:
    """Add the operators and their entries in the menus."""
    register_classes()
    bpy.types.TOPBAR_MT_file_import.append(draw_import)
    bpy.types.TOPBAR_MT_file_export.append(draw_export)


def unregister() -> None:
    """Remove them."""
    bpy.types.TOPBAR_MT_file_export.remove(draw_export)
    bpy.types.TOPBAR_MT_file_import.remove(draw_import)
    unregister_classes()
