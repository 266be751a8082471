# SPDX-License-Identifier: GPL-3.0-or-later
"""Packages that are missing, are not what their name says, or do not load."""

import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from liquid_splash_addon.core import packages
from liquid_splash_addon.core.packages import (
    PackageError,
    advice_for,
    broken_packages,
    is_installed,
    load,
)

ROOT = Path(__file__).resolve().parents[2]
ADVICE = "install it again, then restart Blender. The Splash tab in the sidebar shows how"


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """Return a folder where modules are found, for packages of this test alone."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(packages, "PACKAGES", {"its_module": "its-package"})
    monkeypatch.setattr(packages, "_broken", {})
    monkeypatch.delitem(sys.modules, "its_module", raising=False)
    yield tmp_path
    sys.modules.pop("its_module", None)


def test_what_is_there_is_found_without_importing_it(place):
    assert not is_installed("its_module")
    with pytest.raises(PackageError, match=r"Not installed: its-package\. The Splash tab"):
        load("its_module")
    (place / "its_module.py").write_text("here = True")
    assert is_installed("its_module") and "its_module" not in sys.modules
    assert load("its_module").here and not broken_packages()


def test_a_folder_of_that_name_is_no_package(place):
    (place / "its_module").mkdir()
    assert not is_installed("its_module")
    __import__("its_module")  # as another add-on may do
    assert not is_installed("its_module")


def test_a_stand_in_without_a_spec_does_not_end_the_check(place, monkeypatch):
    monkeypatch.setitem(sys.modules, "its_module", ModuleType("its_module"))
    assert sys.modules["its_module"].__spec__ is None
    assert not is_installed("its_module")
    (place / "its_module.py").touch()
    assert is_installed("its_module")


def test_an_import_that_is_blocked_is_missing(place, monkeypatch):
    monkeypatch.setitem(sys.modules, "its_module", None)
    assert not is_installed("its_module")


@pytest.mark.parametrize(
    "error", ["OSError('[WinError 126] no fbgemm.dll')", "ImportError()", "ValueError('size')"]
)
def test_what_does_not_load_gives_advice_each_time(place, error):
    (place / "its_module.py").write_text(f"raise {error}")
    assert is_installed("its_module")
    said = set()
    for _ in range(2):
        with pytest.raises(PackageError, match=re.escape(ADVICE)) as caught:
            load("its_module")
        said.add(str(caught.value))
    assert len(said) == 1 and said.pop().startswith("The package its-package is broken (")
    assert broken_packages() == ["its-package"]


def test_errors_of_importing_what_is_not_ours_are_told_as_they_are(place):
    assert advice_for(ImportError("no such thing", name="elsewhere")) == "no such thing"
    assert ADVICE in advice_for(ImportError("no such library", name="its_module._part"))
    assert broken_packages() == ["its-package"]


@pytest.mark.parametrize("name", ["numba", "torch"])
def test_core_says_which_package_is_broken(name, tmp_path):
    (tmp_path / f"{name}.py").write_text("raise OSError('no such library')")
    script = (
        f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]\n"
        "from liquid_splash_addon.core.packages import PackageError\n"
        "try:\n"
        "    from liquid_splash_addon.core import pipeline\n"
        "    from liquid_splash_addon.core.generator.loading import load_generator, pick_device\n"
        "    pick_device('AUTO')\n"
        "except PackageError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert f"The package {name} is broken (no such library)" in done.stdout, done.stderr


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs Linux")
def test_the_largest_library_is_loaded_before_the_import():
    """The import holds Python's lock, and Blender's interface waits for it."""
    script = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from liquid_splash_addon.core import packages\n"
        "packages.preload_torch()\n"
        "assert 'torch' not in sys.modules\n"
        "print('libtorch_cpu' in open('/proc/self/maps').read())\n"
        "print(packages.load('torch').ones(2).sum().item())\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.split() == ["True", "2.0"], done.stderr
