# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels draw in every situation, and say what they should."""

import sys
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import dependencies, work_queue
from liquid_splash_addon.blender.ui.model_panel import SPLASH_PT_model, SPLASH_PT_model_waves
from liquid_splash_addon.blender.ui.panels import SPLASH_PT_info, SPLASH_PT_main, SPLASH_PT_settings
from tests.blender.drawing_panels import drawn
from tests.blender.modelling import crossing, generate_layers, part
from tests.blender.sketching import add_sketch, fan, generate


def test_the_buttons_are_there():
    said = drawn(SPLASH_PT_main)
    for name in ("new_sketch", "generate", "regenerate", "realign", "generate_layers", "combine"):
        assert f"splash.{name}" in said


def test_settings_are_those_of_the_scene_then_those_of_the_splash(tubes):
    assert "For new splashes" in drawn(SPLASH_PT_settings)
    assert not SPLASH_PT_info.poll(bpy.context)
    sketch = add_sketch(fan())
    splash = generate()
    for active in (splash, sketch):
        bpy.context.view_layer.objects.active = active
        assert splash.name in drawn(SPLASH_PT_settings)
        assert SPLASH_PT_info.poll(bpy.context)
        assert "faces in" in drawn(SPLASH_PT_info)


def test_progress_takes_the_place_of_the_button(monkeypatch):
    running = SimpleNamespace(line="Generating", fraction=0.5)
    monkeypatch.setattr(work_queue, "collecting", lambda *_: running)
    said = drawn(SPLASH_PT_main)
    assert "Generating (Esc to stop)" in said and "splash.generate" not in said.split()
    with pytest.raises(RuntimeError, match="press Esc"):
        bpy.ops.splash.generate()


def test_what_is_missing_is_listed_with_the_command_to_install_it(monkeypatch):
    assert "Not installed" not in drawn(SPLASH_PT_main)
    monkeypatch.setattr(dependencies, "PACKAGES", {"nowhere_to_be_found": "its-package"})
    assert "Not installed: its-package." in drawn(SPLASH_PT_main)
    command = dependencies.install_command()
    assert sys.executable in command and f"its-package numpy=={np.__version__}" in command


def test_a_model_shows_its_own_panel_and_the_settings_of_its_active_splash(thick_drafts):
    assert not SPLASH_PT_model.poll(bpy.context)
    model = generate_layers(crossing())
    assert SPLASH_PT_model.poll(bpy.context) and SPLASH_PT_info.poll(bpy.context)
    said = drawn(SPLASH_PT_model)
    for text in ("SPLASH_UL_parts", "blend", "mirror_x", "count", "2 splash(es)", "part_remove"):
        assert text in said
    for number, name in enumerate(("Splash A", "Splash B")):
        model.splash_model.active = number
        assert name in drawn(SPLASH_PT_settings)
    assert "amplitude" in drawn(SPLASH_PT_model_waves)
    bpy.data.objects.remove(part("B"))
    model.splash_model.settings.blend = 1.0
    assert "was deleted" in drawn(SPLASH_PT_model)
