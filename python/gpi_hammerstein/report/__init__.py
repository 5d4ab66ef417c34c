"""One self-contained HTML page with the results of an explanation.

The HTML file contains everything: it needs no network and no external scripts. Pictures are SVG drawings of
Matplotlib. Their text and axes have the text colour of the page, which may be dark or light.
"""

from gpi_hammerstein.report.page import page_policy, report_html, write_report

__all__ = ["page_policy", "report_html", "write_report"]
