# SPDX-License-Identifier: GPL-3.0-or-later
"""Hooks of mkdocs.yml: the pages at the checkout's top, and equations.

The pages are written to be read in the checkout too. So those at the top become pages of the site
here, links are changed to lead to them, and equations ($$ ... $$) become MathML, which browsers
show without any script.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]

TOP = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "LICENSE": "LICENSE.txt",
    "CITATION.cff": "CITATION.cff",
}
"""Names on the site of files at the checkout's top."""

EQUATION = re.compile(r"\$\$(.+?)\$\$", re.DOTALL)
INLINE = re.compile(r"\$`(.+?)`\$")
"""As GitHub reads it: a dollar alone would be taken for money."""


def on_files(files: Files, config: Any) -> Files:
    """Add the files at the top."""
    for name, there in TOP.items():
        files.append(File.generated(config, there, abs_src_path=str(ROOT / name)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return a page with its links and equations as the site needs them."""
    is_top = page.file.src_uri in TOP.values()
    for name, there in TOP.items():
        before = "" if is_top else "../"
        markdown = re.sub(rf"\]\({re.escape(before + name)}(?=[)#])", f"]({there}", markdown)
    if is_top:
        markdown = markdown.replace("](docs/", "](")
    markdown = EQUATION.sub(lambda found: mathml(found[1], "block"), markdown)
    return INLINE.sub(lambda found: mathml(found[1], "inline"), markdown)


def mathml(text: str, display: str) -> str:
    """Return an equation of LaTeX as MathML."""
    return str(convert(" ".join(text.split()), display=display))
