"""Georeferencing: CRS names, metres from degrees and feet, latitude, longitude, north."""

import re
from dataclasses import replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene import Mesh, Part, Scene
from umbra.scene.making import move_parts

if TYPE_CHECKING:
    from pyproj import CRS, Transformer

__all__ = [
    "assumes_height_unit",
    "bring_to",
    "find_axis_orders",
    "find_on_plan",
    "find_plan_unit",
    "is_in_degrees",
    "is_known_crs",
    "is_same_plan",
    "locate_bounds",
    "name_crs",
    "show_crs",
    "swap_on_plan",
    "tell_swapped",
    "to_metres",
]

CODE = re.compile(r"\bEPSG(?:/|:)+(?:[\d.]+[/:]+)?(\d+(?:\+\d+)*)", re.IGNORECASE)

SURVEY = re.compile(r"urn:adv:crs:(?:ETRS89_UTM(3[123])|DE_DHDN_3GK([2345]))", re.IGNORECASE)
"""Names that the surveys of Germany's states use: ETRS89 in UTM, or Gauss-Krueger."""

OLD_CODE = re.compile(r"epsg\.xml#(\d+)", re.IGNORECASE)
"""As older servers of features write it."""

TITLE = re.compile(r'\s*[A-Z_]+\s*\[\s*"([^"]+)"')

# Half the northward step [degrees] for the grid's meridian: 1 km.
STEP = 0.005

# Lengths that a map stretches by more than this are converted: the true penumbra is as wide.
STRETCH = 0.01

# Longitudes that are farther apart [degrees] lie on both sides of the antimeridian.
HALF_TURN = 180.0

# Farther than this outside its area of use [degrees], a CRS is taken for wrong.
MARGIN = 1.0


def name_crs(text: object) -> str | None:
    """
    Shorten the name of a CRS, be it a URL, a URN, ``EPSG:28992``, a bare number or anything else.

    ``EPSG:7415``, ``EPSG:2056+5728`` for a pair, ``OGC:CRS84``; other text unchanged; None for
    nothing.
    """
    if isinstance(text, int) and not isinstance(text, bool):
        return f"EPSG:{text}"
    if not isinstance(text, str) or not text.strip():
        return None
    codes = CODE.findall(text) or OLD_CODE.findall(text)
    if codes:
        return "EPSG:" + "+".join(codes)
    survey = SURVEY.search(text)
    if survey:
        return f"EPSG:{25800 + int(survey[1])}" if survey[1] else f"EPSG:{31464 + int(survey[2])}"
    if "CRS84" in text.upper():
        return "OGC:CRS84h" if text.upper().endswith("H") else "OGC:CRS84"
    return text.strip()


def show_crs(crs: str) -> str:
    """Return a CRS's readable name: the title of well-known text."""
    title = TITLE.match(crs)
    return title[1] if title else crs


def is_known_crs(crs: str) -> bool:
    """Return whether PROJ knows this CRS, and it is projected or geographic."""
    system = _find_crs(crs)
    return system is not None and (system.is_projected or system.is_geographic)


def is_in_degrees(crs: str) -> bool:
    """Return whether a CRS is known and geographic, so that its plan is in degrees."""
    system = _find_crs(crs)
    return system is not None and system.is_geographic


def is_same_plan(crs: str, other: str) -> bool:
    """Return whether two CRSs are equal but for heights."""
    a, b = _find_crs(crs), _find_crs(other)
    return crs == other or (a is not None and b is not None and a.to_2d() == b.to_2d())


def bring_to(
    parts: tuple[Part, ...], crs: str, target: str, *, is_high_in_metres: bool
) -> tuple[Part, ...]:
    """Move parts from one known CRS to another in metres; heights are kept, but for their unit."""
    system, wanted = _find_crs(crs), _find_crs(target)
    shown, goal = show_crs(crs), show_crs(target)
    if not is_known_crs(crs) or not is_known_crs(target) or system is None or wanted is None:
        msg = f"{shown} cannot be converted to {goal}; convert to one coordinate reference system"
        raise InputError(msg, crs=(crs, target))
    height = 1.0 if is_high_in_metres else _metres_per_unit(system)[1]
    return _move_plan(parts, system, target, height)


