"""Rule files as YAML with line numbers and checked keys; bounded in size and depth."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from umbra.errors import InputError, find_similar

__all__ = ["Block", "load_block"]


class Block:
    """
    A mapping of a YAML file, with a fixed set of keys.

    Parameters
    ----------
    path : Path
        For messages.
    node : yaml.Node
    what : str
        Name of the mapping: "the file", "check 2".
    keys : sequence of str
        Allowed keys.

    Raises
    ------
    InputError
        If it is not a mapping, or has an unknown or repeated key.
    """

    def __init__(self, path: Path, node: Any, what: str, keys: Sequence[str]) -> None:
        self.path, self.node, self.what = path, node, what
        self.values: dict[str, Any] = {}
        if node.id != "mapping":
            self.refuse(f"{what} must be keys with values", node)
        for key, value in node.value:
            name = str(key.value)
            if name not in keys:
                near = find_similar(name, keys)
                advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(keys)}"
                self.refuse(f"{what} has the unknown key '{name}'; {advice}", key)
            if name in self.values:
                self.refuse(f"{what} has the key '{name}' twice; remove one", key)
            self.values[name] = value

    def refuse(self, words: str, node: Any = None) -> NoReturn:
        """Raise the error that names file and line."""
        line = (node or self.node).start_mark.line + 1
        msg = f"{self.path.name}, line {line}: {words}"
        raise InputError(msg, path=self.path, line=line)

    def has(self, key: str) -> bool:
        """Return whether a key is present."""
        return key in self.values

    def text(self, key: str, default: str | None = None) -> str:
        """Return a value as written; required if there is no default."""
        node = self.values.get(key)
        if node is None:
            if default is None:
                self.refuse(f"{self.what} lacks '{key}'")
            return default
        if node.id != "scalar" or not node.value.strip():
            self.refuse(f"'{key}' must be one value", node)
        return str(node.value).strip()

    def number(self, key: str, default: float | None = None) -> float:
        """Return a number."""
        text = self.text(key, None if default is None else str(default))
        try:
            value = float(text)
        except ValueError:
            self.refuse(f"'{key}' must be a number; got '{text}'", self.values[key])
        if not abs(value) < float("inf"):
            self.refuse(f"'{key}' must be finite; got '{text}'", self.values[key])
        return value

    def items(self, key: str) -> list[Any]:
        """Return the nodes of a list; a single value is a list of one."""
        node = self.values.get(key)
        if node is None:
            self.refuse(f"{self.what} lacks '{key}'")
        nodes = list(node.value) if node.id == "sequence" else [node]
        if not nodes:
            self.refuse(f"'{key}' is empty", node)
        return nodes


_LARGEST = 1_000_000  # [byte]; thousands of rules


def load_block(path: Path, keys: Sequence[str]) -> Block:
    """
    Read a YAML file whose root is a mapping.

    Values stay text: YAML reads 10:00 as a sexagesimal number. Raises InputError if the file
    cannot be read or is not YAML.
    """
    import yaml  # noqa: PLC0415  (few studies have rules)

    class Loader(yaml.BaseLoader):
        """Loader without aliases, which let a small file repeat rules a million times."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                problem = "an alias (*name); write it out"
                raise yaml.composer.ComposerError(None, None, problem, self.peek_event().start_mark)
            return super().compose_node(parent, index)

    try:
        with path.open("rb") as file:  # a device has no size
            data = file.read(_LARGEST + 1)
        if len(data) > _LARGEST:
            msg = f"the rules '{path}' are larger than {_LARGEST / 1e6:g} MB; give fewer"
            raise InputError(msg, path=path)
        node = yaml.compose(data.decode("utf-8"), Loader=Loader)
    except RecursionError as error:
        msg = f"{path.name}: lists and mappings are nested too deep; rules need four levels"
        raise InputError(msg, path=path) from error
    except OSError as error:
        msg = f"cannot read the rules '{path}' ({error.strerror}); check the name"
        raise InputError(msg, path=path) from error
    except UnicodeDecodeError as error:
        msg = f"the rules '{path}' are not UTF-8 text; save them so"
        raise InputError(msg, path=path) from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error)
        msg = f"{path.name}{where}: this is not YAML ({problem}); check indents and colons"
        raise InputError(msg, path=path) from error
    if node is None:
        msg = f"the rules '{path}' are empty; give one rule at least"
        raise InputError(msg, path=path)
    return Block(path, node, "the file", keys)
