# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects are splashes and models, without looking at all objects every time.

Panels and buttons ask with every redraw. Blender's own look-ups by name, and even its count of
objects, walk through all of them, so the objects found are kept themselves. They are dropped before
whatever may free them without Python's knowledge (undo, redo, another file), kept again only after
it, and looked for again once something was added to a scene, removed from one, or marked as a
splash or a model.

Only what is in a scene counts: a deleted object lives on while a property refers to it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy


class Mark(NamedTuple):
    """What makes an object a splash or a model: a property in a group that it was given."""

    group: str
    name: str


SPLASH = Mark("splash", "version")
MODEL = Mark("splash_model", "is_model")


class Found(NamedTuple):
    """What a look at all objects found.

    Attributes
    ----------
    splashes : of each scene, by the scene's session_uid
    models : of all scenes, ordered by name: an original comes before its copies
    uids : session_uids of all these objects
    """

    splashes: dict[int, list[bpy.types.Object]]
    models: list[bpy.types.Object]
    uids: set[int]


_found: Found | None = None
_revision = 0
_may_keep = True
"""Whether what is found stays valid: not while Blender reads another state."""


def carries(item: bpy.types.Object | None, mark: Mark) -> bool:
    """Whether there is an object and it has ``mark``.

    Merely reading a group of properties that an object does not have would give it one.
    """
    if item is None or item.type != "MESH" or not item.is_property_set(mark.group):
        return False
    return bool(getattr(getattr(item, mark.group), mark.name))


def splashes(scene: bpy.types.Scene | None = None) -> list[bpy.types.Object]:
    """List the splashes of a scene in its order, or of all scenes."""
    found = current()
    if scene is not None:
        return list(found.splashes.get(scene.session_uid, ()))
    unique = {item.session_uid: item for listed in found.splashes.values() for item in listed}
    return list(unique.values())


def models() -> list[bpy.types.Object]:
    """List the models of all scenes."""
    return list(current().models)


def is_in_scene(item: bpy.types.Object) -> bool:
    """Whether a splash or a model is in any scene."""
    return item.session_uid in current().uids


def current() -> Found:
    """Return what there is; look at all objects only if something has changed."""
    global _found
    if _found is not None and is_valid(_found):
        return _found
    found = scan()
    _found = found if _may_keep else None
    return found


def is_valid(found: Found) -> bool:
    """Whether everything that was found still exists and is what it was."""
    try:
        return all(carries(item, MODEL) for item in found.models) and all(
            carries(item, SPLASH) for listed in found.splashes.values() for item in listed
        )
    except ReferenceError:  # deleted by a script
        return False


def scan() -> Found:
    """Look at the objects of all scenes."""
    found = Found({}, [], set())
    for scene in bpy.data.scenes:
        for item in scene.objects:
            if carries(item, SPLASH):
                found.splashes.setdefault(scene.session_uid, []).append(item)
            elif carries(item, MODEL):
                if item.session_uid not in found.uids:
                    found.models.append(item)
            else:
                continue
            found.uids.add(item.session_uid)
    found.models.sort(key=lambda item: item.name_full)
    return found


def revision() -> int:
    """Return a number that is another one whenever something may have been added or removed."""
    return _revision


@bpy.app.handlers.persistent
def forget(_first: Any = None, _second: Any = None) -> None:
    """Look at all objects again when next asked; an ``update`` callback and a handler as well."""
    global _found, _revision
    _found = None
    _revision += 1


@bpy.app.handlers.persistent
def before_reading(_first: Any = None, _second: Any = None) -> None:
    """Keep nothing from now on: a reference to a freed object crashes Blender."""
    global _may_keep
    _may_keep = False
    forget()


@bpy.app.handlers.persistent
def after_reading(_first: Any = None, _second: Any = None) -> None:
    """Keep what is found from now on."""
    global _may_keep
    _may_keep = True
    forget()


@bpy.app.handlers.persistent
def notice_collections(_scene: Any, graph: bpy.types.Depsgraph) -> None:
    """Forget if objects were added to a scene or removed from one: that changes a collection."""
    if graph.id_type_updated("COLLECTION"):
        forget()


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    before = (known.undo_pre, known.redo_pre, known.load_pre)
    after = (known.undo_post, known.redo_post, known.load_post, known.load_post_fail)
    return [
        *((moment, before_reading) for moment in before),
        *((moment, after_reading) for moment in after),
        (known.depsgraph_update_post, notice_collections),
    ]


def register() -> None:
    """Start to watch for changes, before all who ask when something has changed."""
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop watching."""
    for known, handler in handlers():
        known.remove(handler)
    after_reading()
