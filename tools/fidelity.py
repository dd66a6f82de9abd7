"""Play the scenarios at random and compare with the paper's own code: `make fidelity`."""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_text
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone
from socialai_dsl.errors import UsageError
from tools.fidelity_page import page
from tools.fidelity_statistics import Comparison, Published, compare

SUMMARY: Final = "compare what a random policy comes to with the figures of the paper's own code"

_FIGURES: Final = Path(__file__).with_name("fidelity_figures.yaml")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios", nargs="*", metavar="SCENARIO", help="names without variants (default: all with figures)"
    )
    parser.add_argument(
        "--episodes",
        type=int,
        default=400_000,
        metavar="N",
        help="to play of each scenario (default: 400000)",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the tables as a Markdown page")
    parser.add_argument(
        "--json", action="store_true", help="print an array with one object for each comparison"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, compare, report."""
    if arguments.episodes < 1:
        raise UsageError(f"--episodes: got {arguments.episodes}, expected at least 1")
    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    compared: dict[str, Comparison] = {}
    for name, published in chosen(arguments.scenarios):
        compared[name] = _compare(name, published, arguments.episodes, arguments.seed)
        if not arguments.json:
            print(_line(name, compared[name]), flush=True)
    if arguments.json:
        print(json.dumps([_object(name, c) for name, c in compared.items()], indent=2))
    if arguments.out is not None:
        today = datetime.now(UTC).date().isoformat()
        write_text(arguments.out, page(compared, arguments.episodes, arguments.seed, today, _commit()))
    differing = [name for name, comparison in compared.items() if not comparison.agrees]
    if differing:
        print(f"differs from the paper's code: {', '.join(differing)}", file=sys.stderr)
    return Exit.FINDINGS if differing else Exit.GOOD


def _commit() -> str:
    """The commit that is checked out, short."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    found = subprocess.run(
        command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True, timeout=60
    )
    return found.stdout.strip()


def chosen(names: list[str]) -> Iterator[tuple[str, Published]]:
    """The name of what to play, with the figures to compare with.

    Raises:
        UsageError: there are no figures of a scenario.
    """
    import yaml

    figures: dict[str, dict[str, Any]] = yaml.safe_load(_FIGURES.read_text(encoding="utf-8"))["scenarios"]
    wanted = [name.removesuffix("+as_coded") for name in names] or list(figures)
    if unknown := [name for name in wanted if name not in figures]:
        raise UsageError(f"{unknown[0]}: no figures to compare with; there are those of {', '.join(figures)}")
    for name in wanted:
        given = dict(figures[name])
        unsocial = given.pop("unsocial", None)
        yield f"{name}+as_coded", Published(**given)
        if unsocial is not None:
            yield f"{name}+as_coded+unsocial", Published(**unsocial)


def _compare(name: str, published: Published, episodes: int, seed: int) -> Comparison:
    from socialai_dsl.evaluation.chance import play_at_random

    return compare(published, play_at_random(name, episodes, seed))


def _line(name: str, comparison: Comparison) -> str:
    ours, published = comparison.ours, comparison.published
    return (
        f"{name}: {'agrees' if comparison.agrees else 'DIFFERS'}; "
        f"success {ours.success_rate:.5f}, theirs {published.successes / published.episodes:.5f} "
        f"(p {comparison.p:.3g}); length {ours.mean_length:.3f}, theirs {published.mean_length:.2f} "
        f"({comparison.distance:+.2f} standard errors)"
    )


def _object(name: str, comparison: Comparison) -> dict[str, Any]:
    return {"scenario": name, **asdict(comparison), "agrees": comparison.agrees}


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m tools.fidelity", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
