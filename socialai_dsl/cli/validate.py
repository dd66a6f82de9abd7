"""`socialai validate`: checks scenario files and reports the findings."""

import argparse
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.arguments import ROOMS, add_effort, limit, positive, refuse
from socialai_dsl.cli.errors import Exit, is_usage
from socialai_dsl.cli.files import STDIN, given_files, standard_input
from socialai_dsl.cli.reporters import REPORTERS, CheckedInput, limited
from socialai_dsl.cli.terminal import ProgressLine, shows_color
from socialai_dsl.diagnostics import Diagnostic, ScenarioError

if TYPE_CHECKING:
    from socialai_dsl.frontend import CheckResult

SUMMARY: Final = "find mistakes in scenario files without playing"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "paths",
        nargs="+",
        metavar="PATH",
        help="a file, a folder, the name of a scenario such as dance+unsocial, or - for standard input",
    )
    parser.add_argument(
        "--format",
        choices=tuple(sorted(REPORTERS.keys() - {"json"})),
        default="text",
        help="format of the findings (default: text)",
    )
    parser.add_argument(
        "--json", action="store_const", const="json", dest="format", help="print the findings as a JSON array"
    )
    parser.add_argument("--strict", action="store_true", help="also fail for warnings")
    parser.add_argument(
        "--deep",
        action="store_true",
        help="also play every scenario without errors, as `socialai check --deep` does",
    )
    add_effort(parser)
    parser.add_argument(
        "--max-errors",
        type=positive,
        metavar="N",
        help="show only the first N errors; the exit code stays the same",
    )
    parser.add_argument(
        "--stdin-filename",
        metavar="PATH",
        help="name for the file on standard input (default: stdin.yaml); the files it names are looked up beside it",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Check everything that was named, then print one report."""
    if not arguments.deep:
        refuse(arguments, ("rooms", "seconds"), "it is for --deep; nothing is played without")
    if STDIN not in arguments.paths:
        refuse(
            arguments, ("stdin_filename",), "it names what is on standard input, which is read for the PATH -"
        )
    results = [
        _checked(name, arguments.stdin_filename or "stdin.yaml") for name in given_files(arguments.paths)
    ]
    checked = _without_used(results)
    if arguments.deep:
        right = [result for (_, result), c in zip(results, checked, strict=True) if not c.errors]
        tried = {result.name: _tried(result, arguments) for result in right}
        checked = [
            replace(c, diagnostics=c.diagnostics + tried.get(result.name, ()))
            for c, (_, result) in zip(checked, results, strict=True)
        ]
    shown = checked if arguments.max_errors is None else limited(checked, arguments.max_errors)
    report = REPORTERS[arguments.format](shown, shows_color(sys.stdout))
    if report:
        print(report)
    failed = any(c.errors or (arguments.strict and c.warnings) for c in checked)
    return Exit.FINDINGS if failed else Exit.GOOD


def _checked(name: str, stdin_filename: str) -> tuple[CheckedInput, "CheckResult"]:
    from socialai_dsl import frontend

    if name == STDIN:
        try:
            texts = standard_input(stdin_filename)
        except ScenarioError as error:  # no text at all, which is a finding in it as in a file
            nothing = frontend.CheckResult(stdin_filename, None, None, error.diagnostics, error.sources, None)
            return CheckedInput(stdin_filename, error.diagnostics, error.sources), nothing
        result = frontend.check(Path(stdin_filename).absolute(), texts, every_value=True)
        name = stdin_filename
    else:
        if name.endswith((".yaml", ".yml")):
            with open(name, "rb") as file:  # raises OSError where it cannot be read: usage, not a finding
                file.read(1)
        result = frontend.check(name, every_value=True)
        if result.has_errors and is_usage(result.diagnostics):
            raise ScenarioError(result.diagnostics, result.sources)
    found = (*result.diagnostics, *_misfits(result))
    return CheckedInput(name, found, dict(result.sources)), result


def _without_used(results: Iterable[tuple[CheckedInput, "CheckResult"]]) -> list[CheckedInput]:
    """What was checked, where a comment that is idle in its own file but silences a warning in another's is fine."""
    from socialai_dsl.frontend import UNUSED

    results = list(results)
    used = {span for _, result in results for span in result.used}
    return [
        replace(
            checked,
            diagnostics=tuple(d for d in checked.diagnostics if d.code != UNUSED or d.span not in used),
        )
        for checked, _ in results
    ]


def _tried(result: "CheckResult", arguments: argparse.Namespace) -> tuple[Diagnostic, ...]:
    """What trying the scenario of a file out shows, or the members of a suite; told to people as it goes."""
    if result.checked is None and result.suite is None:
        return ()
    from socialai_dsl.analysis.check import check_scenario, scenarios_of
    from socialai_dsl.analysis.effort import Clock, Effort

    found: list[Diagnostic] = []
    progress = ProgressLine(sys.stderr)
    say = progress.above(sys.stdout) if arguments.format == "text" else None
    # What was checked, also where it came from standard input.
    texts = {source.path: source for source in result.sources.values() if source.path is not None}
    for scenario, called in scenarios_of(result.name, texts):
        clock = Clock(limit(arguments) or None, progress.show)
        effort = Effort(arguments.rooms or ROOMS, clock=clock)
        report = check_scenario(scenario, called, effort, deep=True, say=say, texts=texts)
        progress.clear()
        found += report.findings()
        if report.interrupted:
            raise KeyboardInterrupt
    return tuple(found)


def _misfits(result: "CheckResult") -> Iterator[Diagnostic]:
    """What is wrong with the layouts of a suite, which only its compiled scenarios can tell."""
    if result.suite is None or not any(result.suite.starts):
        return
    from socialai_dsl.compilation import compile_loaded
    from socialai_dsl.envs.starts import check_starts

    try:
        check_starts(result.suite, compile_loaded(result.suite))
    except ScenarioError as error:
        yield from error.diagnostics
