"""What ships and what lies in `tests/data` is read and compiled once in each process of tests.

Nothing changes what was loaded or compiled, so all tests can share it. What tests write themselves is read each time.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from socialai_dsl import compilation, frontend
from socialai_dsl.loader import reader
from socialai_dsl.loader.resolved import shipped_names

_ROOT = Path(__file__).parents[1]
_KEPT = tuple(str(_ROOT / name) for name in ("tests/data", "scenarios", "experiments", "docs/cookbook"))
_check, _compiled = frontend.check, compilation._compiled
_programs: dict[int, dict[bool, Any]] = {}
"""What was compiled of a scenario, by its identity, with and without probes; `_checked` keeps the scenarios alive."""


def check(
    name: str | Path, texts: Any = None, every_value: bool = False, tests: bool = True, base: Any = None
) -> Any:
    """`frontend.check`."""
    ships = base is None or str(name).partition("+")[0].partition("?")[0] in shipped_names()
    lasting = (".yaml" not in str(name) and ships) or str(name).startswith(_KEPT)
    if texts is not None or every_value or not lasting:
        return _check(name, texts, every_value, tests, base)
    # Findings, and where a rule is written, name files as they are seen from the working directory.
    seen = reader.display_name(reader.shipped_folder())
    result = _checked(str(name), tests, seen)
    # What is wrong with a name depends on what else there is.
    return _check(name, texts, every_value, tests, base) if result.has_errors else result


@cache
def _checked(name: str, tests: bool, seen: str) -> Any:
    result = _check(name, None, False, tests)
    loaded = frontend._loaded(result)
    for checked in () if loaded is None else compilation.scenarios_of(loaded):
        _programs[id(checked)] = {}
    return result


def compiled(checked: Any, notes: Any, numbered: Any, asking: bool = False) -> Any:
    """`compilation._compiled`."""
    own = _programs.get(id(checked)) if notes is compilation.NO_NOTES and numbered is None else None
    if own is None:
        return _compiled(checked, notes, numbered, asking)
    if asking not in own:
        own[asking] = _compiled(checked, notes, numbered, asking)
    return own[asking]


def install() -> None:
    """Let all of the package read and compile by these."""
    frontend.check, compilation._compiled = check, compiled
