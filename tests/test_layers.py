# SPDX-License-Identifier: GPL-3.0-or-later
"""Dependencies go one way: training -> core <- blender."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ADDON = ROOT / "liquid_splash_addon"
CORE = ADDON / "core"
BLENDER_ONLY = {"bpy", "bmesh", "mathutils", "gpu", "blf"}
# Installed, the add-on is bl_ext.<repository>.liquid_splash: it cannot know itself by name.
NEVER = {"training", "liquid_splash_addon"}
# The network itself. All else must import where torch is missing, for the add-on to say so.
TORCH_MODULES = {
    "generator.bfloat16",
    "generator.generator",
    "generator.int8_conv",
    "generator.layers",
    "generator.patch_classifier",
    "generator.pixel_shuffle",
    "generator.precision",
    "generator.sparse",
    "generator.splash_unet",
}


def absolute_imports(path: Path) -> set[str]:
    """Return the top-level packages that a file imports by absolute name, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module.split(".")[0])
    return found


def core_modules() -> list[str]:
    """Return core's modules as dotted names below core, packages included."""
    paths = [path.relative_to(CORE).with_suffix("") for path in sorted(CORE.rglob("*.py"))]
    return [".".join(path.parts).removesuffix(".__init__") for path in paths]


def import_without(blocked: set[str], modules: list[str]) -> subprocess.CompletedProcess[str]:
    """Import modules in a fresh Python where those named in ``blocked`` do not exist."""
    script = (
        "import importlib, sys\n"
        f"sys.path.insert(0, {str(ROOT)!r})\n"
        f"sys.modules.update(dict.fromkeys({sorted(blocked)!r}))\n"
        f"for name in {modules!r}: importlib.import_module(name)\n"
    )
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)


@pytest.mark.parametrize(
    "path", sorted(ADDON.rglob("*.py")), ids=lambda path: path.relative_to(ADDON).as_posix()
)
def test_the_addon_imports_only_what_its_layer_may(path: Path) -> None:
    is_skin = path.is_relative_to(ADDON / "blender")
    banned = NEVER if is_skin else NEVER | BLENDER_ONLY
    assert not absolute_imports(path) & banned


def test_core_imports_where_there_is_no_blender() -> None:
    names = [
        f"liquid_splash_addon.core.{name}".removesuffix(".__init__") for name in core_modules()
    ]
    result = import_without(BLENDER_ONLY, ["liquid_splash_addon", *names])
    assert result.returncode == 0, result.stderr


def test_core_imports_where_there_is_no_torch() -> None:
    names = [name for name in core_modules() if name not in TORCH_MODULES]
    names = [f"liquid_splash_addon.core.{name}".removesuffix(".__init__") for name in names]
    result = import_without(BLENDER_ONLY | {"torch"}, ["liquid_splash_addon", *names])
    assert result.returncode == 0, result.stderr
