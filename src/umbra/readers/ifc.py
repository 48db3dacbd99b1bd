"""
IFC: every element with a shape becomes parts, one per surface style.

A part has the name and class of the assembly it belongs to, so that a curtain wall or a
stair is chosen as one; its own name and class, storey, type, materials and styles are its
tags. Openings are cut by ifcopenshell's geometry engine.

The file is read in a child process, whose results are kept if it crashes or hangs:
ifcopenshell may crash on a damaged file, and its geometry engine hangs on a few real
elements, ignoring Ctrl-C. Another child then continues without that element.
"""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from umbra.errors import InputError
from umbra.packages import require
from umbra.readers.budget import Budget
from umbra.readers.child import ChildLimits, ReadingChild, make_early_end
from umbra.readers.georeference import find_plan_unit, to_metres
from umbra.readers.ifc_engine import (
    ENGINES,
    IfcAttempt,
    IfcFacts,
    IfcShape,
    IfcWork,
    check_whole,
    find_schema,
)
from umbra.readers.ifc_facts import IfcWords
from umbra.readers.model import LEVEL, FileModel, FilePlace, ReadChoices, turn_up
from umbra.scene import Material, Mesh, Part
from umbra.scene.making import move_parts
from umbra.scene.mesh import transform_points

__all__ = ["read_ifc"]


SECONDS = 3.0
"""Processor time that one element may take in one engine [s]; half of it after one hung, ..."""

FOR_A_BYTE = 2e-7
"""... more of it for each byte of the file [s], as large elements make large files, ..."""

LEAST = 0.25
"""... and half of that, and no less."""

WHOLE = 3e-5
"""Processor time that all elements may take beside [s/byte]; they need a tenth of it."""

STRIKES = 2
"""Hangs after which an engine is not tried for the rest, if there is another."""

_LAND = {"IfcSite", "IfcGeographicElement"}
"""Kinds of elements that are land."""

LOSSES = 8
"""Most times that a child may hang, a tenth of those that it may end; the rest is not read."""


@dataclass(eq=False)
class IfcHarvest:
    """The results of reading a file."""

    facts: IfcFacts | None = None  # none until a child has sent them
    shapes: dict[int, IfcShape] = field(default_factory=dict)  # by place among the facts' elements
    # Elements at which an engine ended its process, or took too long
    ended: set[int] = field(default_factory=set)
    # Elements at which an engine ended its process, or took too long
    hung: set[int] = field(default_factory=set)
    is_whole: bool = True  # whether every element was tried


def read_ifc(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read an IFC file in metres: 2x3, 4, 4x3 and its drafts; on the map if it has one."""
    find_schema(data)
    check_whole(data)
    facts, result = harvest(str(path.absolute()), choices.budget)
    parts = tuple(
        part
        for number in sorted(result.shapes)
        for part in _make_parts(facts.elements[number], result.shapes[number])
    )
    if choices.is_placed:
        facts = replace(facts, matrix=None, crs=None)
    site, crs = facts.place, facts.crs
    if facts.matrix is not None and crs is not None:
        # The map's plan may be in feet; heights are metres.
        scale = np.diag([1 / find_plan_unit(crs)] * 2 + [1, 1])
        move = partial(transform_points, scale @ facts.matrix)
        moved = move_parts(parts, move, lambda part: part)
        parts, crs = to_metres(moved, crs, is_high_in_metres=True)
        site = FilePlace(site.latitude, site.longitude, site.elevation)
    site = _state_ground(site, parts, facts, choices)
    notes = (*facts.notes, *_tell_losses(facts, result))
    return FileModel(f"IFC ({facts.schema})", turn_up(parts, choices.up), crs, notes, place=site)


def _tell_losses(facts: IfcFacts, result: IfcHarvest) -> list[str]:
    """Count the elements without a shape by reason, and name the first."""
    missing = set(range(len(facts.elements))) - set(result.shapes)
    hung, ended = missing & result.hung, missing & result.ended - result.hung
    useless = missing - hung - ended
    unread = set() if result.is_whole else useless
    reasons = [
        ("elements left out because the geometry engine crashed", ended),
        ("elements left out because the geometry engine took too long", hung),
        ("elements not read after those", unread),
        ("elements without a usable shape left out", useless - unread),
    ]
    return [
        f"{reason}: {len(which)} (first: {_show(facts.elements[min(which)])})"
        for reason, which in reasons
        if which
    ]


def _show(words: IfcWords) -> str:
    return f"{words.own_kind} '{words.own_name}'"


def _make_parts(words: IfcWords, shape: IfcShape) -> list[Part]:
    # An element repeats a style for each of its pieces: one part for each style.
    looks = list(dict.fromkeys(shape.styles))
    look = np.array([looks.index(style) for style in shape.styles] + [-1], np.int32)[shape.style]
    parts = []
    for number in np.unique(look).tolist():
        name, material = looks[number] if number >= 0 else ("", Material())
        tags = words.tags if not name or name in words.tags else (*words.tags, name)
        mesh = Mesh(shape.vertices, shape.faces[look == number])
        parts.append(Part(words.name, words.kind, mesh, material=material, tags=tags))
    return parts


def _state_ground(
    site: FilePlace, parts: Sequence[Part], facts: IfcFacts, choices: ReadChoices
) -> FilePlace:
    """
    Add the height of the ground: of the site's own body, a storey, the site, or a slab.

    What lies below it are foundations. A site whose body slopes is terrain.
    """
    if any(part.kind in _LAND for part in parts):
        return replace(site, ground=_find_ground(parts))
    if choices.up not in {None, "z"}:
        return site
    if facts.grade is not None:
        height, source = facts.grade
        if facts.matrix is not None:
            height = float(facts.matrix[2, 2] * height + facts.matrix[2, 3])
        if _reaches_below(parts, height):
            return replace(site, ground=height, ground_source=source)
    slabs = [p for p in parts if p.kind == "IfcSlab" and not {"ROOF", "LANDING"} & {*p.tags}]
    if slabs:
        lowest = min(slabs, key=lambda part: part.bounds[1, 2])
        if not _reaches_below(parts, float(lowest.bounds[0, 2])):
            return site
        top, source = float(lowest.bounds[1, 2]), f"the top of its slab '{lowest.name}'"
        return replace(site, ground=top, ground_source=source)
    return site


def _reaches_below(parts: Sequence[Part], height: float) -> bool:
    """Return whether parts reach below a height [m], as foundations do, and above it."""
    boxes = [part.bounds[:, 2] for part in parts if part.triangles]
    if not boxes:
        return False
    low, high = min(box[0] for box in boxes), max(box[1] for box in boxes)
    return low < height - LEVEL and height < high


def _find_ground(parts: Sequence[Part]) -> float | None:
    """Return the height of the site's own body, if its top is level and it has no other slope."""
    site = [part for part in parts if part.kind == "IfcSite"]
    if not site:
        return None
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in site])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    # Nearly level or upright; faces in between are terrain, without a single ground height.
    level = np.abs(normals[:, 2]) > 0.9999 * length
    upright = np.abs(normals[:, 2]) < 1e-4 * length
    top = float(corners[..., 2].max())
    upper = level & (normals[:, 2] > 0)
    if not (level | upright | (length == 0)).all() or not upper.any():
        return None
    heights = corners[upper][..., 2]
    area = length[upper][np.abs(heights - top).max(1) < LEVEL].sum()
    return top if area > 0.5 * length[upper].sum() else None


