"""Values derived from a scene or a caster, kept with it for later studies: bounded, thread-safe."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import TypeVar, cast

__all__ = ["derive"]

T = TypeVar("T")

_NAME = "_derived"
_lock = Lock()


def derive(
    owner: object,
    kind: str,
    key: Hashable,
    make: Callable[[], T],
    most: int = 2,
    fits: Callable[[T], bool] = lambda _: True,
) -> T:
    """
    Return a value derived from a frozen record; make it once and keep it while the record lives.

    Values are identified by their kind and a key of their other inputs, and are read only; the
    ``most`` recently used of each kind are kept, of those that ``fits`` calls small enough.
    ``dataclasses.replace`` makes a record without any. Two threads may both make a value at once;
    one of the two is kept.
    """
    with _lock:
        held: OrderedDict[Hashable, object]
        held = owner.__dict__.setdefault(_NAME, {}).setdefault(kind, OrderedDict())
        if key in held:
            held.move_to_end(key)
            return cast("T", held[key])
    value = make()
    if not fits(value):
        return value
    with _lock:
        value = cast("T", held.setdefault(key, value))
        held.move_to_end(key)
        while len(held) > most:
            held.popitem(last=False)
    return value
