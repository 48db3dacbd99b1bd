"""``umbra doctor``: what runs on this machine, and what to install for the rest."""

import click

from umbra.cli.terminal import echo, echo_json

__all__ = ["command"]


@click.command("doctor")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(as_json: bool) -> None:
    """
    Show which devices work on this machine, and what to install for the others.

    \b
    Example:
    umbra doctor
    """  # noqa: D301  (click asks for a real backspace)
    from umbra.calls.doctor import examine  # noqa: PLC0415

    report = examine()
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
