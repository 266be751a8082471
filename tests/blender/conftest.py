# SPDX-License-Identifier: GPL-3.0-or-later
"""For the tests in Blender: the add-on, and a generator that needs no weights."""

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def addon() -> Iterator[None]:
    """Register the add-on by hand, once."""
    import liquid_splash_addon

    liquid_splash_addon.register()
    yield
    liquid_splash_addon.unregister()


@pytest.fixture
def tubes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every splash be made by the TubeGenerator."""
    from liquid_splash_addon.blender.jobs import loaded_generator
    from tests.blender.sketching import TubeGenerator

    monkeypatch.setattr(loaded_generator, "get", lambda *_: TubeGenerator())


@pytest.fixture
def thick_drafts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every splash be a draft of thick tubes, which can be joined without loss."""
    import bpy

    from liquid_splash_addon.blender.jobs import loaded_generator
    from tests.blender.modelling import ThickTubes

    monkeypatch.setattr(loaded_generator, "get", lambda *_: ThickTubes())
    bpy.context.scene.splash.settings.resolution = "64"
