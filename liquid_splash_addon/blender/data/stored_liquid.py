# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid that a splash's mesh stores, where no exporter looks.

It lies in a registered group of properties of the mesh, not in a custom property: Alembic aborts
Blender over bytes in a custom property, and USD writes them out as text.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from uuid import uuid4

import bpy
from bpy.props import FloatProperty, PointerProperty, StringProperty

from . import opened_files

if TYPE_CHECKING:
    from ...core.sketch.strokes import Stroke

OLD_PROPERTY = "splash_fields"
"""Custom property that held the liquid in files from before 0.1."""


class SplashLiquidGroup(bpy.types.PropertyGroup):
    """The stored liquid of a splash, see core's StoredSplash."""

    content: StringProperty(subtype="BYTE_STRING", options={"HIDDEN"})
    identifier: StringProperty(
        description="Given when the liquid was written, new for every writing: equal identifiers "
        "are equal liquids, also in copies and after undo",
        options={"HIDDEN"},
    )
    space: StringProperty(
        description="Transform from drawing space to the mesh as it was written, 16 numbers. "
        "Empty: the identity",
        options={"HIDDEN"},
    )
    kept: StringProperty(
        description="A few vertices as they were written, 4 numbers each: which one, and where",
        options={"HIDDEN"},
    )
    attributes: StringProperty(
        description="Names of the attributes that were written for shaders, beside velocity",
        options={"HIDDEN"},
    )
    made_of: StringProperty(
        description="Digest of the strokes and settings that the liquid was made of, see evaluated",
        options={"HIDDEN"},
    )
    evaluated: StringProperty(
        description="Key of the task that made the geometry. Undo may restore a mesh and keep the "
        "object that says what it was made of",
        options={"HIDDEN"},
    )
    time_scale: FloatProperty(
        description="Time scale of the mesh's velocities; it was 1 before it could be chosen",
        default=1.0,
        options={"HIDDEN"},
    )


def write(mesh: bpy.types.Mesh, content: bytes) -> str:
    """Store ``content`` with ``mesh`` and return its identifier."""
    group = mesh.splash_liquid
    group.content, group.identifier = content, uuid4().hex
    if OLD_PROPERTY in mesh:
        del mesh[OLD_PROPERTY]
    return str(group.identifier)


def read(mesh: bpy.types.Mesh) -> tuple[bytes, str]:
    """Return the stored liquid and its identifier; both empty if there is none.

    A linked mesh from an old file cannot be converted: its custom property is read where it is.
    """
    group = mesh.splash_liquid
    if content := group.content:  # every look at it copies megabytes
        return bytes(content), str(group.identifier)
    old = mesh.get(OLD_PROPERTY)
    return (bytes(old), f"{OLD_PROPERTY} {mesh.name_full}") if old else (b"", "")


_last_strokes: tuple[str, tuple[Stroke, ...]] = ("", ())
"""Identifier of the last liquid whose strokes were read, and those."""


def strokes_of(mesh: bpy.types.Mesh) -> tuple[Stroke, ...]:
    """Return the strokes that the stored liquid was made of, local metres; none if it has none."""
    from ...core.refinement import stored_splash

    global _last_strokes
    identifier = str(mesh.splash_liquid.identifier)
    if not identifier or identifier != _last_strokes[0]:
        _last_strokes = identifier, stored_splash.strokes_of(read(mesh)[0])
    return _last_strokes[1]


def identifier_of(mesh: bpy.types.Mesh) -> str:
    """Return the identifier of the stored liquid alone; "" if there is none."""
    return str(mesh.splash_liquid.identifier) or read(mesh)[1]


def is_made_by(mesh: bpy.types.Mesh, key: str) -> bool:
    """Whether the task with this key made the geometry; true of meshes that do not tell."""
    return str(mesh.splash_liquid.evaluated) in ("", key)


@bpy.app.handlers.persistent
def convert_old(_file: Any = None, _unused: Any = None) -> None:
    """Move liquid out of custom properties: after opening an old file, or appending from one."""
    for mesh in bpy.data.meshes:
        if OLD_PROPERTY in mesh and mesh.is_editable:
            content = bytes(mesh[OLD_PROPERTY])
            if mesh.splash_liquid.content:
                del mesh[OLD_PROPERTY]
            else:
                write(mesh, content)


register_classes, unregister_classes = bpy.utils.register_classes_factory((SplashLiquidGroup,))


def register() -> None:
    """Add ``Mesh.splash_liquid``, and convert what is open."""
    register_classes()
    bpy.types.Mesh.splash_liquid = PointerProperty(type=SplashLiquidGroup)
    opened_files.listen(convert_old)


def unregister() -> None:
    """Remove ``Mesh.splash_liquid``."""
    opened_files.ignore(convert_old)
    del bpy.types.Mesh.splash_liquid
    unregister_classes()
