# SPDX-License-Identifier: GPL-3.0-or-later
"""Files to play that are made one by one, each of something of its own: a splash a frame.

They lie where those of a simulation do and are played alike. Each is known by the key of what it
was made of: the same is made once, however often it is shown, and what is there already stays.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from ..composition.drops import Drops
from ..mesh.mesh import Mesh
from ..whole_file import write_whole
from .files import FILE, MANIFEST
from .playback import read_json
from .ply import ply_bytes

VERSION = "baked 1"
"""Of what is written: files of another one are made anew."""


class BakedFrames:
    """The files of a folder, made first to last.

    Attributes
    ----------
    keys : what the files were made of, those of earlier runs included, as far as they are there
    done : how many of them are ready
    made : how many of these this run has made; the others were there
    """

    def __init__(self, folder: Path | str) -> None:
        """Take a folder, which must be there. Files of a simulation in it will be replaced."""
        self.folder = Path(folder)
        manifest = read_json(self.folder / MANIFEST)
        keys = manifest.get("made_of", ()) if manifest.get("key") == VERSION else ()
        self.keys = [str(key) for key in keys]
        self.done = self.made = 0
        self._remember()

    def add(self, key: str, make: Callable[[], tuple[Mesh, Drops | None]]) -> None:
        """Have the next file ready: as it is, like an earlier one, or made anew.

        make : returns mesh and free drops in the units of the object that plays and the seconds of
            the timeline. Raises what it raises, and OSError.
        """
        earlier = self.keys[: self.done]
        path = self._path(self.done)
        if not (self.keys[self.done : self.done + 1] == [key] and path.is_file()):
            if key in earlier:
                content = self._path(earlier.index(key)).read_bytes()
            else:
                content = ply_bytes(*make())
                self.made += 1
            self._know("")  # or a crash would leave the new file with the old one's key
            write_whole(path, content)
            self._know(key)
        self.done += 1
        self._remember()

    def _know(self, key: str) -> None:
        """Note what the next file is made of; "" while it is written."""
        is_replaced = self.done < len(self.keys)
        self.keys[self.done : self.done + 1] = [key]
        if is_replaced and not key:
            self._remember()

    def _path(self, number: int) -> Path:
        return self.folder / FILE.format(number=number)

    def _remember(self) -> None:
        """Note what is there."""
        text = json.dumps({"key": VERSION, "frames": self.done, "made_of": self.keys})
        write_whole(self.folder / MANIFEST, text.encode())
