"""What an IFC element is called: the whole it belongs to, and the words that choose it."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from umbra.readers.extras import need

__all__ = ["Words", "count_names", "describe"]


@dataclass(frozen=True)
class Words:
    """What an element is called: the whole's name and kind, its own tags, name and kind."""

    name: str
    kind: str
    tags: tuple[str, ...]
    own_name: str
    own_kind: str


def count_names(products: Iterable[Any]) -> Counter[str]:
    """
    Count how many elements bear each name, pieces of a whole not among them.

    Parameters
    ----------
    products : iterable of ifcopenshell.entity_instance
    """
    wholes = {chain[-1].id(): chain[-1] for chain in map(_ancestors, products)}
    return Counter(whole.Name for whole in wholes.values() if whole.Name)


def describe(product: Any, uses: Counter[str]) -> Words:
    """
    Say what an element is called.

    Parameters
    ----------
    product : ifcopenshell.entity_instance
    uses : Counter of str
        How many elements bear each name; from `count_names`.

    Returns
    -------
    words : Words
    """
    element = need("ifcopenshell.util.element", "ifc", "IFC")
    chain = _ancestors(product)
    whole = chain[-1]
    name = whole.Name or f"{whole.is_a()} {whole.GlobalId}"
    if whole.Name and uses[whole.Name] > 1:
        name = f"{whole.Name} {whole.GlobalId}"
    words: list[str | None] = []
    for piece in chain:
        words += [piece.Name, piece.is_a(), piece.is_a().replace("StandardCase", "")]
        words += [getattr(piece, "PredefinedType", None), getattr(piece, "ObjectType", None)]
        words.append(getattr(element.get_type(piece), "Name", None))
        words += [getattr(material, "Name", None) for material in element.get_materials(piece)]
        words.append(piece.GlobalId)
    words.append(_find_storey(element.get_container(whole)))
    skip = {name, whole.is_a(), "NOTDEFINED", "USERDEFINED"}
    tags = tuple(dict.fromkeys(str(w) for w in words if w and w not in skip))
    return Words(name, whole.is_a(), tags, product.Name or product.GlobalId, product.is_a())


def _find_storey(container: Any) -> str | None:
    """Name the storey that holds a container: itself, or one above it."""
    seen: set[int] = set()
    while container is not None and not container.is_a("IfcBuildingStorey"):
        if container.id() in seen:  # a damaged file: it is a piece of itself
            return None
        seen.add(container.id())
        above = [r.RelatingObject for r in getattr(container, "Decomposes", ()) or ()]
        container = above[0] if above else None
    return None if container is None else container.Name


def _ancestors(product: Any) -> list[Any]:
    """Follow an element to the whole that it is a piece of; the element itself is first."""
    chain = [product]
    while True:
        relations = getattr(chain[-1], "Decomposes", ()) or ()
        above = next((r.RelatingObject for r in relations), None)
        if above is None or not above.is_a("IfcElement") or above in chain:
            return chain
        chain.append(above)
