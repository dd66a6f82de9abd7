"""Layouts: everything an episode can be described by can be put back, and what does not fit is named."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.loader.resolved import shipped_names
from socialai_dsl.program import ENTITY_FIELDS, FIRST_ENTITY, Field, Flag, Header, Register
from tests.quick import one_in

DATA = Path(__file__).parents[2] / "data"
WORKSHOP = f"{DATA}/workshop.yaml"
LANGUAGE = sorted(str(path) for path in (DATA / "agreement").glob("*.yaml"))
PLAYROOM = f"{DATA}/playroom.yaml"
SUITES = [f"{DATA}/suites/{name}.yaml" for name in ("pair", "school", "acts")]
NAMES = [*shipped_names(), *LANGUAGE, WORKSHOP, PLAYROOM, *SUITES]
FLEETING = {
    Register.HEARD,
    Register.SAID_LINE,
    Register.LAST_TURN,
    Register.CHANGED,
    Register.ACCEPTED,
    Register.ATTEMPT,
    Register.BONUS,
}


def some_action(env: ScenarioEnv, rng: np.random.Generator) -> np.ndarray:
    """Any action, walking and keeping silent more often than not."""
    action = rng.integers(env.action_space.nvec)
    if rng.random() < 0.7:
        action[0] = rng.integers(3)
    action[1] = rng.random() < 0.3
    return action


def wander(env: ScenarioEnv, steps: int, rng: np.random.Generator) -> None:
    """Play on, never over the end of the episode."""
    for _ in range(steps):
        before = env.snapshot()
        *_, terminated, truncated, _ = env.step(some_action(env, rng))
        if terminated or truncated:
            env.restore(before)


def differences(one: ScenarioEnv, other: ScenarioEnv) -> list[str]:
    """Registers that decide how the episode goes on and are not equal."""
    program = one._table.program(0)
    first, second = (env._table.state.registers[0] for env in (one, other))
    fleeting = set(map(int, FLEETING))
    # Lines of one text have several numbers, and `describe` tells texts.
    for start, size in ((Header.HEARD, Header.HEARD_SIZE), (Header.LOG, Header.LOG_SIZE)):
        fleeting |= set(range(program.header(start), program.header(start) + program.header(size)))
    fleeting |= {name.register for name in program.registers if name.fleeting}
    for number in range(len(program.entities)):
        base = FIRST_ENTITY + ENTITY_FIELDS * number
        fleeting.add(base + Field.LAST)
        if first[base + Field.GONE]:
            fleeting |= {base + Field.X, base + Field.Y}
    names = {name.register: name.path for name in program.registers}
    return [
        names.get(i, f"register {i}") for i in np.flatnonzero(first != second).tolist() if i not in fleeting
    ]


@pytest.mark.parametrize("name", one_in(5, NAMES, "plays a dozen rooms of every scenario"))
def test_every_moment_can_be_described_and_put_back(name: str) -> None:
    """The same state, the same picture, and with the same key of randomness the same future."""
    rng = np.random.default_rng(7)
    env, other = sd.make(name), sd.make(name)
    for seed in range(12):
        env.reset(seed=seed)
        wander(env, int(rng.integers(0, 20)) if seed % 3 else 0, rng)
        state = env.describe()
        assert json.loads(json.dumps(state)) == state
        observation, info = other.reset(seed=seed, options={"layout": state})
        assert other.describe() == state
        assert differences(env, other) == []
        assert info["history"] == "\n".join(state["heard"])
        assert np.array_equal(observation["tokens"], env._observation()["tokens"])
        early = env._table.program(0).header(Header.FLAGS) & Flag.PICTURE_BEFORE_NPCS
        if not (early and state["t"]):  # such a picture shows an earlier moment of the step
            assert np.array_equal(observation["image"], env._observation()["image"])
        for _ in range(15):
            action = some_action(env, rng)
            expected, found = env.step(action), other.step(action)
            assert found[1:] == expected[1:]
            assert all(np.array_equal(found[0][key], expected[0][key]) for key in expected[0])
            assert other.describe() == env.describe()
            if expected[2] or expected[3]:
                break


@pytest.mark.parametrize("name", one_in(5, NAMES, "plays a dozen rooms of every scenario"))
def test_a_described_room_is_a_layout_for_any_seed(name: str) -> None:
    env, other = sd.make(name), sd.make(name)
    for seed in range(10):
        env.reset(seed=seed)
        state = env.describe()
        other.reset(seed=1000 + seed, options={"layout": state})
        assert other.describe() == state


def started(name: str, **layout: Any) -> dict[str, Any]:
    env = sd.make(name)
    env.reset(seed=1, options={"layout": layout})
    return env.describe()


def test_sequences_are_lists_of_moves_and_utterances() -> None:
    dance = [["left", None], ["forward", "Move your body"], ["right", "Shake your head"]]
    assert started("dance", let={"dance": dance})["let"]["dance"] == dance
    drawn = {str(started_with(seed, let={"dance": dance[:1]})[1:]) for seed in range(30)}
    assert len(drawn) > 10
    assert all(started_with(seed, let={"dance": [None, dance[1]]})[1] == dance[1] for seed in range(3))


def started_with(seed: int, **layout: Any) -> Any:
    env = sd.make("dance")
    env.reset(seed=seed, options={"layout": layout})
    return env.describe()["let"]["dance"]


def test_a_pinned_dance_is_danced_and_repeated() -> None:
    env = sd.make("dance")
    dance = [["left", None], ["right", "Move your head"], ["forward", None]]
    env.reset(seed=0, options={"layout": {"let": {"dance": dance}}})
    heard = [env.step(env.encode_action((None, None)))[4]["utterance"] for _ in range(5)]
    assert [text.removeprefix("Ren: ") for text in heard] == [
        "Look at me!",
        "NA",
        "Move your head",
        "NA",
        "Now repeat my moves!",
    ]
    for move, said in dance:
        *_, terminated, _, info = env.step(env.encode_action((move, said)))
    assert terminated
    assert info["success"]


def test_a_memory_can_be_filled_beforehand() -> None:
    env = sd.make("dance")
    dance = [["left", None], ["right", "Move your head"], ["forward", None]]
    watching = {"state": "watching", "clock": 1}
    env.reset(
        seed=0,
        options={
            "layout": {"t": 9, "dancer": watching, "let": {"dance": dance}, "memory": {"attempt": dance[:2]}}
        },
    )
    assert env.describe()["memory"] == {"attempt": dance[:2]}
    *_, info = env.step(env.encode_action(("forward", None)))
    assert info["success"]


def test_which_file_a_member_of_the_cast_is() -> None:
    for name in ("teacher_03", "teacher_00", "teacher_11"):
        state = started("diverse_exit", one_of={"teacher": name})
        assert state["one_of"] == {"teacher": name}
    observation = sd.make("diverse_exit").reset(
        seed=0,
        options={
            "layout": {
                "room": {"width": 7, "height": 7},
                "agent": {"at": [3, 3], "facing": "up"},
                "teacher": {"at": [3, 2]},
                "one_of": {"teacher": "teacher_03"},
            }
        },
    )[0]
    assert observation["image"][3, 5].tolist()[::2] == [11, 3]


def test_initial_statuses_follow_what_is_given() -> None:
    assert started(WORKSHOP, lamps=[{"state": "pressed"}])["lamps"][0]["initial"] == "pressed"
    given = started(WORKSHOP, lamps=[{"state": "pressed", "initial": "idle"}])["lamps"][0]
    assert (given["state"], given["initial"]) == ("pressed", "idle")


def test_cells_are_pairs_or_nowhere() -> None:
    assert started(WORKSHOP, let={"spot": [3, 2]})["let"]["spot"] == [3, 2]
    assert started(WORKSHOP, let={"spot": "nowhere"})["let"]["spot"] == "nowhere"


def test_what_the_agent_did_last_belongs_to_the_moment() -> None:
    env = sd.make("talkitout")
    env.reset(seed=1, options={"layout": {"agent": {"at": [2, 2], "facing": "up"}, "wizard": {"at": [2, 1]}}})
    assert "last" not in env.describe()
    env.step(env.encode_action((None, "Open the sofa")))
    assert env.describe()["last"] == {"action": "none", "said": "Open the sofa", "poked": None}
    other = sd.make("talkitout")
    other.reset(seed=2, options={"layout": env.describe()})
    assert differences(env, other) == []


@pytest.mark.parametrize(
    ("name", "layout", "message"),
    [
        ("dance", {"let": {"dance": "left"}}, r"let.dance: got 'left'; expected a list of at most 3"),
        ("dance", {"let": {"dance": [["left", None]] * 4}}, r"let.dance: got .*; expected a list of at most 3"),
        ("dance", {"let": {"dance": [["up", None]]}}, r"let.dance\[0\]\[0\]: got 'up'; expected one of left"),
        ("dance", {"let": {"dance": [["left"]]}}, r"let.dance\[0\]: got \['left'\]; expected \[move, utterance\]"),
        (
            "dance",
            {"let": {"dance": [["left", "Move your arm"]]}},
            r"let.dance\[0\]\[1\]: got 'Move your arm', which the grammar cannot say",
        ),
        ("dance", {"let": {"dance": [["left", 3]]}}, r"let.dance\[0\]\[1\]: got 3; expected a text"),
        ("dance", {"let": {"dance": [["left", [0, 9]]]}}, r"let.dance\[0\]\[1\]\[1\]: got 9; expected a whole number"),
        ("dance", {"let": {"dnce": []}}, r"let: there is no 'dnce'; did you mean 'dance'"),
        ("dance", {"memory": {"attempts": []}}, r"memory: there is no 'attempts'; did you mean 'attempt'"),
        ("dance", {"memory": {"attempt": [["left", None]] * 4}}, r"memory.attempt: got .* at most 3"),
        ("dance", {"one_of": {"dancer": "a"}}, r"one_of: 'dancer' is not drawn"),
        ("diverse_exit", {"one_of": {"teacher": "teacher_12"}}, r"one_of.teacher: got 'teacher_12'; expected one of"),
        ("diverse_exit", {"one_of": "teacher_01"}, r"one_of: got 'teacher_01'; expected a mapping"),
        ("showme", {"switches": [{"initial": "idle"}]}, r"switches\[0\].initial: got 'idle', but .* does not draw it"),
        ("showme", {"last": {"action": "jump"}}, r"last.action: got 'jump'"),
        ("showme", {"last": {"poked": "joe"}}, r"last.poked: got 'joe'"),
        ("showme", {"last": {"heard": "joe"}}, r"last: there is no 'heard'"),
        (WORKSHOP, {"let": {"spot": [1]}}, r"let.spot: got \[1\]; expected \[x, y\]"),
        (WORKSHOP, {"let": {"spot": [30, 1]}}, r"let.spot\[0\]: got 30; expected a whole number from 0"),
        (WORKSHOP, {"lamps": [{"initial": "shut"}]}, r"lamps\[0\].initial: got 'shut'; expected one of"),
        (WORKSHOP, {"pending": {"nobody": [1]}}, r"pending: there is no 'nobody'"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(name: str, layout: Any, message: str) -> None:
    env = sd.make(name)
    with pytest.raises(ValueError, match=message):
        env.reset(seed=0, options={"layout": layout})


def test_the_example_of_the_documentation() -> None:
    text = (Path(__file__).parents[3] / "docs" / "layouts.md").read_text()
    example = text.partition("```python\n")[2].partition("```")[0]
    names: dict[str, Any] = {}
    exec(compile(example, "docs/layouts.md", "exec"), names)
    state = names["env"].describe()
    assert state["room"] == {"width": 6, "height": 7}
    assert state["honest"]["name"] == "John"
    assert state["doors"][2]["state"] == "open"
    assert state["let"]["exit"] == "doors[0]"


def test_gestures_beliefs_contents_and_registers_of_the_world_are_given_by_name() -> None:
    state = started(
        PLAYROOM,
        peers=[{"at": [1, 1], "pointing": "left", "last": "point"}, {"at": [2, 2], "pointing": [5, 4]}],
        child={"believes": {"where": "boxes[1]"}},
        toy={"inside": "boxes[1]"},
        lever={"state": "up", "timer": 2},
        state={"asked": 3},
        let={"peers[1].given": 2},
    )
    assert [peer["pointing"] for peer in state["peers"]] == ["left", [5, 4]]
    assert state["peers"][0]["last"] == "point"
    assert state["child"]["believes"] == {"where": "boxes[1]"}
    assert (state["toy"]["inside"], state["toy"]["gone"]) == ("boxes[1]", True)
    assert (state["lever"]["state"], state["lever"]["timer"]) == ("up", 2)
    assert state["state"] == {"asked": 3, "opened_first": False}
    assert state["let"]["peers[1].given"] == 2
    assert state["gate"]["state"] == "open"


def test_what_was_taken_out_of_something_lies_where_it_is_put() -> None:
    state = started(PLAYROOM, toy={"inside": "boxes[0]", "at": [4, 4]}, boxes=[{"gone": True}])
    assert state["toy"]["at"] == [4, 4]
    assert "gone" not in state["toy"]


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        (
            {"peers": [{"pointing": "north"}]},
            r"peers\[0\].pointing: got 'north'; expected one of right, down",
        ),
        (
            {"peers": [{"pointing": [9, 1]}]},
            r"peers\[0\].pointing\[0\]: got 9; expected a whole number from 0 to 8",
        ),
        ({"peers": [{"last": "sing"}]}, r"peers\[0\].last: got 'sing'; expected one of left"),
        ({"child": {"believes": {"who": "toy"}}}, "child.believes: there is no 'who'; expected one of where"),
        ({"agent": {"believes": {"who": "toy"}}}, "agent.believes: there is no 'who'"),
        ({"toy": {"inside": "bag"}}, "toy.inside: got 'bag'"),
        ({"lever": {"timer": 9}}, "lever.timer: got 9; expected a whole number from 0 to 4"),
        ({"state": {"aksed": 1}}, "state: there is no 'aksed'; did you mean 'asked'"),
        ({"state": {"asked": 9}}, "state.asked: got 9; expected a whole number from 0 to 5"),
        (
            {"pending": {"peers[0]": [2]}},
            r"pending.peers\[0\]\[0\]: got 2; expected \[class, speaker, noun\]",
        ),
        ({"pending": {"peers[0]": [[2, "nobody", None]]}}, r"pending.peers\[0\]\[0\]\[1\]: got 'nobody'"),
        ({"pending": {"peers[0]": [[2, "agent", "pink"]]}}, r"pending.peers\[0\]\[0\]\[2\]: got 'pink'"),
    ],
)
def test_what_does_not_fit_in_a_playroom_is_named(layout: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        started(PLAYROOM, **layout)
