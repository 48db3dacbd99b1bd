"""Tables of windows: a line for each, and for each storey, flat and room."""

from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import DIMS

if TYPE_CHECKING:
    from umbra.receivers.windows import WindowReceivers
    from umbra.study.result import Study

__all__ = ["GROUPS", "average_windows", "list_groups", "list_windows"]

GROUPS = ("storey", "flat", "room")
"""What windows are grouped by."""
_OWN = {"name", "area", "group_of_sample", "receiver_z", "position", "normal"}


def list_windows(study: "Study", columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """
    Return the columns of a table with a line for each window.

    Parameters
    ----------
    study : Study
        Of windows.
    columns : dict of str to (n_samples,) array
        Results of the samples, as ``writers.tables.find_columns`` names them.

    Returns
    -------
    table : dict of str to (n_windows,) array
        name, storey, flat, room, x, y, z, azimuth, area_m2 and the results: of a whole pane means,
        but for first, last and longest sun, and flags.
    """
    laid = cast("WindowReceivers", study.laid)
    windows = laid.records
    centers = np.array([window.center for window in windows])
    table: dict[str, NDArray[Any]] = {"name": np.array(laid.group_names)}
    table |= {word: np.array([getattr(window, word) for window in windows]) for word in GROUPS}
    table |= {axis: centers[:, k] for k, axis in enumerate("xyz")}
    table["azimuth"] = np.array([window.find_azimuth(laid.true_north) for window in windows])
    table["area_m2"] = np.array([window.area_m2 for window in windows])
    return table | {
        name: reduce_samples(laid, name, values)
        for name, values in columns.items()
        if name not in _OWN and values.dtype.kind in "fiuMb"
    }


def reduce_samples(laid: "WindowReceivers", name: str, values: NDArray[Any]) -> NDArray[Any]:
    """Return the result (n_windows,) of whole panes from that of their samples."""
    if values.dtype.kind == "M":
        join = np.fmax if name.startswith("last") else np.fmin
        first = np.searchsorted(laid.owner, np.arange(len(laid.records)))
        return join.reduceat(values, first)
    if values.dtype.kind == "f" and not name.startswith("longest"):
        return laid.average(values).astype(values.dtype)
    return laid.most(values)


def list_groups(table: dict[str, NDArray[Any]], by: str) -> dict[str, NDArray[Any]] | None:
    """
    Return the columns of a table with a line for each storey, flat or room; None without any.

    Rooms of one name in two flats are two; each number has its mean by area, least and most.
    """
    keys = [word for word in GROUPS if word == by or (by == "room" and word == "flat")]
    if not (table[by] != "").any():
        return None
    words = np.stack([table[key] for key in keys], 1)
    kinds, which = np.unique(words, axis=0, return_inverse=True)
    which = which.ravel()
    columns: dict[str, NDArray[Any]] = {key: kinds[:, k] for k, key in enumerate(keys)}
    columns["windows"] = np.bincount(which)
    area = table["area_m2"]
    columns["area_m2"] = np.bincount(which, area)
    skipped = {"name", *GROUPS, "x", "y", "z", "azimuth", "area_m2"}
    for name, values in table.items():
        if name in skipped or values.dtype.kind != "f":
            continue
        least, most = np.full(len(kinds), np.inf), np.full(len(kinds), -np.inf)
        np.minimum.at(least, which, values)
        np.maximum.at(most, which, values)
        columns[f"mean_{name}"] = np.bincount(which, area * values) / columns["area_m2"]
        columns[f"least_{name}"], columns[f"most_{name}"] = least, most
    return columns


def average_windows(study: "Study") -> "Study":
    """Return a study with one sample for each window, which pictures draw."""
    from dataclasses import replace  # noqa: PLC0415

    from umbra.scene.grid import Places  # noqa: PLC0415

    laid = cast("WindowReceivers", study.laid)
    if len(laid.owner) == len(laid.records):
        return study
    count = len(laid.records)
    first = np.searchsorted(laid.owner, np.arange(count))
    middles = np.array([window.center for window in laid.records]) - laid.casting.scene.origin
    alone = replace(
        laid, shape=(count,), area=laid.group_areas, areas=laid.group_areas,
        owner=np.arange(count), local=Places(middles, laid.local.normals[first]),
        part=laid.part[first], openings=laid.openings.pick(first),
    )  # fmt: skip

    def pick(name: str, dims: tuple[str, ...], values: Any) -> NDArray[Any]:
        if dims[-1:] != DIMS:
            return np.asarray(values)
        array = np.asarray(values)
        if array.dtype.kind in "US":
            return array[..., first]
        return reduce_samples(laid, name, array)

    more = {
        name: (dims, pick(name, dims, values))
        for name, (dims, values) in study.more.items()
        if name != "in_shadow"
    }
    hours = laid.average(study.shadow_hours).astype(np.float32)
    return replace(study, laid=alone, shadow_hours=hours, more=more, masks=None)
