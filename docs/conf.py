"""How Sphinx builds these pages: `make docs`."""

import subprocess
import sys
from pathlib import Path

import umbra

project = "umbra"
author = "the umbra authors"
copyright = "the umbra authors, MIT licence"
version = release = umbra.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
# Notebooks are kept without outputs and run when these pages are built.
nb_execution_mode = "auto"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]

autodoc_typehints = "none"  # the docstrings give shape, type and unit
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = "umbra"
html_show_sourcelink = False
html_show_copyright = False


def write_live_page(app, error):
    """Write the live page that the front page frames beside it, once all pages are there."""
    if error is not None or app.builder.format != "html":
        return
    quarter = Path(app.outdir, "city_block.city.json")
    script = Path(app.srcdir).parent / "examples" / "city_block.py"
    subprocess.run([sys.executable, script, quarter], check=True, stdout=subprocess.DEVNULL)
    scene = umbra.read(quarter)
    umbra.show(
        scene,
        umbra.find_site(scene),
        date="2026-03-21",
        at="09:00",
        out=quarter.with_name("quarter.html"),
    )


def setup(app):
    """Called by Sphinx."""
    app.connect("build-finished", write_live_page)
