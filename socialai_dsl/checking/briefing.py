"""What players are told before the first observation: nothing, the scenario's instructions, or what the goal is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.errors import OptionError
from socialai_dsl.schema.scenario import Instructions

Tell = Literal["nothing", "instructions", "goal"]
UNTOLD: Final = "Find out from what you see and hear what there is to do, and do it in few turns."
"""The words for players who are told nothing."""


@dataclass(frozen=True)
class Briefing:
    """What players are told before the first observation, in the same words for language models and people.

    Attributes:
        tell: whether they are told `nothing`, the scenario's `instructions` or a sentence about the `goal`.
        words: the text; of a suite with instructions, that of each member which has some.
        language: of the instructions; empty where the file does not say it, or its members differ.
    """

    tell: Tell = "nothing"
    words: str | Mapping[str, str] = ""
    language: str = ""

    def text(self, member: str | None = None) -> str:
        """The words for whoever plays this member of a suite, or a scenario that plays alone."""
        own = self.words if isinstance(self.words, str) else self.words.get(member or "", "")
        return own or UNTOLD

    def record(self) -> dict[str, Any]:
        """What results, transcripts and journals say of it, JSON-able: `tell`, and `told` and `language` if any."""
        told: dict[str, Any] = {"tell": self.tell}
        told |= {"told": self.words} if self.words else {}
        return told | ({"language": self.language} if self.language else {})


NO_BRIEFING: Final = Briefing()


def brief(
    loaded: Loaded | None, tell: Tell | None = None, goal: str = "", language: str | None = None
) -> Briefing:
    """What is to be told of a scenario or suite.

    Args:
        loaded: the scenario or suite; None for a program alone, which has no instructions.
        tell: None: the `goal` if one is given, else the `instructions` if there are some, else `nothing`.
        goal: a sentence about the aim.
        language: a tag such as `en`, of instructions in several languages; None: the one that is written first.

    Raises:
        OptionError: there is nothing of that kind to be told, or an argument goes with another `tell`.
    """
    if tell is not None and tell not in get_args(Tell):
        raise OptionError("tell", f"got {tell!r}, expected one of {', '.join(get_args(Tell))}")
    if not goal.isascii() and goal.encode(errors="ignore").decode() != goal:
        raise OptionError("goal", f"got {goal!r}, expected a text in Unicode")
    written = _instructions(loaded)
    tell = tell or ("goal" if goal else "instructions" if written else "nothing")
    if bool(goal.strip()) != (tell == "goal"):
        expected = "none" if goal.strip() else "a sentence about the aim"
        raise OptionError("goal", f"got {goal!r} and tell {tell!r}, expected {expected}")
    if language is not None and tell != "instructions":
        raise OptionError(
            "language", f"got {language!r} and tell {tell!r}, expected none: instructions alone have one"
        )
    if tell != "instructions":
        return Briefing(tell, goal)
    if loaded is None or not written:
        name = "a program" if loaded is None else loaded.name
        raise OptionError("tell", f"got 'instructions', but {name} has none; expected nothing or goal")
    chosen = {member: _in_language(one, language, member) for member, one in written.items()}
    words = {member: text for member, (text, _) in chosen.items()}
    languages = {tag for _, tag in chosen.values()}
    return Briefing(
        tell,
        words if isinstance(loaded, LoadedSuite) else next(iter(words.values())),
        languages.pop() if len(languages) == 1 else "",
    )


def _instructions(loaded: Loaded | None) -> dict[str, Instructions]:
    """The instructions of a scenario, or of each member of a suite that has some, by name."""
    if loaded is None:
        return {}
    if isinstance(loaded, LoadedSuite):
        members = dict(zip(loaded.member_names, loaded.members, strict=True))
    else:
        members = {loaded.name: loaded}
    own = {name: one.scenario.instructions for name, one in members.items()}
    return {name: one for name, one in own.items() if one is not None}


def _in_language(written: Instructions, language: str | None, name: str) -> tuple[str, str]:
    """The text in a language, and which one that is.

    Raises:
        OptionError: it is not written in this language.
    """
    texts = {"": written} if isinstance(written, str) else written
    if language is None:
        return next((text, tag) for tag, text in texts.items())
    if language not in texts:
        known = f"are in {', '.join(texts)}" if "" not in texts else "do not say in which language they are"
        raise OptionError("language", f"got {language!r}, but the instructions of {name} {known}")
    return texts[language], language
