"""
The store of a city's results: one Zarr group, chunked by tile, and a mark for each tile done.

Every chunk is written under another name and renamed, and carries a checksum. A tile's mark is
written after its last chunk.
"""

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.folders.atomic import check_folder_name, check_is_here, replace_file
from umbra.packages import require
from umbra.study.attributes import find_attributes
from umbra.study.grid_mapping import GRID_MAPPING, find_grid_mapping, find_map_attributes
from umbra.study.measures import Quantity
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.sealed import read_sealed, sum_files, write_sealed

__all__ = ["FORMAT", "CityStore", "check_zarr"]

FORMAT: Literal[3] = 3
"""Of Zarr: named wherever a store is opened, as one of version 2 may name codecs that run code."""
MARKS = "tiles"
ROWS = {"sample", "surface", "part"}
"""Dimensions of surfaces."""
_META = "zarr.json"
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

    def mend(
        self,
        template: Mapping[str, tuple[tuple[str, ...], NDArray]],
        sizes: Mapping[str, int],
        side: Mapping[str, int],
        facts: Mapping[str, object],
        quantities: Sequence[Quantity] = (),
    ) -> list[Path]:
        """
        Make the arrays of all variables as far as they are not there; write those of axes whole.

        Files that differ are replaced, and files that are none of the store's removed. The chunks
        of tiles stay.

        Parameters
        ----------
        template : mapping
            Dimensions and values of each variable, of any few receivers.
        sizes, side : mapping of str to int
            Length of the receivers' dimensions, and of their chunks.
        facts : mapping
            Global attributes, as far as they are known.
        quantities : sequence of Quantity
            Variables of the study's measures.

        Returns
        -------
        damaged : list of Path
            Files that were there, and not as they had been written.
        """
        with TemporaryDirectory(prefix="umbra-") as folder:
            fresh = CityStore(Path(folder) / self.path.name)
            fresh.create(template, sizes, side, facts, quantities)
            wanted = {path.relative_to(fresh.path) for path in fresh.path.rglob("*")
                      if path.is_file()}  # fmt: skip
            arrays = [name for name, (dims, _) in template.items() if dims[-2:] == ("y", "x")]
            self._drop_strangers(wanted, arrays)
            is_there = (self.path / _META).exists()
            return [
                self.path / name for name in sorted(wanted)
                if self._replace(name, (fresh.path / name).read_bytes()) and is_there
            ]  # fmt: skip

    def _drop_strangers(self, wanted: set[Path], arrays: list[str]) -> None:
        """Remove all files but some and those of tiles' chunks, and folders in files' places."""
        if self.path.exists() and not self.path.is_dir():
            self.path.unlink()
        folders = {folder for name in wanted for folder in name.parents}
        for path in list(self.path.rglob("*")):
            name = path.relative_to(self.path)
            if path.is_dir():
                if name in wanted:
                    shutil.rmtree(path)
                continue
            is_chunk = name.parts[0] in arrays and name.parts[1:2] == ("c",)
            if (name not in wanted and not is_chunk) or name in folders:
                path.unlink(missing_ok=True)

    def _replace(self, name: Path, data: bytes) -> bool:
        """Write a file of the store unless it holds these bytes; return whether it did not."""
        path = self.path / name
        if path.is_file() and path.read_bytes() == data:
            return False
        if name == Path(_META) and self._is_of(data):  # with more attributes at the end
            return False
        with replace_file(path) as beside:
            beside.write_bytes(data)
        return True

    def _is_of(self, data: bytes) -> bool:
        """Return whether the group's metadata hold the attributes that it begins with."""
        try:
            known = orjson.loads((self.path / _META).read_bytes())
            begun = orjson.loads(data)
            return bool(begun["attributes"].items() <= known["attributes"].items())
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return False

    def create(
        self,
        template: Mapping[str, tuple[tuple[str, ...], NDArray]],
        sizes: Mapping[str, int],
        side: Mapping[str, int],
        facts: Mapping[str, object],
        quantities: Sequence[Quantity] = (),
    ) -> None:
        """Make the store anew, as ``mend`` makes a new one."""
        _load_zarr().create_group(
            str(self.path), overwrite=True, zarr_format=FORMAT,
            attributes={"Conventions": "CF-1.11"},
        )  # fmt: skip
        mapping = find_grid_mapping(facts.get("crs"))
        dates = int(str(facts.get("days", 1)))
        more: dict[str, dict[str, Any]] = {
            name: find_attributes(name, dates, quantities) for name in template
        }
        if mapping:
            for name, (dims, _) in template.items():
                more[name] |= find_map_attributes(name, dims)
            template = {**template, GRID_MAPPING: ((), np.zeros((), np.int32))}
            more[GRID_MAPPING] = mapping
        self.add(template, sizes, side, more)

    def add(
        self,
        template: Mapping[str, tuple[tuple[str, ...], NDArray]],
        sizes: Mapping[str, int],
        side: Mapping[str, int],
        attributes: Mapping[str, Mapping[str, Any]],
    ) -> None:
        """Make or replace arrays, with their attributes."""
        from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec  # noqa: PLC0415

        zarr = _load_zarr()
        # Bytes of equal weight together: heights, full of digits, take a third less.
        packed: Any = BloscCodec(cname="zstd", clevel=_SHUFFLED, shuffle="shuffle")
        text: Any = ZstdCodec(level=_LEVEL)
        for name, (dims, values) in template.items():
            array, encoding = encode_array(np.asarray(values))
            shape = tuple(sizes.get(dim, n) for dim, n in zip(dims, array.shape, strict=True))
            is_whole = not dims or (dims[-len(side) :] != tuple(side) and not set(dims) & ROWS)
            chunks = tuple(
                max(1, min(n, side.get(dim, n if is_whole else 16)))
                for dim, n in zip(dims, shape, strict=True)
            )
            made = zarr.create_array(
                str(self.path), name=name, shape=shape, chunks=chunks, dimension_names=dims,
                overwrite=True, zarr_format=FORMAT,
                dtype="string" if array.dtype.kind == "O" else array.dtype,
                compressors=[packed if array.dtype.kind in "fiu" else text, Crc32cCodec()],
                fill_value={"f": np.nan, "O": ""}.get(array.dtype.kind, 0),
                attributes={**attributes[name], **encoding},
            )  # fmt: skip
            if is_whole:
                made[...] = array

    def write(self, arrays: Mapping[str, NDArray], where: Any = ...) -> None:
        """Write a part of each variable, which an index names; all of it by default."""
        zarr = _load_zarr()
        for name, values in arrays.items():
            array = zarr.open_array(str(self.path / name), mode="r+", zarr_format=FORMAT)
            array[where] = encode_array(values)[0]

    def finish(self, facts: Mapping[str, object]) -> bool:
        """
        Write the metadata of the whole group, with global attributes and those of all arrays.

        Returns
        -------
        is_changed : bool
            Whether they were not there.
        """
        import warnings  # noqa: PLC0415

        zarr = _load_zarr()
        with TemporaryDirectory(prefix="umbra-") as folder:
            attributes = {"Conventions": "CF-1.11", **make_plain(facts)}
            zarr.create_group(folder, zarr_format=FORMAT, attributes=attributes)
            for path in self.path.glob(f"*/{_META}"):
                target = Path(folder) / path.parent.name
                target.mkdir()
                shutil.copyfile(path, target / _META)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # consolidated metadata are not in the standard yet
                zarr.consolidate_metadata(folder, zarr_format=FORMAT)
            data = (Path(folder) / _META).read_bytes()
        path = self.path / _META
        if path.is_file() and path.read_bytes() == data:
            return False
        with replace_file(path) as beside:
            beside.write_bytes(data)
        return True

    def list_dims(self) -> dict[str, tuple[str, ...]]:
        """Return the dimensions of each array."""
        return {path.parent.name: tuple(_read_dims(path)) for path in self.path.glob(f"*/{_META}")}

    def find_place(self, number: int) -> Path:
        """Return the folder of a tile's pieces."""
        return self._marks / f"{number:06}"

    def mark(self, tile: CityTile, facts: Mapping[str, object], study: str) -> None:
        """Mark a tile as done, with the checksum of its files and the fingerprint of its study."""
        self._marks.mkdir(exist_ok=True)
        held = {**facts, "study": study, "files_checksum": self._sum_up(tile)}
        write_sealed(self._marks / f"{tile.number:06}.json", held)

    def drop_damaged(self, tiles: Iterable[CityTile], study: str) -> list[int]:
        """
        Remove the marks of tiles whose files are not as they were written, and what is half.

        Returns the numbers of these tiles, but not of those that were never done.
        """
        for path in self.path.rglob("*.partial"):  # of a run that was killed
            path.unlink(missing_ok=True)
        sound, damaged = set(), []
        for tile in tiles:
            mark = self._marks / f"{tile.number:06}.json"
            facts = read_sealed(mark)
            if facts is not None and facts.get("study") != study:
                facts = None
            elif facts is None or facts["files_checksum"] != self._sum_up(tile):
                damaged += [tile.number] * mark.exists()
                facts = None
            if facts is not None:
                sound.add(mark)
        for mark in set(self._marks.glob("*.json")) - sound:
            mark.unlink()
        return damaged

    def _sum_up(self, tile: CityTile) -> int:
        """Return the CRC-32 of a tile's files, with their names."""
        return sum_files(self._find_files(tile))

    def _find_files(self, tile: CityTile) -> Iterator[Path]:
        yield from self.find_place(tile.number).glob("*")
        for array in self.path.glob(f"*/{_META}"):
            dims = _read_dims(array)
            if dims[-2:] == ["y", "x"]:
                lead = "*/" * (len(dims) - 2)
                yield from array.parent.glob(f"c/{lead}{tile.place[0]}/{tile.place[1]}")

    def find_done(self) -> dict[int, dict[str, Any]]:
        """Return the facts of each tile that is done, by its number."""
        marks = {int(path.stem): read_sealed(path) for path in self._marks.glob("[0-9]*.json")}
        return {number: facts for number, facts in marks.items() if facts is not None}


def _read_dims(path: Path) -> list[str]:
    """Return the dimensions of an array; none if its metadata are damaged."""
    try:
        return orjson.loads(path.read_bytes()).get("dimension_names") or []
    except (ValueError, AttributeError):
        return []


def encode_array(array: NDArray) -> tuple[NDArray, dict[str, Any]]:
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
    """Make a folder for results; refuse an address, a file, and what cannot be made."""
    check_is_here(folder)
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
