"""
Studies of plans in chunks: Dask arrays, counted when and where they are computed.

A task counts one chunk. All tasks share one job, the scene with its options, which a cluster
sends to each worker once and which every process prepares once.
"""

import hashlib
import pickle
import sys
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from threading import Lock
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.packages import need
from umbra.receivers import find_kind
from umbra.receivers.plan import PlanRaster
from umbra.scene import Scene
from umbra.study.attributes import find_attributes
from umbra.study.options import StudyOptions
from umbra.study.result import Study, time_variables
from umbra.study.settled import settle_ground
from umbra.study.setup import Setup
from umbra.sun import Site

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ChunkJob", "make_lazy_dataset"]

SIDE = 2048
"""Side of a chunk by default [cell]: each processes all casters."""
_KEPT = 2  # jobs that a process keeps prepared
_TIMES = ("prepare_seconds", "count_seconds")


@dataclass(frozen=True, eq=False)
class ChunkJob:
    """
    A study whose chunks are counted alone.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : StudyOptions
    """

    scene: Scene
    site: Site
    options: StudyOptions

    @cached_property
    def key(self) -> str:
        """Name that is the same for the same study."""
        digest = hashlib.blake2b(digest_size=16)
        given = {name: value for name, value in vars(self.options).items() if name != "kind"}
        for what in (
            self.scene.parts,
            self.scene.origin,
            self.site,
            sorted(given.items(), key=str),
        ):
            pickle.dump(what, _Hash(digest), protocol=5)
        return digest.hexdigest()

    @property
    def setup(self) -> Setup:
        """The study's setup; made once in each process."""
        return _prepare(self)[0]

    @property
    def laid(self) -> PlanRaster:
        """The whole plan; laid out once in each process."""
        return _prepare(self)[1]

    def __getstate__(self) -> dict[str, Any]:
        """Send the scene without what was derived from it, and the key with it."""
        return {
            "scene": replace(self.scene), "site": self.site, "options": self.options,
            "key": self.key,
        }  # fmt: skip

    def count(self, rows: slice, cols: slice) -> Study:
        """Count some rows and columns."""
        setup, laid = self.setup, self.laid.pick(rows, cols)
        return setup.finish(setup.count(laid), laid)

    def sketch(self) -> Study:
        """Make the study of one cell before counting: names, types and constants of the whole."""
        setup, laid = self.setup, self.laid.pick(slice(0, 1), slice(0, 1))
        begun = setup.begin(laid)
        known = settle_ground(self.scene, self.options)
        ground_facts = {**laid.facts, **_tell_ground(self.laid), **known.describe()}
        facts = setup.describe(laid.kind.name, 0.0, ground=known.name, **ground_facts)
        facts = {name: fact for name, fact in facts.items() if name not in _TIMES}
        arrays, (more, _) = begun.arrays, begun.collect(laid)
        return Study(
            laid, setup.period, arrays.shadow_hours, arrays.up_hours, begun.masks, facts, more
        )


class _Hash:
    """A file that hashes what is written."""

    def __init__(self, digest: Any) -> None:
        self.write = digest.update


_prepared: OrderedDict[str, tuple[Setup, PlanRaster]] = OrderedDict()
_lock = Lock()


def _prepare(job: ChunkJob) -> tuple[Setup, PlanRaster]:
    """Set a job up, once in each process: other threads wait."""
    with _lock:
        if job.key not in _prepared:
            options = job.options
            scene = settle_ground(job.scene, options).scene
            kind = find_kind(options.receivers, scene, options.ground)
            if not kind.is_plan:
                msg = (
                    f"chunks= is for receivers='ground' and 'top'; got '{options.receivers}', "
                    "which is counted whole; leave chunks= out"
                )
                raise InputError(msg, option="chunks")
            setup = Setup.of(scene, job.site, options, is_cut=True)
            laid = cast("PlanRaster", kind.lay_out(setup.request))
            _prepared[job.key] = setup, laid
        _prepared.move_to_end(job.key)
        while len(_prepared) > _KEPT:
            _prepared.popitem(last=False)
        return _prepared[job.key]


def _tell_ground(laid: PlanRaster) -> dict[str, object]:
    """Return the assumption about the ground, as far as it is known before counting."""
    if laid.assumed is None or laid.kind.lies_under_roofs:
        return laid.kind.describe_level(laid.casting.scene, laid.ground, laid.assumed, 0.0)
    note = (
        f"where nothing of the model lies, the ground is assumed level at z = {laid.ground:.6g} m "
        "(ground=)"
    )
    return {} if laid.casting.has_end else {"assumption": note}


def count_chunk(job: ChunkJob, rows: slice, cols: slice) -> dict[str, Any]:
    """
    Count a chunk: a task's work.

    Returns
    -------
    arrays : dict
        Those that have receivers; masks are packed.
    """
    study = job.count(rows, cols)
    dims = set(study.dims)
    return {
        name: array
        for name, (axes, array) in study.variables().items()
        if dims <= set(axes) and name != "sun_hours"
    }


def take(arrays: dict[str, Any], name: str) -> NDArray:
    """Take one of a chunk's arrays: a task's work."""
    array = np.asarray(arrays[name])
    return array.astype("datetime64[ns]") if array.dtype.kind == "M" else array


