"""One self-contained HTML page of a fleet: distributions, effects, devices that stand out, trends.

The way of a table: :mod:`gpi_hammerstein.fleet` reads and judges it, :mod:`.page` collects the parts of the
page, :mod:`.distributions`, :mod:`.over_dates` and :mod:`.bars` draw, :mod:`.tables` and :mod:`.words` write,
and :mod:`.data` gives the script what it shows. The page has the policy, the style and the packing of the
report of one record.
"""

from gpi_hammerstein.report.fleet.page import fleet_html, fleet_report, write_fleet

__all__ = ["fleet_html", "fleet_report", "write_fleet"]
