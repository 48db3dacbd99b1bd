"""Given points, such as windows, sensors and places in a garden, and the tables they come from."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.receivers.counted import Counted
from umbra.receivers.kind import Request, SampleKind, Variables
from umbra.receivers.single import DIMS, SingleReceivers
from umbra.scene.places import Places

if TYPE_CHECKING:
    from umbra.study.result import Study

__all__ = ["GivenPoints", "NamedPoints", "check_points", "read_points"]

_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")


class GivenPoints(SampleKind):
    """Points from a table, such as windows and sensors."""

    name = "points"
    belongs_to_parts = False
    spot = "point"
    formats = ("csv", "geojson", "gpkg")
    tables = {"points.csv": "sample"}  # noqa: RUF012  (a constant)

    def lay_out(self, request: Request) -> "NamedPoints":
        """Take the points as they are given, with normals or without."""
        casting = request.prepare()
        given = check_points(request.options.points)
        normals = given[:, 3:] if given.shape[1] == 6 else np.full((len(given), 3), np.nan)
        local = Places(given[:, :3] - request.scene.origin, np.ascontiguousarray(normals))
        count = len(given)
        return NamedPoints(
            self, casting, (count,), DIMS, np.ones(count), local=local,
            part=np.full(count, -1), names=request.options.names,
        )  # fmt: skip

    def describe_receivers(self, study: "Study") -> str:
        """Describe the points."""
        return "the given points"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number of points, and of points with normals."""
        count = len(study.shadow_hours)
        free = int(np.isnan(study.places.normals).any(1).sum())
        words = f"{count:,}, {count - free:,} with a normal" if free else f"{count:,}, with normals"
        return "Points", words + ("; the others face the sun at all times" if free else "")

    def find_counted(self, study: "Study") -> Counted:
        """Count each point once."""
        which = np.isfinite(study.shadow_hours)
        return Counted(which, np.ones(which.shape), "points", "points")


@dataclass(eq=False, kw_only=True)
class NamedPoints(SingleReceivers):
    """Points, some with names."""

    def sum_up(self, study: "Study") -> Variables:
        """Return the points' names, where they have some."""
        return {"name": (DIMS, np.array(self.names))} if self.names else {}


def read_points(path: str | Path) -> tuple[NDArray[np.float64], list[str]]:
    """
    Read points from a table of comma-separated values.

    Parameters
    ----------
    path : path
        Columns x, y, z, or x, y, z, nx, ny, nz, in this order; with a first line of
        names they may be in any, with others beside them; ``name`` names the points.

    Returns
    -------
    points : (n, 3) or (n, 6) float64
    names : list of str
        Empty where there are none.

    Raises
    ------
    InputError
        If the file cannot be read, or a line has other than numbers.
    """
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            rows = [
                (n, row) for n, row in enumerate(csv.reader(file), 1) if any(map(str.strip, row))
            ]
    except OSError as error:
        msg = f"{path}: {(error.strerror or str(error)).lower()}; name a table of points"
        raise InputError(msg, path=path) from None
    except (UnicodeDecodeError, csv.Error) as error:
        msg = f"{path}: cannot be read as a table ({error}); give comma-separated x,y,z"
        raise InputError(msg, path=path) from None
    if not rows:
        msg = f"{path}: there are no points; give lines of x,y,z or x,y,z,nx,ny,nz"
        raise InputError(msg, path=path)
    head = [word.strip().lower() for word in rows[0][1]]
    label = None
    if {"x", "y", "z"} <= set(head):
        rows = rows[1:]
        wanted = [name for name in _COLUMNS if name in head]
        if len(wanted) not in {3, 6}:
            msg = f"{path}: a normal needs all of nx, ny, nz; its columns are {', '.join(head)}"
            raise InputError(msg, path=path)
        places = [head.index(name) for name in wanted]
        label = head.index("name") if "name" in head else None
    else:
        places = list(range(6 if len(head) >= 6 else 3))
    points = []
    for line, row in rows:
        try:
            points.append([float(row[place]) for place in places])
        except (ValueError, IndexError):
            msg = (
                f"{path}: line {line} has not {len(places)} numbers ({','.join(row)[:60]}); "
                "give x,y,z or x,y,z,nx,ny,nz"
            )
            raise InputError(msg, path=path, line=line) from None
    names = [row[label].strip() for _, row in rows] if label is not None else []
    return check_points(points), names


def check_points(points: ArrayLike | None) -> NDArray[np.float64]:
    """Return points as an array, with unit normals."""
    given = np.array([] if points is None else points, np.float64)
    if given.ndim != 2 or given.shape[1] not in {3, 6} or not len(given):
        msg = "receivers 'points' need points (n, 3) or with normals (n, 6); give points="
        raise InputError(msg)
    wrong = ~np.isfinite(given).all(1)
    if given.shape[1] == 6:
        length = np.linalg.norm(given[:, 3:], axis=1)
        wrong |= length == 0
        given[:, 3:] /= np.where(length > 0, length, 1.0)[:, None]
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        msg = (
            f"{int(wrong.sum())} points are not finite or have a normal of length 0 "
            f"(first: point {first + 1}); correct or remove them"
        )
        raise InputError(msg, point=first)
    return given
