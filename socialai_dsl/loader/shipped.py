"""Which scenarios ship, and which of the other files are only variants of them."""

import posixpath
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from socialai_dsl.diagnostics import ScenarioError, suggested
from socialai_dsl.errors import UsageError
from socialai_dsl.loader.reader import read_document, shipped_folder
from socialai_dsl.loader.resolved import TESTS, looks_like_path, resolve
from socialai_dsl.vocabulary import spelt

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


@dataclass(frozen=True)
class ShippedScenario:
    """A scenario or suite that ships.

    Attributes:
        name: as `load` takes it. about: what it says of itself.
        variants: what may follow the name after a `+`.
        parameters: what may follow after a `?` -> its values, the default first.
    """

    name: str
    about: str
    variants: tuple[str, ...]
    parameters: dict[str, tuple[str, ...]]


def file_named(name: str, kind: str, shipped: Mapping[str, Path]) -> Path:
    """The file of a path, or of the name under which an experiment or a study ships.

    Raises:
        UsageError: there is no such file, and none of its kind ships under this name.
    """
    path = Path(name)
    if path.exists() or looks_like_path(name):
        return path
    if name not in shipped:
        hint = suggested(name, shipped, f"; those that are shipped are {', '.join(shipped)}")
        raise UsageError(f"there is no {kind} {name!r}{hint}")
    return shipped[name]


def catalogue() -> list[ShippedScenario]:
    """Everything that ships and can be played, those of the paper first, then those in folders."""
    documents = _documents()
    in_folders = [name for name, content in documents.items() if "/" in name and _stands_alone(content)]
    return [
        ShippedScenario(
            name,
            " ".join(str(_own_or_inherited(name, "about") or "").split()),
            tuple(variants_of(name)),
            _parameters(name),
        )
        for name in (*shipped_scenarios(), *in_folders)
    ]


@cache
def _documents() -> dict[str, dict[str, Any]]:
    """Name (path in the folder of shipped scenarios, without its suffix) -> top level of each file; no tests."""
    folder = shipped_folder()
    files = sorted(path for path in folder.rglob("*.yaml") if not path.name.endswith(TESTS))
    read = {path.relative_to(folder).with_suffix("").as_posix(): read_document(path).data for path in files}
    return {name: content for name, content in read.items() if isinstance(content, dict)}


def shipped_scenarios() -> list[str]:
    """The scenarios of the paper, then others and suites beside them, and variants that say what they are about."""
    documents = _documents()
    of_the_paper = [name for name in IDS.values() if name in documents]
    others = [name for name, content in documents.items() if "/" not in name and _stands_alone(content)]
    return list(dict.fromkeys([*of_the_paper, *others]))


@dataclass(frozen=True)
class Recipe:
    """A scenario of the cookbook: its file, and what it says of itself."""

    path: Path
    about: str


@cache
def recipes() -> dict[str, Recipe]:
    """The scenarios of the cookbook by name, `cookbook/shy`."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "cookbook"
    folder = installed if installed.is_dir() else package.parent / "docs" / "cookbook"
    found = {}
    for path in sorted(folder.glob("*.yaml")):
        content = read_document(path).data
        if isinstance(content, dict) and "scenario" in content:
            found[f"cookbook/{path.stem}"] = Recipe(path, " ".join(str(content.get("about", "")).split()))
    return found


def variants_of(scenario: str) -> list[str]:
    """What can follow a scenario's name after a `+`: variants of its own, of its folder, then those for every scenario.

    A variant of what the scenario is itself a variant of counts too, where it has none of that name. One of the folder
    counts where all that it changes is there, as the School's cues need a caretaker who can give them.
    """
    documents = _documents()
    own: list[str] = []
    taken: list[str] = []
    base = scenario
    while base in documents:
        own += [
            name.removeprefix(f"{base}_")
            for name, content in documents.items()
            if name.startswith(f"{base}_") and not _stands_alone(content) and _base(name) == base
        ]
        taken += [name.removeprefix(f"{base}_") for name in documents if name.startswith(f"{base}_")]
        base = _base(base)
    folder = posixpath.dirname(scenario)
    of_folder = [posixpath.basename(name) for name in _of_any(folder)] if folder else []
    near = [name for name in of_folder if name not in taken and _suits(scenario, name)]
    return list(dict.fromkeys([*own, *near, *_of_any("")]))


@cache
def _of_any(folder: str) -> Sequence[str]:
    """The variants in a folder that are of any scenario, without those whose names say for which one they are."""
    return tuple(
        name
        for name in _documents()
        if posixpath.dirname(name) == folder
        and _base(name) == "any"
        and not any(name.startswith(f"{other}_") for other in _documents())
    )


@cache
def _suits(scenario: str, variant: str) -> bool:
    """Whether a variant for any scenario can be applied to this one; a suite's members would each have to be asked."""
    if "suite" in _documents()[scenario]:
        return False
    try:
        resolve(f"{scenario}+{variant}")
    except ScenarioError:
        return False
    return True


def is_shipped(name: str) -> bool:
    """Whether a name, without variants and parameters, is that of a scenario or suite that ships."""
    return name in _documents() and _stands_alone(_documents()[name])


def base_of(scenario: str) -> str:
    """What a shipped scenario is a variant of, if it does not say for itself what it is about; else nothing."""
    return "" if "about" in _documents()[scenario] else _base(scenario)


def _base(name: str) -> str:
    """What a file is a variant of; empty for a scenario."""
    content = _documents()[name]
    return _named(name, content["of"]) if "variant" in content and "of" in content else ""


def _named(name: str, file: object) -> str:
    """The name of a file that another one names."""
    written = str(file)
    if written == "any":
        return written
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), posixpath.splitext(written)[0]))


def _own_or_inherited(name: str, key: str) -> Any:
    """The value of a key in a file, or in what it extends or is a variant of; None if there is none."""
    content = _documents().get(name, {})
    if key in content:
        return content[key]
    above = content.get("extends") or content.get("of")
    return None if above in (None, "any") else _own_or_inherited(_named(name, above), key)


def _parameters(name: str) -> dict[str, tuple[str, ...]]:
    content = _documents().get(name, {})
    above = content.get("extends") or content.get("of")
    found = {} if above in (None, "any") else _parameters(_named(name, above))
    for parameter, said in (content.get("params") or {}).items():
        values = said.get("values") or ()
        default = said.get("default")
        if isinstance(values, dict):  # names of values, of which the default may be written as either
            default = next((name for name, value in values.items() if value == default), default)
        found[parameter] = tuple(dict.fromkeys(map(spelt, (default, *values))))
    removed = {path.removeprefix("params.") for path in content.get("remove") or ()}
    return {parameter: values for parameter, values in found.items() if parameter not in removed}


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
            base = _base(base)
        names += [posixpath.join(posixpath.dirname(scenario), variant), variant]
    return shipped_folder() / f"{next(name for name in names if name in _documents())}.yaml"
