"""The window of ``umbra view``, or what a notebook shows instead."""

import importlib.util
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.calls.first_view import begin_view, draw_view
from umbra.calls.ground import stand_scene
from umbra.calls.options import ViewOptions
from umbra.errors import check_type
from umbra.machine import choose_threads
from umbra.scene import Scene
from umbra.sun import Site

if TYPE_CHECKING:
    from umbra.calls.picture import Picture
    from umbra.calls.result import ShadowStudy
    from umbra.web.widget import LiveView

__all__ = ["is_page", "open_window", "show"]


def show(  # noqa: PLR0913  (each option by its name)
    scene: Scene,
    site: Site | None = None,
    *,
    date: str | None = None,
    at: str | None = None,
    ground: float | str | bool | None = None,
    method: str | None = None,
    soft: str | None = None,
    layer_length: float | None = None,
    layer_gap: float | None = None,
    mask_scale: int | None = None,
    mask_filter: str | None = None,
    detail: float | None = None,
    device: str | None = None,
    size: tuple[int, int] = (1280, 800),
    threads: int | None = None,
    cast: str | Sequence[str] = (),
    no_cast: str | Sequence[str] = (),
    proposed: str | Sequence[str] = (),
    study: "ShadowStudy | None" = None,
    animation: int | str | None = None,
    time: float | None = None,
    view: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
) -> "Picture | LiveView | None":
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
    date : str, optional
        Local date, 21 March by default.
    at : str, optional
        Local clock time, ``"15:00"`` by default.
    ground : float, str or bool, optional
        As in a study: z of a plane [m], ``'feet'``, ``'level'`` or a terrain file; False for
        none.
    method, soft : str, optional
        As in `umbra.render`.
    layer_length, layer_gap, mask_scale, mask_filter, detail : optional
        As in `umbra.render`, unless ``view`` states them.
    device : {'gl', 'cpu'}, optional
        By default gl for a window, cpu for a picture.
    size : (int, int)
        Of the window or the picture.
    threads : int, optional
        All cores by default.
    cast, no_cast : str or sequence of str
        Patterns of the parts that cast, or do not; others are only visible.
    proposed : str or sequence of str
        Patterns of the parts of a proposal, which a page compares: before and after.
    study : ShadowStudy, optional
        Of receivers ``ground`` or ``top``: a page or a notebook shows its hours as colours.
    animation : int or str, optional
        Animation of the scene: its number, its name, or ``"all"``. It plays in a window
        unless ``time`` is given.
    time : float, optional
        Initial time of the animation, of the first one by default [s].
    view : path, optional
        Initial view, as saved in a window.
    out : path, optional
        File of screenshots; in a notebook, of the picture. ``.html`` writes a page of the
        model that moves in any browser, and opens nothing.

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
    given = {name: value for name, value in locals().items() if name not in {"scene", "site"}}
    check_type("scene", scene, Scene)
    options = ViewOptions(**given)
    if site is None:
        site = _find_site(scene, options)
    else:
        check_type("site", site, Site)
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


def is_page(path: object) -> bool:
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
    """Return the file's site; a date's sun needs one."""
    from umbra.sun import find_site  # noqa: PLC0415

    is_known = scene.latitude is not None and scene.longitude is not None
    return find_site(scene) if is_known or options.date or options.at else None


def _is_notebook() -> bool:
    """Return whether a notebook displays a cell's result."""
    shell: Any = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return shell is not None and hasattr(shell, "kernel")


def _is_live(options: ViewOptions) -> bool:
    """Return whether a notebook can show a view as a widget that moves."""
    poses = (options.animation, options.time, options.out)
    has_own = options.list_own() or any(one is not None for one in poses)
    return not has_own and importlib.util.find_spec("anywidget") is not None
