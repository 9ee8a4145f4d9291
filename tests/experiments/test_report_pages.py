"""The page and its twin as files: whole in themselves, escaped, linked, and the same tables in both and in the CSV."""

import csv
import math
import re
from html.parser import HTMLParser

import matplotlib.image
import pytest

from scla_mj.experiments.report import charts
from scla_mj.experiments.report.cells import number, shown, write_csv
from scla_mj.experiments.report.document import (
    Bullets,
    Code,
    Column,
    Document,
    Figure,
    Interval,
    Listing,
    Mark,
    Paragraph,
    Section,
    Strong,
    Table,
)
from scla_mj.experiments.report.html import render_html
from scla_mj.experiments.report.markdown import escape, render_markdown

NASTY = """<script>alert("1")</script> & 'a' | *b* _c_ `d` [e](f) #g"""
COLUMNS = (Column("what"), Column("much", 2), Column("95 % interval", 1), Column("verdict"))
ROWS = (
    (NASTY, 1234.5, Interval(-1.25, 3.0), Mark("reached", "good")),
    ("b", None, Interval(math.nan, math.nan), Mark("missed", "bad")),
    ("c", math.inf, None, None),
)


@pytest.fixture(scope="module")
def document():
    line = charts.Line(NASTY, *charts.style(0), *(charts.np.arange(3.0),) * 1, charts.Curve(*[charts.np.ones(3)] * 3))
    chart = charts.curves([line, line], [], y_label=NASTY)
    table, long = Table("one", NASTY, COLUMNS, ROWS), Table("two", "folded", COLUMNS, ROWS, long=True)
    figure = Figure("three", ("see ", Code("a<b"), Strong("&")), chart, (Column("x", 0),), ((1,),))
    other = Figure("four", "again", chart, (Column("x", 0),), ((1,),))
    blocks = (Paragraph(NASTY), Bullets((NASTY, ("x", Code("y")))), Listing("a && b < c"), table, long, figure, other)
    return Document(NASTY, NASTY, (Section("first", NASTY, blocks), Section("second", "Second", ())))


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
        if tag == "td":
            self.cells.append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "td" in self.open:
            self.cells[-1] += data
        if "style" not in self.open:
            self.text.append(data)


@pytest.fixture(scope="module")
def page(document):
    return render_html(document)


@pytest.fixture(scope="module")
def reader(page):
    return Reader(page)


def test_the_page_fetches_nothing_and_runs_nothing(page, reader):
    for tag, attributes in reader.tags:
        assert tag not in ("script", "link", "iframe", "object", "embed", "img", "base")
        for name, value in attributes.items():
            assert not name.startswith("on"), (tag, name)
            if name in ("src", "href", "xlink:href", "srcset", "data", "action"):
                assert value.startswith("#"), (tag, name, value)
    assert not re.search(r"@import|url\((?!#)", page)


def test_every_link_of_the_page_has_its_place_and_no_name_is_given_twice(reader):
    links = {value[1:] for _, attributes in reader.tags for name, value in attributes.items() if "href" in name}
    assert {"first", "second"} <= links <= set(reader.ids)
    assert len(reader.ids) == len(set(reader.ids))


def test_clips_and_markers_of_a_chart_point_into_that_chart(page, reader):
    assert set(re.findall(r"url\(#([^)]+)\)", page)) <= set(reader.ids)


def test_special_characters_are_shown_and_not_obeyed(page, reader):
    assert "<script" not in page
    assert NASTY in "".join(reader.text)
    assert reader.cells[0] == NASTY


def test_the_page_shows_the_tables_as_the_columns_say(reader):
    assert reader.cells[1:4] == ["1234.50", "[−1.2, 3.0]", "reached"]
    assert reader.cells[4:12] == ["b", "–", "–", "missed", "c", "∞", "–", "–"]


def test_the_twin_has_the_same_tables_and_links_that_lead_to_figures(document):
    text = render_markdown(document)
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert rows[:2] == ["| what | much | 95 % interval | verdict |", "| --- | ---: | ---: | --- |"]
    assert rows[2] == f"| {escape(NASTY)} | 1234.50 | \\[−1.2, 3.0\\] | reached |"
    assert len(rows[2].replace("\\|", "").split("|")) == 6
    assert re.findall(r"\]\((figures/[^)]+)\)", text) == ["figures/three.png", "figures/four.png"]
    assert "a && b < c" in text


def test_markdown_escapes_whatever_it_would_obey():
    assert escape("a|b *c* <d> `e`") == r"a\|b \*c\* \<d\> \`e\`"


def test_a_csv_holds_the_table_in_full_precision(tmp_path):
    rows = [("a", 1 / 3, Interval(0.1, 2 / 3), Mark("reached", "good")), ("b", None, None, None)]
    write_csv(tmp_path / "t.csv", COLUMNS, rows)
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
    assert shown(Interval(math.nan, math.nan), Column("", 2)) == "–"


def test_a_chart_gives_the_same_bytes_twice_and_a_picture_of_the_pages_width(document, tmp_path):
    figure = next(block for block in document.blocks() if isinstance(block, Figure))
    for kind in ("png", "svg"):
        for name in ("a", "b"):
            charts.save(figure.chart, str(tmp_path / f"{name}.{kind}"), kind=kind, salt="x")
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
    assert matplotlib.image.imread(tmp_path / "a.png").shape[1] == round(charts.DPI * charts.WIDTH_IN)


def test_series_can_be_told_apart_without_colour():
    assert len({charts.style(index) for index in range(len(charts.SERIES))}) == len(charts.SERIES)
    assert len(set(charts.SERIES)) == len(charts.SERIES)
    assert charts.DASHES[0] != charts.DASHES[1] != charts.DASHES[2] != charts.DASHES[3]
