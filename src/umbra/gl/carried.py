"""
Uniforms of fragment shaders, which software devices get as flat outputs of the vertex shader.

llvmpipe (Mesa 22) fetches each number of a uniform for each pixel by a gather, 0.35 ns a time: a
matrix and three vectors cost a picture of 1024² more than its lighting. A flat input costs nothing.
"""

import re
from collections.abc import Sequence

__all__ = ["PREFIX", "Lines", "carry_uniforms"]

PREFIX = "given_"
"""What the name of a carried uniform begins with in the vertex shader."""

_UNIFORM = re.compile(r"\s*uniform (float|int|bool|vec[234]) ([\w, ]+);")
_MAIN = re.compile(r"void main\(\) \{")
Lines = Sequence[tuple[str, str]]


def carry_uniforms(vertex: Lines, fragment: Lines) -> tuple[Lines, Lines]:
    """
    Carry a fragment shader's uniforms, numbers and vectors, through the vertex shader.

    Lines are of `load_source`. A uniform ``x`` of the fragment shader becomes ``given_x`` of the
    vertex shader, whether or not that one has an ``x``; arrays and samplers stay.
    """
    kinds: dict[str, str] = {}
    rewritten: list[tuple[str, str]] = []
    for line, place in fragment:
        found = _UNIFORM.match(line)
        if found is None:
            rewritten.append((line, place))
            continue
        for name in found[2].split(", "):
            kinds[name] = found[1]
            value = f"(flat_{name} != 0)" if found[1] == "bool" else f"flat_{name}"
            rewritten.append((f"flat in {_find_flat(found[1])} flat_{name};", place))
            rewritten.append((f"#define {name} {value}", place))
    sent = [
        (f"uniform {kind} {PREFIX}{name}; flat out {_find_flat(kind)} flat_{name};", "carried")
        for name, kind in kinds.items()
    ]
    copies = " ".join(
        f"flat_{name} = {_find_flat(kind)}({PREFIX}{name});" for name, kind in kinds.items()
    )
    begun = [(_MAIN.sub(f"void main() {{ {copies}", line), place) for line, place in vertex]
    return [*sent, *begun], rewritten


def _find_flat(kind: str) -> str:
    """Return the type that carries a uniform: there are no flat booleans."""
    return "int" if kind == "bool" else kind
