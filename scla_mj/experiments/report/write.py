"""From OUT to the report: read the runs, fill in the template, write it as Markdown and HTML, and the data with it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from scla_mj.errors import SclaError, remedy
from scla_mj.experiments import paper, scale, statistics
from scla_mj.experiments.catalogue import CATALOGUE
from scla_mj.experiments.experiment import Experiment
from scla_mj.experiments.report import charts, claims, evidence, results, verdicts
from scla_mj.experiments.report.coverage import covered
from scla_mj.experiments.report.errata import errata
from scla_mj.experiments.report.origin import origin
from scla_mj.experiments.report.provenance import provenance
from scla_mj.experiments.report.render import render_html, render_ladder, render_markdown
from scla_mj.experiments.report.study import Study, gather
from scla_mj.experiments.report.tables import CSV, FIGURES, INTERVAL, Figure, write_csv
from scla_mj.experiments.report.wording import labels, scale_text
from scla_mj.grid import PROTOCOLS
from scla_mj.runs import drawing
from scla_mj.runs.atomic import replacing

REPORT_HTML: Final = "report.html"
REPORT_MD: Final = "report.md"
LADDER_MD: Final = "ladder.md"
"""The table of the ladder and the claims made of it, for another page, such as a README."""
MADE_BY_JSON: Final = "made-by.json"
FILES_TXT: Final = "report-files.txt"
"""Which files in `csv/` and `figures/` the report made, so that the next one can take them away again."""
_OF_A_REPORT: Final = re.compile(rf"{CSV}/(table|figure)-[\w.-]+\.csv|{FIGURES}/[\w.-]+\.png")


def write_report(out: Path, experiments: Sequence[Experiment], *, command: str | None = None) -> Path:
    """Write `report.html`, `report.md`, `csv/` and `figures/` into `out` from the runs that lie there; return the page.

    `ladder.md` holds the table of the ladder once more, `made-by.json` which code wrote all this.

    The report covers `experiments` and whatever else of the catalogue has finished runs in `out`, and names the
    `command` that wrote it, if any. What is missing or unfinished is named in it and left out of its figures. Files of
    an earlier report that this one does not have are removed, others' files never. The same runs give the same report.

    Raises:
        SclaError: the folder cannot be written to.
    """
    shown = contents(gather(out, covered(out, experiments)), command)
    text, tables = render_markdown(shown)
    figures = [table for table in tables if isinstance(table, Figure)]
    own, earlier = {table.data for table in tables} | {figure.picture for figure in figures}, _listed(out)
    try:
        for folder in (CSV, FIGURES):
            (out / folder).mkdir(parents=True, exist_ok=True)
        _write(out / FILES_TXT, _lines(own | earlier))  # all of them: a stop from here on loses none
        for table in tables:
            write_csv(out / table.data, table)
        for figure in figures:
            drawing.save(figure.chart, out / figure.picture)
        _write(out / REPORT_MD, text)
        _write(out / LADDER_MD, render_ladder(shown))
        _write(out / MADE_BY_JSON, json.dumps(shown["origin"]._asdict(), indent=2) + "\n")
        _write(out / REPORT_HTML, render_html(text, figures))
        for link in earlier - own:
            (out / link).unlink(missing_ok=True)
        _write(out / FILES_TXT, _lines(own))
    except OSError as error:
        raise SclaError(f"cannot write the report: {error}; {remedy(error, folder='OUT')}") from error
    return out / REPORT_HTML


def contents(study: Study, command: str | None) -> dict[str, Any]:
    """Return what the template `report.md.j2` prints, and what it calls with the study's experiments, by name."""
    return {
        "study": study,
        "command": command,
        "protocols": PROTOCOLS,
        "catalogue": CATALOGUE,
        "printed": paper,
        "interval": INTERVAL,
        "statistics": statistics,
        "evidence": evidence,
        "results": results,
        "charts": charts,
        "claims": claims,
        "verdicts": verdicts,
        "scale": scale,
        "origin": origin(),
        "scale_text": scale_text,
        "labels": labels,
        "errata": errata,
        "provenance": provenance,
    }


def _listed(out: Path) -> set[str]:
    """Return the data files that an earlier report listed as its own; a line that leads elsewhere is none."""
    path = out / FILES_TXT
    try:
        lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    except (OSError, UnicodeDecodeError):
        return set()
    return {line for line in lines if _OF_A_REPORT.fullmatch(line)}


def _lines(links: set[str]) -> str:
    return "".join(f"{link}\n" for link in sorted(links))


def _write(path: Path, text: str) -> None:
    with replacing(path) as scratch:
        scratch.write_text(text, encoding="utf-8")
