# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes that follow the hand: drafts, and what comes after them."""

import time

import bpy
import pytest

from liquid_splash_addon.blender.jobs import draft_then_full, refine, work_queue
from liquid_splash_addon.blender.scene.targets import find_target
from tests.blender.sketching import add_sketch, fan, generate


def work_until(is_so) -> None:
    """Do the rounds of the queue's timer by hand, as in the background nothing runs it."""
    end = time.monotonic() + 600
    while not is_so():
        assert time.monotonic() < end
        work_queue.tick()
        time.sleep(0.01)


@pytest.mark.parametrize("is_stopped", [False, True], ids=["full", "stopped"])
def test_a_draft_is_bare_and_the_list_comes_after_it(tubes, is_stopped):
    bpy.context.scene.splash.settings.real_size = 0.32
    add_sketch(fan())
    splash = generate(start="FRESH")
    stack = splash.splash_stack
    assert len(stack.items) and stack.evaluated == refine.task_of(splash).key
    splash.splash.settings.resolution = "128"
    seen = []
    draft_then_full.make(find_target(bpy.context), lambda _: seen.append(stack.evaluated))
    work_until(lambda: seen)
    assert seen == [draft_then_full.BARE_DRAFT]
    if is_stopped:
        draft_then_full.making().cancel()
    work_until(lambda: not draft_then_full.making().is_busy and work_queue.running() is None)
    assert stack.evaluated == refine.task_of(splash).key
    assert len(seen) == (1 if is_stopped else 2)
    draft_then_full.forget()
