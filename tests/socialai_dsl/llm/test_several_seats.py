"""Language models on any seat, alone or beside other models: what each is told, what is kept, and that it goes on."""

from __future__ import annotations

import json
import random
import re
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs.seats import RANDOM, SCRIPT
from socialai_dsl.episodes.players import Player
from socialai_dsl.errors import OptionError, RunFailed, UsageError
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.episode import INVALID, LEFT, scripted_reply
from socialai_dsl.llm.view import LastStep
from socialai_dsl.model_options import ModelOptions
from tests.quick import one_in
from tests.socialai_dsl.llm.endpoint import Stub, endpoint

pytest.importorskip("httpx", reason="language models need the extra llm")

LEVERS = "together/levers_together"
HELP = "together/help_together"
PARTNERS = str(Path(__file__).parents[2] / "data" / "agreement" / "partners.yaml")
TOGETHER = sorted(
    f"together/{path.stem}"
    for path in (Path(__file__).parents[3] / "scenarios" / "together").glob("*_together.yaml")
)


def asked(stub: Stub) -> Any:
    """The options of a model behind this server."""
    return {"base_url": stub.url, "probes": "off"}


def by_chance(seed: int) -> Any:
    """A model that turns and speaks, one of a few replies as the text of the request decides."""

    def respond(request: dict[str, Any]) -> str:
        told = json.dumps([seed, request["messages"][-1]])
        sentences = re.findall(r'say "([^"]*)"', request["messages"][0]["content"])
        chosen = random.Random(told)
        said = f', say "{chosen.choice(sentences)}"' if sentences and chosen.random() < 0.5 else ""
        return f"Act: {chosen.choice(['left', 'right'])}{said}"

    return respond


def transcript(folder: Path, number: int = 0) -> list[dict[str, Any]]:
    path = folder / f"episode-{number:03d}.jsonl"
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


# -- what is told --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", one_in(3, TOGETHER, "plays every scenario of several"))
def test_each_seat_is_told_who_it_is_and_sees_hears_and_wins_as_that_seat(name: str) -> None:
    """Whoever replies on a seat gets what the environment gives to that seat, and plays there alone."""
    scenario = f"{name}+oracle"
    seats = sd.make(name, seats={}).unwrapped.seats
    for own in seats:
        filled = dict.fromkeys((seat for seat in seats if seat != own), RANDOM)
        episode, beside = Episode(scenario, "json", seats=filled), sd.make(scenario, seats=filled)
        view = TextView(beside.unwrapped.program, "json", seat=own)
        text = episode.reset(test_episode=3)
        observation, info = beside.reset(options={"test_episode": 3})
        assert re.search(
            r"You are [^,]+, one of (two|three) players, each with a body of its own", episode.instructions
        )
        last, done = None, False
        while not done:
            assert json.loads(text) == json.loads(view.observe(observation, info, last))
            image = observation["image"].copy()
            turn = episode.step("Act: forward")
            action = beside.unwrapped.encode_action(("forward", None))
            observation, reward, terminated, truncated, info = beside.step(action)
            done = terminated or truncated
            assert (turn.reward, turn.done) == (reward, done)
            last = LastStep("forward", image, info.get("success"))
            text = turn.text
        assert episode.result().success == info["success"]
        episode.close(), beside.close()


def test_the_name_is_that_by_which_others_hear_it_in_this_episode() -> None:
    names, heard_of = set(), set()
    for number in range(16):
        heard = Episode(PARTNERS, seats={"agent": RANDOM})
        heard.reset(test_episode=number)
        (name,) = re.findall(r"You are (\w+), one of two players", heard.instructions)
        other = sd.make(PARTNERS, seats={"helper": Speaker()})
        other.reset(options={"test_episode": number})
        lines: list[str] = []
        ended = False
        while not ended:
            *_, terminated, truncated, info = other.step(other.unwrapped.encode_action((None, None)))
            lines += info["utterance"].split("\n")
            ended = terminated or truncated
        spoke = {line.split(":")[0].split()[-1] for line in lines if "It is mine" in line}
        assert spoke <= {name}
        heard_of |= spoke
        names.add(name)
    assert names == heard_of == {"Hal", "Hui"}


