# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that exports a splash to Mantaflow, whatever is in its way."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import bake_mantaflow, export_mantaflow, loaded_generator
from liquid_splash_addon.blender.jobs.export_mantaflow import reason_to_export
from liquid_splash_addon.blender.scene import fluid_domain
from liquid_splash_addon.blender.scene.objects import SceneError
from liquid_splash_addon.core.liquid.fields import AIR, Fields
from liquid_splash_addon.core.mantaflow.cache_files import data_path, has_frame
from tests.blender.manta_module import mend
from tests.blender.sketching import TubeGenerator, add_sketch, fan, generate

pytestmark = pytest.mark.usefixtures("thick_drafts")


@pytest.fixture
def splash():
    """Return an active splash whose exports are small."""
    mend()
    add_sketch(fan())
    item = generate()
    bpy.context.view_layer.objects.active = item
    settings = bpy.context.scene.splash_mantaflow.settings
    settings.resolution, settings.frames, settings.mesh = 40, 2, False
    return item


def export(item) -> bpy.types.Object:
    """Export a splash by the button and return its domain."""
    bpy.context.view_layer.objects.active = item
    assert bpy.ops.splash.mantaflow_export() == {"FINISHED"}
    return fluid_domain.domain_of(item, bpy.context.scene)


def reason(domain) -> str:
    """Return why a domain is to be exported again."""
    return reason_to_export(domain, bpy.context.scene)


def test_export_bake_and_verify(splash):
    bpy.context.scene.splash_mantaflow.settings.mesh = True
    domain = export(splash)
    fluid, group = fluid_domain.settings_of(domain), domain.splash_domain
    assert fluid.time_scale == pytest.approx(0.05)
    assert "temporary folder" in group.warnings, "the file was never saved"
    assert reason(domain) == ""
    assert bpy.ops.splash.mantaflow_bake() == {"FINISHED"}
    assert bake_mantaflow.last_frame(domain) == 3
    numbers = [part.split()[-1] for part in group.verified.split(", ")]
    assert 0.95 <= float(numbers[0]) <= 1.05
    assert float(numbers[1]) > 0.95
    assert float(numbers[4].strip("%")) == pytest.approx(100, abs=5)
    assert splash.hide_render and splash.hide_viewport
    for frame in (1, 3):  # the first one is meshed too
        bpy.context.scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        assert len(domain.evaluated_get(graph).data.vertices) > 100
        assert reason(domain) == ""


def test_resumed_after_it_was_stopped(splash):
    domain = export(splash)
    assert bpy.ops.splash.mantaflow_bake() == {"FINISHED"}
    cache = bake_mantaflow.cache_of(domain)
    first = data_path(cache, "pp", 2).read_bytes()
    for path in (cache / "data").glob("*_0003*"):
        path.unlink()
    fluid_domain.settings_of(domain).cache_frame_pause_data = 2
    assert bake_mantaflow.last_frame(domain) == 2
    assert bpy.ops.splash.mantaflow_bake() == {"FINISHED"}
    assert bake_mantaflow.last_frame(domain) == 3
    assert len(data_path(cache, "pp", 2).read_bytes()) > 0.5 * len(first)


def test_exported_again_it_is_the_same_domain_and_changes_are_noticed(splash):
    domain = export(splash)
    cache = domain.splash_domain.cache
    fluid_domain.settings_of(domain).resolution_max = 44
    assert "not there any more" in reason(domain)
    with pytest.raises(RuntimeError, match="use Export Again first"):
        bpy.ops.splash.mantaflow_bake()
    assert export(splash) == domain
    assert (reason(domain), domain.splash_domain.cache) == ("", cache)
    splash.location.x += 1
    bpy.context.view_layer.update()
    assert "splash" in reason(domain)
    assert export(splash) == domain
    assert sum(1 for item in bpy.data.objects if fluid_domain.settings_of(item)) == 1


def test_two_exports_copies_and_deleted_domains(splash):
    domain = export(splash)
    other = splash.copy()
    other.data = splash.data.copy()
    bpy.context.scene.collection.objects.link(other)
    second = export(other)
    assert second != domain
    caches = {bake_mantaflow.cache_of(item) for item in (domain, second)}
    assert len(caches) == 2 and all(has_frame(cache, 1) for cache in caches)
    copy = domain.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert "copy" in reason(copy)
    assert reason(domain) == ""
    bpy.data.objects.remove(domain)
    third = export(splash)
    assert third not in (second, copy)
    assert bake_mantaflow.cache_of(third) not in caches
    bpy.data.objects.remove(other)
    assert "deleted" in reason(second)


