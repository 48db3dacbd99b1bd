"""What runs on this machine, and what to install for the rest."""

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numba
import numpy as np

from umbra import __version__
from umbra.cache import LIMIT, find_folder, measure
from umbra.machine import count_cores

__all__ = ["examine"]

_PACKAGES = ("numpy", "numba", "moderngl", "glcontext", "glfw", "imgui-bundle", "lavavu-osmesa")


def examine() -> dict[str, Any]:
    """
    Find out which devices run on this machine, and what to install for the others.

    Returns
    -------
    report : dict
        What JSON can hold, as ``umbra doctor --json`` prints it.
    """
    from umbra.gl.backends import BACKENDS  # noqa: PLC0415
    from umbra.gl.context import DRIVER, INSTALL  # noqa: PLC0415
    from umbra.gl.probe import probe  # noqa: PLC0415

    packages = {name: _find_version(name) for name in _PACKAGES}
    advice = []
    backends: dict[str, dict[str, Any]] = {}
    if packages["moderngl"] is None or packages["glcontext"] is None:
        advice.append(f"for the gl device: {INSTALL}")
    else:
        backends = {name: probe(name) for name in BACKENDS}
        if not any("reason" not in found for found in backends.values()):
            advice.append(f"for the gl device {DRIVER}")
    runs = [found for found in backends.values() if "reason" not in found]
    return {
        "umbra": __version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "cpu": {"runs": True, "cores": count_cores(), "threading": _find_threading()},
        "gl": {"runs": bool(runs), "backends": backends},
        "packages": packages,
        "cache": _find_cache(),
        "advice": advice,
    }


def _find_cache() -> dict[str, Any]:
    files, size = measure()
    return {"folder": str(find_folder()), "files": files, "bytes": size, "limit": LIMIT}


def _find_version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _find_threading() -> str:
    """Return numba's threading layer, found by a small job."""

    @numba.njit(parallel=True)
    def add(values: Any) -> None:
        for i in numba.prange(values.size):
            values[i] += 1

    try:
        add(np.zeros(4))
        return str(numba.threading_layer())
    except (ValueError, numba.NumbaError):
        return "none"
