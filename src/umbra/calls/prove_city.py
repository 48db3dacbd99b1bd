"""Verdicts on named receivers of a city's files, each counted among all that reaches it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from umbra.calls.prove import Proof, read_logo_of
from umbra.calls.prove_options import ProofOptions, take_study_options
from umbra.rules.record import Rule
from umbra.tiles.city_options import CityOptions, TileOptions
from umbra.verdicts.judge import judge_rules, spell_out

__all__ = ["make_city_proof"]


def make_city_proof(
    files: Sequence[str],
    site: Mapping[str, Any] | None,
    options: ProofOptions,
    tiling: TileOptions,
    rules: Sequence[Sequence[Rule]],
    folder: Path,
    reading: Mapping[str, Any] | None = None,
    spell: Callable[[str], str] = str,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
    begin: Callable[[str], object] = lambda _stage: None,
) -> Proof:
    """
    Judge a city by rules, with the options of records; ``spell`` writes options' names.

    Parameters
    ----------
    files : sequence of str
        Files, folders and patterns.
    site : mapping, optional
        Arguments of ``find_site`` that override the files.
    options : ProofOptions
    tiling : TileOptions
        ``tiles``: side of the squares whose receivers are counted together; ``memory``.
    rules : sequence of sequences of Rule
        The variants of each.
    folder : Path
        Of the results, which one run holds; keeps the files as arrays, and what was counted.
    reading : mapping, optional
        Options of ``umbra.read``.
    progress, begin : callable
        Called with the number of files read and of all, and with the name of each stage.

    Raises
    ------
    InputError
        If an option, a file or the folder is wrong.
    """
    from umbra.tiles.city_areas import settle_roads  # noqa: PLC0415
    from umbra.tiles.city_proposal import tell_tiled_proposal  # noqa: PLC0415
    from umbra.tiles.city_verdicts import gather_city  # noqa: PLC0415
    from umbra.tiles.sealed import refuse_links  # noqa: PLC0415
    from umbra.tiles.settle import locate_city, settle_city  # noqa: PLC0415

    refuse_links(folder)
    logo = read_logo_of(options)  # before all that takes time
    named = {name: getattr(options, name) for name in ("areas", "areas_on")}
    asked = replace(take_study_options(options), **named)
    city = CityOptions(tiles=tiling.tiles, memory=tiling.memory)
    settled = settle_city(files, site, asked, city, folder, reading, progress)
    begin("judging")
    job = replace(settled.job, square=city.tiles)
    gathered = gather_city(
        job, int(options.year or 0), areas=job.options.areas, areas_on=options.areas_on,
        windows=options.windows, plot=options.plot,
        roads=settle_roads(options.roads, settled.catalogue, locate_city(settled.catalogue)),
        reveal=options.reveal,
    )  # fmt: skip
    verdicts = spell_out(judge_rules(gathered, rules), spell)
    gathered.pieces.drop_others()
    known, catalogue = settled.ground.known, settled.catalogue
    read = [note for file in catalogue.files for note in file.notes]
    land = job.options.horizon
    notes = (
        *read, *catalogue.notes, *settled.told, *(() if land is None else land.told),
        *tell_tiled_proposal(job.open()), *gathered.notes, *known.notes,
    )  # fmt: skip
    ground = spell(str(known.describe().get("assumption", known.name)))
    return Proof(
        verdicts, gathered, options, ground, tuple(dict.fromkeys(map(spell, notes))), spell, logo
    )
