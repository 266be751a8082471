# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input gets a clear error and changes nothing."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data import preferences
from liquid_splash_addon.blender.jobs import loaded_generator
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.sketch.drawing import Drawing
from tests.blender.sketching import add_sketch, fan, generate, splashes, vertices

pytestmark = pytest.mark.once

NAN = Drawing(np.array([(0, 0, 0), (np.nan, 0, 0), (1, 0, 0)]), np.arange(3.0))
STILL = Drawing(np.ones((5, 3)), np.arange(5.0))

BAD_STROKES = {
    "no strokes": ([], {}, "Draw at least one stroke first"),
    "one point": ([Drawing(np.zeros((1, 3)))], {}, "a single point"),
    "not a number": ([NAN], {}, "not a number"),
    "no length": ([STILL], {}, "without length"),
    "all points equal": ([STILL, STILL], {}, "without length"),
}


def state() -> list[object]:
    """Return what must not change: which data there is, and the splashes' every part."""
    blocks = [
        sorted(block.name for block in collection)
        for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.materials)
    ]
    active = bpy.context.view_layer.objects.active
    parts = [
        (vertices(s).tobytes(), s.splash.frame, s.splash.settings.seed, tuple(s.location))
        for s in splashes()
    ]
    return [*blocks, active and active.name, parts]


@pytest.mark.parametrize("bad", BAD_STROKES.values(), ids=BAD_STROKES)
@pytest.mark.usefixtures("tubes")
def test_bad_strokes_for_a_new_splash(bad):
    drawings, settings, message = bad
    add_sketch(drawings)
    before = state()
    with pytest.raises(RuntimeError, match=message):
        generate(**settings)
    assert state() == before


@pytest.mark.parametrize("bad", BAD_STROKES.values(), ids=BAD_STROKES)
@pytest.mark.usefixtures("tubes")
def test_bad_strokes_for_an_old_splash(bad):
    drawings, settings, message = bad
    add_sketch(fan())
    splash = generate()
    splash.splash.sketch = add_sketch(drawings, active=False)
    before = state()
    for name in ("generate", "regenerate", "realign"):
        with pytest.raises(RuntimeError, match=message):
            getattr(bpy.ops.splash, name)(seed=99, **settings)
        assert state() == before


def truncated(folder: Path) -> Path:
    path = folder / "truncated.safetensors"
    path.write_bytes(default_weights_path().read_bytes()[:10_000])
    return path


def foreign(folder: Path) -> Path:
    from safetensors.numpy import save_file

    path = folder / "foreign.safetensors"
    save_file({"weight": np.zeros((2, 2), dtype=np.float32)}, path)
    return path


def text(folder: Path) -> Path:
    path = folder / "notes.txt"
    path.write_text("no weights at all")
    return path


BAD_WEIGHTS = {
    "missing": (lambda folder: folder / "nowhere.safetensors", "No network at"),
    "a folder": (lambda folder: folder, "No network at"),
    "truncated": (truncated, "damaged"),
    "foreign": (foreign, "no network of Liquid Splash|has the format"),
    "text": (text, "no network of Liquid Splash"),
}


@pytest.mark.parametrize("bad", BAD_WEIGHTS.values(), ids=BAD_WEIGHTS)
def test_bad_weights(bad, tmp_path, monkeypatch):
    from liquid_splash_addon.blender.jobs import generate as generate_job

    make, message = bad
    path = make(tmp_path)
    monkeypatch.setattr(generate_job, "weights_path", lambda context: path)
    add_sketch(fan())
    before = state()
    with pytest.raises(RuntimeError, match=message):
        generate()
    assert state() == before
    assert path not in {key[0] for key in loaded_generator._loaded}


def test_without_an_entry_in_the_preferences_the_bundled_weights_are_used():
    assert preferences.weights_path(bpy.context) is None


@pytest.mark.usefixtures("tubes")
def test_a_splash_that_cannot_be_written_is_left_alone():
    add_sketch(fan())
    splash = generate()
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Object Mode"):
        bpy.ops.splash.regenerate()
    bpy.ops.object.mode_set(mode="OBJECT")
    splash.shape_key_add(name="Basis")
    with pytest.raises(RuntimeError, match="shape keys"):
        bpy.ops.splash.regenerate()


@pytest.mark.usefixtures("tubes")
def test_a_splash_whose_sketch_is_gone_says_so():
    sketch = add_sketch(fan())
    splash = generate()
    bpy.data.objects.remove(sketch)
    bpy.context.view_layer.objects.active = splash
    with pytest.raises(RuntimeError, match="whose sketch still exists"):
        bpy.ops.splash.regenerate()


WITHOUT_TORCH = """
import sys
sys.path.insert(0, {root!r})
sys.modules["torch"] = None
import bpy
import liquid_splash_addon
liquid_splash_addon.register()
from tests.blender.sketching import add_sketch, fan, generate, splashes
from tests.blender.test_panels import drawn
from liquid_splash_addon.blender.ui.panels import SPLASH_PT_main
said = drawn(SPLASH_PT_main).replace(" ", "")  # lines are broken to fit
assert "Notinstalled:torch." in said and sys.executable + '"-mpipinstall' in said, said
add_sketch(fan())
try:
    generate()
except RuntimeError as error:
    assert "Not installed: torch." in str(error), error
else:
    raise AssertionError("a splash without torch")
assert not splashes()
liquid_splash_addon.unregister()
print("without torch: fine")
"""


def test_without_torch_the_addon_registers_and_says_what_to_install(tmp_path):
    root = str(Path(__file__).resolve().parents[2])
    script = tmp_path / "without_torch.py"
    script.write_text(WITHOUT_TORCH.format(root=root))
    binary = bpy.app.binary_path
    options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python"]
    command = [sys.executable] if bpy.app.module else [binary, *options]
    done = subprocess.run([*command, script], capture_output=True, text=True, timeout=600)
    assert "without torch: fine" in done.stdout, done.stdout + done.stderr
