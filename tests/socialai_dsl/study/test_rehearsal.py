"""Agents, rivals and language models take part in a rehearsal as people do, beside those who leave and cheat."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import load
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.study.log import FILE, read_log
from socialai_dsl.study.players import agent_of
from socialai_dsl.study.progress import Progress
from socialai_dsl.study.rehearsal import KINDS, rehearse
from socialai_dsl.study.replay import reset_of
from tests.socialai_dsl.llm.endpoint import endpoint
from tests.socialai_dsl.study.participants import loaded_study

GUIDES = """\
study: guides
consent: I agree.
blocks:
- {scenario: talkitout, episodes: 1}
- {scenario: talkitout_no_liar, episodes: 1}
"""
HELPERS = """\
study: helpers
consent: I agree.
blocks:
- {scenario: together/help_together, episodes: 1, seats: {agent: person, jill: person}, wait: 5}
"""


@pytest.mark.parametrize(
    ("text", "kind", "played"),
    [
        (GUIDES, "rival:first_answer", "talkitout+first_answer"),
        (HELPERS, "shipped:help_as_helper", "together/help_together+oracle"),
    ],
)
def test_an_agent_acts_in_a_rehearsal_as_it_acts_elsewhere(
    text: str, kind: str, played: str, place: Path, tmp_path: Path
) -> None:
    if "shipped" in kind:
        pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    loaded = loaded_study(text, place)
    found = rehearse(loaded, tmp_path, 2, speed=300, kinds=(kind,))
    arena, progress = Arena(load(played)), Progress(loaded)
    episode: Episode | None = None
    compared = 0
    for event in read_log(tmp_path / FILE):
        progress.apply(event)
        if event["event"] == "episode" and event["game"] == "g1":
            env = arena.take()
            agents = {} if "rival" in kind else {s: partial(agent_of, kind, Path(), env) for s in arena.seats}
            reset = reset_of(progress.games["g1"].block, event["room"])
            episode = Episode(arena, agents, env)
            episode.begin(reset, f"g1 {event['number']}")
        if event["event"] == "step" and event["game"] == "g1":
            assert episode is not None
            for seat, by in event["by"].items():
                if by == "person":
                    chosen = episode.chosen(seat, kind)
                    assert chosen is not None
                    assert arena.words(event["acts"][seat]) == arena.words(chosen)
                    compared += 1
            episode.step(event["acts"])
    assert compared > 5
    assert found.courses[0].finished


def test_where_an_agent_does_not_play_chance_does_and_the_report_says_it(place: Path, tmp_path: Path) -> None:
    text = GUIDES + "- {scenario: help, episodes: 1}\n"
    loaded = loaded_study(text, place)
    found = rehearse(loaded, tmp_path, 1, speed=300, kinds=("rival:first_answer",))
    (course,) = found.courses
    assert 0 < course.by_chance < course.acts
    assert f", {course.by_chance} of {course.acts} acts by chance" in "\n".join(found.lines(loaded))


def test_whoever_comes_when_the_study_is_full_ends_the_rehearsal_there(place: Path, tmp_path: Path) -> None:
    loaded = loaded_study(GUIDES + "participants: 1\n", place)
    found = rehearse(loaded, tmp_path, 3, speed=300, kinds=("script",))
    assert Counter((one.finished, one.refused) for one in found.courses) == {
        (True, False): 1,
        (False, True): 2,
    }
    assert next(iter(found.lines(loaded))).endswith(
        ", 1 finished, 0 left by themselves, 2 came when the study was full"
    )


@pytest.mark.parametrize("answer", ["Act: left", (401, {}, b"no key")])
def test_a_language_model_takes_part_and_chance_plays_where_it_fails(
    answer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("httpx", reason="language models need the extra llm")
    from socialai_dsl.llm.endpoint import Endpoint

    clients, connect = [], Endpoint.client
    monkeypatch.setattr(Endpoint, "client", lambda endpoint: clients.append(connect(endpoint)) or clients[-1])
    with endpoint(lambda request: answer) as stub:
        text = GUIDES + f'model: {{base_url: "{stub.url}"}}\n'
        loaded = loaded_study(text, tmp_path)
        (tmp_path / "out").mkdir()
        found = rehearse(loaded, tmp_path / "out", 1, speed=300, kinds=("llm:stub",))
    (course,) = found.courses
    assert course.finished
    assert len(stub.requests) >= course.acts > 0
    assert [client.is_closed for client in clients] == [True], "one is enough for all requests"
    moves = Counter(e["acts"]["agent"][0] for e in read_log(tmp_path / "out" / FILE) if e["event"] == "step")
    if answer == "Act: left":
        assert (course.by_chance, set(moves)) == (0, {0})
    else:
        assert course.by_chance == course.acts
        assert len(moves) > 1
        (reason,) = [line for line in found.lines(loaded) if "status 401" in line]
        assert reason.startswith(f"    {course.acts} times: model 'stub' at {stub.url}")
        assert course.failures.total() == course.acts


@pytest.mark.parametrize(
    ("kind", "why"),
    [
        ("rival:nobody_has_it", "no scenario of the study has this rival"),
        ("shipped:nothing", "no agent of this name ships"),
        ("nowhere/at_all", "there is no agent"),
    ],
)
def test_an_agent_that_plays_nowhere_is_refused_before_anybody_begins(
    kind: str, why: str, place: Path, tmp_path: Path
) -> None:
    pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    with pytest.raises(UsageError, match=why):
        rehearse(loaded_study(GUIDES, place), tmp_path, 1, kinds=(kind,))
    assert list(tmp_path.iterdir()) == []


def test_the_command_takes_agents_beside_the_other_kinds(
    place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loaded_study(GUIDES, place)
    file, out = str(place / "study.yaml"), str(tmp_path / "out")
    command = ["study", "rehearse", file, "--also", "rival:first_answer", "--speed", "800", "--out", out]
    assert main(command) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    told = {line[0]: line[1:4] for line in lines if line[0] in (*KINDS, "rival:first_answer")}
    assert set(told) == {*KINDS, "rival:first_answer"}
    assert all(said[1:] == ["of", "2"] for said in told.values())
    assert main(["study", "rehearse", file, "--also", "rival:nope"]) == 2
    assert "no scenario of the study has this rival" in capsys.readouterr().err
