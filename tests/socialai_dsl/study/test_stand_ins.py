"""Agents, rivals and language models have seats and take them over; the data say who chose, and nobody is stuck."""

from __future__ import annotations

import asyncio
import random
import shlex
import shutil
from collections import Counter
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl.checking.studies import LoadedStudy
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.errors import UsageError
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.study.live import Live
from socialai_dsl.study.log import FILE, read_log
from socialai_dsl.study.players import agent_of
from socialai_dsl.study.replay import study_data
from socialai_dsl.trainer.shipped import agents_folder
from tests.socialai_dsl.llm.endpoint import Stub, endpoint
from tests.socialai_dsl.study.participants import Clock, Taking, loaded_study, meet, newcomer, pass_time, run

HELP = """\
study: stand_ins
consent: I agree.
blocks:
- scenario: together/help_together
  episodes: 1
  seats: {agent: person, jill: person}
  stands_in: WHO
  away: 5
  act_within: 20
"""
LEVERS = HELP.replace("help_together", "levers_together").replace("jill", "partner")
BESIDE = """\
study: beside
consent: I agree.
blocks:
- {scenario: together/help_together, episodes: 2, seats: {jill: "llm:stub"}, act_within: 20}
"""


def steps(folder: Path) -> list[dict[str, Any]]:
    return [event for event in read_log(folder / FILE) if event["event"] == "step"]


async def play_an_episode(loaded: LoadedStudy, folder: Path) -> None:
    """One person turns left until the episode ends."""
    live = Live(loaded, folder)
    one = await newcomer(live)
    await one.go()
    while not one.now.get("ended"):
        await one.act("left")
    await live.close()


async def until_true(found: Any) -> None:
    """Let others go on, such as a model's server, until something holds."""
    while not found():
        await asyncio.sleep(0.01)


def model(text: str, stub: Stub, **more: Any) -> str:
    options = "".join(f", {name}: {value}" for name, value in more.items())
    return text + f'model: {{base_url: "{stub.url}"{options}}}\n'


