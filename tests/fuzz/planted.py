"""A reader with faults, by which the tests judge the runner."""

import ctypes
import random
import tempfile
import time
from functools import cache
from pathlib import Path

from fuzz.seeds import make_seeds


@cache
def whole_files():
    with tempfile.TemporaryDirectory() as folder:
        return frozenset(make_seeds(Path(folder)).values())


def judge(path):
    data = path.read_bytes()
    if data in whole_files():
        return ""
    fault = random.Random(data).randrange(9)
    if fault == 0:
        msg = "planted"
        raise AttributeError(msg)
    if fault == 1:
        ctypes.string_at(0)
    if fault == 2:
        while True:
            time.process_time()
    return "" if fault < 5 else "refused"
