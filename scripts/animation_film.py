# SPDX-License-Identifier: GPL-3.0-or-later
"""Films of simulated splashes: rendered frames, strips, animated pictures, curves."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import make_demo as demo
import make_models as models
import numpy as np
import scene as table
from animation_curves import FRAME_MS, TITLES, draw_curves, facts_of, read_mesh
from mathutils import Vector
from PIL import Image

from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.blender.scene.material import water_material
from training.figures.picture import contact_sheet, titled

STRIP = 6
"""Frames of a strip."""

SHOWN_MS = 90
"""Of an animated picture."""

SKY = (0.03, 0.045, 0.08, 1.0)

BOUNCES = 6
"""Of light: these liquids are not clear."""

FAR, INSET, NEAR = 60.0, 0.1, 0.04
"""Where the still liquid around what was simulated ends, how far it reaches over that, and how high
the ripples of the pool are there at most, Blender units. What is higher is splash."""

ABOVE = 0.0005
"""Units by which it is higher than the pool: two surfaces in one place show black specks."""


class Shore(NamedTuple):
    """The still liquid around what was simulated: from where on ``(2,)``, and how high it is."""

    low: np.ndarray
    high: np.ndarray
    height: float

    @classmethod
    def around(cls, points: np.ndarray, height: float) -> Shore:
        """Return the shore of a first frame's vertices ``(n, 3)``; height : about the pool's."""
        low, high = points.min(axis=0)[:2] + INSET, points.max(axis=0)[:2] - INSET
        edge = ((points[:, :2] < low + INSET) | (points[:, :2] > high - INSET)).any(axis=1)
        level = points[edge & (np.abs(points[:, 2] - height) < INSET), 2]
        return cls(low, high, float(np.median(level)) if len(level) else height)

    def joined(self, points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a frame whose pool goes over into the shore, without the pool's own edges."""
        inside = np.minimum(points[:, :2] - self.low, self.high - points[:, :2]).min(axis=1)
        share = np.clip(inside / INSET, 0, 1)
        share = share * share * (3 - 2 * share)
        away = points[:, 2] - self.height
        is_pool = (away < NEAR) & (away > -INSET)
        moved = points.copy()
        moved[is_pool, 2] = self.height + (share * away)[is_pool]
        hidden = (inside < 0) & (away < NEAR)
        return moved, faces[~hidden[faces].all(axis=1)]

    def add(self, material: Any) -> None:
        """Add it to the scene."""
        (left, front), (right, back) = self.low, self.high
        outer = [(-FAR, -FAR), (FAR, -FAR), (FAR, FAR), (-FAR, FAR)]
        inner = [(left, front), (right, front), (right, back), (left, back)]
        mesh = bpy.data.meshes.new("Shore")
        mesh.from_pydata(
            [(float(x), float(y), self.height + ABOVE) for x, y in outer + inner], [],
            [(n, (n + 1) % 4, 4 + (n + 1) % 4, 4 + n) for n in range(4)],
        )  # fmt: skip
        mesh.materials.append(material)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Shore", mesh))


def strip_frames(frames: int) -> list[int]:
    """Return the frames of a strip."""
    return [round(number * frames / (STRIP - 1)) for number in range(STRIP)]


def picture_path(place: Any, number: int) -> Path:
    """Return the file of a rendered frame."""
    return Path(place.folder) / f"picture_{number:03d}.png"


def render_strip(place: Any, subject: Any, options: Any) -> None:
    """Render the frames of a film's strip."""
    render_frames(place, subject, options, strip_frames(options.frames))


def render_frames(place: Any, subject: Any, options: Any, numbers: Sequence[int]) -> None:
    """Render frames that have no picture yet."""
    missing = [number for number in numbers if not picture_path(place, number).is_file()]
    if not missing:
        return
    item = set_scene(place, subject, options)
    shore = Shore.around(read_mesh(place, 0)[0], facts_of(place)["pool"])
    for number in missing:
        points, faces, drops, radii = read_mesh(place, number)
        fill(item, *shore.joined(points, faces), drops, radii)
        path = picture_path(place, number)
        part = path.with_name("part.png")
        demo.render(part)
        part.replace(path)
        print(f"{place.subject} {place.solver} {place.flow}: picture {number}", flush=True)


