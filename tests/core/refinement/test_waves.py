# SPDX-License-Identifier: GPL-3.0-or-later
"""Capillary waves against known properties."""

import itertools
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from liquid_splash_addon.core.mesh.local_thickness import thickness_and_clearance
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.numeric.triangles import enclosed_volume
from liquid_splash_addon.core.refinement import waves
from liquid_splash_addon.core.refinement.settings import WaveSettings
from liquid_splash_addon.core.refinement.waves import (
    DAMPING_TIME,
    add_waves,
    leapfrog,
    prepare,
    propagate,
    time_steps,
    wave_edge,
)
from tests.core.refinement.level_meshes import CELL, bowl, prism
from tests.core.refinement.test_remeshing import crossing_faces, is_manifold

SPEED = 0.2
WAVE_NUMBER = 2 * np.pi / (9 * CELL)


@pytest.fixture(scope="module")
def sheet():
    return prism(96, 8)


@pytest.fixture(scope="module")
def splash():
    return bowl()


class Packet:
    """A wave that runs along a flat sheet, and what is measured of it."""

    def __init__(self, sheet, edge, zeta):
        self.prepared = prepare(sheet, edge, CELL)
        self.operator = self.prepared.operator
        self.x = self.prepared.mesh.vertices[:, 0].astype(float)
        settings = WaveSettings(speed=SPEED, damping=zeta, reach=0.1)
        self.step, _, self.kept = time_steps(self.prepared, settings)
        centre = -18 * CELL
        near = np.exp(-(((self.x - centre) / (8 * CELL)) ** 2))
        self.rho = (near * np.cos(WAVE_NUMBER * (self.x - centre))).astype(np.float32)
        # At half a step before: the envelope is taken as still, which costs a small echo.
        late = WAVE_NUMBER * (self.x - centre + SPEED * self.step / 2)
        self.rate = (SPEED * WAVE_NUMBER * near * np.sin(late)).astype(np.float32)

    def advance(self, steps):
        o = self.operator
        quiet = np.zeros_like(self.rho)
        drive = np.zeros(steps, np.float32)
        leapfrog(
            self.rho, self.rate, o.first, o.near, o.rows, quiet, drive, self.step, SPEED, self.kept
        )

    def phase(self):
        wave = (self.operator.mass * self.rho) @ np.exp(-1j * WAVE_NUMBER * self.x)
        return float(np.angle(wave))

    def energy(self):
        """Return the energy; a term with rho and rate evens out its fall within a period."""
        rho, rate = self.rho.astype(float), self.rate.astype(float)
        ahead = rho + self.step * rate
        drag = (1 - self.kept) / self.step * (self.operator.mass * rho) @ rate
        tension = -(self.operator.mass * rho) @ self.operator.apply(ahead.astype(np.float32))
        return 0.5 * (self.operator.mass @ rate**2 + drag + SPEED**2 * tension)


@pytest.mark.parametrize("edge", [1.0, 0.6])
def test_undamped_waves_keep_their_speed_and_energy(sheet, edge):
    packet = Packet(sheet, edge * CELL, 1.0)
    energy, phases, laps = packet.energy(), [packet.phase()], 30
    per_lap = int(np.ceil(0.05 * CELL / (SPEED * packet.step))) or 1
    for _ in range(laps):
        packet.advance(per_lap)
        phases.append(packet.phase())
    turned = -np.diff(np.unwrap(phases)).sum()
    speed = turned / WAVE_NUMBER / (laps * per_lap * packet.step)
    assert speed == pytest.approx(SPEED, rel=0.05)
    assert packet.energy() == pytest.approx(energy, rel=0.01)