# -- who may be named ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "code", "cure"),
    [
        (LEVERS.replace("WHO", "{agent: 'rival:hurry'}"), "S201", "hurries"),
        (LEVERS.replace("WHO", "'rival:hurries'"), "S703", "stands_in: {agent: rival:hurries}"),
        (LEVERS.replace("WHO", "{partner: 'rival:hurries'}"), "S703", "one of script"),
        (HELP.replace("WHO", "shipped:hlep"), "S703", "shipped:help"),
        (HELP.replace("WHO", "'llm:'"), "S703", "llm:MODEL"),
        (HELP.replace("WHO", "person"), "S703", "one of script"),
        (HELP.replace("WHO", "{jil: random}"), "S201", "jill"),
        (
            BESIDE.replace("llm:stub", "random").replace("seats", "stands_in: {jill: script}, seats"),
            "S107",
            "",
        ),
        (BESIDE + "model: {mode: json, grammar: true}\n", "S104", ""),
    ],
)
def test_who_cannot_play_is_found_in_the_file_with_a_cure(
    text: str, code: str, cure: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as caught:
        loaded_study(text, tmp_path)
    found = [d for d in caught.value.diagnostics if d.code == code]
    assert found, [str(d) for d in caught.value.diagnostics]
    assert cure in f"{found[0].hint} {found[0].suggestion}"


def test_a_folder_in_which_somebody_else_played_is_no_trained_agent(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    import socialai_dsl as sd

    sd.evaluate("random", "help", 1, out=tmp_path / "chance", record=0)
    loaded = loaded_study(HELP.replace("WHO", "chance/help"), tmp_path)
    (tmp_path / "out").mkdir()
    with pytest.raises(UsageError, match="chance/help"):
        Live(loaded, tmp_path / "out")


# -- rivals and trained agents -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "seat", "who"),
    [
        (LEVERS.replace("WHO", "{agent: 'rival:hurries'}"), "agent", "rival:hurries"),
        (LEVERS.replace("WHO", "{partner: random}"), "agent", "script"),
        (HELP.replace("WHO", "{agent: shipped:help, jill: shipped:help_as_helper}"), "agent", "shipped:help"),
        (HELP.replace("WHO", "shipped:help_as_helper"), "jill", "shipped:help_as_helper"),
    ],
)
def test_whom_the_file_names_takes_over_in_the_middle_of_an_episode_and_hands_back(
    text: str, seat: str, who: str, place: Path, tmp_path: Path
) -> None:
    if "shipped" in who:
        pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    loaded = loaded_study(text, place)

    async def leave() -> None:
        clock = Clock()
        live = Live(loaded, tmp_path, clock)
        by_seat = await meet(live)
        leaves = by_seat.pop(seat)
        (stays,) = by_seat.values()
        for one in (stays, leaves):
            await one.act("left")
        assert leaves.page is not None
        live.go(leaves.page)
        await pass_time(live, clock, 6, stays)
        for _ in range(3):
            await stays.act("left")
        back = await Taking(live, leaves.person).come()
        await live.tick()
        for one in (stays, back):
            await one.act("left")
        await live.close()

    run(leave)
    assert [event["by"][seat] for event in steps(tmp_path)] == ["person", who, who, who, "person"]
    assert study_data(loaded, tmp_path).unended == 1, "it was played again as far as it went"


@pytest.mark.parametrize(
    ("scenario", "who"), [("help", "shipped:help"), ("together/help_together", "shipped:help")]
)
def test_an_agent_that_takes_over_remembers_what_came_before(scenario: str, who: str) -> None:
    """It acts as if it had watched from the start, which it then did: the memory of the one is that of the other."""
    pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    from socialai_dsl.frontend import load

    arena, rng = Arena(load(scenario)), random.Random(2)

    def episode() -> Episode:
        env = arena.take()
        made = {"agent": lambda: agent_of(who, Path(), env)}
        begun = Episode(arena, made, env)
        begun.begin({"seed": 3}, "g1 0")
        return begun

    watches, comes = episode(), episode()
    chosen = []
    for _ in range(12):
        chosen.append(watches.chosen("agent", who))
        act = arena.action(watches.rooms, rng.choice(["left", "right", "forward"]), None)
        acts = {seat: act if seat == "agent" else None for seat in arena.seats}
        watches.step(acts)
        comes.step(acts)
    assert comes.acting == {}, "nothing is computed for an agent that is not needed"
    assert comes.chosen("agent", who) == watches.chosen("agent", who)
    memory = comes.acting["agent"].state()["memory"]
    assert (memory == watches.acting["agent"].state()["memory"]).all()
    late = agent_of(who, Path(), comes.env)
    late.act(comes.rooms.seen["agent"])
    assert not np.allclose(late.state()["memory"], memory), "one that has only seen the end knows less"
    assert len({tuple(one or ()) for one in chosen}) > 1


def test_an_agent_that_takes_over_remembers_its_session() -> None:
    """It knows of the episode before what one knows that was there, and its random numbers go on."""
    pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    from socialai_dsl.frontend import load

    arena, who = Arena(load("help")), "shipped:help"
    watches, comes, forgets = (
        Episode(arena, {"agent": partial(agent_of, who, Path(), env)}, env)
        for env in (arena.take(), arena.take(), arena.take())
    )
    for number in range(2):
        for one in (watches, comes):
            one.begin({"options": {"test_episode": [number]}}, f"g1 {number}")
        while number == 0 and watches.ending is None:
            acts = {"agent": watches.chosen("agent", who)}
            for one in (watches, comes):
                one.step(acts)
    assert (comes.t, comes.heard, comes.acting) == (0, {seat: [] for seat in arena.seats}, {})
    forgets.begin({"options": {"test_episode": [1]}}, "g1 1")
    chosen = [one.chosen("agent", who) for one in (watches, comes, forgets)]
    memories = [one.acting["agent"].state()["memory"] for one in (watches, comes, forgets)]
    assert chosen[0] == chosen[1]
    assert (memories[0] == memories[1]).all()
    assert not np.allclose(memories[1], memories[2])


def test_a_rival_has_the_agents_seat_from_the_start(place: Path, tmp_path: Path) -> None:
    text = LEVERS.replace("agent: person", "agent: 'rival:hurries'").replace("  stands_in: WHO\n", "")
    loaded = loaded_study(text, place)
    run(partial(play_an_episode, loaded, tmp_path))
    assert {event["by"]["agent"] for event in steps(tmp_path)} == {"rival:hurries"}
    moves = Counter(event["acts"]["agent"][0] for event in steps(tmp_path))
    assert len(moves) > 1, "it does something"
    (row,) = study_data(loaded, tmp_path).tables["episodes"]
    assert row["others"] == "agent=rival:hurries"


def test_the_column_of_the_others_names_an_agent_in_a_folder_with_a_blank(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    shutil.copytree(agents_folder() / "help_as_helper", tmp_path / "two agents" / "jill")
    loaded = loaded_study(
        BESIDE.replace("llm:stub", "two agents/jill").replace("episodes: 2", "episodes: 1"), tmp_path
    )
    run(partial(play_an_episode, loaded, tmp_path))
    tables = study_data(loaded, tmp_path).tables
    assert shlex.split(tables["episodes"][0]["others"]) == ["jill=two agents/jill"]


# -- language models -----------------------------------------------------------------------------------------------


def test_a_model_has_a_seat_and_is_asked_while_people_look(tmp_path: Path) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: "I turn.\nAct: left") as stub:
        loaded = loaded_study(model(BESIDE, stub), tmp_path)

        async def play() -> None:
            live = Live(loaded, tmp_path)
            one = await newcomer(live)
            await one.go()
            await live.tick()
            await until_true(lambda: stub.requests)
            for _ in range(3):
                before = one.now["t"]
                await one.act("left")
                await until_true(lambda before=before: one.now["t"] > before)
            await live.close()

        run(play)
    taken = steps(tmp_path)
    assert [event["by"] for event in taken] == [{"agent": "person", "jill": "llm:stub"}] * 3
    assert {event["acts"]["jill"][0] for event in taken} == {0}
    messages = stub.requests[2]["messages"]
    assert [one["role"] for one in messages] == ["system", *["user", "assistant"] * 2, "user"]
    assert messages[2]["content"] == "I turn.\nAct: left"
    rows = study_data(loaded, tmp_path).tables["steps"]
    assert [row["reply"] for row in rows if row["seat"] == "jill"] == ["I turn.\nAct: left"] * 3
    assert [row["reply"] for row in rows if row["seat"] == "agent"] == [""] * 3


def test_a_model_that_takes_over_is_shown_what_the_person_did(tmp_path: Path) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: "Act: right") as stub:
        loaded = loaded_study(model(HELP.replace("WHO", "'llm:stub'"), stub), tmp_path)

        async def leave() -> None:
            clock = Clock()
            live = Live(loaded, tmp_path, clock)
            by_seat = await meet(live)
            await by_seat["agent"].act("left")
            await by_seat["jill"].act("forward")
            assert stub.requests == [], "nobody is asked while people play"
            page = by_seat["jill"].page
            assert page is not None
            live.go(page)
            await pass_time(live, clock, 6, by_seat["agent"])
            await by_seat["agent"].act("left")
            await until_true(lambda: by_seat["agent"].now["t"] == 2)
            await live.close()

        run(leave)
    assert [event["by"]["jill"] for event in steps(tmp_path)] == ["person", "llm:stub"]
    (request,) = stub.requests
    assert [one["content"] for one in request["messages"] if one["role"] == "assistant"] == ["Act: forward"]


