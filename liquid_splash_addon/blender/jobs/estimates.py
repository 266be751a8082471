# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simulation will take, for the panel: found out by the queue, as it needs the liquid."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import bpy

from ..scene.objects import Handle
from . import simulate, solver_start, work_queue
from .messages import sentence_for
from .work_queue import Entry, Work

if TYPE_CHECKING:
    from ...core.progress import Report

_known: dict[int, tuple[str, str]] = {}
"""What was found of each splash or model, by session_uid: for which settings, and the sentence."""

_asked: set[int] = set()


def of(item: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """Return a sentence on what simulating ``item`` will take; "" as long as it is not known."""
    uid, key = item.session_uid, simulate.made_of(item, scene)
    found = _known.get(uid)
    if found is not None and found[0] == key:
        return found[1]
    if uid not in _asked and not work_queue.is_immediate():
        _asked.add(uid)
        handle = Handle.of(item)
        work_queue.put(Entry(0, partial(read, handle), partial(fail, handle, key)))
    return ""


def read(handle: Handle) -> Work | None:
    """Read what is to be estimated; None if it is gone."""
    _asked.discard(handle.uid)
    item = handle.find()
    if item is None:
        return None
    order = simulate.read_order(bpy.context, item)
    return Work(order.made_of, partial(compute, order), partial(keep, handle, order.made_of))


def compute(order: simulate.Order, report: Report) -> str:
    """Return the sentence, without bpy."""
    from ...core.simulation.estimate import estimate

    made = solver_start.compute_start(order.start, report)
    return sentence(estimate(simulate.start_of(order, made, ()), order.settings))


def sentence(expected: object) -> str:
    """Say what a core's Estimate means."""
    seconds, memory = (float(getattr(expected, name)) for name in ("seconds", "memory"))
    disc = simulate.bytes_on_disc(expected)
    return f"About {duration(seconds)}, {size(memory)} of memory, {size(disc)} on disk"


def duration(seconds: float) -> str:
    """Return a time in the unit that suits it."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * length:
            return f"{two_digits(seconds / length)} {unit}"
    return f"{two_digits(max(seconds, 1.0))} s"


def size(count: float) -> str:
    """Return bytes in the unit that suits them."""
    if count >= 0.95e9:
        return f"{two_digits(count / 1e9)} GB"
    return f"{two_digits(max(count / 1e6, 1))} MB"


def two_digits(value: float) -> str:
    """Return a number rounded to two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):,g}"


def keep(handle: Handle, key: str, text: str) -> None:
    """Remember a sentence."""
    _known[handle.uid] = key, text


def fail(handle: Handle, key: str, error: Exception) -> None:
    """Remember in its place why it cannot be simulated."""
    _asked.discard(handle.uid)
    _known[handle.uid] = key, sentence_for(error)


@bpy.app.handlers.persistent
def forget(_file: object = None, _unused: object = None) -> None:
    """Forget all: another file is opened."""
    _known.clear()
    _asked.clear()


def register() -> None:
    """Listen to files being opened."""
    bpy.app.handlers.load_pre.append(forget)


def unregister() -> None:
    """Forget all."""
    bpy.app.handlers.load_pre.remove(forget)
    forget()
