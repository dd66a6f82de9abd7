"""What players are told: texts in languages, which are no part of a program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.authoring.formatting import formatted
from socialai_dsl.checking.briefing import UNTOLD, Briefing, brief
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import check
from socialai_dsl.llm import Episode
from socialai_dsl.source import Source

SCENARIO = """\
scenario: walk
horizon: 10
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 6}
cast: {agent: {}}
outcome: [{success: t >= 3}]
"""


def written(folder: Path, instructions: str, name: str = "walk") -> str:
    """A scenario with these lines of instructions."""
    path = folder / f"{name}.yaml"
    path.write_text(SCENARIO + instructions, encoding="utf-8")
    return str(path)


def instructions_of(scenario: str) -> object:
    """What the models hold."""
    loaded = sd.load(scenario)
    assert isinstance(loaded, LoadedScenario)
    return loaded.scenario.instructions


def test_a_program_does_not_change_by_them(tmp_path: Path) -> None:
    without = sd.compile(sd.load(written(tmp_path, "")))
    for instructions in ("instructions: Go.\n", "instructions: {en: Go., de: Geh.}\n"):
        assert sd.compile(sd.load(written(tmp_path, instructions))).sha256 == without.sha256


@pytest.mark.parametrize(
    ("instructions", "expected"),
    [
        ("", None),
        ("instructions: Go.\n", "Go."),
        ("instructions: 5\n", "5"),
        (
            "instructions: {no: Gå., zh-Hant: 走, pt-BR: true}\n",
            {"no": "Gå.", "zh-Hant": "走", "pt-BR": "true"},
        ),
    ],
)
def test_one_text_or_one_for_each_language(tmp_path: Path, instructions: str, expected: object) -> None:
    assert instructions_of(written(tmp_path, instructions)) == expected


@pytest.mark.parametrize(
    ("value", "code", "message"),
    [
        ('""', "S106", "`instructions` is empty"),
        ('{en: "  "}', "S106", "`en` is empty"),
        ("{}", "S106", "`instructions` is empty"),
        ("{en: }", "S104", "nothing is given for `en`"),
        ("[Go, there]", "S104", "`instructions` must be a text, got a list"),
        ("{en: [Go]}", "S104", "`en` must be a text, got a list"),
        ("{english: Go}", "S104", "`english` is not a language"),
        ("{de_AT: Geh}", "S104", "`de_AT` is not a language"),
        ("x" * 4001, "S106", "`instructions` has more than 4000 characters"),
    ],
)
def test_mistakes_are_one_finding(tmp_path: Path, value: str, code: str, message: str) -> None:
    (found,) = check(written(tmp_path, f"instructions: {value}\n")).diagnostics
    assert (found.code, found.text) == (code, message)


def test_an_unknown_language_has_a_hint(tmp_path: Path) -> None:
    (found,) = check(written(tmp_path, "instructions: {EN: Go}\n")).diagnostics
    assert found.hint == "a language is a short tag such as `en`, `de` or `pt-BR`"


def test_variants_and_bases(tmp_path: Path) -> None:
    walk = written(tmp_path, "instructions: {en: Go., de: Geh.}\n")
    (tmp_path / "walk_french.yaml").write_text(
        "variant: french\nof: walk.yaml\nset: {instructions.fr: Va.}\nremove: [instructions.de]\n"
    )
    (tmp_path / "walk_untold.yaml").write_text("variant: untold\nof: walk.yaml\nremove: [instructions]\n")
    (tmp_path / "walk_told.yaml").write_text("variant: told\nof: walk.yaml\nset: {instructions: Walk on.}\n")
    (tmp_path / "run.yaml").write_text("scenario: run\nextends: walk.yaml\ninstructions: {de: Lauf.}\n")
    assert instructions_of(f"{walk}+french") == {"en": "Go.", "fr": "Va."}
    assert instructions_of(f"{walk}+untold") is None
    assert instructions_of(f"{walk}+told") == "Walk on."
    assert instructions_of(str(tmp_path / "run.yaml")) == {"en": "Go.", "de": "Lauf."}
    (tmp_path / "walk_wrong.yaml").write_text(
        "variant: wrong\nof: walk.yaml\nset: {instructions.german: Geh.}\n"
    )
    with pytest.raises(ScenarioError, match="`german` is not a language"):
        sd.load(f"{walk}+wrong")


def test_they_are_formatted() -> None:
    text = SCENARIO + "instructions:  {en:  Go there. ,de: |-\n   Geh.}\n".replace("|-\n   ", "")
    assert formatted(Source("walk.yaml", text)).endswith("instructions: {en: Go there., de: Geh.}\n")


LANGUAGES = "instructions: {en: Go., de: Geh.}\n"


@pytest.mark.parametrize(
    ("instructions", "options", "expected"),
    [
        ("", {}, Briefing()),
        (LANGUAGES, {}, Briefing("instructions", "Go.", "en")),
        (LANGUAGES, {"language": "de"}, Briefing("instructions", "Geh.", "de")),
        (LANGUAGES, {"tell": "nothing"}, Briefing()),
        (LANGUAGES, {"goal": "Wait."}, Briefing("goal", "Wait.")),
        ("instructions: Go.\n", {"tell": "instructions"}, Briefing("instructions", "Go.")),
    ],
)
def test_what_is_told(tmp_path: Path, instructions: str, options: dict[str, Any], expected: Briefing) -> None:
    assert brief(sd.load(written(tmp_path, instructions)), **options) == expected


@pytest.mark.parametrize(
    ("instructions", "options", "message"),
    [
        ("", {"tell": "all"}, "tell: got 'all', expected one of nothing, instructions, goal"),
        (
            "",
            {"tell": "instructions"},
            "tell: got 'instructions', but walk has none; expected nothing or goal",
        ),
        ("", {"tell": "goal"}, "goal: got '' and tell 'goal', expected a sentence about the aim"),
        ("", {"goal": "  "}, "goal: got '  ' and tell 'goal', expected a sentence about the aim"),
        ("", {"goal": "Go.", "tell": "nothing"}, "goal: got 'Go.' and tell 'nothing', expected none"),
        ("", {"language": "de"}, "language: got 'de' and tell 'nothing', expected none"),
        (LANGUAGES, {"language": "fr"}, "language: got 'fr', but the instructions of walk are in en, de"),
        ("instructions: Go.\n", {"language": "en"}, "walk do not say in which language they are"),
    ],
)
def test_what_cannot_be_told(
    tmp_path: Path, instructions: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        brief(sd.load(written(tmp_path, instructions)), **options)


def test_a_program_has_no_instructions(tmp_path: Path) -> None:
    assert brief(None) == Briefing()
    program = sd.compile(sd.load(written(tmp_path, LANGUAGES)))
    assert Episode(program).briefing == Briefing()
    with pytest.raises(ValueError, match="a program has none"):
        brief(None, "instructions")


def suite(folder: Path, more: str = "") -> str:
    """Two members with instructions, and one without."""
    written(folder, LANGUAGES)
    (folder / "run.yaml").write_text("scenario: run\nextends: walk.yaml\ninstructions: {de: Lauf.}\n")
    (folder / "rest.yaml").write_text(SCENARIO.replace("walk", "rest"))
    path = folder / "all.yaml"
    path.write_text(f"suite: all\nmembers: [walk.yaml, run.yaml, rest.yaml]\n{more}")
    return str(path)


def test_each_member_of_a_suite_has_its_own(tmp_path: Path) -> None:
    loaded = sd.load(suite(tmp_path))
    german = brief(loaded, language="de")
    assert german.record() == {
        "tell": "instructions",
        "told": {"walk": "Geh.", "run": "Lauf."},
        "language": "de",
    }
    assert (german.text("run"), german.text("rest"), german.text()) == ("Lauf.", UNTOLD, UNTOLD)
    assert brief(loaded, goal="Wait.").text("rest") == "Wait."
    episode = Episode(suite(tmp_path))
    told = set()
    for number in range(20):
        episode.reset(test_episode=number)
        told.add(episode.instructions.rpartition("turns. ")[2])
    assert told == {"Go.", UNTOLD}


def test_acts_tell_their_own_when_they_begin(tmp_path: Path) -> None:
    german = brief(sd.load(suite(tmp_path)), language="de")
    episode = Episode(suite(tmp_path, "draw: in_sequence\n"), briefing=german)
    episode.reset(seed=0)
    assert episode.instructions.endswith("Geh.")
    turns = []
    while not (turns and turns[-1].done):
        turns.append(episode.step("Act: left"))
    begun = {t: turn.text.partition("\n\n")[0] for t, turn in enumerate(turns) if "\n\n" in turn.text}
    assert list(begun.values()) == ["Lauf.", UNTOLD]
