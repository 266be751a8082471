# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake Frames: keyed settings and animated sketches get a splash a frame, that plays by itself."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data.refinements import add_step
from liquid_splash_addon.blender.jobs import bake_frames
from liquid_splash_addon.blender.scene import frame_folder, locks
from liquid_splash_addon.blender.scene.keyed import count_drawings, has_keyed_settings
from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.blender.ui import bake_panel, panels, simulate_panel
from liquid_splash_addon.core.progress import Cancelled
from liquid_splash_addon.core.refinement.settings import WaveSettings
from tests.blender.drawing_panels import drawn
from tests.blender.sketching import add_sketch, evaluated_mesh, fan, generate, in_world, line
from tests.blender.sketching import vertices as mesh_vertices
from tests.blender.test_simulate import files, read

pytestmark = pytest.mark.usefixtures("tubes")

FIRST, LAST = 2, 4
FRAMES = range(FIRST, LAST + 1)


@pytest.fixture
def splash(tubes, tmp_path) -> bpy.types.Object:
    """Return a splash of a saved file, of which a few frames are to be baked."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "keys.blend"))
    bpy.context.scene.frame_set(1)
    add_sketch(fan())
    bpy.context.scene.frame_set(3)
    splash = generate()
    bake = splash.splash_simulation.bake
    bake.range, bake.first, bake.last = "OWN", FIRST, LAST
    return splash


def key(owner, path: str, *values: tuple[int, float]) -> None:
    """Key a property, and show the scene's frame again."""
    group, name = path.rpartition(".")[::2]
    for frame, value in values:
        setattr(owner.path_resolve(group) if group else owner, name, value)
        assert owner.keyframe_insert(path, frame=frame)
    bpy.context.scene.frame_set(bpy.context.scene.frame_current)


def bake(splash: bpy.types.Object) -> bpy.types.Object:
    """Press the button and return what plays the frames."""
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.bake_frames() == {"FINISHED"}
    return splash.splash_simulation.motion


def regenerated(splash: bpy.types.Object) -> dict[int, np.ndarray]:
    """Return what the button makes at each frame, in the world."""
    found = {}
    bpy.context.view_layer.objects.active = splash
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        bpy.ops.splash.regenerate()
        found[frame] = in_world(splash)
    return found


def played(motion: bpy.types.Object) -> dict[int, np.ndarray]:
    """Return what is shown at each frame, in the world."""
    found = {}
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        points = evaluated_mesh(motion).get("position", np.zeros((0, 3)))
        matrix = np.array(motion.matrix_world)
        found[frame] = points @ matrix[:3, :3].T + matrix[:3, 3]
    return found


def assert_as_regenerated(splash: bpy.types.Object) -> None:
    """Bake, and compare each frame with what Regenerate makes there."""
    before = mesh_vertices(splash).copy()
    frame = bpy.context.scene.frame_current
    motion = bake(splash)
    assert bpy.context.scene.frame_current == frame, "the timeline stays where it is"
    np.testing.assert_array_equal(mesh_vertices(splash), before)
    shown, wanted = played(motion), regenerated(splash)
    assert len({values.tobytes() for values in wanted.values()}) > 1, "something is keyed"
    for number in FRAMES:
        np.testing.assert_allclose(shown[number], wanted[number], atol=2e-5)


def keyed_setting(splash: bpy.types.Object) -> None:
    key(splash, "splash.settings.surface_threshold", (FIRST, 0.2), (LAST, 0.8))


def driven_setting(splash: bpy.types.Object) -> None:
    curve = splash.driver_add("splash.settings.surface_threshold")
    curve.driver.expression = "0.1 * frame"


def keyed_refinement(splash: bpy.types.Object) -> None:
    add_step(splash, WaveSettings(reach=0.2))
    key(splash, "splash_stack.items[0].waves.amplitude", (FIRST, 0.0), (LAST, 0.002))


def keyed_layer(splash: bpy.types.Object) -> None:
    data = splash.splash.sketch.data
    layer = data.layers.new("Extra")
    layer.frames.new(1)
    add_strokes(splash.splash.sketch, [line((-0.2, 0.6, 0.1), (0.4, 0.8, 0.2))], layer)
    key(data, 'layers["Extra"].opacity', (FIRST, 1.0), (FIRST + 1, 0.0))


def keyed_place_of_a_layer(splash: bpy.types.Object) -> None:
    layer = splash.splash.sketch.data.layers.new("Extra")
    layer.frames.new(1)
    add_strokes(splash.splash.sketch, [line((-0.2, 0.6, 0.1), (0.4, 0.8, 0.2))], layer)
    key(splash.splash.sketch.data, 'layers["Extra"].translation', (FIRST, (0, 0, 0)),
        (LAST, (0, 0, 0.3)))  # fmt: skip


