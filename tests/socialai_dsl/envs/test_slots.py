"""Templates with several slots: the space, what is heard in each, suites, layouts, and every way to speak."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.llm.actions import ActionLanguage, ToolCall
from socialai_dsl.program_suite import mixture
from socialai_dsl.semantics.typed import Phrases

ERRANDS = """
scenario: errands
about: Everybody hears everything, and carries out what is asked of them.
horizon: 30
earshot: room
grammar:
  templates: [Give <what> to <whom>, Where is <what>, Hello, I want <n>, Paint it <hue>]
  slots: {what: [the ball, the key], whom: peers, n: [1..3, many], hue: colors}
room: {size: 8}
objects:
  lamp: {type: ball, color: green, place: anywhere}
frames:
  listen:
    let: {got: 0, saw: red}
    states:
      s:
        then:
          - {hears: Give the key to <whom>, when: whom == self, set: {got: 7}}
          - {hears: Give <what> to <whom>, when: whom == self, say: "<what> is for <whom>, not <speaker.name>"}
          - {hears: Paint it <hue>, when: hue == lamp.color, say: It is <hue> already}
          - {hears: Paint it <hue>, set: {saw: hue}}
          - {hears: Where is <what>, say: What is <what>}
          - {hears: [Hello, I want <n>], when: n != "many", say: You want <n>}
cast:
  peers: {count: 2, name: [Ann, Bob], frame: listen, place: anywhere}
  agent: {place: anywhere}
outcome:
  - {success: agent.what == "the key" and agent.hue != lamp.color and agent.whom.x >= 0, id: gave}
  - {failure: agent.n == "many", id: greedy}
"""

NUMBERS = """
scenario: numbers
horizon: 30
earshot: room
grammar: {templates: [Take <n>, Fetch <what>], slots: {n: 2..4, what: [a hat, a coat]}}
room: {size: 6}
frames:
  count:
    let: {sum: 0}
    states:
      s: {then: [{hears: Take <n>, set: {sum: "min(sum + 2 * n, 20)"}, say: That is <sum + 2 * n>}]}
