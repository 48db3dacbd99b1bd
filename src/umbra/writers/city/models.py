"""
Surfaces of a city as 3D Tiles, coloured by hours in shadow.

Each tile's surfaces become one or several GLB files, each with a texture of the samples and a table
of the surfaces' figures. A tree of spheres leads viewers to those that are in sight.

Figures of each surface in a GLB: a property table that viewers of 3D Tiles show on a click.
"""

import io
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.folders.atomic import replace_file
from umbra.sun import Site
from umbra.tiles.surface_pieces import SurfacePieces
from umbra.writers.city.city_surfaces import CitySurfaces, SurfaceRun, cut_runs
from umbra.writers.city.sealed_files import SealedFiles
from umbra.writers.coloured_tileset import find_tileset_placement, make_box, read_place
from umbra.writers.glb import Glb, list_corners, make_legend, turn_y_up
from umbra.writers.surfaces_glb import draw_facades, find_places, lay_out_facades

__all__ = ["add_features", "write_models"]

_CLASS = "surface"
_NO_AZIMUTH = -1.0  # of level surfaces
_UNITS = {"azimuth": "degree", "tilt": "degree", "area": "m2"}


def add_features(glb: Glb, columns: Mapping[str, NDArray]) -> None:
    """
    Add a table of features to the last mesh, whose ``_FEATURE_ID_0`` names the rows.

    Parameters
    ----------
    glb : Glb
    columns : mapping
        Text or numbers of each feature, by name.
    """
    schema: dict[str, object] = {}
    table: dict[str, object] = {}
    count = 0
    for name, values in columns.items():
        key, count = re.sub(r"\W", "_", name), len(values)
        if values.dtype.kind == "O":
            schema[key] = {"name": name, "type": "STRING"}
            table[key] = _add_text(glb, [str(value) for value in values])
            continue
        numbers = np.nan_to_num(values, nan=_NO_AZIMUTH).astype("<f4")
        known: dict[str, object] = {"type": "SCALAR", "componentType": "FLOAT32"}
        if name == "azimuth":
            known["noData"] = _NO_AZIMUTH
        unit = _UNITS.get(name, "h")
        schema[key] = {"name": name, **known, "description": f"[{unit}]"}
        table[key] = {"values": glb.add_bytes(numbers.tobytes())}
    glb.use("EXT_mesh_features", "EXT_structural_metadata")
    glb.more["extensions"] = {
        "EXT_structural_metadata": {
            "schema": {"id": "umbra", "classes": {_CLASS: {"properties": schema}}},
            "propertyTables": [{"class": _CLASS, "count": count, "properties": table}],
        }
    }
    features = {"featureCount": count, "attribute": 0, "propertyTable": 0}
    primitives: Any = glb.meshes[-1]["primitives"]
    primitives[0]["extensions"] = {"EXT_mesh_features": {"featureIds": [features]}}


def _add_text(glb: Glb, texts: list[str]) -> dict[str, object]:
    """Add texts, one after the other, and where each begins and the last ends."""
    packed = [text.encode("utf-8", "replace") for text in texts]
    starts = np.cumsum([0, *map(len, packed)]).astype("<u4")
    return {
        "values": glb.add_bytes(b"".join(packed) or b"\0"),
        "stringOffsets": glb.add_bytes(starts.tobytes()),
        "stringOffsetType": "UINT32",
    }


MOST_SAMPLES = 300_000
"""Of a GLB file, unless one part has more: its texture has one pixel for each."""
_FOLDER, _TREE = "3dtiles", "tileset.json"
_LEAVES = 4  # of a node


def write_models(
    result: CitySurfaces, progress: Callable[[int, int], object] = lambda _done, _all: None
) -> list[Path]:
    """
    Write the surfaces of each tile as GLB files, and ``tileset.json`` over them.

    A file that is as it was written of the same results is left as it is.

    Parameters
    ----------
    result : CitySurfaces
    progress : callable
        Called with the number of tiles done and of all.

    Returns
    -------
    paths : list of Path
        The tileset first.
    """
    folder = result.folder / _FOLDER
    written: list[Path] = []
    with SealedFiles(folder) as sealed:
        for n, tile in enumerate(result.folders):
            mark, pieces = tile.with_suffix(".json"), SurfacePieces([tile])
            for k, run in enumerate(cut_runs(pieces, MOST_SAMPLES, "sample")):
                path = folder / f"tile_{tile.name}_{k}.glb"
                if not sealed.is_whole(path, mark):
                    with replace_file(path) as beside:
                        _write_run(result, pieces, run, beside)
                    sealed.add(path, mark)
                written.append(path)
            progress(n + 1, len(result.folders))
    for path in set(folder.glob("tile_*.glb")) - set(written):  # of an earlier run
        path.unlink()
    tree = folder / _TREE
    with replace_file(tree) as beside:
        beside.write_bytes(orjson.dumps(_describe(result, written), default=str) + b"\n")
    return [tree, *written]


