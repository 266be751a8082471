# SPDX-License-Identifier: GPL-3.0-or-later
"""Make splashes of files of strokes, without Blender: for scripts and render farms.

Every input becomes a splash for each seed. One that cannot be made is said, and does not keep the
others from being made.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

from . import api
from .core.mesh_files import KINDS as MESH_KINDS
from .core.mesh_files import mesh_kind
from .core.refinement.settings import KINDS, RefinementSettings
from .core.settings import LATENT_SEED_MAX
from .core.stroke_files.reading import read_recording

EXIT_CODES = """exit codes:
  0  all splashes were written
  1  some were not: a line says why for each
  2  the command line is wrong
  3  no splash can be made on this machine: a package, the network or the device is missing
"""

SEVERAL_VARIATION = 1.0
"""Variation where several seeds are wanted and none is given: without, all would be the same."""


class Task(NamedTuple):
    """One splash to make: of which file, with which seed, and where to write it."""

    source: Path
    seed: int
    out: Path


def parser(program: str) -> argparse.ArgumentParser:
    """Return the parser of the command line; every field of SplashSettings is an option."""
    made = argparse.ArgumentParser(
        prog=program, description=__doc__, epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = made.add_argument
    add("strokes", nargs="*", type=Path, help="files of strokes: .csv, .json, .tilt or .apa")
    add(
        "--out",
        type=Path,
        metavar="FILE",
        help=f"file to write: {', '.join(MESH_KINDS)}. Where there are several splashes, each gets "
        "the name of its input and its seed before the ending",
    )
    add("--seeds", type=positive, default=1, metavar="N", help="splashes for each input")
    add(
        "--refine",
        action="append",
        default=[],
        metavar="NAME[:SETTING=VALUE,...]",
        help="a preset or a refinement, see --list-refinements; several are done in order",
    )
    add("--weights", type=Path, metavar="FILE", help="another network than the bundled one")
    add(
        "--precision",
        default="",
        metavar="FORMAT",
        help="number format: float32, bfloat16, int8, int8_bfloat16. Default: the fastest here; "
        "name one for the same splash everywhere",
    )
    add("--skip-existing", action="store_true", help="leave files that are there as they are")
    add("--quiet", action="store_true", help="say only what went wrong")
    add("--list-refinements", action="store_true", help="list what --refine takes, and stop")
    add("--version", action="version",
        version=f"Liquid Splash {api.__version__}, interface {api.API_VERSION}")  # fmt: skip
    group = made.add_argument_group("settings of the splash, as in Blender")
    for item in fields(api.SplashSettings):
        if item.name != "use_modifiers":  # of objects in Blender
            group.add_argument(f"--{item.name.replace('_', '-')}", **option(item))
    return made


def option(item: Any) -> dict[str, Any]:
    """Return what makes an option of a setting; None stands for its default."""
    about = item.metadata["description"].replace("%", "%%")
    found: dict[str, Any] = {"default": None, "help": f"{about} (default {item.default})"}
    if "items" in item.metadata:
        return found | {"choices": [name for name, _, _ in item.metadata["items"]]}
    if isinstance(item.default, bool):
        return found | {"action": "store_true"}
    return found | {"type": type(item.default), "metavar": "X"}


def positive(text: str) -> int:
    """Return a whole number of at least 1. Raises ValueError."""
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def main(arguments: Sequence[str], program: str = "python -m liquid_splash_addon") -> int:
    """Do what a command line says and return its exit code, see EXIT_CODES."""
    read = parser(program)
    options = read.parse_args(arguments)
    if options.list_refinements:
        sys.stdout.write(refinement_list())
        return 0
    try:
        check(options)
        settings = settings_of(options)
        steps = [step for text in options.refine for step in refinement_steps(text)]
        tasks = planned(options)
    except (TypeError, ValueError) as error:
        read.error(str(error))  # ends with exit code 2
    try:
        api.check_packages()
        api.generator_of(options.weights, options.device or "AUTO", options.precision)
    except (api.PackageError, ValueError, OSError) as error:
        return failed(str(error), 3)
    return make_all(tasks, settings, steps, options)


def check(options: argparse.Namespace) -> None:
    """Raise ValueError where something is missing from the command line."""
    if not options.strokes:
        raise ValueError("name at least one file of strokes")
    if options.out is None:
        raise ValueError("name the file to write with --out")
    mesh_kind(options.out)
    if not options.out.parent.is_dir():
        raise ValueError(f"there is no folder {options.out.parent}: make it first")
    last = (options.seed or 0) + options.seeds - 1
    if last > LATENT_SEED_MAX:
        raise ValueError(f"seeds end at {LATENT_SEED_MAX}: begin with a smaller --seed")


def settings_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that were given, checked. Raises ValueError."""
    names = [item.name for item in fields(api.SplashSettings)]
    given = {name: getattr(options, name, None) for name in names}
    given = {name: value for name, value in given.items() if value is not None}
    if options.seeds > 1:
        given.setdefault("variation", SEVERAL_VARIATION)
    api.splash_settings(**given)
    return given


