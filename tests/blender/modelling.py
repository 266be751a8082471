# SPDX-License-Identifier: GPL-3.0-or-later
"""Sketches of several layers, their models, and what the tests measure on them."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from liquid_splash_addon.blender.data.model import is_model
from liquid_splash_addon.blender.scene import sketch as sketches
from liquid_splash_addon.blender.scene.mesh_object import read_triangles
from liquid_splash_addon.core.mesh.signed_distance import winding_on_grid
from liquid_splash_addon.core.numeric.triangles import enclosed_volume
from liquid_splash_addon.core.refinement.presets import BARE
from tests.blender.sketching import (
    GAIN,
    SIZE,
    TubeGenerator,
    add_sketch,
    fan,
    in_world,
    line,
    splashes,
    vertices,
)


class ThickTubes(TubeGenerator):
    """Drafts whose liquid is several cells thick: composing thins what is not."""

    radius = 4.0


def layered(*layers) -> bpy.types.Object:
    """Return a new active sketch with these strokes in a layer each: A, B, ..."""
    names = [chr(ord("A") + number) for number in range(len(layers))]
    sketch = sketches.new_sketch(bpy.context, Matrix(), names)
    for name, drawings in zip(names, layers, strict=True):
        sketches.add_strokes(sketch, drawings, sketch.data.layers[name])
    bpy.context.view_layer.objects.active = sketch
    return sketch


def crossing() -> bpy.types.Object:
    """Return a sketch of two layers whose splashes cross."""
    return layered(fan(), [line((0.5, -0.6, 0.05), (0.5, 0.7, -0.05))])


def generate_layers(sketch: bpy.types.Object) -> bpy.types.Object:
    """Generate the layers of ``sketch`` as bare liquid, and return their model."""
    bpy.context.view_layer.objects.active = sketch
    settings = bpy.context.scene.splash.settings
    settings.real_size, settings.speed_gain = SIZE, GAIN  # not the defaults, which may move
    bpy.context.scene.splash.start = BARE
    assert bpy.ops.splash.generate_layers() == {"FINISHED"}
    return the_model()


def the_model() -> bpy.types.Object:
    """Return the only model."""
    (model,) = filter(is_model, bpy.context.scene.objects)
    return model


def part(name: str) -> bpy.types.Object:
    """Return the splash of a layer."""
    return next(item for item in splashes() if item.splash.layer == name)


def volume(item: bpy.types.Object) -> float:
    """Return the volume of a mesh object, in Blender units."""
    return enclosed_volume(*read_triangles(item.data))


def edges_twice(item: bpy.types.Object) -> bool:
    """Whether a mesh object is closed: each edge has a face on either side."""
    faces = read_triangles(item.data)[1]
    edges = np.concatenate([faces, np.roll(faces, 1, axis=1), np.roll(faces, 2, axis=1)])[:, :2]
    forward, back = {tuple(e) for e in edges}, {tuple(e[::-1]) for e in edges}
    return len(forward) == len(edges) and forward == back


def union_volume(items, cells: int = 96) -> float:
    """Return the volume of the union of mesh objects, by counting cells inside any of them."""
    points = np.concatenate([in_world(item) for item in items])
    low, size = points.min(axis=0), np.ptp(points, axis=0).max() / (cells - 2)
    inside = np.zeros((cells,) * 3, dtype=bool)
    for item in items:
        triangles = ((in_world(item) - low) / size + 0.5)[read_triangles(item.data)[1]]
        inside |= winding_on_grid(triangles.astype(np.float64), (cells,) * 3) != 0
    return float(inside.sum() * size**3)


def bounds(item: bpy.types.Object) -> np.ndarray:
    """Return the least and greatest coordinates of a mesh object in its own space."""
    return np.stack([vertices(item).min(axis=0), vertices(item).max(axis=0)])


def bodies(item: bpy.types.Object, size: int = 1) -> set[int]:
    """Return a vertex of each connected piece of ``size`` vertices or more."""
    faces = read_triangles(item.data)[1]
    first = np.arange(len(item.data.vertices))
    for _ in range(500):
        least = first[faces].min(axis=1)
        before = first.copy()
        np.minimum.at(first, faces.ravel(), np.repeat(least, 3))
        first = first[first]
        if (first == before).all():
            break
    found, counts = np.unique(first, return_counts=True)
    return set(found[counts >= size].tolist())


def single(matrix: Matrix | None = None) -> bpy.types.Object:
    """Return the model of one splash, whose sketch stands at ``matrix``."""
    sketch = add_sketch(fan(), matrix)
    assert bpy.ops.splash.generate(start=BARE, speed_gain=GAIN) == {"FINISHED"}
    bpy.context.view_layer.objects.active = sketch
    assert bpy.ops.splash.combine() == {"FINISHED"}
    return the_model()
