# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid Splash: draw a few strokes, get a splash with its flow."""


def register() -> None:
    """Register the add-on with Blender."""
    from . import blender  # here, not above: core must import without Blender

    blender.register()


def unregister() -> None:
    """Remove the add-on from Blender."""
    from . import blender

    blender.unregister()