@pytest.mark.parametrize(
    ("answer", "why"),
    [((401, {}, b"no key"), "status 401"), ("I do not know.", "a reply without an action")],
)
def test_the_script_takes_over_from_a_model_that_fails_to_the_end_of_the_episode(
    answer: Any, why: str, tmp_path: Path
) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: answer) as stub:
        loaded = loaded_study(model(BESIDE, stub, on_invalid="fail"), tmp_path)

        async def play() -> None:
            live = Live(loaded, tmp_path)
            one = await newcomer(live)
            await one.go()
            await live.tick()
            while not one.now.get("ended"):
                before = one.now["t"]
                await one.act("left")
                await until_true(lambda before=before: one.now["t"] > before or one.now.get("ended"))
            await one.go()
            await one.act("left")
            await until_true(lambda: one.now["t"] == 1)
            await live.close()

        run(play)
    assert len(stub.requests) == 2, "once in each episode"
    assert {event["by"]["jill"] for event in steps(tmp_path)} == {"script"}
    rows = [row for row in study_data(loaded, tmp_path).tables["steps"] if row["seat"] == "jill"]
    assert all(why in row["missed"] for row in rows)


def test_nobody_is_stuck_with_a_model_that_does_not_answer(tmp_path: Path) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    import threading

    asked, free = threading.Event(), threading.Event()

    def hang(request: Any) -> str:
        asked.set()
        free.wait(60)
        return "Act: left"

    with endpoint(hang) as stub:
        loaded = loaded_study(model(BESIDE, stub), tmp_path)

        async def play() -> None:
            clock = Clock()
            live = Live(loaded, tmp_path, clock)
            one = await newcomer(live)
            await one.go()
            await live.tick()
            await pass_time(live, clock, 30, one)
            await one.act("left")
            await until_true(asked.is_set)
            await pass_time(live, clock, 19, one)
            assert (one.now["t"], one.now["waiting"]) == (0, True), "the limit counts from the act on"
            await pass_time(live, clock, 1, one)
            assert (one.now["t"], one.now["waiting"]) == (1, False)
            await one.act("left")
            assert one.now["t"] == 2, "and is met once in an episode"
            free.set()
            await live.close()
            again = Live(loaded, tmp_path, clock)
            back = await Taking(again, one.person).come()
            await back.act("left")
            assert back.now["t"] == 3, "a server that is started again knows it, too"
            await again.close()

        run(play)
    assert {event["by"]["jill"] for event in steps(tmp_path)} == {"script"}
    assert {event["missed"]["jill"] for event in steps(tmp_path)} == {"no answer within 20 s"}


