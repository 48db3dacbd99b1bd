"""JSON files: which of CityJSON, CityJSONSeq, GeoJSON and glTF one is, and where one is broken."""

from pathlib import Path

import orjson

from umbra.errors import InputError
from umbra.readers.model import Choices, Model

__all__ = ["read_json"]

OLD = "is glTF 1.0; umbra reads 2.0, convert it (npx gltf-pipeline -i FILE -o OUT.glb)"

BOM = b"\xef\xbb\xbf"

GEOJSON = {"FeatureCollection", "Feature", "GeometryCollection", "MultiPolygon", "Polygon"}


def read_json(data: bytes, path: Path, choices: Choices) -> Model:
    """
    Read a JSON file of any kind that is read.

    Parameters
    ----------
    data : bytes
    path : Path
        Other files are looked for beside it.
    choices : Choices

    Returns
    -------
    model : Model

    Raises
    ------
    InputError
        If the JSON is broken (where), or is none of CityJSON, GeoJSON and glTF (what
        it is).
    """
    data = data.removeprefix(BOM)
    try:
        documents = [orjson.loads(data)]
    except orjson.JSONDecodeError as error:
        documents = _parse_lines(data, path, error)
    head = documents[0]
    if not isinstance(head, dict):
        msg = (
            f"is JSON, but holds a {type(head).__name__}, not a model; "
            "give CityJSON, GeoJSON or glTF"
        )
        raise InputError(msg)
    if "asset" in head:
        from umbra.readers.gltf import read_gltf_tree  # noqa: PLC0415 - only if it is one

        return read_gltf_tree(head, None, path, choices)
    kind = head.get("type")
    if kind in {"CityJSON", "CityJSONFeature"}:
        from umbra.readers.cityjson import read_cityjson  # noqa: PLC0415

        return read_cityjson(documents, choices.up)
    if kind in GEOJSON:
        from umbra.readers.geojson import read_geojson  # noqa: PLC0415

        return read_geojson(documents, choices)
    if kind == "Model" and "properties" in head:
        msg = (
            "is a Honeybee model (HBJSON), which is not read; export OBJ or STL from Rhino, or "
            "geometry from honeybee-vtk (honeybee-vtk translate FILE)"
        )
        raise InputError(msg)
    if isinstance(head.get("accessors"), dict):
        raise InputError(OLD)
    if kind == "Topology":
        msg = "is TopoJSON, which is not read; convert it to GeoJSON or CityJSON"
        raise InputError(msg)
    shown = f"its type is {str(kind)[:40]!r}" if kind else "it has no type"
    msg = f"is JSON, but neither CityJSON, GeoJSON nor glTF ({shown}); export it as one of them"
    raise InputError(msg)


def _parse_lines(data: bytes, path: Path, whole: orjson.JSONDecodeError) -> list[object]:
    """Parse one JSON document a line, if the first line is one by itself."""
    lines = [(number, line) for number, line in enumerate(data.split(b"\n"), 1) if line.strip()]
    documents: list[object] = []
    for number, line in lines:
        try:
            documents.append(orjson.loads(line))
        except orjson.JSONDecodeError as error:
            if number == lines[0][0] and path.suffix.lower() != ".jsonl":
                raise _broken(data, whole, whole.lineno) from whole
            raise _broken(line, error, number) from error
    if len(documents) < 2:
        raise _broken(data, whole, whole.lineno) from whole
    return documents


def _broken(text: bytes, error: orjson.JSONDecodeError, line: int) -> InputError:
    # orjson counts characters; a byte offset is what an editor or dd can go to.
    offset = len(text.decode("utf-8", "replace")[: error.pos].encode())
    what = "ends too early" if offset >= len(text.rstrip()) else "is broken JSON"
    detail = " ".join(error.msg.split())
    msg = (
        f"{what} at line {line}, column {error.colno}, byte {offset} of "
        f"{len(text)} ({detail}); fetch or export it again"
    )
    return InputError(msg, line=line, byte=offset)
