"""Write the tables of docs/replication.md, the kept runs beside the paper's figures: `make replication`."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.atomic import write_text
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone

if TYPE_CHECKING:
    from socialai_dsl.experiments.record import Reference

SUMMARY: Final = "write the tables of docs/replication.md: the kept runs beside the paper's figures"

_ROOT: Final = Path(__file__).parents[1]
_PROFILE: Final = "small"
_KEPT: Final = {"paper": "paper_small", "case_studies": "case_small"}
"""Name of an experiment -> the folder of its runs in docs/results."""

_HEAD: Final = (
    "| condition | frames | success, by seed | ours | paper | difference | p | p corrected | verdict |\n"
    "|---|---|---|---|---|---|---|---|---|"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument("--out", type=Path, metavar="FILE", help="put them into a page, between its comments")


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the tables, or put them into a page."""
    if arguments.out is None:
        print("\n\n".join(tables().values()))
    else:
        write_text(arguments.out, with_tables(arguments.out.read_text(encoding="utf-8")))
    return Exit.GOOD


def with_tables(page: str) -> str:
    """A page with its tables written anew."""
    for name, table in tables().items():
        before, opening, rest = page.partition(f"<!-- {name}: written by `make replication` -->\n")
        _, closing, after = rest.partition("<!-- end -->")
        page = f"{before}{opening}\n{table}\n\n{closing}{after}"
    return page


def tables() -> dict[str, str]:
    """Name of an experiment -> its conditions as a table of Markdown; each condition in the first that has it."""
    seen, found = set[str](), {}
    for name in _KEPT:
        measured = [one for one in _measured(name) if one.condition not in seen]
        seen |= {one.condition for one in measured}
        found[name] = "\n".join([_HEAD, *_rows(measured)])
    return found


@dataclass(frozen=True)
class _Measured:
    """Success of a condition's agents, by seed, on its scenario or on the further `test`; and what was published."""

    condition: str
    test: str
    frames: int
    ours: list[float]
    reference: "Reference | None"


def _measured(name: str) -> Iterator[_Measured]:
    import pandas as pd

    from socialai_dsl.experiments.record import Reference
    from socialai_dsl.frontend import load_experiment

    runs = pd.read_csv(_ROOT / "docs" / "results" / _KEPT[name] / "runs.csv", keep_default_na=False)
    for cell in load_experiment(_ROOT / "experiments" / f"{name}.yaml").cells[_PROFILE]:
        own = runs[runs.condition == cell.name].sort_values("seed")
        tested = [dict(one.rsplit("=", 1) for one in tests.split("; ") if one) for tests in own.tests]
        for test, told in [("", cell.reference), *cell.tests.items()]:
            ours = [float(rates[test]) for rates in tested] if test else list(own.success_rate)
            reference = None if told is None else Reference.model_validate(told.model_dump())
            yield _Measured(cell.name, test, int(own.frames.min()), ours, reference)


def _rows(measured: Sequence[_Measured]) -> Iterator[str]:
    from socialai_dsl.reporting.published import Figure, against_published

    figures = {
        (one.condition, one.test): Figure(None, one.condition, one.test, one.ours, one.reference)
        for one in measured
        if one.reference is not None
    }
    compared = dict(zip(figures, against_published(list(figures.values())), strict=True))
    for one in measured:
        yield f"| {' | '.join(_cells(one, compared.get((one.condition, one.test))))} |"


def _cells(one: _Measured, compared: dict[str, Any] | None) -> list[str]:
    from socialai_dsl.reporting.written import difference, figure, p_value, spread

    cells = [
        f"... on `{one.test}`" if one.test else one.condition,
        "" if one.test else f"{one.frames / 1e6:.1f} M",
        ", ".join(f"{rate:.3f}" for rate in one.ours),
        spread(one.ours),
    ]
    if compared is None:
        return [*cells, "–", "", "", "", "no figure to compare with"]
    return [
        *cells,
        figure(compared["published_mean"], compared["published_std"], 2),
        difference(compared),
        p_value(compared["p"]),
        p_value(compared["p_bonferroni"]),
        compared["verdict"],
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of `make replication`."""
    return run_alone("python -m tools.replication", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