def animated_drawings(splash: bpy.types.Object) -> None:
    """Another drawing from the last frame on."""
    scene, sketch = bpy.context.scene, splash.splash.sketch
    layer = sketch.data.layers[0]
    before = scene.frame_current
    scene.frame_set(LAST)
    layer.frames.new(LAST)
    add_strokes(sketch, [*fan()[:3], line((0, 0, 0), (0.3, -0.5, 0.2))], layer)
    scene.frame_set(before)


WAYS = (keyed_setting, driven_setting, keyed_refinement, keyed_layer, keyed_place_of_a_layer,
        animated_drawings)  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_each_frame_is_what_the_button_makes_there(splash, way):
    way(splash)
    assert_as_regenerated(splash)


def test_hidden_objects_are_read_at_their_frames_too(splash):
    keyed_setting(splash)
    keyed_layer(splash)
    shown = [read(data) for data in files_of(splash)]
    splash.hide_viewport = splash.splash.sketch.hide_viewport = True
    bpy.ops.splash.simulation_delete()
    for before, after in zip(shown, files_of(splash), strict=True):
        np.testing.assert_array_equal(before, read(after))


def files_of(splash: bpy.types.Object) -> list[bytes]:
    """Bake and return the files."""
    bake(splash)
    return files(splash)


@pytest.mark.parametrize("follows", [True, False])
def test_a_sketch_that_moves_and_grows(splash, follows):
    """A child splash moves along by itself; one that stands free is shown where its sketch is."""
    sketch = splash.splash.sketch
    if not follows:
        bpy.context.view_layer.objects.active = splash
        bpy.ops.splash.follow(on=False)
    key(sketch, "location", (FIRST, (0, 0, 0)), (LAST, (3, 0, 0)))
    key(sketch, "scale", (FIRST, (1, 1, 1)), (LAST, (2, 2, 2)))
    shown = played(bake(splash))
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        matrix = np.array(sketch.matrix_world)
        found = (shown[frame] - matrix[:3, 3]) / matrix[0, 0]
        np.testing.assert_allclose(found, shown[FIRST], atol=1e-4, err_msg="on its strokes")
    still = in_world(splash)
    if follows:
        np.testing.assert_allclose(shown[LAST], still, atol=1e-4 * np.ptp(still))


def test_drawings_that_are_held_are_made_once(splash, capfd):
    animated_drawings(splash)
    assert count_drawings(splash) == 2
    stored = files_of(splash)
    assert "2 made" in splash.splash_simulation.summary
    assert " splash(es) made, " in "".join(capfd.readouterr())
    assert stored[0] == stored[1] != stored[2]


def test_the_current_drawing_can_be_used_for_all(splash):
    animated_drawings(splash)
    splash.splash_simulation.bake.drawings = "CURRENT"
    assert len(set(files_of(splash))) == 1
    splash.splash_simulation.bake.first = 0  # before there was a drawing
    assert len(set(files_of(splash))) == 1 and not splash.splash_simulation.warnings
    keyed_setting(splash)
    assert len(set(files_of(splash))) > 1


def test_frames_without_liquid_are_said_and_keep_no_others(splash):
    layer = splash.splash.sketch.data.layers[0]
    layer.frames.new(LAST)  # an empty drawing
    motion = bake(splash)
    assert f"Frames {LAST}: The sketch has no drawing there" in splash.splash_simulation.warnings
    shown = played(motion)
    assert len(shown[LAST]) == 1, "Blender reads no file without a vertex"
    assert all(len(shown[frame]) > 1 for frame in FRAMES[:-1])
    assert not len(motion.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons)


def test_where_no_frame_has_liquid_that_is_the_message(splash):
    splash.splash.sketch.data.layers[0].hide = True
    with pytest.raises(RuntimeError, match="No stroke is left"):
        bake_frames_of(splash)
    assert not splash.splash_simulation.folder and splash.splash_simulation.motion is None


def test_what_was_stopped_goes_on_and_only_changes_are_made(splash):
    keyed_setting(splash)
    run = bake_frames.Run(bake_frames.read_order(bpy.context, splash))

    def stop_later(stage: str, _share: float) -> None:
        if stage.startswith(f"Frame {LAST}"):
            raise Cancelled

    with pytest.raises(Cancelled):
        bake_frames.bake(run, stop_later)
    bake_frames.write(run)
    record = splash.splash_simulation
    assert record.frames == 2 and record.wanted == 3 and len(files(splash)) == 2
    resumed = files_of(splash)
    assert "1 made" in record.summary and len(resumed) == 3
    key(splash, "splash.settings.surface_threshold", (LAST, 0.6))
    assert files_of(splash)[0] == resumed[0] and "1 made" not in record.summary
    assert bpy.ops.splash.simulation_delete() == {"FINISHED"}
    assert not record.folder and not record.is_baked and record.motion is None


def test_frames_are_those_of_the_scene_unless_chosen(splash):
    record, scene = splash.splash_simulation, bpy.context.scene
    record.bake.range = "SCENE"
    scene.frame_start, scene.frame_end = 7, 9
    assert bake_frames.read_order(bpy.context, splash).frames == range(7, 10)
    record.bake.range, record.bake.last = "OWN", FIRST - 1
    with pytest.raises(RuntimeError, match="The last frame is before the first"):
        bpy.ops.splash.bake_frames()


