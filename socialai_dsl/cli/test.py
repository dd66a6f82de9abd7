"""`socialai test`: plays the dialogues that scenarios say must go as written."""

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from socialai_dsl.checking.formats import FORMATS, CheckedInput, as_junit
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import json_text, shows_color
from socialai_dsl.diagnostics import ScenarioError, counted, is_usage, printable, render_text

if TYPE_CHECKING:
    from socialai_dsl.evaluation.scenario_tests import PlayedTest

SUMMARY: Final = "play the tests of scenarios: dialogues that must go as written"

EXAMPLES: Final = (
    ("socialai test gate.yaml", "plays the tests of a scenario"),
    ("socialai test talkitout -k introductions", "plays those with the word in their name"),
)

_REPORTS: Final[dict[str, Callable[[Sequence[CheckedInput]], str]]] = {
    **FORMATS,
    "junit": partial(as_junit, command="test"),
}
"""Format -> function from what was found to what is printed; text is printed as it comes."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "paths",
        nargs="+",
        metavar="PATH",
        help="a scenario, with the tests in the file beside it, a file of tests, or a folder; `dance+unsocial` "
        "stands for the tests that play just this",
    )
    parser.add_argument(
        "-k",
        metavar="EXPR",
        dest="chosen",
        help="play the tests whose name, or whose scenario's, has these words: `wizard and not exit`",
    )
    parser.add_argument(
        "--format",
        choices=tuple(sorted({"text", *_REPORTS} - {"json"})),
        default="text",
        help="format of the report (default: text)",
    )
    parser.add_argument(
        "--json", action="store_const", const="json", dest="format", help="print the results as a JSON array"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play the tests that were named; a mistake in their files is a finding, and so is a test that fails."""
    from socialai_dsl.evaluation.scenario_tests import play_tests

    is_text = arguments.format == "text"
    try:
        played = play_tests(arguments.paths, arguments.chosen, _print if is_text else lambda _: None)
    except ScenarioError as error:
        if is_text or arguments.format == "json":
            raise
        # What reads these formats shows findings at their places; standard error it does not read.
        print(
            _REPORTS[arguments.format](
                [CheckedInput(" ".join(arguments.paths), error.diagnostics, error.sources)]
            )
        )
        return Exit.USAGE if is_usage(error.diagnostics) else Exit.FINDINGS
    if is_text:
        print(_summary(played))
    elif arguments.format == "json":
        print(json_text([one.as_object() for one in played]))
    elif report := _REPORTS[arguments.format]([one.outcome for one in played]):
        print(report)
    return Exit.FINDINGS if any(one.fails for one in played) else Exit.GOOD


def _print(one: "PlayedTest") -> None:
    """The result of a test, with what is wrong."""
    verdict = "fails " if one.fails else "passes"
    print(printable(f"{verdict}  {one.called}  {one.plan.name}"), flush=True)
    if one.fails:
        print(render_text(one.outcome.diagnostics, one.outcome.sources, shows_color(sys.stdout)), flush=True)


def _summary(played: Sequence["PlayedTest"]) -> str:
    failed = sum(one.fails for one in played)
    seconds = sum(one.seconds for one in played)
    return f"{counted(len(played), 'test')}: {len(played) - failed} passed, {failed} failed, {seconds:.1f} s"
