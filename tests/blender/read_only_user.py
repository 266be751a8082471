# SPDX-License-Identifier: GPL-3.0-or-later
"""Enable the installed extension where the user's folders cannot be written; see test_extension.py.

Compiles a function of core too, to see where its code is kept.
"""

import importlib
import os
import tempfile
from pathlib import Path

import bpy  # isort: split

import addon_utils  # Blender's own; only bpy makes it importable
import numpy as np

NAME = "bl_ext.user_default.liquid_splash"


def main() -> None:
    """Enable it, look where compiled code goes, and disable it."""
    resources = Path(os.environ["BLENDER_USER_RESOURCES"])
    assert not os.access(resources, os.W_OK), "the folder can be written"
    if addon_utils.check(NAME) != (True, True):
        assert addon_utils.enable(NAME) is not None, "the extension did not register"
    compiled_code = importlib.import_module(f"{NAME}.core.compiled_code")
    folder = compiled_code.folder()
    assert folder is not None and folder.is_relative_to(tempfile.gettempdir()), folder
    said = compiled_code.note()
    assert said.startswith("Compiled code cannot be kept in ") and str(resources) in said, said
    triangles = importlib.import_module(f"{NAME}.core.numeric.triangles")
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float32)
    faces = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], np.int32)
    assert abs(triangles.enclosed_volume(corners, faces) - 1 / 6) < 1e-6
    assert compiled_code.size() > 0, "nothing was kept"
    addon_utils.disable(NAME)
    assert not folder.exists(), "the temporary folder is left"


if __name__ == "__main__":
    main()
    print("read-only: works", bpy.app.version_string, flush=True)
    os._exit(0)
