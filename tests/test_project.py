# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for the checkout as a whole."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from training.__main__ import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
ADDON = ROOT / "liquid_splash_addon"
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
LICENSE_LINE = "# SPDX-License-Identifier: GPL-3.0-or-later"
LINES_MAX = 400
README_LINES_MAX = 120
COLUMNS_MAX = 120
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


def markdown_links(path: Path) -> list[str]:
    """Return where the links and pictures of a page go, but for addresses on the web."""
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [link for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]


def anchors(path: Path) -> set[str]:
    """Return the names under which the headings of a page can be linked to."""
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    titles = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def resolves(page: Path, link: str) -> bool:
    """Whether a link on a page leads to a file of the checkout, and to a heading in it."""
    name, _, anchor = link.partition("#")
    target = page if not name else (page.parent / name).resolve()
    return target.exists() and (not anchor or anchor in anchors(target))


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


def test_the_readme_is_short() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= README_LINES_MAX


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_of_pages_lead_somewhere(page: Path) -> None:
    assert [link for link in markdown_links(page) if not resolves(page, link)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_lines_of_pages_are_short(page: Path) -> None:
    lines = page.read_text(encoding="utf-8").splitlines()
    # A row of a table, and a picture with its text, cannot be broken.
    text = [line for line in lines if not line.startswith(("|", "!["))]
    assert [line for line in text if len(line) > COLUMNS_MAX] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_name_commands_that_there_are(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert re.findall(r"-m training\.\w+", text) == []
    assert set(re.findall(r"-m training ([a-z][\w-]*)", text)) <= set(COMMANDS)
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    assert set(re.findall(r"`make ([a-z-]+)", text)) <= targets
    scripts = re.findall(r"\b((?:scripts|tests)/[\w/]+\.(?:py|sh))", text)
    assert [name for name in scripts if not (ROOT / name).is_file()] == []


def test_the_workflow_runs_targets_of_the_makefile() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    workflow = (ROOT / ".github" / "workflows" / "test.yml").read_text()
    used = re.search(r"target: \[(.+)\]", workflow)
    assert used and set(used[1].split(", ")) <= targets


def test_the_architecture_names_every_folder(tracked: list[Path]) -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = {ROOT / name for name in re.findall(r"`((?:\w+/)+)`", text)}
    # Folders of the add-on are named from there.
    named = {folder if folder.exists() else ADDON / folder.relative_to(ROOT) for folder in named}
    assert [folder for folder in named if not folder.is_dir()] == []
    rooms = {
        folder
        for path in tracked
        for folder in path.parents
        if folder.is_relative_to(ADDON) or folder.is_relative_to(ROOT / "training")
    }
    rooms |= {ROOT / name for name in ("tests", "scripts", "docs")}
    without = rooms - named - {ADDON}
    assert sorted(str(folder.relative_to(ROOT)) for folder in without) == []


def test_every_source_has_its_licence_line(sources: dict[str, list[str]]) -> None:
    assert [name for name, lines in sources.items() if LICENSE_LINE not in lines[:2]] == []


def test_no_source_is_too_long(sources: dict[str, list[str]]) -> None:
    assert {name: len(lines) for name, lines in sources.items() if len(lines) > LINES_MAX} == {}


def test_no_tracked_file_is_too_big(tracked: list[Path]) -> None:
    assert [path.name for path in tracked if path.stat().st_size > BYTES_MAX] == []


def test_no_file_names_a_place_on_one_machine(tracked: list[Path]) -> None:
    assert [path.name for path in tracked if MACHINE_PATH.search(path.read_bytes())] == []
