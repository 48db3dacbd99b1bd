"""
A reader's library in a child process, which may crash or hang without harm.

The child runs a generator of its target (``module:function``) and passes each piece on, as arrays
and JSON (`umbra.readers.child`); records in them are dataclasses that the target's module names.

Messages between processes: JSON, and the bytes of arrays after it.

Unlike pickles, nothing in them can run code, so the answers of a child whose library was taken over
by a hostile file are data and no more. Records are dataclasses that the reader of a message names.
"""

import json
import os
import signal
import struct
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from types import ModuleType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import HOME, find_memory, make_command

__all__ = [
    "ChildLimits",
    "ReadingChild",
    "list_records",
    "make_early_end",
    "read_message",
    "serve_reader",
    "write_message",
]

_HEAD = struct.Struct("<Q")  # length of the JSON text [byte]
_LONGEST = 1 << 31  # [byte] of it
_PLAIN = {bool, int, float, str, type(None)}
_NUMBERS = "biuf"  # kinds of numpy's types
_BLOCK = 1 << 24  # [byte] of an array that are copied at once


def list_records(module: Any) -> dict[str, type]:
    """Return the dataclasses that a module defines or imports, by name."""
    return {
        n: value
        for n, value in vars(module).items()
        if isinstance(value, type) and is_dataclass(value)
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
        values = {item.name: _encode(getattr(value, item.name), arrays) for item in fields(value)}
        return {"record": [kind.__name__, values]}
    if isinstance(value, (list, tuple, set, frozenset)):
        return {_NAMES[kind]: [_encode(item, arrays) for item in value]}
    if isinstance(value, dict):
        return {"dict": [[_encode(item, arrays) for item in pair] for pair in value.items()]}
    if isinstance(value, BaseException):
        data = value.data if isinstance(value, InputError) else {}
        return {"error": [isinstance(value, InputError), str(value), _encode(data, arrays)]}
    msg = f"a message holds no {kind.__name__}"
    raise TypeError(msg)


_KINDS: dict[str, Any] = {"list": list, "tuple": tuple, "set": set, "frozenset": frozenset}
_NAMES: dict[Any, str] = {kind: name for name, kind in _KINDS.items()}


def _decode(encoded: Any, stream: IO[bytes], records: Mapping[str, type]) -> Any:
    if not isinstance(encoded, dict):
        return encoded
    ((name, value),) = encoded.items()
    if name == "array":
        return _read_array(stream, *value)
    if name == "record":
        kind, facts = value
        return records[kind](**{k: _decode(v, stream, records) for k, v in facts.items()})
    if name == "dict":
        pairs = ([_decode(item, stream, records) for item in pair] for pair in value)
        return dict(pairs)
    if name == "error":
        is_input, text, data = value
        attributes = _decode(data, stream, records)
        return InputError(text, **attributes) if is_input else ValueError(text)
    return _KINDS[name](_decode(item, stream, records) for item in value)


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


_CODE = "from umbra.readers.child import serve_reader; serve_reader({target!r}, {limits!r})"
_PACKAGES = 250e6  # [byte] of the packages that a child loads, beside what the file takes
_TIMES_UP = {-getattr(signal, name) for name in ("SIGPROF", "SIGXCPU") if hasattr(signal, name)}


@dataclass(frozen=True)
class ChildLimits:
    """What a child may take."""

    seconds: float  # processor time until the next piece [s]
    whole: float  # processor time in all [s]
    memory: float  # beside its packages [byte]


class ReadingChild:
    """
    Iterate over the pieces from a child; afterwards states whether they are complete.

    Parameters
    ----------
    target : str
        ``module:function``, called with ``work`` in the child, or here if Python has no program.
    work : object
        That `write_message` can write.
    limits : ChildLimits
    """

    is_done = False
    has_hung = False

    def __init__(self, target: str, work: Any, limits: ChildLimits) -> None:
        self._target, self._work, self._limits = target, work, limits

    def __iter__(self) -> Iterator[Any]:
        module, function = _find_target(self._target)
        if not sys.executable:
            yield from function(self._work)
            self.is_done = True
            return
        limits = (self._limits.seconds, self._limits.whole, self._limits.memory)
        command = make_command(_CODE.format(target=self._target, limits=limits))
        child = subprocess.Popen(command, cwd=HOME, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        requests, answers = child.stdin, child.stdout
        assert requests is not None and answers is not None  # noqa: PT018
        records = list_records(module)
        try:
            with suppress(EOFError, BrokenPipeError):
                write_message(requests, self._work)
                requests.close()
                while (piece := read_message(answers, records)) is not None:
                    if isinstance(piece, BaseException):
                        raise piece
                    yield piece
                self.is_done = True
        finally:
            if not self.is_done:
                child.kill()
            answers.close()
            self.has_hung = child.wait() in _TIMES_UP

    def make_error(self, what: str, remedy: str) -> InputError:
        """Return the error for a child that ended too early, as `make_early_end`."""
        return make_early_end(what, remedy, has_hung=self.has_hung)


def make_early_end(what: str, remedy: str, *, has_hung: bool) -> InputError:
    """Return the error for a file at which a child ended; ``what`` names its format."""
    how = "does not end" if has_hung else "ends its process"
    msg = f"is {what} at which its reader {how}; it is damaged: {remedy}"
    return InputError(msg, has_hung=has_hung)


def serve_reader(target: str, limits: tuple[float, float, float]) -> None:
    """Read a request from standard input, and write its pieces to standard output."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # The library's output must not mix with the pieces.
    answers = os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    seconds, whole, memory = limits
    _limit(memory, whole)
    module, function = _find_target(target)
    work = read_message(sys.stdin.buffer, list_records(module))
    _start_timer(seconds)
    with suppress(BrokenPipeError):
        last: object = None
        try:
            for piece in function(work):
                _start_timer(seconds)
                write_message(answers, piece)
        except MemoryError:
            last = InputError(
                f"takes more than {memory / 1e9:.1f} GB of memory; it is damaged, or say how much "
                "it may take (max_memory=)",
                option="max_memory",
                limit=memory,
            )
        except Exception as error:  # noqa: BLE001 - the parent raises it again
            last = error
        write_message(answers, last)
    os._exit(0)  # without the library's cleanup


def _find_target(target: str) -> tuple[ModuleType, Any]:
    name, _, function = target.partition(":")
    module = import_module(name)
    return module, getattr(module, function)


def _start_timer(seconds: float) -> None:
    # By its default the signal ends the process, also in the midst of C++. Windows has none.
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _limit(memory: float, seconds: float) -> None:
    """Limit memory and processor time, so that the library fails and not the machine."""
    with suppress(ImportError, ValueError, OSError):
        import resource  # noqa: PLC0415 - not on Windows

        held = find_memory()
        most = {
            "RLIMIT_CORE": 0,
            "RLIMIT_AS": held,
            "RLIMIT_DATA": min(memory + _PACKAGES, held),
            "RLIMIT_CPU": seconds + 1,
        }
        for name, limit in most.items():
            number = getattr(resource, name)
            hard = resource.getrlimit(number)[1]
            value = int(limit) if hard == resource.RLIM_INFINITY else min(int(limit), hard)
            resource.setrlimit(number, (value, hard))
