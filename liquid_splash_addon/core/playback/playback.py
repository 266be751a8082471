# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated frames turned into files that are played: refined, in the scene's units.

The files lie beside the simulation's own. Other refinements need no new simulation.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..composition.drops import Drops, drops_to_drawing, mesh_to_drawing
from ..mesh.mesh import Mesh
from ..mesh.spheres import spheres
from ..refinement.settings import (
    KINDS,
    SMALLEST_RADIUS,
    DropletSettings,
    RefinementSettings,
    WaveSettings,
)
from ..refinement.waves import add_waves
from ..scale import Scale
from ..simulation.frames import frames_done, read_frame, read_manifest
from ..simulation.start import Frame as SimulatedFrame
from ..simulation.start import MovingObstacle
from ..sketch.local_frame import Frame
from ..whole_file import whole_file, write_whole
from .files import FILE, MANIFEST, STATE
from .flying_drops import FlyingDrops, Surroundings, advance
from .ply import ply_bytes

VERSION = 3
"""Of what is written: another one is made anew."""


@dataclass(frozen=True)
class Playback:
    """How simulated frames are shown.

    Attributes
    ----------
    frame : from the simulation's local metres and seconds to the units of the object that plays and
        the seconds of the timeline
    steps : refinements evaluated on every frame: waves, and droplets that go on breaking off
    around : what drops fall through, local metres
    drops : those that fly from the start, as they are too small for the solver
    """

    frame: Frame
    steps: tuple[RefinementSettings, ...]
    around: Surroundings
    drops: FlyingDrops = field(default_factory=FlyingDrops.none)

    def to_json(self) -> dict[str, Any]:
        """Return it as what JSON can hold."""
        names = {kind: name for name, kind in KINDS.items()}
        return {
            "axes": self.frame.axes.tolist(),
            "centre": self.frame.centre.tolist(),
            "scale": [self.frame.scale.length, self.frame.scale.time],
            "steps": [[names[type(step)], asdict(step)] for step in self.steps],
            "gravity": self.around.gravity.tolist(),
            "up": self.around.up.tolist(),
            "ground": None if self.around.ground == -np.inf else self.around.ground,
            "drops": {name: values.tolist() for name, values in self.drops._asdict().items()},
        }

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Playback:
        """Return what :meth:`to_json` has described; KeyError, TypeError or ValueError if not."""
        axes, centre = (np.array(values[name], dtype=np.float64) for name in ("axes", "centre"))
        gravity, up = (np.array(values[name], dtype=np.float64) for name in ("gravity", "up"))
        ground = -np.inf if values["ground"] is None else float(values["ground"])
        return cls(
            Frame(axes, centre, Scale(*map(float, values["scale"]))),
            tuple(KINDS[kind](**settings) for kind, settings in values["steps"]),
            Surroundings(gravity, up, ground),
            read_flying(values["drops"]),
        )

    def key(self, simulation: Mapping[str, Any]) -> str:
        """Return what differs for other files; simulation : the manifest of the frames."""
        text = json.dumps([VERSION, self.to_json(), simulation.get("key")], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:32]


