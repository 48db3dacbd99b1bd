"""Meshes of other libraries: trimesh's and PyVista's as parts, and parts as theirs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.scene.mesh import Mesh, Part

if TYPE_CHECKING:
    from umbra.scene.scene import Scene

__all__ = ["FOOTPRINT_READERS", "Exchange"]

FOOTPRINT_READERS: list[Callable[..., Scene]] = []
"""What reads a file of footprints: `umbra.readers`, which stands above, adds `umbra.read`."""


class Exchange:
    """Conversion of scenes from and to other libraries' meshes."""

    @classmethod
    def from_arrays(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        parts: ArrayLike | None = None,
        *,
        name: str = "mesh",
        **facts: Any,
    ) -> Scene:
        """
        Make a scene from arrays.

        Parameters
        ----------
        vertices : (n, 3) float
            z up, in the model's own coordinates [m].
        faces : (m, 3) int
            Counter-clockwise seen from outside.
        parts : (m,) str or int, optional
            Part of each face.
        name : str
            Of the only part otherwise.
        **facts
            ``crs``, ``latitude``, ``longitude``, ``elevation``, ``is_ellipsoidal``,
            ``true_north``, ``ground``.

        Raises
        ------
        InputError
            If an array has another shape, or a face names a vertex that does not exist.
        """
        from umbra.scene.making import make_scene  # noqa: PLC0415

        return make_scene(_list_array_parts(vertices, faces, parts, name), **facts)

    @classmethod
    def from_trimesh(cls, mesh: Any, **facts: Any) -> Scene:
        """
        Make a scene from a ``trimesh.Trimesh`` or ``trimesh.Scene``, z up [m], a part of each node.

        Facts as in `from_arrays`. Raises InputError if it is neither, or has no triangles.
        """
        from umbra.scene.making import make_scene  # noqa: PLC0415

        return make_scene(_list_trimesh_parts(mesh), **facts)

    @classmethod
    def from_pyvista(cls, data: Any, **facts: Any) -> Scene:
        """
        Make a scene from the surface of a PyVista dataset, z up [m]; each block becomes a part.

        Facts as in `from_arrays`. Raises InputError if it is no dataset, or has no faces.
        """
        from umbra.scene.making import make_scene  # noqa: PLC0415

        return make_scene(_list_pyvista_parts(data), **facts)

    @classmethod
    def from_geopandas(cls, table: Any, height: str | None = None, **columns: str) -> Scene:
        """
        Make a scene from footprints with heights, as `umbra.read` reads a file of them.

        Parameters
        ----------
        table : geopandas.GeoDataFrame
            Of polygons; a CRS in degrees is turned into the local UTM zone.
        height : str, optional
            Column of the heights [m]; by default one with a usual name.
        **columns
            ``base_column`` and ``name_column``, as of `umbra.read`.

        Raises
        ------
        InputError
            If it is no GeoDataFrame, or has no heights.
        """
        if not hasattr(table, "geometry") or not hasattr(table, "to_json"):
            msg = f"this is a {type(table).__name__}, not a GeoDataFrame"
            raise InputError(msg)
        if not FOOTPRINT_READERS:
            msg = "nothing reads footprints yet; call umbra.Scene.from_geopandas"
            raise InputError(msg)
        with TemporaryDirectory() as folder:
            path = Path(folder, "table.geojson")
            path.write_text(table.to_json(drop_id=False), encoding="utf-8")
            return FOOTPRINT_READERS[0](path, height_column=height, **columns)

    def to_trimesh(self) -> Any:
        """Return a ``trimesh.Scene``, a mesh for each part, in the model's own coordinates [m]."""
        trimesh = need("trimesh", "", "to_trimesh")
        trimesh_scene = trimesh.Scene()
        for name, vertices, faces in _list_soups(self):  # type: ignore[arg-type]
            mesh = trimesh.Trimesh(vertices, faces, process=False)
            trimesh_scene.add_geometry(mesh, node_name=name, geom_name=name)
        return trimesh_scene

    def to_pyvista(self) -> Any:
        """Return a ``pyvista.MultiBlock``, a block a part, in the model's own coordinates [m]."""
        pyvista = need("pyvista", "", "to_pyvista")
        blocks = pyvista.MultiBlock()
        for name, vertices, faces in _list_soups(self):  # type: ignore[arg-type]
            corners = np.column_stack([np.full(len(faces), 3), faces])
            blocks.append(pyvista.PolyData(vertices, corners.ravel()), name)
        return blocks


