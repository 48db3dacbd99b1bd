"""The window of ``umbra view``, or what a notebook shows instead."""

from __future__ import annotations

import importlib.util
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TypeGuard

from umbra.calls.first_view import begin_view, draw_view, settle_view
from umbra.calls.ground import stand_scene
from umbra.calls.picture_options import ViewOptions
from umbra.errors import check_type
from umbra.machine import choose_threads
from umbra.scene import Scene
from umbra.signatures import takes
from umbra.sun import Site

if TYPE_CHECKING:
    from umbra.calls.picture import Picture
    from umbra.web.widget import LiveView

__all__ = ["is_page", "open_window", "show"]

P = ParamSpec("P")


class ShowCall(Protocol[P]):
    """The signature of ``umbra.show``."""

    def __call__(
        self, scene: Scene, site: Site | None = None, *_: P.args, **options: P.kwargs
    ) -> Picture | LiveView | None: ...


def _take(record: Callable[P, ViewOptions]) -> Callable[[Any], ShowCall[P]]:
    return takes(record, "a view")


@_take(ViewOptions)
def show(
    scene: Scene, site: Site | None = None, *, options: ViewOptions
) -> Picture | LiveView | None:
    """
    Show a scene in a window; in a notebook as a model that moves, or as a picture.

    The environment decides. In a notebook with anywidget (``pip install
    'umbra-shadows[notebook]'``) the cell holds the live model, which the browser draws. Without
    anywidget, or with an option that only umbra's own devices know (``method``, ``soft``,
    ``device``, ``mask_scale``, ``animation``, ``time``, ``out`` and the like), it holds a picture.
    Elsewhere a window opens.

    Parameters
    ----------
    scene : Scene
    site : Site, optional
        The file's site by default; without one the light comes from the upper left.
    options : ViewOptions
        Each by its name.

    Returns
    -------
    shown : LiveView, Picture or None
        In a notebook: a widget whose ``date``, ``time`` and ``viewpoint`` follow its controls and
        can be set, or a picture; None when the window is closed or a page is written.

    Raises
    ------
    InputError
        If an argument is wrong, or there is neither a notebook nor a display.
    UmbraError
        If a package that the window needs is missing.
    """
    check_type("scene", scene, Scene)
    if site is None:
        site = _find_site(scene, options)
    else:
        check_type("site", site, Site)
    options = settle_view(options, scene, site)
    for line in () if options.horizon is None else options.horizon.told:
        warnings.warn(line, stacklevel=3)
    if is_page(options.out):
        from umbra.calls.live import write_live_page  # noqa: PLC0415

        write_live_page(options.out, scene, site, options)
        return None
    if _is_notebook():
        if _is_live(options):
            from umbra.calls.live import make_widget  # noqa: PLC0415

            return make_widget(scene, site, options)
        return draw_view(scene, site, options)
    open_window(scene, site, options)
    return None


def is_page(path: object) -> TypeGuard[str | os.PathLike[str]]:
    """Return whether a file's ending asks for a page."""
    return str(path).lower().endswith((".html", ".htm"))


def open_window(
    scene: Scene, site: Site | None, options: ViewOptions, instead: str = "umbra.render(scene)"
) -> None:
    """
    Open the window and return when it is closed.

    ``instead`` is a call or command without a window, for machines without a display.
    """
    from umbra.window.screen import check_display  # noqa: PLC0415

    check_display(instead)
    from umbra.window.app import PANEL, run_viewer  # noqa: PLC0415

    size = (max(options.size[0] - PANEL, 1), options.size[1])
    scene, height = stand_scene(options, scene)
    view = begin_view(options, scene, site, size)
    names = [Path(source.name).name for source in scene.sources if not source.is_companion]
    stem = names[0].split(".")[0] if names else "scene"
    run_viewer(
        scene,
        view,
        names=names or ["scene"],
        size=options.size,
        instead=instead,
        ground=height,
        threads=choose_threads(options.threads),
        animates=options.animation is not None and options.time is None,
        picture=Path(options.out or f"{stem}.png"),
        view_file=Path(options.view or f"{stem}.view.json"),
    )


def _find_site(scene: Scene, options: ViewOptions) -> Site | None:
    """Return the file's site; a date's sun needs one, and land, whose azimuths are of north."""
    from umbra.sun import find_site  # noqa: PLC0415

    is_known = scene.latitude is not None and scene.longitude is not None
    is_asked = options.date or options.at or options.horizon is not None
    return find_site(scene) if is_known or is_asked else None


def _is_notebook() -> bool:
    """Return whether a notebook displays a cell's result."""
    shell: Any = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return shell is not None and hasattr(shell, "kernel")


def _is_live(options: ViewOptions) -> bool:
    """Return whether a notebook can show a view as a widget that moves."""
    poses = (options.animation, options.time, options.out)
    has_own = options.list_own() or any(pose is not None for pose in poses)
    return not has_own and importlib.util.find_spec("anywidget") is not None
