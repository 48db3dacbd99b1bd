"""Files to scenes: city models, buildings, footprints, rasters and meshes."""

import errno
import gc
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.option_fields import read_flag, read_texts
from umbra.readers.budget import make_budget
from umbra.readers.checks import check_soup, damage_of, errors_of
from umbra.readers.content import FileContent
from umbra.readers.file_layers import FileLayer, combine, name_layers, show_name
from umbra.readers.formats import STREAMED, find_format_kind, load_reader, tell_formats
from umbra.readers.georeference import locate_bounds
from umbra.readers.kept import Files, read_kept
from umbra.readers.model import HEIGHTS, TRUNK, Crowns, FileModel, ReadChoices, state_site
from umbra.readers.placing import check_placings, read_placings
from umbra.readers.region import Region, keep_inside, make_region
from umbra.readers.sited import assume_crs, check_crs, leave_crs, tell_unused_crs
from umbra.scene import Scene, Source, make_scene
from umbra.scene.exchange import FOOTPRINT_READERS
from umbra.scene.numbers import read_number

__all__ = ["read"]

HIGHEST = 1000.0
"""Height of a model that is more than a building's [m]."""
STEEP = 0.05  # share of its length that is more than most mountains'
LONGEST = 1e5  # [m]; no model without a CRS is as long

UPS = ("x", "y", "z")


