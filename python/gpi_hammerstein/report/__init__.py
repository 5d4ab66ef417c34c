"""One self-contained page that says what a record's model lacks.

Everything is in the one HTML file: no network, no script from elsewhere. Pictures are SVG by Matplotlib, the
library that draws all other pictures too; their black follows the page, dark or light.
"""

from gpi_hammerstein.report.page import report_html, write_report

__all__ = ["report_html", "write_report"]
