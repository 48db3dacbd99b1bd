"""One HTML file of a live model: its modules, style, settings and packed model, without network."""

import base64
import hashlib
import re
from collections.abc import Mapping
from html import escape

import orjson

from umbra.web.bundle import bundle, read_asset

__all__ = ["make_page", "make_policy"]

_WHOLE = "html, body { margin: 0; height: 100%; }\n#umbra { height: 100vh; height: 100dvh; }\n"


def make_page(block: bytes, config: Mapping[str, object], version: str) -> str:
    """
    Make the page.

    Parameters
    ----------
    block : bytes
        The model, from `pack_model`.
    config : mapping
        As ``Config`` of ``app.js``.
    version : str
        Of umbra.

    Returns
    -------
    page : str
        HTML, for any browser since 2023 with WebGL2; others show the config's poster.
    """
    style = _WHOLE + read_asset("page.css")
    script = bundle("page") + "\nglobalThis.umbra = await $page.show();"
    parts = {
        "policy": escape(make_policy(style, script)),
        "version": escape(version),
        "title": escape(str(config["title"])),
        "style": style,
        # No data can end the script element that holds it.
        "config": orjson.dumps(config).decode().replace("<", "\\u003c"),
        "block": base64.b64encode(block).decode(),
        "script": script,
    }
    # One pass: inserted text is never searched again.
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], read_asset("page.html"))


def make_policy(style: str, script: str) -> str:
    """
    Allow a page's own style and script, by their hashes, and pictures that it holds.

    All else is refused: other scripts, the network, frames, plug-ins, forms, and a base
    that would turn addresses elsewhere.
    """
    own = {}
    for what, text in (("style", style), ("script", script)):
        digest = hashlib.sha256(f"\n{text}\n".encode()).digest()  # as it stands in the page
        own[what] = f"'sha256-{base64.b64encode(digest).decode()}'"
    return (
        f"default-src 'none'; script-src {own['script']}; style-src {own['style']}; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
