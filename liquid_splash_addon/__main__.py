# SPDX-License-Identifier: GPL-3.0-or-later
"""The entrance to the command line: ``python -m liquid_splash_addon strokes.csv --out a.ply``."""

import sys

from .command_line import main

if __name__ == "__main__":
    try:
        code = main(sys.argv[1:], f"python -m {__package__}")
    except KeyboardInterrupt:
        code = 130  # as shells count an interrupt; what was written is whole
    sys.exit(code)
