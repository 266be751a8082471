# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that are full, files that go, processes that die: Blender stays, and a sentence says so."""

import contextlib
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import generate as generate_job
from liquid_splash_addon.blender.jobs import messages, simulate, work_queue
from liquid_splash_addon.blender.jobs.job import Job
from liquid_splash_addon.blender.scene import openvdb
from liquid_splash_addon.blender.scene.objects import SceneError
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.progress import Cancelled
from tests.blender.sketching import add_sketch, fan, generate, vertices
from tests.blender.test_bad_input import state
from tests.blender.test_simulate import FRAMES, files, settings_of

pytestmark = pytest.mark.once

SHORT_OF_MEMORY = Path(__file__).with_name("short_of_memory.py")


@contextlib.contextmanager
def full_disk(most: int = 500) -> Iterator[None]:
    """Let every file of more than some bytes fail, as on a full disk; those of children too."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


@pytest.fixture
def splash(tubes, tmp_path) -> bpy.types.Object:
    """Return a splash of a saved file that can be simulated."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    add_sketch(fan())
    made = generate()
    settings_of(made)
    return made


def refused(way: Callable[[], object], sentence: str) -> None:
    """Check that something is refused with a sentence, and that the scene is as it was."""
    before = state()
    with pytest.raises(RuntimeError, match=sentence) as raised:
        way()
    assert "Unexpected error" not in str(raised.value)
    assert state() == before


def test_a_full_disk_before_the_first_frame(splash):
    with full_disk():
        refused(bpy.ops.splash.simulate, "check the disk|make room")
    assert not splash.splash_simulation.folder and splash.splash_simulation.motion is None
    assert bpy.ops.splash.simulate() == {"FINISHED"}


def test_a_full_disk_while_frames_are_written(splash, monkeypatch):
    """What the process cannot write it says; with room the run goes on."""
    start = simulate.Simulating
    with monkeypatch.context() as patch:

        def start_on_a_full_disk(job: Path) -> simulate.Simulating:
            with full_disk(20_000):  # enough for what is written about the frames
                return start(job)

        patch.setattr(simulate, "Simulating", start_on_a_full_disk)
        refused(bpy.ops.splash.simulate, "make room")
    assert splash.splash_simulation.motion is None
    assert bpy.ops.splash.simulate() == {"FINISHED"}
    assert len(files(splash)) == FRAMES + 1


def test_a_full_disk_while_strokes_are_exported(splash, tmp_path):
    bpy.context.view_layer.objects.active = splash.splash.sketch
    path = tmp_path / "strokes.json"
    path.write_text("before")
    with full_disk():
        refused(lambda: bpy.ops.splash.export_strokes(filepath=str(path)), "strokes.json")
    assert path.read_text() == "before" and not list(tmp_path.glob("*.part"))


def test_a_full_disk_while_a_volume_is_exported(splash, tmp_path):
    """OpenVDB itself does not say that it could write a part only."""
    try:
        openvdb.load_openvdb()
    except SceneError:
        pytest.skip("this Blender has no OpenVDB for Python")
    path = tmp_path / "splash.vdb"
    for most in (0, 500, 60_000):
        path.write_bytes(b"before")
        with full_disk(most):
            refused(lambda: bpy.ops.splash.export_vdb(filepath=str(path)), "cannot be written")
        assert path.read_bytes() == b"before" and not list(tmp_path.glob("*.part"))
    assert bpy.ops.splash.export_vdb(filepath=str(path)) == {"FINISHED"}
    assert path.stat().st_size > 60_000


def test_weights_that_are_deleted_between_two_splashes(tmp_path, monkeypatch):
    path = tmp_path / "weights.safetensors"
    shutil.copy(default_weights_path(), path)
    monkeypatch.setattr(generate_job, "weights_path", lambda context: path)
    add_sketch(fan())
    splash = generate()
    path.unlink()
    for name in ("regenerate", "realign", "generate"):
        refused(
            lambda name=name: getattr(bpy.ops.splash, name)(seed=3, variation=1.0), "No network at"
        )
    assert bpy.ops.splash.refinement_add(kind="CLEANUP") == {"FINISHED"}, "what needs none goes on"
    shutil.copy(default_weights_path(), path)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    assert splash.splash_stack.items[0].kind == "CLEANUP"


def test_weights_that_are_cut_off_while_they_are_read(tubes, tmp_path, monkeypatch):
    """As a download or a disk may end: the old splash stays."""
    add_sketch(fan())
    generate()
    path = tmp_path / "weights.safetensors"
    path.write_bytes(default_weights_path().read_bytes()[:-5000])
    monkeypatch.undo()
    monkeypatch.setattr(generate_job, "weights_path", lambda context: path)
    refused(bpy.ops.splash.regenerate, "damaged")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="bounds memory as Linux does")
