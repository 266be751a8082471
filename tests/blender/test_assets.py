# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library: what is in the file that Blender's asset browser reads."""

import sys
from pathlib import Path

import bpy

from liquid_splash_addon.core.sketch.presets import PRESETS

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


def test_presets_and_liquids_are_assets_with_catalogs(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(SCRIPTS), *sys.path])
    import make_assets

    names = make_assets.write_library(tmp_path, tmp_path)
    labels = {preset.label for preset in PRESETS.values()}
    assert labels < set(names) and "Milk" in names
    with bpy.data.libraries.load(str(tmp_path / make_assets.FILE), assets_only=True) as (found, _):
        assert set(found.objects) == labels
        assert {"Water", "Milk", "Wine"} <= set(found.materials)
    catalogs = (tmp_path / "blender_assets.cats.txt").read_text().splitlines()
    assert catalogs[0] == "VERSION 1"
    listed = {line.split(":")[0] for line in catalogs if line.count(":") == 2}
    items = [*bpy.data.objects, *bpy.data.materials]
    assert listed == {item.asset_data.catalog_id for item in items if item.asset_data}
    assert len(listed) == 2