def test_the_panel_says_what_does_not_follow_and_cures_it(splash):
    bpy.context.view_layer.objects.active = splash
    assert not has_keyed_settings(splash)
    assert "splash.bake_frames" not in drawn(panels.SPLASH_PT_main)
    keyed_setting(splash)
    said = drawn(panels.SPLASH_PT_main)
    assert "Keyed settings do not evaluate by themselves" in said and "splash.bake_frames" in said
    bake(splash)
    bpy.context.view_layer.objects.active = splash
    said = drawn(panels.SPLASH_PT_main)
    assert "by themselves" not in said and f"Frames {FIRST} to {LAST}" in said
    assert f"Frames {FIRST} to {LAST}" in drawn(bake_panel.SPLASH_PT_bake)
    said = drawn(simulate_panel.SPLASH_PT_simulation)
    assert "simulating replaces them" in said and "Out of date" not in said


def test_animated_sketches_are_said(splash):
    bpy.context.view_layer.objects.active = splash
    animated_drawings(splash)
    assert "The sketch has 2 drawings" in drawn(panels.SPLASH_PT_main)


def test_undo_takes_the_playing_objects_away_and_redo_brings_them_back(splash):
    keyed_setting(splash)
    bpy.ops.ed.undo_push(message="Before")
    bake(splash)
    bpy.ops.ed.undo_push(message="Baked")
    bpy.ops.ed.undo()
    splash = bpy.data.objects["Splash"]
    assert not splash.splash_simulation.folder and "Splash Motion" not in bpy.data.objects
    bpy.ops.ed.redo()
    splash = bpy.data.objects["Splash"]
    assert len(played(splash.splash_simulation.motion)[FIRST])


def test_a_file_saved_elsewhere_plays_its_frames_at_their_frames(splash, tmp_path):
    animated_drawings(splash)
    before = played(bake(splash))
    (tmp_path / "other").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other" / "keys.blend"))
    after = played(bpy.data.objects["Splash Motion"])
    for frame in FRAMES:
        np.testing.assert_array_equal(before[frame], after[frame])


def test_a_linked_splash_and_a_lost_sketch_say_what_to_do(splash, tmp_path):
    bpy.ops.wm.save_mainfile()
    path = bpy.data.filepath
    bpy.data.objects.remove(splash.splash.sketch)
    with pytest.raises(RuntimeError, match="was deleted: choose another in Last Run"):
        bake_frames_of(splash)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, into):
        into.objects = ["Splash"]
    bpy.context.scene.collection.objects.link(into.objects[0])
    with pytest.raises(RuntimeError, match="make it local first"):
        bake_frames_of(into.objects[0])


def bake_frames_of(splash: bpy.types.Object) -> None:
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.bake_frames()


def test_a_full_disk_is_said_and_what_is_done_is_kept(splash, monkeypatch):
    keyed_setting(splash)
    monkeypatch.setattr(frame_folder, "free_bytes", lambda folder: 1000)
    assert bpy.ops.splash.bake_frames() == {"FINISHED"}
    record = splash.splash_simulation
    assert record.frames == 1 and "make room, or bake fewer frames" in record.warnings


@pytest.mark.skipif(
    not hasattr(bpy.types, "CyclesRenderSettings")
    and "cycles" not in bpy.context.preferences.addons,
    reason="this Blender has no Cycles",
)
def test_nothing_is_written_in_a_render(splash, tmp_path):
    """Renders of keyed settings play what was baked; what asks to write is refused meanwhile."""
    keyed_setting(splash)
    bake(splash)
    splash.hide_render = True
    scene, render = bpy.context.scene, bpy.context.scene.render
    scene.frame_start, scene.frame_end = FIRST, LAST
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    render.resolution_x = render.resolution_y = 8
    render.filepath = str(tmp_path / "frame_")
    render.use_lock_interface = render.use_persistent_data = True
    states, said = [], []

    def look(*_given) -> None:
        record = splash.splash_simulation
        states.append(
            (
                mesh_vertices(splash).tobytes(),
                splash.splash.made_of,
                splash.splash_stack.evaluated,
                record.summary,
                len(files(splash)),
            )
        )
        for name in ("bake_frames", "regenerate"):
            try:
                getattr(bpy.ops.splash, name)()
            except RuntimeError as error:
                said.append(str(error))

    bpy.context.view_layer.objects.active = splash
    moments = (bpy.app.handlers.render_pre, bpy.app.handlers.render_post)
    for moment in moments:
        moment.append(look)
    try:
        bpy.ops.render.render(animation=True)
    finally:
        for moment in moments:
            moment.remove(look)
    assert len(states) == 2 * len(FRAMES) and len(set(states)) == 1
    assert len(said) == 2 * len(states) and all("Blender is rendering" in text for text in said)
    assert not locks.is_locked(), "the render is over"
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
