"""From OUT to the report: read the runs, lay out the chapters, write them down twice, and their data beside them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from scla_mj.errors import SclaError, remedy
from scla_mj.experiments.catalogue.experiment import Experiment
from scla_mj.experiments.report import charts, names
from scla_mj.experiments.report.cells import write_csv
from scla_mj.experiments.report.coverage import covered
from scla_mj.experiments.report.document import Document, Figure, Table
from scla_mj.experiments.report.evidence import Study, gather
from scla_mj.experiments.report.html import render_html
from scla_mj.experiments.report.markdown import render_markdown
from scla_mj.experiments.report.sections.ablations import ablations
from scla_mj.experiments.report.sections.brains import brains
from scla_mj.experiments.report.sections.errata import errata
from scla_mj.experiments.report.sections.making import making
from scla_mj.experiments.report.sections.paper_results import paper_results
from scla_mj.experiments.report.sections.policies import policies
from scla_mj.experiments.report.sections.summary import summary
from scla_mj.experiments.report.sections.worlds import worlds
from scla_mj.runs.atomic import replacing

_OF_A_REPORT: Final = re.compile(rf"{names.CSV}/(table|figure)-[\w.-]+\.csv|{names.FIGURES}/[\w.-]+\.png")


def write_report(out: Path, experiments: Sequence[Experiment], *, command: str) -> Path:
    """Write `report.html`, `report.md`, `csv/` and `figures/` into `out` from the runs that lie there; return the page.

    The report covers `experiments` and whatever else of the catalogue has finished runs in `out`. What is missing or
    unfinished is named in it and left out of its figures. Files of an earlier report that this one does not have are
    removed, others' files never. The same runs give the same report.

    Raises:
        SclaError: the folder cannot be written to.
    """
    document = lay_out(gather(out, covered(out, experiments)), command)
    own, earlier = _data_files(document), _listed(out)
    try:
        for folder in (names.CSV, names.FIGURES):
            (out / folder).mkdir(parents=True, exist_ok=True)
        _write_text(out / names.FILES_TXT, _lines(own | earlier))  # all of them: a stop from here on loses none
        _write_data(out, document)
        _write_text(out / names.REPORT_MD, render_markdown(document))
        _write_text(out / names.REPORT_HTML, render_html(document))
        for link in earlier - own:
            (out / link).unlink(missing_ok=True)
        _write_text(out / names.FILES_TXT, _lines(own))
    except OSError as error:
        raise SclaError(f"cannot write the report: {error}; {remedy(error, folder='OUT')}") from error
    return out / names.REPORT_HTML


def lay_out(study: Study, command: str) -> Document:
    """Return the report as a document."""
    sections = (
        summary(study),
        paper_results(study),
        brains(study),
        policies(study),
        worlds(study),
        ablations(study),
        errata(),
        making(study, command),
    )
    lead = (
        "Spiking-based cellular learning automata on a robot that drives: the paper's experiment, its bounds, its "
        "rivals, harder worlds, and what each part is worth. Every figure is computed from the runs beside this page."
    )
    return Document("SCLA, embodied: the experiment", lead, sections)


def _data_files(document: Document) -> set[str]:
    """Return the files of a report's tables and figures, from OUT."""
    shown = [block for block in document.blocks() if isinstance(block, Table | Figure)]
    figures = {names.figure_link(block.key) for block in shown if isinstance(block, Figure)}
    return figures | {names.csv_link(type(block).__name__, block.key) for block in shown}


def _listed(out: Path) -> set[str]:
    """Return the data files that an earlier report listed as its own; a line that leads elsewhere is none."""
    path = out / names.FILES_TXT
    try:
        lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    except (OSError, UnicodeDecodeError):
        return set()
    return {line for line in lines if _OF_A_REPORT.fullmatch(line)}


def _lines(links: set[str]) -> str:
    return "".join(f"{link}\n" for link in sorted(links))


def _write_text(path: Path, text: str) -> None:
    with replacing(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def _write_data(out: Path, document: Document) -> None:
    for block in document.blocks():
        if isinstance(block, Table | Figure):
            write_csv(out / names.csv_link(type(block).__name__, block.key), block.columns, block.rows)
        if isinstance(block, Figure):
            charts.save(block.chart, str(out / names.figure_link(block.key)), kind="png", salt=block.key)
