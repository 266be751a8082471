# SPDX-License-Identifier: GPL-3.0-or-later
"""Licences and bill of materials (SBOM, CycloneDX) of the wheels in a zip, by the tools for them.

    make licences

writes the table of docs/licences.md. Both tools read what an environment has installed. It is made
of the wheels' metadata alone, so it can be one for another platform too.
"""

from __future__ import annotations

import sys
import sysconfig
import tempfile
import venv
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from scripts.extension.lock import output_of
from scripts.extension.targets import ROOT, TARGETS
from scripts.extension.wheels import have

LICENCES, SBOM = "third_party_licences.txt", "sbom.cdx.json"
"""Names of the files in the zip."""

PAGE = ROOT / "docs" / "licences.md"

COMPATIBLE = (
    "Apache",
    "BSD",
    "MIT",
    "Python Software Foundation",
    "PSF",
)
"""What a wheel's licence must contain to be shipped with GPL-3.0-or-later code."""


@contextmanager
def environment(wheels: Sequence[Path]) -> Iterator[Path]:
    """Yield the Python of an environment that has the wheels' metadata and nothing else."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=False, symlinks=True)
        schemes = {"base": folder, "platbase": folder}
        site = Path(sysconfig.get_path("purelib", "venv", vars=schemes))
        for path in wheels:
            with zipfile.ZipFile(path) as archive:
                names = [name for name in archive.namelist() if ".dist-info/" in name]
                archive.extractall(site, names)
        yield Path(sysconfig.get_path("scripts", "venv", vars=schemes)) / "python"


def licence_table(wheels: Sequence[Path], style: str = "markdown") -> str:
    """Return the name, version and licence of each wheel. Raises Unavailable for others."""
    with environment(wheels) as python:
        command = [sys.executable, "-m", "piplicenses", "--python", python, f"--format={style}"]
        command += ["--with-system", "--with-urls", "--from=mixed", "--order=name"]
        return output_of([*command, "--partial-match", f"--allow-only={';'.join(COMPATIBLE)}"])


def write_notices(wheels: Sequence[Path], folder: Path, is_for_others: bool = True) -> None:
    """Write licence texts and SBOM of wheels into a folder.

    is_for_others : whether the zip may be passed on, so that licences have to fit.
    Raises Unavailable.
    """
    if is_for_others:
        licence_table(wheels)
    with environment(wheels) as python:
        texts = [sys.executable, "-m", "piplicenses", "--python", python, "--with-system"]
        texts += ["--format=plain-vertical", "--from=mixed", "--with-license-file"]
        texts += ["--no-license-path"]
        (folder / LICENCES).write_text(output_of(texts), encoding="utf-8")
        bill = [sys.executable, "-m", "cyclonedx_py", "environment", python]
        output_of([*bill, "--output-reproducible", "--output-file", folder / SBOM])


def main() -> None:
    """Put the table of licences into the page about them; every platform has the same packages."""
    heading, _, _ = PAGE.read_text(encoding="utf-8").partition("\n| Name")
    table = licence_table(have(TARGETS[0])).replace("+cpu", "    ")
    PAGE.write_text(f"{heading}\n{table}", encoding="utf-8")


if __name__ == "__main__":
    main()
