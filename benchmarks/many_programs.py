"""Collects different programs for a batch that plays many of them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import socialai_dsl
from socialai_dsl.loader.shipped import shipped_scenarios


def different_programs(count: int) -> dict[str, str]:
    """Scenarios whose programs all differ: shipped ones, then their variants.

    Returns:
        Name, as it is loaded -> digest of the program; not more than `count`.
    """
    found: dict[str, str] = {}
    for name in _candidates():
        try:
            program: Any = socialai_dsl.compile(socialai_dsl.load(name))
        except socialai_dsl.ScenarioError:  # not every variant is there for every scenario
            continue
        if hasattr(program, "words") and program.sha256 not in found.values():
            found[name] = program.sha256
        if len(found) == count:
            break
    return found


def _candidates() -> Iterator[str]:
    from socialai_dsl.loader.reader import shipped_folder

    folder = shipped_folder()
    nested = [path.relative_to(folder).with_suffix("") for path in sorted(folder.rglob("*/*.yaml"))]
    names = [*shipped_scenarios(), *map(Path.as_posix, nested)]
    names = [name for name in names if not name.endswith("_oracle")]  # only the agent's script differs
    for suffix in ("", "+unsocial", "+as_coded"):
        yield from (name + suffix for name in names)
