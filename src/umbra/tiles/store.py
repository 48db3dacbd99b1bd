"""
The store of a city's results: one Zarr group, chunked by tile, and a mark for each tile done.

Every chunk is written under another name and renamed, and carries a checksum. A tile's mark is
written after its last chunk.
"""

import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import require
from umbra.study.attributes import find_attributes
from umbra.tiles.lattice import CityTile
from umbra.tiles.outside import write_json
from umbra.writers.atomic import check_folder_name

__all__ = ["CityStore", "check_zarr"]

MARKS = "tiles"
ROWS = {"sample", "surface", "part"}
"""Dimensions of surfaces."""
_EPOCH = "microseconds since 1970-01-01 00:00:00"
_LEVEL, _SHUFFLED = 3, 5  # of Zstandard


def _load_zarr() -> Any:
    """Import zarr; threads of its compressor would write blocks in the order in which they end."""
    import zarr  # noqa: PLC0415
    from numcodecs import blosc  # noqa: PLC0415

    blosc.use_threads = False
    return zarr


def check_zarr() -> None:
    """Raise an InputError if zarr is missing."""
    require(["zarr"], "city", "a study in tiles")


class CityStore:
    """
    The store of a run.

    Parameters
    ----------
    path : Path
        Folder of the Zarr group; the marks lie beside it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._marks = path.parent / MARKS

    def create(
        self,
        template: Mapping[str, tuple[tuple[str, ...], NDArray]],
        sizes: Mapping[str, int],
        side: Mapping[str, int],
        facts: Mapping[str, object],
    ) -> None:
        """
        Make the arrays of all variables, empty; write those without receivers whole.

        Parameters
        ----------
        template : mapping
            Dimensions and values of each variable, of any few receivers.
        sizes, side : mapping of str to int
            Length of the receivers' dimensions, and of their chunks.
        facts : mapping
            Global attributes.
        """
        _load_zarr().create_group(
            str(self.path), overwrite=True, zarr_format=3,
            attributes={"Conventions": "CF-1.11", **make_plain(facts)},
        )  # fmt: skip
        self.add(template, sizes, side, int(str(facts.get("days", 1))))

    def add(
        self,
        template: Mapping[str, tuple[tuple[str, ...], NDArray]],
        sizes: Mapping[str, int],
        side: Mapping[str, int],
        dates: int,
    ) -> None:
        """Make or replace arrays, as ``create`` does; ``dates`` is the number of dates."""
        from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec  # noqa: PLC0415

        group = _load_zarr().open_group(str(self.path), mode="r+", use_consolidated=False)
        # Bytes of equal weight together: heights, full of digits, take a third less.
        packed: Any = BloscCodec(cname="zstd", clevel=_SHUFFLED, shuffle="shuffle")
        text: Any = ZstdCodec(level=_LEVEL)
        for name, (dims, values) in template.items():
            array, attributes = encode(np.asarray(values))
            shape = tuple(sizes.get(dim, n) for dim, n in zip(dims, array.shape, strict=True))
            is_whole = dims[-len(side) :] != tuple(side) and not set(dims) & ROWS
            chunks = tuple(
                max(1, min(n, side.get(dim, n if is_whole else 16)))
                for dim, n in zip(dims, shape, strict=True)
            )
            made = group.create_array(
                name, shape=shape, chunks=chunks, dimension_names=dims, overwrite=True,
                dtype="string" if array.dtype.kind == "O" else array.dtype,
                compressors=[packed if array.dtype.kind in "fiu" else text, Crc32cCodec()],
                fill_value={"f": np.nan, "O": ""}.get(array.dtype.kind, 0),
                attributes={**find_attributes(name, dates), **attributes},
            )  # fmt: skip
            if is_whole:
                made[...] = array

    def write(self, arrays: Mapping[str, NDArray], where: Any = ...) -> None:
        """Write a part of each variable, which an index names; all of it by default."""
        group = _load_zarr().open_group(str(self.path), mode="r+")
        for name, values in arrays.items():
            group[name][where] = encode(values)[0]

    def finish(self, facts: Mapping[str, object]) -> None:
        """Add global attributes, and consolidate the metadata."""
        import warnings  # noqa: PLC0415

        zarr = _load_zarr()
        group = zarr.open_group(str(self.path), mode="r+", use_consolidated=False)
        group.attrs.update(make_plain(facts))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # consolidated metadata are not in the standard yet
            zarr.consolidate_metadata(str(self.path))

    def find_place(self, number: int) -> Path:
        """Return the folder of a tile's pieces."""
        return self._marks / f"{number:06}"

    def mark(self, tile: CityTile, facts: Mapping[str, object]) -> None:
        """Mark a tile as done, with the checksum of its files."""
        self._marks.mkdir(exist_ok=True)
        held = {**facts, "checksum": self._sum_up(tile)}
        write_json(self._marks / f"{tile.number:06}.json", held)

    def drop_damaged(self, tiles: Iterable[CityTile]) -> None:
        """Remove the marks of tiles whose files are not as they were written, and what is half."""
        for path in self.path.rglob("*.partial"):  # of a run that was killed
            path.unlink(missing_ok=True)
        done = self.find_done()
        self.unmark(
            tile.number
            for tile in tiles
            if tile.number in done and done[tile.number].get("checksum") != self._sum_up(tile)
        )

    def _sum_up(self, tile: CityTile) -> int:
        """Return the CRC-32 of a tile's files, with their names."""
        total = 0
        for path in sorted(self._find_files(tile)):
            total = zlib.crc32(path.read_bytes(), zlib.crc32(path.name.encode(), total))
        return total

    def _find_files(self, tile: CityTile) -> Iterator[Path]:
        yield from self.find_place(tile.number).glob("*")
        for array in self.path.glob("*/zarr.json"):
            dims = orjson.loads(array.read_bytes()).get("dimension_names") or []
            if dims[-2:] == ["y", "x"]:
                lead = "*/" * (len(dims) - 2)
                yield from array.parent.glob(f"c/{lead}{tile.place[0]}/{tile.place[1]}")

    def find_done(self) -> dict[int, dict[str, Any]]:
        """Return the facts of each tile that is done, by its number."""
        found = {}
        for path in self._marks.glob("[0-9]*.json") if self._marks.exists() else ():
            try:
                found[int(path.stem)] = orjson.loads(path.read_bytes())
            except ValueError:  # damaged: counted again
                path.unlink()
        return found

    def unmark(self, numbers: Iterable[int]) -> None:
        """Remove the marks of some tiles."""
        for number in numbers:
            (self._marks / f"{number:06}.json").unlink(missing_ok=True)


