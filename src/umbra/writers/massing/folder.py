"""The folder of an envelope's files: heights as GeoTIFF, OBJ, GLB and CityJSON, and the sheet."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError, find_similar
from umbra.folders.atomic import check_folder_name, replace_results
from umbra.massing.bisection import PartHeight
from umbra.massing.search import HeightEnvelope
from umbra.scene import Mesh
from umbra.version import __version__
from umbra.writers.glb import Glb, turn_y_up
from umbra.writers.massing.envelope_sheet import draw_envelope
from umbra.writers.vectors.gis_files import write_geotiff

__all__ = ["EXTRA", "check_formats", "write_envelope", "write_part_height"]

EXTRA = ("cityjson", "pdf", "svg", "json")
"""Formats besides those that are always written."""


def check_formats(formats: Sequence[str]) -> None:
    """Refuse an unknown format."""
    for name in formats:
        if name not in EXTRA:
            near = find_similar(name, EXTRA)
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(EXTRA)}"
            msg = f"write '{name}' is not known; {advice}"
            raise InputError(msg, option="write")


def write_envelope(
    out: Path,
    envelope: HeightEnvelope,
    formats: Sequence[str] = (),
    say: Callable[[str], object] = lambda _line: None,
) -> list[Path]:
    """
    Write an envelope's files into a folder, which is replaced once all are complete.

    Parameters
    ----------
    out : Path
    envelope : HeightEnvelope
    formats : sequence of str
        Of ``EXTRA``.
    say : callable
        Called with what is told of earlier results.
    """
    check_formats(formats)
    check_folder_name(out)
    names = ["envelope.png", "envelope.tif", "envelope.obj", "envelope.glb"]
    with replace_results(out, say) as folder:
        sheet = draw_envelope(envelope)
        sheet.save(folder / "envelope.png")
        write_height_raster(folder / "envelope.tif", envelope)
        write_height_obj(folder / "envelope.obj", envelope)
        write_height_glb(folder / "envelope.glb", envelope)
        for name in dict.fromkeys(formats):
            if name == "cityjson":
                names.append("envelope.city.json")
                write_height_cityjson(folder / names[-1], envelope)
            elif name == "json":
                names.append("envelope.json")
                facts = orjson.dumps(envelope.sum_up(), option=orjson.OPT_INDENT_2)
                (folder / names[-1]).write_bytes(facts + b"\n")
            else:
                names.append(f"envelope.{name}")
                sheet.save(folder / names[-1])
    return [out / name for name in names]


def write_part_height(
    out: Path, part_height: PartHeight, say: Callable[[str], object] = lambda _line: None
) -> list[Path]:
    """Write a part at its greatest height: ``envelope.obj``, ``.glb`` and ``.json``."""
    check_folder_name(out)
    names = ["envelope.obj", "envelope.glb", "envelope.json"]
    with replace_results(out, say) as folder:
        write_part(folder / names[0], folder / names[1], part_height)
        facts = orjson.dumps(part_height.sum_up(), option=orjson.OPT_INDENT_2)
        (folder / names[2]).write_bytes(facts + b"\n")
    return [out / name for name in names]


_NONE = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
_COLOR = [0.87, 0.62, 0.36, 1.0]  # of the solid, linear
_SCALE = 1e-4  # of CityJSON's whole numbers [m]


def write_height_raster(path: Path, envelope: HeightEnvelope) -> None:
    """Write the heights, with each cell's own bound, as a GeoTIFF."""
    plot, result = envelope.found.plot, envelope.found
    ground = plot.spread(plot.ground + envelope.scene.origin[2])
    bands = [
        ("height", "m", envelope.heights.astype(np.float32)),
        ("height_bound", "m", plot.spread(result.ceiling).astype(np.float32)),
        ("ground", "m", ground.astype(np.float32)),
    ]
    facts: dict[str, object] = {
        "umbra_version": __version__, "rules": "; ".join(envelope.rules),
        "times": "; ".join(envelope.times),
        **{name: f"{value:.6g}" for name, value in envelope.sum_up().items()
           if isinstance(value, float)},
    }  # fmt: skip
    write_geotiff(
        path, envelope.x, envelope.y, bands, cell=(envelope.cell, envelope.cell),
        crs=envelope.scene.crs, facts=facts,
    )  # fmt: skip


