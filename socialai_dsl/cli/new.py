"""`socialai new`: writes a commented scenario to start from, with a script that solves it."""

import argparse
import re
from pathlib import Path
from typing import Final

from socialai_dsl.authoring.templates import SCHEMA, TEMPLATES, template_files
from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.errors import UsageError

SUMMARY: Final = "write a commented scenario to start from, with a script that solves it"

_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        help="name of the scenario; writes NAME.yaml and its variants into this folder",
    )
    parser.add_argument(
        "--template",
        choices=TEMPLATES,
        help="template to start from (default: ask-a-guide)",
    )
    parser.add_argument("--list", action="store_true", help="list the templates and exit")


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the files, and the schema for editors beside them; nothing is written if one of them exists."""
    if arguments.list:
        refuse(arguments, ("name", "template"), "--list lists the templates and writes nothing")
        width = max(map(len, TEMPLATES))
        print("\n".join(f"{name:{width}}  {about}" for name, about in TEMPLATES.items()))
        return Exit.GOOD
    if arguments.name is None:
        raise UsageError("expected a NAME, or --list")
    name = arguments.name.removesuffix(".yaml")
    if not _WORD.fullmatch(name):
        raise UsageError(
            f"NAME: expected letters, digits and underscores (at most 40), got {arguments.name!r}"
        )
    files = template_files(arguments.template or "ask-a-guide", name)
    for path in files:
        if path.exists() or path.is_symlink():
            raise UsageError(f"{path} exists already")
    for path, text in files.items():
        with open(path, "x", encoding="utf-8") as file:
            file.write(text)
    _write_schema(Path(SCHEMA))
    print(f"wrote {', '.join(map(str, files))}; check with: socialai validate {name}.yaml")
    print(f"play with: socialai play {name}.yaml")
    print(f"see it while you write: socialai studio {name}.yaml")
    return Exit.GOOD


def _write_schema(path: Path) -> None:
    """Put the schema where the files say it is; one that is there stays."""
    from socialai_dsl.authoring.language_schema import shipped_schema

    try:
        with open(path, "x", encoding="utf-8") as file:
            file.write(shipped_schema())
    except FileExistsError:
        pass
