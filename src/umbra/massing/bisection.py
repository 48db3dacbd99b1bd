"""The greatest height of a part of the model, by bisection with exact studies."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.rules import Rule
from umbra.scene import Mesh, Part, Scene
from umbra.verdicts.judge import Finding, judge_rules

__all__ = ["PartHeight", "scale_part", "search_part_height"]

_STEP = 0.01  # [m]
_SAME = 1e-4  # of values that have not changed

Gather = Callable[[Scene], Any]
Key = tuple[str, str, str, str, str]


@dataclass(frozen=True, eq=False)
class PartHeight:
    """
    The greatest height of a part that keeps rules.

    Parameters
    ----------
    part : str
        Pattern of its name.
    height_m : float
        Whole centimetres above its base; 0 if none keeps them [m].
    is_capped : bool
        Whether it is the cap.
    binding : tuple of str
        What breaks a centimetre higher.
    broken : tuple of str
        What is broken without the part: nothing is taken from it.
    studies : int
        Number of heights that were judged.
    scene : Scene
        With the part at this height.
    """

    part: str
    height_m: float
    is_capped: bool
    binding: tuple[str, ...]
    broken: tuple[str, ...]
    studies: int
    scene: Scene

    def sum_up(self) -> dict[str, Any]:
        """Return the numbers as plain values, for JSON."""
        return {
            "part": self.part, "max_height_m": self.height_m, "capped": self.is_capped,
            "binding": list(self.binding), "broken_before": list(self.broken),
            "violations": 0, "studies": self.studies,
        }  # fmt: skip


def scale_part(scene: Scene, parts: Sequence[int], height: float) -> Scene:
    """Return a scene with some parts scaled vertically from their base to a height [m]."""
    soup = scene.triangles(parts)
    z = soup.vertices[soup.faces][..., 2]
    base, top = float(z.min()), float(z.max())
    if top - base < _STEP:
        msg = "the part is flat; give one with a height, to be scaled from its base"
        raise InputError(msg, option="max_height")
    changed = list(scene.parts)
    for k in parts:
        own = scene.triangles([k])
        vertices = np.array(own.vertices)
        vertices[:, 2] = base + (vertices[:, 2] - base) * (height / (top - base))
        old = scene.parts[k]
        changed[k] = Part(
            old.name, old.kind, Mesh(vertices, own.faces), layer=old.layer, material=old.material
        )
    return replace(scene, parts=tuple(changed))


def search_part_height(
    scene: Scene,
    pattern: str,
    rules: Sequence[Rule],
    gather: Gather,
    highest: float,
) -> PartHeight:
    """
    Find the greatest height of a part, in centimetres, at which all rules are kept.

    Shadows of a solid that stands on its base grow with its height, so that heights below one that
    keeps the rules keep them, too.

    Parameters
    ----------
    scene : Scene
    pattern : str
        Of the part's name.
    rules : sequence of Rule
    gather : callable
        Returns what rules judge of a scene (``umbra.verdicts.Gathered``).
    highest : float
        Height that is not exceeded [m].

    Raises
    ------
    InputError
        If there is no such part, it is flat, or a verdict is unknown.
    """
    parts = scene.select((pattern,), option="max_height")
    studies = 0

    def judge(steps: int) -> dict[Key, Finding]:
        nonlocal studies
        studies += 1
        gathered = gather(scale_part(scene, parts, max(steps * _STEP, 1e-6)))
        verdicts = judge_rules(gathered, [[rule] for rule in rules])
        findings: dict[Key, Finding] = {}
        for result in (finding for verdict in verdicts for finding in verdict.findings):
            date = str(getattr(result.outcome, "date", ""))
            findings[result.rule.name, result.check, result.kind, result.where, date] = result
        return findings

    before = judge(0)
    for key, finding in before.items():
        if finding.verdict == "unknown":
            msg = f"rule '{key[0]}', {key[1]}: {finding.outcome.needs}"
            raise InputError(msg, option="rules")
    broken = {key for key, finding in before.items() if finding.verdict == "fail"}

    def list_breaches(steps: int) -> list[str]:
        breaches = []
        for key, finding in judge(steps).items():
            if key in broken or key not in before:
                value, had = (
                    finding.outcome.value,
                    before[key].outcome.value if key in before else None,
                )
                lost = value is None or had is None or abs(value - had) > _SAME
                fails = lost and finding.verdict != "pass"
            else:
                fails = finding.verdict == "fail"
            if fails:
                breaches.append(f"{key[3]} ({key[1]})")
        return breaches

    low, high = 0, int(np.floor(highest / _STEP + 1e-9))
    binding = list_breaches(high)
    is_capped = not binding
    if is_capped:
        low = high
    while high - low > 1:
        middle = (low + high) // 2
        breaches = list_breaches(middle)
        if breaches:
            high, binding = middle, breaches
        else:
            low = middle
    height = round(low * _STEP, 2)
    return PartHeight(
        pattern, height, is_capped, tuple(dict.fromkeys(binding)),
        tuple(f"{key[3]} ({key[1]})" for key in sorted(broken)), studies,
        scale_part(scene, parts, max(height, 1e-6)),
    )  # fmt: skip