def make_lazy_dataset(scene: Scene, site: Site, options: StudyOptions, chunks: Any) -> "xr.Dataset":
    """
    Make a study's dataset of Dask arrays, of which nothing is counted yet.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : StudyOptions
        ``threads`` are those of each chunk, 1 by default.
    chunks : int, tuple, dict or 'auto'
        Sides [cell].

    Returns
    -------
    dataset : xarray.Dataset
        The variables of a study without chunks, and the same values.

    Raises
    ------
    InputError
        If Dask is not installed, the receivers are no plan, or the options sum over the plan.
    """
    need("dask.array", "city", "chunks=")
    import xarray as xr  # noqa: PLC0415  (half a second)

    if options.proposed:
        msg = "proposed= adds up over the whole plan; leave chunks= out"
        raise InputError(msg, option="chunks")
    job = ChunkJob(scene, site, replace(options, threads=options.threads or 1))
    sketch = job.sketch()
    dims, dates = job.laid.dims, len(job.setup.period.days)
    sides = normalize_chunks(chunks, dims, job.laid.shape)
    graph = _make_graph(job, sides)
    constants = {**job.laid.coordinates(), **time_variables(job.setup.period)}
    arrays: dict[str, Any] = {}
    for name, (axes, array) in sketch.variables().items():
        if name == "sun_hours":
            values = np.float32(sketch.up_hours) - arrays["shadow_hours"][1]
        elif set(dims) <= set(axes):
            values = _make_array(graph, job, name, array, sides)
        else:
            values = np.array(constants[name][1] if name in constants else array)
        arrays[name] = (axes, values, find_attributes(name, dates))
    return xr.Dataset(arrays, attrs=sketch.facts)


def normalize_chunks(
    chunks: Any, dims: tuple[str, ...], shape: tuple[int, ...]
) -> tuple[tuple[int, ...], ...]:
    """
    Return the sides of all chunks along each axis, as Dask writes them.

    Raises
    ------
    InputError
        If they are malformed.
    """
    from dask.array.core import normalize_chunks as normalize  # noqa: PLC0415

    if isinstance(chunks, Mapping):
        strange = [name for name in chunks if name not in dims]
        if strange:
            msg = f"chunks= names the axis '{strange[0]}'; there are {' and '.join(dims)}"
            raise InputError(msg, option="chunks")
        chunks = tuple(chunks.get(name, "auto") for name in dims)
    sides = chunks if isinstance(chunks, tuple) else (chunks,) * len(dims)
    requested = tuple(SIDE if isinstance(side, str) and side == "auto" else side for side in sides)
    msg = (
        f"chunks= is a side, (rows, columns), {{'y': rows, 'x': columns}} or 'auto', one cell at "
        f"least; got {show_value(chunks)}"
    )
    try:
        normalized: tuple[tuple[int, ...], ...] = normalize(requested, shape)
    except (TypeError, ValueError, ZeroDivisionError) as error:
        raise InputError(msg, option="chunks") from error
    if len(normalized) != len(shape) or not all(side >= 1 for axis in normalized for side in axis):
        raise InputError(msg, option="chunks")
    return normalized


def _make_graph(job: ChunkJob, sides: tuple[tuple[int, ...], ...]) -> Any:
    """Make the tasks that count chunks; the job is one value among them, or on the cluster."""
    from dask.highlevelgraph import HighLevelGraph  # noqa: PLC0415

    name, chunk = f"umbra-job-{job.key}", f"umbra-chunk-{job.key}"
    ends = [np.cumsum((0, *side)).tolist() for side in sides]
    rows, cols = ([slice(*pair) for pair in pairwise(end)] for end in ends)
    tasks = {
        (chunk, i, j): (count_chunk, name, row, others)
        for i, row in enumerate(rows)
        for j, others in enumerate(cols)
    }
    layers: dict[str, dict[Any, Any]] = {name: {name: _scatter(job, name)}, chunk: tasks}
    return HighLevelGraph(layers, {name: set(), chunk: {name}})


def _scatter(job: ChunkJob, name: str) -> Any:
    """Send the job to the active cluster, if any: once, not with each computation."""
    distributed = sys.modules.get("distributed")  # without it no client can be active
    if distributed is None:
        return job
    try:
        client = distributed.get_client()
    except ValueError:
        return job
    return client.scatter({name: job})[name]


def _make_array(
    graph: Any, job: ChunkJob, name: str, array: Any, sides: tuple[tuple[int, ...], ...]
) -> Any:
    """Make the Dask array of one variable, whose last axes are the receivers'."""
    from dask.array import Array  # noqa: PLC0415
    from dask.highlevelgraph import HighLevelGraph  # noqa: PLC0415

    own, chunk = f"umbra-{name}-{job.key}", f"umbra-chunk-{job.key}"
    before = np.shape(array)[: -len(sides)]
    zeros = (0,) * len(before)
    tasks = {(own, *zeros, *key[1:]): (take, key, name) for key in graph.layers[chunk]}
    layers = {**graph.layers, own: tasks}
    whole = HighLevelGraph(layers, {**graph.dependencies, own: {chunk}})
    kind = take({name: array}, name).dtype
    return Array(whole, own, (*((n,) for n in before), *sides), dtype=kind)