def find_plan_unit(crs: str) -> float:
    """Return the length [m] of a projected CRS's horizontal unit; 1 for any other CRS."""
    system = _find_crs(crs)
    return _metres_per_unit(system)[0] if system is not None and system.is_projected else 1.0


def to_metres(
    parts: tuple[Part, ...], crs: str | None, *, is_high_in_metres: bool
) -> tuple[tuple[Part, ...], str | None]:
    """
    Turn degrees, feet and stretched metres, as of web maps, into metres of the local UTM zone.

    A CRS that is not known leaves the coordinates as they are.
    """
    system = _find_crs(crs)
    if system is None or crs is None:
        return parts, crs
    shown = show_crs(crs)
    if system.is_geocentric:
        msg = f"coordinates are geocentric ({shown}); convert them to a projected CRS in metres"
        raise InputError(msg, crs=crs)
    if not (system.is_projected or system.is_geographic):
        return parts, crs
    flat, height = _metres_per_unit(system)
    if is_high_in_metres:
        height = 1.0
    if system.is_projected and flat == 1.0 and height == 1.0 and not _is_stretched(parts, system):
        return parts, crs
    if system.is_geographic and any(part.transform is not None for part in parts):
        msg = f"geometry templates in degrees ({shown}) are not read; convert to a CRS in metres"
        raise InputError(msg, crs=crs)
    return _reproject(parts, crs, system, height)


def tell_swapped(parts: tuple[Part, ...], crs: str) -> list[str]:
    """Tell of a file in degrees at sea whose axes, if they were swapped, lie on land."""
    system = _find_crs(crs)
    part = next((part for part in parts if len(part.mesh.faces)), None)
    if system is None or not system.is_geographic or part is None:
        return []
    from umbra.sun.zones import find_local_zone  # noqa: PLC0415 - 0.1 s, only for degrees

    lon, lat = part.mesh.vertices[part.mesh.faces[0, 0], :2].tolist()
    if max(abs(lat), abs(lon)) > HALF_TURN / 2:
        return []
    zones = [find_local_zone(*point) for point in ((lat, lon), (lon, lat))]
    if not zones[0].startswith("Etc/") or zones[1].startswith("Etc/"):
        return []
    note = (
        f"the coordinates lie at sea (latitude {lat:.4g}, longitude {lon:.4g}); if latitude and "
        f"longitude are swapped in the file, it lies in {zones[1].replace('_', ' ')}: swap them"
    )
    return [note]


def _is_stretched(parts: tuple[Part, ...], crs: "CRS") -> bool:
    """Return whether a projected CRS stretches or shrinks lengths at the first vertex."""
    from pyproj import Proj  # noqa: PLC0415 - 0.1 s, only with a CRS
    from pyproj.exceptions import ProjError  # noqa: PLC0415

    part = next((part for part in parts if len(part.mesh.faces)), None)
    if part is None:
        return False
    corner = part.mesh.vertices[part.mesh.faces[0, 0]]
    x, y = (corner if part.transform is None else part.transform @ [*corner, 1])[:2]
    try:
        there = Proj(crs.to_2d())
        factors = there.get_factors(*there(x, y, inverse=True))
    except ProjError:
        return False
    scales = np.array([factors.meridional_scale, factors.parallel_scale])
    return bool((np.abs(scales - 1) > STRETCH).any() and np.isfinite(scales).all())


