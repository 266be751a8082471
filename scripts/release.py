# SPDX-License-Identifier: GPL-3.0-or-later
"""Tag the version that blender_manifest.toml names, if it can be released.

    make release

It can if the checkout is on main, holds nothing that is not committed, its version is the topmost
and dated one of CHANGELOG.md, is not tagged yet, and passes the tests. The tag, v and the version,
is annotated with what the changelog says. Nothing is pushed.
"""

from __future__ import annotations

import argparse
import datetime
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
BRANCH = "main"
UNRELEASED = "unreleased"
TITLE = re.compile(r"(\d+\.\d+\.\d+) - (\S+)")


class Section(NamedTuple):
    """What the changelog says of one version; ``date`` is UNRELEASED or the day."""

    version: str
    date: str
    text: str


def changelog_sections(root: Path) -> list[Section]:
    """Return the changelog's sections, the newest first. Raises ValueError for a bad title."""
    sections = []
    for part in (root / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        title, _, text = part.partition("\n")
        found = TITLE.fullmatch(title.strip())
        if found is None:
            raise ValueError(f"CHANGELOG.md: '{title}' is not 'VERSION - YYYY-MM-DD'")
        if found[2] != UNRELEASED:
            datetime.date.fromisoformat(found[2])
        sections.append(Section(found[1], found[2], text.strip()))
    return sections


def manifest_version(root: Path) -> str:
    """Return the version of the extension."""
    version: str = tomllib.loads((root / "blender_manifest.toml").read_text())["version"]
    return version


def git(root: Path, *arguments: str, text: str | None = None) -> str:
    """Return what a git command prints. Raises CalledProcessError if it fails."""
    command = ["git", "-C", str(root), *arguments]
    done = subprocess.run(command, input=text, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.strip()


def reasons_against(root: Path) -> list[str]:
    """Return why the version cannot be released, a sentence each; the tests are not run."""
    version = manifest_version(root)
    reasons = []
    if branch := git(root, "branch", "--show-current"):
        if branch != BRANCH:
            reasons.append(f"This is the branch {branch}, not {BRANCH}.")
    else:
        reasons.append(f"No branch is checked out; it must be {BRANCH}.")
    if changed := git(root, "status", "--porcelain"):
        count = len(changed.splitlines())
        reasons.append(f"{count} file(s) are changed or not tracked: commit or remove them.")
    if git(root, "tag", "--list", f"v{version}"):
        reasons.append(f"The tag v{version} exists: raise the version in blender_manifest.toml.")
    try:
        sections = changelog_sections(root)
    except ValueError as error:
        return [*reasons, str(error)]
    if not sections or sections[0].version != version:
        top = sections[0].version if sections else "nothing"
        reasons.append(f"blender_manifest.toml says {version}, the top of CHANGELOG.md {top}.")
    elif sections[0].date == UNRELEASED:
        reasons.append(f"CHANGELOG.md has no date for {version}: put the day in the place of "
                       f"'{UNRELEASED}'.")  # fmt: skip
    elif not sections[0].text:
        reasons.append(f"CHANGELOG.md says nothing of {version}.")
    return reasons


def release(root: Path, tests: list[str]) -> list[str]:
    """Tag the version if nothing is against it; return what is, a sentence each.

    tests : command that must succeed and must leave the checkout as it is
    """
    if reasons := reasons_against(root):
        return reasons
    commit = git(root, "rev-parse", "HEAD")
    if subprocess.run(tests, cwd=root).returncode != 0:
        return [f"The tests failed: {shlex.join(tests)}"]
    if reasons := reasons_against(root):
        return ["The checkout was changed while the tests ran.", *reasons]
    if git(root, "rev-parse", "HEAD") != commit:
        return ["Another commit was checked out while the tests ran."]
    section = changelog_sections(root)[0]
    message = f"Liquid Splash {section.version}\n\n{section.text}\n"
    # The commit that was tested. Whitespace: by default lines that begin with # would be lost.
    git(root, "tag", "--annotate", f"v{section.version}", "--cleanup=whitespace", "--file=-",
        commit, text=message)  # fmt: skip
    return []


def main() -> int:
    """Release this checkout; return 1 if it cannot be."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tests", default="make test", help="command that must succeed")
    if reasons := release(ROOT, shlex.split(parser.parse_args().tests)):
        print("Not released:", *reasons, sep="\n  ", file=sys.stderr)
        return 1
    version = manifest_version(ROOT)
    print(f"Tagged v{version}. To publish it: git push origin v{version}; its zips: make zip")
    return 0


if __name__ == "__main__":
    sys.exit(main())
