"""`socialai validate`: checks scenario files and reports the findings."""

import argparse
import sys
from collections.abc import Sequence
from typing import Final

from socialai_dsl.analysis.effort import Clock, Effort
from socialai_dsl.checking.formats import FORMATS, CheckedInput, every_finding, limited
from socialai_dsl.cli.arguments import add_effort, limit, positive, refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import ProgressLine, shows_color
from socialai_dsl.diagnostics import Severity, counted, render_text
from socialai_dsl.loader.given import STDIN

SUMMARY: Final = "find mistakes in scenario files without playing"

EXAMPLES: Final = (
    ("socialai validate gate.yaml", "finds the mistakes of a file"),
    ("socialai validate . --strict", "checks a folder; warnings fail, too"),
)


def as_text(checked: Sequence[CheckedInput]) -> str:
    """One block per finding with the line it points at, then a summary."""
    diagnostics = every_finding(checked)
    sources = {name: source for c in checked for name, source in c.sources.items()}
    errors = sum(d.severity is Severity.ERROR for d in diagnostics)
    hidden = any(c.left_out for c in checked)
    counts = [counted(errors, "error") + (" shown, more left out" if hidden else "")]
    counts.append(counted(len(diagnostics) - errors, "warning"))
    lines = [render_text([d], sources, shows_color(sys.stdout)) for d in diagnostics]
    lines.append(f"{counted(len(checked), 'file')} checked: {', '.join(counts)}")
    if diagnostics:
        code = diagnostics[0].code
        lines.append(f"`socialai explain {code}` says more about {code}")
    return "\n".join(lines)


REPORTS: Final = {"text": as_text, **FORMATS}
"""Format -> function from what was checked to what is printed."""


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
        choices=tuple(sorted(REPORTS.keys() - {"json"})),
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
    from socialai_dsl.analysis.validation import validate

    if not arguments.deep:
        refuse(arguments, ("rooms", "seconds"), "it is for --deep; nothing is played without")
    if STDIN not in arguments.paths:
        refuse(
            arguments, ("stdin_filename",), "it names what is on standard input, which is read for the PATH -"
        )
    progress = ProgressLine(sys.stderr)

    def effort() -> Effort:
        return Effort(arguments.rooms or Effort.rooms, clock=Clock(limit(arguments), progress.show))

    say = progress.above(sys.stdout) if arguments.format == "text" else None
    stdin_name = arguments.stdin_filename or "stdin.yaml"
    try:
        checked = validate(arguments.paths, stdin_name, effort if arguments.deep else None, say)
    finally:
        progress.clear()
    shown = checked if arguments.max_errors is None else limited(checked, arguments.max_errors)
    report = REPORTS[arguments.format](shown)
    if report:
        print(report)
    failed = any(c.errors or (arguments.strict and c.warnings) for c in checked)
    return Exit.FINDINGS if failed else Exit.GOOD
