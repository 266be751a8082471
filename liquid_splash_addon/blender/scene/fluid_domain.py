# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid domains: made of a splash's box, found again, and what of them Blender's cache hangs on.

Changing most settings of a domain deletes its cache, the frame that was written included. So all
are set before it is written, and a digest of them tells later whether one was changed.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...core.mantaflow.settings import MantaflowSettings
from ..data.model import is_model
from ..data.properties import assign_settings, plain, to_settings
from . import mesh_object, places
from .material import water_material
from .objects import SceneError
from .obstacles import solids

if TYPE_CHECKING:
    from ...core.mantaflow.domain import Domain

NAME = "Splash Domain"
FOLDER = "splash_mantaflow"
"""Folder beside the .blend file, or in Blender's temporary one, that holds all caches."""

DECISIVE = (
    "domain_type", "cache_type", "cache_data_format", "cache_resumable",
    "cache_frame_start", "resolution_max", "simulation_method", "flip_ratio", "time_scale",
    "use_adaptive_timesteps", "timesteps_max", "timesteps_min", "cfl_condition", "use_diffusion",
    "use_viscosity", "particle_radius", "particle_number", "use_fractions", "fractions_threshold",
    "use_collision_border_front", "use_collision_border_back", "use_collision_border_left",
    "use_collision_border_right", "use_collision_border_top", "use_collision_border_bottom",
)  # fmt: skip
"""Settings of a domain on which the frame that was written depends, or that delete the cache."""

SIDES = ("front", "back", "left", "right")
MOST_WEIGHT = 200.0
"""Largest weight of the scene's gravity that Blender knows."""

MOST_STEPS = 100
"""Most steps of the solver in a frame that Blender knows."""


def settings_of(item: bpy.types.Object | None) -> Any:
    """Return the settings of an object's liquid domain; None if it is none."""
    if item is None or item.type != "MESH":
        return None
    for modifier in item.modifiers:
        if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN":
            return modifier.domain_settings
    return None


