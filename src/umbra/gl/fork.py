"""Forks of a process that has used OpenGL: they lack the driver's threads, and would hang."""

import os

from umbra.errors import UmbraError

__all__ = ["check_fork", "note_use"]

_users: set[int] = set()
"""The process that has used OpenGL; in its forks theirs is missing."""


def note_use() -> None:
    """Note that this process uses OpenGL."""
    _users.add(os.getpid())


def check_fork() -> None:
    """Raise `UmbraError` in the fork of a process that has used OpenGL."""
    if _users and os.getpid() not in _users:
        msg = (
            "this process is a fork of one that has used OpenGL, whose driver does not survive a "
            "fork; start it by multiprocessing's 'spawn', or use device='cpu'"
        )
        raise UmbraError(msg)
