"""Shadow volumes of each part at some moments, as closed meshes: GLB and OBJ."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from umbra.casters.casting import select_casters
from umbra.errors import InputError
from umbra.study import Study
from umbra.study.preview import Moment
from umbra.volume.adjacency import make_caster
from umbra.volume.solids import Solid, make_shadow_solid
from umbra.writers.glb import Glb, turn_y_up

__all__ = ["EVERY", "MOST", "write_solids"]

EVERY = 60
"""Interval of the clock times by default [min]."""
MOST = 24
"""Most moments without times of one's own."""
_LARGEST = 20_000_000  # triangles of all solids
_COLOR = (0.27, 0.30, 0.45, 0.5)


def write_solids(
    folder: Path,
    study: Study,
    moments: Sequence[Moment],
    cast: Sequence[str] = (),
    no_cast: Sequence[str] = (),
) -> float:
    """
    Write ``solids.glb`` and ``solids.obj``, and return the height of the ground [m].

    Parameters
    ----------
    folder : Path
    study : Study
    moments : sequence of Moment
        With the sun up.
    cast, no_cast : sequences of str
        Patterns of the parts that cast shadows, as of the study.

    Raises
    ------
    InputError
        If there would be too many triangles.
    """
    scene = study.model.scene
    parts = select_casters(scene, cast, no_cast)
    height = float(study.ground if study.kind.is_level else scene.bounds()[0, 2])
    ground = height - float(scene.origin[2])
    # A lit face makes two, and two for each of its edges.
    count = 4 * len(scene.triangles(parts).faces) * len(moments)
    if count > _LARGEST:
        msg = (
            f"shadow volumes of {len(parts)} parts at {len(moments)} times are some {count:,} "
            "triangles; choose parts with cast= and times with at="
        )
        raise InputError(msg, option="write")
    origin = scene.origin
    facts = study.facts
    glb = Glb(
        f"umbra {facts['umbra_version']}",
        {"origin": origin.tolist(), "crs": facts.get("crs"), "ground": height},
    )
    material = glb.add_material(baseColorFactor=list(_COLOR))
    glb.materials[material]["alphaMode"] = "BLEND"
    with (folder / "solids.obj").open("w", encoding="utf-8") as file:
        file.write(f"# shadow volumes, z up [m], cut at z = {height:.17g}\n")
        first = 1
        for name, solid in _find_solids(study, parts, moments, ground):
            _write_object(file, name, solid, origin, first)
            first += len(solid.vertices)
            points = turn_y_up(solid.vertices)
            glb.add_mesh(name, solid.faces.astype(np.uint32), material, POSITION=points)
    glb.write(folder / "solids.glb")
    return height


def _find_solids(
    study: Study, parts: Sequence[int], moments: Sequence[Moment], ground: float
) -> Iterator[tuple[str, Solid]]:
    """Yield the solids that are not empty with their names, moment by moment."""
    scene = study.model.scene
    labels = scene.labels()
    casters = []
    for part in parts:
        soup = scene.triangles([part])
        casters.append(make_caster(soup.vertices, soup.faces))
    for moment in moments:
        for part, caster in zip(parts, casters, strict=True):
            solid = make_shadow_solid(caster, moment.direction, ground)
            if len(solid.faces):
                yield f"{moment.local:%Y-%m-%d %H:%M} {labels[part]}", solid


def _write_object(file: TextIO, name: str, solid: Solid, origin: np.ndarray, first: int) -> None:
    """Write a solid as an object of an OBJ file; ``first`` numbers its first vertex."""
    clean = " ".join(name.split())
    lines = [f"o {clean}"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in (solid.vertices + origin).tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (solid.faces + first).tolist()]
    file.write("\n".join(lines) + "\n")
