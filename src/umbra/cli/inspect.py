"""``umbra inspect``: what a file contains."""

from collections.abc import Sequence

import click

from umbra.cli.reading import read_model, reading_options
from umbra.cli.terminal import echo, echo_json, name_reading, show_progress
from umbra.errors import fit_names

__all__ = ["command"]

_MOST = 40  # parts listed for a person; --json has all


@click.command("inspect")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@reading_options()
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[str, ...], as_json: bool) -> None:
    """
    Show what a file contains: parts, size, location, and whether its meshes are closed.

    A closed mesh casts by its lit faces, anything else triangle by triangle; shadows
    are exact in both cases.
    """
    from umbra.readers.georeference import show_crs  # noqa: PLC0415
    from umbra.volume.inspection import describe_scene, inspect_scene  # noqa: PLC0415

    with show_progress(quiet=False) as stages:
        stages.begin(name_reading(files))
        scene = read_model(files)
        stages.begin("looking for open edges")
        found = inspect_scene(scene)
    result = describe_scene(scene, found)
    if as_json:
        echo_json(result)
        return
    for source in scene.sources:
        echo(f"{source.name}: {source.format}")
    bounds = scene.bounds()
    size = bounds[1] - bounds[0]
    echo(f"{len(found.parts)} parts, {found.total.triangles} triangles, {found.vertices} vertices")
    echo(
        f"{size[0]:.2f} x {size[1]:.2f} x {size[2]:.2f} m, from "
        + ", ".join(f"{v:.2f}" for v in bounds[0])
        + " to "
        + ", ".join(f"{v:.2f}" for v in bounds[1])
    )
    crs = show_crs(scene.crs or "no CRS")
    if scene.latitude is not None and scene.longitude is not None:
        place = f"latitude {scene.latitude:.5f}°, longitude {scene.longitude:.5f}°"
        if scene.elevation is not None:
            place += f", {scene.elevation:g} m above the sea"
        if scene.true_north is not None:
            place += f", true north at {scene.true_north:.2f}° from the model's y axis"
        echo(f"{crs}: {place}")
    else:
        echo(f"{crs}: the file does not say where it is (--lat, --lon)")
    for number, one in enumerate(scene.animations):
        echo(f"animation {number}: '{one.name}', {one.duration:g} s (--time poses it)")
    if scene.lights:
        echo(f"{len(scene.lights)} lights of its own")
    echo("closed" if found.total.closed else _why_open(result))
    for note in scene.notes:
        echo(f"note: {note}")
    _list_words("layer", [[part.layer] for part in scene.parts], result["parts"])
    _list_words("tag", [part.tags for part in scene.parts], result["parts"])
    _list_parts(result["parts"])


def _why_open(result: dict) -> str:
    reasons = [
        f"{result[key]} {words if result[key] != 1 else words.replace(many, many[:-1])}"
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
    return text


def _list_words(what: str, words: Sequence[Sequence[str]], parts: list[dict]) -> None:
    """Print the layers or tags and how many parts each selects, the commonest first."""
    tally: dict[str, list[int]] = {}
    names: dict[str, set[str]] = {}
    for chosen, part in zip(words, parts, strict=True):
        for word in chosen:
            if word:
                count = tally.setdefault(word, [0, 0])
                count[0] += 1
                count[1] += part["triangles"]
                names.setdefault(word, set()).add(part["name"])
    # A word of one object alone, as a GlobalId is, chooses no group; one of all chooses nothing.
    every = len({part["name"] for part in parts})
    shared = {
        word: count
        for word, count in tally.items()
        if what == "layer" or 1 < len(names[word]) < every
    }
    if not shared:
        return
    echo(f"\n{what:24}    parts  triangles")
    first = sorted(shared.items(), key=lambda one: -one[1][0])[:_MOST]
    shown = fit_names([word for word, _ in first], 24)
    for word, (_, (n, triangles)) in zip(shown, first, strict=True):
        echo(f"{word:24} {n:8} {triangles:10}")
    if len(shared) > _MOST:
        echo(f"and {len(shared) - _MOST} more (--json lists all)")


def _list_parts(parts: list[dict]) -> None:
    """Print the number of parts by kind, then a table of the first parts."""
    kinds: dict[str, list[int]] = {}
    for part in parts:
        tally = kinds.setdefault(part["kind"] or "-", [0, 0, 0])
        tally[0] += 1
        tally[1] += part["triangles"]
        tally[2] += part["closed"]
    echo("\nkind                       parts  triangles  closed")
    for shown, (_, tally) in zip(fit_names(sorted(kinds), 24), sorted(kinds.items()), strict=True):
        n, triangles, closed = tally
        echo(f"{shown:24} {n:7} {triangles:10} {closed:7}")
    width = min(max(len(part["name"]) for part in parts), 48)
    echo(f"\n{'part':{width}}  {'kind':20} triangles  closed  border  >2 faces  windings")
    listed = parts[:_MOST]
    names = fit_names([part["name"] for part in listed], width)
    kinds_shown = fit_names([part["kind"] for part in listed], 20)
    for part, name, kind in zip(listed, names, kinds_shown, strict=True):
        echo(
            f"{name:{width}}  {kind:20} {part['triangles']:9}  "
            f"{'yes' if part['closed'] else 'no':>6}  {part['border_edges']:6}  "
            f"{part['nonmanifold_edges']:8}  {part['inconsistent_edges']:8}"
        )
    if len(parts) > _MOST:
        echo(f"and {len(parts) - _MOST} more (--json lists all)")
