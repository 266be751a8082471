# SPDX-License-Identifier: GPL-3.0-or-later
"""One of training's scenes in Blender's Mantaflow, run by a real Blender::

    tests/blender.sh -b --python tests/benchmarks/mantaflow_scene.py -- IN.json OUT.json

IN.json holds what ``Scene.parameters`` returns and ``resolution`` (cells along the domain, whose
middle is that of the scene's box), ``frames`` and ``fps``; perhaps ``particles``, an .npz file with
``positions`` (metres) and ``velocities`` (m/s) to start from instead of the streamlets. OUT.json
gets ``seconds`` of the bake and, of the start and every frame, ``centres`` (of mass, metres) and
``cells`` that hold liquid.

The liquid does not come from a flow object: cells deeper than two would start at rest. The start
is written as a frame of the cache instead, from which the bake goes on.
"""

import gzip
import json
import struct
import sys
import time
import traceback
from pathlib import Path
from typing import Any, NamedTuple

import bpy  # type: ignore[import-untyped]
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]

START = 1
"""The frame that is written; the bake makes those after it."""

SAMPLES = 2
"""Particles along each edge of a cell: Mantaflow's default, and ours."""

JITTER = 0.1
"""Largest displacement of a particle at the start, cells."""

REACH = 4.0
"""Cells around the liquid in which the start has its velocity."""

TIME_UNIT = 0.4
"""Seconds in a unit of Mantaflow's time; its velocities are in cells a unit."""

DEAD = 1 << 10
"""Flag of a particle that Mantaflow has deleted."""

FLUID = 1
"""Flag of a cell that is liquid, and no solid."""

BORDERS = ("front", "back", "left", "right", "top", "bottom")


class Box(NamedTuple):
    """The domain: cells along each side, cell in metres, lowest corner and middle ``(3,)``."""

    cells: int
    spacing: float
    corner: np.ndarray
    middle: np.ndarray

    @classmethod
    def of(cls, scene: dict[str, Any]) -> "Box":
        """Return the middle ``resolution`` cells of the scene's box."""
        cells, spacing = scene["resolution"], scene["spacing"]
        middle = np.full(3, scene["cells"] * spacing / 2)
        return cls(cells, spacing, middle - cells * spacing / 2, middle)


def read_streamlet(streamlet: dict[str, Any], box: Box) -> tuple[Any, np.ndarray]:
    """Return the signed distance of points in cells, as a function, and the velocity ``(3,)``.

    The velocity is in cells per second.
    """
    tip = (np.array(streamlet["tip"]) - box.corner) / box.spacing
    direction = np.array(streamlet["direction"])
    radius, length = streamlet["radius"] / box.spacing, streamlet["length"] / box.spacing

    def distance(points: np.ndarray) -> np.ndarray:
        along = (points - tip) @ direction
        across = np.sqrt(np.maximum(((points - tip) ** 2).sum(axis=-1) - along**2, 0)) - radius
        along = np.maximum(along, -along - length)
        outside = np.hypot(np.maximum(along, 0), np.maximum(across, 0))
        return np.asarray(outside + np.minimum(np.maximum(along, across), 0))

    return distance, direction * streamlet["speed"] / box.spacing


