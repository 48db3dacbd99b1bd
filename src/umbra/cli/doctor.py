"""``umbra doctor``: what runs on this machine, and what to install for the rest."""

from importlib.metadata import PackageNotFoundError, version
from typing import Any

import click

from umbra import __version__
from umbra.cli.terminal import echo, echo_json

__all__ = ["command"]

_PACKAGES = ("numpy", "numba", "moderngl", "glcontext", "glfw", "imgui-bundle", "lavavu-osmesa")


@click.command("doctor")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(as_json: bool) -> None:
    """
    Say which devices run on this machine, and what to install for the others.

    \b
    Example:
    umbra doctor
    """  # noqa: D301  (click asks for a real backspace)
    report = _examine()
    if as_json:
        echo_json(report)
        return
    cpu, gl = report["cpu"], report["gl"]
    echo(f"umbra {report['umbra']}, Python {report['python']}, {report['system']}")
    echo(f"cpu  runs, {cpu['cores']} cores, threads by {cpu['threading']}")
    echo(f"gl   {'runs' if gl['runs'] else 'does not run'}")
    for name, found in gl["backends"].items():
        if "reason" in found:
            echo(f"     {name:8}{found['reason']}")
            continue
        echo(f"     {name:8}OpenGL {found['version']}, {found['renderer']}")
        echo(
            f"             {'software' if found['is_software'] else 'hardware'}, "
            f"{found['stencil_bits']} stencil bits, "
            f"depth bounds {'yes' if found['depth_bounds'] else 'no'}, "
            f"timer queries {'yes' if found['timer_queries'] else 'no'}"
        )
    packages = [f"{name} {found or '-'}" for name, found in report["packages"].items()]
    echo(f"     {', '.join(packages)}")
    cache = report["cache"]
    echo(
        f"cache {cache['folder']}, {cache['files']} files, {cache['bytes'] / 1e6:.1f} MB of at "
        f"most {cache['limit'] / 1e6:.0f} (remove it to clear it; UMBRA_CACHE names another)"
    )
    for advice in report["advice"]:
        echo(f"To do: {advice}")


def _examine() -> dict[str, Any]:
    """Find out what the command prints."""
    import platform  # noqa: PLC0415

    from umbra.gl.backends import BACKENDS, probe  # noqa: PLC0415
    from umbra.gl.context import DRIVER, INSTALL  # noqa: PLC0415
    from umbra.machine import count_cores  # noqa: PLC0415

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
    from umbra.cache import LIMIT, find_folder, measure  # noqa: PLC0415

    files, size = measure()
    return {"folder": str(find_folder()), "files": files, "bytes": size, "limit": LIMIT}


def _find_version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _find_threading() -> str:
    """Give numba's threading layer, as a small job has it."""
    import numba  # noqa: PLC0415
    import numpy as np  # noqa: PLC0415

    @numba.njit(parallel=True)
    def add(values: Any) -> None:
        for i in numba.prange(values.size):
            values[i] += 1

    try:
        add(np.zeros(4))
        return str(numba.threading_layer())
    except (ValueError, numba.NumbaError):
        return "none"