def read(  # noqa: PLR0913  (each option by its name)
    *paths: str | os.PathLike[str],
    up: str | None = None,
    height_column: str | None = None,
    base_column: str | None = None,
    name_column: str | None = None,
    canopy: Sequence[str] = (),
    trunk: str | float | None = None,
    canopy_heights: str | None = None,
    crs: str | None = None,
    bbox: str | Sequence[float | str] | None = None,
    area: str | os.PathLike[str] | None = None,
    geometric_error: float | None = None,
    place: Sequence[str] = (),
    lift: Sequence[str] = (),
    move: Sequence[str] = (),
    allow_outside: bool = False,
    max_memory: float | None = None,
    cache: bool = False,
) -> Scene:
    """
    Read one scene from one or more files.

    The format is detected from the file's content, then its name's ending. Coordinates in
    degrees or feet are converted to the local UTM zone in metres; with an unknown CRS they
    are kept, with a note.

    Parameters
    ----------
    *paths : str or path
        CityJSON 1.0, 1.1, 2.0 and sequences of it, CityGML 1.0, 2.0, 3.0, FlatCityBuf, glTF
        and GLB, Rhino, COLLADA, KMZ, HBJSON, OBJ, PLY, STL, OFF, IFC, footprints (GeoJSON,
        GeoPackage, Shapefile, GeoParquet), height rasters (GeoTIFF).
        Several become one scene in the first file's CRS, each a layer, named after its file or as
        in ``"proposed=tower.glb"``.
    up : {'x', 'y', 'z'}, optional
        The file's axis that points up: z by default, y in glTF. Footprints and
        rasters have heights and no other axis.
    height_column, base_column : str, optional
        Columns of footprints [m]; by default those with usual names.
    name_column : str, optional
        Of footprints: the column that names them; by default the one with the most different names,
        names before numbers.
    canopy : sequence of str
        Shell patterns of layers or files; height rasters that one matches are canopies
        of trees, closed bodies that stand on the first other raster.
    trunk : str or float, optional
        Base of crowns: a share of the height, 0.25 by default, or the file of a raster.
    canopy_heights : {'above-ground', 'absolute'}, optional
        Reference of the canopies' heights; the ground by default.
    crs : str, optional
        Coordinate reference system of the files that name none: ``"EPSG:28992"``.
    bbox : str or sequence, optional
        ``XMIN,YMIN,XMAX,YMAX``: only objects whose bounds meet this box are read, and they are
        kept whole. In degrees, longitude first, if all four numbers can be and a file names a known
        CRS; else in the first CRS that a file names, or in the one that is added as the fifth.
    area : str or path, optional
        A polygon instead: a GeoJSON file, in degrees unless it names a CRS, or WKT, whose CRS
        is as of ``bbox`` or ahead of it (``SRID=25832;POLYGON ((...))``).
    geometric_error : float, optional
        Of 3D Tiles: tiles of at most this error [m] are not refined further; the finest by default.
    place : sequence of str
        ``LAYER=X,Y[,Z][,AZIMUTH]``: the layer's own origin comes to x, y, z [m] of the other
        layers' coordinates, its y axis at this azimuth [degrees, clockwise from the plan's north].
        Where these are in a CRS, two numbers that can be are latitude and longitude. Without Z
        (``X,Y,,AZIMUTH``) its own ground, else its lowest point, comes to the others' ground. A
        layer whose file states a site among the others is placed by it without being asked.
    lift : sequence of str
        ``LAYER=M``, by which the layer is raised [m], or ``LAYER=ground``.
    move : sequence of str
        ``LAYER=DX,DY[,DZ][,TURN]``, by which the layer is moved [m], after it was turned clockwise
        about the middle of its plan [degrees].
    allow_outside : bool
        Whether a model may name files outside its own folder: buffers, material libraries,
        textures. Only for trusted models.
    max_memory : float, optional
        Memory that reading may take [GB], for files that need more than is taken for sound: 128
        times their size in all, at least half a gigabyte, at most half of the memory.
    cache : bool
        Whether to cache scenes that are slow to read in the user's cache folder, for as
        long as the files are unchanged. The command line does.

    Returns
    -------
    scene : Scene
        With the files' names, SHA-256 and formats in ``sources`` and losses in ``notes``.

    Raises
    ------
    InputError
        If a file is missing, damaged, empty or of an unsupported format; if it holds no
        triangles or coordinates that are not finite; if the files' coordinate reference
        systems differ and one is unknown, or they lie too far apart to make one study; if no
        object meets the box or the area.
    """
    if not paths:
        msg = f"no file given; name one or more of {tell_formats()}"
        raise InputError(msg)
    for path in paths:
        if not isinstance(path, (str, os.PathLike)):
            kind = type(path).__name__
            msg = f"a file is named by a str or a Path; got a {kind} (unpack lists: *files)"
            raise InputError(msg)
    if up is not None and not (isinstance(up, str) and up in UPS):
        msg = f"the up axis must be x, y or z; got {show_value(up)}"
        raise InputError(msg, up=up)
    named_crs = check_crs(crs)
    is_cached = read_flag("cache", cache)
    choices = ReadChoices(
        up,
        height_column,
        base_column,
        name_column,
        crs=named_crs,
        geometric_error=_check_error(geometric_error),
        placings=read_placings(place, lift, move),
        region=make_region(bbox, area, named_crs),
        allow_outside=read_flag("allow_outside", allow_outside),
        budget=make_budget(max_memory),
    )
    # Damaged numbers may overflow on the way to the check that names them.
    with np.errstate(all="ignore"), _pause_collection():
        named = name_layers(paths)
        for _, path in named:
            _check_there(path)  # check all names before reading the first file
        check_placings(choices.placings, [name for name, _ in named])
        choices = replace(choices, crowns=_find_crowns(named, canopy, trunk, canopy_heights))
        files = [(name, _load(path)) for name, path in named]
        for _, content in files:
            choices.budget.grow(content.path.resolve(), content.size)
        if is_cached:
            return _name_places(read_kept(files, choices, _read_files), files)
        return _name_places(_read_files(files, choices), files)


def _name_places(scene: Scene, files: Files) -> Scene:
    """Return the scene with the path and the layer of each file."""
    left = iter(files)
    sources = []
    for source in scene.sources:
        if not source.is_companion:
            layer, content = next(left)
            source = replace(source, path=str(content.path.absolute()), layer=layer)  # noqa: PLW2901
        sources.append(source)
    return scene.with_facts(sources=tuple(sources))


def _read_files(files: Files, choices: ReadChoices) -> Scene:
    return _assemble(*_read_layers(files, choices))


