# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated frames in Blender's Alembic export."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.blender import reading
from tests.blender.exporting import EXPORTERS, export
from tests.blender.test_exporters import y_up
from tests.blender.test_simulate import FRAMES, START, files, made, read, splash  # noqa: F401


@pytest.mark.skipif(EXPORTERS["Alembic"].operator is None, reason="this Blender has no Alembic")
def test_alembic_holds_every_frame_with_its_velocities(splash, tmp_path):  # noqa: F811
    """Read by its own project's library: other topology in each frame."""
    stored = [read(data) for data in files(splash)]
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = START, START + FRAMES
    bpy.ops.wm.save_mainfile()
    path = export("Alembic", Path(bpy.data.filepath), tmp_path)
    found = {
        key.rpartition(":")[2]: values
        for key, values in reading.archive(path).items()
        if "/Splash_Motion/" in key
    }
    for number, wanted in enumerate(stored):
        mark = f"@{number}" if number else ""
        liquid = wanted[wanted[:, 6] == 0]
        np.testing.assert_array_equal(found[f"position{mark}"], y_up(liquid[:, :3]))
        np.testing.assert_array_equal(found[f"velocity{mark}"], y_up(liquid[:, 3:6]))
        assert len(found[f"corners{mark}"])