class Start(NamedTuple):
    """The liquid at the start, in cells and cells per second.

    faces : velocity on the lower faces, ``(Z, Y, X, 3)``; positions, velocities : ``(n, 3)``,
    the particles
    """

    faces: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray

    @classmethod
    def of(cls, scene: dict[str, Any], box: Box) -> "Start":
        """Return the start of ``scene``: its particles, or all its streamlets."""
        if "particles" in scene:
            with np.load(scene["particles"]) as given:
                return cls.from_particles(given["positions"], given["velocities"], box)
        n, rng = box.cells, np.random.default_rng(0)
        z, y, x = np.mgrid[:n, :n, :n]
        corners = np.stack([x, y, z], axis=-1).astype(np.float64)
        nearest, faces = np.full((n, n, n), REACH), np.zeros((n, n, n, 3))
        positions, velocities = [], []
        for streamlet in scene["streamlets"]:
            distance, velocity = read_streamlet(streamlet, box)
            own = distance(corners + 0.5)
            faces[own < nearest] = velocity
            nearest = np.minimum(nearest, own)
            parts = [(np.array(part) + 0.5) / SAMPLES for part in np.ndindex((SAMPLES,) * 3)]
            seeds = np.concatenate([corners[own < 1] + part for part in parts])
            seeds += rng.uniform(-JITTER, JITTER, seeds.shape)
            # The outermost cells are the way out.
            seeds = seeds[(distance(seeds) < 0) & ((seeds > 1) & (seeds < n - 1)).all(axis=1)]
            positions.append(seeds)
            velocities.append(np.tile(velocity, (len(seeds), 1)))
        return cls(faces, np.concatenate(positions), np.concatenate(velocities))

    @classmethod
    def from_particles(cls, positions: np.ndarray, velocities: np.ndarray, box: Box) -> "Start":
        """Return the start from particles (metres, m/s): a cell has the velocity of those in it."""
        n = box.cells
        places, speeds = (positions - box.corner) / box.spacing, velocities / box.spacing
        inside = ((places > 1) & (places < n - 1)).all(axis=1)
        places, speeds = places[inside], speeds[inside]
        x, y, z = places.astype(int).T
        flat = (z * n + y) * n + x
        count = np.maximum(np.bincount(flat, minlength=n**3), 1)
        means = [np.bincount(flat, speeds[:, axis], n**3) / count for axis in range(3)]
        return cls(np.stack(means, axis=-1).reshape(n, n, n, 3), places, speeds)


def write_start(start: Start, box: Box, cache: Path, frame_seconds: float) -> None:
    """Write the start as frame START of a cache (Mantaflow's iogrids.cpp, Blender's MANTA_main).

    The surface need not be written: Mantaflow makes it from the particles.
    """
    n, count = box.cells, len(start.positions)
    points = np.zeros(count, dtype=[("position", "<3f4"), ("flag", "<i4")])
    points["position"] = start.positions
    faces, speeds = ((v * TIME_UNIT).astype("<f4") for v in (start.faces, start.velocities))
    write_uni(cache, "vel", b"MNT3", (n, n, n, 12, 2, 12), faces)
    write_uni(cache, "pp", b"PB02", (count, n, n, n, 0, 16), points)
    write_uni(cache, "pVel", b"PD01", (count, n, n, n, 1, 12), speeds)
    half, step = box.cells * box.spacing / 2, frame_seconds / TIME_UNIT
    low, high = [-half] * 3, [half] * 3
    place = Matrix.Translation(box.middle).transposed()
    config = struct.pack("<4i2f9f6i", 0, n, n, n, 1 / n, step, *low, *high, *low, *[0] * 6)
    config += struct.pack("<16f", *(value for row in place for value in row))
    config += struct.pack("<9i3ff4s", n, n, n, 0, 0, 0, n, n, n, 0, 0, 0, step, b"C01\0")
    (cache / "config").mkdir(parents=True, exist_ok=True)
    with gzip.open(cache / "config" / f"config_{START:04d}.uni", "wb") as file:
        file.write(config)


def write_uni(
    cache: Path, name: str, magic: bytes, header: tuple[int, ...], content: np.ndarray
) -> None:
    """Write one file of frame START; the notes between header and content may be empty."""
    path = cache / "data" / f"{name}_{START:04d}.uni"
    path.parent.mkdir(parents=True, exist_ok=True)
    with gzip.open(path, "wb", compresslevel=1) as file:
        file.write(magic + struct.pack("<6i", *header) + bytes(256) + bytes(8))
        file.write(np.ascontiguousarray(content).tobytes())


def read_uni(path: Path, item: str) -> np.ndarray:
    """Return what a file holds, flat."""
    with gzip.open(path, "rb") as file:
        return np.frombuffer(file.read()[292:], dtype=item)


def add_body(body: dict[str, Any]) -> None:
    """Add the obstacle. Blender's cone, like ours, has its base below and its tip above."""
    add, size, height = bpy.ops.mesh, body["size"], body["height"]
    if body["shape"] == "sphere":
        add.primitive_uv_sphere_add(segments=96, ring_count=48, radius=size)
    elif body["shape"] == "cube":
        add.primitive_cube_add(size=2 * size)
    elif body["shape"] == "cylinder":
        add.primitive_cylinder_add(vertices=96, radius=size, depth=2 * height)
    elif body["shape"] == "cone":
        add.primitive_cone_add(vertices=96, radius1=size, radius2=0, depth=2 * height)
    else:
        return
    solid = bpy.context.object
    turn = Matrix(body["axes"]).transposed().to_4x4()  # its columns are the body's axes
    solid.matrix_world = Matrix.Translation(body["centre"]) @ turn
    modifier = solid.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "EFFECTOR"
    modifier.effector_settings.effector_type = "COLLISION"


