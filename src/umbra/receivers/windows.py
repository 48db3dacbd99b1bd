"""
Windows as receivers: of a table or of the model, judged at the centre, the sill or as whole panes.

A pane behind a reveal that the model does not show gets light through the opening at the wall's
outer face alone: the frame of the opening hides all else.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count
from umbra.receivers.counted import Counted
from umbra.receivers.kind import DIMS, Request, Variables
from umbra.receivers.named import NamedReceivers
from umbra.receivers.openings import Openings
from umbra.receivers.placed import PlacedKind, PlacedSamples
from umbra.receivers.single import PointTile, SharedEdges
from umbra.receivers.standing import name_holders
from umbra.receivers.window_search import find_model_windows
from umbra.scene import Scene
from umbra.scene.grid import Places
from umbra.scene.named_places import Window

__all__ = ["MOST_HELD", "WindowKind", "WindowReceivers", "find_windows"]

HOW = (  # a house without windows in its file gets them
    "give them in a table: windows='FILE.csv' with name,x,y,z,azimuth,width,height "
    "(x,y,z the middle of the pane's outer face)"
)
_FRONT = 1e-3  # of a pane, at which it is judged [m]
_SILL = 0.01  # above the lower edge of a pane, at which its sill is judged [m]
_SIDE, _LEAST = 0.25, 4  # of a pane's squares [m], and least number along a side
MOST_HELD = 2000  # windows of which it is looked whether they lie in a body


def find_windows(request: Request) -> tuple[list[Window], list[str]]:
    """
    Find the windows of a table, or of the model.

    Raises
    ------
    InputError
        If the model has none and no table is given.
    """
    options, scene = request.options, request.scene
    if options.windows is not None:
        return [row.place(request.true_north) for row in options.windows], []
    windows, notes = find_model_windows(scene, request.prepare())
    if not windows:
        why = f" ({'; '.join(notes)})" if notes else ""
        msg = f"the model has no windows (IfcWindow, Window, Aperture){why}; {HOW}"
        raise InputError(msg, option="windows")
    return windows, notes


@dataclass(frozen=True, eq=False)
class OpeningTile(PointTile):
    """
    Points behind openings.

    Parameters
    ----------
    openings : Openings
    """

    openings: Openings = field(kw_only=True)

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light the points in shadow, of the opening's frame, too."""
        hidden = super().masks(suns)
        ways = suns[:, None, :3]
        if suns.shape[1] == 4:
            ways = ways - suns[:, None, 3:] * self.places.points
        hidden[self.openings.find_framed(ways)] = 1
        return hidden


@dataclass(eq=False, kw_only=True)
class WindowReceivers(NamedReceivers):
    """
    Panes of windows.

    Parameters
    ----------
    openings : Openings
    true_north : float
        Azimuth of true north in the model's plan [degrees].
    """

    openings: Openings
    true_north: float = 0.0

    def _make_tile(self, samples: Any, span: slice, shared: SharedEdges) -> PointTile:
        plain = super()._make_tile(None, span, shared)
        openings = self.openings.pick(span)
        if not openings.are_deep:
            return plain
        return OpeningTile(
            plain.casting, plain.places, plain.part, None, shared, None, span.start,
            openings=openings,
        )  # fmt: skip

    def sum_up(self, study: Any) -> Variables:
        """Return the names, places and rooms of the windows, and their figures."""
        windows, dims = self.records, ("window",)
        variables: Variables = {
            "name": (DIMS, np.array(self.group_names)[self.owner]),
            **super().sum_up(study),
            "window": (dims, np.array(self.group_names)),
            "window_position": ((*dims, "xyz"), np.array([w.center for w in windows])),
            "window_azimuth": (dims, np.array([w.find_azimuth(self.true_north) for w in windows])),
            "window_area": (dims, np.array([w.area_m2 for w in windows])),
        }
        for what in ("storey", "flat", "room"):
            words = [getattr(window, what) for window in windows]
            if any(words):
                variables[f"window_{what}"] = (dims, np.array(words))
        return variables


