# SPDX-License-Identifier: GPL-3.0-or-later
"""Do the preset sketches still give the same splashes as another checkout's?

    git worktree add ../before COMMIT
    python scripts/compare_checkouts.py ../before

Makes every preset at 64 and 128 cells in float32, bare and with the Fresh list, in both checkouts,
each with an empty cache of compiled code, and compares the meshes: vertices, faces, velocities.
Names are looked up wherever a checkout defines them, so that files may have moved. Exit status 0
if all is bit-identical or, with --close, within what merging code may change.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
MEAN_MOST, FARTHEST_MOST = 0.01, 0.2
"""Distance between surfaces, in cells."""
VOLUME_MOST, VELOCITY_MOST = 1e-4, 1e-3
"""Relative differences."""


def use(checkout: Path) -> None:
    """Take the project's modules from a checkout, and nothing from this script's own folder."""
    sys.path[0] = str(checkout)


def find(name: str) -> Any:
    """Return what core defines under ``name``, in whichever module."""
    core = importlib.import_module("liquid_splash_addon.core")
    for found in pkgutil.walk_packages(core.__path__, f"{core.__name__}."):
        value = getattr(importlib.import_module(found.name), name, None)
        if getattr(value, "__module__", None) == found.name:
            return value
    raise SystemExit(f"no {name} in {core.__path__}")


def make(out: Path) -> None:
    """Write the splashes of the checkout in the working directory into ``out``."""
    settings_of, make_splash = find("SplashSettings"), find("make_splash")
    read, sketch = find("strokes_from_drawings"), find("example_sketch")
    known = importlib.import_module(sketch.__module__).PRESETS
    fresh = importlib.import_module("liquid_splash_addon.core.refinement.presets").PRESETS["FRESH"]
    generator = find("load_generator")(device="CPU", precision="float32")
    for name in known:
        for cells in ("64", "128"):
            settings = settings_of(resolution=cells, device="CPU")
            strokes, _ = read(sketch(name), settings)
            for kind, steps in (("bare", ()), ("fresh", fresh.steps)):
                splash = make_splash(strokes, settings, generator, refinements=steps)
                mesh, scale = splash.mesh, splash.frame.scale
                np.savez(
                    out / f"{name}_{cells}_{kind}.npz",
                    vertices=mesh.vertices, faces=mesh.faces, velocities=mesh.velocities,
                    # Older checkouts have a number for the scale.
                    cell=splash.fields.grid.spacing / getattr(scale, "length", scale),
                )  # fmt: skip


def made_in(checkout: Path, folder: Path) -> Path:
    """Return the folder with the splashes of a checkout, made in a process of its own."""
    out = folder / "splashes"
    out.mkdir(parents=True)
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(folder / "compiled"),
        "OMP_WAIT_POLICY": "PASSIVE",
    }
    command = [sys.executable, Path(__file__).resolve(), "--make", out]
    subprocess.run(command, cwd=checkout, env=environment, check=True)
    return out


def volume(mesh: dict[str, np.ndarray]) -> float:
    """Return what a mesh encloses, in its own units."""
    a, b, c = (mesh["vertices"][mesh["faces"][:, n]].astype(np.float64) for n in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c) / 6)


def differences(mine: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> dict[str, float]:
    """Return how two splashes differ: distances in cells, the rest relative; empty if in no bit."""
    same = all(
        mine[name].dtype == theirs[name].dtype and np.array_equal(mine[name], theirs[name])
        for name in ("vertices", "faces", "velocities")
    )
    if same:
        return {}
    from scipy.spatial import cKDTree

    points = mine["vertices"].astype(np.float64)
    triangles = theirs["vertices"].astype(np.float64)[theirs["faces"]]
    away, _, _ = find("nearest_on_mesh")(triangles, points, 10 * float(mine["cell"]))
    _, there = cKDTree(theirs["vertices"]).query(points)
    apart = np.linalg.norm(mine["velocities"] - theirs["velocities"][there], axis=1)
    speed = np.linalg.norm(theirs["velocities"], axis=1).mean()
    return {
        "mean": float(away.mean() / mine["cell"]),
        "farthest": float(away.max() / mine["cell"]),
        "volume": abs(volume(mine) / volume(theirs) - 1),
        "velocity": float(apart.mean() / speed),
    }


def main() -> int:
    """Compare this checkout with another, or make the splashes of one."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("other", type=Path, nargs="?", help="the checkout to compare with")
    parser.add_argument("--close", action="store_true", help="allow what merging code may change")
    parser.add_argument("--make", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    use(Path.cwd() if args.make else ROOT)
    if args.make:
        make(args.make)
        return 0
    if args.other is None or not (args.other / "liquid_splash_addon").is_dir():
        parser.error("name another checkout, as of git worktree add")
    with tempfile.TemporaryDirectory() as folder:
        mine = made_in(ROOT, Path(folder) / "mine")
        theirs = made_in(args.other.resolve(), Path(folder) / "theirs")
        return compare(mine, theirs, args.close)


def compare(mine: Path, theirs: Path, close: bool) -> int:
    """Print how the splashes differ and return the exit status."""
    bounds = dict(
        mean=MEAN_MOST, farthest=FARTHEST_MOST, volume=VOLUME_MOST, velocity=VELOCITY_MOST
    )
    paths = sorted(mine.glob("*.npz"))
    if {path.name for path in paths} != {path.name for path in theirs.glob("*.npz")}:
        print("the checkouts have other presets")
        return 1
    bad = 0
    for path in paths:
        found = differences(dict(np.load(path)), dict(np.load(theirs / path.name)))
        words = ", ".join(f"{name} {value:.2g}" for name, value in found.items())
        print(f"{path.stem}: {words or 'identical'}")
        bad += any(value > (bounds[name] if close else 0) for name, value in found.items())
    print(f"{len(paths) - bad} of {len(paths)} splashes are {'close' if close else 'identical'}")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
