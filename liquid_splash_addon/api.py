# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes from scripts, in Blender and in any Python; described in docs/api.md.

::

    from liquid_splash_addon import api  # as an extension: from bl_ext.user_default.liquid_splash

    splash = api.make_splash(api.read_strokes("strokes.csv"), "FRESH", seed=3)
    splash.save("splash.ply")

What is listed in ``__all__`` is the interface, of version :data:`API_VERSION`; nothing else of the
add-on is. Lengths are in the units of the strokes, velocities in those units per second of real
time.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .core.composition.drops import Drops
from .core.packages import PACKAGES, PackageError, is_installed
from .core.progress import Cancelled, Report
from .core.refinement.presets import PRESETS
from .core.refinement.settings import KINDS, RefinementSettings
from .core.refinement.viscous import for_liquid
from .core.settings import SplashSettings
from .core.sketch.drawing import Drawing, drawing_scale, strokes_from_drawings, usable_drawings
from .core.sketch.presets import PRESETS as SKETCHES
from .core.sketch.strokes import Stroke, StrokeError
from .core.stroke_files.limits import StrokeFileError
from .core.stroke_files.reading import read_strokes, write_strokes

if TYPE_CHECKING:
    from .core.generator.generator import Generator
    from .core.mesh.mesh import Mesh

__all__ = [
    "API_VERSION",
    "REFINEMENTS",
    "Cancelled",
    "Drawing",
    "Drops",
    "PackageError",
    "Splash",
    "SplashSettings",
    "Stroke",
    "StrokeError",
    "StrokeFileError",
    "__version__",
    "make_splash",
    "preset_sketch",
    "read_strokes",
    "refinement",
    "write_strokes",
]

API_VERSION = "1.0.0"
"""Version of this interface (semver.org), and of the command line: major, minor, patch."""

REFINEMENTS: dict[str, str] = {
    **{name: preset.about for name, preset in PRESETS.items()},
    **{name: kind.about for name, kind in KINDS.items()},
}
"""What can be named as a refinement, and what it is: lists of several (presets) and single ones."""


def manifest_version() -> str:
    """Return the extension's version, which its manifest alone holds."""
    here = Path(__file__).resolve().parent
    # Installed, the manifest lies beside this file; in a checkout, beside the package.
    found = (folder / "blender_manifest.toml" for folder in (here, here.parent))
    manifest = next(path for path in found if path.is_file())
    return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"])


__version__ = manifest_version()


@dataclass(frozen=True)
class Splash:
    """A finished splash.

    Attributes
    ----------
    vertices : float32 ``(n, 3)``, in the units of the strokes
    faces : int32 ``(m, 3)``, triangles of a closed surface, seen from outside counterclockwise
    velocities : float32 ``(n, 3)``, of the vertices, units per second of real time
    drops : those of the refinements that fly free, None if there are none. Drops that are large
        enough are in the mesh too, as ``drops.meshed`` says
    warnings : sentences for the user
    """

    vertices: np.ndarray
    faces: np.ndarray
    velocities: np.ndarray
    drops: Drops | None = None
    warnings: list[str] = field(default_factory=list)

    def save(self, path: str | Path) -> None:
        """Write a .ply, .obj or .npz file, in whole or not at all. Raises ValueError, OSError."""
        from .core.mesh_files import write_mesh

        write_mesh(path, self._mesh(), self.drops)

    def to_object(self, name: str = "Splash") -> Any:
        """Return it as a new mesh object of Blender's active collection; only in Blender.

        The extension must be enabled. The object has the attribute ``velocity`` and the water
        material; it is an ordinary mesh, without settings to change afterwards.
        """
        from .blender.scene.mesh_object import plain_object

        return plain_object(self._mesh(), name)

    def _mesh(self) -> Mesh:
        from .core.mesh.mesh import Mesh

        return Mesh(self.vertices, self.faces, self.velocities)


def make_splash(
    strokes: Sequence[Drawing | Stroke | np.ndarray],
    refine: str | RefinementSettings | Sequence[str | RefinementSettings] = (),
    *,
    obstacles: Sequence[tuple[np.ndarray, np.ndarray]] = (),
    weights: str | Path | None = None,
    precision: str = "",
    report: Report | None = None,
    **settings: Any,
) -> Splash:
    """Return the splash of some strokes.

    strokes : each a Drawing (points, times, pressures or speeds), a Stroke (points, and velocities
        of the hand) or an array ``(n, 3)`` of points, drawn at the speed ``stroke_speed``
    refine : names of REFINEMENTS, or what :func:`refinement` returns; several are done in order
    obstacles : meshes to keep out of, each of vertices ``(n, 3)`` and triangles ``(m, 3)``
    weights : a weights file, by default the bundled one
    precision : number format ("float32", "bfloat16", "int8", "int8_bfloat16"). By default the
        fastest here; name one to get the same splash on different machines
    report : called with what is done next and the share done; may raise Cancelled to stop
    settings : fields of SplashSettings, as ``seed=3``

    Strokes that cannot be used are left out with a warning. Raises StrokeError where no splash can
    be made of them, ValueError for settings, names and files that are not right, PackageError where
    a package is missing: each with a sentence that says what to do.
    """
    check_packages()
    chosen = splash_settings(**settings)
    steps = for_liquid(refinements(refine), chosen.liquid)
    made, warnings = with_velocities(strokes, chosen)
    from .core.obstacles.obstacles import obstacle_from_mesh
    from .core.pipeline import make_splash as make

    solids = [obstacle_from_mesh(vertices, faces) for vertices, faces in obstacles]
    generator = generator_of(weights, chosen.device, precision)
    splash = make(made, chosen, generator, None, report, steps, solids)
    mesh = splash.mesh
    return Splash(
        mesh.vertices, mesh.faces, mesh.velocities, splash.drops, warnings + splash.warnings
    )


