"""The page and the tables of a report: complete, self-contained, and safe with hostile names."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.reporting.analysis import Analysis, analyse
from socialai_dsl.reporting.collect import read_experiment
from socialai_dsl.reporting.page import render_page
from socialai_dsl.reporting.plots import figures
from socialai_dsl.reporting.records import QuestionRecord, StudyRecord
from socialai_dsl.reporting.style import saved
from socialai_dsl.reporting.tables import tables
from tests.socialai_dsl.reporting.page_reader import Page
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment, write_tests

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>|`$x_1$` [a](javascript:b)\n\u202e_"
PUBLISHED = {"mean": 0.45, "std": 0.05, "n": 16, "note": "30 M frames", "source": "paper, Table 2"}


def drawn(analysis: Analysis) -> dict[str, bytes]:
    return {name: saved(figure, "svg") for name, figure in figures(analysis).items()}


def read(folder: Path, place: Path = Path("report")) -> Page:
    analysis = analyse(read_experiment(folder), {})
    return Page(render_page(analysis, {}, "1", place))


def small(folder: Path) -> Analysis:
    """A table of two columns, of which one lacks a row."""
    conditions = [
        condition("Help / PPO", [0.4, 0.5, 0.6], reference=PUBLISHED, tests=["rooms/help_as_helper.yaml"],
                  test_references={"rooms/help_as_helper.yaml": {"mean": 0.12}}),
        condition("Help / Unsocial", [0.2, 0.2, 0.3]),
        condition("Dance / PPO", [0.7]),
    ]  # fmt: skip
    write_experiment(folder, conditions)
    for seed, rate in enumerate((0.1, 0.2, 0.3)):
        write_tests(folder / "runs" / f"c0-s{seed}", {"rooms/help_as_helper.yaml": rate})
    level = Level(0.25, 0.01, "64 rooms")
    return analyse(read_experiment(folder), {"help": Baselines(Level(1.0, 0.0, "500 episodes"), None, level)})


@pytest.fixture(scope="module")
def analysis(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    return small(tmp_path_factory.mktemp("experiment"))


@pytest.fixture(scope="module")
def drawings(analysis: Analysis) -> dict[str, bytes]:
    return drawn(analysis)


@pytest.fixture(scope="module")
def page(analysis: Analysis, drawings: dict[str, bytes]) -> Page:
    return Page(render_page(analysis, drawings, "1.2.3", Path("report")))


def test_the_page_begins_with_what_there_is(page: Page) -> None:
    assert "7 of 7 runs done, in 3 conditions; 7,000 frames trained in 10 min of run time." in page.text
    assert "Ours beside 2 published figures: not shown to differ (1); not testable (1)." in page.text


@pytest.mark.parametrize("said", [
    "0.500 ± 0.100", "published 0.45 ± 0.05", "difference +0.050", "on help_as_helper: 0.200 ± 0.100", "published 0.12",
    "3 of 3 seeds", "paper, Table 2", "scenarios/help.yaml:56", "jill.look", "Hedges' g", "Bonferroni", "Agarwal",
    "cpu, AVX2 instructions, 1 thread (7 runs)", "bbbbbbbbbbbb", "torch", "2.13.0", "socialai-dsl 1.2.3", "64 rooms",
    "success: any(d in doors where exiter.at(d))",
])  # fmt: skip
def test_what_the_page_says(page: Page, said: str) -> None:
    assert said in page.text


def test_published_figures_stand_beside_ours_with_a_verdict(page: Page) -> None:
    own, other = page.table("verdict")
    assert own[:5] == [
        "Help / PPO",
        "not shown to differ",
        "0.500 ± 0.100",
        "0.45 ± 0.05",
        "+0.050",
    ]
    assert own[5] == own[6] != "–", "one test: nothing to correct"
    assert other == [
        "Help / PPO on help_as_helper", "not testable", "0.200 ± 0.100", "0.12", "+0.080", "–", "–",
    ]  # fmt: skip
    # Variances of the means: 0.01 / 3 and 0.0025 / 16; 2.19 degrees of freedom, whose quantile is 3.96.
    for said in ("[\u22120.184, +0.284]", "no standard deviation published"):
        assert said in page.text


def test_the_page_needs_nothing_else(page: Page) -> None:
    for tag, attributes in page.tags:
        assert tag not in ("script", "link", "iframe", "object")
        for name, value in attributes.items():
            if name in ("src", "srcset", "href"):
                assert (value or "").startswith(("data:image/svg+xml;base64,", "#"))
    anchors = {attributes["id"] for _, attributes in page.tags if attributes.get("id")}
    targets = {attributes["href"] for tag, attributes in page.tags if tag == "a"}
    assert targets <= {f"#{anchor}" for anchor in anchors}


def test_every_figure_has_its_alternative_text(page: Page, drawings: dict[str, bytes]) -> None:
    images = [attributes for tag, attributes in page.tags if tag == "img"]
    assert drawings.keys() == {
        "part1-success", "part1-iqm", "part1-curves1", "part1-curves2",
        "part1-endings1-1", "part1-endings1-2", "part1-endings2-1",
    }  # fmt: skip
    assert len(images) == len(drawings)
    assert all(attributes["alt"] for attributes in images)


def test_a_figure_of_the_same_runs_is_the_same(analysis: Analysis, drawings: dict[str, bytes]) -> None:
    again = figures(analysis)
    assert saved(again["part1-iqm"], "svg") == drawings["part1-iqm"]
    assert saved(again["part1-iqm"], "png").startswith(b"\x89PNG")


def test_figures_call_an_ending_what_the_scenario_calls_it(analysis: Analysis) -> None:
    (legend,) = [axes.get_legend() for axes in figures(analysis)["part1-endings1-1"].axes]
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "success: any(d in doors where exiter.at(d))", "out of time",
    ]  # fmt: skip


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
    analysis = analyse(
        read_experiment(tmp_path), {HOSTILE: Baselines(chance=Level(0.1, 0.0, HOSTILE))}, [HOSTILE]
    )
    drawings = drawn(analysis)
    text = render_page(analysis, drawings, "1", tmp_path)
    page = Page(text)
    assert "<script" not in text
    assert {tag for tag, _ in page.tags} <= {
        "html", "head", "meta", "title", "style", "body", "header", "h1", "h2", "h3", "h4", "p", "nav", "a", "main",
        "figure", "figcaption", "div", "table", "thead", "tbody", "tr", "th", "td", "span", "details", "summary", "ul",
        "li", "img", "meter",
    }  # fmt: skip
    assert not any(name.startswith("on") for _, attributes in page.tags for name in attributes)
    assert " ".join(HOSTILE.split()) in page.text
    assert not any(b"<script" in svg for svg in drawings.values())


def test_hostile_texts_of_a_study_stay_text(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("Help / PPO", [0.4])])
    asked = {"block": HOSTILE, "name": HOSTILE, "ask": HOSTILE}
    scale = QuestionRecord(
        kind="scale", start=1, to=5, ends=(HOSTILE, HOSTILE), answers={HOSTILE: 3}, **asked
    )
    choice = QuestionRecord(kind="choice", options=(HOSTILE, "b"), answers={"p": HOSTILE}, **asked)
    text = QuestionRecord(kind="text", answers={"p": f"{HOSTILE} in my own words"}, **asked)
    study = StudyRecord(
        name=HOSTILE,
        simulated=False,
        joined=2,
        counted=1,
        excluded={HOSTILE: 1},
        unended=0,
        questions=[scale, choice, text],
    )
    analysis = analyse(replace(read_experiment(tmp_path), studies=(study,)), {})
    shown = render_page(analysis, {}, "1", tmp_path)
    page = Page(shown)
    assert "<script" not in shown
    assert not any(name.startswith("on") for _, attributes in page.tags for name in attributes)
    assert " ".join(HOSTILE.split()) in page.text
    assert [row[2:] for row in page.table("share, or mean ± sd")] == [
        ["3.00", "1"],
        ["1.00", "1 of 1"],
        ["0.00", "0 of 1"],
    ]
    assert "in my own words" not in page.text
    assert "simulated" not in page.text.lower()


def test_tables_for_other_programs(analysis: Analysis) -> None:
    found = {
        name: list(csv.DictReader(io.StringIO(table.to_csv(index=False))))
        for name, table in tables(analysis).items()
    }
    assert {name: len(rows) for name, rows in found.items()} == {
        "runs": 7, "conditions": 3, "published": 2, "comparisons": 1, "carried": 1, "rooms": 0, "outcomes": 21,
        "results_by": 0, "seats": 0, "crossplay": 0, "words": 0, "minds": 0, "trials": 0, "people": 0, "asked": 0,
        "orders": 0, "exchanges": 0, "times": 0, "answers": 0, "free_text": 0, "humans": 0,
    }  # fmt: skip
    first = found["conditions"][0]
    assert float(first["success_mean"]) == pytest.approx(0.5)
    assert float(first["success_std"]) == pytest.approx(0.1)
    assert (first["published_mean"], first["tests"]) == ("0.45", "rooms/help_as_helper.yaml=0.2")
    assert found["conditions"][1]["published_mean"] == ""
    assert {row["id"] for row in found["runs"]} >= {"c0-s0", "c1-s1"}
    assert {(row["file"], row["line"]) for row in found["outcomes"] if row["name"] == "success@56"} == {
        ("scenarios/help.yaml", "56")
    }


def test_parquet_holds_the_same(analysis: Analysis, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `parquet` is not installed")
    table = tables(analysis)["conditions"]
    table.to_parquet(tmp_path / "conditions.parquet")
    rows = parquet.read_table(tmp_path / "conditions.parquet").to_pylist()
    assert [row["success_mean"] for row in rows] == pytest.approx(list(table.success_mean))
    assert [row["published_mean"] for row in rows] == [0.45, None, None]


def test_an_experiment_without_anything_is_a_report_too(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("Help / PPO", [])])
    page = read(tmp_path)
    assert "0 of 0 runs done" in page.text
    assert "no result" in page.text


def test_runs_link_to_their_replay(tmp_path: Path) -> None:
    folder = tmp_path / "a b"
    small(folder)
    (folder / "runs" / "c0-s1" / "episode.html").write_text("a page")
    links = [attributes["href"] for tag, attributes in read(folder, folder / "report").tags if tag == "a"]
    assert "../runs/c0-s1/episode.html" in links


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
    rows = read(tmp_path).table("probe")
    assert ["Sally / model", "belief", "20", "0.500", "0.375", "0.500"] in rows
    assert ["Sally / model", "never", "0", "–", "–", "0.500"] in rows


def test_the_page_tells_who_played_and_what_was_learnt_within_a_session(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("Asked / model", [0.25, 0.75])])
    for seed, first in ((0, 0.0), (1, 1.0)):
        path = tmp_path / "runs" / f"c0-s{seed}" / "result.json"
        result = json.loads(path.read_text(encoding="utf-8"))
        result |= {"kind": "model", "tell": "goal", "told": {"one": "Find out."}, "trials": 2, "history": 3}
        trials = [{"episodes": 10, "success_rate": rate} for rate in (first, 0.6)]
        result["eval"]["trials"] = trials[: 2 - seed]
        path.write_text(json.dumps(result), encoding="utf-8")
    page = read(tmp_path)
    (players,) = [row for row in page.table("kind of mind") if row[0] == "Asked / model"]
    assert (players[1], players[3], players[4]) == ("model", "its seat's view", "2 episodes")
    assert "goal" in players[2]
    assert "one: Find out." in page.text
    assert "a request has the last 3 observations" in page.text
    rows = page.table("trial")
    assert ["Asked / model", "1", "20", "0.500"] in rows
    assert ["Asked / model", "2", "10", "0.600"] in rows


def test_where_trained_agents_alone_play_nothing_is_said_of_minds(page: Page) -> None:
    assert "kind of mind" not in page.text
    assert "By trial" not in page.text


def test_an_agent_that_was_asked_nothing_has_no_table_of_probes(page: Page) -> None:
    assert "Probes" not in page.text
