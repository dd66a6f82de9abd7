"""`socialai show`: prints a scenario with everything that it builds on."""

import argparse
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.arguments import add_scenario
from socialai_dsl.cli.errors import Exit
from socialai_dsl.diagnostics import printable

if TYPE_CHECKING:
    from socialai_dsl.loader.resolved import ResolvedFile

SUMMARY: Final = "print a scenario after `extends` and variants, or its compiled program"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    add_scenario(parser, "; without --program also any other file of the language")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--program", action="store_true", help="print the compiled program")
    choice.add_argument("--origin", action="store_true", help="print the file and line of each value")


def execute(arguments: argparse.Namespace) -> Exit:
    """Print the resolved scenario as YAML, its listing, or its values with their origins."""
    if arguments.program:
        import socialai_dsl

        print(socialai_dsl.compile(socialai_dsl.load(arguments.scenario)).listing())
        return Exit.GOOD
    from socialai_dsl.frontend import check

    resolved = check(arguments.scenario).read()
    if arguments.origin:
        for line in _origins(resolved):
            print(printable(line))
    else:
        import yaml

        print(yaml.safe_dump(resolved.data, sort_keys=False, allow_unicode=True, width=100), end="")
    return Exit.GOOD


def _origins(resolved: "ResolvedFile") -> Iterator[str]:
    """One line for each value that is no container: its place, its path, itself; also in files that are drawn from."""
    whole = resolved.with_drawn_files() if resolved.kind == "scenario" else resolved
    for path, part in whole.tree.walk():
        if not part.children:
            yield f"{part.value_span()}: {_dotted(path)} = {json.dumps(part.data, ensure_ascii=False)}"


def _dotted(path: tuple[str | int, ...]) -> str:
    """`("then", 0, "say")` -> `then[0].say`, as variants write it."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")
