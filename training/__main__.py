# SPDX-License-Identifier: GPL-3.0-or-later
"""The one entrance to training: ``python -m training COMMAND [options]``.

A command's module is imported when it is run, so that simulating needs no torch. Worker
processes that import this file anew (spawn, Dask, torchrun) run nothing of it.
"""

from __future__ import annotations

import importlib
import sys

COMMANDS = {
    "simulate": ("simulation.simulate", "scenes to frames, on many cores or a Dask cluster"),
    "inspect": ("data.inspect", "what a data set holds, and a sheet of its frames"),
    "train": ("learning.train", "frames to checkpoints"),
    "train-patches": ("learning.train_patches", "frames to the patch classifier's weights"),
    "export": ("learning.export", "a checkpoint to the add-on's weights"),
    "evaluate": ("evaluation.evaluate", "figures on scenes never trained on"),
    "curves": ("evaluation.curves", "curves of several runs side by side"),
    "ceiling": ("evaluation.ceiling", "how alike twins of a scene are"),
    "claims": ("evaluation.claims", "what the paper's figures claim, measured on the weights"),
    "displaced": ("research.displaced", "how exactly liquid must be placed for an IoU"),
    "error-analysis": ("research.error_analysis", "where answers miss the truth"),
    "refined": ("research.refined", "what refinements do to accuracy"),
    "ruptures": ("research.ruptures", "how ruptured liquid is, by speed"),
    "slow-and-fast": ("research.slow_and_fast", "answers to sketches drawn slowly and fast"),
    "surfaces": ("research.surfaces", "how well true liquids are meshed"),
}
"""The module and the purpose of each command."""


def usage() -> str:
    """Return the list of commands."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {about}" for name, (_, about) in COMMANDS.items()]
    return "\n".join(
        [
            "usage: python -m training COMMAND [options]",
            "",
            *lines,
            "",
            "COMMAND --help: its options",
        ]
    )


def main(arguments: list[str]) -> int:
    """Run a command and return its exit code, 2 where there is no such command."""
    name, *options = arguments or ["--help"]
    if name in ("-h", "--help"):
        print(usage())
        return 0
    if name not in COMMANDS:
        print(f"There is no command {name!r}.\n\n{usage()}", file=sys.stderr)
        return 2
    sys.argv = [f"training {name}", *options]
    module = importlib.import_module(f"training.{COMMANDS[name][0]}")
    code: int = module.main()
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
