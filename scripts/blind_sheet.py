# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of two looks more like a splash, the simulated or ours? (paper, 6.4.1)

    python scripts/blind_sheet.py make DATA --out out/blind
    python scripts/blind_sheet.py score out/blind LRLLR...

`make` renders pairs of pictures: a frame of the test scenes, and what the add-on makes of strokes
that were drawn for it, refined by its Fresh list, in the same light and from the same side. Which
is on the left is drawn by lot. The page index.html shows them and collects the answers of a
viewer, a letter a pair; `score` says how often the simulated one was preferred, and whether that
could be chance. The key is in key.json: viewers must not read it.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

PAIRS = 16
"""As many as each viewer was shown for the paper."""

UNITS = 8.0
"""Blender units a metre: the lights and the camera are made for subjects of about two units."""

PAPER = 0.558
"""Share in which the paper's viewers preferred the simulated one."""

PAGE = """<!doctype html><meta charset="utf-8"><title>Which looks more like a splash?</title>
<style>body{font:16px sans-serif;max-width:1000px;margin:auto}figure{margin:1em 0}
img{width:49%;cursor:pointer;border:4px solid transparent}img.chosen{border-color:#06c}</style>
<h1>Which looks more like a splash?</h1>
<p>Click one of each pair. Give the letters below to whoever asked you.</p>
PAIRS<p><output id="answers"></output></p>
<script>
const chosen = Array(COUNT).fill("-");
for (const image of document.images) image.onclick = () => {
  for (const other of image.parentNode.children) other.classList.remove("chosen");
  image.classList.add("chosen");
  chosen[image.dataset.pair] = image.dataset.side;
  document.getElementById("answers").value = chosen.join("");
};
</script>
"""


