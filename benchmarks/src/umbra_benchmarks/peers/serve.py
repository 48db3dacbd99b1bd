"""A peer's side of the pipe: one request a line in, one answer a line out, both JSON."""

import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

Place = Sequence[float]


class PeerRenderer(Protocol):
    """What a peer offers: frames that are finished when a call returns."""

    name: str
    """Product and version."""
    driver: str
    """What draws for it."""

    def render(self, light: Place) -> None:
        """Draw a frame with the light at a place, and wait until it is drawn."""

    def save(self, light: Place, path: str) -> None:
        """Draw a frame with the light at a place into a PNG file."""


def serve(make: Callable[[dict[str, Any], int], PeerRenderer]) -> None:
    """
    Draw frames until the pipe is closed.

    ``open`` makes the renderer; ``render`` draws a frame for each of ``lights`` and
    says how many seconds one took, by the clock and of processors; ``save`` writes a picture.

    Parameters
    ----------
    make : callable
        Makes the renderer from a scene (``Spheres.to_dict``) and a size in pixels a side.
    """

    def open_scene(request: dict[str, Any]) -> tuple[PeerRenderer, dict[str, object]]:
        renderer = make(request["scene"], request["size"])
        return renderer, {"name": renderer.name, "driver": renderer.driver}

    answer_requests(open_scene, _draw)


def answer_requests(
    open_peer: Callable[[dict[str, Any]], tuple[Any, dict[str, object]]],
    ask: Callable[[Any, dict[str, Any]], dict[str, object]],
) -> None:
    """
    Answer requests until the pipe is closed.

    Parameters
    ----------
    open_peer : callable
        Makes what is asked from the request ``open``, and the answer to it.
    ask : callable
        Answers any other request.
    """
    # Libraries print what they like: standard output is kept for the answers.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    peer = None
    for line in sys.stdin:
        request = json.loads(line)
        answer: dict[str, object] = {}
        try:
            if request["do"] == "open":
                peer, answer = open_peer(request)
            elif peer is None:
                answer = {"error": "nothing is open"}
            else:
                answer = ask(peer, request)
        except Exception as error:  # noqa: BLE001  (told to the other side, whatever it is)
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _draw(renderer: PeerRenderer, request: dict[str, Any]) -> dict[str, object]:
    if request["do"] == "render":
        return _time(renderer, request["lights"])
    renderer.save(request["light"], request["path"])
    return {}


def _time(renderer: PeerRenderer, lights: Sequence[Place]) -> dict[str, object]:
    begun, busy = time.perf_counter(), time.process_time()
    for light in lights:
        renderer.render(light)
    seconds, busy = time.perf_counter() - begun, time.process_time() - busy
    return {"seconds": seconds / len(lights), "processor_seconds": busy / len(lights)}
