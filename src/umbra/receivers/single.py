"""Single points as receivers, counted tile by tile."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patch_pieces import PieceCounter, PieceEdges
from umbra.cpu.patches import Patches, make_patches
from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.rays.masks import CounterByMasks
from umbra.receivers.kind import DIMS, Receivers, Request, Tile, Variables
from umbra.receivers.surface_samples import SampledPlaces, Samples
from umbra.scene.derived import derive
from umbra.scene.grid import Places
from umbra.volume.adjacency import Caster

__all__ = ["MANY_SUNS", "PointTile", "SingleReceivers", "is_kept"]

CHUNK = 65_536
"""Points per tile."""
_CHUNK_OF_SURFACES = 2_097_152  # samples: each chunk finds every sun's silhouette edges again
MANY_SUNS = 16
"""Number of suns from which patches of surfaces are faster than rays."""
_FEW_SUNS, _MANY_SAMPLES = 4, 1_000_000
"""The same for a surface study of many samples: a patch counts all of its own at once."""
_KEPT = 256_000_000  # memory for silhouettes that chunks share [byte]
_SAMPLE = 150  # of a surface, with its share of a patch [byte]
_SHARE = 0.03  # of the memory, for samples and patches that are kept for the next study
_BYTES = 300  # per point: position, normal, hours, and copies made in writing


def is_kept(samples: Samples) -> bool:
    """Return whether samples are few enough to be kept, with their patches, for the next study."""
    return samples.count * _SAMPLE <= _SHARE * find_memory()


@dataclass(frozen=True, eq=False)
class SharedEdges:
    """Edges of casters and of their pieces, sorted by light, which tiles of a study share."""

    binners: dict[Caster, EdgeBinner] = field(default_factory=dict)
    pieces: dict[tuple[Caster, tuple[tuple[int, ...], ...]], PieceEdges] = field(
        default_factory=dict
    )

    def find_binner(self, casting: Casting) -> EdgeBinner:
        """Return the edges of all casters."""
        caster = casting.caster
        if caster not in self.binners:
            self.binners[caster] = EdgeBinner(caster, _KEPT)
        return self.binners[caster]

    def find_pieces(self, casting: Casting, pieces: Sequence[Sequence[int]]) -> PieceEdges:
        """Return the edges of pieces of the casters, given as indices of parts."""
        key = casting.caster, tuple(map(tuple, pieces))
        if key not in self.pieces:
            self.pieces[key] = PieceEdges(casting.caster, casting.find_pieces(pieces), _KEPT)
        return self.pieces[key]


@dataclass(frozen=True, eq=False)
class PointTile(CounterByMasks):
    """
    Some points as receivers.

    Parameters
    ----------
    casting : Casting
    places : Places
        In the scene's local frame.
    part : (n,) int
        Part of each point; -1 for none.
    samples : Samples, optional
        Surface samples that the points come from, if any.
    shared : SharedEdges
        Edges that other tiles use, too.
    whole : Samples, optional
        The samples of all tiles, which keep their patches for the next study.
    first : int
        Index of the tile's first sample among them.
    """

    at_once: ClassVar[int] = 64

    casting: Casting
    places: Places
    part: NDArray[np.signedinteger]
    samples: Samples | None = None
    shared: SharedEdges = field(default_factory=SharedEdges)
    whole: Samples | None = None
    first: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of points."""
        return (len(self.places),)

    @property
    def tree(self) -> FaceTree:
        """Bounding volume hierarchy over the casting faces."""
        return self.casting.tree

    def make_counter(self) -> "PointTile | PatchCounter":
        """Return a counter: by shadow edges on surfaces, by rays for other points."""
        if self.samples is None:
            return self
        casting = self.casting
        binner = self.shared.find_binner(casting)
        return PatchCounter(self._patches, binner, casting.tree, casting.threads)

    @cached_property
    def _patches(self) -> Patches:
        samples, casting = cast("Samples", self.samples), self.casting
        if self.whole is None or not is_kept(self.whole):
            return make_patches(samples, casting.tree)
        tiles = -(-self.whole.count // samples.count)
        return derive(
            self.whole, "patches", (casting.caster, self.first, samples.count),
            lambda: make_patches(samples, casting.tree), most=tiles,
        )  # fmt: skip

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the points in shadow, cast or attached."""
        where = self.places
        return find_hidden(
            self.casting.tree, where.points, where.normals, suns, self.casting.threads
        )

    def find_cast(self, caster: Caster, suns: NDArray[np.float64]) -> tuple[Any, NDArray[np.uint8]]:
        """Find the shadows of one caster alone: the points in reach, and their masks."""
        return self.casting.find_cast(self.places, caster, suns)

    def count_many(self, lights: int) -> None:
        """Return nothing: the layout chose patches or rays by the number of lights."""

    def count_pieces(self, pieces: Sequence[Sequence[int]]) -> PieceCounter | None:
        """Return a counter of pieces of the casters by shadow edges, for surfaces."""
        if self.samples is None:
            return None
        casting = self.casting
        edges = self.shared.find_pieces(casting, pieces)
        return PieceCounter(self._patches, edges, casting.tree, casting.threads)

    def with_casters(self, parts: Sequence[int] | None = None) -> "PointTile":
        """Return the same receivers with other parts casting; all but canopies by default."""
        casting = self.casting.solid if parts is None else self.casting.with_casters(parts)
        return replace(self, casting=casting)

    def find_parts(self) -> NDArray[np.signedinteger]:
        """Return each point's part; -1 for none."""
        return self.part

    def find_below(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """Return none: samples are judged wherever they are."""
        return np.zeros(self.shape, np.bool_)


@dataclass(eq=False, kw_only=True)
class SingleReceivers(Receivers):
    """
    Receivers that are single points.

    Parameters
    ----------
    local : Places
        In the scene's local frame.
    part : (n,) int
        Part of each point; -1 for none.
    samples : Samples, optional
        Surface samples that the points come from, if any.
    names : sequence of str
        Names of the points, if any.
    """

    local: Places
    part: NDArray[np.signedinteger]
    samples: Samples | None = None
    names: Sequence[str] = ()

    @cached_property
    def places(self) -> Places:
        """The receivers in the model's own coordinates."""
        return Places(self.local.points + self.casting.scene.origin, self.local.normals)

    def make_tiles(self, request: Request) -> Sequence[tuple[Any, Callable[[], Tile]]]:
        """
        Cut them into chunks; surfaces are laid out in patches if there are many suns.

        Raises
        ------
        InputError
            If the results do not fit in memory.
        """
        count = len(self.local)
        needed = count * (_BYTES + request.bytes_kept + request.bytes_of_masks)
        if needed > find_memory():
            msg = (
                f"{count:,} samples need {needed / 1e9:.1f} GB and {name_memory(find_memory())}; "
                "give a larger spacing=, or choose parts with on="
            )
            raise InputError(msg, option="spacing", samples=count)
        least = _FEW_SUNS if count >= _MANY_SAMPLES else MANY_SUNS
        is_many = request.lights >= least or request.has_groups
        samples = self.samples if is_many else None
        # Attribution holds a mask of each caster.
        side = request.limit_tiles(math.isqrt(CHUNK if samples is None else _CHUNK_OF_SURFACES))
        return self._cut(8 * (side * side // 8), samples)

    def make_ray_tiles(self) -> Sequence[tuple[slice, Callable[[], PointTile]]]:
        """Return, as ``make_tiles``, tiles that count a few more instants by rays."""
        return self._cut(CHUNK, None)

    def _cut(
        self, chunk: int, samples: Samples | None
    ) -> list[tuple[slice, Callable[[], PointTile]]]:
        pieces = [slice(at, at + chunk) for at in range(0, len(self.local), chunk)]
        shared = SharedEdges()
        return [(span, partial(self._make_tile, samples, span, shared)) for span in pieces]

    def _make_tile(self, samples: Samples | None, span: slice, shared: SharedEdges) -> PointTile:
        if samples is None:
            return PointTile(self.casting, self.local.pick(span), self.part[span], shared=shared)
        piece = samples.piece(span)
        return PointTile(
            self.casting, SampledPlaces(piece), piece.part[piece.surface], piece, shared,
            self.samples, span.start,
        )  # fmt: skip

    def variables(self) -> Variables:
        """Return the position and normal of each."""
        return {
            "receiver_z": (DIMS, self.places.points[:, 2].copy()),
            "position": ((*DIMS, "xyz"), self.places.points),
            "normal": ((*DIMS, "xyz"), self.places.normals.copy()),
        }
