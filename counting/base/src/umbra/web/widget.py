"""The live model in a notebook: the page of ``app.js`` as an ``anywidget``."""

import json
from collections.abc import Mapping
from typing import Any

import anywidget
import traitlets

from umbra.errors import InputError
from umbra.web.bundle import bundle, read_asset

__all__ = ["LiveView"]

_VIEWPOINT = ("target", "heading", "tilt", "distance", "fov")


class LiveView(anywidget.AnyWidget):
    """
    A scene that moves in a notebook's cell; `umbra.show` makes it.

    Attributes follow the page's controls, and the page follows them when they are set.

    Parameters
    ----------
    block : bytes
        The packed model.
    config : mapping
        As ``Config`` of ``app.js``.
    height : int
        Of the cell [CSS pixels].

    Attributes
    ----------
    date : str
        Local date, ``"2026-03-21"``.
    time : str
        Local clock time, ``"15:00"``.
    azimuth, altitude : float
        Of the sun [degrees]; to be set only without a site, else date and time set them.
    viewpoint : dict
        ``target`` in the model's own coordinates [m], ``heading``, ``tilt``, ``fov`` [degrees]
        and ``distance`` [m].
    place : dict or None
        Where one clicked: ``position`` [m], ``object`` (None on the ground) and ``in_sun``
        (None at night). Read it only.
    """

    _esm = f"{bundle('widget')}\nexport default {{ render: $widget.render }};\n"
    _css = read_asset("page.css")

    block = traitlets.Bytes().tag(sync=True)
    config = traitlets.Dict().tag(sync=True)
    height = traitlets.Int(640).tag(sync=True)
    date = traitlets.Unicode().tag(sync=True)
    time = traitlets.Unicode().tag(sync=True)
    azimuth = traitlets.Float().tag(sync=True)
    altitude = traitlets.Float().tag(sync=True)
    viewpoint = traitlets.Dict().tag(sync=True)
    place = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)

    def __init__(self, block: bytes, config: Mapping[str, Any], height: int = 640) -> None:
        view = config["view"]
        sun, minutes = view["sun"], int(view["sun"]["minutes"])
        super().__init__(
            block=block,
            config={**config, "hasLink": False, "takesWheel": False},
            height=height,
            date=sun["date"],
            time=f"{minutes // 60:02}:{minutes % 60:02}",
            azimuth=sun["azimuth"],
            altitude=sun["altitude"],
            viewpoint={name: view["viewpoint"][name] for name in _VIEWPOINT},
        )

    @traitlets.validate("date")
    def _check_date(self, proposal: dict[str, Any]) -> str:
        from umbra.sun.local_time import parse_date  # noqa: PLC0415

        return parse_date(proposal["value"]).isoformat()

    @traitlets.validate("time")
    def _check_time(self, proposal: dict[str, Any]) -> str:
        hours, _, minutes = str(proposal["value"]).partition(":")
        if hours.isdigit() and minutes.isdigit() and int(hours) < 24 and int(minutes) < 60:
            return f"{int(hours):02}:{int(minutes):02}"
        msg = f"the time {proposal['value']!r} is not a clock time; write HH:MM, such as 09:30"
        raise InputError(msg, time=proposal["value"])

    @traitlets.validate("viewpoint")
    def _check_viewpoint(self, proposal: dict[str, Any]) -> dict[str, Any]:
        given = proposal["value"]
        unknown = sorted(set(given) - {*_VIEWPOINT})
        if unknown:
            msg = f"a viewpoint has no '{unknown[0]}'; it has {', '.join(_VIEWPOINT)}"
            raise InputError(msg)
        return json.loads(json.dumps({**self.viewpoint, **given}))
