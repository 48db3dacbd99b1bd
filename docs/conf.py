"""How Sphinx builds these pages: `make docs`."""

import umbra

project = "umbra"
author = "the umbra authors"
copyright = "the umbra authors, MIT licence"
version = release = umbra.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
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