def test_a_server_that_is_started_again_goes_on_with_the_models_conversation(tmp_path: Path) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: f"Reply {len(request['messages'])}.\nAct: right") as stub:
        loaded = loaded_study(model(BESIDE, stub), tmp_path)

        async def act(one: Taking) -> None:
            before = one.now["t"]
            await one.act("left")
            await until_true(lambda: one.now["t"] > before)

        async def play() -> None:
            live = Live(loaded, tmp_path)
            one = await newcomer(live)
            await one.go()
            await act(one)
            await act(one)
            await until_true(lambda: len(stub.requests) == 3)
            await live.close()
            again = Live(loaded, tmp_path)
            await act(await Taking(again, one.person).come())
            await again.close()

        run(play)
    assert stub.requests[3]["messages"] == stub.requests[2]["messages"]


IN_SESSIONS = """\
scenario: sessions
horizon: 3
grammar: {templates: [Say <noun>], nouns: [hello, bye]}
room: {size: 7}
let: {word: pick("hello" | "bye")}
session: {episodes: 2, same: word}
cast:
  agent: {at: [1, 1]}
  bob: {at: [3, 1], seat: open}
outcome:
  - {success: agent.said("Say bye")}
"""


def test_a_model_remembers_its_session_also_when_the_server_is_started_again(tmp_path: Path) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    (tmp_path / "sessions.yaml").write_text(IN_SESSIONS, encoding="utf-8")
    text = BESIDE.replace("together/help_together, episodes: 2", "sessions.yaml, episodes: 4")

    def has_gone_on(one: Taking, t: int) -> bool:
        return one.now["t"] > t or bool(one.now.get("ended"))

    async def play(folder: Path, again: bool) -> None:
        live = Live(loaded, folder)
        one = await newcomer(live)
        await one.go()
        while one.now["do"] == "play":
            before = one.now["t"]
            if one.now.get("ended"):
                await one.go()
                continue
            await one.act("left")
            await until_true(partial(has_gone_on, one, before))
            if again:
                await live.close()
                live = Live(loaded, folder)
                one = await Taking(live, one.person).come()
        await live.close()

    asked: list[list[Any]] = []
    for again in (False, True):
        with endpoint(lambda request: "Act: right") as stub:
            loaded = loaded_study(model(text.replace("jill", "bob"), stub), tmp_path)
            folder = tmp_path / str(again)
            folder.mkdir()
            run(partial(play, folder, again))
        asked.append([messages for messages, _ in groupby(request["messages"] for request in stub.requests)])
    assert asked[0] == asked[1]
    replies = [sum(one["role"] == "assistant" for one in messages) for messages in asked[0]]
    assert replies == [0, 1, 2, 3, 4, 5] * 2, "an episode has three steps, a session two episodes"
    told = [messages[-1]["content"] for messages in asked[0]]
    assert all(told[number].startswith("Episode 1 of 2 begins") for number in (0, 6))
    assert all("Episode 2 of 2 begins" in told[number] for number in (3, 9))


