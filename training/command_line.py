# SPDX-License-Identifier: GPL-3.0-or-later
"""How commands read their options. Below all rooms; imports none of them."""

from __future__ import annotations

import argparse
from dataclasses import field, fields
from typing import Any, TypeVar

Value = TypeVar("Value")

PROGRESS_BAR = "{percentage:3.0f}%|{bar}| {elapsed}<{remaining} {postfix}"
"""Format of tqdm's bar for a run that knows only which share of it is done."""


def command_parser(name: str, about: str | None) -> argparse.ArgumentParser:
    """Parser of ``python -m training NAME``.

    about : docstring of the command's module, shown as it stands
    """
    return argparse.ArgumentParser(
        prog=f"python -m training {name}",
        description=about,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def option(default: Value, about: str) -> Value:
    """Field of a dataclass that :func:`add_options` makes an option of; ``about`` is its help."""
    found: Value = field(default=default, metadata={"help": about})
    return found


def add_options(parser: argparse.ArgumentParser, config: type[Any]) -> None:
    """Add a dataclass's fields as options, with their defaults."""
    for item in fields(config):
        about = f"{item.metadata['help']} (default {item.default})"
        name = f"--{item.name.replace('_', '-')}"
        parser.add_argument(name, type=type(item.default), default=item.default, help=about)


def read_options(args: argparse.Namespace, config: type[Any]) -> Any:
    """Return the dataclass that the options of :func:`add_options` describe."""
    return config(**{item.name: getattr(args, item.name) for item in fields(config)})