def refinement_steps(text: str) -> list[RefinementSettings]:
    """Return the refinements that ``NAME[:SETTING=VALUE,...]`` means. Raises ValueError."""
    name, _, rest = text.partition(":")
    if not rest:
        return api.refinements(name)
    kind = type(api.refinement(name))
    types: dict[str, type[Any]] = {item.name: type(item.default) for item in fields(kind)}
    values = {}
    for pair in rest.split(","):
        setting, _, value = pair.partition("=")
        if setting not in types:
            raise ValueError(f"{name} has no setting {setting!r}: it has {', '.join(types)}")
        try:
            values[setting] = types[setting](value)
        except ValueError:
            raise ValueError(f"{name}: {setting} must be a number, not {value!r}") from None
    return [kind(**values)]


def refinement_list() -> str:
    """Return the names that ``--refine`` takes, those of presets and of single refinements."""
    lines = [f"{name:10} {about}\n" for name, about in api.REFINEMENTS.items()]
    lines.append("\nSettings of single refinements:\n")
    for name in api.REFINEMENTS:
        if name in KINDS:
            items = fields(KINDS[name])
            known = ", ".join(f"{item.name}={item.default:g}" for item in items)
            lines.append(f"{name:10} {known}\n")
    return "".join(lines)


def planned(options: argparse.Namespace) -> list[Task]:
    """Return what is to be made, in the order of the inputs, each under a name of its own."""
    first, count = options.seed or 0, options.seeds
    digits = len(str(first + count - 1))
    tasks = []
    for source, name in zip(options.strokes, unlike_names(options.strokes), strict=True):
        for seed in range(first, first + count):
            parts = [options.out.stem]
            parts += [name] if len(options.strokes) > 1 else []
            parts += [f"{seed:0{digits}}"] if count > 1 else []
            out = options.out.with_name("_".join(parts) + options.out.suffix)
            tasks.append(Task(source, seed, out))
    return tasks


def unlike_names(sources: Sequence[Path]) -> Iterator[str]:
    """Yield a name for each input: its own, with a number where several are called the same."""
    used: set[str] = set()
    for source in sources:
        name, number = source.stem, 1
        while name in used:
            number += 1
            name = f"{source.stem}-{number}"
        used.add(name)
        yield name


def make_all(
    tasks: Sequence[Task], settings: dict[str, Any], steps: Sequence[Any], options: Any
) -> int:
    """Make the splashes one after another; return the exit code."""
    bad = 0
    read: dict[Path, list[api.Drawing] | None] = {}
    for number, task in enumerate(tasks, start=1):
        if options.skip_existing and task.out.exists():
            say(options, f"{task.out}: there already")
            continue
        if task.source not in read:
            read = {task.source: read_source(task.source)}  # only the last one is kept
        drawings = read[task.source]
        made = drawings is not None and make_one(
            task, drawings, settings, steps, options, f"[{number}/{len(tasks)}]"
        )
        bad += not made
    if bad:
        return failed(f"{bad} of {len(tasks)} splashes were not made", 1)
    return 0


def read_source(path: Path) -> list[api.Drawing] | None:
    """Return the strokes of a file; None where there are none, which is said."""
    try:
        recording = read_recording(path)
    except api.StrokeFileError as error:  # it names the file
        failed(str(error), 1)
        return None
    except OSError as error:
        failed(f"{path}: {error.strerror or error}", 1)
        return None
    for warning in recording.warnings:
        warn(f"{path.name}: {warning}")
    return recording.drawings


def make_one(
    task: Task, drawings: Sequence[api.Drawing], settings: dict[str, Any], steps: Sequence[Any],
    options: argparse.Namespace, count: str,
) -> bool:  # fmt: skip
    """Make and write one splash; return whether that went well. What went wrong is said."""

    def report(stage: str, share: float) -> None:
        say(options, f"{count} {task.out.name}: {share:4.0%} {stage}")

    try:
        splash = api.make_splash(
            drawings, steps, weights=options.weights, precision=options.precision, report=report,
            **{**settings, "seed": task.seed},
        )  # fmt: skip
        splash.save(task.out)
    except MemoryError:
        failed(f"{task.out}: too little memory: choose a lower --resolution", 1)
        return False
    except OSError as error:
        failed(f"{task.out} cannot be written: {error.strerror or error}", 1)
        return False
    except (ValueError, RuntimeError) as error:  # torch: too little memory on a graphics card
        failed(f"{task.source.name}, seed {task.seed}: {first_line(error)}", 1)
        return False
    for warning in splash.warnings:
        warn(f"{task.out.name}: {warning}")
    say(options, f"{count} {task.out}: {len(splash.faces):,} faces")
    return True


def first_line(error: Exception) -> str:
    """Return the beginning of an error's message."""
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def say(options: argparse.Namespace, text: str) -> None:
    """Tell how far it is, unless that is not wanted."""
    if not options.quiet:
        sys.stderr.write(f"{text}\n")


def warn(text: str) -> None:
    """Tell what is not as it should be; the splash is made."""
    sys.stderr.write(f"warning: {text}\n")


def failed(text: str, code: int) -> int:
    """Tell what could not be done, and return the exit code for that."""
    sys.stderr.write(f"error: {text}\n")
    return code
