"""``umbra inspect``: what a file contains."""

from collections.abc import Sequence

import click

from umbra.cli.click_options import SectionedCommand
from umbra.cli.reading import files_argument, read_model, reading_options
from umbra.cli.terminal import echo, echo_json, name_reading, show_progress
from umbra.errors import fit_names, show_count
from umbra.machine import load_compiler

__all__ = ["command"]

_MOST = 10  # rows of a table for a person who does not ask for --all


@click.command("inspect", cls=SectionedCommand, headings=("Reading", "Options"))
@files_argument
@reading_options()
@click.option("--all", "shows_all", is_flag=True, help="List all parts, layers and tags, not ten.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[str, ...], shows_all: bool, as_json: bool) -> None:
    """
    Show what a file contains: parts, size, location, and whether its meshes are closed.

    Shadows are exact for any mesh; those of closed meshes are counted faster.
    """
    load_compiler()
    from umbra.readers.georeference import show_crs  # noqa: PLC0415
    from umbra.receivers.window_search import count_windows  # noqa: PLC0415
    from umbra.receivers.windows import HOW  # noqa: PLC0415
    from umbra.volume.inspection import describe_scene, inspect_scene  # noqa: PLC0415

    with show_progress(quiet=False) as stages:
        stages.begin(name_reading(files))
        scene = read_model(files)
        stages.begin("looking for open edges")
        inspection = inspect_scene(scene)
        windows = count_windows(scene)
    result = {**describe_scene(scene, inspection), "windows": windows}
    if as_json:
        echo_json(result)
        return
    for source in scene.sources:
        echo(f"{source.name}: {source.format}")
    bounds = scene.bounds()
    size = bounds[1] - bounds[0]
    echo(
        f"{show_count(len(inspection.parts), 'part')}, "
        f"{show_count(inspection.total.triangles, 'triangle')}, {inspection.vertices:,} vertices"
    )
    echo(
        f"{size[0]:.2f} x {size[1]:.2f} x {size[2]:.2f} m, from "
        + ", ".join(f"{v:.2f}" for v in bounds[0])
        + " to "
        + ", ".join(f"{v:.2f}" for v in bounds[1])
    )
    crs = show_crs(scene.crs or "no CRS")
    if scene.latitude is not None and scene.longitude is not None:
        crs = crs if scene.crs else f"{crs}, but the file says where it is"
        location = f"latitude {scene.latitude:.5f}°, longitude {scene.longitude:.5f}°"
        if scene.elevation is not None:
            datum = "ellipsoid (WGS 84), not the sea" if scene.is_ellipsoidal else "sea"
            location += f", {scene.elevation + 0.0:g} m above the {datum}"
        if scene.true_north is not None:
            location += f", true north at {scene.true_north:.2f}° from the model's y axis"
        echo(f"{crs}: {location}")
    else:
        doubt = scene.site_doubt or "the file does not say where it is"
        echo(f"{crs}: {doubt} (--lat, --lon)")
    for number, animation in enumerate(scene.animations):
        echo(f"animation {number}: '{animation.name}', {animation.duration:g} s (--time poses it)")
    if scene.lights:
        echo(f"{show_count(len(scene.lights), 'light')} of its own")
    if windows:
        echo(f"{show_count(windows, 'window')} (study --receivers windows)")
    elif any(source.format.startswith("IFC") for source in scene.sources):
        echo(f"no windows; {HOW}")
    echo("closed" if inspection.total.closed else _why_open(result))
    for note in scene.notes:
        echo(f"note: {note}")
    most = len(scene.parts) if shows_all else _MOST
    _list_words("layer", [[part.layer] for part in scene.parts], result["parts"], most)
    _list_words("tag", [part.tags for part in scene.parts], result["parts"], most)
    _list_parts(result["parts"], most)


def _why_open(result: dict) -> str:
    reasons = [
        f"{result[key]:,} {words if result[key] != 1 else words.replace(many, many[:-1])}"
        for key, many, words in (
            ("border_edges", "edges", "border edges"),
            ("nonmanifold_edges", "edges", "edges with more than two faces"),
            ("inconsistent_edges", "edges", "edges with inconsistent windings"),
            ("degenerate_triangles", "triangles", "degenerate triangles"),
            ("duplicate_triangles", "triangles", "duplicate triangles"),
        )
        if result[key]
    ]
    text = "not closed: " + ", ".join(reasons)
    if result["first_bad_edge"]:
        ends = (", ".join(f"{v:.3f}" for v in end) for end in result["first_bad_edge"])
        text += f" (first: {' to '.join(ends)})"
    return f"{text}; shadows are exact all the same"


def _list_words(what: str, words: Sequence[Sequence[str]], parts: list[dict], most: int) -> None:
    """Print the layers or tags and how many parts each selects, the commonest first."""
    chosen: dict[str, list[dict]] = {}
    for labels, part in zip(words, parts, strict=True):
        for word in filter(None, labels):
            chosen.setdefault(word, []).append(part)
    # A word of one object alone, as a GlobalId is, chooses no group; one of all chooses nothing.
    every = len({part["name"] for part in parts})
    shared = [
        (word, len(members), sum(part["triangles"] for part in members))
        for word, members in chosen.items()
        if what == "layer" or 1 < len({part["name"] for part in members}) < every
    ]
    if shared:
        shared.sort(key=lambda row: -row[1])
        _show_table({what: "<24", "parts": ">8", "triangles": ">10"}, shared, most)


def _list_parts(parts: list[dict], most: int) -> None:
    """Print the number of parts by kind, then a table of the first parts."""
    kinds: dict[str, list[dict]] = {}
    for part in parts:
        kinds.setdefault(part["kind"] or "-", []).append(part)
    tallies = [
        (
            kind,
            len(members),
            *(sum(part[name] for part in members) for name in ("triangles", "closed")),
        )
        for kind, members in sorted(kinds.items())
    ]
    _show_table({"kind": "<24", "parts": ">7", "triangles": ">10", "closed": ">7"}, tallies, most)
    width = min(max(len(part["name"]) for part in parts), 48)
    columns = {
        "part": f"<{width}", "kind": "<20", "triangles": ">9", "closed": ">7", "border": ">7",
        ">2 faces": ">9", "windings": ">9",
    }  # fmt: skip
    rows = [
        (part["name"], part["kind"], part["triangles"], "yes" if part["closed"] else "no",
         part["border_edges"], part["nonmanifold_edges"], part["inconsistent_edges"])
        for part in parts
    ]  # fmt: skip
    _show_table(columns, rows, most)


def _show_table(columns: dict[str, str], rows: Sequence[tuple], most: int) -> None:
    """Print the first rows of a table; columns have a heading and a format, ``<`` for names."""
    forms = columns.values()
    cells = [
        fit_names(column, int(form[1:])) if form[0] == "<" else column
        for column, form in zip(zip(*rows[:most], strict=True), forms, strict=True)
    ]
    echo()
    for row in (columns, *zip(*cells, strict=True)):
        echo(" ".join(f"{cell:{form}}" for cell, form in zip(row, forms, strict=True)))
    if len(rows) > most:
        echo(f"and {len(rows) - most} more (--all lists them)")
