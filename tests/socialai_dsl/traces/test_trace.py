"""A trace says of an episode what was played, and the JSON Schema of the format is the one that ships."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.episodes import ReplayedPolicy, trace_of
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.traces import Thought, Trace, Tracer, trace_schema
from tests.quick import one_in
from tests.tiny import Folder

SCHEMA = Path(__file__).parents[3] / "docs" / "trace.schema.json"


def scripted(scenario: str, reset: dict[str, Any]) -> list[np.ndarray]:
    env = sd.make(scenario).unwrapped
    env.reset(**reset)
    actions, ended = [], False
    while not ended:
        actions.append(env.scripted_action())
        _, _, terminated, truncated, _ = env.step(actions[-1])
        ended = terminated or truncated
    return actions


def traced(scenario: str, reset: dict[str, Any]) -> Trace:
    env = sd.make(scenario)
    return trace_of(env, scripted(scenario, reset), reset, scenario=scenario, agent="oracle", episode="one")


def state_at(trace: Trace, t: int) -> dict[str, Any]:
    state: dict[str, Any] = {}
    for moment in trace.moments[: t + 1]:
        state |= moment.state
    return state


def codes_at(trace: Trace, t: int) -> np.ndarray:
    """The cells after a step, uint8 (H, W, 4)."""
    cells: dict[int, int] = {}
    room = (0, 0)
    for moment in trace.moments[: t + 1]:
        room = moment.room or room
        cells |= dict(moment.cells)
    width, height = room
    return np.array([trace.looks[cells[k]] for k in range(width * height)], np.uint8).reshape(
        height, width, 4
    )


def test_the_schema_ships_and_holds(update_goldens: bool) -> None:
    text = json.dumps(trace_schema(), indent=2) + "\n"
    if update_goldens:
        SCHEMA.write_text(text, encoding="utf-8")
    assert SCHEMA.read_text(encoding="utf-8") == text
    written = json.loads(traced("talkitout+oracle", {"seed": 3}).as_json())
    jsonschema.validate(written, trace_schema(), jsonschema.Draft202012Validator)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(written | {"format": "socialai-trace/2"}, trace_schema())


def test_what_is_written_can_be_read() -> None:
    trace = traced("talkitout+oracle", {"seed": 3})
    assert Trace.model_validate_json(trace.as_json()) == trace


@pytest.mark.parametrize(
    "scenario",
    [
        "novel/reference_game+oracle",  # several slots, so that an action has more than four numbers
        *one_in(3, ["talkitout+oracle", "cointhief+oracle", "social_env+oracle"], "plays step by step"),
    ],
)
def test_moments_add_up_to_what_the_environment_shows(scenario: str) -> None:
    reset = {"options": {"test_episode": 4}}
    trace = traced(scenario, reset)
    env = sd.make(scenario).unwrapped
    _, info = env.reset(**reset)
    assert trace.moments[0].member == info.get("member")
    reward = 0.0
    for t, action in enumerate(scripted(scenario, reset), start=1):
        observation, gained, *_, info = env.step(action)
        reward += gained
        moment, described = trace.moments[t], env.describe()
        assert np.array_equal(codes_at(trace, t), env.scene().codes)
        assert moment.action == tuple(action)
        assert moment.did == described["last"]["action"]
        assert state_at(trace, t)["agent.at"] == described["agent"]["at"]
        heard = [f"{line.name}: {line.text}" if line.name else line.text for line in moment.heard]
        assert "\n".join(heard) == info["utterance"].replace("NA", "")
        explained = env.explain()
        assert [trace.rules[rule].name for rule in moment.fired] == [
            one["name"] for one in explained["fired"]
        ]
        assert [(trace.rules[rule].at, trace.texts[why]) for rule, why in moment.others] == [
            (one["at"], one["why"]) for one in explained["others"]
        ]
        assert observation["image"][3, 6, :4].tolist() == list(trace.looks[view_at(trace, t)[6 * 7 + 3]])
    ended = trace.moments[-1].ended
    assert ended is not None
    assert (ended.name, ended.success) == (outcome_name(info), info["success"])
    assert sum(moment.reward for moment in trace.moments) == pytest.approx(reward, abs=1e-5)


def view_at(trace: Trace, t: int) -> list[int]:
    return next(moment.view for moment in reversed(trace.moments[: t + 1]) if moment.view is not None)


def test_whoever_speaks_is_known_by_its_place_in_the_cast() -> None:
    lines = [line for moment in traced("talkitout+oracle", {"seed": 3}).moments for line in moment.heard]
    assert lines[0].who == "wizard"
    assert lines[0].name == "Gandalf"
    assert {line.who for line in lines[1:]} <= {"wizard", "honest", "liar"}


def test_a_suite_that_goes_on_to_another_scenario_shows_another_room(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    for name, size in (("one", 5), ("two", 7)):
        folder.write(name, f'room: {{size: {size}}}\noutcome: [{{success: agent.said("Say hello")}}]\n')
    suite = folder.save("acts", "suite: acts\ndraw: in_sequence\nmembers: [one.yaml, two.yaml]\n")
    env = sd.make(str(suite))
    hello = env.unwrapped.encode_action((None, "Say hello"))  # type: ignore[attr-defined]
    trace = trace_of(env, [hello, hello], {"seed": 0}, scenario="acts", agent="person", episode="seed 0")
    assert [moment.member for moment in trace.moments] == ["one", "two", None]
    assert [moment.room for moment in trace.moments] == [(5, 5), (7, 7), None]
    assert trace.moments[-1].ended is not None


def test_a_step_that_is_taken_back_leaves_nothing() -> None:
    env = sd.make("talkitout")
    actions = [np.array([2, 0, 0, 0]), np.array([0, 1, 3, 3]), np.array([2, 0, 0, 0])]
    told = {"scenario": "talkitout", "agent": "person", "episode": "seed 3"}
    straight = trace_of(env, [actions[0], actions[2]], {"seed": 3}, **told)

    tracer = Tracer(env, "talkitout", "person", {})
    tracer.begin("seed 3", *env.reset(seed=3))
    tracer.step(actions[0], *env.step(actions[0]))
    before = env.unwrapped.snapshot()
    tracer.step(actions[1], *env.step(actions[1]))
    tracer.back()
    env.unwrapped.restore(before)
    tracer.step(actions[2], *env.step(actions[2]))
    trace = tracer.trace()
    assert [m.model_dump(exclude={"others"}) for m in trace.moments] == [
        m.model_dump(exclude={"others"}) for m in straight.moments
    ]


def test_what_an_agent_thought_is_beside_what_it_did() -> None:
    thoughts = iter([Thought(probabilities=[[0.25, 0.75]], value=0.5), Thought(probabilities=[[1.0, 0.0]])])
    actions = [np.array([2, 0, 0, 0])] * 2
    trace = trace_of(
        sd.make("talkitout"), actions, {"seed": 3}, scenario="talkitout", agent="net", episode="seed 3",
        think=lambda observation: next(thoughts),
    )  # fmt: skip
    assert trace.moments[0].thought is None
    assert trace.moments[1].thought == Thought(probabilities=[[0.25, 0.75]], value=0.5)
    assert trace.moments[2].thought == Thought(probabilities=[[1.0, 0.0]])


# -- several seats ----------------------------------------------------------------------------------------------------

TOGETHER = "together/levers_together"


def test_a_trace_of_several_seats_has_what_each_of_them_got() -> None:
    found = sd.trace(TOGETHER, agent="random", seats={"partner": "random"}, seed=4)
    env = sd.make(TOGETHER, seats={"agent": "random"}).unwrapped
    assert (found.seats, found.own, found.agent) == (list(env.seats), "agent", "random")
    assert set(found.players) == set(env.seats) - {"agent"}
    other = env.seats[1]
    env = sd.make(
        TOGETHER, seats={"agent": ReplayedPolicy([np.array(one.action) for one in found.moments[1:]])}
    ).unwrapped
    observation, _ = env.reset(seed=4)
    earned, views = 0.0, None
    for t, moment in enumerate(found.moments):
        part = moment.seats[0]
        views = views if part.view is None else part.view
        assert views is not None
        codes = env.view(observation["image"]).codes
        assert [found.looks[number] for number in views] == [
            tuple(code) for row in codes.tolist() for code in row
        ]
        if t + 1 == len(found.moments):
            break
        acts = found.moments[t + 1].seats[0].action
        observation, reward, *_, info = env.step(np.array(acts))
        earned += reward
        heard = [f"{line.name}: {line.text}" for line in found.moments[t + 1].seats[0].heard]
        assert "\n".join(heard) == info["utterance"].replace("NA", "")
        assert found.moments[t + 1].seats[0].reward == pytest.approx(reward, abs=1e-6)
    assert env.seat_names == (other,)
    assert found.moments[-1].seats[0].success is info["success"]
    assert Trace.model_validate_json(found.as_json()) == found
    jsonschema.validate(json.loads(found.as_json()), trace_schema(), jsonschema.Draft202012Validator)


def test_a_script_that_plays_by_itself_is_seen_and_heard_in_a_trace() -> None:
    found = sd.trace(TOGETHER, seed=1)
    assert found.succeeded
    assert found.players == {found.seats[1]: "script"}
    parts = [moment.seats[0] for moment in found.moments[1:]]
    assert all(part.action is None for part in parts)
    assert {"forward", "toggle"} <= {part.did for part in parts}
    assert parts[-1].success
    assert found.names[1] in {line.name for moment in found.moments for line in moment.heard}


def test_the_player_of_another_seat_has_the_success_that_counts(tmp_path: Path) -> None:
    path = tmp_path / "won.yaml"
    path.write_text(
        "scenario: won\nhorizon: 4\nroom: {size: 6}\nactions: [left]\n"
        "grammar: {templates: [Say <noun>], nouns: [hello]}\n"
        "cast: {agent: {}, bob: {seat: open, name: Bob}}\noutcome: [{success: t == 2, for: bob}]\n",
        encoding="utf-8",
    )
    own, other = (sd.trace(str(path), "random", seats={seat: "random"}) for seat in ("agent", "bob"))
    assert (own.own, own.succeeded, own.moments[-1].seats[0].success) == ("bob", True, True)
    assert (other.own, other.succeeded) == ("agent", False)