@pytest.mark.parametrize("edge", [1.0, 0.6])
@pytest.mark.parametrize("zeta", [0.9, 0.7])
def test_damping_does_not_depend_on_the_mesh(sheet, edge, zeta):
    packet = Packet(sheet, edge * CELL, zeta)
    energy, steps = packet.energy(), int(0.1 / packet.step)
    packet.advance(steps)
    # Half of the energy is motion, so amplitude falls with the root of zeta, energy with zeta.
    expected = zeta ** (steps * packet.step / DAMPING_TIME)
    assert np.sqrt(packet.energy() / energy) == pytest.approx(np.sqrt(expected), rel=0.05)


def displacement(prepared, mesh):
    away = mesh.vertices - prepared.mesh.vertices
    return (away * prepared.normals).sum(axis=1)


def test_waves_leave_the_rim_and_fade(splash):
    prepared = prepare(splash, CELL, CELL)
    settings = WaveSettings(frequency=8, speed=0.2, reach=0.1)
    mesh, report = propagate(prepared, settings)
    assert report.warnings == []
    assert report.reach == pytest.approx(0.1)
    moved = np.abs(displacement(prepared, mesh)) / settings.amplitude
    loud = np.abs(prepared.curvature) > 0.2
    away, _ = cKDTree(mesh.vertices[loud]).query(mesh.vertices)
    near, far = moved[away < 3 * CELL], moved[away > 7 * CELL]
    assert len(far) > 100
    assert np.quantile(near, 0.9) > 0.15
    assert np.quantile(far, 0.9) < 0.6 * np.quantile(near, 0.9)
    quiet, _ = propagate(prepared, replace(settings, damping=0.5))
    assert np.abs(displacement(prepared, quiet))[away > 7 * CELL].max() < 0.2 * far.max() * (
        settings.amplitude
    )


def test_looks_alike_on_a_finer_mesh(splash):
    settings = WaveSettings(frequency=8, speed=0.25, reach=0.06)
    found = []
    for edge in (CELL, 0.6 * CELL):
        prepared = prepare(splash, edge, CELL)
        mesh, _ = propagate(prepared, settings)
        found.append((prepared.mesh.vertices, displacement(prepared, mesh)))
    (coarse, first), (fine, second) = found
    _, nearest = cKDTree(fine).query(coarse)
    assert np.corrcoef(first, second[nearest])[0, 1] > 0.9
    assert first.std() == pytest.approx(second.std(), rel=0.15)


def test_volume_is_kept_and_nothing_crosses(splash):
    settings = WaveSettings(amplitude=0.003)
    prepared = prepare(splash, wave_edge(splash, settings, CELL), CELL)
    mesh, report = propagate(prepared, settings)
    assert np.abs(displacement(prepared, mesh)).max() > 0.1 * CELL
    assert crossing_faces(mesh.vertices, mesh.faces) < 0.001 * len(mesh.faces)
    assert is_manifold(mesh.faces)
    before = enclosed_volume(prepared.mesh.vertices, mesh.faces)
    assert report.volume_change == pytest.approx(
        enclosed_volume(mesh.vertices, mesh.faces) / before - 1
    )
    assert abs(report.volume_change) < 0.02


def test_waves_far_too_high_do_not_pierce_sheets(splash):
    prepared = prepare(splash, CELL, CELL)
    high = replace(prepared, curvature=30 * prepared.curvature)
    mesh, _ = propagate(high, WaveSettings(amplitude=0.003, damping=1.0))
    assert crossing_faces(mesh.vertices, mesh.faces) < 0.001 * len(mesh.faces)