class Speaker:
    """Says `It is mine` in every step."""

    def reset(self, mask: Any, episodes: Any = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Any) -> Any:
        return np.array([[6, 1, 1, 2]])


def test_who_is_gone_sees_what_it_was_told() -> None:
    """It goes into the lava, and the other one plays on."""
    episode = Episode(HELP, seats={"jill": RANDOM})
    episode.reset(test_episode=0)
    assert "Once it is out of the room, you see nothing but walls." in episode.instructions
    for act in ("right", "forward", "left"):
        turn = episode.step(f"Act: {act}")
    assert not turn.done
    seen = [line for line in turn.text.splitlines() if line.startswith("- ")]
    assert len(seen) == 1
    assert seen[0].startswith("- a wall: ")
    assert turn.text.endswith("You hear nothing.")


def test_who_plays_alone_is_told_nothing_of_players() -> None:
    for name in ("talkitout", "help", "social_env"):
        episode = Episode(name)
        episode.reset(seed=0)
        assert "players" not in episode.instructions
        assert "In a turn you move first" in episode.instructions


PUSHED = """\
scenario: pushed
horizon: 9
actions: [left, right, forward]
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {width: 9, height: 9, build: [{wall: column(1)}]}
objects: {ball: {type: ball, at: [6, 2], color: red}}
cast:
  agent: {name: Ann, at: [4, 4], facing: up, pushed_by: anybody}
  bob: {name: Bob, at: [4, 5], facing: up, seat: open}
outcome: [{success: t == 9}]
"""


class Walker:
    """Goes ahead in every step."""

    def reset(self, mask: Any, episodes: Any = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Any) -> Any:
        return np.array([[2, 0, 0, 0]])


def test_who_is_pushed_is_told_where(tmp_path: Path) -> None:
    path = tmp_path / "pushed.yaml"
    path.write_text(PUSHED, encoding="utf-8")
    for style, told in (("prose", "You were pushed 1 step ahead.\n"), ("json", '"pushed": "ahead"')):
        pushed = Episode(str(path), style, seats={"bob": Walker()})  # type: ignore[arg-type]
        pushed.reset(seed=0)
        assert "Who walks into you pushes you one step the same way" in pushed.instructions
        assert told in pushed.step("Act: none").text
        assert told not in pushed.step("Act: none").text, "Bob only comes nearer"
    pusher = Episode(str(path), seats={"agent": RANDOM})
    pusher.reset(seed=0)
    assert "pushes you" not in pusher.instructions, "nobody can push Bob"


def test_nobody_is_told_of_a_push_that_was_none() -> None:
    """What the pictures seem to show agrees with where the body went."""
    env = sd.make(PARTNERS, seats={"helper": RANDOM})
    view = TextView(env.unwrapped.program)
    ways = {"ahead": 0, "to the right": 1, "back": 2, "to the left": 3}
    generator, told = np.random.default_rng(0), 0
    for seed in range(150):
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            before, image = env.unwrapped.describe()["agent"], observation["image"].copy()
            movement = generator.choice(["left", "right", "forward", "none"])
            action = env.unwrapped.encode_action((None if movement == "none" else movement, None))
            observation, _, terminated, truncated, info = env.step(action)
            ended, after = terminated or truncated, env.unwrapped.describe()["agent"]
            text = view.observe(observation, info, LastStep(None if movement == "none" else movement, image))
            found = re.match(r"(?:You did not move\.\n)?You were pushed 1 step ([a-z ]+)\.", text)
            if found is None:
                continue
            told += 1
            facing = ["right", "down", "left", "up"].index(after["facing"])
            way = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)][(facing + ways[found[1]]) % 4])
            gone = np.array(after["at"]) - np.array(before["at"])
            walked = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)][facing]) * (movement == "forward")
            assert gone.tolist() in ((way + walked).tolist(), way.tolist())
    assert told


# -- evaluation ----------------------------------------------------------------------------------------------------