def locate_bounds(scene: Scene, bounds: NDArray[np.float64]) -> Scene:
    """
    Find latitude, longitude (WGS 84) and true north from the CRS and the middle of bounds (2, 3).

    A note reports an unknown CRS, or a place outside its area of use.
    """
    if scene.crs is None:
        return scene
    system, shown = _find_crs(scene.crs), show_crs(scene.crs)
    remedy = "give latitude= and longitude= (and true_north= if the plan is turned)"
    if system is None or not (system.is_projected or system.is_geographic):
        note = f"the CRS '{shown}' is not known, so coordinates are taken as metres; {remedy}"
        return scene.with_facts(notes=(*scene.notes, note))
    there, back = _find_ways(system.to_2d())
    x, y, _ = bounds.mean(0)
    lon, lat = there.transform(x, y)
    if not _is_in_use(system, lon, lat):
        doubt = f"the coordinates lie outside the area where {shown} ({system.name}) is used"
        note = f"{doubt}, so the site is not known; {remedy}"
        return scene.with_facts(site_doubt=doubt, notes=(*scene.notes, note))
    xs, ys = back.transform([lon, lon], [lat - STEP, lat + STEP])
    north = float(np.degrees(np.arctan2(xs[1] - xs[0], ys[1] - ys[0])))
    return scene.with_facts(latitude=float(lat), longitude=float(lon), true_north=north)


@lru_cache(16)
def _find_ways(crs: "CRS") -> tuple["Transformer", "Transformer"]:
    """Return the ways from a CRS to WGS 84, as maps have it, and back: 17 ms each."""
    from pyproj import Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    there = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    return there, Transformer.from_crs("EPSG:4326", crs, always_xy=True)


def _is_in_use(crs: "CRS", lon: float, lat: float) -> bool:
    """Return whether a CRS is used at a place [degrees], or at most ``MARGIN`` away."""
    area = crs.area_of_use or crs.to_2d().area_of_use
    if not np.isfinite([lon, lat]).all() or abs(lat) > 90:
        return False
    if area is None:
        return True
    width = (area.east - area.west) % 360 or 360
    return bool(
        (lon - area.west + MARGIN) % 360 <= width + 2 * MARGIN
        and area.south - MARGIN <= lat <= area.north + MARGIN
    )


def find_on_plan(crs: str, latitude: float, longitude: float) -> NDArray[np.float64] | None:
    """Return x and y (2,) [m] of a place [degrees] in a projected CRS; None without one."""
    system = _find_crs(crs)
    if system is None or not system.is_projected:
        return None
    from pyproj import Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    there = Transformer.from_crs("EPSG:4326", system.to_2d(), always_xy=True)
    point = np.array(there.transform(longitude, latitude))
    return point if np.isfinite(point).all() else None