cast: {ann: {frame: count, place: anywhere}, agent: {place: anywhere}}
outcome: [{success: ann.sum >= 12}]
"""

NOUNS = """
scenario: nouns
horizon: 30
grammar: {templates: [Fetch <noun>, Hello], nouns: [a hat, bread]}
room: {size: 6}
cast: {agent: {place: anywhere}}
outcome: [{success: agent.noun == "bread"}]
"""


@pytest.fixture
def errands(tmp_path: Path) -> Any:
    return made(tmp_path, "errands", ERRANDS)


def made(folder: Path, name: str, text: str) -> Any:
    path = folder / f"{name}.yaml"
    path.write_text(text, encoding="utf-8")
    env = sd.make(str(path)).unwrapped
    env.reset(seed=1)
    return env


def said(env: Any, sentence: str | None) -> str:
    *_, info = env.step(env.encode_action((None, sentence)))
    return str(info["utterance"])


def test_every_slot_is_a_head(errands: Any) -> None:
    assert errands.action_space.nvec.tolist() == [8, 2, 5, 2, 2, 4, 6]
    assert errands.encode_action((None, "Give the key to Bob")).tolist() == [7, 1, 0, 1, 1, 0, 0]
    assert errands.encode_action(("left", "Paint it blue")).tolist() == [0, 1, 4, 0, 0, 0, 2]
    by_parts = errands.encode_action((None, "Give <what> to <whom>", "the key", 1, None, None))
    assert by_parts.tolist() == [7, 1, 0, 1, 1, 0, 0]
    assert errands.encode_action((None,) * 6).tolist() == [7, 0, 0, 0, 0, 0, 0]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((None, "Give <what> to <whom>", "the key", None, None, None), "whom None; expected both"),
        ((None, None, "the key", None, None, None), "expected both or neither"),
        ((None, "Hello", 0, 0), r"expected \(body action, template, what, whom, n, hue\)"),
        ((None, "Give the key to Bobb"), "did you mean 'Give the key to Bob'"),
        ((None, "Where is <what>", "the kye", None, None, None), "did you mean 'the key'"),
    ],
)
def test_what_cannot_be_said_is_explained(errands: Any, given: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        errands.encode_action(given)


def test_actions_outside_of_a_slot_are_refused(errands: Any) -> None:
    with pytest.raises(ValueError, match="expected one of MultiDiscrete"):
        errands.step(np.array([7, 1, 0, 2, 0, 0, 0]))


def test_rules_hear_things_people_colours_and_numbers(errands: Any) -> None:
    assert said(errands, "Give the ball to Bob") == "Bob: the ball is for Bob, not Agent"
    assert said(errands, "Paint it green") == "Ann: It is green already\nBob: It is green already"
    said(errands, "Paint it blue")
    assert errands.describe()["let"]["peers[0].saw"] == "blue"
    assert said(errands, "Where is the key") == "Ann: What is the key\nBob: What is the key"
    assert said(errands, "I want 2") == "Ann: You want 2\nBob: You want 2"


def test_a_word_in_the_place_of_a_slot_matches_itself_alone(errands: Any) -> None:
    said(errands, "Give the ball to Ann")
    assert errands.describe()["let"]["peers[0].got"] == 0
    _, _, ended, _, info = errands.step(errands.encode_action((None, "Give the key to Ann")))
    assert (ended, info["outcome"]) == (True, "gave")
    assert [errands.describe()["let"][f"peers[{k}].got"] for k in (0, 1)] == [7, 0]


def test_a_rule_that_asks_for_a_slot_hears_only_what_has_it(errands: Any) -> None:
    assert said(errands, "Hello") == "NA", "it has no number, and the rule asks for one"


def test_the_choice_for_a_slot_that_a_template_lacks_means_nothing(errands: Any) -> None:
    rng, registers = np.random.default_rng(0), []
    for _ in range(20):
        errands.reset(seed=1)
        spare = rng.integers(0, errands.action_space.nvec)
        spare[:4] = 7, 1, 1, 0
        _, _, ended, _, info = errands.step(spare)
        registers.append((ended, info["utterance"], str(errands.describe())))
    assert len(set(registers)) == 1


def test_in_silence_a_slot_is_unlike_anything(errands: Any) -> None:
    for _ in range(3):
        *_, terminated, _, info = errands.step(errands.encode_action((None, None)))
        assert not terminated
    _, _, ended, _, info = errands.step(errands.encode_action((None, "I want many")))
    assert (ended, info["outcome"]) == (True, "greedy")


def test_numbers_are_computed_with_beside_slots_of_words(tmp_path: Path) -> None:
    env = made(tmp_path, "numbers", NUMBERS)
    assert said(env, "Take 3") == "Ann: That is 6"
    assert said(env, "Fetch a hat") == "NA"
    assert said(env, "Take 4") == "Ann: That is 14"


def test_a_member_hears_the_slots_of_what_another_says(tmp_path: Path) -> None:
    text = ERRANDS.replace("cast:\n", "cast:\n  boss: {name: Cleo, frame: order, place: anywhere}\n").replace(
        "frames:\n",
        "frames:\n  order: {let: {who: pick(peers)}, steps: [{do: stay, for: 1, say: Give the ball to <who.name>}]}\n",
    )
    env = made(tmp_path, "boss", text)
    heard = []
    for _ in range(3):
        heard += [line for line in said(env, None).splitlines() if line != "NA"]
    who = env.describe()["let"]["boss.who"]
    name = {"peers[0]": "Ann", "peers[1]": "Bob"}[who]
    assert heard == [f"Cleo: Give the ball to {name}", f"{name}: the ball is for {name}, not Cleo"]


def test_a_layout_puts_back_what_was_heard(errands: Any) -> None:
    text = str(said(errands, "Give the ball to Ann"))
    state = errands.describe()
    assert state["last"]["said"] == "Give the ball to Ann"
    errands.reset(seed=5, options={"layout": state})
    assert errands.describe() == state, text


def test_an_inbox_holds_what_stood_in_the_slots(tmp_path: Path) -> None:
    # Bob has had his turn when Ann speaks, so what she says waits in his inbox, if he hears before he acts next.
    text = ERRANDS.replace("say: What is <what>", "say: Give <what> to Ann")
    env = made(tmp_path, "waits", text)
    said(env, "Where is the key")
    state = env.describe()
    assert state["pending"] == {"peers[0]": [[3, "peers[1]", {"what": "the key", "whom": "Ann"}]]} or (
        [entry[2] for entry in state["pending"]["peers[0]"]] == [{"what": "the key", "whom": "Ann"}]
    )
    env.reset(seed=5, options={"layout": state})
    assert env.describe() == state


def test_a_suite_has_the_slots_of_its_members_by_name(tmp_path: Path) -> None:
    for name, text in (("errands", ERRANDS), ("numbers", NUMBERS), ("nouns", NOUNS)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    path = tmp_path / "all.yaml"
    path.write_text(
        "suite: all\nmembers: [errands.yaml, numbers.yaml, nouns.yaml]\ngrammar: union\n", encoding="utf-8"
    )
    env: Any = sd.make(str(path)).unwrapped
    slots = env.program.sentences.slots
    assert [slot.name for slot in slots] == ["what", "whom", "n", "hue", "noun"]
    assert slots[0].words == ("the ball", "the key", "a hat", "a coat")
    assert slots[2].words == ("1", "2", "3", "many", "4")
    used = dict(zip(env.program.templates, env.program.sentences.used, strict=True))
    assert used["Hello"] == (False,) * 5, "a template has a noun where it says so"
    assert used["Give <what> to <whom>"] == (True, True, False, False, False)
    heard: dict[str, set[str]] = {}
    for seed in range(20):
        *_, info = env.reset(seed=seed)
        *_, info = env.step(
            env.encode_action((None, "Take 4" if info["member"] == "numbers" else "Where is the key"))
        )
        heard.setdefault(info["member"], set()).add(info["utterance"])
    assert heard == {
        "errands": {"Ann: What is the key\nBob: What is the key"},
        "numbers": {"Ann: That is 8"},
        "nouns": {"NA"},
    }


def test_several_scenarios_in_one_batch_keep_their_own_slots(tmp_path: Path) -> None:
    paths = []
    for name, text in (("numbers", NUMBERS), ("nouns", NOUNS)):
        paths.append(tmp_path / f"{name}.yaml")
        paths[-1].write_text(text, encoding="utf-8")
    programs = [sd.compile(sd.load(str(path))) for path in paths]
    assert [slot.name for slot in mixture(programs).sentences.slots] == ["n", "what", "noun"]
    envs: Any = sd.make_vec([str(path) for path in paths], num_envs=2)
    envs.reset(seed=1)
    assert envs.single_action_space.nvec.tolist() == [8, 2, 4, 3, 2, 2]
    templates = envs.program.templates
    action = np.array(
        [[7, 1, templates.index("Take <n>"), 2, 0, 0], [7, 1, templates.index("Fetch <noun>"), 0, 0, 1]]
    )
    *_, terminated, _, _ = envs.step(action)
    assert terminated.tolist() == [False, True]


def test_a_script_says_what_fills_slots(tmp_path: Path) -> None:
    text = NUMBERS.replace("agent: {place: anywhere}", "agent: {place: anywhere, frame: buy}").replace(
        "frames:\n", "frames:\n  buy: {let: {k: pick(2..4)}, states: {s: {then: [{say: Take <k>}]}}}\n"
    )
    env = made(tmp_path, "buys", text)
    k = env.describe()["let"]["agent.k"]
    assert env.scripted_action().tolist() == [7, 1, 0, k - 2, 0]
    ended = False
    while not ended:
        _, reward, ended, cut, _ = env.step(env.scripted_action())
        assert not cut
    assert reward > 0


def test_language_models_and_people_say_them(errands: Any) -> None:
    language = ActionLanguage(errands.program)
    told = language.instructions("text")
    assert "one of these words for each <what>, <whom>, <n> and <hue> in it" in told
    assert "<whom>: Ann; Bob" in told
    assert language.parse('Act: say "give the key to bob"').action == (None, "Give the key to Bob")
    call = ToolCall("say", '{"template": "Give <what> to <whom>", "what": "the ball", "whom": "Ann"}')
    assert language.parse_calls([call]).action == (None, "Give the ball to Ann")
    assert 'slot-what ::= "the ball" | "the key"' in language.gbnf()
    assert '"Give " slot-what " to " slot-whom' in language.gbnf()
    phrases = Phrases(errands.program.actions, errands.program.sentences)
    assert phrases.sentences()[:3] == ["Give the ball to Ann", "Give the ball to Bob", "Give the key to Ann"]
    assert phrases.completed("forward give the k") == "forward Give the key to Ann"


def test_a_sequence_is_drawn_from_what_can_be_said(tmp_path: Path) -> None:
    text = NUMBERS.replace(
        "frames:\n", "let:\n  dance: {sequence: 8, moves: [left], utterance: {chance: 1}}\nframes:\n"
    )
    env = made(tmp_path, "dance", text.replace("success: ann", "success: t > 29 and ann"))
    seen = set()
    for seed in range(20):
        env.reset(seed=seed)
        seen |= {said for _, said in env.describe()["let"]["dance"]}
    assert seen == {"Take 2", "Take 3", "Take 4", "Fetch a hat", "Fetch a coat"}


def test_the_digest_tells_grammars_apart(tmp_path: Path) -> None:
    def digest(text: str) -> str:
        path = tmp_path / "digest.yaml"
        path.write_text(text, encoding="utf-8")
        return sd.compile(sd.load(str(path))).sha256

    other = NUMBERS.replace("<what>", "<item>").replace("what:", "item:")
    assert len({digest(NUMBERS), digest(other), digest(NUMBERS.replace("2..4", "2..5"))}) == 3
