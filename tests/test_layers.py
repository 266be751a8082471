# SPDX-License-Identifier: GPL-3.0-or-later
"""Dependencies go one way: training -> core <- blender, and within each from room to room."""

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

ROOMS = {
    "liquid_splash_addon.core": (
        "settings liquids grid scale progress packages compiled_code compiling whole_file",
        "numeric", "fluid", "sketch", "stroke_files", "condition", "liquid", "generator",
        "mesh", "obstacles", "refinement", "composition", "animation", "simulation", "playback",
        "mantaflow", "mesh_files",
        "pipeline",
        "rehearsal",
    ),
    "liquid_splash_addon.blender": ("data", "scene", "jobs", "capture", "ui"),
    "training": (
        "command_line",
        "scenes", "measures", "figures", "data", "simulation", "learning", "evaluation", "research",
    ),
}  # fmt: skip
"""The one declared order: a room imports only itself and those before it. Names on one line share
a place."""

NETWORK = {"asyncio", "ftplib", "http", "multiprocessing", "requests", "smtplib", "socket",
           "socketserver", "ssl", "urllib", "urllib3", "xmlrpc", "webbrowser"}  # fmt: skip
"""The add-on uses no network: the manifest does not ask for that permission."""

PICKLES = {"cloudpickle", "dill", "joblib", "marshal", "pickle", "shelve"}
"""What runs code that a file brings along."""

# The networks themselves. All else must import where torch is missing, for the add-on to say so.
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


def module_name(path: Path) -> str:
    """Return the dotted name of a source file below the checkout."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


MODULES = {
    module_name(path): path
    for wing in (ADDON, ROOT / "training")
    for path in sorted(wing.rglob("*.py"))
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


def imported_names(node: ast.AST, package: list[str]) -> list[str]:
    """Return the dotted names that one import statement may mean, modules and what is in them."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = package[: len(package) - node.level + 1] if node.level else []
    start = ".".join([*base, *([node.module] if node.module else [])])
    return [f"{start}.{alias.name}" for alias in node.names]


def project_imports(name: str, path: Path) -> set[str]:
    """Return the project's modules that a file imports: in functions and for types too."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        for full in imported_names(node, package):
            module = full if full in MODULES else full.rpartition(".")[0]
            if module in MODULES and module != name:
                found.add(module)
    return found


def import_graph() -> dict[str, set[str]]:
    """Return what each module of the project imports."""
    return {name: project_imports(name, path) for name, path in MODULES.items()}


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return every set of modules that reach each other, and of those that import themselves."""
    reached = {name: reachable(graph, name) for name in graph}
    found = {
        tuple(sorted(other for other in reached[name] if name in reached[other])) for name in graph
    }
    return [list(circle) for circle in found if circle]


def reachable(graph: dict[str, set[str]], start: str) -> set[str]:
    """Return what ``start`` imports, directly or not."""
    seen: set[str] = set()
    waiting = list(graph[start])
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += graph[name]
    return seen


def place(name: str, wing: str) -> int | None:
    """Return the number of a module's room in the order of its wing; None where it has none."""
    rest = name.removeprefix(f"{wing}.").split(".")[0]
    return next((n for n, rooms in enumerate(ROOMS[wing]) if rest in rooms.split()), None)


def core_modules() -> list[str]:
    """Return core's modules as dotted names below core, packages included."""
    return [name.removeprefix("liquid_splash_addon.") for name in MODULES if ".core" in name]


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


@pytest.mark.parametrize(
    "path", sorted(ADDON.rglob("*.py")), ids=lambda path: str(path.relative_to(ADDON))
)
def test_the_addon_uses_neither_network_nor_pickles(path: Path) -> None:
    assert not absolute_imports(path) & (NETWORK | PICKLES)


def test_no_modules_import_each_other_in_a_circle() -> None:
    assert circles(import_graph()) == []


@pytest.mark.parametrize("wing", ROOMS)
def test_rooms_import_only_rooms_before_them(wing: str) -> None:
    wrong = [
        f"{name} imports {other}"
        for name, imports in import_graph().items()
        for other in imports
        if name.startswith(f"{wing}.") and other.startswith(f"{wing}.")
        if (here := place(name, wing)) is not None and (there := place(other, wing)) is not None
        if there > here
    ]
    assert wrong == []


@pytest.mark.parametrize("wing", ROOMS)
def test_every_module_is_in_a_declared_room(wing: str) -> None:
    without = {
        name for name in MODULES if name.startswith(f"{wing}.") and place(name, wing) is None
    }
    assert without <= {"training.__main__"}


@pytest.mark.parametrize("wing", ROOMS)
def test_no_room_imports_from_above_its_wing(wing: str) -> None:
    """The package itself is the last to be imported, as it is what registers or starts all."""
    above = {wing, "liquid_splash_addon", "training.__main__"}
    wrong = [
        f"{name} imports {other}"
        for name, imports in import_graph().items()
        for other in imports & above
        if name.startswith(f"{wing}.")
    ]
    assert wrong == []


def test_circles_and_wrong_orders_would_be_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}, "e": {"e"}}
    assert sorted(circles(graph)) == [["a", "b", "c"], ["e"]]
    assert place("liquid_splash_addon.core.fluid.step", "liquid_splash_addon.core") == 2
    assert place("liquid_splash_addon.core.progress", "liquid_splash_addon.core") == 0
    source = "def f():\n    from ..mesh.mesh import Mesh\n    from . import volume\n"
    tree = ast.walk(ast.parse(source))
    package = ["liquid_splash_addon", "core", "liquid"]
    names = [name for node in tree for name in imported_names(node, package)]
    assert names == [
        "liquid_splash_addon.core.mesh.mesh.Mesh",
        "liquid_splash_addon.core.liquid.volume",
    ]


def test_core_imports_where_there_is_no_blender() -> None:
    names = [f"liquid_splash_addon.{name}" for name in core_modules()]
    result = import_without(BLENDER_ONLY, ["liquid_splash_addon", *names])
    assert result.returncode == 0, result.stderr


def test_core_imports_where_there_is_no_torch() -> None:
    names = [name for name in core_modules() if name.removeprefix("core.") not in TORCH_MODULES]
    names = [f"liquid_splash_addon.{name}" for name in names]
    result = import_without(BLENDER_ONLY | {"torch"}, ["liquid_splash_addon", *names])
    assert result.returncode == 0, result.stderr
