"""The live model of ``umbra view --web``, of ``scene.html`` and of notebooks."""

import base64
import os
from dataclasses import replace
from io import BytesIO
from typing import TYPE_CHECKING

from PIL import Image

from umbra.calls.first_view import (
    begin_view,
    draw_view,
    find_shown_land,
    find_shown_study,
)
from umbra.calls.ground import stand_scene
from umbra.calls.picture_options import ViewOptions
from umbra.calls.study_result import ShadowStudy
from umbra.errors import InputError, show_count
from umbra.folders.atomic import replace_file
from umbra.lights import Horizon
from umbra.scene import Scene
from umbra.study import Study
from umbra.study.replaced import leave_replaced
from umbra.sun import Site
from umbra.writers.live_study import (
    clear_ground,
    describe_layers,
    find_face_surfaces,
    make_hours,
    make_palette,
)

if TYPE_CHECKING:
    from umbra.web.widget import LiveView

__all__ = ["make_config", "make_live_page", "make_widget", "write_live_page"]

_QUALITY = 82  # of the poster, which stands in where the model cannot be drawn


def make_config(scene: Scene, site: Site | None, options: ViewOptions) -> dict[str, object]:
    """
    Describe a page's model and its first view, as ``Config`` of ``umbra/web/app.js``.

    Parameters
    ----------
    scene : Scene
    site : Site or None
        Without one the sun is set by azimuth and altitude.
    options : ViewOptions
    """
    from umbra.window.view_file import to_json  # noqa: PLC0415
    from umbra.writers.folder.captions import list_files, name_model  # noqa: PLC0415

    study = find_shown_study(options)
    scene, height = _stand(scene, options)
    hours = None if study is None else make_hours(study)
    view = begin_view(options, scene, site, options.size)
    names = list_files(scene)
    proposed = list(scene.select(options.proposed, option="proposed")) if options.proposed else []
    removed = find_removed(scene, options)
    return {
        "name": (names[0].split(".")[0] or names[0]) if names else "scene",
        "title": name_model(names) if names else "Scene",
        "subtitle": _describe(scene, site),
        "view": to_json(view),
        "isFramed": options.view is None,
        "ground": _find_ground(scene, study, height),
        **describe_layers(scene),
        "proposed": proposed,
        "removed": removed,
        "notes": [*scene.notes, *_tell_shadows(scene, study, find_shown_land(options))],
        "palette": make_palette(),
        "hours": hours,
        "hasLink": True,
        "takesWheel": True,
        "poster": "",
    }


def find_removed(scene: Scene, options: ViewOptions) -> list[int]:
    """Return the parts that a proposal replaces."""
    left, _ = leave_replaced(scene, options.proposed, options.replace, options.replace_in)
    gone = {id(part) for part in left.replaced}
    return [k for k, part in enumerate(scene.parts) if id(part) in gone]


def _tell_shadows(scene: Scene, study: Study | None, land: Horizon | None) -> list[str]:
    """Describe what the page's shadows leave out: light through glass and through canopies."""
    notes = []
    glass = [part.name for part in scene.parts if part.material.opacity < 1]
    if glass:
        what = show_count(len(glass), "part is", "parts are")
        notes.append(
            f"{what} drawn transparent (first: '{glass[0]}'), and cast shadows as opaque ones do"
        )
    if land is not None:
        notes.append(
            f"the land of {land.name}, up to {land.highest:.1f}° high, hides the sun; it is not "
            "drawn, and dusk stands for it"
        )
    if study is not None and "canopy_transmissivity" in study.facts:
        notes.append(
            "the hours of the study count the light that its canopies transmit; the page's own "
            "shadows and hours at a place take canopies as opaque"
        )
    return notes


def _stand(scene: Scene, options: ViewOptions) -> tuple[Scene, float | None]:
    """Return a page's scene on its ground, the study's if there is one, and a plane's height."""
    study, canopies = options.study, []
    if isinstance(study, ShadowStudy) and options.ground is None:
        options = replace(options, ground=study.options.ground)
        canopies = scene.select(study.options.canopy) if study.options.canopy else []
    return stand_scene(options, scene, canopies)


def _find_ground(scene: Scene, study: Study | None, height: float | None) -> float | None:
    """Return the height of the plane that a page draws [m]."""
    if study is not None and study.is_plan and height is not None:
        return clear_ground(scene, float(study.ground), is_above=study.kind.lies_under_roofs)
    return None if height is None else clear_ground(scene, height, is_above=False)


def _describe(scene: Scene, site: Site | None) -> str:
    """Return a line on the place and the size of the model."""
    objects = len(set(scene.groups().tolist()))
    faces = sum(len(part.mesh.faces) for part in scene.parts)
    size = f"{show_count(objects, 'object')}, {show_count(faces, 'triangle')}"
    if site is None:
        return size
    return f"{site.show(4)} · {site.zone} · {size}"


def _draw_poster(scene: Scene, site: Site | None, options: ViewOptions) -> str:
    """Draw the first view, for browsers that cannot, as an address."""
    stream = BytesIO()
    picture = draw_view(scene, site, replace(options, out=None))
    Image.fromarray(picture.image).save(stream, "WEBP", quality=_QUALITY)
    return f"data:image/webp;base64,{base64.b64encode(stream.getvalue()).decode()}"


def make_live_page(scene: Scene, site: Site | None, options: ViewOptions) -> str:
    """Make the page of a scene; parameters as in `make_config`."""
    from umbra.scene import pose  # noqa: PLC0415
    from umbra.version import __version__  # noqa: PLC0415
    from umbra.web.pack import pack_model  # noqa: PLC0415
    from umbra.web.page import make_page  # noqa: PLC0415

    for name in options.list_own():
        msg = (
            f"{name}= is for umbra's own devices, and a page is drawn by the browser, with hard "
            "shadows; leave it out"
        )
        raise InputError(msg, option=name)
    if options.time is not None:
        scene = pose(scene, options.time, 0 if options.animation is None else options.animation)
        options = replace(options, animation=None, time=None)
    elif options.animation is not None:
        msg = "a page plays no animation; give the time of one pose, too"
        raise InputError(msg, option="animation")
    scene, _ = _stand(scene, options)
    config = make_config(scene, site, options)
    config["poster"] = _draw_poster(scene, site, options)
    surface = find_face_surfaces(find_shown_study(options), scene)
    return make_page(
        pack_model(scene, site, surface, find_shown_land(options)), config, __version__
    )


def write_live_page(
    path: str | os.PathLike[str], scene: Scene, site: Site | None, options: ViewOptions
) -> None:
    """Write the page of a scene as one file; parameters as in `make_config`."""
    page = make_live_page(scene, site, options)
    with replace_file(path) as beside:
        beside.write_text(page, "utf-8", newline="\n")


def make_widget(scene: Scene, site: Site | None, options: ViewOptions) -> "LiveView":
    """Make the page of a scene for a notebook's cell; parameters as in `make_config`."""
    scene, _ = _stand(scene, options)
    config = make_config(scene, site, options)  # finds what is wrong, before anywidget loads
    from umbra.web.pack import pack_model  # noqa: PLC0415
    from umbra.web.widget import LiveView  # noqa: PLC0415

    surface = find_face_surfaces(find_shown_study(options), scene)
    return LiveView(
        pack_model(scene, site, surface, find_shown_land(options)), config, height=options.size[1]
    )
