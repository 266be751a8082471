# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutated files give strokes or a clear error: no crash, no hang, no flood of memory."""

import json
import random
import subprocess
import sys
from pathlib import Path

import pytest

from liquid_splash_addon.core.stroke_files.limits import StrokeFileError
from liquid_splash_addon.core.stroke_files.reading import KINDS, read_bytes
from tests.core.stroke_files.making import tilt
from tests.core.stroke_files.seeds import mutated, seeds

RUNS = {"tilt": 4000, "sketch": 6000, "apa": 5000, "json": 5000, "csv": 5000}
"""Mutated files of each kind."""

SCRIPT = Path(__file__).with_name("fuzz_readers.py")


@pytest.mark.parametrize("kind", RUNS)
def test_a_few_random_changes_give_strokes_or_a_clear_error(kind):
    number, files = random.Random(kind), seeds(kind)
    answers = {"strokes": 0, "errors": 0}
    for run in range(25):
        content = mutated(files[run % len(files)], number)
        content = tilt(content) if kind == "sketch" else content
        try:
            found = read_bytes(content, KINDS[".tilt" if kind == "sketch" else f".{kind}"])
            answers["strokes"] += bool(found.drawings)
        except StrokeFileError as error:
            answers["errors"] += len(str(error)) > 20
    assert sum(answers.values()) == 25 and answers["errors"]
    assert answers["strokes"] or kind == "tilt", "its checksums find every change"


@pytest.mark.slow
@pytest.mark.parametrize("kind", RUNS)
def test_mutations_guided_by_coverage_find_no_fault(kind, tmp_path):
    pytest.importorskip("atheris")
    out = tmp_path / "figures.json"
    command = [sys.executable, str(SCRIPT), "--kind", kind, "--runs", str(RUNS[kind])]
    done = subprocess.run([*command, "--out", str(out)], capture_output=True, text=True)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    figures = json.loads(out.read_text())
    assert figures["files"] >= RUNS[kind] and figures["peak_mb"] < 500
    assert figures["longest_s"] < 5 and figures["read"] > 0 and figures["refused"] > 0


HEAVY = {
    "bomb.tilt": "tilt(sketch_bytes([LINE]) + bytes(300 * 2**20))",
    "full.tilt": "tilt(repeated(sketch_bytes([LINE]), 20, 500), compression=zipfile.ZIP_STORED)",
    "full.apa": "repeated(apa([LINE]), 17, 500)",
    "short.apa": "repeated(apa([LINE[:2]]), 17, 20_000)",
    "empty.apa": "repeated(apa([[]]), 17, 20_000)",
    "full.csv": "b'x,y,z,t,pressure,stroke\\n' + b'1.12345678,1.2345678,2.345678,2.5,0.5,1\\n"
    "2.12345678,1.2345678,2.345678,2.5,0.5,1\\n' * 250_000",
    "wide.csv": "('x,y,z,t\\n0,0,0,0\\n1,0,0,1\\n' + '\\U0001f30a' * (30 * 2**20)).encode()",
    "lines.csv": "b'x,y,z\\n0,0,0\\n1,0,0\\n' + b'\\n' * (20 * 2**20)",
    "full.json": "b'{\"strokes\": [[' + b'[0.123456, 1.234567, 2.345678, 0.5],' * 499_999 "
    "+ b'[0, 0, 0, 0]]]}'",
    "objects.json": "b'{\"strokes\": [' + b'{},' * (40 * 2**20) + b'0]}'",
    "lists.json": "b'{\"strokes\": [' + b'[],' * 2_000_000 + b'0]}'",
}
"""The most that each kind may hold, and what looks small and grows: Python that makes the file."""

MEASURE = """
import resource, sys, time, zipfile
import numpy as np
sys.path.insert(0, {root!r})
from pathlib import Path
from tests.core.stroke_files.making import *
LINE = np.linspace((0, 0, 0), (1, 0, 0), 1000)
def repeated(data, at, count):
    return data[:at] + struct.pack("<I", count) + data[at + 4 :] * count
if sys.argv[1] == "make":
    Path(sys.argv[2]).write_bytes({content})
else:
    from liquid_splash_addon.core.stroke_files.reading import StrokeFileError, read_recording
    start = time.process_time()
    try:
        read_recording(sys.argv[2])
    except StrokeFileError as error:
        print(error, file=sys.stderr)
    print(time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", HEAVY)
def test_the_largest_files_stay_below_500_mb(name, tmp_path):
    script = MEASURE.format(root=str(SCRIPT.parents[3]), content=HEAVY[name])
    path = tmp_path / name
    for step in ("make", "read"):
        done = subprocess.run(
            [sys.executable, "-c", script, step, str(path)], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr[-2000:]
    seconds, megabytes = map(float, done.stdout.split())
    assert megabytes < 500 and seconds < 30
    size = path.stat().st_size / 2**20
    print(f"{name}: {size:.1f} MB, {seconds:.1f} s, {megabytes:.0f} MB. {done.stderr.strip()}")
