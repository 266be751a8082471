# SPDX-License-Identifier: GPL-3.0-or-later
"""The entrance to training: ``python -m training COMMAND [options]``.

A command's module is imported only when it runs, so that simulating needs no torch. On several
devices: ``torchrun --nproc-per-node N -m training train ...``. Processes that commands start import
the modules that they need, never this one.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

COMMANDS = {
    "simulate": ("simulation.simulate", "scenes to frames, on many cores or a Dask cluster"),
    "inspect": ("data.inspect", "what a data set holds, and a sheet of its frames"),
    "train-patches": ("learning.train_patches", "frames to the patch classifier's weights"),
    "train": ("learning.train", "frames to checkpoints of a generator"),
    "export": ("learning.export", "a checkpoint to the add-on's weights"),
    "evaluate": ("evaluation.evaluate", "accuracy on scenes never trained on, beside baselines"),
    "curves": ("evaluation.curves", "accuracy of several runs against time"),
    "ceiling": ("evaluation.ceiling", "how alike twins of a scene are"),
    "critic": ("evaluation.critic", "how well a network tells answers from simulated surfaces"),
    "claims": ("evaluation.claims", "what the paper's figures claim, measured on the weights"),
    "displaced": ("research.displaced", "how exactly liquid must be placed for an IoU"),
    "error-analysis": ("research.error_analysis", "where answers miss the truth"),
    "ranges": ("research.ranges", "what strokes a generator is trained on"),
    "refined": ("research.refined", "how refinements change the accuracy"),
    "resketched": (
        "research.resketched",
        "simulated liquid sketched from its mesh, and generated again",
    ),
    "ruptures": ("research.ruptures", "how ruptured liquid is, by speed"),
    "slow-and-fast": ("research.slow_and_fast", "answers to sketches drawn slowly and fast"),
    "surfaces": ("research.surfaces", "how well simulated liquid is meshed"),
}
"""Module and purpose of each command; a module's ``main`` takes the options and gives an exit code.

In the order in which they are used: first those that lead to weights.
"""


def usage() -> str:
    """Text that lists the commands."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {about}" for name, (_, about) in COMMANDS.items()]
    return "\n".join(
        [
            "usage: python -m training COMMAND [options]",
            "",
            *lines,
            "",
            "`python -m training COMMAND --help` lists its options.",
        ]
    )


def main(arguments: Sequence[str]) -> int:
    """Run a command and return its exit code, 2 where there is no such command."""
    name, *options = arguments or ["--help"]
    if name in ("-h", "--help"):
        print(usage())
        return 0
    if name not in COMMANDS:
        print(f"There is no command {name!r}.\n\n{usage()}", file=sys.stderr)
        return 2
    module = importlib.import_module(f"training.{COMMANDS[name][0]}")
    code: int = module.main(options)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
