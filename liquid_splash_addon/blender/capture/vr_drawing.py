# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing in a virtual reality session of Blender.

A timer looks at the hands once each time round Blender's main loop, which is once a frame while a
session runs. No modal operator takes part: both hands draw at once, and a session that ends in the
middle of a stroke leaves nothing behind that waits for a release.
"""

from __future__ import annotations

import time
import traceback
from typing import Any, NamedTuple

import bpy

from ...core.sketch.recording import Pen, Recording, next_gain
from ..jobs import draft_then_full, undo_step, work_queue
from ..jobs.job import redraw_sidebars
from ..jobs.messages import sentence_for
from ..scene import world_strokes
from ..scene.objects import Handle
from ..scene.sketch import INK_RADIUS
from ..scene.targets import find_target
from . import action_set, feedback, hands
from .bindings import GAIN, GENERATE, HANDS, UNDO

EVERY_FRAME = 0.0
"""Seconds until the timer looks again: none, Blender then calls it in each round of its loop."""

MESSAGE_SECONDS = 3.0
"""How long a message stays in the headset."""

ENDED = "The VR session has ended. All strokes are kept"
NO_SET = "Stop the VR session and start it here: it was started without the buttons for drawing"


class Message(NamedTuple):
    """What is shown at a hand for a moment."""

    text: str
    hand: int
    until: float


class DrawingSession:
    """What is going on in a session while one draws.

    Attributes
    ----------
    pens : left and right
    owns_session : whether ending it ends the session
    message : what to show at a hand
    """

    def __init__(self, owns_session: bool) -> None:
        """Begin; the session may not have drawn its first frame yet."""
        self.pens = [Pen() for _ in HANDS]
        self.owns_session = owns_session
        self.message: Message | None = None
        self.poses: list[Any] = [None] * len(HANDS)
        self._buttons = hands.Buttons()
        self._unwritten: list[Recording] = []
        self._written: list[world_strokes.Written] = []
        self._ink: dict[Handle, float] = {}
        self._needs_undo_step = False
        self._is_set_active = False

    def step(self, context: bpy.types.Context) -> None:
        """Follow hands and buttons by one frame."""
        if not self._is_set_active:  # once: it would end the grabbing of a hand that moves about
            action_set.activate(context, action_set.NAME)
            self._is_set_active = True
        reach = context.scene.splash_capture.tip
        for hand, pen in enumerate(self.pens):
            pose = self.poses[hand] = hands.pose_of(context, hand, reach)
            if pose is None:
                continue
            was_down = pen.is_down
            self._end(pen.move(pose))
            if pen.is_down != was_down:
                hands.tick(context, hand)
        for action, hand in self._buttons.pressed(context):
            self._press(context, action, hand)
        if not work_queue.is_locked():
            feedback.show(context, self)
        self.write(context)

    def lift(self) -> None:
        """End the strokes that are being drawn, as far as they are."""
        for pen in self.pens:
            self._end(pen.lift())

    def write(self, context: bpy.types.Context) -> None:
        """Write what was drawn into the sketch; never while Blender renders."""
        if work_queue.is_locked():
            return
        while self._unwritten:
            self._write(context, self._unwritten[0])
            del self._unwritten[0]
        if self._needs_undo_step and not any(pen.is_down for pen in self.pens):
            self._needs_undo_step = False
            undo_step.push("VR Stroke")

    def say(self, text: str, hand: int) -> None:
        """Show a message at a hand, and in the panel."""
        self.message = Message(text, hand, time.monotonic() + MESSAGE_SECONDS)
        redraw_sidebars()

    def _end(self, recording: Recording | None) -> None:
        if recording is not None:
            self._unwritten.append(recording)

    def _write(self, context: bpy.types.Context, recording: Recording) -> None:
        sketch = world_strokes.sketch_to_draw_on(context)
        scale = recording.poses[0].scale
        ink = self._ink.setdefault(Handle.of(sketch), INK_RADIUS * scale)
        drawing = recording.drawing()
        try:
            written = world_strokes.write_stroke(context, sketch, drawing, ink)
        except Exception as error:  # whatever is wrong with that sketch, the stroke is not lost
            traceback.print_exception(error)
            fresh = world_strokes.fresh_sketch(context)
            written = world_strokes.write_stroke(context, fresh, drawing, INK_RADIUS * scale)
        self._written.append(written)
        self._needs_undo_step = True

    def _press(self, context: bpy.types.Context, action: str, hand: int) -> None:
        """Do what a button is for."""
        try:
            does = {UNDO: self._undo, GENERATE: self._generate, GAIN: self._gain}[action]
            self.say(does(context, hand), hand)
        except ValueError as error:
            self.say(sentence_for(error), hand)
        hands.tick(context, hand)

    def _undo(self, _context: bpy.types.Context, _hand: int) -> str:
        """Remove the last stroke that is still there as it was drawn."""
        while self._written:
            if world_strokes.remove_stroke(self._written.pop()):
                self._needs_undo_step = True
                return "Stroke removed"
        return "No stroke to remove"

    def _generate(self, context: bpy.types.Context, hand: int) -> str:
        """Have the splash made, while one goes on drawing."""
        draft_then_full.request(context, lambda text: self.say(text, hand))
        return "Generating"

    def _gain(self, context: bpy.types.Context, _hand: int) -> str:
        """Choose the next preset of the speed gain, for the splash or for new ones."""
        target = find_target(context)
        splash = None if target is None else target.splash
        settings = (context.scene if splash is None else splash).splash.settings
        settings.speed_gain = next_gain(settings.speed_gain)
        self._needs_undo_step = True
        return f"Speed gain {settings.speed_gain:g}"


_drawing: DrawingSession | None = None
_note = ""


def current() -> DrawingSession | None:
    """Return what is going on; None while nobody draws."""
    return _drawing


def note() -> str:
    """Return why drawing has ended, for the panel; "" where it was asked to."""
    return _note


def start(context: bpy.types.Context, owns_session: bool) -> None:
    """Begin to draw in the session that is running or just starting."""
    global _drawing, _note
    _drawing, _note = DrawingSession(owns_session), ""
    if not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=EVERY_FRAME, persistent=True)


def stop(context: bpy.types.Context, reason: str = "") -> None:
    """End drawing: what was being drawn is kept, and the session's own buttons work again."""
    global _drawing, _note
    ended, _drawing = _drawing, None
    _note = reason
    if ended is None:
        return
    feedback.hide()
    if hands.is_running(context):
        action_set.activate(context, action_set.original())
    ended.lift()
    ended.write(context)
    redraw_sidebars()


def look() -> float | None:
    """Follow the session by one frame; None ends the timer."""
    context = bpy.context
    drawing = _drawing
    if drawing is None:
        return None
    try:
        if not hands.is_running(context):
            stop(context, ENDED)
            return None
        if not action_set.is_there(context.window_manager.xr_session_state):
            stop(context, NO_SET)
            return None
        drawing.step(context)
    except Exception as error:
        traceback.print_exception(error)
        stop(context, sentence_for(error))
        return None
    return EVERY_FRAME


@bpy.app.handlers.persistent
def before_another_file(_file: object = None, _unused: object = None) -> None:
    """Forget strokes of the file that is closed; the session goes on with the next."""
    if _drawing is not None:
        _drawing.lift()
        start(bpy.context, _drawing.owns_session)


def register() -> None:
    """Listen to files being opened."""
    bpy.app.handlers.load_pre.append(before_another_file)


def unregister() -> None:
    """End drawing."""
    bpy.app.handlers.load_pre.remove(before_another_file)
    stop(bpy.context)
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)
