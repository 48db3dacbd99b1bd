"""
The report: one HTML file that holds a whole study and asks nothing of the network.

``timeline.py`` counts every instant at the page's resolution, ``facts.py`` says in
words what was assumed, ``page.py`` puts both into ``page.html`` with its style and
script.
"""

from umbra.writers.report.page import write_report
from umbra.writers.report.table import Table

__all__ = ["Table", "write_report"]
