"""What models really write is understood; what cannot be understood is answered with what is possible."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import socialai_dsl as sd
from socialai_dsl.llm import Action, ActionLanguage
from socialai_dsl.llm.actions import ToolCall
from socialai_dsl.llm.questions import read_answer
from socialai_dsl.program_suite import Playable
from tests.shipped import scenarios, suites
from tests.tiny import Folder

LANGUAGE = ActionLanguage(sd.compile(sd.load("talkitout")))
EXIT = "Where is the exit"
OTHER = "How are you"

TOKENS = ("</s>", "<|im_end|>", "<|eot_id|>", "<|return|>", "<end_of_turn>", "<｜end▁of▁sentence｜>")
THOUGHTS = (
    ("<think>", "</think>"),
    ("<Thinking>", "</thinking >"),
    ('<reasoning effort="high">', "</reasoning>"),
    ("<analysis>", "</analysis>"),
    ("<seed:think>", "</seed:think>"),
    ("[THINK]", "[/THINK]"),
    ("◁think▷", "◁/think▷"),
    ("<|START_THINKING|>", "<|END_THINKING|>"),
    ("<|channel>thought\n", "<channel|>"),
    ("<|channel|>analysis<|message|>", "<|end|><|start|>assistant<|channel|>final<|message|>"),
)


@pytest.mark.parametrize(
    ("reply", "action"),
    [
        ("Act: forward", Action("forward")),
        ("forward", Action("forward")),
        ("  FORWARD.  ", Action("forward")),
        ("Act: none", Action()),
        ("Action: stay", Action()),
        ("**Action:** `turn left`", Action("left")),
        ("**Act: left**", Action("left")),
        ("act : Left!", Action("left")),
        ("> Act: forward", Action("forward")),
        ("Act:\n\nforward", Action("forward")),
        ("```\nAct: forward\n```", Action("forward")),
        ("```\nforward\n```", Action("forward")),
        ("Act: pick up", Action("pickup")),
        ("Act: pick_up", Action("pickup")),
        ("I will move forward.", Action("forward")),
        ("I'll turn right now", Action("right")),
        (f'Act: say "{EXIT}"', Action(None, EXIT)),
        (f"Act: say '{EXIT}'", Action(None, EXIT)),
        (f"Act: say “{EXIT}?”", Action(None, EXIT)),
        (f"Act: {EXIT}?", Action(None, EXIT)),
        ("Act: say: where is THE  exit", Action(None, EXIT)),
        (f'"{EXIT}?"', Action(None, EXIT)),
        (f'Act: say "{EXIT}" to the wizard.', Action(None, EXIT)),
        (f'Act: forward, say "{EXIT}"', Action("forward", EXIT)),
        (f'Act: move forward and say "{EXIT}"', Action("forward", EXIT)),
        (f'Act: say "{EXIT}" and turn left', Action("left", EXIT)),
        (f"Act: forward {EXIT}", Action("forward", EXIT)),
        ("Act: say open sesame and then turn left", Action("left", "Open sesame")),
        (f"Act: none, say {EXIT}", Action(None, EXIT)),
        (
            "I see a door ahead. Should I use it?\nNo: first I ask.\nAct: say How are you",
            Action(None, "How are you"),
        ),
        ("Act: left\nThat was wrong.\nAct: right", Action("right")),
        ("Act: left\nAct:", Action("left")),
        ("<think>Act: left</think>\nAct: right", Action("right")),
        ("<think>I could say Act: left</think>right", Action("right")),
        ('{"move": "forward", "say": null}', Action("forward")),
        ('{"move": null, "say": null}', Action()),
        (f'```json\n{{"move": "none", "say": "{EXIT}"}}\n```', Action(None, EXIT)),
        (f'Sure! {{"action": "Left", "say": "{EXIT}?"}} Good luck.', Action("left", EXIT)),
        ('{"name": "move", "arguments": {"direction": "left"}}', Action("left")),
        ('{"template": "Open <noun>", "noun": "sesame"}', Action(None, "Open sesame")),
        ("Act：left", Action("left")),
        ('"Act: left"', Action("left")),
        ("I see a wall. Act: left", Action("left")),
        ("My final action: left", Action("left")),
        ("Act: left\n**Act: turn left**", Action("left")),
        ('Act: {"move": "left", "say": null}', Action("left")),
        ('{"plan": "Act: right", "move": "left"}', Action("left")),
        ('{"move": "left", "say": "none"}', Action("left")),
        (f'Act: say "{EXIT}" and wait for an answer', Action(None, EXIT)),
        ("My last action: right\nAct: left", Action("left")),
        ("__Act__: left", Action("left")),
        (f'Act: "left", say "{EXIT}"', Action("left", EXIT)),
        ('{"name": "move", "arguments": "{\\"direction\\": \\"left\\"}"}', Action("left")),
        ("Act: left\n\nUser: You see a wall.\nAct: right", Action("left")),
        ("<answer>Act: left</answer>", Action("left")),
        ("<answer>\nleft\n</answer>", Action("left")),
        ("So \\boxed{left}", Action("left")),
        ("Act: <b>left</b>", Action("left")),
        ('<tool_call>{"name": "move", "arguments": {"direction": "left"}}</tool_call>', Action("left")),
        *((f"Act: left{token}", Action("left")) for token in TOKENS),
        ("<|im_start|>assistant\nAct: left<|im_end|>\n<|im_start|>user\nAct: right", Action("left")),
        *((f"Hm. {opens}Act: right{closes} Act: left", Action("left")) for opens, closes in THOUGHTS),
        ("The prompt began this. Act: right</think>left", Action("left")),
        ("<think>" + "Act: right\n" * 5000 + "</think>Act: left", Action("left")),
        ("analysisShall I? Act: rightassistantfinalAct: left", Action("left")),
    ],
)
def test_what_models_write_is_understood(reply: str, action: Action) -> None:
    assert LANGUAGE.parse(reply) == (action, "")


@pytest.mark.parametrize(
    ("reply", "wrong"),
    [
        ("", "the reply was empty"),
        (" \n", "the reply was empty"),
        ("```\n```", "the reply held no action"),
        ("<think>I go forward. Act: forward", "the reply held no action"),
        ("Act: fly", '"fly" is no action'),
        ("Act: don't go forward", '"don\'t go forward" is no action'),
        (
            "I am not sure whether to go forward or to ask.",
            '"I am not sure whether to go forward or to ask." is no',
        ),
        (
            'Act: say "Where is the exist"',
            '"Where is the exist" cannot be said; did you mean "Where is the exit"?',
        ),
        ("Act: say please let me out", "cannot be said"),
        (f'Act: fly, say "{EXIT}"', "is not plainly one action"),
        ('{"move": "fly", "say": null}', '"fly" is no movement'),
        ('{"move": "left", "say": "Open up"}', '"Open up" cannot be said'),
        ('{"mood": "good"}', "the object says neither what to do nor what to say"),
        ("x" * 1000, f'"{"x" * 80}…" is too long for an action'),
        *((f"{opens}Shall I? Act: left", "the reply held no action") for opens, _ in THOUGHTS),
        ("analysisShall I? Act: left", "the reply held no action"),
        ("Act: left</think>", "the reply held no action"),
        ("Act: left\nAct: right", 'the reply held two actions, "left" and "right"'),
        ("1. Act: left\n2. Act: forward", "the reply held two actions"),
        ("Act: left. Act: right", "the reply held two actions"),
        ("Act: left\nforward", "the reply held two actions"),
        (f'Act: left\nsay "{EXIT}"', "the reply held two actions"),
        ("left\nright", "the reply held two actions"),
        ('{"move": "left"}\n{"move": "right"}', "the reply held two actions"),
        ('{"move": "left", "direction": "right"}', "the object names several movements"),
        ('Act: left, or rather {"move": "right", "say": ""}', "is no action"),
        ("Act: left or right", '"left or right" is no action'),
        ("<answer>left or right</answer>", '"left or right" is no action'),
        (f'say "{EXIT}" or "{OTHER}"', f'the reply held two sentences, "{EXIT}" and "{OTHER}"'),
        (f'Act: say "{EXIT}", not "{OTHER}"', "the reply held two sentences"),
        (f'Act: say "{EXIT}" or go left', "is not plainly one action"),
        (f'Act: left, say "{EXIT}", then right', "is not plainly one action"),
        (f'Act: do not say "{EXIT}"', "is not plainly one action"),
        (f'She said "{EXIT}"', "is not plainly one action"),
        (f'I said "{EXIT}"', "is not plainly one action"),
        ("My last action: left", '"My last action: left" is no action'),
        ("Previous action: left. It failed.", "is no action"),
        ("I could do Act: left", "is no action"),
        ('{"move": ["left"]}', "is no movement"),
        ('{"move": "left", "move": "right"}', "is no movement"),
    ],
)
def test_what_is_not_understood_is_answered_with_what_is_possible(reply: str, wrong: str) -> None:
    action, error = LANGUAGE.parse(reply)
    assert action is None
    assert wrong in error
    assert "Movements are left, right, forward, pickup, drop, toggle, done, none" in error
    assert len(error) < 500


@pytest.mark.parametrize("name", [*scenarios(), *suites()])
def test_everything_that_can_be_done_and_said_is_read_back(name: str) -> None:
    reads_back(sd.compile(sd.load(name)))


def test_so_is_what_looks_like_something_else(tmp_path: Path) -> None:
    play = Folder(tmp_path)(
        """\
        actions: [left, right, forward, done]
        grammar:
          templates:
          - <noun>
          - Say <noun>
          - He said "hi" to <noun>
          - "Act: left, <noun>"
          - "* <noun> *"
          - "I am done, <noun>"
          - Yes or <noun>, please
          - "{<noun>}"
          nouns: [left, none, nothing, stay, silence, or, I, O'Neil, "a: b", 1, forward now]
        """
    )
    reads_back(play.env.unwrapped.program)  # type: ignore[attr-defined]


def reads_back(program: Playable) -> None:
    """See that replies that say what can be done and said are read so."""
    language = ActionLanguage(program)
    schema = jsonschema.Draft202012Validator(language.json_schema())
    for template, choices in program.sentences.each():
        for movement in (None, "left"):
            action = Action(movement, program.sentences.text(template, choices))
            assert language.parse(language.write(action)) == (action, "")
            reply = {"move": movement or "none", "say": action.sentence}
            schema.validate(reply)
            assert language.parse(json.dumps(reply)).action == action
    for movement in (None, *program.actions):
        assert language.parse(language.write(Action(movement))).action == Action(movement)


def test_tools_of_one_reply_make_one_action() -> None:
    def parse(*calls: tuple[str, Any]) -> Any:
        return LANGUAGE.parse_calls([ToolCall(name, json.dumps(given)) for name, given in calls])

    ask = ("say", {"template": "Where is <noun>", "noun": "the exit"})
    assert parse(("move", {"direction": "left"})).action == Action("left")
    assert parse(("move", {"direction": "left"}), ask).action == Action("left", EXIT)
    assert parse(("move", {"direction": "left"}), ask, ("move", {"direction": "left"})).action == Action(
        "left", EXIT
    )
    different = parse(("move", {"direction": "left"}), ask, ("move", {"direction": "right"}))
    assert 'the reply held two actions, "left" and "right"' in different.error
    assert "no tool was called" in parse().error
    assert '"fly" with "{}" is no call of a tool' in parse(("fly", {})).error
    assert '"up" is no movement' in parse(("move", {"direction": "up"})).error
    assert "is no call of a tool" in LANGUAGE.parse_calls([ToolCall("move", "{left")]).error
    assert [tool["function"]["name"] for tool in LANGUAGE.tools()] == ["move", "say"]
    directions = LANGUAGE.tools()[0]["function"]["parameters"]["properties"]["direction"]["enum"]
    assert directions == ["left", "right", "forward", "pickup", "drop", "toggle", "done", "none"]


def test_the_grammar_names_every_word() -> None:
    grammar = LANGUAGE.gbnf()
    assert 'root ::= "Act: " (movement | speech | movement ", " speech)' in grammar
    assert '"Where is " noun' in grammar
    assert '"the trash can"' in grammar


PIECES = [
    *("Act: ", "act", "Action:", "：", "left", "right", "none", "or", "say ", EXIT, OTHER, "my last "),
    *(
        '"',
        "'",
        "“",
        "”",
        "{",
        "}",
        '{"move": "left"}',
        '{"say": ["',
        "[",
        "]",
        "<",
        ">",
        "/",
        "|",
        "\\boxed{",
    ),
    *("\n", "\r", " ", "**", "```", "\u2028", "\x1b[2J", "\ud800", "e\u0301", "😀", "<answer>", "</answer>"),
    *(mark for pair in THOUGHTS for mark in pair),
    *TOKENS,
]


@given(st.lists(st.sampled_from(PIECES) | st.text(max_size=5)).map("".join) | st.text())
@settings(max_examples=500, deadline=None)
def test_any_text_is_an_action_that_can_be_done_or_is_refused_with_a_reason(reply: str) -> None:
    action, error = LANGUAGE.parse(reply)
    assert (action is None) == bool(error)
    if action is not None:
        assert action.movement in (None, "left", "right", "forward", "pickup", "drop", "toggle", "done")
        assert action.sentence is None or LANGUAGE.parse(LANGUAGE.write(action)).action == action
    assert error.isprintable()
    assert read_answer(reply, ("left", EXIT)) in (None, "left", EXIT)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.sampled_from(PIECES),
    lambda inner: (
        st.lists(inner) | st.dictionaries(st.sampled_from(["move", "say", "template", "noun"]), inner)
    ),
    max_leaves=8,
)


@given(JSON, st.sampled_from(["move", "say", "fly", ""]))
@settings(max_examples=200, deadline=None)
def test_any_object_and_any_call_likewise(found: Any, name: str) -> None:
    for parsed in (
        LANGUAGE.parse(json.dumps(found)),
        LANGUAGE.parse_calls([ToolCall(name, json.dumps(found))]),
    ):
        assert (parsed.action is None) == bool(parsed.error)
        assert parsed.error.isprintable()


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        ('say "Well, yes"', "Well, yes"),
        ('say "well yes!"', "Well yes"),
        ('say "WELL, yes."', "Well, yes"),
        ("say well yes", None),
        ('say "Well; yes"', None),
    ],
)
def test_sentences_with_the_same_words_are_told_apart_or_refused(
    said: str, sentence: str | None, tmp_path: Path
) -> None:
    play = Folder(tmp_path)('grammar: {templates: ["Well, <noun>", Well <noun>], nouns: [yes, no]}')
    action = ActionLanguage(play.env.unwrapped.program).parse(f"Act: {said}").action  # type: ignore[attr-defined]
    assert action == (None if sentence is None else Action(None, sentence))
