# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by vr_harness.py in a Blender with a window and a VR runtime: hands draw, as an artist's do.

    vr_script.py -- SCENE [SCENE ...]

Scenes are generators that yield conditions; a timer resumes them once the condition holds, so that
Blender's main loop, and with it the session, goes on between them.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

import liquid_splash_addon
from liquid_splash_addon.blender.capture import action_set, feedback, hands, vr_drawing
from liquid_splash_addon.blender.jobs import draft_then_full, loaded_generator
from liquid_splash_addon.blender.ui import vr_panel
from liquid_splash_addon.core.sketch import speed_colours
from liquid_splash_addon.core.sketch.strokes import arc_length
from tests.blender.monado import Hand
from tests.blender.running_scripts import run
from tests.blender.sketching import SIZE, TubeGenerator, splashes
from tests.blender.vr_hands import (
    LEFT,
    RIGHT,
    Condition,
    Hands,
    Steps,
    away,
    blender_path,
    circle,
    in_view,
    in_world,
    mean_speed,
    sketches,
    strokes,
    tip,
)
from tests.blender.vr_motion import PACE, RATE, Motion, made_motion, recorded_motion

PATIENCE = 600.0
"""Seconds until a condition that does not come true is a failure."""

EXACT = 1e-3
"""Metres: how far a recorded point may be from the path that was sent."""

SLOWEST = 6.0
"""Times as slow as PACE that motions are played at most, where other work takes the cores."""

SPEED_ERROR = 0.1
"""Share by which the mean speed of a stroke of a second or more may be off."""

STOCK = "viewport_vr_preview"


HANDS: Hands


def begin(stock: bool = False) -> Steps:
    """Start a session and wait for its first poses."""
    settings = bpy.context.window_manager.xr_session_settings
    settings.use_absolute_tracking = True
    settings.base_pose_type, settings.base_pose_location = "CUSTOM", (0.0, 0.0, 0.0)
    settings.base_pose_angle = 0.0
    HANDS.send(LEFT, RIGHT)
    assert in_view(bpy.ops.splash.vr_drawing) == {"FINISHED"}
    assert vr_drawing.current() is not None
    assert action_set.original() == ("blender_default" if stock else "")
    yield HANDS.seen


def end() -> Steps:
    """Stop, by the same button."""
    assert in_view(bpy.ops.splash.vr_drawing) == {"FINISHED"}
    assert vr_drawing.current() is None and vr_drawing.note() == ""
    yield lambda: bpy.context.window_manager.xr_session_state is None
    assert bpy.data.collections.get(feedback.COLLECTION) is None
    assert not [item for item in bpy.data.objects if item.name.startswith(feedback.WET_INK)]


