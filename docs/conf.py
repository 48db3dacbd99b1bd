"""How Sphinx builds these pages: `make docs`."""

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
