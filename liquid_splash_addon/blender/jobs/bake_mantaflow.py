# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake an exported domain: data, then the mesh, then a comparison of the first solved frame.

With a window these are Blender's own jobs, with its progress bar and Esc; what is done is kept, and
baking again goes on from there. In the background they block.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from ..scene import fluid_domain
from ..scene.objects import Handle, SceneError, select_only
from .export_mantaflow import reason_to_export

TICK = 0.5
"""Seconds between two looks at Blender's job."""

_waiting: dict[Handle, str] = {}
"""Domains that are being baked: what comes next of "MESH" and "END"."""


def cache_of(item: bpy.types.Object) -> Path:
    """Return the folder of a domain's cache."""
    return Path(bpy.path.abspath(fluid_domain.settings_of(item).cache_directory))


def last_frame(item: bpy.types.Object) -> int:
    """Return the last frame without a gap that is in a domain's cache."""
    from ...core.mantaflow.cache_files import data_path

    fluid = fluid_domain.settings_of(item)
    cache, frame = cache_of(item), item.splash_domain.frame
    while frame < fluid.cache_frame_end and data_path(cache, "pp", frame + 1).is_file():
        frame += 1
    return frame


def check(item: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Raise SceneError if a domain cannot be baked now, with what to do first."""
    fluid_domain.check_usable(item)
    if reason := reason_to_export(item, scene):
        raise SceneError(f"{reason}: use Export Again first")


def bake(context: bpy.types.Context, item: bpy.types.Object) -> None:
    """Bake a domain, or go on with it. Raises SceneError with what to do first."""
    check(item, context.scene)
    select_only(context, item)
    fluid, done = fluid_domain.settings_of(item), last_frame(item)
    if done < fluid.cache_frame_end:
        # The last frame may be cut off: it is solved once more, from the one before it.
        fluid.cache_frame_pause_data = max(done, item.splash_domain.frame + 1)
        fluid.has_cache_baked_data = True
        if bpy.app.background:
            bpy.ops.fluid.bake_data()
        else:
            bpy.ops.fluid.bake_data("INVOKE_DEFAULT")
    if bpy.app.background:
        if last_frame(item) == fluid.cache_frame_end and fluid.use_mesh:
            bpy.ops.fluid.bake_mesh()
        finish(item, context.scene)
        return
    _waiting[Handle.of(item)] = "MESH"
    if not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=TICK)


def look() -> float | None:
    """Go on where a job of Blender's has ended; None when nothing is left to do."""
    for handle, step in [*_waiting.items()]:
        item = handle.find()
        fluid = fluid_domain.settings_of(item)
        if item is None or fluid is None or not item.users_scene:
            del _waiting[handle]
        elif not fluid_domain.is_baking(fluid):
            whole = last_frame(item) == fluid.cache_frame_end
            if step == "MESH" and whole and fluid.use_mesh and not fluid.has_cache_baked_mesh:
                _waiting[handle] = "END"
                start_mesh(item)
            else:
                del _waiting[handle]
                finish(item, item.users_scene[0])
    return TICK if _waiting else None


def start_mesh(item: bpy.types.Object) -> None:
    """Start Blender's job that makes the surface."""
    window = bpy.context.window_manager.windows[0]
    area = next((one for one in window.screen.areas if one.type == "VIEW_3D"), None)
    with bpy.context.temp_override(window=window, area=area):
        select_only(bpy.context, item)
        bpy.ops.fluid.bake_mesh("INVOKE_DEFAULT")


def finish(item: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Compare the first solved frame, and hide the splash once all is baked."""
    group, fluid = item.splash_domain, fluid_domain.settings_of(item)
    done = last_frame(item)
    if done > group.frame:
        group.verified = verify(item, scene)
    if fluid.has_cache_baked_mesh and item.display_type == "WIRE":
        item.display_type = "TEXTURED"
    source = fluid_domain.source_of(item)
    if done == fluid.cache_frame_end and group.settings.hide and source is not None:
        if source.is_editable:
            source.hide_viewport = source.hide_render = True


def verify(item: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """Return how well the first solved frame goes on from the splash, or why that is not known."""
    from ...core.mantaflow.cache_files import CacheError
    from ...core.mantaflow.comparison import compare

    group = item.splash_domain
    try:
        fall = fluid_domain.gravity_vector(scene, group.fall)
        return str(compare(cache_of(item), group.frame, fall))
    except CacheError as error:
        return str(error)


def unregister() -> None:
    """Wait for nothing any more."""
    _waiting.clear()
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)


def register() -> None:
    """Nothing: looking begins with a bake."""
