# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in a process of its own, without bpy: compiling ahead, or a job of a module of core.

One line of JSON comes in: ``path`` (Blender's ``sys.path``), ``package`` (the add-on's name in
Blender), ``folder`` (its place) and ``kept`` (the folder of compiled code, if it is ours), perhaps
``gives_way`` (whether all else goes first); for a job also ``module`` (in the package,
``.core. ...``), whose ``work(job, say)`` is called, and ``job``. Out go lines of JSON, with
``stage`` and ``share``, ``reached`` or, last of all, ``failed``. The process ends when its input
does, as Blender's end ends it.
"""

import importlib
import json
import os
import sys
import threading
import types

NICENESS = 10
"""Added to what Blender has once all is there that a user may wait for: all else goes first."""

STARTED_AT = os.nice(0) if hasattr(os, "nice") else 0
"""What Blender has."""

LAST_AWAITED = "refined"
"""The stage of core's compiled_code after which no splash waits for this process any more."""


def main() -> int:
    """Do what is ordered, or rehearse; return the exit code."""
    order = json.loads(sys.stdin.readline())
    threading.Thread(target=end_with_parent, daemon=True).start()
    if order.get("gives_way"):
        give_way()
    sys.path[:] = order["path"]
    stand_in(order["package"], order["folder"])
    try:
        importlib.import_module(order["package"] + ".core.compiled_code").share(order["kept"])
        if "module" in order:
            module = importlib.import_module(order["package"] + order["module"])
            return int(module.work(order["job"], say))
        importlib.import_module(order["package"] + ".core.rehearsal").rehearse(report, reached)
    except (Exception, MemoryError) as error:
        say(failed=f"{type(error).__name__}: {error}")
        return 1
    # What was not kept is no reason to try again and again, but is to be said.
    say(note=importlib.import_module(order["package"] + ".core.compiled_code").note())
    return 0


def end_with_parent() -> None:
    """Wait for the end of the input, which comes with Blender's end, however it comes."""
    sys.stdin.read()
    os._exit(1)


def stand_in(package: str, folder: str) -> None:
    """Make the package and those around it importable, without running what is in them.

    Compiled code is bound to the names of its modules, and the add-on itself needs bpy.
    """
    parts = package.split(".")
    for count in range(1, len(parts) + 1):
        name = ".".join(parts[:count])
        module = types.ModuleType(name)
        module.__path__ = [folder] if name == package else []
        sys.modules[name] = module


def report(stage: str, share: float) -> None:
    """Tell Blender how far it is."""
    say(stage=stage, share=share)


def reached(stage: str) -> None:
    """Tell Blender that all is compiled that this stage needs."""
    say(reached=stage)
    if stage == LAST_AWAITED:
        give_way()


def give_way() -> None:
    """Let all else go first. On Windows the parent chose the priority."""
    if hasattr(os, "nice"):
        os.nice(STARTED_AT + NICENESS - os.nice(0))


def say(**values: object) -> None:
    """Write a line of JSON."""
    sys.stdout.write(json.dumps(values) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)  # not by sys.exit: threads of torch may hold it up