def _read_layers(files: Files, choices: ReadChoices) -> tuple[list[FileLayer], tuple[Source, ...]]:
    layers: list[FileLayer] = []
    sources: list[Source] = []
    named: list[str | None] = []
    placings = {placing.layer: placing for placing in choices.placings}
    for name, content in files:
        path, placing = content.path, placings.get(name)
        is_placed = placing is not None and placing.at is not None
        crowns = choices.crowns if choices.crowns and choices.crowns.matches(name, path) else None
        region = None if is_placed else choices.region
        options = replace(choices, crowns=crowns, region=region, is_placed=is_placed)
        model, source = _read_one(content, options)
        named.append(model.crs)
        model = leave_crs(model) if is_placed else assume_crs(model, choices.crs)
        # A file that its site may bring into the region is judged when all CRSs are known.
        is_later = is_placed or (len(files) > 1 and model.is_sited)
        if choices.region is not None and not is_later:
            choices = replace(choices, region=choices.region.settle(model.crs))
            model = _keep_inside(model, choices.region, path)
        layers.append(FileLayer(name, path, model, placing))
        if placing is not None:
            source = replace(source, moved=(*placing.move, placing.turn))
        sources += [
            source,
            *(replace(companion, is_companion=True) for companion in model.companions),
        ]
    if unused := tell_unused_crs(named, choices.crs):
        model = layers[0].model
        layers[0] = replace(layers[0], model=replace(model, notes=(*model.notes, *unused)))
    if choices.region is not None:
        layers = _drop_empty(_judge_sited(layers, choices.region), choices.region)
    return layers, tuple(sources)


def _keep_inside(model: FileModel, region: Region | None, path: Path) -> FileModel:
    """Leave out objects outside the region, with a note."""
    assert region is not None
    with damage_of(path, path=path):
        model, outside = keep_inside(model, region)
    outside += model.outside
    note = f"{show_name(path)}: objects outside {region.shown} left out: {outside}"
    return replace(model, notes=(*model.notes, note)) if outside else model


def _judge_sited(layers: list[FileLayer], region: Region) -> list[FileLayer]:
    """Keep what meets the region of files with a site, or all where a CRS may bring them there."""
    has_crs = any(layer.model.crs is not None for layer in layers)
    judged = []
    for layer in layers:
        if len(layers) > 1 and layer.model.is_sited and not layer.is_placed:
            model = _keep_inside(layer.model, region, layer.path)
            layer = replace(layer, model=model if model.parts or not has_crs else layer.model)  # noqa: PLW2901
        judged.append(layer)
    return judged


def _drop_empty(layers: list[FileLayer], region: Region) -> list[FileLayer]:
    """Drop files without an object in the region, and give their notes to the first other."""
    there = [layer for layer in layers if layer.model.parts]
    if not there:
        notes = "; ".join(note for layer in layers for note in layer.model.notes[-1:])
        msg = f"no object meets {region.shown} ({notes}); umbra inspect shows the bounds of a file"
        raise InputError(msg, option=region.option, outside=notes)
    lost = tuple(note for layer in layers if not layer.model.parts for note in layer.model.notes)
    model = replace(there[0].model, notes=(*there[0].model.notes, *lost))
    return [replace(there[0], model=model), *there[1:]]


def _check_error(error: float | None) -> float | None:
    if error is None:
        return None
    length = read_number("geometric_error=", error)
    if not length >= 0:
        msg = f"geometric_error= is a length of 0 m or more; got {error!r}"
        raise InputError(msg, option="geometric_error")
    return length


def _find_crowns(
    named: Sequence[tuple[str, Path]],
    canopy: Sequence[str],
    trunk: str | float | None,
    heights: str | None,
) -> Crowns | None:
    """Return the selection of canopy rasters and their options; None without canopies."""
    if heights is not None and not (isinstance(heights, str) and heights in HEIGHTS):
        msg = f"canopy heights are {' or '.join(HEIGHTS)}; got {show_value(heights)}"
        raise InputError(msg, canopy_heights=heights)
    crowns = Crowns(
        read_texts("canopy", canopy), str(TRUNK if trunk is None else trunk), heights or HEIGHTS[0]
    )
    if any(crowns.matches(name, path) for name, path in named):
        return crowns
    for given, word in ((trunk, "trunk="), (heights, "canopy_heights=")):
        if given is not None:
            msg = (
                f"{word} is for canopy rasters, and none of the files is one; name its layer: "
                "'canopy=FILE.tif', canopy='canopy'"
            )
            raise InputError(msg, option="canopy")
    return None


