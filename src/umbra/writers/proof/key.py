"""The key of a proof's plan."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from umbra.writers.paper import INK, RULE, SMALL, Paper
from umbra.writers.proof.drawing import BOUNDARY, COLORS, LAND, PROPOSAL, REPLACED, TINTS, Drawing

__all__ = ["Key", "draw_key", "list_key"]

_VERDICTS = {
    "pass": "what passes", "fail": "what fails", "unknown": "unknown", "": "judged without a limit",
}  # fmt: skip


@dataclass(frozen=True)
class Key:
    """
    A line of a key.

    Parameters
    ----------
    kind : {'area', 'mark', 'both', 'box', 'line', 'dashed', 'number'}
    words : str
    color : str
        Of areas and marks the verdict; of a number its digits.
    """

    kind: str
    words: str
    color: str


def list_key(drawing: Drawing, numbered: Sequence[str]) -> list[Key]:
    """Return what a plan's colours, lines and numbers mean."""
    areas = {verdict for _, verdict, _ in drawing.shapes}
    windows = {window[3] for window in drawing.windows}
    keys = []
    for verdict, words in _VERDICTS.items():
        if verdict in areas | windows:
            kind = "area" if verdict in areas else "mark"
            keys.append(Key("both" if verdict in areas & windows else kind, words, verdict))
    if drawing.proposal:
        keys.append(Key("box", "the proposal", PROPOSAL))
    if drawing.replaced:
        keys.append(Key("dashed", "what the proposal replaces", REPLACED))
    if drawing.buildings:
        keys.append(Key("box", "what stands around", LAND))
    if drawing.boundary:
        beside = " and ".join(label for _, label in drawing.offsets)
        keys.append(Key("line", f"the plot; dashed: {beside} from it", BOUNDARY))
    keys += [Key("line", f"line of {line.label}", INK) for line in drawing.lines]
    keys += [Key("number", name, f"{k}") for k, name in enumerate(numbered, 1)]
    return keys


def draw_key(paper: Paper, x: float, y: float, key: Key) -> None:
    """Draw a line of a key, its baseline at y."""
    color = key.color
    if not key.kind:
        pass
    elif key.kind == "number":
        paper.write(x + 0.1, y, color, SMALL, weight="bold", ha="center")
    elif key.kind in {"line", "dashed"}:
        line = paper.rule([np.array([(x, y + 0.045), (x + 0.2, y + 0.045)])], color, 1.0)
        line.set_linestyle("--" if key.kind == "dashed" else "-")
    elif key.kind == "box":
        _box(paper, x, y, color, RULE)
    else:
        if key.kind in {"area", "both"}:
            _box(paper, x, y, TINTS[color], COLORS[color])
        if key.kind in {"mark", "both"}:
            at = x + (0.06 if key.kind == "mark" else 0.1)
            shape = np.array([(at, y), (at + 0.08, y), (at + 0.04, y + 0.1)])
            paper.fill([shape], "white" if color == "unknown" else COLORS[color], COLORS[color])
    paper.write(x + 0.28, y, key.words, SMALL)


def _box(paper: Paper, x: float, y: float, color: str, edge: str) -> None:
    corners = np.array([(x, y), (x + 0.2, y), (x + 0.2, y + 0.1), (x, y + 0.1)])
    paper.fill([corners], color, edge, 0.6)
