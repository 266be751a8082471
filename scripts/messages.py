# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the list of docs/messages.md anew: every message that an artist can get, from the sources.

    python -m scripts.messages              the list
    python -m scripts.messages --unnamed    prints the messages that no test names

A message is what an error of ours says, what an operator reports, why a button is grey, or a
warning that a splash keeps. Words that are filled in are shown as "…".
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
ADDON = ROOT / "liquid_splash_addon"
PAGE = ROOT / "docs" / "messages.md"
BEGIN, END = "<!-- messages: make messages writes them -->\n", "<!-- end of messages -->\n"

ERRORS = ("StrokeError", "SceneError", "WeightsError", "PackageError", "FileError")
"""Errors whose words are for artists, besides those that the sources derive from ValueError."""

WARNINGS = ("warnings", "left_out", "lost")
"""Names of lists of sentences for artists, see also functions that end in _warnings."""

GAP = "…"
"""Stands for words that are filled in."""

SHORTEST = 12
"""Letters: what is shorter is a name, to be filled into other messages."""

TELLING = 9
"""Letters of a part of a message that tell it from others."""

SEAM = 6
"""Letters on either side of what is filled in."""


class Message(NamedTuple):
    """A message: its words, its kind, and the module that says it, with its line."""

    text: str
    kind: str
    module: str
    line: int


def messages() -> list[Message]:
    """List the messages of the add-on, in the order of its sources."""
    return [found for path in sorted(ADDON.rglob("*.py")) for found in messages_of(path)]


def messages_of(path: Path) -> Iterator[Message]:
    """Yield the messages of a source, each once."""
    module = path.relative_to(ADDON).with_suffix("").as_posix()
    known = set()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    own = {node.name for node in tree.body if isinstance(node, ast.ClassDef) and is_error(node)}
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    for node in ast.walk(tree):
        for kind, words in said_by(node, own | set(ERRORS)):
            for text in texts(words, functions):
                if len(text) >= SHORTEST and " " in text and text not in known:
                    known.add(text)
                    yield Message(text, kind, module, node.lineno)


def is_error(node: ast.ClassDef) -> bool:
    """Whether a class derives from an error whose words are shown."""
    return any(isinstance(base, ast.Name) and base.id == "ValueError" for base in node.bases)


def said_by(node: ast.AST, errors: set[str]) -> Iterator[tuple[str, ast.expr]]:
    """Yield the kinds and expressions of the messages that a node of the tree says."""
    if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
        if name_of(node.exc.func) in errors | {"ValueError"}:
            yield "error", node.exc.args[0]
    elif isinstance(node, ast.Call) and name_of(node.func) == "report" and len(node.args) == 2:
        if isinstance(node.args[0], ast.Set):
            (kind,) = (ast.literal_eval(item) for item in node.args[0].elts)
            yield kind.lower(), node.args[1]
    elif isinstance(node, ast.Call) and name_of(node.func) == "poll_message_set":
        yield "grey", node.args[0]
    elif isinstance(node, ast.FunctionDef) and node.name.endswith("warnings"):
        for part in ast.walk(node):
            if isinstance(part, ast.Return) and isinstance(part.value, ast.List):
                yield from (("warning", item) for item in part.value.elts)
    elif isinstance(node, ast.AugAssign) and name_of(node.target) in WARNINGS:
        if isinstance(node.value, ast.List):
            yield from (("warning", item) for item in node.value.elts)
    elif isinstance(node, ast.Call) and name_of(node.func) == "append":
        if isinstance(node.func, ast.Attribute) and name_of(node.func.value) in WARNINGS:
            yield "warning", node.args[0]


def name_of(node: ast.AST) -> str:
    """Return the last name of an expression."""
    return str(getattr(node, "attr", getattr(node, "id", "")))


def texts(node: ast.expr, functions: Mapping[str, ast.FunctionDef]) -> list[str]:
    """Return what an expression may say, with GAP for what is filled in; nothing if all of it is.

    functions : of the same source, whose results may be messages
    """
    if isinstance(node, ast.IfExp):
        return texts(node.body, functions) + texts(node.orelse, functions)
    if isinstance(node, ast.Call) and name_of(node.func) in functions:
        said = [part.value for part in ast.walk(functions[name_of(node.func)])
                if isinstance(part, ast.Return) and part.value is not None]  # fmt: skip
        return [text for value in said if value is not node for text in texts(value, {})]
    text = text_of(node)
    return [text] if text.strip(GAP + " ") else []


def text_of(node: ast.expr) -> str:
    """Return the words of an expression."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(map(text_of, node.values))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return text_of(node.left) + text_of(node.right)
    return GAP


def table(found: list[Message]) -> str:
    """Return the list as a table."""
    rows = sorted({(item.text, item.kind, item.module) for item in found}, key=order)
    lines = [f"| {shown(text)} | {kind} | `{module}` |\n" for text, kind, module in rows]
    return "| message | kind | said by |\n|---|---|---|\n" + "".join(lines)


def order(row: tuple[str, str, str]) -> tuple[str, str]:
    """Return by what rows are sorted: their first letters, whatever is filled in before them."""
    return row[0].lstrip(f"{GAP} '\"(").lower(), row[2]


def shown(text: str) -> str:
    """Return a message as a table can hold it."""
    return (
        text.strip().replace("|", "\\|").replace("\n", " ").replace("<", "&lt;").replace("*", "\\*")
    )


def page(text: str) -> str:
    """Return the page with its list replaced."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table(messages())}\n{END}{after}"


def unnamed() -> list[Message]:
    """List the messages of which no test names any part: nobody may provoke them."""
    named = {
        node.value.replace("\\", "")  # patterns quote brackets and dots
        for path in (ROOT / "tests").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    return [item for item in messages() if not any(names(part, item.text) for part in named)]


def names(part: str, text: str) -> bool:
    """Whether a test's words are those of a message: they lie in it, or span what is filled in."""
    if len(part) < TELLING:
        return False
    if part in text:
        return True
    own = text.split(GAP)
    if any(len(piece) >= TELLING and piece in part for piece in own):
        return True
    return any(
        seam(before, after).search(part) for before, after in pairwise(own) if before and after
    )


@cache
def seam(before: str, after: str) -> re.Pattern[str]:
    """Return what finds the ends of two pieces of a message with something filled in between."""
    return re.compile(f"{re.escape(before[-SEAM:])}.+?{re.escape(after[:SEAM])}")


def main() -> None:
    """Write the page, or list what no test names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--unnamed", action="store_true", help="list messages that no test names")
    if parser.parse_args().unnamed:
        for item in unnamed():
            print(f"{item.module}:{item.line}: {item.text}")
    else:
        PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