def encode(array: NDArray) -> tuple[NDArray, dict[str, Any]]:
    """Return an array as the store keeps it, and CF attributes of its encoding."""
    if array.dtype.kind == "M":
        numbers = array.astype("datetime64[us]").astype(np.int64)
        return numbers, {"units": _EPOCH, "calendar": "proleptic_gregorian"}
    if array.dtype.kind == "b":
        return array.astype(np.uint8), {}
    if array.dtype.kind == "U":
        return array.astype(object), {}
    return array, {}


def make_plain(facts: Mapping[str, object]) -> dict[str, Any]:
    """Return facts as JSON has them, without None."""
    plain: dict[str, Any] = {}
    for name, fact in facts.items():
        if isinstance(fact, (np.ndarray, tuple)):
            plain[name] = np.asarray(fact).tolist()
        elif isinstance(fact, np.generic):
            plain[name] = fact.item()
        elif fact is not None:
            plain[name] = fact
    return plain


def check_folder(folder: Path) -> None:
    """Make a folder for results; refuse one that is a file, or cannot be made."""
    if folder.exists() and not folder.is_dir():
        msg = f"'{folder}' is a file, not a folder; name another output folder"
        raise InputError(msg, option="out", path=folder)
    check_folder_name(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:  # ValueError: a null byte in its name
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        msg = f"cannot make the output folder '{folder}' ({reason}); name another"
        raise InputError(msg, option="out", path=folder) from error
