# SPDX-License-Identifier: GPL-3.0-or-later
"""The one queue: results are written only where they are still wanted."""

import threading
import time

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.jobs import refine, scheduler, work_queue
from tests.blender.sketching import add_sketch, fan, generate, vertices

pytestmark = [pytest.mark.once, pytest.mark.usefixtures("tubes")]


@pytest.fixture
def splash() -> bpy.types.Object:
    """A splash with droplets and waves."""
    add_sketch(fan())
    made = generate()
    bpy.ops.splash.refinement_preset(preset="FRESH")
    return made


@pytest.fixture
def windowed(monkeypatch):
    """Have work done in a thread, as in a window; the test is the timer, see :func:`run_queue`."""
    monkeypatch.setattr(work_queue, "is_immediate", lambda: False)
    yield
    work_queue.stop()


class Gate:
    """Holds work back until it is opened."""

    def __init__(self, compute) -> None:
        self.compute, self.entered, self.opened = compute, threading.Event(), threading.Event()

    def __call__(self, task, report):
        self.entered.set()
        assert self.opened.wait(60)
        return self.compute(task, report)


@pytest.fixture
def gate(monkeypatch) -> Gate:
    """Hold every refining back until the gate is opened."""
    made = Gate(refine.KIND.compute)
    kinds = [
        kind._replace(compute=made) if kind is refine.KIND else kind for kind in scheduler._kinds
    ]
    monkeypatch.setattr(scheduler, "_kinds", kinds)
    return made


def run_queue(seconds: float = 600.0) -> None:
    """Do what the timer does until nothing is left to do."""
    end = time.monotonic() + seconds
    while work_queue.tick() is not None:
        assert time.monotonic() < end
        time.sleep(0.01)


def amount(splash):
    """Return the settings of its droplets."""
    return splash.splash_stack.items[0].droplets


def computed(splash) -> np.ndarray:
    """Return the vertices that its settings give when computed directly."""
    refine.refiner = None
    return refine.compute(refine.task_of(splash), lambda stage, share: None).mesh.vertices


def test_a_change_is_evaluated_in_a_thread(splash, windowed):
    before = vertices(splash)
    amount(splash).amount = 0.02
    np.testing.assert_array_equal(vertices(splash), before)
    assert "Waiting" in scheduler.stage_of(splash)
    run_queue()
    assert scheduler.stage_of(splash) == ""
    np.testing.assert_array_equal(vertices(splash), computed(splash))


def test_a_burst_of_changes_ends_in_the_last(splash, windowed, gate):
    gate.opened.set()
    for number in range(20):
        amount(splash).seed = number
        work_queue.tick()
    run_queue()
    np.testing.assert_array_equal(vertices(splash), computed(splash))


def test_what_was_queued_before_apply_does_not_undo_it(splash, windowed, gate):
    """One change is being computed and another waits when the list is applied."""
    amount(splash).seed = 1
    work_queue.tick()
    assert gate.entered.wait(60)
    amount(splash).seed = 2
    gate.opened.set()
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    applied = vertices(splash)
    assert not splash.splash_stack.items
    run_queue()
    np.testing.assert_array_equal(vertices(splash), applied)


def test_a_slow_result_does_not_overwrite_a_newer_splash(splash, windowed, gate):
    """Refining ends after the splash was made anew: what is wanted now is computed."""
    amount(splash).seed = 1
    work_queue.tick()
    assert gate.entered.wait(60)
    assert bpy.ops.splash.regenerate(variation=1.0, seed=7) == {"FINISHED"}
    gate.opened.set()
    run_queue()
    np.testing.assert_array_equal(vertices(splash), computed(splash))
    assert splash.splash_stack.evaluated == refine.task_of(splash).key


@pytest.mark.parametrize(
    "error", [MemoryError(), RuntimeError("from a library"), OSError(28, "full")]
)
def test_any_error_becomes_a_message_and_the_queue_goes_on(splash, windowed, monkeypatch, error):
    kind = refine.KIND

    def fail(task, report):
        raise error

    failing = [
        other._replace(compute=fail) if other is kind else other for other in scheduler._kinds
    ]
    monkeypatch.setattr(scheduler, "_kinds", failing)
    before = vertices(splash)
    amount(splash).seed = 1
    run_queue()
    assert splash.splash_stack.warnings
    np.testing.assert_array_equal(vertices(splash), before)
    monkeypatch.setattr(scheduler, "_kinds", [kind])
    amount(splash).seed = 2
    run_queue()
    assert not splash.splash_stack.warnings
    np.testing.assert_array_equal(vertices(splash), computed(splash))


def test_a_deleted_splash_is_forgotten(splash, windowed, gate):
    amount(splash).seed = 1
    work_queue.tick()
    assert gate.entered.wait(60)
    bpy.data.objects.remove(splash)
    gate.opened.set()
    run_queue()
    assert work_queue.running() is None


def test_a_copy_is_evaluated_by_itself(splash, windowed):
    copy = splash.copy()
    copy.data = splash.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert stored_liquid.read(copy.data) == stored_liquid.read(splash.data)
    before = vertices(splash)
    amount(copy).seed = 9
    run_queue()
    np.testing.assert_array_equal(vertices(splash), before)
    np.testing.assert_array_equal(vertices(copy), computed(copy))
    assert vertices(copy).shape != before.shape or np.abs(vertices(copy) - before).max() > 0


def test_a_copy_of_a_splash_that_waits_is_evaluated_too(splash, windowed):
    """The copy has the changed settings, but the mesh of before."""
    amount(splash).amount = 0.02
    copy = splash.copy()
    copy.data = splash.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    bpy.context.view_layer.update()
    run_queue()
    for item in (splash, copy):
        np.testing.assert_array_equal(vertices(item), computed(item))
        assert not item.splash_stack.pending


def test_a_file_saved_while_a_change_waits_goes_on(splash, windowed, tmp_path):
    amount(splash).amount = 0.02
    path, name = str(tmp_path / "waiting.blend"), splash.name
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    run_queue()
    again = bpy.data.objects[name]
    np.testing.assert_array_equal(vertices(again), computed(again))


def test_nothing_is_written_while_a_render_runs(splash, windowed, monkeypatch):
    before = vertices(splash)
    monkeypatch.setattr(work_queue, "is_locked", lambda: True)
    amount(splash).seed = 1
    for _ in range(20):
        assert work_queue.tick() is not None
        time.sleep(0.01)
    np.testing.assert_array_equal(vertices(splash), before)
    monkeypatch.setattr(work_queue, "is_locked", lambda: False)
    run_queue()
    np.testing.assert_array_equal(vertices(splash), computed(splash))


def test_another_file_ends_what_runs(splash, windowed, gate, tmp_path):
    amount(splash).seed = 1
    work_queue.tick()
    assert gate.entered.wait(60)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    gate.opened.set()
    assert work_queue.running() is None and work_queue.tick() is None


def test_a_preset_is_one_evaluation(splash, monkeypatch):
    asked = []
    counted = refine.KIND._replace(
        compute=lambda task, report: (asked.append(task), refine.compute(task, report))[1]
    )
    monkeypatch.setattr(scheduler, "_kinds", [counted])
    assert bpy.ops.splash.refinement_preset(preset="STORM") == {"FINISHED"}
    assert len(asked) == 1 and len(asked[0].steps) == 4
