"""Reads the command line, runs one command and turns whatever happens into an exit code."""

import argparse
import gc
import os
import re
import sys
import traceback
import warnings
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NoReturn

from socialai_dsl.cli.arguments import flag
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import shows_color
from socialai_dsl.diagnostics import ScenarioError, is_usage, printable, render_text, suggested
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.errors import OptionError, RunFailed, UsageError, described_error
from socialai_dsl.trainer.config import HYPER

_NEW_OBJECTS_BETWEEN_COLLECTIONS: Final = 50_000
"""Importing makes many objects that stay; to look through them every 700 takes a tenth of a short command."""

_GROUPS: Final = {
    "write scenarios": ("new", "list", "validate", "test", "check", "explain", "show", "fmt"),
    "see them played": ("play", "trace", "replay", "studio"),
    "train and evaluate agents": ("run", "evaluate", "crossplay", "words", "export", "serve"),
    "many runs": ("experiment", "report"),
    "studies with people": ("study",),
    "editors": ("schema", "lsp"),
}
"""What users do -> the commands for it; each is a module beside this one."""

_COMMANDS: Final = tuple(name for names in _GROUPS.values() for name in names)


def main(argv: Sequence[str] | None = None) -> int:
    """Run `socialai COMMAND ...` and return its exit code."""
    _open_streams()
    words = list(sys.argv[1:] if argv is None else argv)
    if words and not words[0].startswith("-") and words[0] not in _COMMANDS:
        return _unknown_command(words[0])
    # Loading all commands doubles the time to start; the others are needed for their summaries alone.
    if words and words[0] in _COMMANDS:
        named: Sequence[str] = words[:1]
    else:
        named = () if words and words[0].startswith("--v") else _COMMANDS
    modules = {name: import_module(f"socialai_dsl.cli.{name}") for name in named}
    parser = _Parser(
        prog="socialai",
        usage="%(prog)s COMMAND ...",
        description="Check, play and train on social scenarios written in YAML.",
        epilog=_overview(modules) if named is _COMMANDS else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_version(parser, words)
    parser.add_argument(
        "--print-completion",
        action=_Completion,
        choices=("bash", "zsh", "fish"),
        metavar="SHELL",
        help="print a completion script for bash, zsh or fish, and exit",
    )
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", prog="socialai", help=argparse.SUPPRESS
    )
    for name, module in modules.items():
        command = commands.add_parser(name, help=module.SUMMARY, description=_sentence(module.SUMMARY))
        _add_command(command, module)
    if words in ([], ["--"]):
        parser.print_help()
        return Exit.GOOD
    return _guarded(parser, words)


def _open_streams() -> None:
    """Have streams that read and write nothing where a parent process has closed the standard ones (`<&-`, `>&-`)."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            nothing = os.open(os.devnull, os.O_RDWR)
            # Open until the process ends, as the standard ones are.
            setattr(sys, name, open(nothing, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


def _overview(modules: Mapping[str, Any]) -> str:
    """Every command with its summary, grouped by what users do."""
    width = max(map(len, modules))
    lines = []
    for title, names in _GROUPS.items():
        lines += ["", f"{title}:", *(f"  {name:<{width}}  {modules[name].SUMMARY}" for name in names)]
    return "\n".join([*lines, "", "`socialai COMMAND --help` lists the options of a command."]).lstrip("\n")


def _examples(examples: Sequence[tuple[str, str]]) -> str:
    """Commands to try, each with what it is for on the next line."""
    return "\n".join(["examples:", *(f"  {command}\n      {purpose}" for command, purpose in examples)])


def run_main(argv: Sequence[str] | None = None) -> int:
    """Run `socialai-run ...`, the same as `socialai run ...`, and return its exit code."""
    return run_alone("socialai-run", import_module("socialai_dsl.cli.run"), argv)


def run_alone(program: str, module: Any, argv: Sequence[str] | None = None) -> int:
    """Run a command as a program of its own and return its exit code.

    Args:
        program: what it is called.
        module: has `SUMMARY`, `add_arguments` and `execute`, as every command does, and perhaps `EXAMPLES`.
        argv: what was typed (default: `sys.argv`).
    """
    _open_streams()
    parser = _Parser(prog=program, description=_sentence(module.SUMMARY))
    _add_version(parser, sys.argv[1:] if argv is None else argv)
    _add_command(parser, module)
    return _guarded(parser, argv)


def _sentence(summary: str) -> str:
    return summary[0].upper() + summary[1:] + "."


def _add_version(parser: argparse.ArgumentParser, words: Sequence[str]) -> None:
    # Looked up only when asked for, because the look-up reads the disk.
    asked = any(word.startswith("--v") for word in words)
    shown = f"{parser.prog} {version('socialai-dsl')}" if asked else ""
    parser.add_argument("--version", action="version", version=shown, help="show the version and exit")


def _add_command(parser: argparse.ArgumentParser, module: Any) -> None:
    module.add_arguments(parser)
    if examples := getattr(module, "EXAMPLES", ()):
        parser.formatter_class = argparse.RawDescriptionHelpFormatter
        parser.epilog = _examples(examples)
    parser.set_defaults(execute=module.execute)
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")


def _guarded(parser: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse and execute; every error is answered with one message and its exit code."""
    gc.set_threshold(_NEW_OBJECTS_BETWEEN_COLLECTIONS)
    # An agent plays by many small operations: PyTorch's threads wait for each other longer than they compute, above all
    # beside other work. Training sets its own number of threads.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    debug = False
    usual = warnings.formatwarning
    # Users want to know what to look out for, not which line of ours says so.
    warnings.formatwarning = lambda message, *_, **__: f"{parser.prog}: warning: {printable(str(message))}\n"
    try:
        try:
            try:
                arguments = parser.parse_args(argv)
            except SystemExit as end:  # argparse has printed what was asked for, or what is wrong
                return int(end.code or 0)
            debug = arguments.debug
            return int(arguments.execute(arguments))
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes stdout once more when it exits and would complain there.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Exit.BROKEN_PIPE
    except KeyboardInterrupt as interruption:
        print(f"{parser.prog}: {printable(str(interruption)) or 'interrupted'}", file=sys.stderr)
        return Exit.INTERRUPTED
    except Exception as error:
        if debug:
            traceback.print_exc()
        return _explain(parser.prog, error)
    finally:
        warnings.formatwarning = usual


