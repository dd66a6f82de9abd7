"""What was spelt otherwise in earlier versions: it still works in this one, and says what to write now."""

from collections.abc import Mapping, Sequence
from typing import Final

FOR_MAINTAINERS: Final = ("bench", "fidelity", "reference", "sheets")
"""Commands of earlier versions: targets of make of the same names do the same in a checkout."""

_OPTIONS_OF_ORACLES: Final = {"--episodes": "--rooms"}
_OPTIONS_OF_CURVES: Final = {"--out": "--curves"}


def current(words: Sequence[str]) -> tuple[list[str], str | None]:
    """A command line as it is written now, and what to tell its author; None where nothing has changed."""
    command, rest = (words[0], list(words[1:])) if words else ("", [])
    match command:
        case "codes":
            return ["explain", *rest], "`explain` instead of `codes`"
        case "coverage":
            return [
                "check",
                *rest,
                *_unlimited(rest),
                *["--part", "coverage", "--alone"],
            ], "`check --part coverage` instead of `coverage`"
        case "oracles":
            return ["check", *_oracles(rest)], "`check --part script` instead of `oracles`"
        case "curves":
            rest = _renamed(rest, _OPTIONS_OF_CURVES)
            if not any(word.partition("=")[0] == "--curves" for word in rest):
                rest += ["--curves", "curves.png"]
            return ["report", *rest], "`report --curves FILE` instead of `curves`"
        case "report" if "--no-ceilings" in rest:
            rest = _renamed(rest, {"--no-ceilings": "--no-baselines"})
            return ["report", *rest], "`--no-baselines` instead of `--no-ceilings`"
        case "check" | "validate" if (found := _option(rest, "--format")) is not None:
            index, length, named = found
            if named == "json":
                rest[index : index + length] = ["--json"]
                return [command, *rest], "`--json` instead of `--format json`"
            if command == "check" and named == "text":
                del rest[index : index + length]
                return [command, *rest], "nothing instead of `--format text`"
        case "serve" if rest[:1] == ["openenv"] and any(word.startswith("--scenario") for word in rest):
            return [
                "serve",
                *_served(rest[1:]),
            ], "`serve SCENARIO` instead of `serve openenv --scenario SCENARIO`"
    return list(words), None


def _oracles(rest: list[str]) -> list[str]:
    """Options of `oracles` as those of `check`; without a scenario it played all that ship and have a script."""
    from socialai_dsl.loader.shipped import shipped_scenarios, variants_of

    rest = _renamed(rest, _OPTIONS_OF_ORACLES)
    named = {word.partition("=")[0] for word in rest}
    if not rest or rest[0].startswith("-"):
        rest = [*(name for name in shipped_scenarios() if "oracle" in variants_of(name)), *rest]
    rest += [] if "--rooms" in named else ["--rooms", "5000"]
    rest += [] if "--states" in named else ["--states", "300000"]
    return [*rest, *_unlimited(rest), "--part", "script"]


def _unlimited(rest: Sequence[str]) -> list[str]:
    """Commands of earlier versions that had no time limit keep none."""
    return [] if any(word.partition("=")[0] == "--seconds" for word in rest) else ["--seconds", "0"]


def _renamed(words: Sequence[str], names: Mapping[str, str]) -> list[str]:
    """The words with options renamed, whether their value follows after a blank or after `=`."""
    parts = [word.partition("=") for word in words]
    return [names.get(option, option) + equals + value for option, equals, value in parts]


def _option(rest: Sequence[str], name: str) -> tuple[int, int, str] | None:
    """Where an option stands, how many words it takes, and its value; None where it is not given."""
    for index, word in enumerate(rest):
        if word.startswith(f"{name}="):
            return index, 1, word.partition("=")[2]
        if word == name and index + 1 < len(rest):
            return index, 2, rest[index + 1]
    return None


def _served(rest: Sequence[str]) -> list[str]:
    """The scenario first."""
    found = _option(rest, "--scenario")
    if found is None:
        return list(rest)
    index, length, scenario = found
    return [scenario, *rest[:index], *rest[index + length :]]
