# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's properties are core's one list of parameters."""

from dataclasses import fields, replace

import bpy
import pytest

import liquid_splash_addon
from liquid_splash_addon.blender.data.properties import assign_settings, to_settings
from liquid_splash_addon.core.settings import SplashSettings

NAMES = [item.name for item in fields(SplashSettings)]
OWN = {"rna_type", "name", "bl_idname"}
MAKERS = ("generate", "regenerate", "realign")


def new_object() -> bpy.types.Object:
    return bpy.data.objects.new("any", None)


@pytest.mark.parametrize("owner", [lambda: bpy.context.scene, new_object], ids=["scene", "object"])
def test_property_groups_match(owner):
    group = owner().splash.settings
    assert [p.identifier for p in group.bl_rna.properties if p.identifier not in OWN] == NAMES
    assert to_settings(group) == SplashSettings()


@pytest.mark.parametrize("name", MAKERS)
def test_redo_panels_match(name):
    properties = getattr(bpy.ops.splash, name).get_rna_type().properties
    own = OWN | ({"start"} if name == "generate" else set())
    assert [p.identifier for p in properties if p.identifier not in own] == NAMES
    defaults = {p.identifier: p.default for p in properties if p.identifier in NAMES}
    assert defaults == pytest.approx(vars(SplashSettings()))


@pytest.mark.parametrize("item", fields(SplashSettings), ids=lambda item: item.name)
def test_all_allowed_values_pass_both_ways(item):
    """In particular the limits: single precision puts 0.01 below 0.01."""
    limits = item.metadata
    values = (
        [i[0] for i in limits["items"]] if "items" in limits else [limits["low"], limits["high"]]
    )
    for value in values:
        settings = replace(SplashSettings(), **{item.name: value})
        assign_settings(bpy.context.scene.splash.settings, settings)
        assert to_settings(bpy.context.scene.splash.settings) == settings


@pytest.mark.parametrize("item", fields(SplashSettings), ids=lambda item: item.name)
def test_values_beyond_the_limits_are_held_back(item):
    group = bpy.context.scene.splash.settings
    if "items" in item.metadata:
        with pytest.raises(TypeError):
            setattr(group, item.name, "no such thing")
    elif not isinstance(item.default, bool):  # which have none
        setattr(group, item.name, type(item.default)(-1e9))
        assert getattr(to_settings(group), item.name) == item.metadata["low"]


def test_registering_again_works_and_leaves_nothing():
    liquid_splash_addon.unregister()
    try:
        assert not hasattr(bpy.types.Object, "splash")
        assert not hasattr(bpy.types.Scene, "splash")
        assert not [name for name in dir(bpy.types) if name.startswith("SPLASH_")]
    finally:
        liquid_splash_addon.register()
    assert to_settings(bpy.context.scene.splash.settings) == SplashSettings()
