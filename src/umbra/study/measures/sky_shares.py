"""
The sky before a receiver: view factor, and illuminance from the CIE overcast sky.

Both are sums over directions of the sky (``--sky-directions``), each times the cosine at the
receiver's normal, as its plane sees it.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Lights, find_directions
from umbra.study.measures.measure import Asked, Measure, Quantity

__all__ = ["SkyBlockedBy", "SkyComponent", "SkyViewFactor"]


class SkyViewFactor(Measure):
    """
    Sky view factor: (1/pi) integral over the free upper sky of the cosine at the normal.

    A free level plane has 1, a free vertical plane 0.5 (Oke 1987, "Boundary Layer Climates").
    """

    name, unit, long_name = "sky_view_factor", "1", "sky view factor"
    most = 1.0
    follows_normal = has_exact = True

    def check(self, options: Any) -> None:
        """Check that there are such directions; canopies are not solved exactly."""
        find_directions(options.sky_directions)
        if options.exact and options.canopy:
            msg = "the exact sky passes no canopies; leave exact= or canopy= out"
            raise InputError(msg, option="exact")

    def describe(self, asked: Asked) -> dict[str, object]:
        """Return the directions of the sky, or that there are none."""
        directions = "exact" if asked.options.exact else str(asked.options.sky_directions)
        return {"sky_directions": directions}

    def tell(self, options: Any) -> str:
        """Say how many directions there are."""
        if options.exact:
            return "the free sky exactly, by its outlines"
        return f"{len(find_directions(options.sky_directions)[0]):,} directions of the sky"

    def make_lights(self, asked: Asked) -> Lights:
        """Return directions of the sky, each weighted by its solid angle over pi."""
        directions, angles = find_directions(asked.options.sky_directions)
        return Lights.of(directions, angles / math.pi, (self.name,), (self.unit,))

    def solve(
        self, scene: Any, parts: Sequence[int], places: Any, threads: int
    ) -> list[NDArray[np.float64]]:
        """Integrate over the outlines of the free sky."""
        from umbra.sky.casters import find_sky_casters  # noqa: PLC0415 - kernels
        from umbra.sky.view_factors import measure_sky  # noqa: PLC0415

        casters, _ = find_sky_casters(scene, parts)
        return [getattr(measure_sky(casters, places.points, places.normals, threads), self.name)]

    def derive(self, sums: NDArray, asked: Asked) -> list[NDArray]:
        """Return the sums, at most a free sky's, which sets of patches miss by 1e-4."""
        return [np.minimum(total, self.most) for total in sums]


class SkyComponent(SkyViewFactor):
    """
    Sky component: illuminance from the CIE overcast sky, of that on an open level plane.

    The luminance is proportional to 1 + 2 sin(altitude) (Moon and Spencer 1942; CIE S 011), of
    which an open level plane receives 7 pi / 3. A free vertical plane has 39.62 %; on vertical
    planes it is the vertical sky component of BRE 209.
    """

    name, unit, long_name = "sky_component", "%", "sky component, CIE overcast sky"
    most = 100.0

    def make_lights(self, asked: Asked) -> Lights:
        """Return directions of the sky, each weighted by its solid angle and luminance."""
        directions, angles = find_directions(asked.options.sky_directions)
        weights = angles * (1 + 2 * directions[:, 2]) * (100 * 3 / (7 * math.pi))
        return Lights.of(directions, weights, (self.name,), (self.unit,))


class SkyBlockedBy(SkyComponent):
    """
    The share of the open sky component that each group of casters takes (``by``, ``who``).

    The nearest caster in a direction takes it. The share is of the receiver's own open sky
    component, that of its plane without obstacles; with what is free all shares add up to 100 %.
    """

    name, long_name = "sky_blocked_by", "sky component that the caster takes, of the open plane's"
    by_caster = True
    takes = ("by", "who")

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What all casters take, and what each group does."""
        whole = "sky component that is blocked, of the open plane's"
        return (
            Quantity("sky_blocked", self.unit, whole, 100.0, "loss"),
            Quantity(self.name, self.unit, self.long_name, ramp="loss", per="caster"),
        )

    def check(self, options: Any) -> None:
        """Check that there are groups, and no canopies, which take a part of a direction."""
        super().check(options)
        if options.by is None and not options.who:
            msg = "measure sky_blocked_by needs by='part' (or kind, layer) or who='NAME'; give one"
            raise InputError(msg, option="by")
        if options.canopy:
            msg = "sky_blocked_by gives a direction to one caster, not in part to a canopy; leave "
            msg += "canopy= out"
            raise InputError(msg, option="canopy")