def _list_array_parts(
    vertices: ArrayLike, faces: ArrayLike, parts: ArrayLike | None, name: str
) -> list[Part]:
    """Return a soup's parts: one, or one for each name in ``parts`` (n_faces,)."""
    try:
        points, corners = np.array(vertices, np.float64), np.array(faces)
    except (TypeError, ValueError) as error:
        msg = f"vertices and faces are arrays of numbers ({error})"
        raise InputError(msg) from error
    for title, array in (("vertices", points), ("faces", corners)):
        if array.ndim != 2 or array.shape[1] != 3:
            msg = f"{title} are an array (n, 3); got {array.shape}"
            raise InputError(msg, option=title)
    if corners.dtype.kind not in "iu":
        msg = f"faces are whole numbers, three vertices each; got {corners.dtype}"
        raise InputError(msg, option="faces")
    if parts is None:
        return [Part(name, "", Mesh(points, corners))]
    labels = np.asarray(parts)
    if labels.shape != (len(corners),):
        msg = f"parts has one name or number for each of {len(corners)} faces; got {labels.shape}"
        raise InputError(msg, option="parts")
    names, owner = np.unique(labels, return_inverse=True)
    return [
        Part(str(label), "", Mesh(points, corners[owner == k])) for k, label in enumerate(names)
    ]


def _list_trimesh_parts(mesh: Any) -> list[Part]:
    """Return the parts of a ``trimesh.Trimesh``, or of a ``trimesh.Scene``, one for each node."""
    if hasattr(mesh, "graph") and hasattr(mesh, "geometry"):
        parts = []
        for node in mesh.graph.nodes_geometry:
            transform, name = mesh.graph[node]
            geometry = mesh.geometry[name]
            if hasattr(geometry, "faces"):
                shape = Mesh(np.array(geometry.vertices, float), np.array(geometry.faces))
                parts.append(Part(str(node), "", shape, np.array(transform, float)))
        return parts
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
        msg = f"this is a {type(mesh).__name__}, not a mesh or scene of trimesh"
        raise InputError(msg)
    name = str(getattr(mesh, "metadata", {}).get("name", "mesh"))
    return [Part(name, "", Mesh(np.array(mesh.vertices, float), np.array(mesh.faces)))]


def _list_pyvista_parts(data: Any) -> list[Part]:
    """Return the parts of a PyVista dataset: its surface, or that of each block."""
    if hasattr(data, "keys") and hasattr(data, "n_blocks"):
        blocks = [(str(key or n), data[n]) for n, key in enumerate(data.keys())]
        return [
            Part(key if len(parts) == 1 else f"{key}/{part.name}", part.kind, part.mesh)
            for key, block in blocks
            if block is not None
            for parts in [_list_pyvista_parts(block)]
            for part in parts
        ]
    if not hasattr(data, "extract_surface"):
        msg = f"this is a {type(data).__name__}, not a dataset of PyVista"
        raise InputError(msg)
    surface = (data if hasattr(data, "faces") else _find_surface(data)).triangulate()
    faces = np.asarray(surface.faces).reshape(-1, 4)[:, 1:]
    return [Part("mesh", "", Mesh(np.array(surface.points, np.float64), np.array(faces)))]


def _find_surface(data: Any) -> Any:
    try:
        return data.extract_surface(algorithm=None)
    except TypeError:  # an older PyVista has one algorithm
        return data.extract_surface()


def _list_soups(scene: Scene) -> Iterator[tuple[str, NDArray[np.float64], NDArray[np.int32]]]:
    """Return each part's own name, vertices in the model's own coordinates, and faces."""
    seen: dict[str, int] = {}
    for index, label in enumerate(scene.labels()):
        seen[label] = seen.get(label, 0) + 1
        soup = scene.triangles([index])
        used, faces = np.unique(soup.faces, return_inverse=True)
        name = label if seen[label] == 1 else f"{label} ({seen[label]})"
        yield name, soup.vertices[used] + scene.origin, faces.reshape(-1, 3).astype(np.int32)
