"""The tables of docs/minds.md are those of the reports beside it, and these are of the experiments that they name."""

import csv
from collections.abc import Callable
from pathlib import Path

import pytest

from socialai_dsl.experiments.document import document_of
from socialai_dsl.frontend import load_experiment
from tests.socialai_dsl.reporting.page_reader import Page

DOCS = Path(__file__).parents[1] / "docs"
OPENING, CLOSING = "<!-- made from docs/results/{} -->\n", "<!-- end -->"


def table() -> str:
    """Success in each trial, a row for each scenario and a column for each mind."""
    report = Page((DOCS / "results" / "minds" / "index.html").read_text(encoding="utf-8"))
    cells: dict[str, dict[str, list[str]]] = {}
    minds: dict[str, None] = {}
    for condition, _, _, success in report.table("trial"):
        row, _, mind = condition.partition(" / ")
        cells.setdefault(row, {}).setdefault(mind, []).append(f"{float(success):.2f}".removeprefix("0"))
        minds[mind] = None
    head = f"| scenario | {' | '.join(minds)} |\n|---|{'---|' * len(minds)}\n"
    rows = (
        f"| {row} | {' | '.join(', '.join(found.get(mind, ())) for mind in minds)} |\n"
        for row, found in cells.items()
    )
    return head + "".join(rows)


def rows(name: str) -> list[dict[str, str]]:
    with open(DOCS / "results" / "every_mind" / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def shown(figure: str) -> str:
    return f"{float(figure):.2f}".removeprefix("0")


def with_people() -> str:
    """Success with its interval, a row for each scenario and a column for each mind; and whom they asked first."""
    cells: dict[str, dict[str, str]] = {}
    for one in rows("minds.csv"):
        row, _, mind = one["condition"].partition(" / ")
        low, high = shown(one["success_low"]), shown(one["success_high"])
        cells.setdefault(row, {})[mind] = f"{shown(one['success'])} [{low}, {high}]"
    minds = list(dict.fromkeys(mind for found in cells.values() for mind in found))
    asked = [one for one in rows("asked.csv") if one["condition"].startswith("TalkItOut / ")]
    firsts = {(one["by"], one["condition"].partition(" / ")[2]): shown(one["first"]) for one in asked}
    at_all = {
        (one["by"], one["condition"].partition(" / ")[2]): shown(one["share_of_episodes"]) for one in asked
    }
    people = list(dict.fromkeys(by for by, _ in firsts))
    tables = [
        ("scenario", [(row, [found.get(mind, "") for mind in minds]) for row, found in cells.items()]),
        (
            "asked first (at all)",
            [
                (by, [f"{firsts.get((by, m), '.00')} ({at_all.get((by, m), '.00')})" for m in minds])
                for by in people
            ],
        ),
    ]
    return "\n".join(
        f"| {head} | {' | '.join(minds)} |\n|---|{'---|' * len(minds)}\n"
        + "".join(f"| {name} | {' | '.join(texts)} |\n" for name, texts in found)
        for head, found in tables
    )


@pytest.mark.parametrize(("name", "made"), [("minds", table), ("every_mind", with_people)])
def test_a_table_is_that_of_its_report(name: str, made: Callable[[], str], update_goldens: bool) -> None:
    page, opening = DOCS / "minds.md", OPENING.format(name)
    before, _, rest = page.read_text(encoding="utf-8").partition(opening)
    shown, _, after = rest.partition(CLOSING)
    if update_goldens:
        page.write_text(f"{before}{opening}\n{made()}\n{CLOSING}{after}", encoding="utf-8")
        shown = f"\n{made()}\n"
    assert shown == f"\n{made()}\n", "if the report is meant, run pytest --update-goldens"


@pytest.mark.parametrize(("name", "profile"), [("minds", "laptop"), ("every_mind", None)])
def test_a_report_is_of_its_experiment(name: str, profile: str | None) -> None:
    loaded = load_experiment(Path(__file__).parents[1] / "experiments" / f"{name}.yaml")
    planned = {cell.name: cell.scenario for cell in loaded.cells[profile]}
    with open(DOCS / "results" / name / "conditions.csv", newline="", encoding="utf-8") as file:
        done = {row["condition"]: row["scenario"] for row in csv.DictReader(file) if row["agent"] != "person"}
    assert done == planned
    assert len(set(planned.values())) == {"minds": 10, "every_mind": 3}[name]


def test_the_small_model_goes_on_where_it_stopped() -> None:
    """In all ten scenarios it has the settings of the two that it has played, so these are not played again."""
    with open(DOCS / "results" / "minds" / "runs.csv", newline="", encoding="utf-8") as file:
        played = {
            row["condition"]: row["id"] for row in csv.DictReader(file) if row["column"] == "SmolLM2-135M"
        }
    loaded = load_experiment(Path(__file__).parents[1] / "experiments" / "minds.yaml")
    planned = {run["condition"]: run["id"] for run in document_of(loaded, "laptop_all")["runs"]}
    assert len([name for name in planned if name.endswith("SmolLM2-135M")]) == 10
    settings = [cell.model for cell in loaded.cells["laptop_all"] if cell.name in played]
    assert settings == [cell.model for cell in loaded.cells["laptop"] if cell.name in played]
    assert {name: planned[name] for name in played} == played


def test_the_people_of_the_example_are_simulated_and_marked_so() -> None:
    simulated = {row["condition"] for row in rows("minds.csv") if row["simulated"] == "True"}
    assert simulated == {row["condition"] for row in rows("minds.csv") if row["kind"] == "person"}
    assert all("simulated people" in name for name in simulated)
    text = (DOCS / "results" / "every_mind" / "index.html").read_text(encoding="utf-8")
    assert "With simulated people: a rehearsal, in which no person took part." in text
