"""Messages of a reading child: what is written is read again, and nothing in them is run."""

import io
import math
import pickle
import sys
from dataclasses import dataclass

import numpy as np
import pytest

from umbra import InputError
from umbra.readers.child import ChildLimits, ReadingChild, list_records, read_message, write_message


@dataclass(frozen=True)
class Told:
    name: str
    places: dict
    inner: object = None


RECORDS = list_records(sys.modules[__name__])


def pass_on(value):
    stream = io.BytesIO()
    write_message(stream, value)
    stream.seek(0)
    return read_message(stream, RECORDS)


@pytest.mark.parametrize(
    "value",
    [
        None, True, -3, 1.5, math.inf, "Straße\n\x00", [], [1, "a", None], (1, (2.0,), []),
        {"a": 1, 2: (3,)}, {1, 2}, frozenset({(1, 2)}), Told("x", {"b": [(1, 2)]}, Told("y", {})),
    ],
)  # fmt: skip
def test_values_come_back_in_their_types(value):
    found = pass_on(value)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("kind", ["<f8", "<f4", "<i4", "<u8", "|b1"])
@pytest.mark.parametrize("shape", [(0, 3), (2, 3), ()])
def test_arrays_come_back_bit_for_bit(kind, shape):
    array = np.random.default_rng(0).integers(0, 2, shape).astype(kind)
    found = pass_on((array, [array.T]))
    assert found[0].dtype == array.dtype
    assert np.array_equal(found[0], array)
    assert np.array_equal(found[1][0], array.T)
    assert found[0].flags.writeable


def test_errors_come_back_with_their_data():
    error = pass_on(InputError("is damaged", views=["a"], count=3))
    assert isinstance(error, InputError)
    assert (error.views, error.count) == (["a"], 3)
    assert isinstance(pass_on(RuntimeError("broken")), ValueError)


@pytest.mark.parametrize("value", [object(), print, np.array([object()]), b"raw"])
def test_what_is_no_data_is_not_written(value):
    with pytest.raises(TypeError):
        write_message(io.BytesIO(), value)


class Trap:
    def __reduce__(self):
        return (sys.exit, ("code of a file was run",))


@pytest.mark.parametrize("data", [pickle.dumps(Trap()), b"", b"\x05", b"\xff" * 40])
def test_a_pickle_or_noise_is_no_message(data):
    with pytest.raises((EOFError, ValueError)):
        read_message(io.BytesIO(data), RECORDS)


def test_records_that_nobody_names_are_not_made():
    stream = io.BytesIO()
    write_message(stream, Told("x", {}))
    stream.seek(0)
    with pytest.raises(KeyError):
        read_message(stream, {})


def count_up(most):
    yield from range(most)


def take_memory(size):
    yield len(bytearray(size))


def spin(_):
    while True:
        pass


LIMITS = ChildLimits(5.0, 5.0, 100e6)


@pytest.fixture
def child(children, monkeypatch):
    monkeypatch.syspath_prepend(str(__file__).rpartition("/")[0])
    return lambda name, work, limits=LIMITS: ReadingChild(f"test_message:{name}", work, limits)


def test_a_child_gives_its_pieces(child):
    reading = child("count_up", 4)
    assert list(reading) == [0, 1, 2, 3]
    assert reading.is_done


@pytest.mark.skipif(sys.platform != "linux", reason="limits are those of Linux")
def test_a_child_that_takes_too_much_is_ended(child):
    with pytest.raises(InputError) as caught:
        list(child("take_memory", 2_000_000_000))
    assert caught.value.option == "max_memory"
    assert caught.value.limit == 100e6
    reading = child("spin", 0, ChildLimits(0.3, 5.0, 100e6))
    assert list(reading) == []
    assert reading.has_hung
    assert not reading.is_done
