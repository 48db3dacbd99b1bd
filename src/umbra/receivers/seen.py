"""
Pixels of a view as receivers.

A view from infinity that looks level or down starts outside every shadow while the sun is
up, as shadows run downward; so z-pass counts are right. From an eye at finite distance
counting starts at the eye's own count.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.cpu.patch_pieces import PieceCounter, PieceEdges
from umbra.cpu.patches import Patches
from umbra.devices import DEFAULT, DEVICES
from umbra.ground.level import EARTH, TERRAIN
from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.rays.masks import CounterByMasks
from umbra.receivers.gridded import Raster
from umbra.receivers.kind import Request, Tile, Variables
from umbra.receivers.samples import find_sources
from umbra.receivers.single import MANY_SUNS
from umbra.receivers.surface_samples import Samples
from umbra.receivers.view_pixels import PixelCounter, make_pixel_patches, snap_to_faces
from umbra.scene import Camera, directional_light
from umbra.scene.grid import Grid, Places
from umbra.scene.mesh import ADDED_GROUND
from umbra.soft.frames import FrameCounts
from umbra.volume.adjacency import Caster

__all__ = ["SeenRaster", "ViewModel", "ViewTile"]

_MANY = 128  # lights of a view from which patches pay
_LEVEL = 1e-9  # largest z of a level unit vector
_FAR = 1e9  # height of empty pixels' points, above every shadow [m]


@dataclass(frozen=True, eq=False)
class ViewModel(Casting):
    """
    Casters, and receivers seen by a camera.

    Parameters
    ----------
    scene, soup, caster, threads
        As in ``Casting``.
    casters : list of int
        Parts that cast.
    make_camera : callable
        Returns the camera of a grid of the view.
    ground : float, optional
        z of a visible ground, in the model's own coordinates [m].
    shown : list of int, optional
        Visible parts, as if no others hid them; all by default.
    lights : int
        Number of lights of the study.
    proposed : sequence of int
        Parts of the proposed development, which record nothing: the ground below them does.
    asked : list of int, optional
        Visible parts that receive; all, and the ground, by default.
    samples : Samples, optional
        Samples whose picture the view is: it shows their surfaces alone, on the side that is
        sampled, and the ground. Its shadows are counted by patches, as those of the samples are,
        which takes a fraction of the time of a frame for each sun.
    """

    casters: list[int]
    make_camera: Callable[[Grid], Camera]
    ground: float | None = None
    shown: list[int] | None = None
    lights: int = 0
    proposed: Sequence[int] = ()
    asked: list[int] | None = None
    samples: Samples | None = None

    def with_casters(self, parts: Sequence[int]) -> "ViewModel":
        """Return the same receivers with other parts casting, visible or not."""
        shown = range(len(self.scene.parts)) if self.shown is None else self.shown
        return replace(super().with_casters(parts), shown=list(shown))

    @cached_property
    def counter(self) -> FrameCounts:
        """Counter of frames of the scene, or of the shown parts alone; all are opaque."""
        scene = self.scene
        if self.shown is not None:
            scene = replace(scene, parts=tuple(scene.parts[k] for k in self.shown))
        frames = DEVICES[DEFAULT].open_frames(
            scene, self.ground, casters=self.casters if self.shown is None else None,
            threads=self.threads, transmits=False,
        )  # fmt: skip
        return frames.__enter__()  # the CPU holds nothing that must be freed

    def make_tile(self, grid: Grid) -> "ViewTile":
        """Make the receivers of a grid."""
        camera = self.make_camera(grid)
        return ViewTile(self, camera, *self.look(camera))

    def look(self, camera: Camera) -> tuple[DepthBuffer, VisibleSurface]:
        """Find the visible surface of the shown parts, with indices of the scene's parts."""
        view, frame = self.counter.see(camera)
        if self.shown is not None:
            part = frame.part.copy()
            part[part >= 0] = np.array(self.shown)[part[part >= 0]]
            frame = replace(frame, part=part)
        return view, frame


