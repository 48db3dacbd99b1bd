"""Parts of a city's files that patterns match, and those that a proposal replaces."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.ground.level import TERRAIN
from umbra.packages import need
from umbra.scene import Mesh, Part, Scene
from umbra.study.options import StudyOptions
from umbra.study.replaced import (
    CutObject,
    judge_shares,
    measure_inside,
    read_outline,
    tell_replaced,
)
from umbra.tiles.city_catalogue import Catalogue, CityFile

__all__ = [
    "NOTHING",
    "find_matching",
    "find_replaced_parts",
    "settle_outline",
    "tell_city_replaced",
]

NOTHING = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))


def find_matching(file: CityFile, patterns: Iterable[str]) -> NDArray[np.bool_]:
    """Return which parts of a file one of some patterns matches, (n_parts,) bool."""
    is_matched = np.zeros(file.counts["parts"], np.bool_)
    patterns = list(patterns)
    if not patterns:
        return is_matched
    words = file.words
    for k, (name, kind, tags) in enumerate(
        zip(words["names"], words["kinds"], words["tags"], strict=True)
    ):
        part = Part(name, kind, NOTHING, layer=file.layer, tags=tuple(tags))
        is_matched[k] = any(part.matches(pattern) for pattern in patterns)
    return is_matched


def settle_outline(
    options: StudyOptions, where: Scene, bounds: NDArray[np.float64]
) -> tuple[StudyOptions, list[str]]:
    """
    Return options whose plot is text, which processes and fingerprints hold; and notes.

    Parameters
    ----------
    options : StudyOptions
    where : Scene
        At the place of the city, without parts.
    bounds : (2, 3) float64
        Of the city [m].
    """
    if options.replace_in is None:
        return options, []
    outline, notes = read_outline(options.replace_in, fill_bounds(where, bounds))
    text = need("shapely", "gis", "replace_in").to_wkt(outline, rounding_precision=-1)
    return replace(options, replace_in=text), notes


def fill_bounds(where: Scene, bounds: NDArray[np.float64]) -> Scene:
    """Return a scene with a part that reaches over some bounds (2, 3), for readers of outlines."""
    corners = np.array([bounds[0], bounds[1], [*bounds[0, :2], bounds[1, 2]]]) - where.origin
    return replace(where, parts=(Part("", "", Mesh(corners, np.array([[0, 1, 2]], np.int32))),))


def find_replaced_parts(file: CityFile, options: StudyOptions) -> NDArray[np.bool_]:
    """Return which parts of a file a proposal replaces, (n_parts,) bool."""
    is_replaced = find_matching(file, options.replace)
    if options.replace_in is not None:
        goes, _ = judge_shares(_measure_shares(file, options))
        is_replaced |= goes[file.geometry.object_of]
    return is_replaced & _find_open(file, options)


def _find_open(file: CityFile, options: StudyOptions) -> NDArray[np.bool_]:
    """Return the parts of a file that can be replaced: neither ground nor the proposal."""
    ground = np.array([kind in TERRAIN for kind in file.kinds_of_parts], np.bool_)
    return ~ground & ~find_matching(file, options.proposed)


def _measure_shares(file: CityFile, options: StudyOptions) -> NDArray[np.float64]:
    """Return the share of each object of a file in the plot, (n_objects,)."""
    shapely = need("shapely", "gis", "replace_in")
    outline, geometry = shapely.from_wkt(options.replace_in), file.geometry
    count, origin = file.counts["objects"], np.array(file.origin)[:2]
    low, high = np.array(shapely.bounds(outline)).reshape(2, 2) - origin
    boxes = geometry.boxes[:, :, :2]
    near = ((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(1)
    units = np.flatnonzero(np.isin(geometry.objects, geometry.objects[near]))
    faces = geometry.find_faces(units)
    faces = faces[_find_open(file, options)[geometry.part[faces]]]
    corners = geometry.vertices[geometry.faces[faces]][..., :2] + origin
    owner = geometry.object_of[geometry.part[faces]]
    return measure_inside(shapely, corners, owner, count, outline)


def name_city_replaced(catalogue: Catalogue, options: StudyOptions) -> list[str]:
    """Return the names of what a proposal replaces in a city, each once."""
    if not options.replace and options.replace_in is None:
        return []
    names: dict[str, None] = {}
    for file in catalogue.files:
        gone, own = find_replaced_parts(file, options), file.words["names"]
        names.update(dict.fromkeys(own[k] for k in np.flatnonzero(gone).tolist()))
    return list(names)


def tell_city_replaced(catalogue: Catalogue, options: StudyOptions) -> list[str]:
    """
    Report what a proposal replaces in a city.

    Raises
    ------
    InputError
        If a pattern matches only ground or the proposal.
    """
    if not options.replace and options.replace_in is None:
        return []
    for pattern in options.replace:
        if not any(
            (find_matching(file, [pattern]) & _find_open(file, options)).any()
            for file in catalogue.files
        ):
            msg = (
                f"replace='{pattern}' matches only ground, which is not replaced, or parts of the "
                "proposal; name what stands there"
            )
            raise InputError(msg, option="replace", pattern=pattern)
    names: dict[str, None] = {}
    cut: list[CutObject] = []
    faces = 0
    for file in catalogue.files:
        gone, labels = find_replaced_parts(file, options), catalogue.label_parts(file)
        names.update(dict.fromkeys(labels[k] for k in np.flatnonzero(gone).tolist()))
        faces += int(gone[file.geometry.part].sum()) if gone.any() else 0
        if options.replace_in is not None:
            shares = _measure_shares(file, options)
            goes, is_cut = judge_shares(shares)
            first = {index: k for k, index in enumerate(file.geometry.object_of.tolist())}
            cut += [
                CutObject(labels[first[index]], float(shares[index]), bool(goes[index]))
                for index in np.flatnonzero(is_cut).tolist()
            ]
    return tell_replaced(list(names), faces, cut, has_outline=options.replace_in is not None)