def write_height_obj(path: Path, envelope: HeightEnvelope) -> None:
    """Write the solid in the model's own coordinates, z up [m]."""
    title = f"envelope of {envelope.volume_m3:,.0f} m3"
    _write_obj(path, "envelope", envelope.mesh or _NONE, title, envelope.scene.crs)


def write_height_glb(path: Path, envelope: HeightEnvelope) -> None:
    """Write the solid about the middle of the plot, which ``origin`` of the extras states."""
    foot = float(envelope.found.plot.foot.min() + envelope.scene.origin[2])
    origin = np.array([np.mean(envelope.x), np.mean(envelope.y), foot])
    facts = {"crs": envelope.scene.crs, **envelope.sum_up()}
    _write_glb(path, "envelope", envelope.mesh or _NONE, origin, facts)


def write_part(obj: Path, glb: Path, part_height: PartHeight) -> None:
    """Write a part of a model at its greatest height as OBJ and GLB."""
    scene = part_height.scene
    soup = scene.triangles(scene.select((part_height.part,), option="max_height"))
    mesh = Mesh(soup.vertices + scene.origin, soup.faces)
    _write_obj(
        obj,
        part_height.part,
        mesh,
        f"{part_height.part}, {part_height.height_m:.2f} m high",
        scene.crs,
    )
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    origin = np.array([*(low + high)[:2] / 2, low[2]])
    _write_glb(glb, part_height.part, mesh, origin, {"crs": scene.crs, **part_height.sum_up()})


def _write_obj(path: Path, name: str, mesh: Mesh, title: str, crs: str | None) -> None:
    lines = [
        f"# umbra {__version__}: {title}; z is up, metres",
        f"# {crs or 'the coordinates of the model'}",
        f"o {name}",
        *("v %.6f %.6f %.6f" % tuple(corner) for corner in mesh.vertices.tolist()),  # noqa: UP031
        *("f %d %d %d" % tuple(face) for face in (mesh.faces + 1).tolist()),  # noqa: UP031
    ]
    # A name from a file may hold a line's end.
    path.write_text("\n".join(line.replace("\n", " ") for line in lines) + "\n", encoding="utf-8")


def _write_glb(
    path: Path, name: str, mesh: Mesh, origin: NDArray[np.float64], facts: dict[str, Any]
) -> None:
    glb = Glb(f"umbra {__version__}", {"origin": origin.tolist(), **facts})
    if len(mesh.faces):
        material = glb.add_material(baseColorFactor=_COLOR)
        points = turn_y_up(mesh.vertices - origin)
        glb.add_mesh(name, mesh.faces.astype(np.uint32), material, POSITION=points)
    glb.write(path)


def write_height_cityjson(path: Path, envelope: HeightEnvelope) -> None:
    """Write the solid as a generic city object of CityJSON 2.0."""
    mesh = envelope.mesh or _NONE
    origin = mesh.vertices.min(0) if len(mesh.vertices) else np.zeros(3)
    whole = np.rint((mesh.vertices - origin) / _SCALE).astype(np.int64)
    solid = {
        "type": "Solid", "lod": "1",
        "boundaries": [[[face] for face in mesh.faces.tolist()]],
    }  # fmt: skip
    document = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [_SCALE] * 3, "translate": origin.tolist()},
        "metadata": {"title": "envelope", **_name_system(envelope.scene.crs)},
        "CityObjects": {
            "envelope": {
                "type": "GenericCityObject",
                "attributes": {"rules": list(envelope.rules), **envelope.sum_up()},
                "geometry": [solid] if len(mesh.faces) else [],
            }
        },
        "vertices": whole.tolist(),
    }
    path.write_bytes(orjson.dumps(document) + b"\n")


def _name_system(crs: str | None) -> dict[str, str]:
    """Return the reference system as CityJSON names it, where it has a code."""
    from umbra.writers.vectors.gis_files import find_crs  # noqa: PLC0415

    system = find_crs(crs)
    code = None if system is None else system.to_epsg(min_confidence=70)
    if code is None:
        return {}
    return {"referenceSystem": f"https://www.opengis.net/def/crs/EPSG/0/{code}"}
