"""
What umbra does in child processes, done in the tests' own: a child takes 0.4 to 0.9 s to start.

Whatever passes between the processes is written and read again, as it is with a child. Tests of
children, of their limits and their ends ask for the fixture ``children``; the commands that tests
start in processes of their own have children, and so do all tests of a thorough run.
"""

import io
import pickle

from umbra.readers import child
from umbra.writers import painter


def pass_on(value, records):
    """Write a value as a message, and read it."""
    stream = io.BytesIO()
    child.write_message(stream, value)
    stream.seek(0)
    return child.read_message(stream, records)


def _iterate(reading):
    """Give the pieces of a `ReadingChild`, without one."""
    module, function = child._find_target(reading._target)
    records = child.list_records(module)
    try:
        for piece in function(pass_on(reading._work, records)):
            yield pass_on(piece, records)
    except Exception as error:  # noqa: BLE001 - as of the child
        raise pass_on(error, records) from None
    reading.is_done = True


def _run_pickled(*job, run=painter._run):
    run(*pickle.loads(pickle.dumps(job)))


def read_and_draw_here(patch):
    """Have readers and painters work in this process; ``patch`` is a ``pytest.MonkeyPatch``."""
    patch.setattr(child.ReadingChild, "__iter__", _iterate)
    patch.setattr(painter.Painter, "_start", lambda *_: None)
    patch.setattr(painter, "_run", _run_pickled)


_WITH_CHILDREN = [
    (child.ReadingChild, "__iter__", child.ReadingChild.__iter__),
    (painter.Painter, "_start", painter.Painter._start),
    (painter, "_run", painter._run),
]


def restore_children(patch):
    """Undo this for a test."""
    for where, name, value in _WITH_CHILDREN:
        patch.setattr(where, name, value)
