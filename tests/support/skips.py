"""Why tests skip: what a machine lacks, said at the end with how to get it."""

import re
from collections import Counter
from dataclasses import dataclass


@dataclass(frozen=True)
class Want:
    """
    Something that tests need.

    Parameters
    ----------
    what : str
        In words.
    reasons : str
        A pattern of the reasons for which tests skip that lack it.
    remedy : str
        How to get it; nothing where there is no way here.
    """

    what: str
    reasons: str
    remedy: str


WANTS = {
    "opengl": Want(
        "OpenGL",
        "no OpenGL|moderngl",
        "apt install libegl1 libgl1 libgl1-mesa-dri, or pip install '.[osmesa]'",
    ),
    "webgpu": Want(
        "WebGPU",
        "no WebGPU",
        "pip install '.[wgpu]', and apt install mesa-vulkan-drivers libvulkan1",
    ),
    "browser": Want("a browser", "no Chromium", "apt install chromium"),
    "axe": Want(
        "accessibility rules", "no axe-core", "pip install axe-core-python, or AXE=PATH/axe.min.js"
    ),
    "typescript": Want("TypeScript", "no TypeScript", "apt install node-typescript"),
    "window": Want("a screen for windows", "no window can be tried", "apt install xvfb xdotool"),
    "models": Want(
        "real models",
        "real model|city model",
        "they are not part of the repository; ../shared/data is where they lie",
    ),
    "peers": Want(
        "other tools to measure beside",
        "(?i)ladybug|pybdshadow|umep|solweig|pyradiance",
        "umbra bench tools says how; each needs a Python of its own; pip install pyradiance",
    ),
    "packages": Want(
        "Python packages", "could not import|not installed", "make test installs them"
    ),
}
ELSEWHERE = "Windows|depth bounds|round otherwise|one backend of several"
"""Skips that say that a test is for another system or driver: nothing is lacking."""


def find_want(reason):
    """Give the key in ``WANTS`` of what a test lacks, or why else it skips."""
    found = [key for key, want in WANTS.items() if re.search(want.reasons, reason)]
    if found:
        return found[0]
    return "elsewhere" if re.search(ELSEWHERE, reason) else "other"


def read_reason(report):
    """Give the reason of a skipped test or module."""
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
    return reason.removeprefix("Skipped: ")


def tell(reasons):
    """Give a line for each thing that is lacking: how many tests skip, and how to get it."""
    counts = Counter(map(find_want, reasons))
    lines = [
        f"{counts[key]:5} for want of {want.what}: {want.remedy}"
        for key, want in WANTS.items()
        if counts[key]
    ]
    others = Counter(reason for reason in reasons if find_want(reason) not in WANTS)
    return lines + [f"{count:5} {reason}" for reason, count in others.most_common()]


def find_unexpected(reasons, lacking):
    """Give the reasons to skip other than what a machine is known to lack."""
    known = {*lacking, "elsewhere", "peers"}
    return list(dict.fromkeys(reason for reason in reasons if find_want(reason) not in known))
