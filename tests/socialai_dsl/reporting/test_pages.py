"""The page, the Markdown and the tables of a report: complete, self-contained, and safe with hostile names."""

import csv
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.reporting.analysis import Analysis, Ceilings, Level, analyse
from socialai_dsl.reporting.collect import read_experiment
from socialai_dsl.reporting.document import Document
from socialai_dsl.reporting.markdown import render_markdown
from socialai_dsl.reporting.page import render_page
from socialai_dsl.reporting.plots import iqm_figure
from socialai_dsl.reporting.sections import compose
from socialai_dsl.reporting.style import saved, styled
from socialai_dsl.reporting.tables import as_csv, as_parquet, tables
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment, write_tests

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>|`$x_1$` [a](javascript:b)\n\u202e_"
PUBLISHED = {"mean": 0.45, "std": 0.05, "note": "30 M frames", "source": "paper, Table 2"}


class Tags(HTMLParser):
    """The tags of a page with their attributes, and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


def small(folder: Path) -> Analysis:
    """A table of two columns, of which one lacks a row."""
    conditions = [
        condition("Help / PPO", [0.4, 0.5, 0.6], reference=PUBLISHED, tests=["help_as_helper"],
                  test_references={"help_as_helper": {"mean": 0.12}}),
        condition("Help / Unsocial", [0.2, 0.2, 0.3]),
        condition("Dance / PPO", [0.7]),
    ]  # fmt: skip
    write_experiment(folder, conditions)
    for seed, rate in enumerate((0.1, 0.2, 0.3)):
        write_tests(folder / "runs" / f"c0-s{seed}", {"help_as_helper": rate})
    level = Level(0.25, 0.01, "64 rooms")
    return analyse(read_experiment(folder), {"help": Ceilings(Level(1.0, 0.0, "500 episodes"), None, level)})


@pytest.fixture(scope="module")
def analysis(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    return small(tmp_path_factory.mktemp("experiment"))


@pytest.fixture(scope="module")
def document(analysis: Analysis) -> Document:
    return compose(analysis, "1.2.3", Path("report"))


@pytest.fixture(scope="module")
def page(document: Document) -> str:
    return render_page(document)


@pytest.fixture(scope="module")
def text(page: str) -> str:
    return Tags(page).text


@pytest.fixture(scope="module")
def markdown(document: Document) -> str:
    return render_markdown(document, "figures")


def test_the_page_begins_with_what_there_is(text: str) -> None:
    assert "7 of 7 runs done, in 3 conditions; 7,000 frames trained in 10 min of run time." in text
    assert "Of 1 condition with a published figure, 1 have it within one published standard deviation" in text


@pytest.mark.parametrize("said", [
    "0.500 ± 0.100", "published 0.45 ± 0.05", "difference +0.050", "on help_as_helper: 0.200 ± 0.100", "published 0.12",
    "3 of 3 seeds", "paper, Table 2", "scenarios/help.yaml:56", "jill.look", "Hedges' g", "Bonferroni", "Agarwal",
    "cpu, AVX2 instructions, 1 thread (7 runs)", "bbbbbbbbbbbb", "torch", "2.13.0", "socialai-dsl 1.2.3", "64 rooms",
])  # fmt: skip
def test_page_and_markdown_say_the_same(text: str, markdown: str, said: str) -> None:
    assert said in text
    assert said.replace("_", "\\_") in markdown


def test_the_page_needs_nothing_else(page: str) -> None:
    for tag, attributes in Tags(page).tags:
        assert tag not in ("script", "link", "iframe", "object")
        for name, value in attributes.items():
            if name in ("src", "srcset", "href"):
                assert (value or "").startswith(("data:image/svg+xml;base64,", "#"))
    assert "url(" not in page
    anchors = {attributes["id"] for _, attributes in Tags(page).tags if attributes.get("id")}
    targets = {a["href"] for tag, a in Tags(page).tags if tag == "a"}
    assert targets <= {f"#{anchor}" for anchor in anchors}


def test_every_figure_has_its_alternative_text(page: str, document: Document) -> None:
    images = [attributes for tag, attributes in Tags(page).tags if tag == "img"]
    assert len(images) == len(document.images) == 5
    assert all(attributes["alt"] for attributes in images)
    for image in document.images.values():
        assert image.png.startswith(b"\x89PNG")
        assert b"<svg" in image.svg
        assert b"<svg" in image.narrow


def test_a_figure_of_the_same_runs_is_the_same(analysis: Analysis, document: Document) -> None:
    table = analysis.sections[0]
    with styled():
        again = iqm_figure(table.aggregates, table.columns)
        assert saved(again, "svg") == document.images["part1-iqm"].svg
        assert saved(again, "png") == document.images["part1-iqm"].png


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    published = PUBLISHED | {"source": HOSTILE, "note": HOSTILE}
    hostile = condition(HOSTILE, [0.1, 0.2], HOSTILE, scenario=HOSTILE, reference=published, tests=[HOSTILE])
    write_experiment(tmp_path, [hostile], about=HOSTILE)
    (tmp_path / "runs" / "c0-s0" / "status.json").write_text(
        json.dumps({"state": "failed", "message": HOSTILE})
    )
    path = tmp_path / "runs" / "c0-s1" / "result.json"
    result: dict[str, Any] = json.loads(path.read_text())
    result["eval"]["endings"][0] |= {"text": HOSTILE, "file": HOSTILE}
    result["eval"]["rules"] = {HOSTILE: 1.0}
    result["versions"] = {HOSTILE: HOSTILE}
    path.write_text(json.dumps(result))
    ceilings = {HOSTILE: Ceilings(random=Level(0.1, 0.0, HOSTILE))}
    document = compose(analyse(read_experiment(tmp_path), ceilings, [HOSTILE]), "1", tmp_path)
    page = render_page(document)
    tags = Tags(page)
    assert "<script" not in page
    assert {tag for tag, _ in tags.tags} <= {
        "html", "head", "meta", "title", "style", "body", "header", "h1", "h2", "h3", "p", "nav", "a", "main", "figure",
        "figcaption", "div", "table", "thead", "tbody", "tr", "th", "td", "span", "code", "details", "summary", "ul",
        "li", "picture", "source", "img", "svg", "rect",
    }  # fmt: skip
    assert not any(name.startswith("on") for _, attributes in tags.tags for name in attributes)
    assert HOSTILE in tags.text
    for image in document.images.values():
        assert b"<script" not in image.svg
    markdown = render_markdown(document, "figures")
    assert "<script" not in markdown
    assert "<img" not in markdown
    assert re.search(r"(?<!\\)\]\(javascript", markdown) is None
    for block in re.findall(r"(?:^\|.*\n)+", markdown, re.MULTILINE):
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}) == 1, block


def test_tables_for_other_programs(analysis: Analysis) -> None:
    read = {name: list(csv.DictReader(io.StringIO(as_csv(rows)))) for name, rows in tables(analysis).items()}
    assert {name: len(rows) for name, rows in read.items()} == {
        "runs": 7, "conditions": 3, "comparisons": 1, "rooms": 0, "outcomes": 21,
    }  # fmt: skip
    first = read["conditions"][0]
    assert float(first["success_mean"]) == pytest.approx(0.5)
    assert float(first["success_std"]) == pytest.approx(0.1)
    assert (first["published_mean"], first["tests"]) == ("0.45", "help_as_helper=0.2")
    assert read["conditions"][1]["published_mean"] == ""
    assert {row["id"] for row in read["runs"]} >= {"c0-s0", "c1-s1"}
    assert {(row["file"], row["line"]) for row in read["outcomes"] if row["name"] == "success@56"} == {
        ("scenarios/help.yaml", "56")
    }


def test_parquet_holds_the_same(analysis: Analysis) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `parquet` is not installed")
    rows = tables(analysis)["conditions"]
    content = as_parquet(rows)
    assert content is not None
    assert parquet.read_table(io.BytesIO(content)).to_pylist() == rows


def test_an_experiment_without_anything_is_a_report_too(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("Help / PPO", [])])
    document = compose(analyse(read_experiment(tmp_path), {}), "1", tmp_path)
    assert "0 of 0 runs done" in Tags(render_page(document)).text
    assert "no result" in render_markdown(document, "figures")


def test_runs_link_to_their_replay(tmp_path: Path) -> None:
    analysis = small(tmp_path / "a b")
    (tmp_path / "a b" / "runs" / "c0-s1" / "episode.html").write_text("a page")
    document = compose(analysis, "1", tmp_path / "a b" / "report")
    links = [
        attrs["href"] for tag, attrs in Tags(render_page(document)).tags if tag == "a" and "href" in attrs
    ]
    assert "../runs/c0-s1/episode.html" in links
    assert "[watch](../runs/c0-s1/episode.html)" in render_markdown(document, "figures")


def test_probes_stand_beside_success(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("Sally / model", [0.25, 0.75])])
    for seed, right in ((0, 8), (1, 2)):
        path = tmp_path / "runs" / f"c0-s{seed}" / "result.json"
        result = json.loads(path.read_text(encoding="utf-8"))
        result["eval"]["probes"] = {
            "belief": {"asked": 10, "right": right, "unread": 0, "chance": 0.5 if seed else 0.25},
            "never": {"asked": 0, "right": 0, "unread": 0, "chance": None},
        }
        path.write_text(json.dumps(result), encoding="utf-8")
    text = render_markdown(compose(analyse(read_experiment(tmp_path), {}), "1.0", tmp_path), "figures")
    rows = [
        [cell.strip(" *`") for cell in line.split("|")[1:-1]] for line in text.splitlines() if "|" in line
    ]
    assert ["Sally / model", "belief", "20", "0.500", "0.375", "0.500"] in rows
    assert ["Sally / model", "never", "0", "–", "–", "0.500"] in rows


def test_who_was_asked_nothing_has_no_table_of_probes(analysis: Analysis) -> None:
    assert "Probes" not in render_markdown(compose(analysis, "1.0", Path()), "figures")