@contextmanager
def _pause_collection() -> Iterator[None]:
    """Pause garbage collection: parsers make millions of lists but no cycles."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _assemble(layers: list[FileLayer], sources: tuple[Source, ...]) -> Scene:
    notes = [note for layer in layers for note in layer.model.notes]
    places = {show_name(layer.path): layer.model.place for layer in layers}
    with damage_of(", ".join(str(layer.path) for layer in layers)):
        whole = combine(layers)
        frames = {name: tuple(matrix.ravel().tolist()) for name, matrix in whole.frames.items()}
        sources = tuple(replace(source, frame=frames.get(source.name, ())) for source in sources)
        layers.clear()  # a scene's parts are made one by one from a city's, which nobody else holds
        scene = make_scene(
            whole.parts, crs=whole.crs, sources=sources, notes=(*notes, *whole.notes),
            lights=whole.lights,
        )  # fmt: skip
        bounds = scene.bounds()
        sited_scene = state_site(locate_bounds(scene, bounds), places)
        return sited_scene.with_facts(notes=(*sited_scene.notes, *_tell_unit(sited_scene, bounds)))


def _tell_unit(scene: Scene, bounds: NDArray[np.float64]) -> list[str]:
    """Report a model without a CRS that is as high as no building, as one in millimetres is."""
    *_, height = size = np.ptp(bounds, axis=0).tolist()
    is_flat = height < STEEP * max(size) and max(size) < LONGEST
    if scene.crs is not None or height < HIGHEST or is_flat:
        return []
    extent = f"the model is {size[0]:,.0f} x {size[1]:,.0f} m and {height:,.0f} m high"
    return [f"{extent}; if its lengths are in millimetres or feet, export it in metres"]


def _check_there(path: Path) -> None:
    """Check that a file can be read, without opening it: a pipe can be opened only once."""
    try:
        if path.is_dir():
            raise IsADirectoryError
        path.stat()
        if not os.access(path, os.R_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        raise _make_refusal(path, error) from error


def _make_refusal(path: Path, error: OSError | ValueError) -> InputError:
    """Return the error for a file that cannot be opened, with the remedy."""
    if isinstance(error, FileNotFoundError):
        reason, remedy = "no such file", "check the name"
        if str(path) == "-":
            remedy = "to read from a pipe, name /dev/stdin"
    elif isinstance(error, IsADirectoryError):
        reason, remedy = "is a folder", f"name a file in it ({tell_formats()})"
    else:
        reason = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        remedy = "check the name and its permissions"
    return InputError(f"{path}: {reason}; {remedy}", path=path)


def _load(path: Path) -> FileContent:
    """Read a file's first bytes; all of them, unless its reader takes a stream."""
    try:
        with errors_of(f"{path}: ", path=path):
            content = FileContent(path)
            if not content.head.strip() and content.size <= len(content.head):
                msg = "is empty; export the model again"
                raise InputError(msg)
        with damage_of(path, path=path):
            kind = find_format_kind(content)
        with errors_of(f"{path}: ", path=path):
            if kind not in STREAMED:
                _ = content.data
    except OSError as error:
        raise _make_refusal(path, error) from error
    return content


def _read_one(content: FileContent, choices: ReadChoices) -> tuple[FileModel, Source]:
    path = content.path
    with damage_of(path, path=path):
        kind = find_format_kind(content)
        given = content if kind in STREAMED else content.data
        model = load_reader(kind)(given, path, choices)
        if not (model.outside or any(part.triangles for part in model.parts)):
            left_out = f" ({'; '.join(model.notes)})" if model.notes else ""
            msg = f"has no triangles{left_out}; export the model with its surfaces"
            raise InputError(msg)
        check_soup(model.parts)
    # A name in a note may hold a line break, and a note is a line.
    name = show_name(path)
    notes = tuple(f"{name}: {' '.join(note.split())}" for note in model.notes)
    source = Source(name, content.digest.hex(), model.format, ground=model.place.ground)
    return replace(model, notes=notes), source


FOOTPRINT_READERS.append(read)