def test_clearance_is_half_the_thickness_half_the_gap_or_the_radius():
    axes = np.arange(-10, 10.0)
    x, y = (part.ravel() for part in np.meshgrid(axes, axes))
    # Two sheets 1.6 thick, 2.4 apart.
    heights, sides = (0.0, 1.6, 4.0, 5.6), (-1, 1, -1, 1)
    points = np.concatenate([np.stack([x, y, 0 * x + z], axis=1) for z in heights])
    normals = np.repeat([[0, 0, side] for side in sides], len(x), axis=0).astype(np.float32)
    inward, outward = (
        part.reshape(4, -1) for part in thickness_and_clearance(points, normals, 4.0)
    )
    assert inward == pytest.approx(0.8, rel=1e-4)
    assert outward[[1, 2]] == pytest.approx(1.2, rel=1e-4)
    assert outward[[0, 3]] == pytest.approx(2.0, rel=1e-4)
    ball = np.random.default_rng(0).normal(size=(300, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    inward, outward = thickness_and_clearance(1.5 * ball, ball.astype(np.float32), 4.0)
    assert inward == pytest.approx(1.5, rel=1e-3)
    assert outward == pytest.approx(2.0, rel=1e-3)


def test_no_slider_blows_up(splash):
    sliders = [(item.metadata["low"], item.metadata["high"]) for item in fields(WaveSettings)]
    kept = {}
    for values in itertools.product(*sliders):
        settings = WaveSettings(*values)
        edge = max(wave_edge(splash, settings, CELL), 0.7 * CELL)
        prepared = kept.setdefault(edge, prepare(splash, edge, CELL) if edge not in kept else None)
        mesh, report = propagate(prepared, settings)
        moved = np.abs(displacement(prepared, mesh))
        assert np.isfinite(mesh.vertices).all()
        assert moved.max() <= waves.CLEARANCE_SHARE * waves.CLEARANCE_REACH / 2 * CELL * 1.001
        assert report.steps <= waves.MOST_WAVE_STEPS
        assert abs(report.volume_change) < 0.1
        if settings.amplitude == 0 or settings.reach == 0:
            assert moved.max() < 1e-6


def test_rate_stays_bounded_where_nothing_is_damped(splash):
    prepared = prepare(splash, CELL, CELL)
    settings = WaveSettings(damping=1.0, reach=0.4)
    step, _, _ = time_steps(prepared, settings)
    # The mode that a step too long makes grow.
    noise = np.random.default_rng(0).normal(size=len(prepared.curvature)).astype(np.float32)
    rate, o = np.zeros_like(noise), prepared.operator
    leapfrog(
        noise, rate, o.first, o.near, o.rows, rate * 0, np.zeros(3000, np.float32), step,
        settings.speed, 1.0,
    )  # fmt: skip
    assert np.abs(noise).max() < 50


def test_settings_that_cannot_be_met_are_reported(splash, monkeypatch):
    short = WaveSettings(frequency=10, speed=0.1)
    monkeypatch.setattr(waves, "MOST_TRIANGLES", 1)
    mesh, report = propagate(prepare(splash, wave_edge(splash, short, CELL), CELL), short)
    assert report.wavelength == pytest.approx(6 * CELL, rel=0.01)
    assert "10 mm are too short" in report.warnings[0]
    assert len(mesh.faces) < 1.2 * len(splash.faces)
    monkeypatch.setattr(waves, "MOST_WAVE_STEPS", 10)
    _, report = propagate(prepare(splash, CELL, CELL), WaveSettings(speed=0.3, reach=0.4))
    assert report.steps == 10
    assert report.reach < 0.1
    assert "instead of 400 mm" in report.warnings[0]


def test_edges_are_fine_enough_for_a_wave(splash):
    settings = WaveSettings(frequency=10, speed=0.1)
    edge = wave_edge(splash, settings, CELL)
    assert edge <= settings.wavelength / 6 * 1.001
    assert edge > settings.wavelength / 6 / 1.5
    assert wave_edge(splash, WaveSettings(speed=1.0), CELL) == CELL


def test_no_mesh_gets_no_waves():
    nothing = Mesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32), np.zeros((0, 3)))
    mesh, report = add_waves(nothing, WaveSettings(), CELL)
    assert len(mesh.faces) == 0
    assert report.volume_change == 0


def test_values_outside_the_sliders_are_refused():
    with pytest.raises(ValueError, match="frequency must be from 1"):
        WaveSettings(frequency=20)