def test_a_person_who_is_late_is_stood_in_for_by_a_model_which_gets_its_own_time(tmp_path: Path) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: "Act: right") as stub:
        loaded = loaded_study(model(HELP.replace("WHO", "{jill: 'llm:stub'}"), stub), tmp_path)

        async def dawdle() -> None:
            clock = Clock()
            live = Live(loaded, tmp_path, clock)
            by_seat = await meet(live)
            await by_seat["agent"].act("left")
            await pass_time(live, clock, 20, *by_seat.values())
            await until_true(lambda: by_seat["agent"].now["t"] == 1)
            await by_seat["agent"].act("left")
            await by_seat["jill"].act("left")
            assert by_seat["jill"].now["t"] == 2, "in the next step it is waited for again"
            await live.close()

        run(dawdle)
    assert [event["by"]["jill"] for event in steps(tmp_path)] == ["llm:stub", "person"]


@pytest.mark.parametrize("servers", [[4], [1, 3], [3, 1]])
def test_a_budget_that_is_spent_leaves_the_seat_to_the_script(servers: list[int], tmp_path: Path) -> None:
    """Also if it was spent before the server was started again, after so many steps."""
    pytest.importorskip("httpx", reason="language models need the extra llm")
    with endpoint(lambda request: "Act: right") as stub:
        loaded = loaded_study(model(BESIDE, stub, budget="'24'"), tmp_path)

        async def play(person: str | None, count: int) -> str:
            live = Live(loaded, tmp_path)
            one = await newcomer(live) if person is None else await Taking(live, person).come()
            if person is None:
                await one.go()
            begun = one.now["t"]
            for t in range(begun, begun + count):
                await one.act("left")
                await until_true(lambda t=t: one.now["t"] > t)
            await live.close()
            return one.person

        person = None
        for count in servers:
            person = run(partial(play, person, count))
    assert [event["by"]["jill"] for event in steps(tmp_path)] == ["llm:stub"] * 2 + ["script"] * 2
    assert steps(tmp_path)[-1]["missed"] == {"jill": "the budget is spent"}
