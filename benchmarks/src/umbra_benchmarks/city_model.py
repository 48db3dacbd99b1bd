"""
A made-up city of any area: buildings, towers, trees and terrain, always the same.

The city is cut into tiles of 1 km and laid out in street blocks, which lie askew to the
tiles. Each object belongs to the tile of its centre, so that none lies in two files. All
numbers come from a hash of the seed and of the block's place: every tile can be made alone.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra_benchmarks.city_shapes import SHAPES, Objects

__all__ = ["KM", "MIDDLE", "City", "CitySquare"]

KM = 1000.0
"""Side of a tile [m]."""
MIDDLE = (691, 5335)
"""South-western corner of the middle tile, EPSG:25832 [km]."""
_BLOCK = np.array([110.0, 84.0])  # sides of a street block with its streets [m]
_TURN = math.radians(17.0)  # of the blocks against the tiles
_AXES = np.array([[math.cos(_TURN), math.sin(_TURN)], [-math.sin(_TURN), math.cos(_TURN)]])
_STEP = 25.0  # of the terrain's lattice [m]
_WAVES = ((9000.0, 35.0), (4100.0, 14.0), (1700.0, 5.0), (430.0, 0.8))  # length, height [m]
_USES = ("courtyard", "rows", "villas", "halls", "slabs", "tower")
_BUILDINGS = np.array([3, 16, 6, 2, 3, 1])  # in a block of each use
_CENTRAL = np.array([0.50, 0.08, 0.02, 0.03, 0.15, 0.03])  # share of uses in the middle,
_OUTER = np.array([0.02, 0.18, 0.45, 0.10, 0.06, 0.001])  # and at the edge
_MOST_BUILT = 0.97  # share of built blocks; the others are parks
_STREET_TREES, _PARK_TREES = 8, 36  # most of a block


@dataclass(frozen=True, eq=False)
class CitySquare:
    """
    The objects of a square kilometre.

    Parameters
    ----------
    corner : (int, int)
        South-western corner [km].
    buildings : list of Objects
    trees : Objects
        Crowns: closed meshes.
    terrain : (n + 1, n + 1, 3) float64
        Lattice of the ground, rows northward; neighbours share their borders.
    """

    corner: tuple[int, int]
    buildings: list[Objects]
    trees: Objects
    terrain: NDArray[np.float64]

    @property
    def building_count(self) -> int:
        """Number of buildings."""
        return sum(len(some.names) for some in self.buildings)


@dataclass(frozen=True)
class City:
    """
    A made-up city.

    Parameters
    ----------
    area : int
        Number of tiles of 1 km², those nearest to the middle [km2].
    seed : int
    buildings : float
        Mean number on a square kilometre; 580 make 180,000 on 310 km².
    trees : float
        Share of the places for trees that have one.
    """

    area: int = 310
    seed: int = 1
    buildings: float = 580.0
    trees: float = 0.5

    def __post_init__(self) -> None:
        if self.area < 1:
            msg = f"a city has an area of 1 km² at least; got {self.area}"
            raise InputError(msg, option="area")
        if not 0 <= self.trees <= 1:
            msg = f"the share of places with a tree is 0 to 1; got {self.trees:g}"
            raise InputError(msg, option="trees")
        most = _MOST_BUILT * _find_mean(math.inf)
        if not 0 < self.buildings <= most:
            msg = f"a square kilometre has room for 1 to {most:.0f} buildings; got {self.buildings}"
            raise InputError(msg, option="buildings")

    @cached_property
    def corners(self) -> list[tuple[int, int]]:
        """South-western corners of the tiles, from the middle outward [km]."""
        reach = math.ceil(math.sqrt(self.area / math.pi)) + 2
        around = range(-reach, reach + 1)
        found = sorted((i * i + j * j, i, j) for i in around for j in around)
        return [(MIDDLE[0] + i, MIDDLE[1] + j) for _, i, j in found[: self.area]]

    @property
    def radius(self) -> float:
        """Radius of a disc of the city's area [m]."""
        return KM * math.sqrt(self.area / math.pi)

    def tiles(self) -> Iterator[CitySquare]:
        """Make the tiles one after the other, from the middle outward."""
        for corner in self.corners:
            yield self.make_tile(corner)

    def make_tile(self, corner: tuple[int, int]) -> CitySquare:
        """
        Make one tile.

        Parameters
        ----------
        corner : (int, int)
            South-western corner [km].
        """
        blocks = _Blocks.of(self, corner)
        buildings = [some for some in _build(blocks) if some.names]
        side = np.arange(0.0, KM + _STEP, _STEP)
        x, y = np.meshgrid(KM * corner[0] + side, KM * corner[1] + side)
        terrain = np.stack([x, y, self.find_ground(x, y)], -1)
        return CitySquare(corner, buildings, _plant(blocks), terrain)

    def find_ground(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Return the height of the hills at some places [m]."""
        east = np.asarray(x, np.float64) - KM * MIDDLE[0]
        north = np.asarray(y, np.float64) - KM * MIDDLE[1]
        height = np.full(np.broadcast_shapes(east.shape, north.shape), 520.0)
        for k, (length, rise) in enumerate(_WAVES):
            way, one, two = 2 * np.pi * _draw(self.seed, k, 0, np.arange(3))
            along = east * np.cos(way) + north * np.sin(way)
            across = north * np.cos(way) - east * np.sin(way)
            wave = 2 * np.pi / length
            height += rise * np.sin(along * wave + one) * np.cos(0.7 * across * wave + two)
        return height

    @cached_property
    def built(self) -> float:
        """Buildings that a block may have on average before parks run out."""
        wanted = self.buildings
        low, high = 0.0, 20.0 * _BUILDINGS.max()
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if _find_mean(middle) < wanted else (low, middle)
        return low


def _find_mean(built: float) -> float:
    """Return the mean number of buildings on a square kilometre."""
    out = np.sqrt((np.arange(200) + 0.5) / 200)
    uses = _mix(out)
    return float((_find_built(uses, built) * (uses @ _BUILDINGS)).mean() * 1e6 / _BLOCK.prod())


def _mix(out: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shares of uses at some distances from the middle, in radii, (n, uses)."""
    out = np.minimum(out, 1.0)[:, None]
    uses = (1 - out) * _CENTRAL + out * _OUTER
    return uses / uses.sum(1, keepdims=True)


def _find_built(uses: NDArray[np.float64], built: float) -> NDArray[np.float64]:
    """Return the shares of blocks that are built on."""
    return np.minimum(built / (uses @ _BUILDINGS), _MOST_BUILT)


def _draw(seed: int, i: ArrayLike, j: ArrayLike, k: ArrayLike) -> NDArray[np.float64]:
    """Return numbers in [0, 1) that depend on nothing but four integers (SplitMix64)."""
    found = np.array(seed % 2**64, np.uint64)
    with np.errstate(over="ignore"):
        for number in (i, j, k):
            found = found ^ np.asarray(number, np.int64).view(np.uint64)
            found = np.asarray(found + np.uint64(0x9E3779B97F4A7C15))
            found = (found ^ (found >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            found = (found ^ (found >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            found ^= found >> np.uint64(31)
    drawn: NDArray[np.float64] = (found >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return drawn


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Street blocks that may hold objects of a tile."""

    city: City
    corner: tuple[int, int]
    place: NDArray[np.int64]  # (n, 2), in the blocks' own lattice
    centre: NDArray[np.float64]  # (n, 2) [m]
    use: NDArray[np.int64]  # (n,), of _USES; one more is a park

    @classmethod
    def of(cls, city: City, corner: tuple[int, int]) -> "_Blocks":
        """Find the blocks near a tile, and what each is used for."""
        middle = KM * np.add(MIDDLE, 0.5)
        half, reach = KM / 2, float(np.hypot(*_BLOCK))
        own = (KM * np.add(corner, 0.5) - middle) @ _AXES.T
        most = (math.sqrt(2) * half + reach) / _BLOCK
        i, j = (
            np.arange(math.floor(at - wide), math.ceil(at + wide))
            for at, wide in zip(own / _BLOCK, most, strict=True)
        )
        place = np.stack(np.meshgrid(i, j, indexing="ij"), -1).reshape(-1, 2).astype(np.int64)
        centre = (place + 0.5) * _BLOCK @ _AXES + middle
        is_near = (np.abs(centre - KM * np.add(corner, 0.5)) < half + reach).all(1)
        place, centre = place[is_near], centre[is_near]
        uses = _mix(np.hypot(*(centre - middle).T) / city.radius)
        uses *= _find_built(uses, city.built)[:, None]
        drawn = _draw(city.seed, place[:, 0], place[:, 1], 0)
        return cls(city, corner, place, centre, (drawn[:, None] >= uses.cumsum(1)).sum(1))

    def choose(self, use: str) -> "_Blocks":
        """Return the blocks of one use, or parks."""
        number = _USES.index(use) if use in _USES else len(_USES)
        which = self.use == number
        return _Blocks(
            self.city, self.corner, self.place[which], self.centre[which], self.use[which]
        )

    def draw(
        self, channel: int, count: int, low: float = 0.0, high: float = 1.0
    ) -> NDArray[np.float64]:
        """Return a number in a range for each of the objects of each block, (n, count)."""
        k = 1 + 64 * channel + np.arange(count)
        drawn = _draw(self.city.seed, self.place[:, :1], self.place[:, 1:], k)
        return low + (high - low) * drawn

    def locate(self, u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Return places given along the blocks' sides from their centres, (n, count, 2)."""
        own = np.stack(np.broadcast_arrays(u, v), -1) @ _AXES
        return self.centre[:, None] + own

    def is_in_tile(self, places: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which places lie in the tile; borders belong to the tile north or east."""
        return (np.floor(places / KM) == self.corner).all(-1)

    def name(self, letter: str, which: NDArray[np.bool_]) -> list[str]:
        """Name the chosen of each block's objects, (n, count) bool."""
        block, k = np.nonzero(which)
        places = (self.place[block] + 10_000).tolist()
        return [
            f"{letter}{i:05d}{j:05d}{n:02d}" for (i, j), n in zip(places, k.tolist(), strict=True)
        ]


def _build(blocks: _Blocks) -> Iterator[Objects]:
    """Make the buildings of a tile."""
    some = blocks.choose("courtyard")
    yield _raise_courtyards(some)
    half = some.draw(11, 2, 6, 9), some.draw(12, 2, 5, 7)
    yield _raise(some, "flat", 10, [-14.0, 14.0], [4.0, -5.0], *half, some.draw(13, 2, 4, 12), "r")
    some = blocks.choose("rows")
    units = 11.75 * (np.arange(16) % 8 - 3.5)
    eaves = np.repeat(some.draw(20, 2, 6, 9), 8, 1) + some.draw(21, 16, 0.0, 0.6)
    side = np.repeat([-22.0, 22.0], 8)
    yield _raise(some, "gabled", 22, units, side, 5.875, 5.0, eaves, "h")
    some = blocks.choose("villas")
    u, v = np.tile([-31.0, 0.0, 31.0], 2), np.repeat([-17.0, 17.0], 3)
    half = some.draw(30, 6, 5, 8), some.draw(31, 6, 4.5, 7)
    eaves, is_hipped = some.draw(32, 6, 4, 8), some.draw(33, 6) < 0.4  # noqa: PLR2004
    turn = some.draw(34, 6, -0.15, 0.15)
    for shape, which in (("gabled", ~is_hipped), ("hipped", is_hipped)):
        yield _raise(some, shape, 35, u, v, *half, eaves, "v", turn=turn, which=which)
    some = blocks.choose("halls")
    half = some.draw(40, 2, 14, 21), some.draw(41, 2, 18, 30)
    yield _raise(some, "flat", 42, [-23.0, 23.0], 0.0, *half, some.draw(43, 2, 6, 14), "i")
    some = blocks.choose("slabs")
    high, long = some.draw(50, 3, 18, 45), some.draw(52, 3, 20, 32)
    yield _raise(some, "flat", 51, [-32.0, 0.0, 32.0], 0.0, 6.0, long, high, "s")
    yield _raise_towers(blocks.choose("tower"))


def _raise(
    blocks: _Blocks,
    shape: str,
    channel: int,
    u: ArrayLike,
    v: ArrayLike,
    long: ArrayLike,
    wide: ArrayLike,
    eaves: NDArray[np.float64],
    letter: str,
    *,
    turn: ArrayLike = 0.0,
    which: ArrayLike = True,
) -> Objects:
    """Make rectangular buildings with roofs; half lengths, heights above the ground [m]."""
    count = eaves.shape
    centre = np.broadcast_to(blocks.locate(u, v), (*count, 2))
    which = np.broadcast_to(which, count) & blocks.is_in_tile(centre)
    half = np.stack([np.broadcast_to(one, count)[which] for one in (long, wide)], -1)
    angle = _TURN + np.broadcast_to(turn, count)[which]
    corners = _find_corners(centre[which], half, angle)
    base = blocks.city.find_ground(corners[..., 0], corners[..., 1]).min(1, keepdims=True)
    top = base + eaves[which][:, None]
    levels = [_lift(corners, base), _lift(corners, top)]
    if shape != "flat":
        rise = (half.min(1) * blocks.draw(channel, count[1], 0.5, 1.0)[which])[:, None]
        inset = half.min(1) / half[:, 0] if shape == "hipped" else np.zeros(len(half))
        along = half[:, 0] * (1 - np.minimum(inset, 0.9))
        way = along[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
        ridge = np.stack([centre[which] - way, centre[which] + way], 1)
        levels.append(_lift(ridge, top + rise))
    return Objects(SHAPES[shape], blocks.name(letter, which), np.concatenate(levels, 1))


def _raise_courtyards(blocks: _Blocks) -> Objects:
    """Make houses around a courtyard."""
    centre = blocks.locate([0.0], [0.0])
    which = blocks.is_in_tile(centre)
    middle = centre[which]
    outer = np.stack([blocks.draw(1, 1, 43, 47)[which], blocks.draw(2, 1, 31, 34)[which]], -1)
    inner = outer - blocks.draw(3, 1, 11, 14)[which][:, None]
    rings = [_find_corners(middle, half, np.full(len(half), _TURN)) for half in (outer, inner)]
    base = blocks.city.find_ground(rings[0][..., 0], rings[0][..., 1]).min(1, keepdims=True)
    top = base + blocks.draw(4, 1, 14, 24)[which][:, None]
    levels = [_lift(ring, level) for ring in rings for level in (base, top)]
    return Objects(SHAPES["courtyard"], blocks.name("c", which), np.concatenate(levels, 1))


def _raise_towers(blocks: _Blocks) -> Objects:
    """Make towers on podiums, two parts of one building."""
    centre = blocks.locate([0.0], [0.0])
    which = blocks.is_in_tile(centre)
    middle = centre[which]
    angle = np.full(len(middle), _TURN)
    podium = _find_corners(middle, np.broadcast_to([24.0, 20.0], middle.shape), angle)
    half = np.stack([blocks.draw(k, 1, 9, 14)[which] for k in (60, 61)], -1)
    shaft = _find_corners(middle, half, angle)
    base = blocks.city.find_ground(podium[..., 0], podium[..., 1]).min(1, keepdims=True)
    step = base + blocks.draw(62, 1, 8, 14)[which][:, None]
    # Few are very tall.
    top = base + 60 + 190 * blocks.draw(63, 1)[which][:, None] ** 3
    levels = [(podium, base), (podium, step), (shaft, step), (shaft, top)]
    vertices = np.concatenate([_lift(*level) for level in levels], 1)
    return Objects(SHAPES["tower"], blocks.name("t", which), vertices)


def _plant(blocks: _Blocks) -> Objects:
    """Plant trees along streets and in parks."""
    street = (np.arange(_STREET_TREES) - 3.5) * 11.5
    along = blocks.locate(street + blocks.draw(70, _STREET_TREES, -2, 2), -39.0)
    parks = blocks.choose("park")
    u, v = parks.draw(72, _PARK_TREES, -50, 50), parks.draw(73, _PARK_TREES, -36, 36)
    names: list[str] = []
    crowns = []
    for letter, some, places in (("a", blocks, along), ("p", parks, parks.locate(u, v))):
        count = places.shape[1]
        which = some.is_in_tile(places) & (some.draw(74, count) < blocks.city.trees)
        names += some.name(letter, which)
        wide, tall = some.draw(75, count, 2, 3.5)[which], some.draw(76, count, 4, 12)[which]
        crowns.append(_make_crowns(blocks.city, places[which], wide, tall))
    return Objects(SHAPES["crown"], names, np.concatenate(crowns))


def _make_crowns(
    city: City, places: NDArray[np.float64], wide: NDArray[np.float64], tall: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Make crowns, (n, 8, 3), which begin 2.5 m above the ground."""
    angle = np.pi / 3 * np.arange(6)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1) * wide[:, None, None] + places[:, None]
    middle = places[:, None]
    low = city.find_ground(*places.T)[:, None] + 2.5
    levels = [(middle, low), (ring, low + 0.45 * tall[:, None]), (middle, low + tall[:, None])]
    return np.concatenate([_lift(*level) for level in levels], 1)


def _find_corners(
    centre: NDArray[np.float64], half: NDArray[np.float64], angle: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the corners of rectangles, counter-clockwise, (n, 4, 2)."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = (half[:, None] * [[-1, -1], [1, -1], [1, 1], [-1, 1]]).transpose(2, 0, 1)
    return centre[:, None] + np.stack([x * cos - y * sin, x * sin + y * cos], -1)


def _lift(plan: NDArray[np.float64], level: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put corners (n, k, 2) at a height, (n, 1), (n, k, 3)."""
    return np.concatenate([plan, np.broadcast_to(level, plan.shape[:2])[..., None]], -1)
