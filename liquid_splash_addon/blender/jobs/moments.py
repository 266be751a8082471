# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash would be made of at another frame than the one that is shown."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.settings import SplashSettings
from ..data.frame_text import frame_to_text
from ..data.properties import plain, to_settings
from ..data.refinements import steps_of
from ..scene import follow, mesh_space, motion_object, places
from ..scene.grease_pencil import has_strokes
from ..scene.keyed import sketches_of
from ..scene.objects import Handle, SceneError
from ..scene.obstacles import placed, solids
from ..scene.targets import target_of
from . import generate, looks


@dataclass(frozen=True)
class Moment:
    """A frame as it was read.

    Attributes
    ----------
    request : what its splash is made of
    place : float64 ``(4, 4)``, from drawing space to that of the object that plays
    time_scale : of its slow motion
    """

    request: generate.Request
    place: np.ndarray
    time_scale: float

    @property
    def key(self) -> str:
        """Identifies the file: equal keys, equal files, in another session too."""
        request = self.request
        frame = "" if request.frame is None else frame_to_text(request.frame)
        text = f"{request.digest} {request.refinements!r} {frame} {request.frame_real_size} " + (
            f"{request.precision} {np.round(self.place, 6).tolist()} {self.time_scale}"
        )
        return hashlib.sha256(text.encode()).hexdigest()[:32]


def read_moment(item: Handle, frame: int, seen: Moment | None = None) -> Moment:
    """Read a frame; Blender goes on showing its own. Raises ValueError where there is no splash.

    seen : the frame whose strokes and obstacles it is to be made of, if not its own
    """
    splash = item.find()
    if splash is None:
        raise SceneError("The sketch or its splash was deleted meanwhile, so nothing was made")
    sketches = sketches_of(splash)
    collection = splash.splash_obstacles.collection
    around = [] if collection is None else [*solids(collection, splash)]
    with places.at_frame([splash, *sketches, *around], frame) as evaluated:
        shown = evaluated(splash)
        settings = to_settings(shown.splash.settings)
        request = read_strokes(splash, settings) if seen is None else seen.request
        place, _ = follow.wanted_place(splash, sketches[0], request.moved)
        player = np.array(shown.matrix_world, dtype=np.float64) @ player_space(splash)
        request = replace(
            request,
            settings=settings,
            refinements=steps_of(shown),
            clearance=plain(shown.splash_obstacles.clearance),
            look=looks.NOTHING,
        )
        time_scale = plain(shown.splash_motion.time_scale)
    return Moment(request, np.linalg.inv(player) @ place, time_scale)


def read_strokes(splash: bpy.types.Object, settings: SplashSettings) -> generate.Request:
    """Read what a splash is made of at the frame that is read, obstacles where it is to be."""
    sketches = sketches_of(splash)
    if not any(map(is_drawn, sketches)):
        raise SceneError("The sketch has no drawing there, so there is no liquid")
    request = generate.snapshot(bpy.context, target_of(splash), settings)
    if not request.obstacles:
        return request
    place, _ = follow.wanted_place(splash, sketches[0], request.moved)
    here = np.linalg.inv(place) @ np.array(mesh_space.liquid_matrix(splash), dtype=np.float64)
    return replace(request, obstacles=[placed(one, here) for one in request.obstacles])


def is_drawn(sketch: bpy.types.Object) -> bool:
    """Whether a sketch may have strokes at the frame that is read."""
    return sketch.type != "GREASEPENCIL" or any(map(has_strokes, sketch.data.layers))


def player_space(splash: bpy.types.Object) -> np.ndarray:
    """Return the transform from the object that plays to the splash it follows, ``(4, 4)``."""
    for item in motion_object.players_of(splash):
        return np.array(item.matrix_parent_inverse, dtype=np.float64)
    return mesh_space.space_of(splash.data)
