# SPDX-License-Identifier: GPL-3.0-or-later
"""Films, rims and beads of every preset sketch, measured on the finished mesh."""

from functools import cache

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.closest_point import nearest_on_mesh
from liquid_splash_addon.core.mesh.marching_cubes import surface
from liquid_splash_addon.core.mesh.self_intersection import crossing_faces
from liquid_splash_addon.core.pipeline import Splash, make_splash
from liquid_splash_addon.core.refinement.presets import PRESETS as LISTS
from liquid_splash_addon.core.refinement.settings import SheetSettings
from liquid_splash_addon.core.refinement.sheet_mesh import SheetMesh, prepare_sheets
from liquid_splash_addon.core.refinement.sheets import add_sheets
from liquid_splash_addon.core.refinement.stack import Refiner
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import PRESETS
from liquid_splash_addon.core.sketch.strokes import Stroke
from tests.core.refinement.sheet_measures import bead_gaps, film_ratios, rim_ratios
from tests.core.refinement.test_remeshing import is_manifold

pytestmark = pytest.mark.slow

PLAIN = SheetSettings(beads=0, fingers=0)
"""Rims as they are between beads, with nothing that grows out of them."""


SAG = 0.06
"""Cells by which both sides of a bent film may miss each other: chords of 0.8 to 1.1 cells across
an arc of 2.5 cells' radius lie that far from it. A film of 1 mm is 0.3 cells thick."""


@cache
def generator():
    from liquid_splash_addon.core.generator.loading import load_generator

    return load_generator(device="CPU")


def strokes_of(name: str) -> list[Stroke]:
    """Return the strokes of a preset at its defaults, all layers in one."""
    drawings = [drawing for layer in PRESETS[name]().layers().values() for drawing in layer]
    return strokes_from_drawings(drawings, SplashSettings())[0]


@cache
def splash_of(name: str) -> Splash:
    return make_splash(strokes_of(name), SplashSettings(), generator())


@cache
def prepared_of(name: str) -> SheetMesh:
    splash = splash_of(name)
    return prepare_sheets(surface(splash.fields), splash.fields.grid.spacing, splash.strokes)


@pytest.mark.parametrize("name", PRESETS)
def test_films_rims_and_beads_are_as_asked_for(name):
    prepared = prepared_of(name)
    made = add_sheets(prepared, PLAIN)
    films, areas, wanted = film_ratios(prepared, made)
    rims, gaps = rim_ratios(prepared, made), bead_gaps(prepared, made) / PLAIN.spacing
    mean = float(np.average(films, weights=areas)) if len(films) else 1.0
    off, whole = np.abs(films - 1), max(areas.sum(), 1e-30)
    near = float(areas[off < 0.15].sum() / whole)
    flat = float(areas[off < np.maximum(0.15, SAG * prepared.spacing / wanted)].sum() / whole)
    print(
        f"{name}: film {mean:.3f} of what was asked for, {near:.3f} of its area within 15 %, "
        f"{flat:.3f} but for chords; rims "
        f"{np.median(rims):.2f}, {np.mean(np.abs(rims - 1) < 0.25):.3f} within 25 %; beads "
        f"{gaps.mean():.2f}, {np.mean(np.abs(gaps - 1) < 0.3):.3f} within 30 %"
    )
    assert abs(mean - 1) < 0.15 and near > 0.75 and flat > 0.85
    assert np.mean(np.abs(rims - 1) < 0.25) > 0.9 and abs(np.median(rims) - 1) < 0.15
    assert np.mean(np.abs(gaps - 1) < 0.3) > 0.9


@pytest.mark.parametrize("name", PRESETS)
def test_new_splashes_are_closed_and_hardly_cross(name):
    splash = splash_of(name)
    refined = Refiner(splash.fields, strokes=splash.strokes).refine(LISTS["FRESH"].steps)
    mesh = refined.mesh
    crossed = float(crossing_faces(mesh.vertices, mesh.faces).mean())
    print(f"{name}: {len(mesh.faces)} faces, {100 * crossed:.4f} % cross, volume {refined.gained}")
    assert is_manifold(mesh.faces)
    assert crossed <= 1e-4


def test_a_turned_sketch_in_its_stored_frame_gives_the_same_sheets_turned():
    strokes, splash = strokes_of("CROWN"), splash_of("CROWN")
    angle = np.radians(37.0)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    other = make_splash(
        [Stroke(s.points @ turn.T, s.velocities @ turn.T) for s in strokes], SplashSettings(),
        generator(), splash.frame.moved(matrix), refinements=LISTS["FRESH"].steps,
    )  # fmt: skip
    here = make_splash(
        strokes, SplashSettings(), generator(), splash.frame, refinements=LISTS["FRESH"].steps
    ).mesh
    cell = splash.frame.scale.lengths_to_drawing(splash.fields.grid.spacing)
    places = here.vertices.astype(np.float64) @ turn.T
    triangles = other.mesh.vertices.astype(np.float64)[other.mesh.faces]
    away = nearest_on_mesh(triangles, places, cell)[0] / cell
    print(f"turned: {np.quantile(away, 0.999):.5f} cells away, {away.max():.5f} at most")
    assert np.quantile(away, 0.999) < 0.01
