# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the tests with the Python that runs this file::

blender -b --python tests/run.py [-- pytest options]
python tests/run.py [pytest options]
"""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
INSTALL = (
    "This Python has no pytest. Install what the tests need, once: '{}' -m pip install "
    "pytest torch safetensors scikit-image scipy numba pymeshlab tqdm tensorboard"
)


def pytest_options(argv: list[str]) -> list[str]:
    """Return what is meant for pytest: all of Python's arguments, of Blender's those after --."""
    if "--" in argv:
        return argv[argv.index("--") + 1 :]
    is_python = Path(argv[0]).name == Path(__file__).name
    return argv[1:] if is_python else []


def main() -> int:
    """Run pytest from the checkout's top and return its exit code."""
    try:
        import pytest
    except ImportError:
        print(INSTALL.format(sys.executable))
        return 2
    # Before torch is there: idle OpenMP threads that spin make it several times slower.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    os.chdir(ROOT)
    return int(pytest.main(["--rootdir", str(ROOT), *pytest_options(sys.argv)]))


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    if "coverage" in sys.modules:  # python -m coverage run: it would write when Python ends
        recorded = sys.modules["coverage"].Coverage.current()
        if recorded is not None:  # a library has imported it, no more
            recorded.stop()
            recorded.save()
    # Not sys.exit: with Blender's module, some versions crash while Python ends, which would
    # replace pytest's exit code.
    os._exit(code)
