# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracked hands without hardware: what Monado's remote driver is sent, and how a hand is posed.

Its packets (magic ``mndrmt3``, 376 bytes, little endian) hold the head and both controllers whole.
OpenXR's axes: x right, y up, z towards the viewer; metres; quaternions ``(x, y, z, w)``.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

MAGIC = b"mndrmt3\0"
HEAD = struct.Struct("<8f3fI 8f3fI 4f3f 4B")
"""Two eyes (field of view, rotation, place, padding), the head's rotation and place, flags."""

HAND = struct.Struct("<4f3f 6f 5f 3f 2f f 2f 16B")
"""Rotation, place, velocities, fingers, trigger and squeeze, stick, pad; what is on and pressed."""

SIZE = len(MAGIC) + HEAD.size + 2 * HAND.size
STANDING = (0.0, 1.6, 0.0)
UNTURNED = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Hand:
    """A controller (Valve Index) at one moment."""

    place: Sequence[float]
    turn: Sequence[float] = UNTURNED
    trigger: float = 0.0
    squeeze: float = 0.0
    a: bool = False
    b: bool = False
    stick: bool = False

    def packed(self) -> bytes:
        """Return its part of a packet."""
        trigger = (self.trigger > 0.75, self.trigger > 0.0)  # pressed, touched
        on = [False, True, False, False, self.a, self.a, self.b, self.b, *trigger]
        on += [self.stick, self.stick, False, False, False, False]
        pulled = (self.trigger, self.squeeze, self.squeeze)
        return HAND.pack(*self.turn, *self.place, *[0.0] * 11, *pulled, *[0.0] * 5, *on)

    def in_blender(self, reach: float = 0.0) -> np.ndarray:
        """Return the place of a pen tip ``reach`` metres in front, on Blender's axes."""
        x, y, z, w = self.turn
        ahead = -np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        tip = np.asarray(self.place, dtype=float) + reach * ahead
        return np.array([tip[0], -tip[2], tip[1]])


def packet(left: Hand, right: Hand) -> bytes:
    """Return what sets both hands, and a head that stands still."""
    eye = (0, 0, 0, 0, *UNTURNED, 0, 0, 0, 0)
    head = HEAD.pack(*eye, *eye, *UNTURNED, *STANDING, 0, 0, 0, 0)
    return MAGIC + head + left.packed() + right.packed()


class Feeder:
    """The connection to the driver: it keeps the last packet until the next."""

    def __init__(self, port: int) -> None:
        """Connect, and read the two packets with which the driver greets."""
        self.socket = socket.create_connection(("127.0.0.1", port), 5.0)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        greeting = b""
        while len(greeting) < SIZE and (part := self.socket.recv(SIZE - len(greeting))):
            greeting += part
        assert greeting.startswith(MAGIC), greeting[:8]

    def send(self, left: Hand, right: Hand) -> None:
        """Set both hands."""
        self.socket.sendall(packet(left, right))

    def play(
        self, moments: Sequence[tuple[float, Hand, Hand]], sent: list[float]
    ) -> threading.Thread:
        """Send hands at their times, seconds from now, in a thread that is returned.

        sent : gets the times at which they were really sent: a busy machine is late
        """

        def run() -> None:
            began = time.perf_counter()
            for at, left, right in moments:
                time.sleep(max(0.0, began + at - time.perf_counter()))
                self.send(left, right)
                sent.append(time.perf_counter())

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        return thread
