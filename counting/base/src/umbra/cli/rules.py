"""``umbra rules``: the rules that umbra brings."""

from typing import Any

import click

from umbra.cli.terminal import echo, echo_json

__all__ = ["command"]


@click.command("rules")
@click.argument("name", required=False, metavar="[NAME]")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(name: str | None, as_json: bool) -> None:
    """
    List the rules that umbra brings, or print one to copy and change.

    A rule is a file with its edition and source, and with what was read of them. Check it before
    use: none of these files is an authority's own.

    \b
    Examples:
    umbra rules
    umbra rules en-17037-sunlight
    umbra rules zurich-abv > mine.yaml
    umbra prove town.city.json --areas gardens.geojson --rules bre-209-gardens --out proof
    """  # noqa: D301  (click asks for a real backspace)
    from umbra.rules.catalogue import describe_rule, list_rules  # noqa: PLC0415
    from umbra.rules.read import EVERY, find_shipped, read_rule  # noqa: PLC0415

    if name is None:
        if as_json:
            every = [describe_rule(read_rule(f"{name}:{EVERY}")) for name in find_shipped()]
            echo_json({"rules": every})
            return
        for rule in list_rules():
            echo(f"{rule.name:21}{rule.place}: {rule.asks} ({rule.edition})")
        return
    stem, _, variant = name.partition(":")
    rules = read_rule(f"{stem}:{variant or EVERY}")
    if as_json:
        facts: dict[str, Any] = describe_rule(rules)
        echo_json({**facts, "text": rules[0].text})
        return
    echo(rules[0].text.rstrip("\n"))
