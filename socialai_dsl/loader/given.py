"""The files that a command is given: paths, folders, standard input."""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from socialai_dsl.errors import UsageError
from socialai_dsl.loader.reader import display_name, read_stream, yaml_files_below
from socialai_dsl.source import Source

STDIN: Final = "-"


def given_files(paths: Iterable[str]) -> list[str]:
    """The files that paths stand for, each once: a folder for the YAML files below it, anything else for itself.

    Raises:
        UsageError: there is no YAML file below a folder.
    """
    names: dict[str, None] = {}
    for path in paths:
        found = yaml_files_below(Path(path)) if Path(path).is_dir() else [path]
        if not found:
            raise UsageError(f"{path}: expected scenario files (*.yaml) in this folder, found none")
        names.update(dict.fromkeys(found))
    return list(names)


def standard_input(name: str) -> Mapping[Path, Source]:
    """The text on standard input as the text of the file called `name`, as `frontend.check` takes it.

    Raises:
        ScenarioError: it is too large, or no text.
    """
    path = Path(name)
    return {path.resolve(): read_stream(sys.stdin.buffer, display_name(path))}
