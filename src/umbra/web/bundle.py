"""
JavaScript modules as one script, for a page that needs no network.

Each module becomes a function that runs once; its imports become constants. This takes the
forms that the modules here use: ``import { a, b as c } from "./name.js";``, the same with
``export``, and ``export`` before ``const``, ``function``, ``async function`` or ``class``. Comments
on lines of their own are left out: they are a quarter of the modules.
"""

import re
from importlib.resources import files

from umbra.errors import UmbraError

__all__ = ["bundle", "read_asset"]

_IMPORT = re.compile(r"""^(import|export) \{([^}]*)\} from ["']\./(\w+)\.js["'];\n""", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:const|function|async function|class) (\w+))", re.MULTILINE)
_COMMENT = re.compile(r"^[ \t]*(?://[^\n]*|/\*\*(?:[^*]|\*(?!/))*\*/)\n", re.MULTILINE)
_OTHER = re.compile(r"^(?:import|export)\b.*", re.MULTILINE)


def bundle(name: str) -> str:
    """
    Join a module with all that it imports, directly or not.

    Parameters
    ----------
    name : str
        Of the module, without ``.js``.

    Returns
    -------
    script : str
        Its last line ends the constant ``$name``, an object of the module's exports.

    Raises
    ------
    UmbraError
        If modules import each other in a circle, or in a form that is not known.
    """
    done: dict[str, str] = {}

    def add(module: str, above: tuple[str, ...]) -> None:
        if module in above:
            msg = f"modules import each other in a circle: {' -> '.join((*above, module))}"
            raise UmbraError(msg)
        if module not in done:
            text = read_asset(f"{module}.js")
            for match in _IMPORT.finditer(text):
                add(match[3], (*above, module))
            done[module] = _wrap(module, text)

    add(name, ())
    return "\n".join(done.values())


def read_asset(name: str) -> str:
    """Read a file of this package."""
    return (files("umbra.web") / name).read_text("utf-8")


def _wrap(name: str, text: str) -> str:
    """Turn a module into a function that runs once and returns what the module exports."""
    text = _COMMENT.sub("", text)
    exports = _EXPORT.findall(text)
    text = _EXPORT.sub("", text)
    for kind, names, _ in _IMPORT.findall(text):
        exports += re.findall(r"(\w+)\s*(?:,|$)", names) if kind == "export" else []
    text = _IMPORT.sub(lambda match: f"const {{{_rename(match[2])}}} = ${match[3]};\n", text)
    unknown = _OTHER.search(text)
    if unknown:
        msg = f"{name}.js has a form of import or export that is not known: {unknown[0]}"
        raise UmbraError(msg)
    return f"const ${name} = (() => {{\n{text}return {{ {', '.join(exports)} }};\n}})();\n"


def _rename(names: str) -> str:
    """Write ``a as b`` as destructuring does: ``a: b``."""
    return re.sub(r"\s+as\s+", ": ", names)
