"""Names inside OUT: the report, its twin, and the data of its figures and tables."""

from typing import Final

REPORT_HTML: Final = "report.html"
REPORT_MD: Final = "report.md"
CSV: Final = "csv"
FIGURES: Final = "figures"
FILES_TXT: Final = "report-files.txt"
"""Which files in `csv/` and `figures/` the report made, so that the next one can take them away again."""


def figure_link(key: str) -> str:
    """Return a figure's file, from OUT."""
    return f"{FIGURES}/{key}.png"


def csv_link(kind: str, key: str) -> str:
    """Return the data file of a table or figure, from OUT."""
    return f"{CSV}/{kind.lower()}-{key}.csv"
