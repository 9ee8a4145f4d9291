"""From OUT to the report: read the runs, lay out the chapters, write them down twice, and their data beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scla_mj.errors import SclaError
from scla_mj.experiments.catalogue.experiment import Experiment
from scla_mj.experiments.report import charts, names
from scla_mj.experiments.report.cells import write_csv
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


def write_report(out: Path, experiments: Sequence[Experiment], *, command: str) -> Path:
    """Write `report.html`, `report.md`, `csv/` and `figures/` into `out` from the runs that lie there; return the page.

    What is missing or unfinished in `out` is named in the report and left out of its figures. The same runs give the
    same report.

    Raises:
        SclaError: the folder cannot be written to.
    """
    document = lay_out(gather(out, experiments), command)
    try:
        for folder in (names.CSV, names.FIGURES):
            (out / folder).mkdir(parents=True, exist_ok=True)
        _write_data(out, document)
        (out / names.REPORT_MD).write_text(render_markdown(document), encoding="utf-8")
        (out / names.REPORT_HTML).write_text(render_html(document), encoding="utf-8")
    except OSError as error:
        raise SclaError(f"cannot write the report: {error}; free the disk or choose another OUT") from error
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


def _write_data(out: Path, document: Document) -> None:
    for block in document.blocks():
        if isinstance(block, Table | Figure):
            write_csv(out / names.csv_link(type(block).__name__, block.key), block.columns, block.rows)
        if isinstance(block, Figure):
            charts.save(block.chart, str(out / names.figure_link(block.key)), kind="png", salt=block.key)
