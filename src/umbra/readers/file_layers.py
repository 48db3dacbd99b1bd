"""
Several files, each a layer, in one scene: names, coordinates, heights.

The first CRS named by a file is the scene's; other files are converted to it. Files without
one are assumed to use it, unless they are placed: by the caller, or by the site that they state.
"""

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count
from umbra.readers.apart import FilePlan, check_apart, make_crs_error
from umbra.readers.checks import errors_of
from umbra.readers.georeference import (
    assumes_height_unit,
    bring_to,
    is_known_crs,
    is_same_plan,
    show_crs,
    tell_swapped,
    to_metres,
)
from umbra.readers.model import FileModel, UniqueNames
from umbra.readers.placing import Placing, move_light, place_parts
from umbra.readers.sited import find_by_site
from umbra.readers.terrain import (
    find_gaps,
    find_overlaps,
    find_terrain_height,
    find_terrain_parts,
    measure_boxes,
    stand_on,
)
from umbra.scene import Light, Part, Scene

__all__ = ["FileLayer", "combine", "name_layers", "show_name"]

NAMED = re.compile(r"([^/\\=]+)=(.+)", re.DOTALL)
ENDINGS = re.compile(r"(\.city)?\.\w+$", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class FileLayer:
    """A file that was read, and the name of the layer it makes."""

    name: str
    path: Path
    model: FileModel
    placing: Placing | None = None  # that the caller wants

    @property
    def is_placed(self) -> bool:
        """Whether the caller says where its origin is."""
        return self.placing is not None and self.placing.at is not None


def name_layers(paths: Sequence[str | os.PathLike[str]]) -> list[tuple[str, Path]]:
    """
    Split names of layers from files.

    ``existing=a.city.json`` names a layer, unless a file of that whole name exists. Unnamed
    layers of several files are named after their files; that of a single file is empty.
    """
    named: list[tuple[str, Path]] = []
    for given in paths:
        if not os.fspath(given):
            msg = "the name of a file is empty, as that of a variable that is not set; name a model"
            raise InputError(msg)
        match = NAMED.fullmatch(given) if isinstance(given, str) else None
        if match and not Path(os.fspath(given)).exists():
            named.append((match[1].strip(), Path(match[2])))
        elif isinstance(given, str) and given.endswith("=") and not Path(given).exists():
            msg = f"'{given}' names a layer without a file; write {given}FILE"
            raise InputError(msg, layer=given[:-1])
        else:
            named.append(("", Path(given)))
    if len(named) == 1:
        return named
    return [(layer or ENDINGS.sub("", show_name(path)), path) for layer, path in named]


def show_name(path: Path) -> str:
    """Return a file's name as Unicode, with � for bytes that are not."""
    return os.fsencode(path.name).decode("utf-8", "replace")


@dataclass(frozen=True, eq=False)
class Combined:
    """
    Layers in one plan.

    ``parts``, each with its layer, are in metres if the CRS is known; ``frames`` (4, 4) are those
    of files that were placed, by name; ``notes`` tell of parts converted, placed or misplaced.
    """

    parts: Iterator[Part]
    lights: tuple[Light, ...]
    crs: str | None
    frames: dict[str, NDArray[np.float64]]
    notes: list[str]


def combine(layers: Sequence[FileLayer]) -> Combined:
    """Convert layers to one CRS, place them, and set them on the terrain among them."""
    notes: list[str] = []
    moved, crs = _bring_together(layers, notes)
    frames = _place(layers, moved, crs, notes)
    if len(layers) > 1:
        notes += check_apart([_lay_out(*pair) for pair in zip(layers, moved)], crs)
    # The first raster is the terrain: another may be trees, or roofs.
    rasters = (parts for layer, parts in zip(layers, moved) if layer.model.is_terrain)
    ground: Sequence[Part] = next(rasters, ())
    for index, layer in enumerate(layers):
        if layer.model.is_afloat and ground:
            moved[index], missed = stand_on(moved[index], ground)
            note = f"{show_name(layer.path)}: set on the terrain, at its lowest below each part"
            beside = f"; {show_count(missed, 'part lies', 'parts lie')} beside it, on its edge"
            notes.append(note + (beside if missed else ""))
    for index, layer in enumerate(layers):
        if layer.model.crowns is not None:
            others = [part for k, parts in enumerate(moved) for part in parts if k != index]
            moved[index], note = _stand(layer, moved[index], ground, others)
            notes.append(f"{show_name(layer.path)}: {note}")
    if len(layers) > 1:
        notes += _check_together(layers, moved)
    lights = tuple(
        move_light(light, frames[show_name(layer.path)])
        if show_name(layer.path) in frames
        else light
        for layer in layers
        for light in layer.model.lights
    )
    return Combined(chain.from_iterable(moved), lights, crs, frames, notes)


def _place(
    layers: Sequence[FileLayer], moved: list[tuple[Part, ...]], crs: str | None, notes: list[str]
) -> dict[str, NDArray[np.float64]]:
    """Place layers as the caller or their site says; return how, by the name of the file."""
    wanted = _find_placings(layers, moved, crs)
    frames, plain = {}, list(moved)
    named = {placing.layer for placing in wanted if placing}
    has_raster = any(layer.model.is_terrain for layer in layers)
    for k, (layer, placing) in enumerate(zip(layers, wanted)):
        if placing is not None:
            others = [
                p for parts, layer in zip(moved, layers) if layer.name not in named for p in parts
            ]
            placed = place_parts(
                moved[k], others or _list_others(layers, moved, layer.name), crs, placing,
                is_afloat=layer.model.is_afloat and has_raster,
                own_ground=layer.model.place.ground,
                beside=[
                    part
                    for i, other in enumerate(layers)
                    if i != k and other.name == layer.name
                    for part in plain[i]
                ] if placing.turn else (),
            )  # fmt: skip
            moved[k] = placed.parts
            if placed.note not in notes:
                notes.append(placed.note)
            frames[show_name(layer.path)] = placed.matrix
    return frames


def _find_placings(
    layers: Sequence[FileLayer], moved: Sequence[tuple[Part, ...]], crs: str | None
) -> list[Placing | None]:
    """Return how the caller, or the site that its file states, places each layer."""
    wanted = [layer.placing for layer in layers]
    is_free = [placing is None or placing.at is None for placing in wanted]
    sited = [k for k, layer in enumerate(layers) if layer.model.is_sited and is_free[k]]
    if len(layers) > 1 and sited:
        plans = [_lay_out(*pair) for pair in zip(layers, moved)]
        for k in sited:
            layer, placing = layers[k], wanted[k]
            rest = [plan for i, plan in enumerate(plans) if i != k and wanted[i] is None]
            by_site = find_by_site(layer.name, plans[k], rest, crs, plans[sited[0]])
            if by_site is not None and placing is not None:  # moved or lifted from there
                by_site = replace(by_site, move=placing.move, turn=placing.turn, lift=placing.lift)
            wanted[k] = by_site or placing
    return wanted


def _list_others(
    layers: Sequence[FileLayer], moved: Sequence[tuple[Part, ...]], name: str
) -> list[Part]:
    return [part for layer, parts in zip(layers, moved) if layer.name != name for part in parts]


def _bring_together(
    layers: Sequence[FileLayer], notes: list[str]
) -> tuple[list[tuple[Part, ...]], str | None]:
    """Convert layers to the first CRS named, in metres; name their parts."""
    target, first = None, layers[0]  # the CRS, and the layer that named it
    moved: list[tuple[Part, ...]] = []
    unique: dict[str, UniqueNames] = {}  # files that share a layer's name hold objects of their own
    for layer in layers:
        crs, parts, metric = layer.model.crs, layer.model.parts, layer.model.is_high_in_metres
        if crs is not None and target is None:
            parts, own = to_metres(parts, crs, is_high_in_metres=metric)
            target, first = own or crs, layer
        elif crs is not None and target is not None and not is_same_plan(crs, target):
            if not is_known_crs(crs) or not is_known_crs(target):
                raise make_crs_error(first.path, layer.path, (first.model.crs or "", crs))
            parts = bring_to(parts, crs, target, is_high_in_metres=metric)
        if crs is not None and target is not None and parts is not layer.model.parts:
            whose = f"{show_name(layer.path)}: " if len(layers) > 1 else ""
            remarks = [
                *_tell_conversion(crs, target, metric),
                *tell_swapped(layer.model.parts, crs),
            ]
            notes += [f"{whose}{note}" for note in remarks]
        if layer.name:
            before = unique.setdefault(layer.name, UniqueNames())
            parts, count = _place_in_layer(parts, layer.name, before)
            if count:
                notes.append(
                    f"{show_name(layer.path)}: names that another file of layer '{layer.name}' "
                    f"has, numbered: {count}"
                )
        moved.append(parts)
    return moved, target


def _tell_conversion(crs: str, target: str, is_high_in_metres: bool) -> list[str]:
    notes = [f"coordinates were converted from {show_crs(crs)} to {show_crs(target)}"]
    if assumes_height_unit(crs):
        unit = "metres" if is_high_in_metres else "feet, as the plan is"
        notes.append(
            f"{show_crs(crs)} does not say the unit of heights: taken as {unit} "
            "(a CRS with a height system says it, as EPSG:2263+5703)"
        )
    return notes


def _lay_out(layer: FileLayer, parts: Sequence[Part]) -> FilePlan:
    """Return where a file lies in the plan of all."""
    crs, site = layer.model.crs, layer.model.place
    bounds = Scene(tuple(parts), np.zeros(3)).bounds()[:, :2]
    return FilePlan(
        show_name(layer.path), bounds, crs, site.latitude, site.longitude,
        site.true_north or 0.0, site.altitude, site.is_ellipsoidal,
        layer=layer.name, is_placed=layer.is_placed,
    )  # fmt: skip


def _check_together(
    layers: Sequence[FileLayer],
    moved: Sequence[tuple[Part, ...]],
) -> list[str]:
    """Note layers that lie above or below the terrain, or in each other's place."""
    groups: dict[str, list[Part]] = {}
    for layer, parts in zip(layers, moved):
        groups.setdefault(layer.name, []).extend(parts)
    notes: list[str] = []
    # Parts that are a terrain may stand among others; a file of nothing else comes first.
    terrains = [(layer, find_terrain_parts(parts)) for layer, parts in zip(layers, moved)]
    terrains.sort(key=lambda pair: not pair[0].model.is_terrain)
    bearing, ground = next((pair for pair in terrains if pair[1]), (None, ()))
    for layer, parts in zip(layers, moved):
        model = layer.model
        is_set = model.crowns or (model.is_afloat and bearing and bearing.model.is_terrain)
        if bearing and parts and layer is not bearing and not (model.is_terrain or is_set):
            notes += find_gaps(layer.name, measure_boxes(parts)[1], bearing.name, ground)
    trees = {layer.name for layer in layers if layer.model.crowns is not None}
    return notes + find_overlaps({n: parts for n, parts in groups.items() if n not in trees})


def _place_in_layer(
    parts: Sequence[Part], layer: str, before: UniqueNames
) -> tuple[tuple[Part, ...], int]:
    """Put a file's parts in a layer, numbering names that its earlier files use."""
    names = {name: before.add(name) for name in dict.fromkeys(part.name for part in parts)}
    placed = []
    for part in parts:
        name = names[part.name]
        tags = part.tags if name == part.name else (*part.tags, part.name)
        placed.append(replace(part, layer=layer, name=name, tags=tags))
    return tuple(placed), sum(new != old for old, new in names.items())


def _stand(
    layer: FileLayer, parts: Sequence[Part], ground: Sequence[Part], others: Sequence[Part]
) -> tuple[tuple[Part, ...], str]:
    """Make the body of a canopy on the terrain, or on the lowest point of all the rest."""
    from umbra.readers.canopy import stand_crowns  # noqa: PLC0415 - it compiles kernels

    (part,), crowns = parts, layer.model.crowns
    assert crowns is not None
    centres = part.mesh.vertices[crowns.corners, :2].mean(1)
    if ground:
        heights, inside = find_terrain_height(ground, centres)
        missed = int((~inside).sum())
        note = "a canopy on the terrain"
    else:
        solid = [p for p in others if p.kind != "Canopy"]
        lowest = float(Scene(tuple(solid), np.zeros(3)).bounds()[0, 2]) if solid else 0.0
        heights, missed = np.full(len(centres), lowest), 0
        note = f"a canopy on the level ground of z = {lowest:.6g}, for there is no terrain raster"
    with errors_of(f"{show_name(layer.path)} "):
        body, left_out = stand_crowns(part, crowns, heights)
    note += f", {len(centres) - left_out} cells up to {float(crowns.tops.max()):.3g} m"
    if left_out:
        note += f"; cells without a crown above the trunk zone left out: {left_out}"
    if missed:
        note += f"; {missed} cells lie beside the terrain, on its edge"
    return (body,), note
