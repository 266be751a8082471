# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a repository of extensions that Blender can subscribe to: the zips and their index.

    make repo

The folder is static: any web server, or a file:// address, serves it. The light zip stays out of
it, because Blender would not know which of two for the same version to take.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Sequence
from pathlib import Path

from scripts.extension.blender_tool import run
from scripts.extension.targets import ROOT
from scripts.extension.wheels import place

DIST = ROOT / "dist"


def write_repository(folder: Path, zips: Sequence[Path]) -> None:
    """Write the repository of some zips into a folder, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for path in zips:
        place(path, folder)
    run("server-generate", "--repo-dir", folder, "--html")


def main() -> None:
    """Write the repository of what `make zip` built."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--zips", type=Path, default=DIST, help="folder with the zips")
    parser.add_argument("--output", type=Path, default=DIST / "repository", help="folder for it")
    arguments = parser.parse_args()
    zips = sorted(arguments.zips.glob("liquid_splash-*-py3*.zip"))
    if not zips:
        raise SystemExit(f"There is no zip with wheels in {arguments.zips}: run make zip")
    write_repository(arguments.output.resolve(), zips)


if __name__ == "__main__":
    main()
