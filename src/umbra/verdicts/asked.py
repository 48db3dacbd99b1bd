"""Which receivers a requirement asks of, and of which flat and room they are."""

import re
from collections.abc import Collection

from umbra.rules.record import Requirement
from umbra.verdicts.subjects import Subjects

__all__ = ["choose_asked", "find_flat_room", "tell_choice"]


def choose_asked(subjects: Subjects, requirement: Requirement) -> list[int]:
    """Return the indices of the receivers that a rule asks of."""
    chosen = list(range(len(subjects)))
    if subjects.kind != "windows":
        return chosen
    if requirement.facing is not None:
        low, high = requirement.facing
        chosen = [k for k in chosen if low - 1e-6 <= subjects.azimuths[k] % 360 <= high + 1e-6]
    if requirement.rooms and any(subjects.rooms):
        chosen = [k for k in chosen if _is_called(subjects.rooms[k], requirement.rooms)]
    return chosen


def find_flat_room(
    subjects: Subjects, k: int, flats: set[str], requirement: Requirement
) -> tuple[str, str]:
    """
    Return the flat and room of a receiver that a share of flats asks of; empty of others.

    An area may be called as the flat (of ``flats``) whose private open space it is.
    """
    flat, room = subjects.flats[k], _fold(subjects.rooms[k])
    if subjects.kind == "areas":
        flat = flat or (subjects.names[k] if subjects.names[k] in flats else "")
        room = room or "balcony"
    is_asked = bool(flat) and (not requirement.rooms or room in requirement.rooms)
    return (flat, room) if is_asked else ("", "")


def tell_choice(requirement: Requirement) -> str:
    """Describe the receivers that are asked of."""
    words = []
    if requirement.facing is not None:
        words.append("windows that face {:g} to {:g} degrees".format(*requirement.facing))
    if requirement.rooms:
        words.append(f"rooms {', '.join(requirement.rooms)}")
    return " and ".join(words)


def _is_called(room: str, asked: Collection[str]) -> bool:
    """Return whether a room is asked of, with or without a number in brackets at its end."""
    return _fold(room) in asked or _fold(re.sub(r"\([^()]*\)\s*$", "", room)) in asked


def _fold(room: str) -> str:
    """Return the name of a room as rules write it."""
    return room.strip().casefold()
