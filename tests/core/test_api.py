# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface for scripts: what it promises, and what it gives."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from liquid_splash_addon import api
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.obstacles.obstacles import ObstacleError
from liquid_splash_addon.core.pipeline import make_splash
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
DRAFT = {"resolution": 64, "device": "CPU", "precision": "float32"}


@pytest.fixture(scope="module")
def crown() -> api.Splash:
    """Return a crown with drops."""
    steps = [api.refinement("DROPLETS", amount=0.006, size=0.7, spread=0.0)]
    return api.make_splash(api.preset_sketch("CROWN"), steps, **DRAFT)


def documented() -> dict[str, str]:
    """Return the names in the page's table of the interface, each with its arguments."""
    table = PAGE.split("## The interface")[1].split("## Command line")[0]
    first = [line.split(" | ")[0] for line in table.splitlines() if line.startswith("| `")]
    names = [name for cell in first for name in re.findall(r"`([^`]+)`", cell)]
    return {name.partition("(")[0]: name.partition("(")[2] for name in names}


def without_types(function) -> str:
    """Return the arguments of a function or class as the page writes them."""
    signature = inspect.signature(function)
    bare = [item.replace(annotation=item.empty) for item in signature.parameters.values()]
    return str(signature.replace(parameters=bare, return_annotation=signature.empty))[1:]


def test_the_page_lists_the_interface_and_its_version() -> None:
    assert set(documented()) == set(api.__all__)
    assert f"Version {api.API_VERSION} " in PAGE
    assert re.fullmatch(r"\d+\.\d+\.\d+", api.API_VERSION)
    manifest = (ROOT / "blender_manifest.toml").read_text()
    assert f'version = "{api.__version__}"' in manifest


@pytest.mark.parametrize("name", [name for name, listed in documented().items() if listed])
def test_the_page_lists_the_arguments_that_there_are(name) -> None:
    listed = documented()[name]
    assert listed == "...)" or listed == without_types(getattr(api, name))


def test_the_page_lists_the_methods_of_a_splash() -> None:
    methods = re.findall(r"`(\w+)\(([^`]*)\)`", PAGE.split("| `Splash(")[1].split("\n")[0])
    for name, listed in methods:
        own = without_types(getattr(api.Splash, name))
        assert own.removeprefix("self, ") == f"{listed})"


