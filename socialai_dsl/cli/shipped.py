"""This module knows which scenarios are shipped, and which of the other files are only variants of them."""

from functools import cache
from pathlib import Path
from typing import Any, Final

_OF_ANY: Final = "any"


@cache
def _documents() -> dict[str, dict[str, Any]]:
    """Name (of the file, without its suffix) -> top level of each file in the folder of shipped scenarios."""
    import yaml

    from socialai_dsl.loader import shipped_folder

    read = {
        path.stem: yaml.safe_load(path.read_text("utf-8")) for path in sorted(shipped_folder().glob("*.yaml"))
    }
    return {name: content for name, content in read.items() if isinstance(content, dict)}


def shipped_scenarios() -> list[str]:
    """Scenarios and suites, and the variants that say what they are about: those are scenarios of their own."""
    return [name for name, content in _documents().items() if _stands_alone(content)]


def variants_of(scenario: str) -> list[str]:
    """What can follow a scenario's name after a `+`: its own variants, then those of any scenario."""
    own = {
        name.removeprefix(f"{scenario}_")
        for name, content in _documents().items()
        if name.startswith(f"{scenario}_")
        and "variant" in content
        and not _stands_alone(content)
        and Path(str(content.get("of", ""))).stem == scenario
    }
    shared = {
        name
        for name, content in _documents().items()
        if "variant" in content and content.get("of") == _OF_ANY and not _stands_alone(content)
    }
    return [*sorted(own), *sorted(shared - own)]


def _stands_alone(content: dict[str, Any]) -> bool:
    if content.get("abstract"):
        return False
    return "scenario" in content or "suite" in content or ("variant" in content and "about" in content)
