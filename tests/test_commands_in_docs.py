# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands and scripts that the pages show: all of them are ones that there are.

A block without a language holds commands for a terminal; all other blocks name their language.
"""

import contextlib
import importlib
import io
import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

pytest.importorskip("torch")

import build
from liquid_splash_addon import command_line
from training.__main__ import COMMANDS
from training.__main__ import main as training

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`((?:make|torchrun|python) [^`]+)`")
INSTALL = ["--command", "extension", "install-file", "-r", "user_default", "-e"]
"""tests/blender/test_extension.py installs the zip so."""


class Command(NamedTuple):
    """A command, and the page that shows it."""

    page: str
    line: str


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a page that are in a language; "" for commands."""
    found = BLOCK.findall(page.read_text(encoding="utf-8"))
    return [text for name, text in found if name == language]


def commands_of(block: str) -> Iterator[str]:
    """Yield the commands of a block, on one line each, without comments and with variables set."""
    known: dict[str, str] = {}
    for line in re.sub(r"\\\n\s*", " ", block).splitlines():
        line = re.sub(r"(^|\s)#.*$", "", line).strip()
        for name, value in known.items():
            line = line.replace(f"${name}", value)
        if assigned := re.fullmatch(r'(\w+)="(.*)"', line):
            known[assigned[1]] = assigned[2]
        elif line:
            yield line


def all_commands() -> list[Command]:
    """Return the commands of all pages: those in blocks, and those within sentences."""
    found = []
    for page in PAGES:
        lines = [line for block in blocks(page, "") for line in commands_of(block)]
        prose = BLOCK.sub("", page.read_text(encoding="utf-8"))
        # Of a name that stands for all of its kind nothing can be said.
        inline = [" ".join(text.split()) for text in INLINE.findall(prose)]
        lines += [line for line in inline if not re.search(r"\bCOMMAND\b|-c ", line)]
        found += [Command(page.name, line) for line in lines]
    return found


@cache
def options_of(name: str) -> set[str]:
    """Return the options of a training command, as its help lists them."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), pytest.raises(SystemExit) as end:
        training([name, "--help"])
    assert end.value.code == 0
    return set(re.findall(r"(?<![\w-])--[a-z][\w-]*", said.getvalue()))


def check_make(words: list[str]) -> None:
    """Check targets against the Makefile, variables against what its head describes."""
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.M))
    variables = set(re.findall(r"^# ([A-Z_]+) ", MAKEFILE, re.M))
    for word in words:
        name, is_variable, _ = word.partition("=")
        assert name in (variables if is_variable else targets), word


def check_training(words: list[str]) -> None:
    """Check a training command and the names of its options."""
    if not words:  # the list of commands
        return
    name, *rest = words
    assert name in COMMANDS
    given = {word.partition("=")[0] for word in rest if word.startswith("--")}
    assert given <= options_of(name)


def check_addon(words: list[str]) -> None:
    """Let the command line itself read its arguments."""
    parsed = command_line.parser("test").parse_args(words)
    command_line.settings_of(parsed)
    for text in parsed.refine:
        command_line.refinement_steps(text)


def check_python(words: list[str]) -> None:
    """Check a module or script that Python is to run."""
    match words:
        case ["-m", "training", *rest]:
            check_training(rest)
        case ["-m", "liquid_splash_addon", *rest]:
            check_addon(rest)
        case ["-m", "pip", "install", "--requirement", path]:
            assert (ROOT / path).is_file()
        case ["-m", module, *_] if module.startswith("tests."):
            assert (ROOT / f"{module.replace('.', '/')}.py").is_file()
        case ["build.py", *rest]:
            said = build.__doc__ or ""
            assert all(word in said or word == "--help" for word in rest)
        case [path, *_] if path.startswith(("scripts/", "tests/")):
            assert (ROOT / path).is_file()
        case _:
            pytest.fail("no test knows this command of Python's")


def check(line: str) -> None:
    """Check one command."""
    program, *words = shlex.split(line)
    if program == "make":
        check_make(words)
    elif program == "python":
        check_python(words)
    elif program == "torchrun":
        check_python(words[words.index("-m") :])
    elif program == "blender":
        assert words[: len(INSTALL)] == INSTALL
    elif program == "git":
        assert words[0] == "push"
    else:
        pytest.fail("a block without a language holds commands that the tests know")


@pytest.mark.parametrize("command", all_commands(), ids=lambda c: f"{c.page}: {c.line}"[:120])
def test_a_command_of_a_page_is_one_that_there_is(command: Command) -> None:
    check(command.line)


@pytest.mark.parametrize(
    "line",
    [
        "make no-such-target",
        "make zip NO_SUCH=1",
        "python -m training no-such-command",
        "python -m training train DATA --no-such-option 3",
        "python -m liquid_splash_addon a.csv --out b.ply --refine FOAM",
        "python -m no_such_module",
        "python scripts/no_such_script.py",
        "rm -rf /",
    ],
)
def test_a_stale_command_would_be_found(line: str) -> None:
    with pytest.raises((AssertionError, SystemExit, ValueError, pytest.fail.Exception)):
        check(line)


SCRIPTS = [(page.name, text) for page in PAGES for text in blocks(page, "python")]


@pytest.mark.parametrize(("page", "text"), SCRIPTS, ids=[name for name, _ in SCRIPTS])
def test_a_script_of_a_page_imports_what_there_is(page: str, text: str) -> None:
    compile(text, page, "exec")
    installed = re.findall(
        r"^from (?:bl_ext\.user_default\.liquid_splash|liquid_splash_addon)(\S*) import (.+)$",
        text, re.M,
    )  # fmt: skip
    for module, names in installed:
        found = importlib.import_module(f"liquid_splash_addon{module}")
        for name in names.split(", "):
            if not hasattr(found, name):
                importlib.import_module(f"liquid_splash_addon{module}.{name}")
