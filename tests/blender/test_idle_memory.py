# SPDX-License-Identifier: GPL-3.0-or-later
"""Networks and intermediate results are dropped when nobody needs them, and nothing is lost."""

import time
import weakref

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import (
    idle_memory,
    loaded_generator,
    refine,
    work_queue,
)
from tests.blender.sketching import add_sketch, fan, generate, vertices


@pytest.fixture
def a_while_ago(monkeypatch: pytest.MonkeyPatch):
    """Let time pass: return a function that has the last use lie some seconds back."""

    def pass_by(seconds: float) -> None:
        monkeypatch.setattr(work_queue, "_used", time.monotonic() - seconds)

    return pass_by


def test_what_is_idle_is_dropped_and_made_again_alike(a_while_ago):
    add_sketch(fan())
    splash = generate(start="FRESH")
    before = vertices(splash)
    kept = (
        weakref.ref(next(iter(loaded_generator._loaded.values()))),
        weakref.ref(refine.refiner[1]),
    )
    assert idle_memory.is_kept()
    a_while_ago(idle_memory.IDLE - 30)
    assert idle_memory.look() == idle_memory.LOOK
    assert all(ref() is not None for ref in kept), "not yet"
    a_while_ago(idle_memory.IDLE + 1)
    idle_memory.look()
    assert not idle_memory.is_kept()
    assert all(ref() is None for ref in kept), "nothing else holds them"
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), before)


def test_what_is_in_use_stays(tubes, monkeypatch, a_while_ago):
    add_sketch(fan())
    generate(start="FRESH")
    assert time.monotonic() - work_queue.last_used() < 60, "a splash is a use"
    a_while_ago(idle_memory.IDLE + 1)
    with monkeypatch.context() as patch:
        patch.setattr(work_queue, "is_busy", lambda: True)
        idle_memory.look()
    assert idle_memory.is_kept(), "something long is being computed"
    idle_memory.look()
    assert not idle_memory.is_kept()


def test_the_background_keeps_what_scripts_go_on_with():
    assert bpy.app.background
    assert not bpy.app.timers.is_registered(idle_memory.look)