def set_scene(place: Any, subject: Any, options: Any) -> bpy.types.Object:
    """Make the scene of a subject; return the object that shows its liquid."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    facts, scene = facts_of(place), bpy.context.scene
    item = bpy.data.objects.new("Liquid", bpy.data.meshes.new("Liquid"))
    item.data.materials.append(water_material())
    models.retune(item, subject.liquid)
    scene.collection.objects.link(item)
    Shore.around(read_mesh(place, 0)[0], facts["pool"]).add(item.data.materials[0])
    centre, size = Vector(facts["centre"]), np.array(facts["size"])
    radius = float(np.linalg.norm(size)) / 2
    table.use_cycles(scene, options.samples, options.size)
    scene.view_settings.exposure = subject.exposure
    scene.cycles.max_bounces = BOUNCES
    scene.world = studio.world_of(SKY)
    studio.add_lights(scene.collection, centre, radius, subject.view)
    half = size / 2 * (subject.width, subject.width, 1.2)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    corners = np.array(facts["centre"]) + signs * half
    corners[:, 2] = np.maximum(corners[:, 2], facts["pool"])
    studio.add_camera(scene, scene.collection, corners, subject.view, studio.LENS)
    return item


def fill(item: bpy.types.Object, vertices: Any, faces: Any, drops: Any, radii: Any) -> None:
    """Give an object a frame's mesh, its drops as balls."""
    ball_points, ball_faces = ball()
    parts, triangles, count = [vertices], [faces], len(vertices)
    for place, radius in zip(drops, radii, strict=True):
        parts.append(place + radius * ball_points)
        triangles.append(ball_faces + count)
        count += len(ball_points)
    mesh = item.data
    mesh.clear_geometry()
    points, ends = np.concatenate(parts), np.concatenate(triangles)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", np.float32(points).ravel())
    mesh.loops.add(ends.size)
    mesh.loops.foreach_set("vertex_index", np.int32(ends).ravel())
    mesh.polygons.add(len(ends))
    mesh.polygons.foreach_set("loop_start", np.arange(len(ends), dtype=np.int32) * 3)
    mesh.update(calc_edges=True)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(ends), dtype=bool))
    mesh.update()


def ball() -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and triangles of a ball of radius 1."""
    import bmesh

    made = bmesh.new()
    bmesh.ops.create_icosphere(made, subdivisions=3, radius=1.0)
    points = np.array([vertex.co[:] for vertex in made.verts])
    faces = np.array([[vertex.index for vertex in face.verts] for face in made.faces])
    made.free()
    return points, faces


def make_pictures(name: str, places: Sequence[Any], subject: Any, options: Any) -> None:
    """Make strips, animated picture and curves of a subject."""
    options.out.mkdir(parents=True, exist_ok=True)
    for solver in ("ours", "mantaflow"):
        rows = [place for place in places if place.solver == solver]
        save_strip(rows, options, options.out / f"animation_{name}_{solver}.webp")
    report = draw_curves(places, options, options.out / f"animation_{name}_curves.png")
    print(json.dumps({name: report}), flush=True)
    ours = [place for place in places if place.solver == "ours"]
    for place in ours:
        render_frames(place, subject, options, range(options.frames + 1))
    save_animation(ours, options, options.out / f"animation_{name}.webp")


def save_strip(places: Sequence[Any], options: Any, path: Path) -> None:
    """Save the films of one solver as rows."""
    pictures = []
    for place in places:
        for number in strip_frames(options.frames):
            picture = Image.open(picture_path(place, number)).convert("RGB")
            title = f"{TITLES[place.flow]}, {number * FRAME_MS:.0f} ms"
            pictures.append(titled(picture, title))
    contact_sheet(pictures, STRIP).save(path, quality=90, method=6)


def save_animation(places: Sequence[Any], options: Any, path: Path) -> None:
    """Save films side by side as one animated picture."""
    frames = []
    for number in range(options.frames + 1):
        frames.append(
            contact_sheet(
                [
                    titled(
                        Image.open(picture_path(place, number)).convert("RGB"), TITLES[place.flow]
                    )
                    for place in places
                ],
                len(places),
            )
        )
    lengths = [SHOWN_MS * 6, *[SHOWN_MS] * (len(frames) - 2), SHOWN_MS * 8]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=lengths, loop=0, quality=90,
        method=6,
    )  # fmt: skip
