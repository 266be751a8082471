# SPDX-License-Identifier: GPL-3.0-or-later
"""The one entrance to training's commands."""

import subprocess
import sys
from pathlib import Path

import pytest

from training.__main__ import COMMANDS, main

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_says_how_it_is_used(name, capsys):
    pytest.importorskip("torch")
    with pytest.raises(SystemExit) as end:
        main([name, "--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert text.startswith(f"usage: python -m training {name} ")
    assert f"python -m training {name} " in text.split("\n\n", 1)[1]  # an example


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"]])
def test_without_a_command_all_are_listed(arguments, capsys):
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert text.startswith("usage: python -m training COMMAND")
    assert all(f"  {name} " in text for name in COMMANDS)


def test_an_unknown_command_is_refused_with_the_list(capsys):
    assert main(["simulat", "--help"]) == 2
    out, errors = capsys.readouterr()
    assert not out and "no command 'simulat'" in errors
    assert all(f"  {name} " in errors for name in COMMANDS)


def run_python(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python in the project's folder."""
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_the_entrance_is_a_process_with_an_exit_code():
    assert run_python("-m", "training").returncode == 0
    assert run_python("-m", "training", "nonsense").returncode == 2


def test_simulating_needs_no_torch(tmp_path: Path):
    """Neither does what its worker processes import."""
    script = (
        "import sys\n"
        "class NoTorch:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name.split('.')[0] == 'torch': raise ImportError(name)\n"
        "sys.meta_path.insert(0, NoTorch())\n"
        "from training.__main__ import main\n"
        "from training.simulation.simulate import simulate_scene\n"
        "assert simulate_scene(0, 16, 16)\n"
        f"sys.exit(main(['simulate', '--scenes', '1', '--out', {str(tmp_path)!r}, '--help']))"
    )
    done = run_python("-c", script)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("usage: python -m training simulate")
