# SPDX-License-Identifier: GPL-3.0-or-later
"""What the zips with wheels contain: the lists, and the wheels themselves."""

import json
import re
import struct
import subprocess
import sys
import tomllib
import zipfile
from email.parser import HeaderParser
from pathlib import Path

import pytest

pytest.importorskip("packaging")  # not in every Blender's Python

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

from build import MANIFEST, manifest_for
from liquid_splash_addon.core.packages import PACKAGES
from scripts.extension import notices
from scripts.extension import wheels as store
from scripts.extension.lock import Unavailable
from scripts.extension.targets import CUDA_TARGETS, LEFT_OUT, ROOT, TARGETS, Target, pinned

LISTED = [target for target in [*TARGETS, *CUDA_TARGETS] if target.lock.is_file()]
SYSTEMS = {"linux-x64": ("posix", "linux", "Linux", "x86_64"),
           "windows-x64": ("nt", "win32", "Windows", "AMD64"),
           "macos-arm64": ("posix", "darwin", "Darwin", "arm64")}  # fmt: skip
NUMPY = {"3.11": "1.26.4", "3.13": "2.2.0"}
"""The oldest of the Blenders with that Python."""

NOT_NEEDED_BY_LISTS = {canonicalize_name(name) for name in LEFT_OUT}

each_list = pytest.mark.parametrize("target", LISTED, ids=lambda target: target.name)


def marker_values(target: Target) -> dict[str, str]:
    """Return what a requirement's conditions see on the target."""
    os_name, system, full, machine = SYSTEMS[target.platform.blender]
    return {
        "os_name": os_name,
        "sys_platform": system,
        "platform_system": full,
        "platform_machine": machine,
        "python_version": target.python.version,
        "python_full_version": f"{target.python.version}.0",
        "extra": "",
    }


def kept(target: Target) -> list[Path]:
    """Return the wheels of a target, if all are on this machine already; else skip."""
    wheels = store.listed(target)
    missing = [wheel.file for wheel in wheels if not (store.kept_wheels() / wheel.file).is_file()]
    if missing:
        pytest.skip(f"not downloaded yet: {', '.join(missing)}")
    return [store.kept_wheels() / wheel.file for wheel in wheels]


def read(wheel: Path, name: str) -> str:
    """Return a file of a wheel's metadata."""
    with zipfile.ZipFile(wheel) as archive:
        (path,) = [n for n in archive.namelist() if n.endswith(f".dist-info/{name}")]
        return archive.read(path).decode()


def test_every_platform_and_python_is_there() -> None:
    assert {target.name for target in TARGETS} == {
        f"{platform}-py{python}"
        for platform in ("linux-x64", "windows-x64", "macos-arm64")
        for python in (311, 313)
    }
    # For the others the index has no build of torch.
    assert {target.name for target in TARGETS if target not in LISTED} <= {"linux-x64-py313"}


@each_list
def test_a_list_names_what_the_addon_imports_in_tested_versions(target: Target) -> None:
    versions = {wheel.name: wheel.version for wheel in store.listed(target)}
    assert set(PACKAGES.values()) <= set(versions)
    assert not NOT_NEEDED_BY_LISTS & {canonicalize_name(name) for name in versions}
    pins = {canonicalize_name(name): version for name, version in pinned().items()}
    differing = {
        name: version
        for name, version in versions.items()
        if version.partition("+")[0] != pins.get(canonicalize_name(name))
    }
    assert all(name.startswith(("cuda-", "nvidia-", "triton")) for name in differing), differing


@each_list
def test_the_names_of_wheels_say_that_they_are_for_this_platform_and_python(target: Target) -> None:
    # Tags as Blender reads them: for what it would not install, its tool has no complaint.
    digits = target.python.version.replace(".", "")
    for wheel in store.listed(target):
        tags = parse_wheel_filename(wheel.file)[3]
        assert any(tag.platform in (*target.platform.tags, "any") or is_older_macos(tag.platform)
                   for tag in tags), wheel.file  # fmt: skip
        assert any(
            tag.interpreter in ("py3", "py2.py3", f"cp{digits}")
            or (tag.abi == "abi3" and int(tag.interpreter[3:]) <= int(digits[1:]))
            for tag in tags
        ), wheel.file


def is_older_macos(platform: str) -> bool:
    """Whether a tag is of macOS up to 14 on Apple's processors."""
    return platform in [f"macosx_{n}_0_{m}" for n in range(11, 15) for m in ("arm64", "universal2")]


def test_the_manifest_of_a_zip_differs_in_platform_and_versions_alone() -> None:
    text = MANIFEST.read_text(encoding="utf-8")
    plain = tomllib.loads(text)
    target = next(target for target in TARGETS if target.name == "windows-x64-py313")
    made = tomllib.loads(manifest_for(text, target, ["b.whl", "a.whl"]))
    assert made.pop("platforms") == ["windows-x64"]
    assert made.pop("blender_version_max") == "5.3.0"
    assert made["blender_version_min"] == "5.1.0"
    assert made["wheels"] == ["./wheels/a.whl", "./wheels/b.whl"]
    changed = {"wheels", "blender_version_min"}
    assert {k: v for k, v in made.items() if k not in changed} == {
        k: v for k, v in plain.items() if k not in changed
    }


