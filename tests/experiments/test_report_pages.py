"""The report as files: whole in themselves, escaped, linked, and the same tables in Markdown, in HTML and as CSV."""

import csv
import math
import re
from html.parser import HTMLParser

import matplotlib.image
import numpy as np
import pytest
import small_out
from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from synthetic_out import learning, write_runs

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.experiments.report import charts, write_report
from scla_mj.experiments.report.render import escape
from scla_mj.experiments.report.tables import Interval, Table, number, shown, write_csv
from scla_mj.experiments.statistics import Curve
from scla_mj.runs import drawing

NASTY = """1. <script>alert("1")</script> & 'a' | *b* _c_ `d` [e](f) ![g](h) &lt; \\ # {{ i }}"""
LINES = f"{NASTY}\n\n# Not a heading\n\n<b>"
COLUMNS = {"what": None, "much": 2, "95 % interval": 1, "verdict": None}
SMALL = RunConfig(brain="scla-printed", epochs=2, decisions=60, telemetry="off")
SCALAR = with_settings(SMALL, protocol="sensed-start", plasticity={"modulation": "scalar"})
EXPERIMENTS = (
    Experiment("mine", "paper", NASTY, NASTY, SMALL, (0, 1), None,
               (Target(LINES, 1, 2, "mean hits per 1000", 0.0), Target("all", 1, 2, "mean hits per 1000", 401.0))),
    Experiment("scalar", "ablation", NASTY, LINES, SCALAR, (0,), "mine"),
    *(Experiment(f"large-{n}", "world", f"{n} x {n}", "?", with_settings(SMALL, grid={"cells": (n, n)}), (0,))
      for n in range(6, 8)),
)  # fmt: skip


