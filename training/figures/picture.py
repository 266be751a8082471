# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of liquids, drawn by sphere tracing their signed distance on the CPU."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import distance_transform_edt, gaussian_filter

from liquid_splash_addon.core.liquid.fields import AIR, Fields
from liquid_splash_addon.core.liquid.level_set import surface_level
from liquid_splash_addon.core.mesh.marching_cubes import LEVEL_BAND, LEVEL_SPREAD
from liquid_splash_addon.core.numeric.trilinear import trilinear

from ..scenes.bodies import NOTHING, Body, world_distance

AZIMUTH, ELEVATION = np.radians(35.0), np.radians(22.0)
"""Where the camera stands: angle around the vertical, angle above the horizon, radians."""

RAYS_A_PIXEL = 2
"""Rays along each side of a pixel."""

STROKE_INK = (214, 90, 30)
"""Colour of strokes."""


def camera_axes(azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> np.ndarray:
    """Return ``(3, 3)``: right, down and forward of an orthographic camera, as rows."""
    forward = -np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def draw_liquid(
    distance: np.ndarray,
    pixels: int,
    solid: Body = NOTHING,
    strokes: Sequence[np.ndarray] = (),
    centre: np.ndarray | None = None,
    width: float | None = None,
) -> Image.Image:
    """Return a square picture of a liquid.

    distance : float32 ``(X, Y, Z)``, signed, in cells, clipped at +-3 or less; solid and
    strokes ``(m, 3)`` in cells of it. centre ``(3,)`` and width (cells) of what is shown;
    None shows all of the array.
    """
    axes = camera_axes()
    shape = np.array(distance.shape, dtype=float)
    centre = shape / 2 if centre is None else np.asarray(centre, dtype=float)
    width = float(np.linalg.norm(shape)) * 0.8 if width is None else width
    rays = pixels * RAYS_A_PIXEL
    image = np.empty((rays, rays, 3), dtype=np.float32)
    _draw(distance, *solid.packed(), axes, centre, width, image)
    picture = Image.fromarray((np.clip(image, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8))
    pen = ImageDraw.Draw(picture)
    for line in strokes:
        flat = (line[:, :3] - centre) @ axes[:2].T * (rays / width) + rays / 2
        pen.line(
            [tuple(p) for p in flat], fill=STROKE_INK, width=max(rays // 160, 1), joint="curve"
        )
    return picture.resize((pixels, pixels), Image.Resampling.LANCZOS)


def titled(picture: Image.Image, title: str) -> Image.Image:
    """Return the picture with a line of text above it."""
    size = max(picture.width // 17, 8)
    font, strip = ImageFont.load_default(size), size * 3 // 2
    result = Image.new("RGB", (picture.width, picture.height + strip), "white")
    result.paste(picture, (0, strip))
    ImageDraw.Draw(result).text((2, strip // 2), title, fill="black", font=font, anchor="lm")
    return result


def contact_sheet(pictures: Sequence[Image.Image], columns: int, gap: int = 4) -> Image.Image:
    """Return the pictures, all of one size, side by side in rows."""
    w, h = pictures[0].size
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * (w + gap) - gap, rows * (h + gap) - gap), "white")
    for number, picture in enumerate(pictures):
        sheet.paste(picture, ((number % columns) * (w + gap), (number // columns) * (h + gap)))
    return sheet


def safe_distance(fields: Fields) -> np.ndarray:
    """Return a distance to the surface as it is meshed, in cells, ``(X, Y, Z)``.

    Too small rather than too large: rays must not step over thin liquid.
    """
    level = np.clip(surface_level(fields, 0.5), -LEVEL_BAND, LEVEL_BAND)
    level = gaussian_filter(level, LEVEL_SPREAD, mode="nearest")
    if (level > 0).all():
        return np.full(level.shape, AIR, dtype=np.float32)
    away = distance_transform_edt(level > 0)
    return np.where(away > 2, np.minimum(away - 1, AIR), level / 2).astype(np.float32)


@njit(cache=True, fastmath=True)
def _draw(field, kind, size, height, body_centre, body_axes, axes, centre, width, image):
    rays = image.shape[0]
    nx, ny, nz = field.shape
    reach = np.sqrt(nx * nx + ny * ny + nz * nz)
    for row in range(rays):
        for column in range(rays):
            u = ((column + 0.5) / rays - 0.5) * width
            v = ((row + 0.5) / rays - 0.5) * width
            x = centre[0] + u * axes[0, 0] + v * axes[1, 0] - reach * axes[2, 0]
            y = centre[1] + u * axes[0, 1] + v * axes[1, 1] - reach * axes[2, 1]
            z = centre[2] + u * axes[0, 2] + v * axes[1, 2] - reach * axes[2, 2]
            travelled, hit = 0.0, 0
            while travelled < 2 * reach:
                px = x + travelled * axes[2, 0]
                py = y + travelled * axes[2, 1]
                pz = z + travelled * axes[2, 2]
                wet = _liquid(field, px, py, pz)
                dry = world_distance(kind, size, height, body_centre, body_axes, px, py, pz)
                near = min(wet, dry)
                if near < 0.02:
                    hit = 1 if wet < dry else 2
                    break
                travelled += max(0.8 * near, 0.05)
            shade = 0.93 - 0.18 * row / rays
            colour = (shade, shade, shade * 1.01)
            if hit == 1:
                n = _normal(field, px, py, pz)
                colour = _water(n, axes)
            elif hit == 2:
                e = 0.2
                a = world_distance(kind, size, height, body_centre, body_axes, px + e, py, pz)
                b = world_distance(kind, size, height, body_centre, body_axes, px, py + e, pz)
                c = world_distance(kind, size, height, body_centre, body_axes, px, py, pz + e)
                n = _unit(a - dry, b - dry, c - dry)
                light = 0.16 + 0.3 * max(0.0, 0.3 * n[0] + 0.45 * n[1] + 0.84 * n[2])
                colour = (light, light, light)
            image[row, column, 0] = colour[0]
            image[row, column, 1] = colour[1]
            image[row, column, 2] = colour[2]


@njit(cache=True, fastmath=True)
def _liquid(field, x, y, z):
    """Return the distance to the liquid; outside the array, at least that to the array."""
    nx, ny, nz = field.shape
    ox = max(0.5 - x, x - nx + 0.5, 0.0)
    oy = max(0.5 - y, y - ny + 0.5, 0.0)
    oz = max(0.5 - z, z - nz + 0.5, 0.0)
    away = np.sqrt(ox * ox + oy * oy + oz * oz)
    if away > 0:
        return away + 0.1
    return trilinear(field, x, y, z)


@njit(cache=True, fastmath=True)
def _normal(field, x, y, z):
    e = 0.7
    return _unit(
        trilinear(field, x + e, y, z) - trilinear(field, x - e, y, z),
        trilinear(field, x, y + e, z) - trilinear(field, x, y - e, z),
        trilinear(field, x, y, z + e) - trilinear(field, x, y, z - e),
    )


@njit(cache=True, fastmath=True)
def _unit(x, y, z):
    size = max(np.sqrt(x * x + y * y + z * z), 1e-9)
    return x / size, y / size, z / size


@njit(cache=True, fastmath=True)
def _water(n, axes):
    """Shade: a sky that is bright above, a key light with a highlight, a rim by Fresnel."""
    facing = max(-(n[0] * axes[2, 0] + n[1] * axes[2, 1] + n[2] * axes[2, 2]), 0.0)
    key = max(0.3 * n[0] + 0.45 * n[1] + 0.84 * n[2], 0.0)
    # Half way between the key light and the camera.
    h = _unit(0.3 - axes[2, 0], 0.45 - axes[2, 1], 0.84 - axes[2, 2])
    shine = max(n[0] * h[0] + n[1] * h[1] + n[2] * h[2], 0.0) ** 60
    rim = (1 - facing) ** 3
    sky = 0.5 + 0.5 * n[2]
    red = 0.05 + 0.10 * sky + 0.18 * key + 0.45 * rim + 0.8 * shine
    green = 0.16 + 0.16 * sky + 0.26 * key + 0.45 * rim + 0.8 * shine
    blue = 0.32 + 0.20 * sky + 0.30 * key + 0.42 * rim + 0.8 * shine
    return red, green, blue
