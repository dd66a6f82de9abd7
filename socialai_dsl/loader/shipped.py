"""The scenarios that ship, without the files that are only variants of them."""

from functools import cache
from pathlib import Path
from typing import Any, Final

import yaml

from socialai_dsl.loader.library import shipped_folder

IDS: Final = {
    "TalkItOut": "talkitout",
    "TalkItOutNoLiar": "talkitout_no_liar",
    "Dance": "dance",
    "CoinThief": "cointhief",
    "CoinThiefTags": "cointhief_tags",
    "DiverseExit": "diverse_exit",
    "ShowMe": "showme",
    "ShowMeNoSocial": "showme_no_social",
    "Help": "help",
    "HelpAsHelper": "help_as_helper",
    "SocialEnv": "social_env",
}
"""Gymnasium's id without `SocialAI/` and `-v1`, as the paper calls a scenario -> its name."""


@cache
def _documents() -> dict[str, dict[str, Any]]:
    """Name (of the file, without its suffix) -> top level of each file in the folder of shipped scenarios."""
    files = sorted(shipped_folder().glob("*.yaml"))
    read = {path.stem: yaml.safe_load(path.read_text("utf-8")) for path in files}
    return {name: content for name, content in read.items() if isinstance(content, dict)}


def shipped_scenarios() -> list[str]:
    """The scenarios of the paper, then other scenarios and suites, and variants that say what they are about."""
    documents = _documents()
    of_the_paper = [name for name in IDS.values() if name in documents]
    others = [name for name, content in documents.items() if _stands_alone(content)]
    return list(dict.fromkeys([*of_the_paper, *others]))


def variants_of(scenario: str) -> list[str]:
    """The variants that can follow a scenario's name after a `+`: its own, then those of any scenario.

    A variant of what the scenario is itself a variant of counts too, where it has none of that name.
    """
    documents, standing = _documents(), set(shipped_scenarios())
    own: list[str] = []
    base = scenario
    while base in documents:
        own += [
            name.removeprefix(f"{base}_")
            for name, content in documents.items()
            if name.startswith(f"{base}_") and name not in standing and _base(content) == base
        ]
        base = _base(documents[base])
    shared = [name for name, content in documents.items() if _base(content) == "any" and name not in standing]
    return list(dict.fromkeys([*own, *shared]))


def base_of(scenario: str) -> str:
    """The base of a shipped variant without a description of its own; else nothing."""
    content = _documents()[scenario]
    return "" if "about" in content else _base(content)


def _base(content: dict[str, Any]) -> str:
    """What a file is a variant of; empty for a scenario."""
    return Path(str(content["of"])).stem if "variant" in content and "of" in content else ""


def _stands_alone(content: dict[str, Any]) -> bool:
    if content.get("abstract"):
        return False
    return "scenario" in content or "suite" in content or ("variant" in content and "about" in content)


def file_of(scenario: str, variant: str | None = None) -> Path:
    """The file of a shipped scenario, or of a variant that `variants_of` names."""
    names = [scenario]
    if variant is not None:
        names, base = [], scenario
        while base in _documents():
            names.append(f"{base}_{variant}")
            base = _base(_documents()[base])
        names.append(variant)
    return shipped_folder() / f"{next(name for name in names if name in _documents())}.yaml"