class Reader(HTMLParser):
    """Collects tags with their attributes, ids, the text of table cells, and checks that tags close."""

    VOID = frozenset({"meta", "br", "hr", "img", "link", "input"})

    def __init__(self, text):
        super().__init__()
        self.tags, self.ids, self.cells, self.open, self.text = [], [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in self.VOID:
            self.open.append(tag)
        if tag in ("td", "th"):
            self.cells.append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if {"td", "th"} & set(self.open):
            self.cells[-1] += data
        if "style" not in self.open:
            self.text.append(data)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    for experiment in EXPERIMENTS:
        write_runs(folder, experiment, learning(1.0))
    write_report(folder, EXPERIMENTS, command=f"scla-mj {NASTY}")
    return folder


@pytest.fixture(scope="module")
def text(out):
    return (out / "report.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(out):
    return (out / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def reader(page):
    return Reader(page)


def test_the_page_fetches_nothing_and_runs_nothing(page, reader):
    for tag, attributes in reader.tags:
        assert tag not in ("script", "link", "iframe", "object", "embed", "img", "base")
        for name, value in attributes.items():
            assert not name.startswith("on"), (tag, name)
            if name in ("src", "href", "xlink:href", "srcset", "data", "action"):
                assert value.startswith(("#", "data:image/png;base64,")), (tag, name, value)
    assert not re.search(r"@import|url\((?!#)", page)


def test_every_link_of_the_page_has_its_place_and_no_name_is_given_twice(reader):
    links = {value[1:] for _, attributes in reader.tags for name, value in attributes.items()
             if "href" in name and value[0] == "#"}  # fmt: skip
    assert {"summary", "ablations", "how-this-was-made"} <= links <= set(reader.ids)
    assert len(reader.ids) == len(set(reader.ids))


def test_clips_and_markers_of_a_chart_point_into_that_chart(page, reader):
    assert set(re.findall(r"url\(#([^)]+)\)", page)) <= set(reader.ids)


def test_special_characters_are_shown_and_not_obeyed(page, reader):
    assert "<script" not in page
    assert sum(tag in ("h1", "h2", "h3") for tag, _ in reader.tags) == 11
    assert reader.cells.count(NASTY) >= 6
    assert re.sub("\n+", " ", LINES) in reader.cells
    assert f"scla-mj {NASTY}" in "".join(reader.text)
    assert f"Mean weights at the end, {NASTY}: agreeing" in "".join(reader.text)


WORDS = st.text(st.characters(exclude_categories=("C", "Z")) | st.sampled_from("\n *_`[]()<>|~#&;!\\{}-+=:."))


@given(WORDS)
@example(NASTY)
def test_any_text_is_shown_by_markdown_as_it_is(words):
    table = f"| a |\n|---|\n| x{escape(words)}x |"
    reader = Reader(MarkdownIt("commonmark").enable(["table", "strikethrough"]).render(table))
    line = re.sub("\n+", " ", words)
    assert reader.cells == ["a", f"x{line}x"]
    assert {tag for tag, _ in reader.tags} == {"table", "thead", "tbody", "tr", "th", "td"}


def test_markdown_page_and_csv_have_the_same_tables(out, text, reader):
    rows = [line for line in text.splitlines() if line.startswith("| ") and not line.startswith("| ---")]
    cells = [cell for row in rows for cell in re.split(r"(?<!\\)\|", row)[1:-1]]
    assert [re.sub(r"\\(.)", r"\1", cell).strip() for cell in cells] == [cell.strip() for cell in reader.cells]
    tables = sorted((out / "csv").glob("table-*.csv"))
    assert len(tables) == len(re.findall(r"\*\*Table \d+\.\*\*", text))
    lengths = []
    for path in tables:
        with path.open(newline="", encoding="utf-8") as file:
            lengths.append(len(list(csv.reader(file))))
    assert sum(lengths) == len(rows)


def test_every_figure_of_the_report_is_a_file_next_to_it_with_its_data(out, text):
    links = re.findall(r"\]\((figures/[^)]+)\)", text)
    assert len(links) == text.count("**Figure ") > 5
    for link in links:
        assert matplotlib.image.imread(out / link).shape[1] == round(drawing.DPI * drawing.WIDE_MM / 25.4)
        assert (out / "csv" / f"figure-{link[8:-4]}.csv").is_file()


def test_a_verdict_is_coloured_and_a_long_table_folded_away(page):
    assert '<span class="mark good">reached</span>' in page and '<span class="mark bad">missed</span>' in page
    assert page.count("<details>") == 1
    assert "Show all" in page[page.index("The default settings") :]


def test_a_csv_holds_the_table_in_full_precision(tmp_path):
    rows = [("a", 1 / 3, Interval(0.1, 2 / 3), "reached"), ("b", None, None, None)]
    write_csv(tmp_path / "t.csv", Table("t", COLUMNS, rows))
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        read = list(csv.reader(file))
    assert read[0] == ["what", "much", "95 % interval low", "95 % interval high", "verdict"]
    assert [float(field) for field in read[1][1:4]] == [1 / 3, 0.1, 2 / 3]
    assert read[2] == ["b", "", "", "", ""]


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [(115.384, 2, "115.38"), (-0.001, 2, "0.00"), (-3.0, 1, "−3.0"), (1.08e-5, 4, "<0.0001"), (0.0, 4, "0.0000"),
     (math.nan, 2, "–"), (-math.inf, 2, "−∞"), (14, 0, "14"), (0.02, None, "0.02")],
)  # fmt: skip
def test_numbers_read_as_in_print(value, decimals, text):
    assert number(value, decimals) == text


def test_an_interval_of_one_seed_is_shown_as_absent():
    assert shown(Interval(math.nan, math.nan), 2) == shown(None, 2) == "–"
    assert shown(Interval(-1.25, 3.0), 1) == "[−1.2, 3.0]"


def test_a_chart_gives_the_same_bytes_twice(tmp_path):
    line = charts.Line(NASTY, 0, np.arange(3.0), Curve(*[np.ones(3)] * 3))
    chart = charts.draw_curves([line, line], [], y_label=NASTY)
    for kind in ("png", "svg"):
        for name in ("a", "b"):
            drawing.save(chart, tmp_path / f"{name}.{kind}", kind=kind, salt="x")
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_series_can_be_told_apart_without_colour():
    assert len({*zip(charts.SERIES, map(str, charts.DASHES), strict=True)}) == len(set(charts.SERIES)) == 8
    assert charts.DASHES[0] != charts.DASHES[1] != charts.DASHES[2] != charts.DASHES[3]


def test_the_same_runs_give_the_same_report(tmp_path):
    small_out.fill(tmp_path, [small_out.BY_NAME["random-any"]])
    reports = []
    for _ in range(2):
        write_report(tmp_path, [small_out.BY_NAME["random-any"]], command=small_out.COMMAND)
        files = [tmp_path / "report.html", *(tmp_path / "csv").iterdir(), *(tmp_path / "figures").iterdir()]
        reports.append({path.name: path.read_bytes() for path in files})
    assert reports[0] == reports[1]


def test_an_empty_out_makes_a_report_of_gaps_and_errata_alone(tmp_path):
    write_report(tmp_path / "new", small_out.EXPERIMENTS, command=small_out.COMMAND)
    text = (tmp_path / "new" / "report.md").read_text(encoding="utf-8")
    assert "**0 of 8 targets reached**, 0 missed, 8 could not be judged" in text
    assert text.count("not run") == len(small_out.EXPERIMENTS)
    assert "115 hits are 115.38" in text and "## What one dopamine must show" not in text
    assert not list((tmp_path / "new" / "figures").iterdir())


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(SclaError, match="cannot write the report"):
        write_report(tmp_path / "file", (), command=small_out.COMMAND)
