"""Finds the files that a command is given: paths, folders, standard input."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.errors import UsageError

if TYPE_CHECKING:
    from socialai_dsl.source import Source

STDIN: Final = "-"


def yaml_files(folder: str) -> list[str]:
    """The YAML files under a folder, sorted.

    Raises:
        UsageError: there is none.
    """
    from socialai_dsl.loader.reader import yaml_files_below

    names = yaml_files_below(Path(folder))
    if not names:
        raise UsageError(f"{folder}: expected scenario files (*.yaml) in this folder, found none")
    return names


def standard_input(name: str) -> Mapping[Path, "Source"]:
    """The text on standard input as the text of the file called `name`, as `frontend.check` takes it.

    Raises:
        ScenarioError: it is too large, or no text.
    """
    from socialai_dsl.loader.reader import display_name, read_stream

    path = Path(name)
    return {path.resolve(): read_stream(sys.stdin.buffer, display_name(path))}