def test_a_model_beside_scripts_does_what_the_script_does(tmp_path: Path) -> None:
    """The model plays the agent's script through text; its partner is the script of the other seat."""
    playing: dict[str, Episode] = {}
    for number in range(3):
        episode = Episode(f"{LEVERS}+oracle", seats={"partner": SCRIPT})
        playing[episode.reset(test_episode=number)] = episode

    def respond(request: dict[str, Any]) -> str:
        episode = playing[request["messages"][1]["content"]]
        reply = scripted_reply(episode)
        episode.step(reply)
        return reply

    expected = sd.evaluate("oracle", LEVERS, 3, seats={"partner": "script"}).result
    with endpoint(respond) as stub:
        found = sd.evaluate("llm:stub", LEVERS, 3, out=tmp_path, seats={"partner": "script"}, **asked(stub))
    assert found.result.success.tolist() == expected.success.tolist() == [True] * 3
    assert found.result.lengths.tolist() == expected.lengths.tolist()
    assert found.result.others["partner"][0].tolist() == expected.others["partner"][0].tolist()


@pytest.mark.parametrize("partner", ["script", "random"])
def test_what_a_model_plays_on_another_seat_is_kept_and_goes_on(partner: str, tmp_path: Path) -> None:
    with endpoint(by_chance(1)) as stub:
        options = {"out": tmp_path, "record": 1, "seats": {"agent": partner}, **asked(stub)}
        found = sd.evaluate("llm:stub", HELP, 3, **options)
        count = len(stub.requests)
        again = sd.evaluate("llm:stub", HELP, 3, **options)
        assert len(stub.requests) == count, "what was played is read from the transcripts"
    assert found.seat == "jill"
    assert np.array_equal(found.result.lengths, again.result.lengths)
    settings = json.loads((tmp_path / "help_together/transcripts/settings.json").read_text("utf-8"))
    assert (settings["seat"], settings["players"]) == ("jill", {"agent": partner, "jill": "llm:stub"})
    result = json.loads((tmp_path / "help_together/result.json").read_text("utf-8"))
    assert (result["seat"], result["eval"]["seats"].keys()) == ("jill", {"agent"})
    traces = sd.replay(tmp_path / "help_together", test_episodes=[0, 1, 2])
    for number, trace in enumerate(traces):
        assert (trace.own, trace.agent, trace.players) == ("jill", "llm:stub", {"agent": partner})
        assert len(trace.moments) - 1 == found.result.lengths[number]
        assert [reply.seat for reply in trace.moments[1].replies] == [None], "what the model answered"


def test_models_play_with_models_and_hear_each_other(tmp_path: Path) -> None:
    """Each has a transcript of its own; what one says the other is told, and both play the same episodes."""
    with endpoint(by_chance(1)) as stub:
        options = {"out": tmp_path, "record": 1, "seats": {"jill": "llm:other"}, **asked(stub)}
        found = sd.evaluate("llm:stub", HELP, 3, **options)
        count = len(stub.requests)
        assert sd.evaluate("llm:stub", HELP, 3, **options).figures() == found.figures()
        assert len(stub.requests) == count
    assert {request["model"] for request in stub.requests} == {"stub", "other"}
    kept = tmp_path / "help_together/transcripts"
    said = 0
    for number in range(3):
        agent, jill = transcript(kept, number), transcript(kept / "jill", number)
        assert len(agent) == len(jill) == found.result.lengths[number]
        for teller, hearer, name in ((agent, jill, "Ann"), (jill, agent, "Jill")):
            for record, later in zip(teller, hearer[1:], strict=False):
                words = re.search(r'say "(.*)"', record["reply"])
                assert (f"- {name}: " in later["observation"]) == (words is not None)
                assert words is None or f"- {name}: {words[1]}" in later["observation"]
                said += words is not None
    assert said
    figures = found.figures()
    assert figures["models"]["jill"]["replies"] == figures["replies"] == count // 2
    (trace,) = sd.replay(tmp_path / "help_together", test_episodes=[1])
    assert len(trace.moments) - 1 == found.result.lengths[1]
    for moment, *records in zip(
        trace.moments[1:], transcript(kept, 1), transcript(kept / "jill", 1), strict=True
    ):
        answers = [(reply.seat, reply.text) for reply in moment.replies]
        assert answers == [(seat, one["reply"]) for seat, one in zip(("agent", "jill"), records, strict=True)]