def test_a_wheel_that_is_not_the_listed_one_is_never_used(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    wheel = store.listed(LISTED[0])[0]
    (tmp_path / wheel.file).write_bytes(b"another wheel of that name")
    assert not store.is_there(wheel, tmp_path) and not store.is_there(wheel, None)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.delenv("PIP_FIND_LINKS", raising=False)
    with pytest.raises(Unavailable):
        store.download(LISTED[0], [wheel], tmp_path, tmp_path)


def test_a_zip_whose_wheels_cannot_be_had_is_left_out_with_one_line(tmp_path) -> None:
    target = Target(TARGETS[0].platform, TARGETS[0].python._replace(version="3.99"))
    with pytest.raises(
        Unavailable, match=r"never listed: put torch==.*cpu.* WHEELS=folder"
    ) as said:
        store.have(target, tmp_path)
    assert "\n" not in str(said.value)


@each_list
def test_what_the_wheels_require_is_there_or_left_out_on_purpose(target: Target) -> None:
    versions = {canonicalize_name(w.name): w.version for w in store.listed(target)}
    versions["numpy"] = NUMPY[target.python.version]
    for wheel in kept(target):
        lines = HeaderParser().parsestr(read(wheel, "METADATA")).get_all("Requires-Dist") or []
        for need in map(Requirement, lines):
            name = canonicalize_name(need.name)
            if need.marker and not need.marker.evaluate(marker_values(target)):
                continue
            if name in versions:
                assert need.specifier.contains(versions[name], prereleases=True), (wheel, need)
            else:
                assert name in NOT_NEEDED_BY_LISTS, (wheel.name, need)


@each_list
@pytest.mark.slow
def test_the_wheels_contain_code_for_this_platform_and_python(target: Target) -> None:
    for path in kept(target):
        assert store.digest_of(path) in target.lock.read_text(), path.name
        declared = HeaderParser().parsestr(read(path, "WHEEL")).get_all("Tag")
        assert {str(tag) for tag in parse_wheel_filename(path.name)[3]} <= set(declared), path.name
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
            for name in archive.namelist():
                if name.endswith((".so", ".pyd", ".dylib", ".dll")) or ".so." in name:
                    with archive.open(name) as file:
                        check_machine_code(target, name, file.read(4096))


def check_machine_code(target: Target, name: str, head: bytes) -> None:
    """Check the header of a library: its format, its processor, and its Python by its name."""
    kind = target.platform.blender
    if kind == "linux-x64":
        assert head[:4] == b"\x7fELF" and struct.unpack_from("<H", head, 18) == (62,), name
    elif kind == "windows-x64":
        (at,) = struct.unpack_from("<I", head, 60)
        assert head[:2] == b"MZ" and head[at : at + 6] == b"PE\0\0\x64\x86", name
    else:
        assert head[:8] == b"\xcf\xfa\xed\xfe\x0c\0\0\x01" or head[:4] == b"\xca\xfe\xba\xbe", name
    digits = target.python.version.replace(".", "")
    bound = re.search(r"\.(?:cpython-|cp)(\d+)", Path(name).name)
    assert bound is None or bound[1] == digits, name


def test_the_addon_imports_nothing_that_the_zips_leave_out() -> None:
    # What core uses, imported where none of the packages that are left out can be.
    gone = [*LEFT_OUT, "PIL"]
    script = (
        f"import sys; sys.modules.update(dict.fromkeys({gone!r})); del sys.modules['numpy']\n"
        "import liquid_splash_addon.core.rehearsal, skimage.measure, safetensors.torch\n"
        "import liquid_splash_addon.core.generator.generator\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_page_of_licences_names_what_the_zips_contain() -> None:
    page = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    rows = [line.split("|") for line in page.splitlines() if line.startswith("|")][2:]
    named = {(canonicalize_name(row[1].strip()), row[2].strip()) for row in rows}
    for target in TARGETS:
        if target in LISTED:
            wheels = store.listed(target)
            assert named == {
                (canonicalize_name(w.name), w.version.partition("+")[0]) for w in wheels
            }


def test_licences_and_bill_of_materials_are_of_the_wheels_and_nothing_else(tmp_path) -> None:
    pytest.importorskip("piplicenses")
    wheels = [make_wheel(tmp_path, "good", "MIT"), make_wheel(tmp_path, "better", "BSD-3-Clause")]
    notices.write_notices(wheels, tmp_path)
    texts = (tmp_path / notices.LICENCES).read_text()
    assert "better" in texts and "Do as you like." in texts and "numpy" not in texts
    bill = json.loads((tmp_path / notices.SBOM).read_text())
    assert bill["bomFormat"] == "CycloneDX"
    assert {(c["name"], c["version"]) for c in bill["components"]} == {
        ("good", "1.0"), ("better", "1.0")
    }  # fmt: skip
    bad = make_wheel(tmp_path, "bad", "LicenseRef-Proprietary")
    with pytest.raises(Unavailable, match="bad"):
        notices.write_notices([*wheels, bad], tmp_path)
    notices.write_notices([*wheels, bad], tmp_path, is_for_others=False)


def make_wheel(folder: Path, name: str, licence: str) -> Path:
    """Write a wheel without code."""
    path = folder / f"{name}-1.0-py3-none-any.whl"
    metadata = (
        f"Metadata-Version: 2.4\nName: {name}\nVersion: 1.0\n"
        f"License-Expression: {licence}\nLicense-File: LICENSE\n"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{name}-1.0.dist-info/METADATA", metadata)
        archive.writestr(f"{name}-1.0.dist-info/licenses/LICENSE", "Do as you like.")
        archive.writestr(
            f"{name}-1.0.dist-info/RECORD", f"{name}-1.0.dist-info/licenses/LICENSE,,\n"
        )
    return path