def main() -> int:
    """Make the pairs, or score answers."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="render the pairs")
    make.add_argument("data", type=Path, help="directory of the data set")
    make.add_argument("--out", type=Path, default=Path("out/blind"))
    make.add_argument("--pairs", type=int, default=PAIRS)
    make.add_argument("--first", type=int, default=0, help="pair to begin with: to go on")
    make.add_argument("--samples", type=int, default=24)
    make.add_argument("--size", type=int, nargs=2, default=(480, 360), metavar="PIXELS")
    make.add_argument("--seed", type=int, default=0, help="of the lots")
    score = commands.add_parser("score", help="score the answers of viewers")
    score.add_argument("folder", type=Path)
    score.add_argument("answers", nargs="+", help="L or R for each pair, - for none; one a viewer")
    options = parser.parse_args()
    try:
        return make_pairs(options) if options.command == "make" else score_answers(options)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1


def score_answers(options: argparse.Namespace) -> int:
    """Print how often viewers preferred the simulated one."""
    key = json.loads((options.folder / "key.json").read_text())["simulated"]
    simulated = total = 0
    for number, answers in enumerate(options.answers, start=1):
        chosen, answered = preferred(key, answers)
        print(f"viewer {number}: simulated {chosen}, ours {answered - chosen}, of {answered}")
        simulated, total = simulated + chosen, total + answered
    if not total:
        raise ValueError("no pair was answered: give L or R for each")
    share, chance = simulated / total, by_chance(simulated, total)
    print(f"simulated preferred: {share:.1%} of {total} (paper: {PAPER:.1%})")
    print(f"as far from even, or farther, by chance: p = {chance:.3f}")
    return 0


def preferred(key: str, answers: str) -> tuple[int, int]:
    """Return how many answers name the simulated one, and how many name any.

    key : the side of the simulated one, L or R, a pair; answers : the same, or - for none.
    Raises ValueError for answers that do not fit the key.
    """
    if len(answers) != len(key) or set(answers.upper()) - set("LR-"):
        raise ValueError(f"'{answers}' is not {len(key)} letters L, R or -: one for each pair")
    chosen = sum(a == k for a, k in zip(answers.upper(), key, strict=True))
    return chosen, len(answers) - answers.count("-")


def by_chance(simulated: int, total: int) -> float:
    """Return the two-sided probability of such a count where both are as good (binomial)."""
    from scipy.stats import binomtest

    return float(binomtest(simulated, total).pvalue)


def lots(pairs: int, seed: int) -> str:
    """Return on which side the simulated one of each pair is: as often on the left."""
    sides = np.array(["L", "R"] * (-(-pairs // 2)))[:pairs]
    return "".join(np.random.default_rng(seed).permutation(sides))


def make_pairs(options: argparse.Namespace) -> int:
    """Render the pairs and write the page and the key."""
    import bpy

    import liquid_splash_addon
    from liquid_splash_addon.core.generator.loading import load_generator
    from training.data.items import choose, load_items

    items = choose(load_items(options.data, "test"), options.pairs)
    key = lots(len(items), options.seed)
    options.out.mkdir(parents=True, exist_ok=True)
    liquid_splash_addon.register()
    generator = load_generator(None, "CPU")
    for number in range(options.first, len(items)):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        sides = "LR" if key[number] == "L" else "RL"
        render_pair(meshes(items[number], generator), number, sides, options)
        print(f"pair {number + 1} of {len(items)}", flush=True)
    shown = "".join(
        f'<figure>{number + 1}<br><img src="{number:02}L.webp" data-pair="{number}" data-side="L">'
        f'<img src="{number:02}R.webp" data-pair="{number}" data-side="R"></figure>\n'
        for number in range(len(items))
    )
    page = PAGE.replace("PAIRS", shown).replace("COUNT", str(len(items)))
    (options.out / "index.html").write_text(page)
    frames = [[item.seed, item.number] for item in items]
    (options.out / "key.json").write_text(json.dumps({"simulated": key, "frames": frames}) + "\n")
    return 0


def meshes(item, generator) -> list:
    """Return the simulated liquid of a frame and ours, meshes in Blender units, z up."""
    from liquid_splash_addon.core.composition.drops import mesh_to_drawing
    from liquid_splash_addon.core.grid import Grid
    from liquid_splash_addon.core.liquid.level_set import LevelSet
    from liquid_splash_addon.core.mesh.marching_cubes import surface
    from liquid_splash_addon.core.mesh.mesh import Mesh
    from liquid_splash_addon.core.mesh.spheres import spheres
    from liquid_splash_addon.core.pipeline import make_splash
    from liquid_splash_addon.core.refinement.presets import PRESETS
    from liquid_splash_addon.core.settings import SplashSettings
    from liquid_splash_addon.core.sketch.local_frame import fit_frame
    from training.data.samples import held_out_strokes, resample

    stored = item.load()
    strokes = held_out_strokes(item, stored)
    frame, grid = fit_frame(strokes), Grid.local()
    true = LevelSet(*resample(stored, item.spacing, frame, grid), grid)
    simulated = mesh_to_drawing(surface(true.fields()), frame)
    drops = stored.droplets.astype(np.float32)
    inside = np.abs(frame.points_to_local(drops[:, :3].astype(float))) < grid.size[0] / 2
    drops = drops[inside.all(axis=1) & (drops[:, 6] > 0)]
    if len(drops):
        balls = spheres(drops[:, :3], drops[:, 3:6], drops[:, 6])
        simulated = Mesh(
            np.concatenate([simulated.vertices, balls.vertices]),
            np.concatenate([simulated.faces, balls.faces + np.int32(len(simulated.vertices))]),
            np.concatenate([simulated.velocities, balls.velocities]),
        )
    settings = SplashSettings(speed_gain=1.0, device="CPU")
    steps = PRESETS["FRESH"].steps
    ours = make_splash(strokes, settings, generator, frame, refinements=steps).mesh
    middle = ours.vertices.mean(axis=0)
    return [
        replace(m, vertices=(m.vertices - middle) * np.float32(UNITS)) for m in (simulated, ours)
    ]


def render_pair(pair: Sequence, number: int, sides: str, options: argparse.Namespace) -> None:
    """Render both meshes in the same light, each to the file of its side."""
    import make_demo as demo
    from PIL import Image

    from liquid_splash_addon.blender.scene.mesh_object import plain_object

    shown = [plain_object(mesh, "Splash") for mesh in pair]
    both = np.concatenate([mesh.vertices for mesh in pair])
    demo.set_table(both, options.samples, options.size, margin=0.12)
    for item, side in zip(shown, sides, strict=True):
        for other in shown:
            other.hide_render = other is not item
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "shot.png"
            demo.render(path)
            picture = Image.open(path).convert("RGB")
        picture.save(options.out / f"{number:02}{side}.webp", quality=85, method=6)


if __name__ == "__main__":
    sys.exit(main())