def refinement(name: str, **settings: Any) -> RefinementSettings:
    """Return a single refinement with settings, as ``refinement("DROPLETS", amount=0.004)``.

    Raises ValueError for a name that is none, TypeError for settings that it does not have.
    """
    kind = KINDS.get(name.upper())
    if kind is None:
        raise ValueError(f"There is no refinement {name!r}: choose one of {', '.join(KINDS)}")
    return kind(**settings)


def preset_sketch(name: str = "CROWN", **controls: Any) -> list[Drawing]:
    """Return a sketch that code draws, as *Presets* in Blender does, with the same controls.

    Raises ValueError for a name that is none, TypeError for controls that it does not have.
    """
    preset = SKETCHES.get(name.upper())
    if preset is None:
        raise ValueError(f"There is no sketch {name!r}: choose one of {', '.join(SKETCHES)}")
    return [drawing for layer in preset(**controls).layers().values() for drawing in layer]


def check_packages() -> None:
    """Raise PackageError, with the command that helps, if a package is missing."""
    missing = [name for module, name in PACKAGES.items() if not is_installed(module)]
    if missing:
        raise PackageError(
            f"Not installed: {', '.join(missing)}. Run: python -m pip install {' '.join(missing)}"
        )


def splash_settings(**settings: Any) -> SplashSettings:
    """Return settings by name; the resolution may be a number. Raises ValueError, TypeError."""
    if "resolution" in settings:
        settings["resolution"] = str(settings["resolution"])
    return SplashSettings(**settings)


def refinements(
    refine: str | RefinementSettings | Sequence[str | RefinementSettings],
) -> list[RefinementSettings]:
    """Return the steps that are meant, those of presets one by one. Raises ValueError."""
    given = [refine] if isinstance(refine, str | RefinementSettings) else refine
    steps: list[RefinementSettings] = []
    for item in given:
        if isinstance(item, RefinementSettings):
            steps.append(item)
        elif item.upper() in PRESETS:
            steps += PRESETS[item.upper()].steps
        elif item.upper() in KINDS:
            steps.append(KINDS[item.upper()]())
        else:
            raise ValueError(
                f"There is no refinement {item!r}: choose one of {', '.join(REFINEMENTS)}"
            )
    return steps


def with_velocities(
    given: Sequence[Drawing | Stroke | np.ndarray], settings: SplashSettings
) -> tuple[list[Stroke], list[str]]:
    """Return the strokes with velocities, in the units given, and warnings. Raises StrokeError."""
    strokes = [as_stroke(number, item) for number, item in enumerate(given, start=1)]
    _, faulty, left_out = usable_drawings([as_drawing(stroke) for stroke in strokes])
    usable = [stroke for number, stroke in enumerate(strokes) if number not in set(faulty)]
    scale = drawing_scale([as_drawing(stroke) for stroke in usable], settings.real_size)
    drawn = [stroke for stroke in usable if isinstance(stroke, Drawing)]
    timed, warnings = strokes_from_drawings(drawn, settings, scale) if drawn else ([], [])
    with_speed = iter(timed)
    made = [next(with_speed) if isinstance(s, Drawing) else s for s in usable]
    return made, left_out + warnings


def as_stroke(number: int, item: Drawing | Stroke | np.ndarray) -> Drawing | Stroke:
    """Return what was given, points alone as a Drawing. Raises StrokeError for other arrays."""
    if isinstance(item, Stroke):
        return item
    drawing = item if isinstance(item, Drawing) else Drawing(np.asarray(item, dtype=np.float64))
    points = np.asarray(drawing.points)
    if points.ndim != 2 or points.shape[1] != 3:
        raise StrokeError(f"Stroke {number} needs points of shape (n, 3), not {points.shape}")
    for name in ("times", "pressures", "speeds"):
        values = getattr(drawing, name)
        if values is not None and np.shape(values) != (len(points),):
            raise StrokeError(
                f"Stroke {number} has {len(points)} points, so its {name} need the shape "
                f"({len(points)},), not {np.shape(values)}"
            )
    return drawing


def as_drawing(stroke: Drawing | Stroke) -> Drawing:
    """Return a stroke as a Drawing that shows the same faults and size."""
    if isinstance(stroke, Drawing):
        return stroke
    return Drawing(stroke.points, speeds=np.linalg.norm(stroke.velocities, axis=1))


def generator_of(weights: str | Path | None, device: str, precision: str) -> Generator:
    """Return the generator of a weights file, kept until another is asked for.

    Raises WeightsError (a ValueError) for a file or a device that cannot be used, ValueError.
    """
    from .core.generator.weights_file import default_weights_path

    path = default_weights_path() if weights is None else Path(weights)
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    return kept_generator(path, changed, device, precision)


@lru_cache(maxsize=1)
def kept_generator(path: Path, changed: int, device: str, precision: str) -> Generator:
    """Return the generator as :func:`generator_of` does; changed : when the file was written."""
    from .core.generator.loading import load_fastest, load_generator, load_torch

    if not precision:
        return load_fastest(path, device)
    load_torch()
    from .core.generator.precision import PRECISIONS

    if precision not in PRECISIONS:
        raise ValueError(f"precision must be one of {', '.join(PRECISIONS)}, not {precision!r}")
    return load_generator(path, device, precision)
