# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for the checkout as a whole."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LICENSE_LINE = "# SPDX-License-Identifier: GPL-3.0-or-later"
LINES_MAX = 400
BYTES_MAX = 25 * 2**20
# Somebody's home folder or the checkout's own place: true on one machine only.
MACHINE_PATH = re.compile(
    rb"(?<![\w}])/(?:home/\w+|Users/\w+|root|work)/|" + re.escape(str(ROOT).encode())
)


@pytest.fixture(scope="module")
def tracked() -> list[Path]:
    """Return the files that git tracks."""
    if shutil.which("git") is None:
        pytest.skip("no git in this Python's system")
    result = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if result.returncode != 0:
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in result.stdout.split("\0") if name]
    return [path for path in paths if path.is_file()]


@pytest.fixture(scope="module")
def sources(tracked: list[Path]) -> dict[str, list[str]]:
    """Return the lines of every tracked Python file, by name."""
    return {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8").splitlines()
        for path in tracked
        if path.suffix == ".py"
    }


def test_manifest_changelog_and_citation_agree_on_the_version() -> None:
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    titles = re.findall(r"^## (.+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    # Only the topmost version may lack its day.
    assert re.fullmatch(re.escape(version) + r" - (unreleased|\d{4}-\d\d-\d\d)", titles[0])
    assert all(re.fullmatch(r"\d+\.\d+\.\d+ - \d{4}-\d\d-\d\d", title) for title in titles[1:])
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.M) == [version]


def test_changelog_entries_name_their_part() -> None:
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    entries = [line for line in lines if line.startswith("- ")]
    assert entries
    assert all(re.match(r"- (Add-on|Training|Project): ", line) for line in entries)


def test_the_readme_names_every_module(sources: dict[str, list[str]]) -> None:
    named = re.findall(r"\w+\.py", (ROOT / "README.md").read_text(encoding="utf-8"))
    modules = [
        Path(name).name
        for name in sources
        if name.startswith(("liquid_splash_addon/", "training/")) and "__init__" not in name
    ]
    assert {name for name in modules if named.count(name) < modules.count(name)} == set()


def test_every_source_has_its_licence_line(sources: dict[str, list[str]]) -> None:
    assert [name for name, lines in sources.items() if LICENSE_LINE not in lines[:2]] == []


def test_no_source_is_too_long(sources: dict[str, list[str]]) -> None:
    assert {name: len(lines) for name, lines in sources.items() if len(lines) > LINES_MAX} == {}


def test_no_tracked_file_is_too_big(tracked: list[Path]) -> None:
    assert [path.name for path in tracked if path.stat().st_size > BYTES_MAX] == []


def test_no_file_names_a_place_on_one_machine(tracked: list[Path]) -> None:
    assert [path.name for path in tracked if MACHINE_PATH.search(path.read_bytes())] == []
