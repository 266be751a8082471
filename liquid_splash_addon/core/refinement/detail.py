# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of one step of refinement."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..liquid.level_set import LevelSet
from .drop_meshes import DropCloud


@dataclass(frozen=True)
class Detail:
    """A splash after a step of refinement.

    Attributes
    ----------
    liquid : the splash, with the drops that merged with it
    gained : volume that the step added, cells^3, free drops included; negative if it removed some
    warnings : sentences for the user
    cloud : drops of this step that fly free
    """

    liquid: LevelSet
    gained: float = 0.0
    warnings: list[str] = field(default_factory=list)
    cloud: DropCloud = field(default_factory=DropCloud.empty)
