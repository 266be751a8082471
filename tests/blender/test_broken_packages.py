# SPDX-License-Identifier: GPL-3.0-or-later
"""A package that is there but does not load: advice, and no traceback."""

import subprocess
import sys
from pathlib import Path

import bpy
import pytest

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]

SCRIPT = """
import sys
sys.path[:0] = [{folder!r}, {root!r}]
import bpy
import liquid_splash_addon
liquid_splash_addon.register()
assert not {{"torch", "numba", "scipy"}} & set(sys.modules), "enabling is to be fast"
from liquid_splash_addon.blender.scene import sketch as sketches
from liquid_splash_addon.core.sketch.presets import example_sketch
from mathutils import Matrix
sketch = sketches.new_sketch(bpy.context, Matrix())
sketches.add_strokes(sketch, example_sketch("crown"))
bpy.context.view_layer.objects.active = sketch
for _ in range(2):
    try:
        bpy.ops.splash.generate(resolution="64")
    except RuntimeError as error:
        text = str(error)
        assert "The package {name} is broken (no such library): install it again" in text, text
        assert "The Splash tab in the sidebar shows how" in text, text
    else:
        raise AssertionError("a splash in spite of all")
from liquid_splash_addon.blender.jobs import dependencies
assert dependencies.complaint().startswith("Broken: {name}."), dependencies.complaint()
assert "--upgrade {name} numpy==" in dependencies.install_command()
liquid_splash_addon.unregister()
print("broken: fine")
"""


@pytest.mark.parametrize("error", ["OSError", "ImportError"])
@pytest.mark.parametrize("name", ["torch", "numba"])
def test_a_package_that_does_not_load_is_named_with_what_to_do(name, error, tmp_path):
    (tmp_path / f"{name}.py").write_text(f"raise {error}('no such library')")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(folder=str(tmp_path), root=str(ROOT), name=name))
    options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python"]
    command = [sys.executable] if bpy.app.module else [bpy.app.binary_path, *options]
    done = subprocess.run([*command, script], capture_output=True, text=True, timeout=600)
    assert "broken: fine" in done.stdout, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