def test_out_of_memory():
    options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python"]
    command = [sys.executable] if bpy.app.module else [bpy.app.binary_path, *options]
    done = subprocess.run([*command, SHORT_OF_MEMORY], capture_output=True, text=True, timeout=600)
    assert "short of memory: fine" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    "said",
    [
        "[enforce fail at alloc_cpu.cpp:119] data. DefaultCPUAllocator: not enough memory: you "
        "tried to allocate 8589934592 bytes.",
        "DefaultCPUAllocator: can't allocate memory: you tried to allocate 17 bytes",
        "CUDA out of memory. Tried to allocate 2.00 GiB",
        "can't start new thread",
    ],
)
def test_what_libraries_say_of_memory_is_understood(said):
    assert messages.sentence_for(RuntimeError(said)) == messages.NO_MEMORY
    assert "Please report" in messages.sentence_for(RuntimeError("a library's own fault"))


def test_a_process_that_is_killed(splash, monkeypatch):
    """As by a system that runs out of memory: what is done is kept, and it goes on from there."""
    started: list[simulate.Simulating] = []
    start = simulate.Simulating
    settings = splash.splash_simulation.settings
    settings.frames = 8

    def start_and_kill(job: Path) -> simulate.Simulating:
        child = start(job)
        started.append(child)
        threading.Thread(target=kill_after_a_frame, args=(child,), daemon=True).start()
        return child

    with monkeypatch.context() as patch:
        patch.setattr(simulate, "Simulating", start_and_kill)
        assert bpy.ops.splash.simulate() == {"FINISHED"}
    done = len(files(splash))
    assert started[0].code and 1 <= done < 9
    assert "press Resume to go on" in splash.splash_simulation.warnings
    assert bpy.ops.splash.simulate() == {"FINISHED"}
    assert len(files(splash)) == 9 and not splash.splash_simulation.warnings


def kill_after_a_frame(child: simulate.Simulating) -> None:
    """Kill a process once it has made something, as another program would."""
    while not child.played and not child.is_done:
        time.sleep(0.005)
    child._process.kill()


def test_a_process_that_is_killed_before_its_first_frame(splash, monkeypatch):
    start = simulate.Simulating

    def start_and_kill(job: Path) -> simulate.Simulating:
        child = start(job)
        child._process.kill()
        return child

    with monkeypatch.context() as patch:
        patch.setattr(simulate, "Simulating", start_and_kill)
        refused(bpy.ops.splash.simulate, "ended too early .*: press Resume to go on")
    assert splash.splash_simulation.motion is None
    assert bpy.ops.splash.simulate() == {"FINISHED"}


def test_a_process_that_hangs_is_ended_by_esc(splash):
    """It says nothing any more; Esc still ends it, at once."""
    order = simulate.read_order(bpy.context, splash)
    run = simulate.Run(order)
    looks = iter(range(3))
    seen: list[simulate.Simulating] = []
    start = simulate.Simulating

    class Hanging(start):
        def __init__(self, job: Path) -> None:
            super().__init__(job)
            self._process.send_signal(signal.SIGSTOP)
            seen.append(self)

    def esc(_stage: str, _share: float) -> None:
        if seen and next(looks, None) is None:
            raise Cancelled

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulate, "Simulating", Hanging)
        with pytest.raises(Cancelled):
            simulate.simulate(run, esc)
    assert seen[0].is_done and seen[0].code == -signal.SIGKILL
    simulate.write(run)
    assert not splash.splash_simulation.folder and splash.splash_simulation.motion is None


def test_a_thread_that_does_not_end_holds_nothing_up(splash, monkeypatch):
    """Disabling and opening files wait for it no longer than they are told; nothing is written."""
    monkeypatch.setattr(work_queue, "is_immediate", lambda: False)
    release = threading.Event()
    written: list[object] = []
    work = work_queue.Work("hangs", lambda report: release.wait(60), written.append)
    work_queue.put(work_queue.Entry(0, lambda: work, lambda error: None))
    work_queue.tick()
    running = work_queue.running()
    assert running is not None and isinstance(running.job, Job)
    work_queue.stop(0.05)
    assert not running.job.is_done and work_queue.running() is None
    before = vertices(splash)
    release.set()
    running.job.wait(60)
    assert work_queue.tick() is None and not written
    np.testing.assert_array_equal(vertices(splash), before)
