# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands as processes: stopped, killed, out of space, on a cluster, several at once."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from training.data.frames import load_parameters, scene_path
from training.simulation.simulate import main as simulate_main

ROOT = Path(__file__).parents[2]
COARSE = ("--resolution", 16)


def start(*arguments, **options):
    """Start a Python command in the project's folder, marked by its last argument."""
    command = [sys.executable, *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    environment["LIQUID_SPLASH_TEST"] = str(arguments[-1])
    return subprocess.Popen(
        command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True, **options
    )


def simulate(*arguments, **options):
    """Start ``python -m training simulate``."""
    return start("-m", "training", "simulate", *COARSE, *arguments, **options)


def wait_until(done, seconds=600.0):
    """Wait until ``done()``; fail after ``seconds``."""
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def scenes(directory):
    """Return the scene files in a directory, by name."""
    return sorted(path.name for path in directory.glob("scene_*.npz"))


def test_a_stopped_run_goes_on_where_it_was(tmp_path: Path, run_command):
    arguments = (*COARSE, "--scenes", 2, "--first", 40, "--workers", 1, "--out", tmp_path)
    assert run_command(simulate_main, *arguments) == 0
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("scene_*.npz")}
    assert len(before) == 2
    gone = sorted(before)[0]
    gone.unlink()
    assert run_command(simulate_main, *arguments) == 0
    after = {path: path.stat().st_mtime_ns for path in tmp_path.glob("scene_*.npz")}
    assert set(after) == set(before)
    assert [p for p in before if before[p] != after[p]] == [gone]


def test_a_run_killed_at_any_moment_leaves_only_whole_files(tmp_path: Path):
    arguments = ("--scenes", 12, "--workers", 2, "--out", tmp_path)
    run = simulate(*arguments)
    wait_until(lambda: len(scenes(tmp_path)) >= 3)
    run.kill()
    run.communicate()
    left = scenes(tmp_path)
    assert len(left) < 12
    for name in left:
        load_parameters(tmp_path / name)
    (tmp_path / "scene_000099.123.tmp").write_bytes(b"half a file")
    kept = {name: (tmp_path / name).stat().st_mtime_ns for name in left}
    again = simulate(*arguments)
    again.communicate()
    assert again.returncode == 0
    assert scenes(tmp_path) == [scene_path(tmp_path, n).name for n in range(12)]
    assert all((tmp_path / name).stat().st_mtime_ns == kept[name] for name in left)
    assert not list(tmp_path.glob("*.tmp"))


def processes_with(word):
    """Return the processes that :func:`start` marked so, and theirs: children inherit the mark."""
    return [
        process
        for process in psutil.process_iter(["environ"])
        if (process.info["environ"] or {}).get("LIQUID_SPLASH_TEST") == word
    ]


def test_workers_end_with_the_run_that_started_them(tmp_path: Path):
    run = simulate("--scenes", 500, "--workers", 2, "--out", tmp_path)
    wait_until(lambda: scenes(tmp_path))
    assert len(processes_with(str(tmp_path))) >= 3
    run.kill()
    run.communicate()
    wait_until(lambda: not processes_with(str(tmp_path)), 10)
    count = len(scenes(tmp_path))
    time.sleep(1.0)
    assert len(scenes(tmp_path)) == count