@dataclass(frozen=True, eq=False)
class ViewTile(CounterByMasks):
    """
    Pixels of a view as receivers; row 0 is the lowest.

    Parameters
    ----------
    model : ViewModel
    camera : Camera
    view : DepthBuffer
    frame : VisibleSurface
    """

    model: ViewModel
    camera: Camera
    view: DepthBuffer
    frame: VisibleSurface

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        return self.view.face.shape

    @property
    def is_seen(self) -> NDArray[np.bool_]:
        """Pixels with a visible surface, (rows, cols) bool."""
        return self.frame.part[::-1] != NOTHING

    @property
    def casting(self) -> ViewModel:
        """The casters of its scene."""
        return self.model

    @property
    def tree(self) -> FaceTree:
        """Bounding volume hierarchy over the casting faces."""
        return self.model.tree

    @property
    def nothing(self) -> NDArray[np.bool_]:
        """Pixels without a visible surface that receives, (rows, cols) bool."""
        nothing = ~self.is_asked | self.is_earth
        return nothing if self.model.samples is None else nothing | self.is_back

    @cached_property
    def is_earth(self) -> NDArray[np.bool_]:
        """
        Pixels of a level view that show the inside of the earth, (rows, cols) bool.

        The underside of a terrain, and what is below a terrain, such as cellars: an elevation cuts
        the earth at the model's border, and sees there what no sun can reach.
        """
        model, part = self.model, self.frame.part[::-1]
        parts = model.scene.parts
        land = [k for k, one in enumerate(parts) if one.kind in TERRAIN]
        is_level = abs(self.camera.axes()[2][2]) < _LEVEL
        if not land or not is_level or self.camera.is_perspective or model.samples is not None:
            return np.zeros(self.shape, np.bool_)
        is_land = np.isin(part, land)
        earth: NDArray[np.bool_] = is_land & (self.frame.normal[::-1, :, 2] < -_LEVEL)
        covers = [k for k in land if parts[k].kind in EARTH]
        below = np.flatnonzero(self.is_seen & ~is_land)
        if covers and len(below):
            points = self.places.points[below]
            up = np.broadcast_to([0.0, 0.0, 1.0], points.shape).copy()
            tree = model.with_casters(covers).tree
            found = find_hidden(tree, points, up, up[:1], model.threads)
            earth.flat[below[found[0].view(np.bool_)]] = True
        return earth

    @property
    def is_asked(self) -> NDArray[np.bool_]:
        """Pixels with a visible surface of the parts that are asked for, (rows, cols) bool."""
        if self.model.asked is None:
            return self.is_seen
        return np.isin(self.frame.part[::-1], self.model.asked)

    @cached_property
    def sampled(self) -> NDArray[np.intp]:
        """Sampled surface that each pixel shows, (rows, cols); -1 for none, also for backs."""
        model, samples = self.model, self.model.samples
        assert samples is not None
        sources = find_sources(model.scene, model.scene.triangles(model.shown).part)
        surface = np.full(int(sources.max(initial=-1)) + 1, -1)
        known = samples.source < len(surface)
        surface[samples.source[known]] = samples.owner[known]
        face = self.view.face[::-1]
        shown = np.append(surface[sources], -1)[np.maximum(face, -1)]  # -1 is the last
        seen = np.flatnonzero(shown >= 0)
        normal = samples.surface_normal[shown.flat[seen]]
        facing = np.einsum("ij,ij->i", normal, self.frame.normal[::-1].reshape(-1, 3)[seen])
        shown.flat[seen[facing <= 0]] = -1
        return shown

    @property
    def is_ground(self) -> NDArray[np.bool_]:
        """Pixels of a ground that is no part of the model, (rows, cols) bool."""
        part, parts = self.frame.part[::-1], self.model.scene.parts
        added = [k for k, part in enumerate(parts) if part.kind in ADDED_GROUND]
        return (part == GROUND) | np.isin(part, added)

    @property
    def is_back(self) -> NDArray[np.bool_]:
        """Pixels of surfaces asked for that have no samples on the side that is seen."""
        return self.is_asked & (self.sampled < 0) & ~self.is_ground

    @property
    def axes(self) -> NDArray[np.float64]:
        """The directions of columns and rows, (2, 3) float64."""
        return self.camera.axes()[:2]

    @property
    def relief(self) -> NDArray[np.float64]:
        """1 where a surface is seen, so that outlines are drawn, (rows, cols) float64."""
        return self.is_seen.astype(np.float64)

    @property
    def drawn_heights(self) -> NDArray[np.float64]:
        """0 where a surface is seen, NaN elsewhere, (rows, cols)."""
        return np.where(self.is_seen, 0.0, np.nan)

    @cached_property
    def places(self) -> Places:
        """The pixels' centres on the surface; far above the model where there is none."""
        model = self.model
        position = (self.frame.position[::-1] - model.scene.origin).reshape(-1, 3)
        face, soup = self.view.face[::-1].ravel(), model.scene.triangles(model.shown)
        snap_to_faces(position, face, soup.vertices, soup.faces)
        normal = self.frame.normal[::-1].reshape(-1, 3).copy()
        nothing = ~self.is_seen.ravel()
        position[nothing] = (0.0, 0.0, _FAR)
        normal[nothing] = (0.0, 0.0, 1.0)
        return Places(position, normal)

    def make_counter(self) -> "ViewTile | PixelCounter":
        """Return a counter of all casters: of frames, or by patches if only some parts are seen."""
        model = self.model
        # z-pass needs all casters in the picture.
        is_by_patches = model.samples is not None or model.shown is not None
        if not is_by_patches or self.camera.is_perspective or model.lights < MANY_SUNS:
            return self
        return PixelCounter(self._patches, model.caster, model.tree, self.shape, model.threads)

    def count_many(self, lights: int) -> PixelCounter | None:
        """Return a counter by patches, the faster one for many lights in an orthographic view."""
        model = self.model
        if self.camera.is_perspective or lights < _MANY:
            return None
        return PixelCounter(self._patches, model.caster, model.tree, self.shape, model.threads)

    @cached_property
    def _patches(self) -> Patches:
        """The pixels of an orthographic view as patches of the planes that they show."""
        model = self.model
        return make_pixel_patches(
            self.places, self.view.face[::-1].ravel(), self.camera,
            model.scene.triangles(model.shown), model.scene, model.ground, model.tree,
        )  # fmt: skip

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the pixels in shadow, cast or attached."""
        if self.model.shown is not None:
            tree, where = self.model.tree, self.places
            hidden = find_hidden(tree, where.points, where.normals, suns, self.model.threads)
            return hidden.reshape(-1, *self.shape)
        masks = np.zeros((len(suns), *self.shape), np.uint8)
        counter, normal = self.model.counter, np.nan_to_num(self.frame.normal)
        is_seen = self.view.face != NOTHING
        for mask, sun in zip(masks, suns, strict=True):
            counts = counter.count(self.view, self.camera, directional_light(sun))
            dark = ((counts != 0) | (normal @ sun <= 0)) & is_seen
            mask[...] = dark[::-1]
        return masks

    def find_cast(self, caster: Caster, suns: NDArray[np.float64]) -> tuple[Any, NDArray[np.uint8]]:
        """Find the shadows of one caster alone: the pixels in reach, and their masks."""
        which, masks = self.model.find_cast(self.places, caster, suns)
        return np.unravel_index(which, self.shape), masks

    def count_pieces(self, pieces: Sequence[Sequence[int]]) -> PieceCounter | None:
        """Return a counter of pieces of the casters by shadow edges, in an orthographic view."""
        model = self.model
        if self.camera.is_perspective:
            return None
        edges = PieceEdges(model.caster, model.find_pieces(pieces))
        return PieceCounter(self._patches, edges, model.tree, model.threads)

    def with_casters(self, parts: Sequence[int] | None = None) -> "ViewTile":
        """Return the same receivers with other parts casting; all but canopies by default."""
        model = self.model.solid if parts is None else self.model.with_casters(parts)
        return replace(self, model=model)

    def find_canopies(self) -> NDArray[np.bool_]:
        """Find the pixels with canopies in front of their surface, (rows, cols)."""
        canopy = self.model.canopy
        return self.find_cells(() if canopy is None else canopy.parts)

    def find_cells(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """Find the pixels in which some parts, see-through ones included, are in front."""
        model = self.model
        tile = self
        if model.shown is not None and not set(parts) <= set(model.shown):
            whole = replace(model, shown=sorted({*model.shown, *parts}))
            tile = replace(self, frame=whole.look(self.camera)[1])
        return np.isin(tile.frame.part[::-1], parts)

    def find_parts(self) -> NDArray[np.intp]:
        """Return each pixel's part; -1 for the ground, outside a proposal, or none."""
        part = np.maximum(self.frame.part[::-1], -1)
        if self.model.ground is not None and self.model.proposed:
            part[(part < 0) & self.find_below(self.model.proposed)] = self.model.proposed[0]
        return part

    def find_below(self, parts: Sequence[int]) -> NDArray[np.bool_]:
        """Find the pixels of the ground over which some parts of ``scene.whole`` stand."""
        model, is_covered = self.model, np.zeros(self.shape, np.bool_)
        below = np.flatnonzero(self.is_ground & self.is_seen)
        tree, where = model.with_casters(parts).tree, self.places
        points, normals = where.points[below], where.normals[below]
        covered = find_hidden(tree, points, normals, np.array([[0.0, 0.0, 1.0]]), model.threads)
        is_covered.flat[below[covered[0].view(np.bool_)]] = True
        return is_covered


@dataclass(eq=False)
class SeenRaster(Raster):
    """
    Pixels of a view, in one tile.

    Parameters
    ----------
    tile : ViewTile
    """

    casting: ViewModel
    tile: ViewTile = field(kw_only=True)

    @property
    def heights(self) -> NDArray[np.float64]:
        """0 where a surface is seen, NaN elsewhere."""
        return self.tile.drawn_heights

    def make_tiles(self, request: Request) -> Sequence[tuple[Any, Callable[[], Tile]]]:
        """Return all pixels as one tile."""
        return [(..., lambda: self.tile)]

    def finish(self) -> NDArray[np.bool_] | None:
        """Return the pixels without a visible surface that receives."""
        return self.tile.nothing

    def locate(self) -> Variables:
        """Return the position, normal and part at each pixel's centre."""
        frame = self.tile.frame
        return {
            "position": ((*self.dims, "xyz"), frame.position[::-1].copy()),
            "normal": ((*self.dims, "xyz"), frame.normal[::-1].copy()),
            "part": (self.dims, np.where(self.tile.is_ground, GROUND, frame.part[::-1])),
        }
