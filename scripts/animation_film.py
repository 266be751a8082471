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
from mathutils import Vector
from matplotlib import rc_context
from matplotlib.figure import Figure
from PIL import Image

from liquid_splash_addon.blender.scene.material import water_material
from training.figures.picture import contact_sheet, titled

STRIP = 6
"""Frames of a strip."""

COMPARED = 12
"""Frames over which the solvers' centres are compared."""

CLEAR = 0.06
"""Units above the pool's surface from which liquid counts as the splash."""

TITLES = {
    "moving": "with initial velocity",
    "still": "without",
    "ours": "our solver",
    "mantaflow": "Mantaflow",
}
FRAME_MS = 90
"""Of an animated picture."""

SKY = (0.03, 0.045, 0.08, 1.0)

BOUNCES = 6
"""Of light: these liquids are not clear."""

FAR, INSET, NEAR = 60.0, 0.1, 0.3
"""Where the still liquid around what was simulated ends, how far it reaches over that, and how far
from the pool's surface its ripples are at most, Blender units."""


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
        is_pool = np.abs(away) < NEAR
        moved = points.copy()
        moved[is_pool, 2] = self.height + (share * away)[is_pool]
        hidden = (inside < 0) & (away < INSET)
        return moved, faces[~hidden[faces].all(axis=1)]

    def add(self, material: Any) -> None:
        """Add it to the scene."""
        (left, front), (right, back) = self.low, self.high
        outer = [(-FAR, -FAR), (FAR, -FAR), (FAR, FAR), (-FAR, FAR)]
        inner = [(left, front), (right, front), (right, back), (left, back)]
        mesh = bpy.data.meshes.new("Shore")
        mesh.from_pydata(
            [(float(x), float(y), self.height) for x, y in outer + inner], [],
            [(n, (n + 1) % 4, 4 + (n + 1) % 4, 4 + n) for n in range(4)],
        )  # fmt: skip
        mesh.materials.append(material)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Shore", mesh))


class Measured(NamedTuple):
    """The liquid above a height: volume, centre ``(3,)`` and mean distance from an axis."""

    volume: float
    centre: np.ndarray
    radius: float


def facts_of(place: Any) -> dict[str, Any]:
    """Return what is known of a subject's splash."""
    return dict(json.loads((place.folder.parent / "facts.json").read_text()))


def above(vertices: np.ndarray, faces: np.ndarray, height: float, axis: np.ndarray) -> Measured:
    """Measure what a closed mesh holds above ``height``; axis : x and y of an upright axis.

    By Gauss's theorem with fields along z: the volume above is the integral of
    ``n_z max(z - height, 0)`` over the surface, the moments likewise.
    """
    corners = vertices[faces].astype(np.float64)
    edges = corners[:, 1:, :2] - corners[:, :1, :2]
    flat = (edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]) / 2
    middle = corners.mean(axis=1)
    top = np.maximum(middle[:, 2], height)
    share = flat * (top - height)
    volume = share.sum()
    level = (flat * (top**2 - height**2)).sum() / 2
    places = middle[:, :2] - axis
    radius = (share * np.linalg.norm(places, axis=1)).sum() / volume
    flatly = (share[:, None] * places).sum(axis=0) / volume + axis
    return Measured(volume, np.array([*flatly, level / volume]), radius)


def read_mesh(place: Any, number: int) -> tuple[np.ndarray, ...]:
    """Return vertices, faces, drops and their radii of a frame."""
    with np.load(place.frame(number)) as file:
        return tuple(file[name] for name in ("vertices", "faces", "drops", "radii"))


def measured(place: Any, frames: int) -> list[Measured]:
    """Measure the frames of a film; drops beside the mesh count, too."""
    facts, found = facts_of(place), []
    axis = np.array(facts["centre"][:2])
    for number in range(frames + 1):
        vertices, faces, drops, radii = read_mesh(place, number)
        mesh = above(vertices, faces, facts["pool"] + CLEAR, axis)
        weights = np.append(4 / 3 * np.pi * radii.astype(float) ** 3, mesh.volume)
        centres = np.vstack([drops, mesh.centre])
        away = np.append(np.linalg.norm(drops[:, :2] - axis, axis=1), mesh.radius)
        weights[:-1] *= drops[:, 2] > facts["pool"] + CLEAR
        found.append(
            Measured(
                weights.sum(),
                np.average(centres, axis=0, weights=weights),
                float(np.average(away, weights=weights)),
            )
        )
    return found


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
    table.set_world(SKY)
    table.add_lights(centre, radius, subject.view)
    half = size / 2 * (subject.width, subject.width, 1.2)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    corners = np.array(facts["centre"]) + signs * half
    corners[:, 2] = np.maximum(corners[:, 2], facts["pool"])
    table.add_camera(scene, corners, subject.view, demo.LENS)
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
            milliseconds = 1000 * number / 24 * 0.1
            title = f"{TITLES[place.flow]}, {milliseconds:.0f} ms"
            pictures.append(titled(picture, title))
    contact_sheet(pictures, STRIP).save(path, quality=85, method=6)


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
    lengths = [FRAME_MS * 6, *[FRAME_MS] * (len(frames) - 2), FRAME_MS * 8]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=lengths, loop=0, quality=82,
        method=6,
    )  # fmt: skip


def draw_curves(places: Sequence[Any], options: Any, path: Path) -> dict[str, float]:
    """Draw height and radius over time; return the solvers' greatest distance over the size."""
    found = {(place.solver, place.flow): measured(place, options.frames) for place in places}
    times = np.arange(options.frames + 1) / 24 * 100
    style: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False}
    lines = {"ours": "-", "mantaflow": (0, (4, 1.5))}
    colours = {"moving": "#0072b2", "still": "#d55e00"}
    with rc_context(style):
        figure = Figure(figsize=(7.5, 2.8))
        height, radius = figure.subplots(1, 2)
        for (solver, flow), film in found.items():
            label = f"{TITLES[solver]}, {TITLES[flow]}"
            look = {"color": colours[flow], "linestyle": lines[solver], "label": label}
            height.plot(times, [one.centre[2] for one in film], **look)
            radius.plot(times, [one.radius for one in film], **look)
        height.set_ylabel("height of the centre of mass (units)")
        radius.set_ylabel("mean radius (units)")
        for axes in (height, radius):
            axes.set_xlabel("time of the liquid (ms)")
        figure.legend(*height.get_legend_handles_labels(), loc="upper center", ncols=4,
                      frameon=False)  # fmt: skip
        figure.tight_layout(rect=(0, 0, 1, 0.92))
        figure.savefig(path, dpi=150)
    size = max(facts_of(places[0])["size"])
    report = {}
    for flow in ("moving", "still"):
        a, b = (
            np.array([one.centre for one in found[solver, flow]])[: COMPARED + 1]
            for solver in ("ours", "mantaflow")
        )
        report[f"{flow}_apart"] = float(np.linalg.norm(a - b, axis=1).max() / size)
    for (solver, flow), film in found.items():
        report[f"{solver}_{flow}_rises"] = float(film[-1].centre[2] - film[0].centre[2])
        report[f"{solver}_{flow}_spreads"] = float(film[-1].radius - film[0].radius)
        report[f"{solver}_{flow}_volume"] = float(film[-1].volume / film[0].volume)
    return report