def _write_run(result: CitySurfaces, pieces: SurfacePieces, run: SurfaceRun, path: Path) -> None:
    """Write some parts as a GLB."""
    samples = _read_samples(result, pieces, run)
    hours = pieces.read("shadow_hours", run.samples.start, run.samples.stop)
    layout = lay_out_facades(samples)
    picture, corner, scale = draw_facades(layout, hours / max(result.up_hours, 1e-9), (1,))
    flat = corner[samples.owner][:, None] + scale * find_places(samples, layout)
    where = flat / np.array(picture.size)
    low, high = samples.corners.min((0, 1)), samples.corners.max((0, 1))
    middle = np.round((low + high) / 2)
    facts = result.facts
    extras = {
        "origin": (middle + result.origin).tolist(),
        "crs": facts.get("crs"),
        "hours_of_darkest": result.up_hours,
        "legend": make_legend(result.up_hours),
    }
    glb = Glb(f"umbra {facts.get('umbra_version', '')}", extras)
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    texture = {"index": glb.add_texture(stream.getvalue())}
    material = glb.add_material(lit=False, baseColorTexture=texture)
    points = turn_y_up((samples.corners - middle).reshape(-1, 3))
    glb.add_mesh(
        "surfaces", list_corners(points), material, POSITION=points,
        TEXCOORD_0=np.ascontiguousarray(where.reshape(-1, 2), "<f4"),
        _FEATURE_ID_0=np.repeat(samples.owner, 3).astype("<f4")[:, None],
    )  # fmt: skip
    add_features(glb, result.list_rows(pieces, run))
    glb.write(path)


@dataclass(frozen=True, eq=False)
class _StoredSamples:
    """Samples as they are stored; fields as in ``Samples``."""

    points: NDArray[np.float64]
    surface: NDArray[np.int32]
    corners: NDArray[np.float64]
    owner: NDArray[np.int64]
    axes: NDArray[np.float64]
    start: NDArray[np.float64]
    cells: NDArray[np.int64]
    spacing: float


def _read_samples(result: CitySurfaces, pieces: SurfacePieces, run: SurfaceRun) -> _StoredSamples:
    """Return the samples of some parts as those of a study that has no others."""

    def read(name: str, rows: slice) -> NDArray[Any]:
        return pieces.read(name, rows.start, rows.stop)

    first = run.surfaces.start
    return _StoredSamples(
        points=read("position", run.samples) - result.origin,
        surface=(read("surface_of_sample", run.samples) - first).astype(np.int32),
        corners=read("triangle_corners", run.triangles),
        owner=read("surface_of_triangle", run.triangles).astype(np.int64) - first,
        axes=read("surface_axes", run.surfaces),
        start=read("surface_start", run.surfaces),
        cells=read("surface_cells", run.surfaces),
        spacing=float(result.facts["spacing_m"]),
    )


@dataclass(frozen=True)
class _Leaf:
    """
    A GLB in its place on the earth.

    Parameters
    ----------
    name : str
    placement : (4, 4) float64
        From coordinates about its origin, z up, to geocentric ones (EPSG:4978).
    bounds : (2, 3) float64
        About its origin [m].
    """

    name: str
    placement: NDArray[np.float64]
    bounds: NDArray[np.float64]

    @property
    def sphere(self) -> tuple[NDArray[np.float64], float]:
        """Geocentric middle and radius [m]."""
        middle, half = self.bounds.mean(0), np.ptp(self.bounds, axis=0) / 2
        return self.placement[:3, :3] @ middle + self.placement[:3, 3], float(np.hypot.reduce(half))

    def describe(self) -> dict[str, Any]:
        """Return its node of the tree."""
        return {
            "transform": self.placement.T.ravel().tolist(),
            "boundingVolume": make_box(self.bounds),
            "geometricError": 0.0,
            "content": {"uri": self.name},
        }


def _describe(result: CitySurfaces, paths: list[Path]) -> dict[str, Any]:
    """Return the tileset of some GLB files."""
    root = _grow(list(_find_leaves(result, paths)))
    return {
        "asset": {"version": "1.1", "extras": result.facts},
        "geometricError": root["geometricError"],
        "root": root,
    }


def _find_leaves(result: CitySurfaces, paths: list[Path]) -> Iterator[_Leaf]:
    """Yield each GLB in its place."""
    facts = result.facts
    crs = facts.get("crs")
    site = Site(
        facts.get("latitude", 0.0),
        facts.get("longitude", 0.0),
        "UTC",
        true_north=facts.get("true_north_deg", 0.0),
    )
    whole = result.bounds.mean(0)
    for path in paths:
        origin, bounds = read_place(path)
        placement = find_tileset_placement(origin, crs, site)
        if crs is None:  # the middle of the city lies at the site, on one level plane
            placement = find_tileset_placement(whole, crs, site)
            placement[:3, 3] += placement[:3, :3] @ (origin - whole)
        yield _Leaf(path.name, placement, bounds)


def _grow(leaves: list[_Leaf]) -> dict[str, Any]:
    """Return the tree of some leaves: halves across the longest axis, in spheres."""
    middles = np.array([leaf.sphere[0] for leaf in leaves])
    centre = (middles.min(0) + middles.max(0)) / 2
    reach = [np.linalg.norm(leaf.sphere[0] - centre) + leaf.sphere[1] for leaf in leaves]
    radius = float(max(reach))
    if len(leaves) <= _LEAVES:
        children = [leaf.describe() for leaf in leaves]
    else:
        along = int(np.ptp(middles, axis=0).argmax())
        order = np.argsort(middles[:, along], kind="stable").tolist()
        half = len(order) // 2
        children = [_grow([leaves[k] for k in half]) for half in (order[:half], order[half:])]
    return {
        "boundingVolume": {"sphere": [*centre.tolist(), radius]},
        # Empty nodes are always refined in sight: nothing coarser is there to show.
        "geometricError": 2 * radius,
        "refine": "ADD",
        "children": children,
    }
