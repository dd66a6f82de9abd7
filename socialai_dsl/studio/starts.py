"""What a new scenario begins with: a template, or a copy of a scenario that ships or of one of the cookbook's."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from socialai_dsl.authoring.templates import TEMPLATES
from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.frontend import Loaded, check, closest_script, load
from socialai_dsl.loader.reader import display_name
from socialai_dsl.loader.resolved import TESTS
from socialai_dsl.loader.shipped import catalogue, file_of, is_shipped, recipes

COPIES: Final = {
    "classics": "classic experiments",
    "novel": "new scenarios",
    "cookbook": "the cookbook: one idea each",
    "": "the paper's scenarios",
    "school": "the School",
}
"""Folder of a scenario -> what is in it, in the order in which they are offered."""


def offered() -> list[tuple[str, dict[str, str]]]:
    """Templates, then what can be copied: headings, each with names and what they are about."""
    copies: dict[str, dict[str, str]] = {folder: {} for folder in COPIES}
    known = {one.name: one.about for one in catalogue()} | {
        name: recipe.about for name, recipe in recipes().items()
    }
    for name, about in known.items():
        copies.setdefault(name.rpartition("/")[0], {})[name] = about
    headed = [(COPIES.get(folder, folder), names) for folder, names in copies.items() if names]
    return [("templates", dict(TEMPLATES)), *headed]


def copied(name: str, is_taken: Callable[[str], bool]) -> dict[str, str]:
    """The files of a scenario, those of its script and its tests included: name in the new folder -> text.

    The first is the scenario itself. Where that or what belongs to it alone has a name that is taken, all of these get
    a number.

    Args:
        name: as `offered` has it.
        is_taken: whether a file of a name is there.

    Raises:
        KeyError: there is no such scenario.
    """
    found = recipes()
    if name not in found and not is_shipped(name):
        raise KeyError(name)
    path = found[name].path if name in found else file_of(name)
    folder, stem = path.parent, path.stem
    texts = {there: text for there, text in _read(path) if there.is_relative_to(folder)}
    own = [there for there, text in texts.items() if there == path or _about(text, stem, "") != text]
    number, called = 2, stem
    while any(is_taken(there.name.replace(stem, called, 1)) for there in own):
        called, number = f"{stem}_{number}", number + 1
    return {
        there.name.replace(stem, called, 1) if there in own else there.relative_to(folder).as_posix(): _about(
            text, stem, called
        )
        for there, text in texts.items()
    }


def _read(path: Path) -> Iterator[tuple[Path, str]]:
    """The files that a scenario, its script and its tests are read from, itself first."""
    loaded, beside = load(str(path)), path.with_name(path.stem + TESTS)
    every: list[Loaded] = [loaded]
    if isinstance(loaded, LoadedSuite):
        every += loaded.members
    else:
        every += [closest_script(str(path), loaded).loaded]
    tested = check(str(beside)) if beside.is_file() else None
    if tested is not None:
        every += [one.loaded for one in tested.tested]
    for source in (source for one in every for source in one.resolved.files.values()):
        if source.path is not None:
            yield source.path, source.text
    if tested is not None:
        yield beside, tested.sources[display_name(beside)].text


def _about(text: str, stem: str, called: str) -> str:
    """The text of a variant, or of tests, of the scenario's file under its new name."""
    return re.sub(rf"(?m)^((?:of|tests_of): ){re.escape(stem)}(?=(\.yaml)?\s)", rf"\g<1>{called}", text)
