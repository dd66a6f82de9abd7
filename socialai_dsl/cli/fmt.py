"""`socialai fmt`: rewrites scenario files in one style, keeping their meaning and comments."""

import argparse
import sys
from pathlib import Path
from typing import Final

from socialai_dsl.atomic import write_text
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import shows_color
from socialai_dsl.diagnostics import ScenarioError, is_usage, render_text
from socialai_dsl.loader.given import STDIN, given_files

SUMMARY: Final = "format scenario files; comments stay"

EXAMPLES: Final = (
    ("socialai fmt gate.yaml", "formats a file"),
    ("socialai fmt . --check", "names the files that are not formatted"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "paths",
        nargs="+",
        metavar="PATH",
        help="a file, a folder, or - to read standard input and write standard output",
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing; exit with 1 if a file is not formatted"
    )
    parser.add_argument("--diff", action="store_true", help="write nothing; print the changes")


def execute(arguments: argparse.Namespace) -> Exit:
    """Format each file; one that cannot be read as YAML is reported and stays as it is."""
    changed = failed = missing = 0
    names = given_files(arguments.paths)
    for name in names:
        try:
            changed += _format(name, arguments.check, arguments.diff)
        except ScenarioError as error:
            failed += 1
            missing += is_usage(error.diagnostics)
            print(render_text(error.diagnostics, error.sources, shows_color(sys.stderr)), file=sys.stderr)
    if names != [STDIN]:
        verb = "would be changed" if arguments.check or arguments.diff else "changed"
        others = len(dict.fromkeys(names)) - changed - failed
        broken = f", {failed} cannot be read" if failed else ""
        print(f"{changed} {verb}, {others} left as they are{broken}", file=sys.stderr)
    if missing:
        return Exit.USAGE
    return Exit.FINDINGS if failed or (arguments.check and changed) else Exit.GOOD


def _format(name: str, check: bool, diff: bool) -> bool:
    """Format one file; whether that changes it."""
    from socialai_dsl.authoring.formatting import formatted_file

    found = formatted_file(name)
    if diff and found.changes:
        sys.stdout.writelines(found.diff())
    if not check and not diff:
        if name == STDIN:
            sys.stdout.write(found.text)
        elif found.changes:
            write_text(Path(name).resolve(), found.text)  # a link stays a link
    elif check and found.changes and not diff:
        print(found.source.name)
    return found.changes