def test_all_models_of_a_room_are_asked_at_once(tmp_path: Path) -> None:
    both = threading.Barrier(2, timeout=20)

    def respond(request: dict[str, Any]) -> str:
        both.wait()
        return "Act: done"

    with endpoint(respond) as stub:
        options = {"out": tmp_path, "seats": {"jill": "llm:other"}, "concurrency": 1, **asked(stub)}
        found = sd.evaluate("llm:stub", HELP, 1, **options)
    assert found.figures()["replies"] == found.figures()["models"]["jill"]["replies"] == 1


def test_a_model_may_be_the_partner_of_who_is_none(tmp_path: Path) -> None:
    with endpoint(by_chance(2)) as stub:
        partner = Player("llm:other", options=ModelOptions(base_url=stub.url, history=3), out=tmp_path)
        found = sd.evaluate("random", HELP, 2, out=tmp_path, seats={"jill": partner}, seed=5)
        alone = sd.evaluate("random", HELP, 2, seats={"jill": "random"}, seed=5)
    assert found.seat == "agent"
    assert "replies" not in found.figures()
    assert found.figures()["models"]["jill"]["replies"] == found.result.lengths.sum()
    assert [len(request["messages"]) for request in stub.requests if len(request["messages"]) > 6] == []
    for one, other in zip(found.actions[0], alone.actions[0], strict=False):
        assert one[0].tolist() == other[0].tolist(), "chance draws what it draws beside others"
    (trace,) = sd.replay(tmp_path / "help_together", test_episodes=[1])
    assert (trace.agent, trace.players) == ("random", {"jill": "llm:other"})
    assert [reply.seat for reply in trace.moments[1].replies] == ["jill"]
    assert len(trace.moments) - 1 == found.result.lengths[1]


def test_who_gives_no_action_ends_the_episode_for_all(tmp_path: Path) -> None:
    def respond(request: dict[str, Any]) -> str:
        return "Hm." if request["model"] == "other" and len(request["messages"]) > 4 else "Act: left"

    with endpoint(respond) as stub:
        options = {"out": tmp_path, "on_invalid": "fail", "record": 2, **asked(stub)}
        left = sd.evaluate("llm:stub", HELP, 2, seats={"jill": "llm:other"}, **options)
        own = sd.evaluate(
            "llm:other", HELP, 2, seats={"agent": "llm:stub"}, **{**options, "out": tmp_path / "own"}
        )
    assert left.figures()["outcomes"][LEFT] == own.figures()["outcomes"][INVALID] == 1
    assert left.result.lengths.tolist() == own.result.lengths.tolist() == [2, 2]
    assert not own.result.others["agent"][0].any()
    for place in (tmp_path, tmp_path / "own"):
        (trace,) = sd.replay(place / "help_together", test_episodes=[1])
        assert len(trace.moments) == 4, "the start, two steps, and the end without one"


def test_each_model_has_a_budget_of_its_own(tmp_path: Path) -> None:
    """Twelve tokens a reply; what one has spent takes nothing from the other."""
    with endpoint(lambda _: "Act: left") as stub:
        options = {"out": tmp_path, "seats": {"jill": "llm:other"}, "concurrency": 1, **asked(stub)}
        with pytest.raises(RunFailed, match="1 of 2 episodes are over"):
            sd.evaluate("llm:stub", HELP, 2, budget=str(12 * 25), **options)
        counts = [sum(request["model"] == name for request in stub.requests) for name in ("stub", "other")]
        assert 25 <= min(counts) <= max(counts) <= 26
        found = sd.evaluate("llm:stub", HELP, 2, budget=str(12 * 25), **options)
    assert found.result.episodes == 2


