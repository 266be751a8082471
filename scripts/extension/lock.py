# SPDX-License-Identifier: GPL-3.0-or-later
"""Write down which wheels the zips contain: name, version, hash and file, one list a zip.

    make lock [WHEELS=folder] [PIP_ARGS="--index-url ..."]

uv resolves for the zip's platform and Python, against the NumPy of its Blenders and the versions
in requirements.txt; pip says which wheel that is. A zip without wheels for it keeps the list that
it has. The lists are read by wheels.py.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote, urlsplit

from scripts.extension.targets import CUDA_TARGETS, LEFT_OUT, TARGETS, Target, pinned, roots

MACOS_LEAST = "14.0"
HEADING = """\
# The wheels of {name}, written by `make lock`. Declared by them and left out, see targets.py:
# {left_out}.
"""


class Unavailable(Exception):  # noqa: N818 (it is a result)
    """There is no set of wheels; the message says which is missing."""


def output_of(command: list[str | Path], **environment: str) -> str:
    """Return what a command prints. Raises Unavailable with the last line of its complaint."""
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True
    )
    if done.returncode != 0:
        said = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        causes = [line for line in said if line.lower().startswith(("error", "cause"))]
        raise Unavailable((causes or said or ["it failed"])[-1])
    return done.stdout


def sources(wheels: Path | None) -> list[str]:
    """Return options of pip, and of uv, for where packages come from."""
    folder = ["--find-links", str(wheels)] if wheels else []
    return [*shlex.split(os.environ.get("PIP_ARGS", "")), *folder]


def resolve(target: Target, wheels: Path | None) -> str:
    """Return the requirements that fulfil :func:`roots`, with versions. Raises Unavailable."""
    # uv does not read pip's variables.
    links = [word for link in os.environ.get("PIP_FIND_LINKS", "").split()
             for word in ("--find-links", link)]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        wanted, tested = Path(folder, "wanted.in"), Path(folder, "tested.txt")
        wanted.write_text("\n".join(roots(target)))
        # NumPy is the Blender's; torch may be another build.
        others = {name: v for name, v in pinned().items() if name not in ("numpy", "torch")}
        tested.write_text("".join(f"{name}=={version}\n" for name, version in others.items()))
        command = [sys.executable, "-m", "uv", "pip", "compile", wanted, "--constraints", tested]
        command += ["--python-platform", target.platform.uv]
        command += ["--python-version", target.python.version]
        command += ["--no-build", "--no-header", "--no-annotate", "--quiet"]
        for name in LEFT_OUT:
            command += ["--no-emit-package", name]
        return output_of([*command, *links, *sources(wheels)], MACOSX_DEPLOYMENT_TARGET=MACOS_LEAST)


def choose(target: Target, requirements: str, wheels: Path | None) -> list[dict]:
    """Return pip's report of which wheels fulfil the requirements. Raises Unavailable."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "requirements.txt")
        path.write_text(requirements)
        command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed"]
        command += ["--quiet", "--report", "-", "--target", folder, "--requirement", path]
        report = output_of([*command, *target.pip_options, *sources(wheels)])
    return json.loads(report)["install"]


def line_of(chosen: dict) -> str:
    """Return the line of a list for one wheel: nothing in it says where it came from."""
    name, version = chosen["metadata"]["name"].lower(), chosen["metadata"]["version"]
    source = chosen["download_info"]
    digest = source["archive_info"]["hashes"]["sha256"]
    file = unquote(urlsplit(source["url"]).path.rpartition("/")[2])
    return f"{name}=={version} --hash=sha256:{digest}  # {file}"


def lock(target: Target, wheels: Path | None = None) -> None:
    """Write a target's list. Raises Unavailable where there are no wheels for it."""
    chosen = choose(target, resolve(target, wheels), wheels)
    lines = sorted(line_of(each) for each in chosen)
    left_out = ", ".join(sorted(LEFT_OUT))
    heading = HEADING.format(name=target.name, left_out=left_out)
    target.lock.write_text(heading + "\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Write the lists that can be had."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--wheels", type=Path, help="folder with wheels that no index has")
    wheels = parser.parse_args().wheels
    for target in [*TARGETS, *CUDA_TARGETS]:
        try:
            lock(target, wheels)
            print(f"{target.name}: {target.lock}")
        except Unavailable as reason:
            print(f"{target.name}: left as it is. {reason}")


if __name__ == "__main__":
    main()
