"""
Features available on this machine, and the packages that the others need.

Each OpenGL backend is probed in a child process, which prints JSON: different contexts in one
process disturb each other, and a crashing driver must not end the caller.
"""

import json
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from umbra.cache import LIMIT, find_doubt, find_folder, measure_cache
from umbra.errors import UmbraError
from umbra.gl.context import open_device
from umbra.gl.target import Target
from umbra.machine import HOME, count_cores, make_command
from umbra.packages import write_install
from umbra.registry import Offer, Registry
from umbra.version import __version__

__all__ = ["examine", "list_offers", "probe", "tell"]

_PACKAGES = ("numpy", "numba", "moderngl", "glcontext", "glfw", "imgui-bundle", "lavavu-osmesa")
_SECONDS = 60


def examine() -> dict[str, Any]:
    """
    Find the devices that run on this machine, and the packages for the others.

    Returns
    -------
    report : dict
        JSON data, as ``umbra doctor --json`` prints it.
    """
    from umbra.gl.backends import BACKENDS  # noqa: PLC0415
    from umbra.gl.context import tell_driver  # noqa: PLC0415

    packages = {name: _find_version(name) for name in _PACKAGES}
    advice = []
    backends: dict[str, dict[str, Any]] = {}
    if packages["moderngl"] is None or packages["glcontext"] is None:
        advice.append(f"for the gl device: {write_install('gl')}")
    else:
        backends = {name: probe(name) for name in BACKENDS}
        if not any("reason" not in backend for backend in backends.values()):
            advice.append(f"for the gl device {tell_driver()}")
    if doubt := find_doubt(find_folder()):
        advice.append(
            f"for the cache, a folder of your own: '{find_folder()}' is not used, as {doubt} "
            "(UMBRA_CACHE names another; chmod 700 keeps others out of yours)"
        )
    runs = [backend for backend in backends.values() if "reason" not in backend]
    return {
        "umbra": __version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "cpu": {"runs": True, "cores": count_cores()},
        "gl": {"runs": bool(runs), "backends": backends},
        "packages": packages,
        "added": [asdict(offer) for offer in list_offers()],
        "cache": _find_cache(),
        "advice": advice,
    }


def list_offers() -> list[Offer]:
    """List what packages installed beside umbra offer, and why some of it cannot be used."""
    from umbra import devices, receivers  # noqa: PLC0415 - the checks of drivers need none
    from umbra.readers import added, formats  # noqa: PLC0415
    from umbra.study.measures import MEASURES  # noqa: PLC0415
    from umbra.writers import folder, outputs  # noqa: PLC0415

    endings = [ending.removeprefix(".") for ending in formats.BY_ENDING]
    taken: list[tuple[Registry[Any], Sequence[str]]] = [
        (MEASURES, ()),
        (receivers.REGISTRY, ("auto",)),
        (devices.REGISTRY, devices.CHOICES),
        (added.REGISTRY, endings),
        (outputs.REGISTRY, folder.NAMES),
    ]
    return [offer for registry, own in taken for offer in registry.list_offers(own)]


def _find_cache() -> dict[str, Any]:
    files, size = measure_cache()
    return {"folder": str(find_folder()), "files": files, "bytes": size, "limit": LIMIT}


def _find_version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def probe(backend: str) -> dict[str, Any]:
    """
    Inspect a backend of ``BACKENDS``.

    Returns
    -------
    facts : dict
        ``version``, ``vendor``, ``renderer``, ``is_software``, ``stencil_bits``,
        ``depth_bounds`` and ``timer_queries``; or the ``reason`` why it does not run.
    """
    command = make_command("from umbra.calls.doctor import tell; tell()", backend)
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
    """Open the backend in this process and query it."""
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