class WindowKind(PlacedKind):
    """Windows, judged at their centre, at their sill, or as whole panes."""

    name = noun = "windows"
    spot = "pane"
    formats: ClassVar[tuple[str, ...]] = ()
    own_table = "windows.csv"

    def place(self, scene: Scene, options: Any) -> PlacedSamples:
        """Lay out nothing: `lay_out` does, which knows true north."""
        raise NotImplementedError

    def lay_out(self, request: Request) -> WindowReceivers:
        """Find the windows, and sample their panes."""
        options, scene = request.options, request.scene
        windows, notes = find_windows(request)
        windows = [_settle_reveal(window, options.reveal) for window in windows]
        windows, remarks = _bring_out(windows, request)
        notes += remarks
        judge = options.judge
        local = [_sample(window, judge) for window in windows]
        owner = np.repeat(np.arange(len(windows)), [len(points) for points in local])
        flat = np.concatenate(local)
        openings = Openings.of(windows, owner, flat)
        axes, middles = openings.axes, np.array([window.center for window in windows])[owner]
        points = middles + np.einsum("nk,nkd->nd", np.column_stack([flat, np.full(
            len(flat), _FRONT)]), axes) - scene.origin  # fmt: skip
        if options.exact and openings.are_deep:
            msg = (
                "exact= solves times without reveals; leave it out, or judge on the outer face "
                "(reveal='none')"
            )
            raise InputError(msg, option="exact")
        counts = np.bincount(owner)
        areas = np.array([window.area_m2 for window in windows])[owner] / counts[owner]
        return WindowReceivers(
            self, request.prepare(), (len(points),), DIMS, areas,
            {"judge": judge, "windows": len(windows)},
            local=Places(points, axes[:, 2].copy()), part=np.full(len(points), -1), areas=areas,
            records=windows, owner=owner, notes=tuple(notes), openings=openings,
            true_north=request.true_north,
        )  # fmt: skip

    def describe_receivers(self, study: Any) -> str:
        """Describe the windows."""
        count, judge = len(study.laid.records), study.facts["judge"]
        where = {"centre": "at the centre of the pane", "sill": "at the middle of the sill",
                 "pane": "as the whole pane"}  # fmt: skip
        return f"{show_count(count, 'window')}, judged {where[judge]}"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number of samples."""
        return (
            "Windows",
            f"{len(study.laid.records):,}, {show_count(len(study.shadow_hours), 'sample')}",
        )

    def find_counted(self, study: Any) -> Counted:
        """Weight each sample by its share of a window."""
        which = np.isfinite(study.shadow_hours)
        return Counted(which, 1.0 / np.bincount(study.laid.owner)[study.laid.owner], "windows",
                       "windows")  # fmt: skip


def _settle_reveal(window: Window, reveal: float | str | None) -> Window:
    """Return a window as it is judged: on the wall's outer face, or behind a depth [m]."""
    if window.is_of_model:  # whose walls have the hole: they cast the shadow of its edges
        outer = window.center + (window.reveal or 0.0) * window.normal
        return replace(window, reveal=0.0, center=outer if reveal == "none" else window.center)
    if reveal == "none":
        return replace(window, reveal=0.0)
    depth = window.reveal if window.reveal is not None else (reveal or 0.0)
    return replace(window, reveal=float(depth))


def _bring_out(windows: Sequence[Window], request: Request) -> tuple[list[Window], list[str]]:
    """Bring panes that lie within a wall by their reveal to its outer face; tell of all others."""
    if len(windows) > MOST_HELD:
        return list(windows), []
    scene, soup = request.scene, request.prepare().soup
    settled, lost = list(windows), []
    front = np.array([w.center + 2 * _FRONT * w.normal for w in windows]) - scene.origin
    holders = name_holders(scene, soup, front)
    for k, holder in enumerate(holders):
        if not holder:
            continue
        window = windows[k]
        out = window.center + (window.reveal or 0.0) * window.normal
        beyond = (out + 2 * _FRONT * window.normal - scene.origin)[None]
        if window.reveal and not name_holders(scene, soup, beyond)[0]:
            settled[k] = replace(window, center=out)
        else:
            lost.append((window.name, holder))
    if not lost:
        return settled, []
    count = show_count(len(lost), "window lies", "windows lie")
    note = (
        f"{count} inside a body, where no sun comes (first: '{lost[0][0]}' in '{lost[0][1]}'); "
        "x,y,z is the middle of the pane's outer face: move it out of the wall, or tell how deep "
        "it lies (the column reveal)"
    )
    return settled, [note]


def _sample(window: Window, judge: str) -> NDArray[np.float64]:
    """Return the places of a pane's samples: right and up of its middle, (n, 2) [m]."""
    if judge == "centre":
        return np.zeros((1, 2))
    if judge == "sill":
        return np.array([[0.0, min(_SILL - window.height / 2, 0.0)]])
    cols, rows = (max(_LEAST, math.ceil(side / _SIDE)) for side in (window.width, window.height))
    across = ((np.arange(cols) + 0.5) / cols - 0.5) * window.width
    up = ((np.arange(rows) + 0.5) / rows - 0.5) * window.height
    return np.stack([k.ravel() for k in np.meshgrid(across, up)], 1)