def swap_on_plan(crs: str, point: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return where a place (2,) of a projected CRS lies if latitude and longitude are swapped."""
    system = _find_crs(crs)
    if system is None or not system.is_projected:
        return None
    from pyproj import Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    there = Transformer.from_crs(system.to_2d(), "EPSG:4326", always_xy=True)
    longitude, latitude = there.transform(*point)
    return find_on_plan(crs, longitude, latitude) if abs(longitude) <= 90 else None


def find_axis_orders(crs: str, point: NDArray[np.float64]) -> tuple[bool, tuple[bool, ...]]:
    """
    Find whether the first coordinate of a file in this CRS points north.

    Parameters
    ----------
    crs : str
    point : (2,) or longer float64
        Of the file, in its order.

    Returns
    -------
    says : bool
        Whether the CRS says so.
    orders : tuple of bool
        False for east first, true for north first: the order in which the place lies in the area
        in which the CRS is used, since many programs write east first whatever the CRS. Of a
        projected CRS both, as it says first, if the place lies there either way or neither way.
    """
    system = _find_crs(crs)
    if system is None or not (system.is_projected or system.is_geographic):
        return False, (False,)
    from pyproj import Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    flat = system.to_2d()
    says = flat.axis_info[0].direction == "north"
    there = Transformer.from_crs(flat, flat.geodetic_crs, always_xy=True)
    first, second = float(point[0]), float(point[1])
    fits = tuple(
        swap
        for swap in (says, not says)
        if _is_in_use(system, *there.transform(*((second, first) if swap else (first, second))))
    )
    if len(fits) == 1:
        return says, fits
    return says, (says, not says) if system.is_projected else (says,)


@cache
def _find_crs(crs: str | None) -> "CRS | None":
    """Find a CRS that PROJ knows and can convert; well-known text may name any projection."""
    if crs is None:
        return None
    from pyproj import CRS, Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS
    from pyproj.exceptions import ProjError  # noqa: PLC0415

    try:
        system = CRS.from_user_input(crs)
        if system.is_projected:
            flat = system.to_2d()
            Transformer.from_crs(flat, flat.geodetic_crs)
    except ProjError:
        return None
    return system


def assumes_height_unit(crs: str) -> bool:
    """Return whether a CRS in feet does not state the unit of heights; then feet are assumed."""
    system = _find_crs(crs)
    if system is None or not system.is_projected:
        return False
    axes = system.axis_info
    return axes[0].unit_conversion_factor != 1.0 and all(axis.direction != "up" for axis in axes)


def _metres_per_unit(crs: "CRS") -> tuple[float, float]:
    """Return metres per plan unit and per height unit."""
    axes = crs.axis_info
    up = [axis.unit_conversion_factor for axis in axes if axis.direction == "up"]
    plan = axes[0].unit_conversion_factor
    if up:
        return plan, up[0]
    # Without a vertical axis, heights take the plan's unit unless it is degrees.
    return plan, 1.0 if crs.is_geographic else plan


def _reproject(
    parts: tuple[Part, ...], crs: str, system: "CRS", height: float
) -> tuple[tuple[Part, ...], str]:
    from pyproj import Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    flat = system.to_2d()
    # All at once: parts may share one array of vertices.
    soup = Scene(parts, np.zeros(3)).triangles()
    used = soup.vertices[soup.faces.ravel(), :2]
    used = used[np.isfinite(used).all(1)]
    if not len(used):
        return parts, crs  # make_scene reports vertices that are not finite
    if system.is_geographic and np.ptp(used[:, 0]) > HALF_TURN:
        used[:, 0] %= 2 * HALF_TURN  # on both sides of the antimeridian
    middle = (used.min(0) + used.max(0)) / 2
    lon, lat = Transformer.from_crs(flat, flat.geodetic_crs, always_xy=True).transform(*middle)
    if not (np.isfinite([lon, lat]).all() and abs(lat) <= 84):
        shown = show_crs(crs)
        msg = (
            f"the coordinates about x {middle[0]:g}, y {middle[1]:g} do not fit their CRS {shown} "
            f"({system.name}); correct the CRS or convert to metres"
        )
        raise InputError(msg, crs=crs)
    zone = _find_utm(system, lon, lat)
    return _move_plan(parts, system, zone, height), zone


def _move_plan(
    parts: tuple[Part, ...], system: "CRS", target: str, height: float
) -> tuple[Part, ...]:
    from pyproj import CRS, Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    flat = CRS.from_user_input(target).to_2d()
    transformer = Transformer.from_crs(system.to_2d(), flat, always_xy=True)

    def move(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y, z = vertices.T
        east, north = transformer.transform(x, y)
        return np.stack([east, north, z * height], axis=1)

    def place(part: Part) -> Part:
        """Return an instance as a separate mesh, with each vertex converted."""
        mesh, used = part.mesh, part.mesh.faces.ravel()
        corners = Scene((part,), np.zeros(3)).triangles().vertices[used]
        faces = np.arange(len(used), dtype=np.int32)
        uv, uv2 = (None if rows is None else rows[used] for rows in (mesh.uv, mesh.uv2))
        mesh = Mesh(move(corners), faces, uv=uv, uv2=uv2)
        return replace(part, mesh=mesh, transform=None, binding=None)

    return move_parts(parts, move, place)


def _find_utm(crs: "CRS", lon: float, lat: float) -> str:
    """Find the UTM zone at a place, on the same datum if possible."""
    from pyproj.database import query_utm_crs_info  # noqa: PLC0415

    zone = int((lon + 180) % 360 // 6) + 1
    datum = crs.geodetic_crs.name if crs.geodetic_crs is not None else "WGS 84"
    name = f"{datum} / UTM zone {zone}{'N' if lat >= 0 else 'S'}"
    # By full name: some datums have zones with northing first or a prefixed easting.
    codes = [info.code for info in query_utm_crs_info(datum_name=datum) if info.name == name]
    return f"EPSG:{codes[0] if codes else (32600 if lat >= 0 else 32700) + zone}"
