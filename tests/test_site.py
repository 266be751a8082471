# SPDX-License-Identifier: GPL-3.0-or-later
"""The documentation as a site, and the page of messages."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PYTHON = ROOT / ".venv-docs" / "bin" / "python"
TOP = {"index.md", "changelog.md", "contributing.md"}
"""Pages that scripts/site_pages.py makes of those at the checkout's top."""

needs_site = pytest.mark.skipif(not PYTHON.exists(), reason="`make docs` installs what it needs")


def build(config: Path, site: Path) -> subprocess.CompletedProcess[str]:
    """Build the site strictly."""
    command = [PYTHON, "-m", "mkdocs", "build", "--strict"]
    return subprocess.run(
        [*command, "--config-file", config, "--site-dir", site], capture_output=True, text=True
    )


def test_the_navigation_has_every_page_once() -> None:
    listed = re.findall(r": ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.M)
    pages = {path.name for path in (ROOT / "docs").glob("*.md")}
    assert sorted(listed) == sorted(pages | TOP)


@needs_site
def test_the_site_is_built_without_a_warning(tmp_path) -> None:
    done = build(ROOT / "mkdocs.yml", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    home = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert 'src="images/demo.png"' in home and 'href="guide.html"' in home
    equations = (tmp_path / "how-it-works.html").read_text(encoding="utf-8")
    assert equations.count('<math xmlns="http://www.w3.org/1998/Math/MathML" display="block">') == 7
    assert "$" not in re.sub(r"<script.*?</script>", "", equations, flags=re.DOTALL)
    assert "make_splash" in (tmp_path / "reference.html").read_text(encoding="utf-8")


@needs_site
@pytest.mark.parametrize("link", ["no-such-page.md", "guide.md#no-such-heading"])
def test_a_broken_link_would_fail(link, tmp_path) -> None:
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "start.md").write_text(f"# Start\n\n[a link]({link})\n", encoding="utf-8")
    (docs / "guide.md").write_text("# Guide\n", encoding="utf-8")
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    text = text.split("nav:\n  - Home")[0].replace("hooks: [scripts/site_pages.py]", "")
    (tmp_path / "mkdocs.yml").write_text(text, encoding="utf-8")
    done = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert done.returncode != 0 and link.partition("#")[0] in done.stdout + done.stderr


def sentences() -> str:
    """Return all texts in the add-on's sources; what is filled in is left out."""
    found = []
    for path in (ROOT / "liquid_splash_addon").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return "\n".join(found)


def test_the_page_of_messages_quotes_what_is_said() -> None:
    page = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")
    quoted = re.findall(r"^\| `([^`]+)` \|", page, re.M)
    said = sentences()
    assert len(quoted) > 20
    assert [text for text in quoted if text not in said] == []
