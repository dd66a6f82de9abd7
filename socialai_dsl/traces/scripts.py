"""The scripts and style sheets of pages, plain files beside this module."""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from typing import Final

_PLACE: Final = "socialai_dsl.traces"
_IMPORT: Final = re.compile(r'^import \{[^}]*\} from "\./([\w.]+)";\n', re.MULTILINE)


@cache
def static_text(name: str) -> str:
    """A file of the folder `static`."""
    return files(_PLACE).joinpath("static", name).read_text(encoding="utf-8")


def bundled(name: str) -> str:
    """A module and what it imports as one script, for a page that lies in a single file.

    A browser imports no module from a disk. All modules share one scope, so names at the top of a module differ.
    """
    parts = [_IMPORT.sub("", static_text(module)) for module in _modules(name)]
    return "\n".join(re.sub(r"^export ", "", part, flags=re.MULTILINE) for part in parts)


def _modules(name: str) -> list[str]:
    """A module and everything it imports, each behind what it needs."""
    imported = [found for one in _IMPORT.findall(static_text(name)) for found in _modules(one)]
    return list(dict.fromkeys([*imported, name]))
