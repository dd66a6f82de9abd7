"""This module is `socialai validate`: it checks scenario files and reports what is wrong with them."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.errors import Exit, UsageError, is_usage
from socialai_dsl.cli.reporters import REPORTERS, Checked
from socialai_dsl.diagnostics import Diagnostic, ScenarioError

if TYPE_CHECKING:
    from socialai_dsl.frontend import CheckResult

SUMMARY: Final = "check scenario files and folders of them"

_SUFFIXES: Final = frozenset({".yaml", ".yml"})


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "paths",
        nargs="+",
        metavar="PATH",
        help="a file, a folder, or a scenario's name such as dance+unsocial",
    )
    parser.add_argument(
        "--format",
        choices=sorted(REPORTERS),
        default="text",
        help="how to print the findings (default: text); json prints an array",
    )
    parser.add_argument("--strict", action="store_true", help="warnings count as failures too")


def execute(arguments: argparse.Namespace) -> Exit:
    """Check everything that was named, then print one report."""
    checked = [_check(name) for name in _expand(arguments.paths)]
    report = REPORTERS[arguments.format](checked, sys.stdout.isatty())
    if report:
        print(report)
    failed = any(c.errors or (arguments.strict and c.warnings) for c in checked)
    return Exit.FINDINGS if failed else Exit.GOOD


def _expand(paths: list[str]) -> Iterator[str]:
    """Yield each file once: a folder gives the YAML files under it, sorted; anything else stays as it is."""
    yielded = set()
    for path in paths:
        names = [path]
        if Path(path).is_dir():
            names = sorted(str(p) for p in Path(path).rglob("*") if p.suffix in _SUFFIXES and p.is_file())
            if not names:
                raise UsageError(f"{path}: expected scenario files (*.yaml) in this folder, found none")
        for name in names:
            if name not in yielded:
                yielded.add(name)
                yield name


def _check(name: str) -> Checked:
    from socialai_dsl import frontend

    if Path(name).suffix in _SUFFIXES:
        with open(name, "rb") as file:  # raises OSError where the file cannot be read: usage, not a finding
            file.read(1)
    result = frontend.check(name)
    if result.has_errors and is_usage(result.diagnostics):
        raise ScenarioError(result.diagnostics, result.sources)
    found = (*result.diagnostics, *_misfits(result))
    return Checked(name, found, dict(result.sources))


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
