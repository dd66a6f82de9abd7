"""This module reads the command line, runs one command and turns whatever happens into an exit code."""

import argparse
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Final

from socialai_dsl.cli import (
    bench,
    check,
    codes,
    coverage,
    curves,
    evaluate,
    fidelity,
    new,
    oracles,
    play,
    reference,
    run,
    schema,
    sheets,
    show,
    trace,
    validate,
)
from socialai_dsl.cli.errors import Exit, RunFailed, UsageError, is_usage
from socialai_dsl.diagnostics import ScenarioError, render_text
from socialai_dsl.engine.errors import RoomError

_COMMANDS: Final = {
    "run": run,
    "new": new,
    "validate": validate,
    "codes": codes,
    "schema": schema,
    "reference": reference,
    "show": show,
    "evaluate": evaluate,
    "play": play,
    "trace": trace,
    "coverage": coverage,
    "bench": bench,
    "fidelity": fidelity,
    "oracles": oracles,
    "check": check,
    "curves": curves,
    "sheets": sheets,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run `socialai COMMAND ...` and return its exit code."""
    parser = argparse.ArgumentParser(
        prog="socialai", description="Check, train on and measure social scenarios written in YAML."
    )
    parser.add_argument("--version", action=_Version)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, module in _COMMANDS.items():
        summary = module.SUMMARY
        command = commands.add_parser(name, help=summary, description=summary[0].upper() + summary[1:] + ".")
        module.add_arguments(command)
        command.set_defaults(execute=module.execute)
        _add_debug(command)
    return _guarded(parser, argv)


def run_main(argv: Sequence[str] | None = None) -> int:
    """Run `socialai-run ...`, the same as `socialai run ...`, and return its exit code."""
    parser = argparse.ArgumentParser(prog="socialai-run", description=run.SUMMARY.capitalize() + ".")
    parser.add_argument("--version", action=_Version)
    run.add_arguments(parser)
    parser.set_defaults(execute=run.execute)
    _add_debug(parser)
    return _guarded(parser, argv)


def _add_debug(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--debug", action="store_true", help="show the whole traceback of an error")


def _guarded(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse and execute; every error is answered with one message and its exit code."""
    debug = False
    try:
        try:
            arguments = parser.parse_args(argv)
            debug = arguments.debug
            return int(arguments.execute(arguments))
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes stdout once more when it exits and would complain there.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Exit.BROKEN_PIPE
    except KeyboardInterrupt as interruption:
        print(f"{parser.prog}: {str(interruption) or 'interrupted'}", file=sys.stderr)
        return Exit.INTERRUPTED
    except Exception as error:
        if debug:
            traceback.print_exc()
        return _explain(parser.prog, error)


def _explain(program: str, error: Exception) -> Exit:
    if isinstance(error, ScenarioError):
        print(render_text(error.diagnostics, error.sources, color=sys.stderr.isatty()), file=sys.stderr)
        return Exit.USAGE if is_usage(error.diagnostics) else Exit.FINDINGS
    if isinstance(error, UsageError | RunFailed | RoomError):
        print(f"{program}: {error}", file=sys.stderr)
        return Exit.USAGE if isinstance(error, UsageError) else Exit.FINDINGS
    if isinstance(error, OSError):
        place = f": {error.filename}" if error.filename is not None else ""
        print(f"{program}: {error.strerror or error}{place}", file=sys.stderr)
        return Exit.USAGE
    print(
        f"{program}: internal error, {type(error).__name__}: {error}\n"
        "This is a bug. Please report it with the command and the scenario; --debug shows the traceback.",
        file=sys.stderr,
    )
    return Exit.INTERNAL


class _Version(argparse.Action):
    """Print the version; looked up only when asked for, because the look-up reads the disk."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and exit")

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        from importlib.metadata import version

        print(f"{parser.prog} {version('socialai-dsl')}")
        parser.exit(Exit.GOOD)