def harvest(path: str, budget: Budget) -> tuple[IfcFacts, IfcHarvest]:
    """Read an IFC file in child processes."""
    require(["ifcopenshell"], "ifc", "IFC")
    result = IfcHarvest()
    work = IfcWork(path)
    hangs: Counter[str] = Counter()
    ends = 0
    size = Path(path).stat().st_size
    limits = budget.limit_child(SECONDS + FOR_A_BYTE * size, WHOLE)
    until = _find_spent() + limits.whole
    while (loss := _gather(work, result, _halve(limits, hangs.total(), until))) is not None:
        attempt, has_hung = loss
        if attempt is None or result.facts is None:
            error = make_early_end("IFC", "export it again", has_hung=has_hung)
            raise error
        (result.hung if has_hung else result.ended).add(attempt.element)
        hangs[attempt.engine] += has_hung
        ends += not has_hung
        is_late = _find_spent() + LEAST * limits.seconds > until
        if hangs.total() >= LOSSES or ends >= 10 * LOSSES or is_late:
            result.is_whole = False
            break
        engines = tuple(engine for engine in ENGINES[:-1] if hangs[engine] < STRIKES) + ENGINES[-1:]
        work = replace(
            work, engines=engines, made=frozenset(result.shapes), skip=work.skip | {attempt}
        )
    if result.facts is None:
        msg = "holds no IFC that could be read; export it again"
        raise InputError(msg)
    return result.facts, result


def _gather(
    work: IfcWork, result: IfcHarvest, limits: ChildLimits
) -> tuple[IfcAttempt | None, bool] | None:
    """Run one child to its end; if it was early, give the attempt at work and whether it hung."""
    attempt = None
    pieces = ReadingChild("umbra.readers.ifc_engine:read_pieces", work, limits)
    for piece in pieces:
        if isinstance(piece, IfcFacts):
            result.facts = piece
        elif isinstance(piece, IfcAttempt):
            attempt = piece
        elif attempt is not None:
            result.shapes[attempt.element] = piece
    if pieces.is_done:
        return None
    return attempt, pieces.has_hung


def _halve(limits: ChildLimits, hangs: int, until: float) -> ChildLimits:
    """Return the limits of the next child, after some have hung."""
    seconds = limits.seconds * max(0.5**hangs, LEAST)
    return ChildLimits(seconds, max(until - _find_spent(), seconds), limits.memory)


def _find_spent() -> float:
    """Return the processor time that ended children took [s]; on Windows the clock's."""
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return time.monotonic()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
