# SPDX-License-Identifier: GPL-3.0-or-later
"""The preset sketches and liquids as an asset library that Blender's asset browser shows.

    python scripts/make_assets.py --out out/assets --pictures docs/images/gallery

Add the folder under Edit > Preferences > File Paths > Asset Libraries. A sketch is dragged into
the scene and generated like any other; a liquid is dropped on a splash.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import uuid
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
from materials import LIQUIDS, pour
from PIL import Image

import liquid_splash_addon
from liquid_splash_addon.blender.scene.material import water_material
from liquid_splash_addon.blender.ui.sketch_presets import add_preset
from liquid_splash_addon.core.sketch.presets import PRESETS

FILE = "liquid_splash.blend"
CATALOGS = {
    name: uuid.uuid5(uuid.NAMESPACE_URL, f"liquid-splash/{name}")
    for name in ("Sketches", "Liquids")
}
"""Identifiers that stay, so that assets keep their catalogs from one version to the next."""

PREVIEW = 256
"""Pixels along each side of a preview."""


def main() -> None:
    """Write the library."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/assets"))
    parser.add_argument("--pictures", type=Path, default=Path("docs/images/gallery"))
    options = parser.parse_args()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    liquid_splash_addon.register()
    options.out.mkdir(parents=True, exist_ok=True)
    print(", ".join(write_library(options.out, options.pictures)))


def write_library(folder: Path, pictures: Path) -> list[str]:
    """Write the file and its catalogs to ``folder``; return the assets' names.

    pictures : folder with a picture PRESET.webp of each preset, its preview; those without get
    none.
    """
    made = [sketch_asset(name, pictures) for name in PRESETS]
    made += [liquid_asset(name) for name in LIQUIDS if name != "clay"]
    lines = ["VERSION 1", ""]
    lines += [f"{number}:Splash/{name}:{name}" for name, number in CATALOGS.items()]
    (folder / "blender_assets.cats.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    bpy.data.libraries.write(str(folder.resolve() / FILE), set(made), fake_user=True, compress=True)
    return [item.name for item in made]


def sketch_asset(name: str, pictures: Path) -> bpy.types.Object:
    """Return a preset's sketch, marked as an asset."""
    preset = PRESETS[name]
    item = add_preset(bpy.context, preset())
    item.name = preset.label
    mark(item, "Sketches", preset.about)
    picture = pictures / f"{name.lower()}.webp"
    if picture.is_file():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "preview.png"
            squared(Image.open(picture).convert("RGB")).save(path)
            with bpy.context.temp_override(id=item):
                bpy.ops.ed.lib_id_load_custom_preview(filepath=str(path))
    return item


def liquid_asset(name: str) -> bpy.types.Material:
    """Return a liquid's material, marked as an asset."""
    material = water_material().copy()
    material.name = name.title()
    pour(material, name)
    mark(material, "Liquids", f"{name.title()}, for splashes")
    return material


def mark(item: Any, catalog: str, about: str) -> None:
    """Make an asset of an object or a material."""
    item.asset_mark()
    item.asset_data.catalog_id = str(CATALOGS[catalog])
    item.asset_data.description = about
    item.asset_data.license = "GPL-3.0-or-later"
    item.asset_data.tags.new("splash", skip_if_exists=True)


def squared(picture: Image.Image) -> Image.Image:
    """Return the middle of a picture as a square preview."""
    side = min(picture.size)
    left, top = ((whole - side) // 2 for whole in picture.size)
    return picture.crop((left, top, left + side, top + side)).resize((PREVIEW, PREVIEW))


if __name__ == "__main__":
    main()
