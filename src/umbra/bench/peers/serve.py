"""A peer's side of the pipe: one request a line in, one answer a line out, both JSON."""

import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

Place = Sequence[float]


class Renderer(Protocol):
    """What a peer offers: frames that are finished when a call returns."""

    name: str
    """Product and version."""
    driver: str
    """What draws for it."""

    def render(self, light: Place) -> None:
        """Draw a frame with the light at a place, and wait until it is drawn."""

    def save(self, light: Place, path: str) -> None:
        """Draw a frame with the light at a place into a PNG file."""


def serve(make: Callable[[dict[str, Any], int], Renderer]) -> None:
    """
    Answer requests until the pipe is closed.

    ``open`` makes the renderer; ``render`` draws a frame for each of ``lights`` and
    says how many seconds one took, by the clock and of processors; ``save`` writes a picture.

    Parameters
    ----------
    make : callable
        Gives the renderer of a scene (``Spheres.to_dict``) at so many pixels a side.
    """
    # Libraries print what they like: standard output is kept for the answers.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    renderer: Renderer | None = None
    for line in sys.stdin:
        request = json.loads(line)
        answer: dict[str, object] = {}
        try:
            if request["do"] == "open":
                renderer = make(request["scene"], request["size"])
                answer = {"name": renderer.name, "driver": renderer.driver}
            elif renderer is None:
                answer = {"error": "nothing is open"}
            elif request["do"] == "render":
                answer = _time(renderer, request["lights"])
            else:
                renderer.save(request["light"], request["path"])
        except Exception as error:  # noqa: BLE001  (told to the other side, whatever it is)
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _time(renderer: Renderer, lights: Sequence[Place]) -> dict[str, object]:
    begun, busy = time.perf_counter(), time.process_time()
    for light in lights:
        renderer.render(light)
    seconds, busy = time.perf_counter() - begun, time.process_time() - busy
    return {"seconds": seconds / len(lights), "processor_seconds": busy / len(lights)}
