# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in another thread."""

import threading

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import generate as generate_job
from liquid_splash_addon.blender.jobs import job
from liquid_splash_addon.blender.scene import targets
from liquid_splash_addon.blender.scene.objects import SceneError
from liquid_splash_addon.core.progress import Cancelled
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.settings import SplashSettings
from tests.blender.sketching import SIZE, add_sketch, fan, generate, vertices


def test_a_job_works_elsewhere_and_reports():
    def work(report):
        report("Half way", 0.5)
        return threading.current_thread()

    run = job.Job(work)
    assert run.result() != threading.main_thread()
    assert run.is_done and (run.stage, run.fraction) == ("Half way", 0.5)


def test_a_cancelled_job_ends_at_its_next_report():
    go_on, reached = threading.Event(), []

    def work(report):
        go_on.wait(10)
        report("Next", 0.1)
        reached.append(True)

    run = job.Job(work)
    run.cancel()
    go_on.set()
    with pytest.raises(Cancelled):
        run.result()
    assert not reached


def test_a_cancel_after_the_last_report_counts_too():
    go_on = threading.Event()
    run = job.Job(lambda report: go_on.wait(10))
    run.cancel()
    go_on.set()
    with pytest.raises(Cancelled):
        run.result()


def test_errors_come_back_to_the_caller():
    def work(report):
        raise ValueError("from there")

    with pytest.raises(ValueError, match="from there"):
        job.Job(work).result()


def test_a_splash_made_in_a_thread_is_the_same(tubes):
    """And the computation can do without bpy, whose data a thread must not touch."""
    add_sketch(fan())
    target = targets.find_target(bpy.context)
    settings = SplashSettings(real_size=SIZE, resolution="64", seed=4, variation=1)
    request = generate_job.snapshot(bpy.context, target, settings, start=BARE)
    result = job.Job(lambda report: generate_job.compute(request, report)).result()
    splash = generate_job.write(bpy.context, request, result)
    first = vertices(splash)
    bpy.data.objects.remove(splash)
    bpy.context.view_layer.objects.active = target.sketch
    np.testing.assert_array_equal(vertices(generate(seed=4, variation=1)), first)


def test_a_result_whose_sketch_was_deleted_is_dropped(tubes):
    sketch = add_sketch(fan())
    target = targets.find_target(bpy.context)
    request = generate_job.snapshot(bpy.context, target, SplashSettings(resolution="64"))
    result = generate_job.compute(request, lambda stage, share: None)
    bpy.data.objects.remove(sketch)
    with pytest.raises(SceneError, match="deleted"):
        generate_job.write(bpy.context, request, result)
    assert not bpy.data.meshes