def _explain(program: str, error: Exception) -> Exit:
    if isinstance(error, ScenarioError):
        print(render_text(error.diagnostics, error.sources, color=shows_color(sys.stderr)), file=sys.stderr)
        return Exit.USAGE if is_usage(error.diagnostics) else Exit.FINDINGS
    if isinstance(error, OptionError):
        name = _FLAGS.get(error.name, error.name)
        option = f"--hyper {name}" if name in HYPER else flag(name)
        error = UsageError(f"{option}: {error.said}")
    for kind, end in _ENDS.items():
        if isinstance(error, kind):
            lacking = "this machine has too little memory for what was asked"
            said = lacking if kind is MemoryError else described_error(error)
            print(f"{program}: {printable(said)}", file=sys.stderr)
            return end
    print(
        f"{program}: internal error, {type(error).__name__}: {printable(str(error))}\n"
        "This is a bug. Please report it with the command and the scenario; --debug shows the traceback.",
        file=sys.stderr,
    )
    return Exit.INTERNAL


_FLAGS: Final = {"seats": "seat"}
"""An option of a run -> that of the command, where it has another name."""

_ENDS: Final[dict[type[Exception], Exit]] = {
    UsageError: Exit.USAGE,
    OSError: Exit.USAGE,
    MemoryError: Exit.USAGE,
    RoomError: Exit.FINDINGS,
    RunFailed: Exit.STOPPED,
}
"""What is no mistake of ours -> how the command ends."""


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with the command in text that no terminal acts on, whatever was typed."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does; an option that does not exist is answered with the nearest one that does."""
        known, unknown = super().parse_known_args(args, namespace)
        for word in [word for word in unknown if word.startswith("--")]:
            options = re.findall(r"--[a-z-]+", self.format_help())
            cure = suggested(word.partition("=")[0], options, f"; `{self.prog} --help` lists the options")
            self.exit(Exit.USAGE, f"{self.prog}: there is no option {printable(word)}{cure}\n")
        return known, unknown

    def error(self, message: str) -> NoReturn:
        super().error(printable(message))


def _unknown_command(word: str) -> Exit:
    cure = suggested(word, _COMMANDS, "; `socialai --help` lists the commands")
    print(f"socialai: there is no command {printable(word)}{cure}", file=sys.stderr)
    return Exit.USAGE


class _Completion(argparse.Action):
    """Prints a script that lets a shell complete commands, options and their values, and ends the command."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        import shtab

        for action in _actions(parser):
            if isinstance(action, argparse._SubParsersAction):
                action.help = None  # `--help` lists the commands in groups instead
            if action.type is Path or (action.metavar in _FILES_OR_NAMES and action.choices is None):
                action.complete = shtab.FILE  # type: ignore[attr-defined]
        print(shtab.complete(parser, shell=str(values)))
        parser.exit(Exit.GOOD)


_FILES_OR_NAMES: Final = ("SCENARIO", "PATH", "FILE", "RUN", "CODE|SCENARIO", "RUN|SCENARIO|TRACES")


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The options of a parser and of its commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