PROBED = f"""\
{PUSHED}
probes:
  where: {{when: t == 2, ask: Is Ann beside Bob?, answer: agent.next_to(bob)}}
  heard: {{when: t == 3, ask: Did Bob speak?, answer: bob.said("Say hello")}}
"""


def test_probes_are_asked_on_every_seat(tmp_path: Path) -> None:
    path = tmp_path / "pushed.yaml"
    path.write_text(PROBED, encoding="utf-8")
    loaded = sd.load(str(path))
    for own, other in (("agent", "bob"), ("bob", "agent")):
        episode = Episode(str(path), probes=loaded, seats={other: RANDOM})
        episode.reset(seed=3)
        done = False
        while not done:
            done = episode.step('Act: forward, say "Say hello"').done
            while (question := episode.question) is not None:
                episode.answer(f"Answer: {question.right}")
        right = {one.question.probe: one.question.right for one in episode.answered}
        assert right.keys() == {"where", "heard"}
        assert own == "agent" or right["heard"] == "yes"


# -- mistakes ------------------------------------------------------------------------------------------------------


def test_a_seat_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match="seat: got 'jil', expected one of agent, jill"):
        TextView(sd.compile(sd.load(HELP)), seat="jil")
    with pytest.raises(ValueError, match="did you mean 'jill'"):
        Episode(HELP, seats={"jil": RANDOM})


def test_options_of_models_need_a_model(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="history: the agent 'random' has no use for it"):
        sd.evaluate("random", HELP, 1, history=3, seats={"jill": "random"})
    with pytest.raises(OptionError, match="got 'human' for jill, expected a player who needs no terminal"):
        sd.evaluate("random", HELP, 1, seats={"jill": "human"})


def test_a_folder_holds_episodes_with_the_same_players(tmp_path: Path) -> None:
    with endpoint(lambda _: "Act: left") as stub:
        sd.evaluate("llm:stub", HELP, 1, out=tmp_path, seats={"jill": "script"}, **asked(stub))
        with pytest.raises(ValueError, match="played with another players; choose another folder"):
            sd.evaluate("llm:stub", HELP, 1, out=tmp_path, seats={"jill": "random"}, **asked(stub))


class Moody:
    """Acts otherwise each time it is asked."""

    def __init__(self) -> None:
        self._generator = np.random.default_rng()

    def reset(self, mask: Any, episodes: Any = None) -> None:
        """Nothing to forget."""

    def act(self, observation: Any) -> Any:
        return self._generator.integers(0, [8, 2, 2, 2], (len(observation["tokens"]), 4))


def test_a_transcript_is_not_mixed_with_an_episode_that_goes_another_way(tmp_path: Path) -> None:
    """What was played can be looked at, and it is said that it cannot go on."""
    with endpoint(lambda _: "Act: left") as stub:
        options = {
            "out": tmp_path,
            "record": 0,
            "seats": {"jill": Player("moody", policy=Moody())},
            **asked(stub),
        }
        found = sd.evaluate("llm:stub", HELP, 2, **options)
        with pytest.raises(
            UsageError, match=r"tells of an episode that goes another way now.*another folder"
        ):
            sd.evaluate("llm:stub", HELP, 2, **options)
    traces = sd.replay(tmp_path / "help_together", test_episodes=[0, 1])
    assert [len(trace.moments) - 1 for trace in traces] == found.result.lengths.tolist()


def test_who_is_not_to_know_the_own_seat_is_not_told_it() -> None:
    """As the pictures of hidden seats do not tell players apart, what is written does not either."""
    shown, hidden = (
        sd.compile(sd.load(f"together/turn_taking_together{variant}")) for variant in ("", "+alike")
    )
    names = {"agent": "Ann", "partner": "Bob"}
    told = {
        program.sha256: [TextView(program, seat=seat).explanation(name) for seat, name in names.items()]
        for program in (shown, hidden)
    }
    assert len(set(told[shown.sha256])) == 2
    assert len(set(told[hidden.sha256])) == 1
    assert not any(name in told[hidden.sha256][0] for name in names.values())
