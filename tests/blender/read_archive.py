# SPDX-License-Identifier: GPL-3.0-or-later
"""Read the meshes of an Alembic or USD file without Blender, by those projects' own libraries::

python read_archive.py FILE OUT.npz

OUT has an array for each mesh and attribute, ``path:attribute``, of an Alembic file also those of
its later samples, ``path:attribute@1``, and the text of everything that has a name in ``text``. A
process of its own, as Blender's module has a USD of its own.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

Named = Iterator[tuple[str, np.ndarray]]


def read_usd(path: str) -> Named:
    """Yield the attributes of all meshes of a USD file."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(path)
    yield "text", np.array(stage.ExportToString())
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        for name, attribute in (
            ("position", UsdGeom.Mesh(prim).GetPointsAttr()),
            ("velocity", UsdGeom.Mesh(prim).GetVelocitiesAttr()),
            ("radius", prim.GetAttribute("primvars:radius")),
            ("corners", UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr()),
        ):
            if attribute and attribute.HasValue():
                yield f"{prim.GetPath()}:{name}", np.array(attribute.Get())


def read_alembic(path: str) -> Named:
    """Yield the attributes of all meshes of an Alembic file."""
    from alembic3d.Abc import IArchive

    names: list[str] = []
    yield from walk(IArchive(path).getTop(), names)
    yield "text", np.array("\n".join(names))


def walk(item: Any, names: list[str]) -> Named:
    """Yield the attributes of a mesh of an Alembic file, and of all below it."""
    from alembic3d.Abc import ISampleSelector, WrapExistingFlag
    from alembic3d.AbcGeom import IPolyMesh

    list_properties(item.getProperties(), item.getFullName(), names)
    if IPolyMesh.matches(item.getHeader()):
        schema = IPolyMesh(item, WrapExistingFlag.kWrapExisting).getSchema()
        for name, found in (
            ("position", schema.getPositionsProperty()),
            ("velocity", schema.getVelocitiesProperty()),
            ("corners", schema.getFaceIndicesProperty()),
        ):
            for sample in range(found.getNumSamples() if found.valid() else 0):
                kind = np.int64 if name == "corners" else np.float32
                time = found.getTimeSampling().getSampleTime(sample)
                at = found.getValue(ISampleSelector(time))
                values = [value if kind is np.int64 else tuple(value) for value in at]
                label = f"{name}@{sample}" if sample else name
                yield f"{item.getFullName()}:{label}", np.array(values, dtype=kind)
    for number in range(item.getNumChildren()):
        yield from walk(item.getChild(number), names)


def list_properties(group: Any, path: str, names: list[str]) -> None:
    """Append the names of all properties of a group."""
    for number in range(group.getNumProperties()):
        header = group.getPropertyHeader(number)
        names.append(f"{path}/{header.getName()}")
        if header.isCompound():
            list_properties(group.getProperty(number), names[-1], names)


if __name__ == "__main__":
    read = {".abc": read_alembic, ".usdc": read_usd}[Path(sys.argv[1]).suffix]
    np.savez(sys.argv[2], **dict(read(sys.argv[1])))
