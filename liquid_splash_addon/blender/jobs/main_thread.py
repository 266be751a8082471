# SPDX-License-Identifier: GPL-3.0-or-later
"""What threads ask Blender's own thread to do, in pieces that no user notices."""

from __future__ import annotations

import queue
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...core.progress import Report

MOST_SECONDS = 0.008
"""Most that is spent at once, the last piece not counted: half of what a picture takes."""

PAUSE = 0.05
"""Seconds between two reports of a thread that waits."""

_requests: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()


def ask(task: Callable[[], Any], report: Report, stage: str, share: float) -> Any:
    """Have a small task done in Blender's own thread, between two drawings; return its result.

    For work that must read more of the scene than one look may take: one call for each piece. Not
    while a render runs. ``report`` is told ``stage`` and ``share`` while it waits. Raises what it
    or the task raises.
    """
    if threading.current_thread() is threading.main_thread():
        report(stage, share)
        return task()
    answer: Future[Any] = Future()

    def answered() -> None:
        if not answer.set_running_or_notify_cancel():
            return
        try:
            answer.set_result(task())
        except BaseException as error:  # raised again in the thread that asks
            answer.set_exception(error)

    _requests.put(answered)
    try:
        while not answer.done():
            report(stage, share)
            wait([answer], PAUSE)
    finally:
        answer.cancel()  # of no effect on one that is done
    return answer.result()


def ask_anyway(task: Callable[[], Any]) -> None:
    """Have a task done in Blender's own thread some time, whatever becomes of this one."""

    def protected() -> None:
        try:
            task()
        except Exception as error:  # nobody waits for it
            traceback.print_exception(error)

    if threading.current_thread() is threading.main_thread():
        protected()
    else:
        _requests.put(protected)


def is_asked() -> bool:
    """Whether something is yet to be done."""
    return not _requests.empty()


def do_requests(seconds: float = MOST_SECONDS) -> None:
    """Do what was asked for, as much as begins within ``seconds``."""
    end = time.monotonic() + seconds
    while True:
        try:
            _requests.get_nowait()()
        except queue.Empty:
            return
        if time.monotonic() > end:
            return
