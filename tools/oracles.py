"""Let the scripts of all shipped scenarios play, and search the rooms that they do not solve: `make oracles`."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from socialai_dsl.atomic import write_text
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone
from socialai_dsl.cli.terminal import ProgressLine
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.scripts import UNPROVEN, VERDICTS, ScriptReport, UnsolvedRoom, play_script
from socialai_dsl.loader.shipped import shipped_scenarios, variants_of

SUMMARY: Final = "let the scenarios' own scripts play, and search the rooms that they do not solve"

_STATES: Final = 300_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios",
        nargs="*",
        metavar="SCENARIO",
        help="a path or a name (default: all shipped ones with a variant `oracle`)",
    )
    parser.add_argument(
        "--episodes", type=int, default=5000, metavar="N", help="rooms to play (default: 5000)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    parser.add_argument(
        "--states",
        type=int,
        default=_STATES,
        metavar="N",
        help=f"how many states a search looks at before it gives up (default: {_STATES})",
    )
    parser.add_argument(
        "--json", action="store_true", help="print an array with one object for each scenario"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the reports as a Markdown page")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, search, report; a room that can be solved and was not is a finding."""
    for option in ("episodes", "states"):
        if getattr(arguments, option) < 1:
            raise UsageError(f"--{option}: got {getattr(arguments, option)}, expected at least 1")
    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    names = arguments.scenarios or [name for name in shipped_scenarios() if "oracle" in variants_of(name)]
    from socialai_dsl.analysis.effort import Clock

    reports, progress = [], ProgressLine(sys.stderr)
    for name in names:
        clock = Clock(None, progress.show)
        reports.append(play_script(name, arguments.episodes, arguments.seed, arguments.states, clock))
        progress.clear()
        if not arguments.json:
            print("\n".join(reports[-1].lines()), flush=True)
        if clock.interrupted:
            raise KeyboardInterrupt
    if arguments.json:
        print(json.dumps([report.as_object() for report in reports], indent=2))
    if arguments.out is not None:
        write_text(arguments.out, _page(reports, arguments.states))
    return Exit.FINDINGS if any(report.found("solvable") for report in reports) else Exit.GOOD


def _page(reports: list[ScriptReport], states: int) -> str:
    rows = [
        "# What the scripts solve\n",
        "Each scenario's own script (its variant `oracle`) plays rooms of one seed. A room",
        "that it does not solve is searched: all that the agent can do and say is tried, breadth first, as far as",
        f'{states:,} different states. `env.reset(seed=..., options={{"index": ...}})` opens such a room.\n',
        "| scenario | rooms | solved | ceiling | unsolvable | solvable | undecided |",
        "|---|---|---|---|---|---|---|",
    ]
    for report in reports:
        counts = [str(len(report.found(verdict))) for verdict in VERDICTS]
        rows.append(
            f"| `{report.scenario}` | {report.rooms:,} | {report.success_rate:.2%} ± {report.success_se:.2%} "
            f"| {report.ceiling:.2%} | {' | '.join(counts)} |"
        )
    for report in reports:
        rows += ["", f"## {report.scenario}, seed {report.seed}", ""]
        if not report.unsolved:
            rows.append("Every room is solved.")
            continue
        rows += [
            "| index | the script's episode | room | states | shortest success |",
            "|---|---|---|---|---|",
        ]
        rows += [_row(room) for room in report.unsolved]
    return "\n".join(rows) + "\n"


def _row(room: UnsolvedRoom) -> str:
    verdict = room.verdict if room.exact or room.verdict != "unsolvable" else room.verdict + UNPROVEN
    steps = "" if room.steps is None else f"{room.steps} steps"
    return f"| {room.index} | {room.outcome} | {verdict} | {room.states:,} | {steps} |"


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m tools.oracles", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
