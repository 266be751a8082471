# SPDX-License-Identifier: GPL-3.0-or-later
"""Run out of memory while splashes are made and refined; test_injections.py runs this file.

Memory is bounded for the length of an operation, in a process of its own: what cannot be given then
may end a library as well as Blender.
"""

import contextlib
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import scheduler
from liquid_splash_addon.blender.jobs.messages import NO_MEMORY
from tests.blender.sketching import add_sketch, fan, generate, vertices

ROOM = 48 << 20
"""Bytes that are free while memory is short."""


@contextlib.contextmanager
def short_of_memory() -> Iterator[None]:
    """Let no more than ROOM bytes be had in this block."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def test_a_resolution_too_high() -> None:
    """The splash stays, a sentence says what to do, and with memory it is made."""
    splash = generate(resolution="64")
    before, counts = vertices(splash), (len(bpy.data.objects), len(bpy.data.meshes))
    try:
        with short_of_memory():
            bpy.ops.splash.regenerate(resolution="128")
    except RuntimeError as error:
        assert NO_MEMORY in str(error), error
    else:
        raise AssertionError("made all the same: ROOM is too much")
    assert (vertices(splash) == before).all() and splash.splash.settings.resolution == "64"
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == counts
    assert bpy.ops.splash.regenerate(resolution="128") == {"FINISHED"}
    assert len(splash.data.vertices) > 2 * len(before)


def test_too_many_drops() -> None:
    """The mesh stays as it was, with the warning; fewer drops are made."""
    (splash,) = (item for item in bpy.context.scene.objects if item.type == "MESH")
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    droplets = splash.splash_stack.items[0].droplets
    droplets.amount = 0.01
    before = vertices(splash)
    with short_of_memory(), scheduler.held():  # evaluated where the inner block ends
        droplets.particles, droplets.size, droplets.amount = 400_000, 3.0, 1.0
    assert NO_MEMORY in splash.splash_stack.warnings, splash.splash_stack.warnings
    assert (vertices(splash) == before).all()
    with scheduler.held():
        droplets.particles, droplets.amount = 50_000, 0.005
    assert NO_MEMORY not in splash.splash_stack.warnings
    assert (vertices(splash)[:99] != before[:99]).any() or len(vertices(splash)) != len(before)


if __name__ == "__main__":
    liquid_splash_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    add_sketch(fan())
    test_a_resolution_too_high()
    test_too_many_drops()
    print("short of memory: fine", flush=True)
    os._exit(0)
