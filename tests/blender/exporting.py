# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's exporters, by name. As a script it opens a file and exports it::

python -m tests.blender.exporting FILE.blend EXPORTER OUT with|without
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import bpy

ROOT = Path(__file__).resolve().parents[2]
SECONDS = 600
"""After which an export counts as hanging: a busy machine needs ten."""


class Exporter(NamedTuple):
    """An exporter of Blender.

    Attributes
    ----------
    room, name : of its operator
    ending : of its files
    custom : option that has custom properties written; None if it writes none
    may_hang : whether it runs in a process of its own, as a fault in it may take Blender along
    """

    room: str
    name: str
    ending: str
    custom: str | None = None
    may_hang: bool = False

    @property
    def operator(self) -> Callable[..., Any] | None:
        """The operator; None if this Blender was built without it."""
        room = getattr(bpy.ops, self.room)
        return getattr(room, self.name) if self.name in dir(room) else None


EXPORTERS = {
    "glTF": Exporter("export_scene", "gltf", ".glb", "export_extras"),
    "FBX": Exporter("export_scene", "fbx", ".fbx", "use_custom_props"),
    "OBJ": Exporter("wm", "obj_export", ".obj"),
    "STL": Exporter("wm", "stl_export", ".stl"),
    "PLY": Exporter("wm", "ply_export", ".ply", "export_attributes"),
    "Alembic": Exporter("wm", "alembic_export", ".abc", "export_custom_properties", True),
    "USD": Exporter("wm", "usd_export", ".usdc", "export_custom_properties", True),
}
DEFAULT, WITH, WITHOUT = "default", "with", "without"
"""How custom properties are exported: as each exporter does by default, always, never."""


def export(name: str, blend: Path, out: Path, custom: str = DEFAULT) -> Path:
    """Export a .blend file, and return the exported one."""
    exporter = EXPORTERS[name]
    path = out / f"{blend.stem}-{custom}{exporter.ending}"
    if exporter.may_hang:
        command = [sys.executable, "-m", "tests.blender.exporting", blend, name, path, custom]
        done = subprocess.run(
            [str(word) for word in command], cwd=ROOT, timeout=SECONDS, capture_output=True
        )
        assert done.returncode == 0, done.stderr.decode()[-2000:]
    else:
        export_here(name, blend, path, custom)
    return path


def export_here(name: str, blend: Path, path: Path, custom: str) -> None:
    """Open and export in this process."""
    exporter = EXPORTERS[name]
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    choice = {} if custom == DEFAULT else {exporter.custom: custom == WITH}
    assert exporter.operator(filepath=str(path), **choice) == {"FINISHED"}


def main() -> None:
    """Export as the command line says, with the add-on as users have it."""
    import liquid_splash_addon

    blend, name, path, custom = sys.argv[1:]
    liquid_splash_addon.register()
    export_here(name, Path(blend), Path(path), custom)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # Blender's module may crash while Python ends
