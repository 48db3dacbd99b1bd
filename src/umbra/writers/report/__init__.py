"""
The report: one HTML file that holds a whole study and asks nothing of the network.

``facts.py`` says in words what was assumed, ``tables.py``, ``comparison.py`` and
``sample_tables.py`` lay out tables; ``plan_data.py`` packs a raster and ``model_data.py`` surfaces
and points for the script, each instant as ``umbra.study.timeline`` counts it. ``page.py`` puts all
into ``assets/page.html`` with its style and script, ``markup.py`` writes the HTML of its parts.
"""

from umbra.writers.report.markup import Table
from umbra.writers.report.page import write_report

__all__ = ["Table", "write_report"]
