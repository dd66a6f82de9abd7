"""The table of docs/minds.md is that of the report beside it, and the report is of `experiments/minds.yaml`."""

import csv
from pathlib import Path

from socialai_dsl.frontend import load_experiment
from tests.socialai_dsl.reporting.page_reader import Page

DOCS = Path(__file__).parents[1] / "docs"
OPENING, CLOSING = "<!-- made from docs/results/minds -->\n", "<!-- end -->"


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


def test_the_table_is_that_of_the_report(update_goldens: bool) -> None:
    page = DOCS / "minds.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(OPENING)
    shown, _, after = rest.partition(CLOSING)
    if update_goldens:
        page.write_text(f"{before}{OPENING}\n{table()}\n{CLOSING}{after}", encoding="utf-8")
        shown = f"\n{table()}\n"
    assert shown == f"\n{table()}\n", "if the report is meant, run pytest --update-goldens"


def test_the_report_is_of_the_experiment() -> None:
    loaded = load_experiment(Path(__file__).parents[1] / "experiments" / "minds.yaml")
    planned = {cell.name: cell.scenario for cell in loaded.cells["laptop"]}
    with open(DOCS / "results" / "minds" / "conditions.csv", newline="", encoding="utf-8") as file:
        done = {row["condition"]: row["scenario"] for row in csv.DictReader(file)}
    assert done == planned
    assert len(set(planned.values())) == 10