def no_large_files():
    """Let every file of more than 500 bytes fail, as on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))


def test_a_full_disk_is_said_and_leaves_nothing_half_written(tmp_path: Path):
    run = simulate("--scenes", 2, "--workers", 1, "--out", tmp_path, preexec_fn=no_large_files)
    _, errors = run.communicate()
    assert run.returncode == 1
    assert "free some space" in errors and "Traceback" not in errors
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_is_said(tmp_path: Path, run_command, capsys):
    (tmp_path / "file").write_text("in the way")
    assert run_command(simulate_main, "--scenes", 1, "--out", tmp_path / "file" / "data") == 1
    assert "choose another --out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--scenes", 0), "must be at least 1"),
        (("--scenes", 1, "--resolution", 64, "--store", 128), "--store must be between"),
        (("--scenes", 1, "--family", "rain"), "invalid choice"),
    ],
)
def test_bad_arguments_are_said(tmp_path: Path, run_command, capsys, arguments, sentence):
    with pytest.raises(SystemExit) as end:
        run_command(simulate_main, *arguments, "--out", tmp_path / "new")
    assert end.value.code == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_scheduler_that_is_not_there_is_said(tmp_path: Path):
    pytest.importorskip("distributed")
    run = simulate("--scenes", 1, "--out", tmp_path, "--scheduler", "tcp://127.0.0.1:1")
    _, errors = run.communicate()
    assert run.returncode == 1
    assert "no Dask scheduler answers" in errors and "Traceback" not in errors


def test_on_dask_every_scene_arrives_once_though_a_worker_is_killed(tmp_path: Path):
    pytest.importorskip("distributed")
    address, data = tmp_path / "scheduler.json", tmp_path / "data"
    node = ("--scheduler-file", address)
    started = [start("-m", "dask", "scheduler", "--port", 0, "--no-dashboard", *node)]
    try:
        wait_until(address.exists)
        options = ("--nthreads", 1, "--no-nanny", "--no-dashboard", *node)
        workers = [start("-m", "dask", "worker", *options) for _ in range(2)]
        started += workers
        scheduler = json.loads(address.read_text())["address"]
        run = simulate("--scenes", 10, "--out", data, "--scheduler", scheduler)
        started.append(run)
        wait_until(lambda: len(scenes(data)) >= 2)
        workers[0].kill()
        assert run.wait(120) == 0
        assert scenes(data) == [scene_path(data, n).name for n in range(10)]
        bar = run.stderr.read()
        assert "10/10" in bar and "11/10" not in bar
    finally:
        for process in started:
            process.kill()
            process.communicate()


def test_two_processes_learn_what_one_does(toy_data: Path, tmp_path: Path):
    """With the same global batch, ``torchrun`` with two processes has the same losses."""
    torch = pytest.importorskip("torch")
    script = tmp_path / "toy.py"
    script.write_text(TWO_PROCESSES)
    curves = []
    for processes in (1, 2):
        out = tmp_path / f"by_{processes}"
        torchrun = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
        command = [*torchrun, f"--nproc-per-node={processes}", script, toy_data, out]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        curves.append(torch.load(out / "checkpoint.pt", weights_only=True)["learner"]["network"])
    for name, tensor in curves[0].items():
        # After one step they differ by 1e-9, after two by 1e-6: Muon enlarges what rounding leaves,
        # after four tenfold again, whichever way the sums are taken. Other samples would be 1e-3.
        assert torch.allclose(curves[1][name], tensor, atol=5e-6), name


@pytest.mark.slow
def test_the_command_trains_in_two_processes(toy_data: Path, tmp_path: Path):
    """As ``torchrun -m training train``, with processes of its own that draw the samples."""
    torch = pytest.importorskip("torch")
    torchrun = ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"]
    paper = ("--model", "unet", "--cells", 16, "--steps", 2)  # ours would take minutes
    options = (*paper, "--workers", 1, "--threads", 1, "--device", "cpu", "--precision", "float32")
    run = start(*torchrun, "-m", "training", "train", toy_data, *options, "--out", tmp_path)
    _, errors = run.communicate()
    assert run.returncode == 0, errors
    state = torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    assert state["steps"] == 2 and state["kind"] == "paper"


TWO_PROCESSES = """
import sys
from pathlib import Path
from training.data.items import load_items
from training.learning import parallel
from training.learning.splash_learner import SplashConfig, SplashLearner
from training.learning.train import Run, TrainConfig, train
from liquid_splash_addon.core.generator.splash_unet import NetworkConfig

rank, world = parallel.start()
shape = NetworkConfig((4, 8, 8, 8), (1, 1, 1, 1), (1, 1, 1), (4, 8), (1, 1, 1), latent_channels=2)
config = TrainConfig(steps=2, batch=4, cells=32, crop=32, warmup=1)
items = load_items(Path(sys.argv[1]), "train")
out = Path(sys.argv[2])
out.mkdir(exist_ok=True)
run = Run(config, SplashLearner(SplashConfig(imle_from=2.0), shape, 32), out, {"kind": "splash"})
train(run, items, items[:1], 0, rank, world)
parallel.stop()
"""
