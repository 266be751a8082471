# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line for farms: what is written, what is said, and the exit codes."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from liquid_splash_addon import api, command_line
from liquid_splash_addon.core.packages import PACKAGES

FAST = ["--resolution", "64", "--device", "CPU", "--precision", "float32"]


@pytest.fixture
def strokes(tmp_path) -> Path:
    """Return a file with a sketch."""
    path = tmp_path / "wave.csv"
    api.write_strokes(path, api.preset_sketch("WAVE"))
    return path


def run(*arguments) -> int:
    """Return the exit code of a command line, of wrong ones too."""
    try:
        return command_line.main([str(argument) for argument in arguments])
    except SystemExit as end:
        return int(end.code)


def test_every_seed_is_written_and_the_same_as_by_the_interface(strokes, tmp_path, capsys) -> None:
    out = tmp_path / "splash.npz"
    assert run(strokes, "--out", out, "--seeds", 2, "--seed", 9, *FAST) == 0
    names = sorted(path.name for path in tmp_path.glob("*.npz"))
    assert names == ["splash_09.npz", "splash_10.npz"]
    first, second = (np.load(tmp_path / name)["vertices"] for name in names)
    assert first.shape != second.shape or not np.allclose(first, second)
    wanted = api.make_splash(
        api.read_strokes(strokes), seed=9, variation=1.0, resolution=64, device="CPU",
        precision="float32",
    )  # fmt: skip
    np.testing.assert_array_equal(first, wanted.vertices)
    said = capsys.readouterr()
    assert said.out == "" and "[2/2] splash_10.npz:  10% Generating liquid" in said.err


def test_a_bad_input_does_not_keep_the_others_from_being_made(strokes, tmp_path, capsys) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("{")
    out = tmp_path / "all.ply"
    assert run(bad, tmp_path / "none.csv", strokes, "--out", out, "--quiet", *FAST) == 1
    assert [path.name for path in tmp_path.glob("*.ply")] == ["all_wave.ply"]
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("error: bad.json: ")
    assert "none.csv: No such file" in lines[1]
    assert lines[-1] == "error: 2 of 3 splashes were not made"
    assert all(line.startswith(("error: ", "warning: ")) for line in lines)


def test_a_splash_that_cannot_be_written_is_said(strokes, tmp_path, capsys) -> None:
    (tmp_path / "splash_0.ply").mkdir()
    assert run(strokes, "--out", tmp_path / "splash.ply", "--seeds", 2, "--quiet", *FAST) == 1
    assert (tmp_path / "splash_1.ply").is_file()
    assert "splash_0.ply cannot be written" in capsys.readouterr().err


def test_what_is_there_can_be_left(strokes, tmp_path, capsys) -> None:
    out = tmp_path / "splash.ply"
    out.write_bytes(b"mine")
    assert run(strokes, "--out", out, "--skip-existing", *FAST) == 0
    assert out.read_bytes() == b"mine" and "there already" in capsys.readouterr().err


def test_inputs_of_the_same_name_do_not_overwrite_each_other() -> None:
    sources = [Path("a/wave.csv"), Path("b/wave.csv"), Path("b/wave-2.csv")]
    assert list(command_line.unlike_names(sources)) == ["wave", "wave-2", "wave-2-2"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "name at least one file of strokes"),
        (["a.csv"], "name the file to write with --out"),
        (["a.csv", "--out", "a.stl"], "splashes are written as .ply, .obj, .npz only"),
        (["a.csv", "--out", "no/folder/a.ply"], "there is no folder no/folder: make it first"),
        (["a.csv", "--out", "a.ply", "--refine", "FOAM"], "no refinement 'FOAM'"),
        (
            ["a.csv", "--out", "a.ply", "--refine", "WAVES:height=1"],
            "WAVES has no setting 'height'",
        ),
        (
            ["a.csv", "--out", "a.ply", "--refine", "WAVES:speed=x"],
            "WAVES: speed must be a number, not",
        ),
        (["a.csv", "--out", "a.ply", "--refine", "WAVES:speed=9"], "speed must be from 0.1 to 1.0"),
        (["a.csv", "--out", "a.ply", "--breakup", "99"], "breakup must be from 0.0 to 10.0"),
        (["a.csv", "--out", "a.ply", "--seeds", "0"], "argument --seeds: invalid"),
        (["a.csv", "--out", "a.ply", "--seed", "2147483647", "--seeds", "2"], "seeds end at"),
        (["a.csv", "--out", "a.ply", "--resolution", "96"], "invalid choice: '96'"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_wrong_command_line_ends_with_2_and_a_sentence(arguments, says, capsys) -> None:
    assert run(*arguments) == 2
    assert says in capsys.readouterr().err


def test_a_machine_that_cannot_make_splashes_ends_with_3(strokes, tmp_path, monkeypatch, capsys):
    out = tmp_path / "splash.ply"
    assert run(strokes, "--out", out, "--weights", tmp_path / "none.safetensors", *FAST) == 3
    assert "No network at" in capsys.readouterr().err
    monkeypatch.setitem(PACKAGES, "no_such_module", "no-such-package")
    assert run(strokes, "--out", out, *FAST) == 3
    assert "Run: python -m pip install no-such-package" in capsys.readouterr().err


def test_lists_and_versions_are_printed(capsys) -> None:
    assert run("--list-refinements") == 0
    listed = capsys.readouterr().out
    assert all(f"{name} " in listed for name in api.REFINEMENTS)
    assert "amplitude=0.0007" in listed
    assert run("--version") == 0
    assert capsys.readouterr().out == (
        f"Liquid Splash {api.__version__}, interface {api.API_VERSION}\n"
    )


def test_refinements_may_have_settings() -> None:
    (step,) = command_line.refinement_steps("DROPLETS:amount=0.004,seed=2")
    assert step == api.refinement("DROPLETS", amount=0.004, seed=2)