class Player:
    """Makes the files of a folder's frames, one after another, as far as these are there."""

    def __init__(
        self,
        folder: Path | str,
        playback: Playback,
        obstacles: Sequence[MovingObstacle] = (),
    ) -> None:
        """Take a folder that holds, or will hold, a simulation. What is there already is kept.

        obstacles : in which drops end, as they do in the liquid
        """
        self.folder, self.playback, self.obstacles = Path(folder), playback, obstacles
        self.done = 0
        self.left = 0.0
        self.drops = FlyingDrops.none()
        self.warnings: list[str] = []
        self._key = ""

    def catch_up(self) -> int:
        """Make the files of all frames that are done; return how many there are.

        Raises OSError and ValueError, with a sentence for the user.
        """
        available = frames_done(self.folder)
        while self.done < available:
            self.next()
        return self.done

    def next(self) -> None:
        """Make the file of the next frame, which must be there."""
        manifest = read_manifest(self.folder)
        self._begin(manifest)
        if self.done >= frames_done(self.folder):  # all of them were made before
            return
        frame = read_frame(self.folder, self.done)
        mesh, drops = self._refined(frame, manifest)
        write_whole(self.folder / FILE.format(number=self.done), ply_bytes(mesh, drops))
        self.done, self.left = self.done + 1, frame.left
        self._remember()

    def _begin(self, simulation: Mapping[str, Any]) -> None:
        """Go on after what was made from the same; without that, forget it."""
        key = self.playback.key(simulation)
        if key == self._key:
            return
        self._key, self.done, self.left, self.drops = key, 0, 0.0, FlyingDrops.none()
        made = read_json(self.folder / MANIFEST)
        kept = made.get("key") == key and read_drops(self.folder / STATE, int(made["frames"]))
        if kept:
            self.done, self.left, self.drops = int(made["frames"]), float(made["left"]), kept
        else:
            self._remember()  # from now on, files of others are not taken for these

    def _remember(self) -> None:
        """Keep what the next frame goes on from."""
        with whole_file(self.folder / STATE) as beside, beside.open("wb") as file:
            np.savez(file, frames=np.array(self.done), **self.drops._asdict())
        text = json.dumps({"key": self._key, "frames": self.done, "left": self.left})
        write_whole(self.folder / MANIFEST, text.encode())

    def _solids(self) -> list[np.ndarray]:
        """Return the triangles of the obstacles at this frame."""
        return [
            obstacle.poses[min(self.done, len(obstacle.poses) - 1)][obstacle.faces]
            for obstacle in self.obstacles
        ]

    def _refined(self, frame: SimulatedFrame, simulation: Mapping[str, Any]) -> tuple[Mesh, Drops]:
        """Return mesh and drops as they are played."""
        playback, cell = self.playback, float(simulation["cell"])
        droplets = [step for step in playback.steps if isinstance(step, DropletSettings)]
        if self.done == 0:
            self.drops = playback.drops
        else:
            self.drops = advance(
                self.drops, frame.mesh, droplets, float(simulation["frame_seconds"]),
                self.done, cell, playback.around, self._solids(),
            )  # fmt: skip
        mesh = frame.mesh
        for step in playback.steps:
            if isinstance(step, WaveSettings) and len(mesh.faces):
                mesh, about = add_waves(mesh, step, cell)
                self.warnings += [text for text in about.warnings if text not in self.warnings]
        still = Drops(*frame.drops, np.zeros(len(frame.drops.radii), dtype=bool))
        drops = joined([still, self.drops.shown()])
        # As those of a splash at rest: what a grid could resolve has a surface.
        drops = drops._replace(meshed=drops.radii >= SMALLEST_RADIUS * cell)
        if drops.meshed.any():
            mesh = mesh.joined(spheres(*(values[drops.meshed] for values in drops[:3])))
        return mesh_to_drawing(mesh, playback.frame), drops_to_drawing(drops, playback.frame)


def joined(drops: Sequence[Drops]) -> Drops:
    """Return several lists of drops as one."""
    return Drops(*map(np.concatenate, zip(*drops, strict=True)))


def played(folder: Path | str) -> int:
    """Return how many files a folder has to play, from the first on without a gap."""
    folder, count = Path(folder), 0
    most = int(read_json(folder / MANIFEST).get("frames", 0))
    while count < most and (folder / FILE.format(number=count)).is_file():
        count += 1
    return count


def share_left(folder: Path | str) -> float:
    """Return the share of the liquid that had left the domain at the last frame."""
    return float(read_json(Path(folder) / MANIFEST).get("left", 0.0))


def read_json(path: Path) -> dict[str, Any]:
    """Return what a file of JSON says; nothing where there is none that can be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def read_flying(values: Mapping[str, Any]) -> FlyingDrops:
    """Return drops that are written as lists."""
    arrays = [np.array(values[name], dtype=np.float32) for name in FlyingDrops._fields]
    return FlyingDrops(*(array.reshape(-1, 3) for array in arrays[:2]), *arrays[2:])


def read_drops(path: Path, frames: int) -> FlyingDrops | None:
    """Return the drops after a number of frames; None where they are not kept."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            if int(stored["frames"]) != frames:
                return None
            return FlyingDrops(*(stored[name] for name in FlyingDrops._fields))
    except (OSError, ValueError, KeyError, EOFError):
        return None
