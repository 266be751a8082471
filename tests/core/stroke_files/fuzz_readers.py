# SPDX-License-Identifier: GPL-3.0-or-later
"""Feed mutated files to the readers, guided by the code that they reach (libFuzzer, by atheris).

    python tests/core/stroke_files/fuzz_readers.py --kind tilt --runs 5000 --out fuzz.json

A StrokeFileError is an answer; any other error, 5 s for a file, or 500 MB end the run with the file
that did it, in the folder of ``--out``. It is libFuzzer that ends the process, so what was measured
is written while it runs. ``sketch`` mutates what is inside a .tilt file, behind its checksums.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

import atheris  # noqa: E402

with atheris.instrument_imports(
    include=["liquid_splash_addon.core.stroke_files", "liquid_splash_addon.core.sketch"],
    enable_loader_override=False,
):
    from liquid_splash_addon.core.stroke_files.limits import StrokeFileError
    from liquid_splash_addon.core.stroke_files.reading import KINDS, read_bytes

from tests.core.stroke_files.making import tilt  # noqa: E402
from tests.core.stroke_files.seeds import seeds  # noqa: E402

SECONDS = 5
MEGABYTES = 500
EVERY = 200
"""Runs between two notes of what was measured."""


class Harness:
    """Reads one mutated file after the other and keeps count.

    Attributes
    ----------
    figures : what was measured so far
    """

    def __init__(self, kind: str, runs: int, out: Path) -> None:
        self.kind, self.runs, self.out = kind, runs, out
        self.reader = KINDS[".tilt" if kind == "sketch" else f".{kind}"]
        self.wrap: Callable[[bytes], bytes] = tilt if kind == "sketch" else bytes
        self.figures: dict[str, Any] = {"kind": kind, "files": 0, "read": 0, "refused": 0,
                                        "longest_s": 0.0, "messages": 0}  # fmt: skip
        self.messages: set[str] = set()

    def __call__(self, data: bytes) -> None:
        """Read a file; whatever is raised but a StrokeFileError is a fault."""
        wrapped = self.wrap(data)
        start = time.process_time()  # not of others that run beside it
        try:
            recording = read_bytes(wrapped, self.reader)
            assert recording.drawings and recording.size >= 0
            self.figures["read"] += 1
        except StrokeFileError as error:
            self.figures["refused"] += 1
            self.messages.add("".join(c for c in str(error) if not c.isdigit())[:60])
        taken = time.process_time() - start
        self.figures["longest_s"] = max(self.figures["longest_s"], round(taken, 3))
        self.figures["files"] += 1
        if self.figures["files"] % EVERY == 0 or self.figures["files"] >= self.runs:
            self.note()

    def note(self) -> None:
        """Write what was measured."""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        self.figures |= {"peak_mb": round(peak), "messages": len(self.messages)}
        self.out.write_text(json.dumps(self.figures))


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", choices=("tilt", "sketch", "apa", "json", "csv"), required=True)
    parser.add_argument("--runs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    folder = args.out.parent / f"corpus_{args.kind}"
    folder.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(seeds(args.kind)):
        (folder / f"seed_{number}").write_bytes(content)
    options = [
        f"-runs={args.runs}", f"-timeout={SECONDS}", f"-rss_limit_mb={MEGABYTES}",
        f"-seed={args.seed}", "-max_len=65536", "-len_control=20", "-verbosity=0",
        f"-artifact_prefix={args.out.parent}/{args.kind}_",
    ]  # fmt: skip
    atheris.Setup([sys.argv[0], *options, str(folder)], Harness(args.kind, args.runs, args.out))
    atheris.Fuzz()


if __name__ == "__main__":
    main()
