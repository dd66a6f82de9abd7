"""Pages of other origins let people take part where the study's author admits them, and reach nothing else."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from socialai_dsl.cli.main import main
from socialai_dsl.study.live import Live
from socialai_dsl.study.replay import study_data
from socialai_dsl.study.words import words_of
from socialai_dsl.web.pages import origin_of
from tests.socialai_dsl.study.participants import ALONE, Taking, loaded_study, newcomer, run, until
from tests.socialai_dsl.study.test_server import served

LAB = "https://lab.example.org"
PLAYED = """\
study: played
consent: I agree.
blocks:
- {name: one, scenario: talkitout_no_liar, episodes: 2}
participants: 2
"""
ADMITTED = ("--embed", LAB, "--embed", "http://localhost:5500/")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "study.yaml").write_text(PLAYED, encoding="utf-8")
    return tmp_path


@contextmanager
def joined(
    at: str, origin: str | None = LAB, **message: Any
) -> Iterator[tuple[ClientConnection, dict[str, Any]]]:
    """A page of somebody else that has asked to take part, and what it was answered first."""
    with connect(f"{at.replace('http', 'ws')}/embed", origin=origin) as line:  # type: ignore[arg-type]
        if message:
            line.send(json.dumps({"do": "join", "consented": True, **message}))
        yield line, json.loads(line.recv(timeout=30))


def refused(at: str, origin: str | None = LAB, **message: Any) -> tuple[str, str]:
    with joined(at, origin, **message) as (line, said):
        with pytest.raises(ConnectionClosed, match="4403"):
            line.recv()
        return said["why"], said["say"]


def test_only_pages_that_are_admitted_let_people_take_part_and_that_is_all_they_can(folder: Path) -> None:
    words = words_of("en")
    with served(folder, folder / "out", *ADMITTED) as (_, at, _links):
        for origin in (None, "null", "https://evil.example", "http://lab.example.org", f"{LAB}:444", at):
            why, say = refused(at, origin)
            assert (why, f"--embed {origin or 'null'}" in say) == ("origin", True)
        embed = f"{at.replace('http', 'ws')}/embed"
        with (
            pytest.raises(InvalidStatus),
            connect(embed, origin=LAB, additional_headers={"Host": "evil.example"}),
        ):  # type: ignore[arg-type]
            pass
        for wrong in ({"consented": False}, {"id": ""}, {"id": "x" * 201}, {"id": 1}, {"seed": 1}):
            assert refused(at, **wrong) == ("consent", words["consent"])
        assert refused(at, code="0" * 40)[0] == "forgotten"
        with joined(at, id="abc") as (line, said):
            assert set(said) == {"do", "code", "language", "words", "done"}
            assert json.loads(line.recv())["do"] == "play"
        code = said["code"]
        with joined(at, "http://localhost:5500", id="abc") as (_line, again):
            assert again["code"] == code
        with pytest.raises(InvalidStatus), connect(f"{at.replace('http', 'ws')}/seat/{code}", origin=LAB):  # type: ignore[arg-type]
            pass
        answer = httpx.get(f"{at}/p/{code}", headers={"Origin": LAB})
        assert [name for name in answer.headers if name.startswith("access-control")] == []
        assert "frame-ancestors 'none'" in answer.headers["content-security-policy"]
        with joined(at, id="other"):
            pass
        assert refused(at, id="third") == ("full", words["full"])
    data = study_data(loaded_study(PLAYED, folder), folder / "out")
    assert [row["agreed_at"] for row in data.tables["participants"]] == [LAB, LAB]
    assert "abc" not in (folder / "out" / "log.jsonl").read_text(encoding="utf-8")


def test_whoever_may_come_once_goes_on_by_the_code_and_not_by_the_id(folder: Path) -> None:
    (folder / "study.yaml").write_text(PLAYED + "recruit: {on_return: refuse}\n", encoding="utf-8")
    with served(folder, folder / "out", *ADMITTED) as (_, at, _links):
        with joined(at, id="abc") as (_line, said):
            pass
        assert refused(at, id="abc") == ("again", words_of("en")["again"])
        with joined(at, id="abc", code=said["code"]) as (line, _):
            assert json.loads(line.recv())["do"] == "play"


def test_whoever_was_invited_and_agrees_elsewhere_is_not_asked_again_and_who_declined_does_not_play(
    folder: Path,
) -> None:
    with served(folder, folder / "out", *ADMITTED) as (_, at, _links):
        codes = {}
        for one in ("agrees", "declines"):
            path = httpx.get(f"{at}/join?PROLIFIC_PID={one}").headers["location"]
            codes[one] = path.rpartition("/")[2]
        with connect(f"{at.replace('http', 'ws')}/seat/{codes['declines']}", origin=at) as line:  # type: ignore[arg-type]
            line.send(json.dumps({"do": "decline", "on": json.loads(line.recv())["on"]}))
            line.recv()
        for one, shown in (("agrees", "play"), ("declines", "end")):
            with joined(at, id=one) as (line, said):
                assert (said["code"], json.loads(line.recv())["do"]) == (codes[one], shown)


@pytest.mark.parametrize("feedback", ["outcome", "none"])
def test_an_episode_that_has_ended_is_told_as_the_tables_have_it(feedback: str, folder: Path) -> None:
    loaded = loaded_study(PLAYED.replace("episodes: 2", f"episodes: 2, feedback: {feedback}"), folder)
    out = folder / "out"
    out.mkdir()

    async def play() -> tuple[list[dict[str, Any]], list[int]]:
        live = Live(loaded, out)
        person = await live.join()
        assert live.agree(person, LAB, simulated=False)
        one = Taking(live, person)
        one.page = await live.come(person, one.screens.append, lambda code, why: None, elsewhere=True)
        records, done = [], [live.progress.gone_on_from(live.progress.people[person])]
        for moves in (["left", "forward", "done"], ["done"]):
            for move in moves:
                await one.act(move)
            records.append(one.now["record"])
            done.append(live.progress.gone_on_from(live.progress.people[person]))
            await one.go()
            done.append(live.progress.gone_on_from(live.progress.people[person]))
        assert one.now["do"] == "end"
        await live.close()
        return records, done

    records, done = run(play)
    assert done == [0, 0, 1, 1, 2]
    assert [(one["episode"], one["more"], one["trials"]) for one in records] == [(1, True, 2), (2, False, 2)]
    tables = study_data(loaded, out).tables
    told = {"success", "outcome", "return"}
    key = {"participant", "game", "position", "trial", "trials", "episode", "more"}
    assert all({*record} == key | told | {"steps", "own_steps", "acts"} for record in records), (
        "no room, no seat, no scenario, and nothing of others"
    )
    for record, row in zip(records, tables["episodes"], strict=True):
        for name in {*record} & {*row}:
            assert record[name] == (None if feedback == "none" and name in told else row[name]), name
        steps = [step for step in tables["steps"] if step["trial"] == row["trial"]]
        assert record["acts"] == [
            {name: step[name] for name in act} for step, act in zip(steps, record["acts"], strict=True)
        ]


def test_practice_is_played_in_its_rounds_before_what_counts(folder: Path) -> None:
    practice = "practice: {scenario: talkitout_no_liar, episodes: 1, until: {success: 1}, rounds: 2}\n"
    loaded = loaded_study(PLAYED.replace("episodes: 2", "episodes: 1") + practice, folder)

    async def play() -> list[dict[str, Any]]:
        live = Live(loaded, folder)
        person = await live.join()
        live.agree(person, LAB, simulated=True)
        one, records = Taking(live, person), []
        one.page = await live.come(person, one.screens.append, lambda code, why: None, elsewhere=True)
        while one.now["do"] == "play":
            await one.act("done")
            records.append(one.now["record"])
            await one.go()
        await live.close()
        return records

    found = [(one["position"], one["trial"], one["episode"], one["more"]) for one in run(play)]
    assert found == [(0, 1, 1, True), (0, 1, 2, True), (1, 1, 3, False)]
    (person,) = study_data(loaded, folder).tables["participants"]
    assert (person["excluded"], person["practice_rounds"]) == ("simulated", 2)


def test_our_own_page_gets_no_record(place: Path, tmp_path: Path) -> None:
    async def end() -> dict[str, Any]:
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        await until(one, "play")
        await one.act("done")
        await live.close()
        return one.now

    screen = run(end)
    assert screen["ended"]
    assert "record" not in screen


def test_a_full_disk_lets_nobody_in(folder: Path) -> None:
    (folder / "out").mkdir()
    with served(folder, folder / "out", *ADMITTED) as (_, at, _links):
        (folder / "out" / "recruited.csv").mkdir()  # which cannot be written then
        assert refused(at, id="abc") == ("full_disk", words_of("en")["full_disk"])


@pytest.mark.parametrize(
    ("given", "origin"),
    [
        ("https://Lab.example.org/", "https://lab.example.org"),
        ("https://lab.example.org:443", "https://lab.example.org"),
        ("http://127.0.0.1:5500", "http://127.0.0.1:5500"),
        ("http://[::1]:80", "http://[::1]"),
        *(
            (wrong, None)
            for wrong in ("*", "null", "lab.example.org", "file:///x", "https://", "https://a:b")
        ),
        *((f"https://a.example{more}", None) for more in ("/x", "?x", "#x", ":99999")),
        ("https://user@a.example", None),
    ],
)
def test_an_origin_is_what_browsers_say(given: str, origin: str | None) -> None:
    assert origin_of(given) == origin


@pytest.mark.parametrize(
    ("text", "origin", "said"),
    [
        (PLAYED, "*", "got '*', expected the origin of a page, such as https://lab.example.org"),
        (ALONE, LAB, "has `instructions` and `questions`, which a page that embeds a study shows itself"),
        (
            PLAYED.replace("episodes: 2", "episodes: 2, questions: [{id: how, ask: How?}]"),
            LAB,
            "has `questions` of blocks",
        ),
    ],
)
def test_what_cannot_be_embedded_is_refused_before_anybody_comes(
    text: str, origin: str, said: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    arguments = ["study", "run", str(folder / "study.yaml"), "--embed", origin, "--out", str(folder / "out")]
    assert main(arguments) == 2
    assert said in capsys.readouterr().err
    assert not (folder / "out").exists()