def domain_of(source: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the domain in a scene that was made of a splash or a model; None if there is none."""
    for entry in scene.splash_mantaflow.domains:
        item = entry.domain
        if item is None or item.splash_domain.source != source or scene not in item.users_scene:
            continue
        if settings_of(item) is not None:
            return item
    return None


def source_of(item: bpy.types.Object | None) -> bpy.types.Object | None:
    """Return the splash or model of a domain; None for what is none, or whose splash is gone."""
    if item is None or settings_of(item) is None:
        return None
    source = item.splash_domain.source
    return source if source is not None and source.users_scene else None


def is_copy(item: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Whether a domain is a duplicate: it names the splash and the cache of another domain."""
    source = source_of(item)
    return source is not None and domain_of(source, scene) != item


def check_usable(item: bpy.types.Object) -> None:
    """Raise SceneError if a domain cannot be set now."""
    if not (item.is_editable and item.data.is_editable):
        raise SceneError(f"The domain '{item.name}' is linked from another file: make it local")
    if item.mode != "OBJECT":
        raise SceneError(f"The domain '{item.name}' is being edited: switch to Object Mode first")
    if is_baking(settings_of(item)):
        raise SceneError(f"'{item.name}' is being baked: press Esc there first")


def is_baking(settings: Any) -> bool:
    """Whether a bake runs in a domain."""
    return bool(settings is not None and settings.is_cache_baking_any)


def ensure(context: bpy.types.Context, source: bpy.types.Object) -> bpy.types.Object:
    """Return the domain of a splash or model, made if there is none."""
    scene = context.scene
    found = domain_of(source, scene)
    if found is not None:
        return found
    forget_deleted(scene)
    item = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
    item.data.materials.append(water_material())
    mesh_object.collection_for(context, source).objects.link(item)
    modifier = item.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "DOMAIN"
    item.splash_domain.source = source
    scene.splash_mantaflow.domains.add().domain = item
    chosen = to_settings(scene.splash_mantaflow.settings, MantaflowSettings)
    assign_settings(item.splash_domain.settings, chosen)
    return item


def forget_deleted(scene: bpy.types.Scene) -> None:
    """Take domains that were deleted out of the scene's list."""
    entries = scene.splash_mantaflow.domains
    for number in reversed(range(len(entries))):
        item = entries[number].domain
        if item is None or not item.users_scene:
            entries.remove(number)


def new_cache(item: bpy.types.Object | None, folder: str) -> tuple[Path, str, bool]:
    """Return the folder for a domain's cache, the path to enter in Blender, and if it is temporary.

    A domain keeps its folder, unless that is a temporary one and the file was saved since, or
    another domain has it too.

    folder : name of a new one
    """
    settings = settings_of(item)
    if item is not None and settings is not None and item.splash_domain.cache:
        where = bpy.path.abspath(settings.cache_directory)
        kept_there = not item.splash_domain.is_temporary or not bpy.data.filepath
        if kept_there and where and not is_shared(item):
            return Path(where), settings.cache_directory, item.splash_domain.is_temporary
    name = f"{FOLDER}/{folder}"
    if bpy.data.filepath:
        return Path(bpy.path.abspath(f"//{name}")), f"//{name}", False
    path = Path(bpy.app.tempdir) / name
    return path, str(path), True


def is_shared(item: bpy.types.Object) -> bool:
    """Whether another domain writes to the same folder."""
    own = bpy.path.abspath(settings_of(item).cache_directory)
    for other in bpy.data.objects:
        settings = settings_of(other) if other != item else None
        if settings is not None and bpy.path.abspath(settings.cache_directory) == own:
            return True
    return False


def shape(item: bpy.types.Object, domain: Domain) -> None:
    """Give a domain object its box: unturned and unscaled, its origin in the middle."""
    half = domain.size / 2
    corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    item.data.clear_geometry()
    item.data.from_pydata((np.array(corners) * half).tolist(), [], faces)
    item.data.update()
    item.parent = None
    item.rotation_mode = "XYZ"
    item.location, item.rotation_euler, item.scale = domain.middle, (0, 0, 0), (1, 1, 1)
    item.delta_location, item.delta_rotation_euler = (0, 0, 0), (0, 0, 0)
    item.delta_scale = (1, 1, 1)


def configure(
    context: bpy.types.Context,
    item: bpy.types.Object,
    domain: Domain,
    settings: MantaflowSettings,
    cache: str,
    time_scale: float,
    gravity: float,
    fastest: float,
) -> None:
    """Set all of a domain that the written frame depends on; its own other settings stay.

    cache : folder as Blender is to know it; gravity : units/s^2 of the liquid's time;
    fastest : cells per frame
    """
    fluid, scene = settings_of(item), context.scene
    # What is there is of another start: Blender would go on from it.
    fluid.cache_frame_pause_data = 0
    fluid.domain_type = "LIQUID"
    fluid.cache_type = "MODULAR"
    fluid.cache_data_format = "UNI"
    fluid.cache_resumable = True
    fluid.simulation_method = "FLIP"
    fluid.resolution_max = domain.longest
    fluid.time_scale = time_scale
    fluid.use_adaptive_timesteps = True
    # The solver's steps are of twice its CFL number of cells at most, if they are enough.
    steps = int(np.ceil(fastest / max(fluid.cfl_condition, 0.1))) + 1
    fluid.timesteps_max = min(max(fluid.timesteps_max, steps), MOST_STEPS)
    fluid.use_mesh = settings.mesh
    fluid.use_speed_vectors = settings.mesh
    fluid.cache_frame_start = settings.frame
    fluid.cache_frame_end = settings.frame + settings.frames
    for side in SIDES:
        setattr(fluid, f"use_collision_border_{side}", settings.ground == "POOL")
    fluid.use_collision_border_top = False
    fluid.use_collision_border_bottom = settings.ground != "NONE"
    set_gravity(scene, fluid, gravity)
    fluid.cache_directory = cache


def set_gravity(scene: bpy.types.Scene, fluid: Any, gravity: float) -> None:
    """Set a domain's gravity, units/s^2, in the direction of the scene's."""
    own = np.array(scene.gravity)
    size = float(np.linalg.norm(own))
    if not scene.use_gravity or size == 0:
        fluid.gravity = (0, 0, 0)
        return
    fluid.effector_weights.gravity = gravity / size


def gravity_fits(scene: bpy.types.Scene, gravity: float) -> bool:
    """Whether Blender's domains know a gravity of that size, units/s^2."""
    size = float(np.linalg.norm(scene.gravity))
    return not scene.use_gravity or size == 0 or abs(gravity) <= MOST_WEIGHT * size


def gravity_vector(scene: bpy.types.Scene, gravity: float) -> np.ndarray:
    """Return the gravity that acts, units/s^2 ``(3,)``; none where the scene has none."""
    own = np.array(scene.gravity)
    size = float(np.linalg.norm(own))
    return own * (gravity / size) if scene.use_gravity and size else np.zeros(3)


def add_effectors(source: bpy.types.Object) -> list[str]:
    """Make the obstacles of a splash effectors, and return warnings about those that cannot be.

    Objects that take part in a simulation already are left as they are.
    """
    collection = source.splash_obstacles.collection
    warnings = []
    for item in [] if collection is None else solids(collection, source):
        if any(modifier.type == "FLUID" for modifier in item.modifiers):
            continue
        if item.type != "MESH":
            warnings.append(
                f"Obstacle '{item.name}' is no mesh, so Mantaflow does not know it: convert it"
            )
        elif not item.is_editable:
            warnings.append(
                f"Obstacle '{item.name}' is linked, so it cannot be an effector: make it local"
            )
        else:
            modifier = item.modifiers.new("Fluid", "FLUID")
            modifier.fluid_type = "EFFECTOR"
            modifier.effector_settings.effector_type = "COLLISION"
    return warnings


def set_ready(item: bpy.types.Object, frame: int) -> None:
    """Have the next bake go on from the frame that was written."""
    fluid = settings_of(item)
    fluid.cache_frame_pause_mesh = 0
    fluid.has_cache_baked_mesh = False
    fluid.cache_frame_pause_data = frame + 1
    # Shows Resume and Free in Blender's own panel.
    fluid.has_cache_baked_data = True
    item.display_type = "WIRE"  # until there is liquid to be seen in it


def state_of(item: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """Return a digest of a domain's decisive settings, box and gravity."""
    fluid = settings_of(item)
    values = [plain(getattr(fluid, name, None)) for name in DECISIVE]
    values.append(bpy.path.abspath(fluid.cache_directory))
    gravity = [plain(value) for value in gravity_of(fluid, scene)]
    # Not the object's box, which is the liquid's once that has a mesh.
    corners = np.empty(3 * len(item.data.vertices), dtype=np.float32)
    item.data.vertices.foreach_get("co", corners)
    box = corners.reshape(-1, 3).round(5).tolist()
    place = np.array(places.shown_matrix(item)).round(5).tolist()
    rate = plain(scene.render.fps / scene.render.fps_base)
    return hashlib.sha256(repr((values, gravity, box, place, rate)).encode()).hexdigest()[:16]


def gravity_of(fluid: Any, scene: bpy.types.Scene) -> list[float]:
    """Return the gravity that acts in a domain."""
    if not scene.use_gravity:
        return [*fluid.gravity]
    return [value * fluid.effector_weights.gravity for value in scene.gravity]


def made_of(source: bpy.types.Object, settings: object) -> str:
    """Return a digest of a splash or model as it is seen, and of an export's settings.

    Cheap: panels ask for it while they are drawn.
    """
    if is_model(source):
        liquid = source.splash_model.evaluated
    else:
        liquid = f"{source.data.splash_liquid.identifier} {source.splash_stack.evaluated}"
    place = np.array(places.shown_matrix(source)).round(5).tolist()
    speed = plain(source.splash_motion.time_scale)
    return hashlib.sha256(repr((liquid, place, speed, settings)).encode()).hexdigest()[:16]
