"""
The report: one HTML file that holds a whole study and asks nothing of the network.

``timeline.py`` counts every instant at the page's resolution, of very many those that
``thinning.py`` chooses; ``facts.py`` says in words what was assumed, ``comparison.py`` and
``sample_tables.py`` lay out tables;
``plan_data.py`` packs a raster and ``model_data.py`` surfaces and points for the script.
``page.py`` puts all into ``assets/page.html`` with its style and script.
"""

from umbra.writers.report.page import write_point_report, write_report
from umbra.writers.report.table import Table

__all__ = ["Table", "write_point_report", "write_report"]