def add_domain(scene: dict[str, Any], box: Box, cache: Path) -> Any:
    """Add the open domain, ready to go on from frame START; all else is Blender's default."""
    bpy.ops.mesh.primitive_cube_add(size=box.cells * box.spacing, location=box.middle)
    modifier = bpy.context.object.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "DOMAIN"
    domain = modifier.domain_settings
    domain.domain_type = "LIQUID"
    domain.resolution_max = box.cells
    domain.cache_type = "MODULAR"
    domain.cache_data_format = "UNI"
    # For the level set; bakes of 128^3 cells with and without it took the same time.
    domain.cache_resumable = True
    domain.simulation_method = "FLIP"
    domain.use_mesh = False
    # Without it the solid is a staircase of whole cells, which brakes the liquid and holds it.
    domain.use_fractions = True
    for side in BORDERS:
        setattr(domain, f"use_collision_border_{side}", False)
    domain.cache_frame_start, domain.cache_frame_end = START, START + scene["frames"]
    domain.cache_directory = str(cache)
    return domain


def bake(scene: dict[str, Any], cache: Path) -> float:
    """Build the scene, bake it and return the seconds that the bake alone took."""
    box = Box.of(scene)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    world = bpy.context.scene
    world.render.fps, world.render.fps_base = scene["fps"], 1.0
    world.frame_start, world.frame_end = START, START + scene["frames"]
    world.gravity = (0, 0, -9.81)
    add_body(scene["obstacle"])
    domain = add_domain(scene, box, cache)
    world.frame_set(START)
    # After the settings: changing one of them deletes what is in the cache.
    write_start(Start.of(scene, box), box, cache, 1 / scene["fps"])
    domain.cache_frame_pause_data = START + 1
    domain.has_cache_baked_data = True
    begin = time.perf_counter()
    bpy.ops.fluid.bake_data()
    return time.perf_counter() - begin


def look(cache: Path, frame: int, box: Box) -> tuple[list[float], int]:
    """Return the centre of mass, metres, and the number of cells that hold liquid.

    Mantaflow keeps particles near the surface only (all of them at the start, when it has not
    seen them yet): deep in the liquid every cell is full.
    """
    points = read_uni(cache / "data" / f"pp_{frame:04d}.uni", "<f4,<f4,<f4,<i4")
    points = points[points["f3"] & DEAD == 0]
    positions = np.stack([points["f0"], points["f1"], points["f2"]], axis=1)
    shape = (box.cells,) * 3
    held = np.zeros(shape, dtype=bool)
    held[tuple(np.clip(positions.astype(int), 0, box.cells - 1).T)] = True
    deep = np.zeros_like(held)
    if frame > START:
        level = read_uni(cache / "data" / f"phi_{frame:04d}.uni", "<f4").reshape(shape).T
        flags = read_uni(cache / "data" / f"flags_{frame:04d}.uni", "<i4").reshape(shape).T
        deep = (level < -1) & (flags & FLUID > 0) & ~held
    mass = len(positions) + SAMPLES**3 * deep.sum()
    moment = positions.sum(axis=0, dtype=np.float64)
    moment += SAMPLES**3 * (np.argwhere(deep) + 0.5).sum(axis=0)
    centre = moment / mass * box.spacing + box.corner if mass else np.full(3, np.nan)
    return centre.tolist(), int(held.sum() + deep.sum())


def main() -> None:
    """Read IN.json, bake, write OUT.json."""
    given, result = (Path(name) for name in sys.argv[sys.argv.index("--") + 1 :])
    scene = json.loads(given.read_text())
    cache = result.parent / "cache"
    seconds = bake(scene, cache)
    frames = range(START, START + scene["frames"] + 1)
    looks = [look(cache, frame, Box.of(scene)) for frame in frames]
    centres, cells = zip(*looks, strict=True)
    result.write_text(json.dumps({"seconds": seconds, "centres": centres, "cells": cells}))


if __name__ == "__main__":
    try:
        main()
    except Exception:  # Blender would print it and end with 0
        traceback.print_exc()
        sys.exit(1)
