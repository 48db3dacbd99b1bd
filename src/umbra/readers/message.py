"""
Messages between processes: JSON, and the bytes of arrays after it.

Unlike pickles, nothing in them can run code, so the answers of a child whose library was taken over
by a hostile file are data and no more. Records are dataclasses that the reader of a message names.
"""

import json
import struct
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError

__all__ = ["list_records", "read_message", "write_message"]

_HEAD = struct.Struct("<Q")  # length of the JSON text [byte]
_LONGEST = 1 << 31  # [byte] of it
_PLAIN = {bool, int, float, str, type(None)}
_NUMBERS = "biuf"  # kinds of numpy's types
_BLOCK = 1 << 24  # [byte] of an array that are copied at once


def list_records(module: Any) -> dict[str, type]:
    """Return the dataclasses that a module defines or imports, by name."""
    return {
        n: one for n, one in vars(module).items() if isinstance(one, type) and is_dataclass(one)
    }


def write_message(stream: IO[bytes], value: Any) -> None:
    """
    Write a value: plain ones, lists, tuples, sets, dicts, arrays of numbers, records, errors.

    Raises TypeError for anything else.
    """
    arrays: list[NDArray[Any]] = []
    text = json.dumps(_encode(value, arrays)).encode()
    stream.write(_HEAD.pack(len(text)))
    stream.write(text)
    for array in arrays:
        raw = memoryview(array.reshape(-1).view(np.uint8).data)
        for start in range(0, len(raw), _BLOCK):
            stream.write(raw[start : start + _BLOCK])
    stream.flush()


def read_message(stream: IO[bytes], records: Mapping[str, type]) -> Any:
    """
    Read a value; an error that was written is returned as an `InputError` or `ValueError`.

    Raises EOFError if the message breaks off, ValueError if it is none.
    """
    (size,) = _HEAD.unpack(_read(stream, _HEAD.size))
    if size > _LONGEST:
        msg = "a message is too long"
        raise ValueError(msg)
    return _decode(json.loads(_read(stream, size)), stream, records)


def _read(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


def _encode(value: Any, arrays: list[NDArray[Any]]) -> Any:  # noqa: PLR0911 - one for each kind
    kind = type(value)
    if kind in _PLAIN:
        return value
    if kind is list and _PLAIN.issuperset(map(type, value)):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in _NUMBERS:
        arrays.append(np.ascontiguousarray(value))
        return {"array": [value.dtype.str, list(value.shape)]}
    if isinstance(value, np.generic):
        return _encode(value.item(), arrays)
    if is_dataclass(value) and not isinstance(value, type):
        told = {one.name: _encode(getattr(value, one.name), arrays) for one in fields(value)}
        return {"record": [kind.__name__, told]}
    if isinstance(value, (list, tuple, set, frozenset)):
        return {_NAMES[kind]: [_encode(one, arrays) for one in value]}
    if isinstance(value, dict):
        return {"dict": [[_encode(one, arrays) for one in pair] for pair in value.items()]}
    if isinstance(value, BaseException):
        data = value.data if isinstance(value, InputError) else {}
        return {"error": [isinstance(value, InputError), str(value), _encode(data, arrays)]}
    msg = f"a message holds no {kind.__name__}"
    raise TypeError(msg)


_KINDS: dict[str, Any] = {"list": list, "tuple": tuple, "set": set, "frozenset": frozenset}
_NAMES: dict[Any, str] = {kind: name for name, kind in _KINDS.items()}


def _decode(told: Any, stream: IO[bytes], records: Mapping[str, type]) -> Any:
    if not isinstance(told, dict):
        return told
    ((name, value),) = told.items()
    if name == "array":
        return _read_array(stream, *value)
    if name == "record":
        kind, facts = value
        return records[kind](**{k: _decode(v, stream, records) for k, v in facts.items()})
    if name == "dict":
        pairs = ([_decode(one, stream, records) for one in pair] for pair in value)
        return dict(pairs)
    if name == "error":
        is_input, text, data = value
        found = _decode(data, stream, records)
        return InputError(text, **found) if is_input else ValueError(text)
    return _KINDS[name](_decode(one, stream, records) for one in value)


def _read_array(stream: IO[bytes], name: str, shape: list[int]) -> NDArray[Any]:
    kind = np.dtype(name)
    if kind.kind not in _NUMBERS or min(shape, default=0) < 0:
        msg = "a message holds no array of numbers"
        raise ValueError(msg)
    array = np.zeros(shape, kind)
    raw = memoryview(array.reshape(-1).view(np.uint8).data)
    start = 0
    while start < len(raw):
        count = stream.readinto(raw[start : start + _BLOCK])  # type: ignore[attr-defined]
        if not count:
            raise EOFError
        start += count
    return array
