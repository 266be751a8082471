# SPDX-License-Identifier: GPL-3.0-or-later
"""From particles to a frame: surface, velocity, and spray finer than a cell."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.step import Liquid, World, flow
from liquid_splash_addon.core.fluid.surface import DISTANCE_BAND, particle_level, redistance
from liquid_splash_addon.core.fluid.transfer import sample

from ..data.frames import StoredFrame, near_blocks, pack_distance, pack_velocity

SMALLEST_SURFACE = 1.0
"""Cells^3 of the stored grid: a connected piece of liquid with less is stored as a droplet."""

FRAME_MARGIN = int(DISTANCE_BAND) + 2
"""Cells of air around the liquid in a frame, and layers of air cells with a velocity."""


def take_frame(
    liquid: Liquid, world: World, spacing: float, stored_spacing: float, time: float
) -> StoredFrame:
    """Return the liquid as a frame on cells of ``stored_spacing`` metres.

    spacing : cell of the simulation, metres; time : seconds since impact.
    """
    scale = spacing / stored_spacing
    positions = liquid.particles.positions * np.float32(scale)
    volumes = liquid.particles.volumes * np.float32(scale**3)
    start = np.floor(positions.min(axis=0)).astype(int) - FRAME_MARGIN
    shape = np.ceil(positions.max(axis=0)).astype(int) + FRAME_MARGIN - start
    x, y, z = (int(n + n % 2) for n in shape)
    level = particle_level(positions, volumes, start, (x, y, z))
    pieces = find_pieces(level, positions - start)
    spray = np.bincount(pieces, volumes)[pieces] < SMALLEST_SURFACE
    if spray.any():
        level = particle_level(positions[~spray], volumes[~spray], start, (x, y, z))
    codes = pack_distance(redistance(level))
    velocity = block_velocity(liquid.particles, world, codes, start, scale) * spacing
    droplets = gather_droplets(liquid.particles.take(spray), pieces[spray], spacing)
    return StoredFrame(codes, pack_velocity(velocity), start, droplets, time)


def find_pieces(level: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the number of the connected piece of liquid that each particle belongs to, ``(n,)``.

    A particle whose cell lies outside the surface belongs to a piece in the cells around it, or
    else is a piece with the others of its cell.
    level : ``(X, Y, Z)``, negative in the liquid; positions : ``(n, 3)`` cells of it.
    """
    labels, count = ndimage.label(level < 0)
    around = ndimage.maximum_filter(labels, 3)
    flat = np.ravel_multi_index(tuple(positions.astype(int).T), level.shape)
    pieces = labels.ravel()[flat].astype(np.int64)
    pieces = np.where(pieces == 0, around.ravel()[flat], pieces)
    alone = pieces == 0
    _, cell = np.unique(flat[alone], return_inverse=True)
    pieces[alone] = count + 1 + cell
    return np.asarray(pieces)


def gather_droplets(particles: Particles, pieces: np.ndarray, spacing: float) -> np.ndarray:
    """Return float16 ``(n, 7)``: position (m), velocity (m/s) and radius (m) of each piece."""
    _, number = np.unique(pieces, return_inverse=True)
    if not len(number):
        return np.zeros((0, 7), dtype=np.float16)
    volume = np.bincount(number, particles.volumes)
    moving = np.concatenate([particles.positions, particles.velocities], axis=1) * spacing
    means = [np.bincount(number, particles.volumes * column) / volume for column in moving.T]
    radius = np.cbrt(volume * 3 / (4 * np.pi)) * spacing
    return np.stack([*means, radius], axis=1).astype(np.float16)


def block_velocity(
    particles: Particles, world: World, codes: np.ndarray, start: np.ndarray, scale: float
) -> np.ndarray:
    """Return the divergence-free velocity ``(n, 3)``, cells/s, in the middle of each near block.

    scale : stored cells a cell of the simulation, at most 1.
    """
    current = flow(particles, world, kick=0.0, layers=int(np.ceil(FRAME_MARGIN / scale)))
    middles = (np.argwhere(near_blocks(codes)) * 2 + 1 + start) / scale
    return sample(middles.astype(np.float32), current.cells, current.after)
