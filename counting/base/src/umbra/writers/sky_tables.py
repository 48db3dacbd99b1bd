"""Tables of the sky above a place: outlines as CSV, and horizons as PVGIS and pvlib read them."""

import csv
from collections.abc import Callable
from pathlib import Path

import orjson

from umbra.sky.free_sky import ExactSky

__all__ = ["write_horizon", "write_outlines", "write_values"]


def write_outlines(path: Path, view: ExactSky) -> None:
    """Write the corners of the outlines: number of the loop, direction, and what is behind."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["outline", "x", "y", "z", "part"])
        for k, outline in enumerate(view.outlines):
            for direction, part in zip(outline.directions.tolist(), outline.part, strict=True):
                table.writerow([k, *map(repr, direction), part or ""])


def write_horizon(path: Path, view: ExactSky, step: float = 1.0) -> None:
    """
    Write the elevations of the horizon, one a line, from north on clockwise, at equal steps.

    PVGIS takes such a file as the user's horizon, and pvlib the same list as ``userhorizon``.
    """
    _, elevation = view.horizon(step)
    path.write_text("".join(f"{value:.3f}\n" for value in elevation), encoding="utf-8")


def write_values(path: Path, view: ExactSky, dates: tuple[str, ...]) -> None:
    """Write all results as JSON, numbers with all their digits."""
    path.write_bytes(orjson.dumps(view.sum_up(dates), option=orjson.OPT_INDENT_2))


WRITERS: dict[str, tuple[str, Callable[[Path, ExactSky], None]]] = {
    "csv": (".csv", write_outlines),
    "horizon": ("-horizon.txt", write_horizon),
}
