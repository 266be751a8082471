# SPDX-License-Identifier: GPL-3.0-or-later
"""Releases: what must be true before a version is tagged, in a repository of their own."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "release.py"
PASS, FAIL = ([sys.executable, "-c", f"raise SystemExit({code})"] for code in (0, 1))
DATED = "# Changelog\n\n## 0.2.0 - 2026-12-01\n\n- Add-on: waves.\n# not a comment\n"

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


@pytest.fixture(scope="module")
def releasing() -> ModuleType:
    """Load the script."""
    spec = importlib.util.spec_from_file_location("release_script", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def git(root: Path, *arguments: str) -> str:
    """Run git and return what it prints."""
    command = ["git", "-C", str(root), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a repository whose version can be released."""
    # Neither the user's settings nor a repository in which the tests were started by a hook.
    for name in ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"):
        monkeypatch.delenv(name, raising=False)
    for name in ("GIT_CONFIG_GLOBAL", "GIT_CONFIG_SYSTEM"):
        monkeypatch.setenv(name, "/dev/null")
    for who in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{who}_NAME", "A. Tester")
        monkeypatch.setenv(f"GIT_{who}_EMAIL", "tester@example.org")
    git(tmp_path, "init", "--quiet", "--initial-branch", "main")
    (tmp_path / "blender_manifest.toml").write_text('version = "0.2.0"\n')
    (tmp_path / "CHANGELOG.md").write_text(DATED)
    commit(tmp_path)
    return tmp_path


def commit(root: Path) -> None:
    """Commit all that is there."""
    git(root, "add", "--all")
    git(root, "commit", "--quiet", "--message", "Some change")


def test_a_good_version_gets_an_annotated_tag(releasing: ModuleType, root: Path) -> None:
    assert releasing.release(root, PASS) == []
    assert git(root, "cat-file", "-t", "v0.2.0").strip() == "tag"
    assert git(root, "rev-parse", "v0.2.0^{commit}") == git(root, "rev-parse", "HEAD")
    message = git(root, "tag", "--list", "--format=%(contents)", "v0.2.0")
    assert message.startswith("Liquid Splash 0.2.0\n\n- Add-on: waves.\n# not a comment")


@pytest.mark.parametrize(
    ("changelog", "reason"),
    [
        (DATED.replace("2026-12-01", "unreleased"), "no date for 0.2.0"),
        (DATED.replace("0.2.0", "0.3.0"), "says 0.2.0, the top of CHANGELOG.md 0.3.0"),
        ("# Changelog\n", "the top of CHANGELOG.md nothing"),
        ("# Changelog\n\n## 0.2.0 - 2026-12-01\n", "says nothing of 0.2.0"),
        (DATED.replace("2026-12-01", "2026-13-01"), "month must be in 1..12"),
        (DATED.replace(" - 2026-12-01", ""), "is not 'VERSION - YYYY-MM-DD'"),
    ],
)
def test_the_changelog_must_have_the_version(
    releasing: ModuleType, root: Path, changelog: str, reason: str
) -> None:
    (root / "CHANGELOG.md").write_text(changelog)
    commit(root)
    reasons = releasing.release(root, PASS)
    assert len(reasons) == 1 and reason in reasons[0]
    assert git(root, "tag") == ""


def test_all_must_be_committed(releasing: ModuleType, root: Path) -> None:
    (root / "new.txt").write_text("new")
    assert "1 file(s) are changed" in releasing.release(root, PASS)[0]
    (root / "new.txt").unlink()
    (root / "CHANGELOG.md").write_text(DATED + "- Add-on: more.\n")
    assert "1 file(s) are changed" in releasing.release(root, PASS)[0]


def test_it_must_be_main(releasing: ModuleType, root: Path) -> None:
    git(root, "switch", "--quiet", "--create", "idea")
    assert "branch idea, not main" in releasing.release(root, PASS)[0]
    git(root, "switch", "--quiet", "--detach")
    assert "No branch" in releasing.release(root, PASS)[0]


def test_a_version_is_tagged_once(releasing: ModuleType, root: Path) -> None:
    assert releasing.release(root, PASS) == []
    assert "v0.2.0 exists" in releasing.release(root, PASS)[0]


def test_failing_tests_are_no_release(releasing: ModuleType, root: Path) -> None:
    assert "tests failed" in releasing.release(root, FAIL)[0]
    assert git(root, "tag") == ""


def test_tests_must_leave_the_checkout_as_it_is(releasing: ModuleType, root: Path) -> None:
    writes = [sys.executable, "-c", "open('left.txt', 'w')"]
    assert "while the tests ran" in releasing.release(root, writes)[0]
    (root / "left.txt").unlink()
    commits = ["git", "commit", "--quiet", "--allow-empty", "--message", "Sneaked in"]
    assert "Another commit" in releasing.release(root, commits)[0]
    assert git(root, "tag") == ""