def test_importing_it_loads_neither_blender_nor_torch() -> None:
    script = (
        "import sys; sys.modules['bpy'] = None\n"
        "import liquid_splash_addon.api, liquid_splash_addon.command_line\n"
        "print(sorted({'torch', 'scipy', 'skimage'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stdout + done.stderr


def test_it_gives_what_the_pipeline_gives() -> None:
    drawings = api.preset_sketch("WAVE")
    settings = SplashSettings(resolution="64", device="CPU", seed=3, variation=1.0)
    strokes, _ = strokes_from_drawings(drawings, settings)
    wanted = make_splash(strokes, settings, load_generator(device="CPU")).mesh
    for given in (drawings, strokes, [drawings[0], *strokes[1:]]):
        found = api.make_splash(given, seed=3, variation=1.0, **DRAFT)
        np.testing.assert_array_equal(found.vertices, wanted.vertices)
        np.testing.assert_array_equal(found.velocities, wanted.velocities)


def test_a_preset_of_refinements_is_a_name() -> None:
    assert api.refinements("FRESH") == list(api.PRESETS["FRESH"].steps)
    assert api.refinements(["ruptures", api.refinement("waves", speed=0.2)]) == [
        api.refinement("RUPTURES"),
        api.refinement("WAVES", speed=0.2),
    ]


def test_points_alone_are_drawn_at_the_stroke_speed() -> None:
    line = np.linspace([0, 0, 0], [2, 0, 0], 9)
    settings = SplashSettings(real_size=0.5, stroke_speed=0.25)
    (stroke,), warnings = api.with_velocities([line], settings)
    # Two units stand for half a metre: a quarter of a metre per second is one unit per second.
    np.testing.assert_allclose(stroke.velocities, np.tile([1.0, 0, 0], (9, 1)), atol=1e-6)
    assert "have no recorded time" in warnings[0]


def test_one_bad_stroke_does_not_keep_the_others_from_a_splash() -> None:
    line = np.linspace([0, 0, 0], [2, 0, 0], 9)
    bad = [np.zeros((3, 3)), api.Stroke(line, np.full((9, 3), np.nan)), line[:1]]
    strokes, warnings = api.with_velocities([*bad, line], SplashSettings())
    assert len(strokes) == 1 and len(warnings) == 4
    assert all(text.startswith("Left out 1 stroke(s)") for text in warnings[:3])


@pytest.mark.parametrize(
    ("strokes", "settings", "kind", "says"),
    [
        ([], {}, api.StrokeError, "Draw at least one stroke"),
        ([np.zeros((4, 2))], {}, api.StrokeError, r"Stroke 1 needs points of shape \(n, 3\)"),
        (
            [api.Drawing(np.zeros((4, 3)), times=np.zeros(3))],
            {},
            api.StrokeError,
            r"Stroke 1 has 4 points, so its times need the shape \(4,\), not \(3,\)",
        ),
        ([np.zeros((1, 3))], {}, api.StrokeError, "None of the 1 stroke"),
        ([np.eye(3)], {"refine": "FOAM"}, ValueError, "no refinement 'FOAM': choose one of FRESH"),
        ([np.eye(3)], {"resolution": 96}, ValueError, "resolution must be one of 64, 128"),
        ([np.eye(3)], {"precision": "float8"}, ValueError, "precision must be one of float32"),
        ([np.eye(3)], {"weights": "no.file"}, ValueError, "No network at no.file"),
        ([np.eye(3)], {"size": 3}, TypeError, "size"),
        ([np.eye(3)], {"obstacles": [(np.eye(3), [])]}, ObstacleError, "has no faces"),
    ],
    ids=lambda value: None if not isinstance(value, str) else value.split()[0],
)
def test_what_cannot_be_done_is_said(strokes, settings, kind, says) -> None:
    with pytest.raises(kind, match=says):
        api.make_splash(strokes, **{"device": "CPU", **settings})


def test_obstacles_are_kept_free(crown) -> None:
    low, high = crown.vertices.min(axis=0), crown.vertices.max(axis=0)
    middle = (low + high) / 2
    # The half of the crown at positive x is under a box.
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    box = np.where(corners, high + 0.5, [middle[0], low[1] - 0.5, low[2] - 0.5])
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
         [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    )  # fmt: skip
    splash = api.make_splash(api.preset_sketch("CROWN"), obstacles=[(box, faces)], **DRAFT)
    cell = 0.4 / 64 / 0.33 * float((high - low).max())
    assert splash.vertices[:, 0].max() < middle[0] + cell
    assert splash.vertices[:, 0].min() < low[0] + 4 * cell


def test_an_independent_reader_finds_mesh_velocities_and_drops(crown, tmp_path) -> None:
    plyfile = pytest.importorskip("plyfile")
    crown.save(tmp_path / "crown.ply")
    read = plyfile.PlyData.read(tmp_path / "crown.ply")
    assert not read.text
    free, count = ~crown.drops.meshed, len(crown.vertices)
    assert free.any()
    wanted = {
        ("x", "y", "z"): (crown.vertices, crown.drops.positions),
        ("velocity_x", "velocity_y", "velocity_z"): (crown.velocities, crown.drops.velocities),
    }
    for names, (mesh, drops) in wanted.items():
        found = np.stack([read["vertex"][name] for name in names], axis=1)
        np.testing.assert_array_equal(found, np.concatenate([mesh, drops[free]]))
    np.testing.assert_array_equal(read["vertex"]["radius"][count:], crown.drops.radii[free])
    assert not read["vertex"]["radius"][:count].any()
    np.testing.assert_array_equal(np.stack(read["face"]["vertex_indices"]), crown.faces)


def test_obj_is_read_by_another_library(crown, tmp_path) -> None:
    from pymeshlab import MeshSet

    crown.save(tmp_path / "crown.obj")
    meshes = MeshSet()
    meshes.load_new_mesh(str(tmp_path / "crown.obj"))
    found = meshes.current_mesh()
    np.testing.assert_allclose(found.vertex_matrix(), crown.vertices, rtol=1e-6)
    np.testing.assert_array_equal(found.face_matrix(), crown.faces)


def test_arrays_come_back_from_an_archive(crown, tmp_path) -> None:
    crown.save(tmp_path / "crown.npz")
    with np.load(tmp_path / "crown.npz", allow_pickle=False) as stored:
        np.testing.assert_array_equal(stored["velocities"], crown.velocities)
        np.testing.assert_array_equal(stored["drop_radii"], crown.drops.radii)


def test_a_file_of_another_kind_is_refused(crown, tmp_path) -> None:
    with pytest.raises(ValueError, match=r"splash.stl: splashes are written as .ply, .obj, .npz"):
        crown.save(tmp_path / "splash.stl")
    assert list(tmp_path.iterdir()) == []


def test_a_report_can_stop_it() -> None:
    def stop(stage, share):
        raise api.Cancelled

    with pytest.raises(api.Cancelled):
        api.make_splash(api.preset_sketch("JET"), report=stop, **DRAFT)