def empty() -> None:
    """Remove all objects, and make drafts fast and full splashes another resolution."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    settings = bpy.context.scene.splash.settings
    settings.resolution, settings.real_size = "128", SIZE


def one_stroke() -> Steps:
    """Draw, undo, generate and change the gain with one hand; every pose is kept as it was."""
    empty()
    yield from begin()
    path = circle((0.1, 1.3, -0.6))
    yield from HANDS.draw(1, path)
    (stroke,) = strokes()
    assert len(np.unique(stroke.points, axis=0)) == len(path), "every pose is kept"
    assert len(stroke.points) <= 2 * len(path), "and those that repeat are not"
    assert away(stroke.points, blender_path(path)) < 1e-5
    assert (np.diff(stroke.times) > 0).all() and stroke.times[0] == 0
    yield from HANDS.draw(0, path - (0.5, 0, 0), trigger=0.4)
    first, second = strokes()
    pressures = [read.pressures.mean() for read in (first, second)]
    assert np.allclose(pressures, (1.0, 0.5), atol=1e-3), "the trigger, over the largest"
    assert len(sketches()) == 1
    yield from HANDS.press(0, "a")
    assert len(strokes()) == 1, "the button undoes"
    in_view(bpy.ops.ed.undo)
    yield lambda: len(strokes()) == 2
    in_view(bpy.ops.ed.redo)
    yield lambda: len(strokes()) == 1
    yield from HANDS.draw(0, path - (0.4, 0, 0))
    yield from HANDS.press(1, "stick")
    assert bpy.context.scene.splash.settings.speed_gain == 4.0, "the next one"
    yield from generated()
    yield from end()
    assert len(strokes()) >= 2


def generated() -> Steps:
    """Generate by a button: a draft, then the full splash, while one goes on drawing."""
    before = len(strokes())
    yield from HANDS.press(1, "b")
    yield lambda: bool(splashes())
    (splash,) = splashes()
    draft = len(splash.data.vertices)
    assert draft_then_full.making().stage == "full"
    yield from HANDS.draw(1, circle((0.2, 1.2, -0.5), 0.1, 8))
    assert len(strokes()) == before + 1, "one goes on drawing"
    yield lambda: draft_then_full.making().stage == "done"
    (splash,) = splashes()
    assert len(splash.data.vertices) > 2 * draft
    assert splash.splash.settings.resolution == "128"
    assert splash.splash.sketch == sketches()[0]


def frame_rate() -> Generator[Condition, None, float]:
    """Measure how many poses a second there are: on a busy machine, few."""
    times = []

    def seen() -> bool:
        times.append(time.perf_counter())
        return times[-1] - times[0] > 2.0

    yield seen
    rate = (len(times) - 1) / (times[-1] - times[0])
    print(f"vr: {rate:.1f} frames a second", flush=True)
    return rate


def played(motion: Motion) -> Steps:
    """Play a motion of both hands, and compare every stroke with what was sent."""
    before = len(strokes())
    first = motion.moments[0]
    yield HANDS.send(replace(first[1], trigger=0.0), replace(first[2], trigger=0.0))
    stamps: list[float] = []
    pace = PACE * min(max(1.0, RATE / (yield from frame_rate())), SLOWEST)
    thread = HANDS.feeder.play(motion.slowly(pace), stamps)
    yield lambda: not thread.is_alive()
    motion = motion.as_sent(stamps, pace)
    HANDS.last = list(motion.moments[-1][1:])
    yield HANDS.lift(0)
    yield HANDS.lift(1)
    sent = [stroke for side in range(2) for stroke in motion.strokes(side)]
    drawn = strokes()[before:]
    assert len(drawn) == len(sent), (len(drawn), len(sent))
    worst, errors = 0.0, []
    for times, path in sent:
        points = np.array([in_world(hand.in_blender(tip())) for hand in path])
        stroke = min(drawn, key=lambda drawing, points=points: away(drawing.points, points))
        worst = max(worst, away(stroke.points, points) / hands.scale_of(bpy.context))
        if times[-1] - times[0] >= 0.99:
            truth = arc_length(points)[-1] / (times[-1] - times[0])
            errors.append(abs(pace * mean_speed(stroke) / truth - 1))
    off = ", ".join(f"{error:.1%}" for error in errors)
    print(f"vr: {worst * 1e3:.4f} mm away, speeds off by {off}", flush=True)
    assert worst < EXACT, worst
    assert errors and max(errors) < SPEED_ERROR, errors


def two_hands() -> Steps:
    """Draw with both hands at once, as the session stands, then where it was moved and scaled."""
    empty()
    yield from begin()
    yield from played(made_motion())
    state = bpy.context.window_manager.xr_session_state
    state.navigation_location, state.navigation_scale = (2.0, -1.0, 0.5), 3.0
    state.navigation_rotation = (0.9238795, 0.0, 0.0, 0.3826834)  # 45 degrees about Z
    yield HANDS.send(LEFT, RIGHT)
    yield from HANDS.draw(1, circle((0.1, 1.3, -0.6)))
    path = blender_path(circle((0.1, 1.3, -0.6)))
    assert away(strokes()[-1].points, path) < 3 * EXACT
    assert np.ptp(path, axis=0).max() > 0.9, "three times as large"
    yield from end()


def recorded() -> Steps:
    """Draw as a person did."""
    motion = recorded_motion()
    if motion is None:
        print("vr: skipped, the recording is not here", flush=True)
        return
    empty()
    yield from begin()
    yield from played(motion)
    yield from end()


def stock() -> Steps:
    """Draw beside the stock add-on: its trigger teleports, but not while one draws."""
    bpy.ops.preferences.addon_enable(module=STOCK)
    empty()
    for _ in range(2):
        yield from begin(stock=True)
        yield from HANDS.draw(1, circle((0.1, 1.3, -0.6)))
        state = bpy.context.window_manager.xr_session_state
        assert state.navigation_location.length == 0.0, "the trigger does not teleport"
        made = state.actionmaps.find(state, action_set.NAME)
        names = {item.name for item in made.actionmap_items}
        assert {"nav_grab", "fly_forward", "controller_aim"} <= names, names
        assert not {"teleport", "viewfinder_capture"} & names, names
        vr_drawing.current().owns_session = False
        in_view(bpy.ops.splash.vr_drawing)
        count = len(strokes())
        assert hands.is_running(bpy.context), "the session goes on"
        # The stock teleport aims at the floor: look down, and pull the trigger.
        down = (-0.7071068, 0.0, 0.0, 0.7071068)
        floor()
        for trigger in (0.0, 1.0, 1.0, 0.0):
            HANDS.send(right=Hand((0.3, 1.3, -0.5), down, trigger))
            yield after(0.6)
        yield lambda: bpy.context.window_manager.xr_session_state.navigation_location.length > 0.1
        assert len(strokes()) == count, "nobody draws"
        in_view(bpy.ops.wm.xr_session_toggle)
        yield lambda: bpy.context.window_manager.xr_session_state is None
        # Once more, with the stock add-on's handler before ours in the list.
        handlers = bpy.app.handlers.xr_session_start_pre
        handlers.remove(action_set.before_session)
        handlers.append(action_set.before_session)
        empty()
    bpy.ops.preferences.addon_disable(module=STOCK)


def floor() -> None:
    """Add something to teleport to."""
    mesh = bpy.data.meshes.new("Floor")
    corners = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Floor", mesh))
    bpy.context.view_layer.update()


def after(seconds: float) -> Condition:
    """Return the condition that some time has passed."""
    until = time.monotonic() + seconds
    return lambda: time.monotonic() > until


def killed() -> Steps:
    """Lose the runtime in the middle of a stroke: what was drawn is kept, and Blender goes on."""
    empty()
    yield from begin()
    path = circle((0.1, 1.3, -0.6))
    yield from HANDS.draw(0, path - (0.5, 0, 0))
    for place in path:
        yield HANDS.send(right=Hand(tuple(map(float, place)), trigger=0.8))
    assert vr_drawing.current().pens[1].is_down and len(strokes()) == 1
    os.kill(int(os.environ["VR_SERVICE"]), signal.SIGKILL)
    yield lambda: vr_drawing.current() is None
    assert vr_drawing.note() == vr_drawing.ENDED
    assert len(strokes()) == 2, "finished or not"
    assert bpy.data.collections.get(feedback.COLLECTION) is None
    in_view(bpy.ops.ed.undo)
    assert len(strokes()) == 1
    yield after(0.5)
    try:
        in_view(bpy.ops.splash.vr_drawing)
    except RuntimeError as error:
        assert "No VR runtime" in str(error), error
    else:
        raise AssertionError("there is no runtime to start with")
    assert vr_drawing.current() is None


def pictures() -> Steps:
    """Take pictures of the screen, which mirrors the headset: in a stroke, and with the splash."""
    empty()
    speed_colours.FAST = 0.1  # without a GPU, poses come at the pace of a snail
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    area.spaces.active.show_region_ui = True
    yield after(1.0)
    with bpy.context.temp_override(window=window, area=area):
        next(r for r in area.regions if r.type == "UI").active_panel_category = "Splash"
    yield from begin()
    area.spaces.active.mirror_xr_session = True
    for height in (1.5, 1.65):
        yield from HANDS.draw(0, circle((-0.25, height, -1.2), 0.15, 16))
    place = circle((0.15, 1.55, -1.2), 0.2, 24)
    for n in sorted({int(n) for n in np.linspace(0, 23**0.5, 16) ** 2}):
        yield HANDS.send(right=Hand(tuple(map(float, place[n])), trigger=0.9))
    picture("drawing")
    yield HANDS.lift(1)
    yield from HANDS.press(1, "b")
    yield lambda: draft_then_full.making().stage == "done"
    yield from HANDS.press(1, "stick")
    picture("generated")
    yield from end()


def picture(name: str) -> None:
    """Save what the screen shows, where pictures are wanted."""
    folder = os.environ.get("VR_PICTURES")
    if folder:
        # Blender's own screenshot is black while a session runs.
        subprocess.run(["import", "-window", "root", Path(folder) / f"{name}.png"], check=True)


SCENES = {
    scene.__name__: scene for scene in (one_stroke, two_hands, recorded, stock, killed, pictures)
}


STEPS: list[float] = []
"""Seconds that the add-on took in each frame."""


def timed(step: Callable[..., None]) -> Callable[..., None]:
    """Have a method note how long it takes."""

    def run(*given: object) -> None:
        began = time.perf_counter()
        step(*given)
        STEPS.append(time.perf_counter() - began)

    return run


def everything(names: Sequence[str]) -> Steps:
    """Play scenes one after the other."""
    for name in names:
        began = time.monotonic()
        yield from SCENES[name]()
        print(f"vr: {name} in {time.monotonic() - began:.1f} s", flush=True)
    longest = sorted(STEPS)[-3:]
    print(f"vr: steps {np.median(STEPS) * 1e3:.2f} ms, longest {longest}", flush=True)


def explain() -> None:
    """Say where hands and poses were when the script failed."""
    print("hands:", HANDS.last, flush=True)
    if vr_drawing.current() is not None:
        print("poses:", vr_drawing.current().poses, flush=True)


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :]
    if "pictures" in words:  # the panel that they show, open and at the top
        vr_panel.SPLASH_PT_vr.bl_options, vr_panel.SPLASH_PT_vr.bl_order = set(), -1
    liquid_splash_addon.register()
    GENERATOR = TubeGenerator()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    vr_drawing.DrawingSession.step = timed(vr_drawing.DrawingSession.step)
    HANDS = Hands()
    bpy.app.timers.register(
        run(everything(words), "vr", PATIENCE, 0.002, explain), first_interval=0.5, persistent=True
    )
