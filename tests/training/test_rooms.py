# SPDX-License-Identifier: GPL-3.0-or-later
"""Training's rooms import one way only, and no two files import each other."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = (
    "scenes",
    "measures",
    "figures",
    "data",
    "simulation",
    "learning",
    "evaluation",
    "research",
)
"""A room imports only those before it."""


def module_name(path: Path) -> str:
    """Return a file's dotted name; a package's is its ``__init__``'s."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_name(path): path for path in sorted((ROOT / "training").rglob("*.py"))}


def imported(name: str) -> set[str]:
    """Return the modules of training that one imports, anywhere in it."""
    path, found = MODULES[name], set()
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level]
            base = ".".join([*(above if node.level else []), *filter(None, [node.module])])
            names = [base, *(f"{base}.{alias.name}" for alias in node.names)]
        else:
            continue
        found |= {other for other in names if other in MODULES}
    return {other for other in found if MODULES[other].name != "__init__.py"} - {name}


def room_of(name: str) -> str:
    """Return the room of a module, "" for those below all rooms."""
    parts = name.split(".")
    return parts[1] if len(parts) > 2 else ""


@pytest.mark.parametrize("name", [name for name in MODULES if room_of(name)])
def test_a_room_imports_only_rooms_before_it(name):
    allowed = {"", *ROOMS[: ROOMS.index(room_of(name)) + 1]}
    assert {other for other in imported(name) if room_of(other) not in allowed} == set()


def test_no_files_import_each_other_in_a_circle():
    graph = {name: imported(name) for name in MODULES}
    assert sum(map(len, graph.values())) > 100  # the search finds imports
    TopologicalSorter(graph).prepare()


def test_what_lies_below_all_rooms_imports_none():
    below = [name for name in MODULES if not room_of(name)]
    assert [name for name in below if any(map(room_of, imported(name)))] == []
