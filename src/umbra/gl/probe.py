"""
What one backend has, found out in a child process, which prints JSON.

Contexts of several kinds in one process disturb each other, and a driver that crashes
must not take the asker with it.
"""

import json
import subprocess
import sys
from typing import Any

from umbra.children import HOME, make_command
from umbra.errors import UmbraError
from umbra.gl.context import open_device
from umbra.gl.target import Target

__all__ = ["probe", "tell"]

_SECONDS = 60


def probe(backend: str) -> dict[str, Any]:
    """
    Find out what a backend of ``BACKENDS`` has.

    Returns
    -------
    facts : dict
        ``version``, ``vendor``, ``renderer``, ``is_software``, ``stencil_bits``,
        ``depth_bounds`` and ``timer_queries``; or the ``reason`` why it does not run.
    """
    command = make_command("from umbra.gl.probe import tell; tell()", backend)
    try:
        done = subprocess.run(
            command, cwd=HOME, capture_output=True, text=True, check=False, timeout=_SECONDS
        )
    except subprocess.TimeoutExpired:
        return {"reason": f"it does not answer within {_SECONDS} s"}
    try:
        return dict(json.loads(done.stdout))
    except ValueError:
        last = done.stderr.strip().splitlines()[-1:] or [f"status {done.returncode}"]
        return {"reason": f"its driver ended the process: {last[0]}"}


def _find_facts(backend: str) -> dict[str, Any]:
    """Open the backend here, and ask."""
    try:
        with open_device(backend) as device, Target(device, (16, 16)) as target:
            return {
                "version": device.version,
                "vendor": device.vendor,
                "renderer": device.renderer,
                "is_software": device.is_software,
                "stencil_bits": target.stencil_bits(),
                "depth_bounds": device.has_depth_bounds,
                "timer_queries": device.has_timer_queries,
            }
    except UmbraError as error:
        reasons: Any = error.data.get("reasons", [str(error)])
        return {"reason": str(reasons[0]).removeprefix(f"{backend}: ")}


def tell() -> None:
    """Print the facts of the backend that the command names."""
    sys.stdout.write(json.dumps(_find_facts(sys.argv[1])))
