# SPDX-License-Identifier: GPL-3.0-or-later
"""Random things that artists do to random scenes.

python -m tests.blender.scene_fuzzer FIRST COUNT [--seconds S] [--out FILE]

Runs sequences by their seeds, in Blender's module, for some seconds at most. FILE gets what came of
them, as JSON, for docs/reliability.md.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.blender.fuzzed_file import InFile
from tests.blender.fuzzed_sketch import OnSketch
from tests.blender.fuzzed_splash import OnSplash


class Fuzz(OnSketch, OnSplash, InFile):
    """All that is done."""


class Outcome(NamedTuple):
    """What came of a sequence.

    Attributes
    ----------
    fault : what went wrong, "" for nothing
    done : the names of its operations
    is_placed : whether the splash could be made at the end and was found on its sketch
    """

    fault: str
    done: list[str]
    is_placed: bool


def play(seed: int, names: Sequence[str] | None = None) -> Outcome:
    """Run one sequence, of these operations or those that follow from its seed."""
    fuzz = None
    try:
        fuzz = Fuzz(seed)
        fuzz.run(names)
    except Exception as error:
        done = [] if fuzz is None else fuzz.done
        return Outcome(f"seed {seed}: {type(error).__name__}: {error} after {done}", done, False)
    return Outcome("", fuzz.done, fuzz.made_last and not fuzz.is_offset)


def run(seed: int, names: Sequence[str] | None = None) -> str:
    """Run one sequence; return what went wrong, "" for nothing."""
    return play(seed, names).fault


def shrunk(seed: int) -> str:
    """Return the fault of a sequence with as few operations as still give it."""
    outcome = play(seed)
    names = outcome.done[:]
    for number in range(len(names) - 1, -1, -1):
        fewer = names[:number] + names[number + 1 :]
        again = play(seed, fewer)
        if again.fault.split(" after ")[0] == outcome.fault.split(" after ")[0]:
            names, outcome = fewer, again
    return f"{outcome.fault}\n    of {names}"


def run_many(first: int, count: int, seconds: float) -> dict[str, object]:
    """Run sequences, print the faults, and return what came of them."""
    import bpy

    begun, outcomes = time.monotonic(), []
    for seed in range(first, first + count):
        if time.monotonic() - begun > seconds:
            break
        outcomes.append(play(seed))
        if outcomes[-1].fault:
            print(f"FAULT {shrunk(seed)}", flush=True)
    used = Counter(name for outcome in outcomes for name in outcome.done)
    return {
        "blender": bpy.app.version_string,
        "first": first,
        "sequences": len(outcomes),
        "faults": sum(bool(outcome.fault) for outcome in outcomes),
        "placed": sum(outcome.is_placed for outcome in outcomes),
        "operations": sum(used.values()),
        "kinds": len(used),
        "seconds": round(time.monotonic() - begun),
    }


def main() -> int:
    """Do what the command line says."""
    import liquid_splash_addon
    from liquid_splash_addon.blender.jobs import loaded_generator
    from tests.blender.sketching import TubeGenerator

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path)
    wanted = parser.parse_args()
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: TubeGenerator()
    came = run_many(wanted.first, wanted.count, wanted.seconds)
    print(f"fuzzer: {came}", flush=True)
    if wanted.out is not None:
        wanted.out.parent.mkdir(parents=True, exist_ok=True)
        wanted.out.write_text(json.dumps(came))
    return int(came["faults"] != 0)


if __name__ == "__main__":
    os._exit(main())
