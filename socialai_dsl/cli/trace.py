"""`socialai trace`: one episode step by step, with the rules that fired and why others did not."""

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.trace_episode import Trace, Traced, TraceStep
from socialai_dsl.cli.trace_text import Text
from socialai_dsl.diagnostics import did_you_mean

SUMMARY: Final = "go through one episode step by step: which rules fired, and why the others did not"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenario", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the episode (default: 0)")
    parser.add_argument(
        "--test-episode", type=int, metavar="N", help="episode N of the fixed test set instead of a seed"
    )
    parser.add_argument(
        "--index",
        type=int,
        metavar="N",
        help="room N of the seed, counted from 0, as `check` and `validate` name rooms (default: 0)",
    )
    parser.add_argument(
        "--layout",
        type=Path,
        metavar="FILE",
        help="start from a known room: a JSON file, see docs/layouts.md",
    )
    played = parser.add_mutually_exclusive_group()
    played.add_argument(
        "--agent",
        metavar="AGENT",
        help="oracle, random, shipped, or a checkpoint or run folder (default: oracle where there is one, else random)",
    )
    played.add_argument(
        "--do",
        action="append",
        metavar="LINE",
        help="what the agent does in the next step, typed as in `socialai play`; give it once for each step",
    )
    parser.add_argument("--steps", type=int, metavar="N", help="show at most so many steps")
    parser.add_argument("--from", type=int, default=1, metavar="K", dest="first", help="begin with step K")
    parser.add_argument(
        "--why",
        action="append",
        default=[],
        metavar="NAME",
        help="show only the rules of this member of the cast, of `world` or of `outcome`, and every reason",
    )
    parser.add_argument("--json", action="store_true", help="print the trace as one JSON object")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play the episode and print it."""
    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    for option, given in (("steps", arguments.steps), ("from", arguments.first)):
        if given is not None and given < 1:
            raise UsageError(f"--{option}: got {given}, expected at least 1")
    reset: dict[str, Any] = {"seed": arguments.seed}
    options: dict[str, Any] = {}
    if arguments.test_episode is not None:
        reset, options["test_episode"] = {}, arguments.test_episode
    if arguments.index is not None:
        if arguments.test_episode is not None:
            raise UsageError(
                "--index: the test set has rooms of its own; leave out --index or --test-episode"
            )
        if arguments.index < 0:
            raise UsageError(f"--index: got {arguments.index}, expected at least 0")
        options["index"] = arguments.index
    if arguments.layout is not None:
        options["layout"] = _layout(arguments.layout)
    traced = Traced(arguments.scenario, arguments.agent, arguments.do, arguments.seed)
    try:
        trace = traced.begin({**reset, "options": options or None})
        _check_names(arguments.why, trace)
        steps = _window(traced.steps(trace), arguments.first, arguments.steps)
        if arguments.json:
            shown = [step.as_object(arguments.why) for step in steps]
            print(json.dumps(trace.as_object(shown), indent=2, ensure_ascii=False))
            return Exit.GOOD
        text = Text(arguments.why, sys.stdout.isatty())
        print("\n".join(text.head(trace)), flush=True)
        for step in steps:
            print("\n".join(text.step(step)), flush=True)
        print("\n".join(text.end(trace)))
    finally:
        traced.close()
    return Exit.GOOD


def _layout(path: Path) -> Any:
    """A layout from a file.

    Raises:
        UsageError: it is no JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise UsageError(f"--layout: {path} is no JSON: {error}") from None


def _check_names(names: list[str], trace: Trace) -> None:
    known = [*trace.names, "world", "outcome"]
    groups = {name.partition("[")[0] for name in trace.names}
    for name in names:
        if name not in known and name not in groups:
            near = did_you_mean(name, known)
            hint = f"; did you mean {near!r}?" if near else f"; expected one of {', '.join(known)}"
            raise UsageError(f"--why: got {name!r}{hint}")


def _window(steps: Iterator[TraceStep], first: int, count: int | None) -> Iterator[TraceStep]:
    """The steps from `first` on, at most `count` of them."""
    for step in steps:
        if step.t >= first:
            yield step
        if count is not None and step.t >= first + count - 1:
            return