def test_the_cache_lies_beside_a_saved_file(splash, tmp_path):
    temporary = Path(export(splash).splash_domain.cache)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    domain = export(splash)
    cache = bake_mantaflow.cache_of(domain)
    assert tmp_path in cache.parents and temporary != cache
    assert has_frame(cache, 1) and "temporary" not in domain.splash_domain.warnings
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    domain = bpy.data.objects[fluid_domain.NAME]
    assert reason(domain) == ""


def test_a_splash_from_another_file_can_be_exported(splash, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    name = splash.name
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.objects = [name]
    (linked,) = into.objects
    bpy.context.scene.collection.objects.link(linked)
    bpy.context.scene.splash_mantaflow.settings.resolution = 40
    assert has_frame(bake_mantaflow.cache_of(export(linked)), 1)


def test_what_cannot_be_exported_is_said_and_nothing_is_lost(splash, tmp_path):
    domain = export(splash)
    cache = bake_mantaflow.cache_of(domain)
    before = data_path(cache, "vel", 1).read_bytes()
    settings = domain.splash_domain.settings
    settings.resolution = 1024
    with pytest.raises(RuntimeError, match="GB are free: set Resolution to"):
        bpy.ops.splash.mantaflow_export()
    settings.resolution = 40
    assert data_path(cache, "vel", 1).read_bytes() == before
    assert reason(domain) == ""
    (tmp_path / "file").write_text("")
    fluid_domain.settings_of(domain).cache_directory = str(tmp_path / "file")
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.splash.mantaflow_export()
    bpy.context.view_layer.objects.active = None
    assert not bpy.ops.splash.mantaflow_export.poll()


class Bursting(TubeGenerator):
    """A ball whose liquid flies apart at once: all of that is divergence."""

    def generate(self, condition, grid, *_inputs):
        centres = np.stack(np.meshgrid(*(np.arange(n) - n / 2 for n in grid.shape), indexing="ij"))
        away = np.linalg.norm(centres, axis=0) - 8
        distance = np.clip(away, -AIR, AIR).astype(np.float32)
        velocity = (0.2 * centres).astype(np.float32)
        return Fields(1 / (1 + np.exp(2 * distance)), distance, velocity, grid)


def test_motion_that_the_solver_removes_is_told(splash, monkeypatch):
    monkeypatch.setattr(loaded_generator, "get", lambda *_: Bursting())
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    bpy.context.scene.splash_mantaflow.settings.divergence_free = False
    said = export(splash).splash_domain.warnings
    assert "Switch on Divergence-Free: the solver's first step will remove" in said


def test_too_much_gravity_is_refused(splash):
    bpy.context.scene.gravity = (0, 0, -1e-3)
    with pytest.raises(RuntimeError, match="Scale the splash down, or lower Gravity: at"):
        bpy.ops.splash.mantaflow_export()


def test_what_is_linked_cannot_be_set(splash, tmp_path):
    export(splash)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.active_object.name = "Rock"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    name = bpy.context.scene.name
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.scenes = [name]
    (scene,) = into.scenes
    domain = scene.objects[fluid_domain.NAME]
    with pytest.raises(SceneError, match=f"The domain '{domain.name}' is linked from another"):
        fluid_domain.check_usable(domain)
    linked = domain.splash_domain.source
    bpy.data.objects.remove(domain)
    with pytest.raises(SceneError, match=f"The scene '{scene.name}' is linked from another file"):
        export_mantaflow.read_task(SimpleNamespace(scene=scene), linked, "cache")
    collection = bpy.data.collections.new("Obstacles")
    collection.objects.link(scene.objects["Rock"])
    bpy.context.scene.collection.children.link(collection)
    bpy.context.view_layer.update()
    around = SimpleNamespace(splash_obstacles=SimpleNamespace(collection=collection))
    said = fluid_domain.add_effectors(around)
    assert "Obstacle 'Rock' is linked, so it cannot be an effector: make it" in said[0]


def test_obstacles_become_effectors_and_inflows_stay(splash):
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0.6, 0, 0))
    cube = bpy.context.object
    collection.objects.link(cube)
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(2, 0, 0))
    inflow = bpy.context.object
    modifier = inflow.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "FLOW"
    modifier.flow_settings.flow_behavior = "INFLOW"
    collection.objects.link(inflow)
    splash.splash_obstacles.collection = collection
    export(splash)
    assert cube.modifiers[0].fluid_type == "EFFECTOR"
    assert [modifier.fluid_type for modifier in inflow.modifiers] == ["FLOW"]
    export(splash)
    assert len(cube.modifiers) == 1
