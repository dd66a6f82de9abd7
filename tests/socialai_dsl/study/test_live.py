"""The server decides where a participant is; each step is there once, whatever pages, disks and processes do."""

from __future__ import annotations

import asyncio
import json
import os
import random
import shutil
import threading
from collections import Counter
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.checking.studies import LoadedStudy
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.errors import UnreadableError, UsageError
from socialai_dsl.frontend import load_study
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.study import log
from socialai_dsl.study.columns import COLUMNS
from socialai_dsl.study.data import write_data
from socialai_dsl.study.exported import read_exported
from socialai_dsl.study.live import FAST, TAKEN, Live
from socialai_dsl.study.log import FILE, Log, read_log
from socialai_dsl.study.replay import StudyData, study_data
from socialai_dsl.study.status import status_of
from tests.socialai_dsl.study.participants import (
    ALONE,
    TOGETHER,
    Clock,
    Taking,
    loaded_study,
    meet,
    newcomer,
    pass_time,
    run,
    until,
)

SHIPPED = shipped_folder()


async def play_on(one: Taking, rng: random.Random, most: int = 10_000) -> None:
    """Play by chance, and answer what is asked, to the end or for so many messages."""
    for _ in range(most):
        screen = one.now
        if screen["do"] == "end":
            return
        if screen["do"] == "asked":
            await one.send(do="answers", answers={"how": "well", "hard": 3})
        elif screen["do"] == "play" and not screen.get("ended"):
            await one.act(rng.choice(["left", "right", "forward", "toggle"]))
        else:
            await one.go()


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("room.png", "{}"),
        ("räume-1.png", "{}"),
        ("a&b's.png", "{}"),
        ("room(1).png", "{}"),
        ("two rooms.png", "<{}>"),
        ("room.png", '{} "A room"'),
        ("room.png", "<{}> 'A room'"),
    ],
)
def test_a_page_shows_its_pictures_however_they_are_called(name: str, written: str, tmp_path: Path) -> None:
    page = f"![a room]({written.format(name)})"
    (tmp_path / "walk.md").write_text(page, encoding="utf-8")
    text = ALONE.replace("[Walk.]", "[walk.md]")
    with pytest.raises(ScenarioError, match="S903"):
        loaded_study(text, tmp_path)
    (tmp_path / name).write_bytes(b"picture")
    study = loaded_study(text, tmp_path)
    assert [file.name for file in study.pictures.values()] == [name]

    async def walk() -> None:
        live = Live(study, tmp_path)
        one = await newcomer(live)
        await one.go()
        assert 'src="/picture/0"' in one.now["html"]
        await live.close()

    run(walk)


def steps(folder: Path) -> list[tuple[Any, ...]]:
    return [(e["game"], e["episode"], e["t"]) for e in read_log(folder / FILE) if e["event"] == "step"]


def test_a_participant_goes_from_consent_to_the_code(place: Path, tmp_path: Path) -> None:
    async def take_part() -> list[str]:
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        assert one.now["do"] == "consent"
        assert "&lt;b&gt;Tags&lt;/b&gt; are <em>words</em>" in one.now["html"]
        await play_on(one, random.Random(1))
        await live.close()
        return [screen["do"] for screen in one.screens] + [one.now["code"], one.now["paid"]["currency"]]

    shown = run(take_part)
    assert list(dict.fromkeys(shown)) == ["consent", "page", "play", "asked", "end", "DONE", "EUR"]
    status = status_of(loaded_study(ALONE, place), tmp_path)
    assert (status.joined, status.began, status.finished, status.groups) == (1, 1, 1, ((1, 1),))
    data = study_data(loaded_study(ALONE, place), tmp_path)
    assert data.replayed == 2
    assert {row["question"]: row["answer"] for row in data.tables["answers"]} == {"how": "well", "hard": 3}
    (person,) = data.tables["participants"]
    assert person["excluded"] == ""
    assert person["paid"] == 1 + 0.5 * person["successes"]
    for table, rows in data.tables.items():
        assert all(list(row) == list(COLUMNS[table]) for row in rows), table
    assert [row["reaction_ms"] for row in data.tables["steps"]] == [1.5] * len(data.tables["steps"])


def test_whoever_declines_leaves_nothing_but_that(place: Path, tmp_path: Path) -> None:
    async def decline() -> None:
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        assert (await one.send(do="decline"))["declined"]
        assert (await one.go())["declined"]
        await live.close()

    run(decline)
    assert {event["event"] for event in read_log(tmp_path / FILE)} <= {
        "study",
        "server",
        "joined",
        "came",
        "declined",
    }


def test_what_is_not_meant_for_the_present_screen_does_nothing(place: Path, tmp_path: Path) -> None:
    """A second press of a key, an earlier screen, what cannot be done or said, an answer to nothing."""

    async def press_twice() -> None:
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        first = await until(one, "play")
        await one.act("forward")
        await one.act("forward", on=first["on"])
        assert one.now["t"] == 1
        for wrong in (
            {"do": "act", "movement": "fly", "said": None, "shown": 0.0, "acted": 0.0},
            {"do": "act", "movement": None, "said": "Give me the solution", "shown": 0.0, "acted": 0.0},
            {"do": "act", "movement": "left", "said": None, "shown": -1.0, "acted": 0.0},
            {"do": "answers", "answers": {"how": "x", "hard": 1}},
            {"do": "go"},
            {"do": "decline"},
            {"do": "glance"},
        ):
            await one.send(**wrong)
            assert one.now["t"] == 1, wrong
        assert one.page is not None
        for text in ("", "[]", "no JSON", "null", '{"do":"act"}', "\ud800".encode("utf-8", "surrogatepass")):
            await live.hear(one.page, text)
            assert one.now["t"] == 1
        await live.close()

    run(press_twice)
    assert steps(tmp_path) == [("g1", 0, 0)]


def test_answers_have_to_fit_the_questions(place: Path, tmp_path: Path) -> None:
    async def answer() -> None:
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        rng = random.Random(3)
        while one.now["do"] != "asked":
            await play_on(one, rng, 1)
        for wrong in (
            {},
            {"how": "well"},
            {"how": "well", "hard": 6},
            {"how": "well", "hard": "3"},
            {"how": "", "hard": 3},
            {"how": "well", "hard": 3, "what": "neither"},
            {"how": "well", "hard": 3, "more": "x"},
        ):
            assert (await one.send(do="answers", answers=wrong))["do"] == "asked", wrong
        assert (await one.send(do="answers", answers={"how": "well", "hard": 3, "what": "that"}))[
            "do"
        ] == "end"
        await live.close()

    run(answer)


def test_a_second_page_takes_over_and_each_step_is_there_once(place: Path, tmp_path: Path) -> None:
    async def open_twice() -> None:
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        await until(one, "play")
        await one.act("left")
        two = await Taking(live, one.person).come()
        assert one.closed == [TAKEN]
        assert (two.now["on"], two.now["t"], two.now["view"]) == (one.now["on"], 1, one.now["view"])
        assert "phrases" in two.now, "the new page is told what can be said"
        await one.act("left")
        await two.act("right")
        assert two.now["t"] == 2
        await live.close()

    run(open_twice)
    assert steps(tmp_path) == [("g1", 0, 0), ("g1", 0, 1)]


def test_a_page_that_sends_too_much_is_closed(place: Path, tmp_path: Path) -> None:
    async def flood() -> None:
        live = Live(loaded_study(ALONE, place), tmp_path, Clock())
        one = await newcomer(live)
        for _ in range(100):
            await one.beat()
        assert FAST in one.closed
        await live.close()

    run(flood)


@pytest.fixture(scope="module")
def whole(place: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The log of two participants who came to the end."""
    folder = tmp_path_factory.mktemp("whole")

    async def take_part() -> None:
        live = Live(loaded_study(ALONE, place), folder)
        for number in range(2):
            await play_on(await newcomer(live), random.Random(number))
        await live.close()

    run(take_part)
    return (folder / FILE).read_bytes()


@pytest.mark.parametrize("number", range(50))
def test_a_server_that_is_killed_goes_on_where_it_was(
    number: int, whole: bytes, place: Path, tmp_path: Path
) -> None:
    """What a killed process leaves is a beginning of its log, perhaps with a line that is cut off."""
    cut = random.Random(number).randrange(whole.index(b"\n") + 1, len(whole))
    (tmp_path / FILE).write_bytes(whole[:cut])
    before = [json.loads(line) for line in whole[:cut].split(b"\n")[:-1]]

    async def go_on() -> None:
        live = Live(loaded_study(ALONE, place), tmp_path)
        for person in list(live.progress.people):
            await play_on(await Taking(live, person).come(), random.Random(number))
        await live.close()

    run(go_on)
    after = list(read_log(tmp_path / FILE))
    assert after[: len(before)] == before
    assert set(Counter(steps(tmp_path)).values()) <= {1}
    data = study_data(loaded_study(ALONE, place), tmp_path)
    people = {event["participant"] for event in after if event["event"] == "joined"}
    assert data.replayed == 2 * len(people)
    assert data.unended == 0
    assert all(row["ended"] for row in data.tables["participants"])


def test_what_cannot_be_stored_has_not_happened(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = False
    fsync = os.fsync

    def sometimes(descriptor: int) -> None:
        if full:
            raise OSError(28, "No space left on device")
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", sometimes)

    async def fill_the_disk() -> None:
        nonlocal full
        live = Live(loaded_study(ALONE, place), tmp_path)
        one = await newcomer(live)
        await until(one, "play")
        await one.act("left")
        before = one.now
        full = True
        for _ in range(3):
            await one.act("right")
            assert (one.now["notice"], one.now["on"], one.now["view"]) == (
                "disk",
                before["on"],
                before["view"],
            )
        with pytest.raises(OSError, match="No space"):
            await live.join()
        full = False
        await one.act("right")
        assert (one.now["t"], one.now.get("notice")) == (2, None)
        await play_on(one, random.Random(5))
        await live.close()

    run(fill_the_disk)
    assert set(Counter(steps(tmp_path)).values()) == {1}
    assert study_data(loaded_study(ALONE, place), tmp_path).replayed == 2


def test_a_study_that_was_changed_is_not_gone_on_with(whole: bytes, place: Path, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(whole)
    for text, why in (
        (ALONE.replace("I agree.", "I do agree."), "another text"),
        (ALONE.replace("talkitout_no_liar", "talkitout"), "another version of talkitout"),
        (ALONE.replace("study: alone", "study: other"), "holds the study 'alone'"),
    ):
        with pytest.raises(UsageError, match=why):
            Live(loaded_study(text, place), tmp_path)
    assert (tmp_path / FILE).read_bytes() == whole, "nothing was written"


def test_each_of_two_scenarios_of_one_name_has_to_be_as_it_was(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        shutil.copy(SHIPPED / "talkitout_no_liar.yaml", tmp_path / folder / "talk.yaml")
    blocks = "".join(f"- {{scenario: {folder}/talk.yaml, episodes: 1}}\n" for folder in ("one", "two"))
    text = f"study: twice\nconsent: I agree.\nblocks:\n{blocks}"
    (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
    out = tmp_path / "out"
    out.mkdir()

    def begin() -> None:
        async def open_and_close() -> None:
            await Live(load_study(tmp_path / "study.yaml"), out).close()

        run(open_and_close)

    begin()
    begin()
    changed = (SHIPPED / "talkitout.yaml").read_text(encoding="utf-8")
    for folder in ("one", "two"):
        file = tmp_path / folder / "talk.yaml"
        before = file.read_text(encoding="utf-8")
        file.write_text(changed, encoding="utf-8")
        with pytest.raises(UsageError, match="another version of"):
            begin()
        file.write_text(before, encoding="utf-8")
    begin()


@pytest.mark.parametrize("names", [("same", "same"), ("practice", "other"), ("talkitout_2", None)])
def test_blocks_that_the_data_could_not_tell_apart_are_a_finding(
    names: tuple[str | None, ...], tmp_path: Path
) -> None:
    blocks = "".join(
        f"- {{scenario: talkitout, episodes: 1{'' if name is None else f', name: {name}'}}}\n"
        for name in names
    )
    file = tmp_path / "study.yaml"
    file.write_text(f"study: s\nconsent: I agree.\nblocks:\n{blocks}", encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load_study(file)
    assert [finding.code for finding in caught.value.diagnostics] == ["S213"]


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('"event":"step"', '"event":"stop"', "cannot have come here"),
        ('"success":{"agent":false}', '"success":{"agent":true}', "the episode came out as"),
        ('"room":0', '"room":7', "got the room 7"),
        ('"t":3,', '"t":2,', "got step 2"),
    ],
)
def test_data_that_do_not_reproduce_are_refused(
    old: str, new: str, why: str, whole: bytes, place: Path, tmp_path: Path
) -> None:
    assert old.encode() in whole
    (tmp_path / FILE).write_bytes(whole.replace(old.encode(), new.encode(), 1))
    with pytest.raises(UnreadableError, match=why):
        study_data(loaded_study(ALONE, place), tmp_path)


@pytest.mark.parametrize("value", [None, "p9", []])
def test_whoever_reads_a_log_that_was_changed_says_in_which_line(
    value: Any, whole: bytes, place: Path, tmp_path: Path
) -> None:
    """Or notices nothing, where it does not need what was changed."""

    def go_on(loaded: LoadedStudy, folder: Path) -> None:
        run(Live(loaded, folder).close)

    loaded, lines = loaded_study(ALONE, place), whole.splitlines()
    refused: dict[str, list[str]] = {}
    first = {json.loads(line)["event"]: number for number, line in reversed([*enumerate(lines)])}
    for number in first.values():
        event = json.loads(lines[number])
        for one in [{}] if value is None else [{**event, key: value} for key in event]:
            new = [*lines[:number], json.dumps(one).encode(), *lines[number + 1 :]]
            (tmp_path / FILE).write_bytes(b"\n".join(new) + b"\n")
            for name, reads in (("data", study_data), ("status", status_of), ("run", go_on)):
                try:
                    reads(loaded, tmp_path)
                except UsageError as error:
                    refused.setdefault(name, []).append(str(error))
    assert all(f"{FILE}:" in said for told in refused.values() for said in told)
    assert min(len(refused[name]) for name in ("data", "status", "run")) >= len(first) // 2


def test_tables_are_written_with_a_codebook(whole: bytes, place: Path, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(whole)
    loaded = loaded_study(ALONE, place)
    files = write_data(study_data(loaded, tmp_path), loaded, tmp_path / "out")
    assert [file.name for file in files if file.suffix == ".csv"] == [
        f"study-alone_table-{table}_data.csv" for table in COLUMNS
    ]
    described = json.loads((tmp_path / "out" / "dataset_description.json").read_text())
    assert {column for columns in COLUMNS.values() for column in columns} == {
        one["name"] for one in described["variableMeasured"]
    }
    assert "| `hard` | scale | How hard? |" in (tmp_path / "out" / "codebook.md").read_text()


@pytest.mark.parametrize(
    "text", ["x" * 200_000, 'a,"b"', "=1+1", "1", "True", "\r", "two\r\nlines\n", "\x00", "\ufeff", "ä\u2028"]
)
def test_tables_are_read_again_as_they_were_written(
    text: str, whole: bytes, place: Path, tmp_path: Path
) -> None:
    """Whatever people have answered, and however much a language model."""
    (tmp_path / FILE).write_bytes(whole)
    loaded = loaded_study(ALONE, place)
    data = study_data(loaded, tmp_path)
    data.tables["steps"][0]["reply"] = data.tables["answers"][0]["answer"] = text
    write_data(data, loaded, tmp_path / "out")
    assert read_exported(tmp_path / "out").tables == data.tables


# -- two people ----------------------------------------------------------------------------------------------------


def test_two_who_are_there_play_together_and_see_their_own_seats(place: Path, tmp_path: Path) -> None:
    async def meet() -> None:
        live = Live(loaded_study(TOGETHER, place), tmp_path, Clock())
        one, two = await newcomer(live), await newcomer(live)
        await until(one, "room")
        await live.tick()
        assert one.now["do"] == "room", "nobody else has come"
        await two.go()
        await live.tick()
        assert (one.now["do"], two.now["do"]) == ("play", "play")
        assert one.now["view"] != two.now["view"]
        await one.act("left")
        assert (one.now["waiting"], one.now["t"]) == (True, 0)
        await one.act("right")  # too late to think again
        await two.act("forward")
        assert (one.now["t"], two.now["t"], one.now["waiting"]) == (1, 1, False)
        await live.close()

    run(meet)
    (step,) = [event for event in read_log(tmp_path / FILE) if event["event"] == "step"]
    assert step["by"] == {"agent": "person", "jill": "person"}
    assert [time["movement"] for time in step["times"].values()] == ["left", "forward"]


def test_pictures_come_in_the_order_in_which_things_happened(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever chose first waits; a slow disk must not bring that picture behind the next one, where nobody waits."""
    gate, write = threading.Event(), Log._write

    def slowly(log: Log, lines: bytes) -> None:
        gate.wait(60)
        write(log, lines)

    async def play() -> None:
        live = Live(loaded_study(TOGETHER, place), tmp_path, Clock())
        one, two = await newcomer(live), await newcomer(live)
        await one.go()
        await two.go()
        await live.tick()
        monkeypatch.setattr(Log, "_write", slowly)
        under_way = [asyncio.create_task(newcomer(live))]
        await asyncio.sleep(0.1)  # it is being written
        for taking in (one, two):
            under_way.append(asyncio.create_task(taking.act("left")))  # type: ignore[arg-type]
            await asyncio.sleep(0)
        gate.set()
        await asyncio.gather(*under_way)
        assert [(screen["t"], screen["waiting"]) for screen in one.screens[-2:]] == [(0, True), (1, False)]
        await live.close()

    run(play)


def test_the_script_takes_the_seat_for_which_nobody_comes(place: Path, tmp_path: Path) -> None:
    async def wait() -> None:
        clock = Clock()
        live = Live(loaded_study(TOGETHER, place), tmp_path, clock)
        one = await newcomer(live)
        await until(one, "room")
        for _ in range(29):
            clock.now += 1
            await one.beat()
            await live.tick()
            assert one.now["do"] == "room"
        clock.now += 1
        await one.beat()
        await live.tick()
        assert one.now["do"] == "play"
        await one.act("left")
        assert one.now["t"] == 1
        await live.close()

    run(wait)
    (game,) = [event for event in read_log(tmp_path / FILE) if event["event"] == "game"]
    assert game["seats"] == {"agent": "p0001", "jill": "script"}


def test_who_was_not_heard_while_waiting_is_matched_once_heard_again(place: Path, tmp_path: Path) -> None:
    """As a page in the background, whose signs a browser sends late: it is not matched then, and not forgotten."""

    async def wait() -> None:
        clock = Clock()
        live = Live(loaded_study(TOGETHER, place), tmp_path, clock)
        one = await newcomer(live)
        await until(one, "room")
        await pass_time(live, clock, 8)
        other = await newcomer(live)
        await until(other, "room")
        await pass_time(live, clock, 3, other)
        assert (one.now["do"], other.now["do"]) == ("room", "room"), "nobody plays with who is not there"
        await pass_time(live, clock, 1, one, other)
        assert (one.now["do"], other.now["do"]) == ("play", "play")
        await live.close()

    run(wait)


def test_who_was_not_heard_is_shown_what_others_did_meanwhile(place: Path, tmp_path: Path) -> None:
    """Also if they have come to the end of the last episode, after which nobody goes on by themselves."""
    loaded = loaded_study(TOGETHER.replace("episodes: 2", "episodes: 1"), place)

    async def play() -> None:
        clock = Clock()
        live = Live(loaded, tmp_path, clock)
        people = await meet(live)
        away, stays = people["jill"], people["agent"]
        await away.act("left")
        assert away.now["waiting"]
        await pass_time(live, clock, 8, stays)
        while not stays.now.get("ended"):
            await stays.act("left")
        assert not away.now.get("ended")
        await pass_time(live, clock, 1, stays, away)
        assert away.now["ended"]
        await away.go()
        assert away.now["do"] == "end"
        await live.close()

    run(play)


def test_another_takes_the_place_of_who_dropped_out(place: Path, tmp_path: Path) -> None:
    text = ALONE + "participants: 2\nassign: {groups: 2}\n"

    async def take_part() -> None:
        clock = Clock()
        live = Live(loaded_study(text, place), tmp_path, clock)
        stays, drops, late = [await newcomer(live) for _ in range(3)]
        await stays.go()
        await drops.go()
        assert (await late.go())["do"] == "consent", "two take part, and two may"
        assert drops.page is not None
        live.go(drops.page)
        for _ in range(60):
            assert (await late.go())["do"] == "consent"
            clock.now += 60
            await stays.beat()
            await late.beat()
        assert (await late.go())["do"] == "page"
        assert [live.progress.people[one.person].group for one in (stays, drops, late)] == [1, 2, 2]
        assert (await Taking(live, drops.person).come()).now["do"] == "page", "who comes back goes on"
        assert (await (await newcomer(live)).go())["do"] == "consent"
        await live.close()

    run(take_part)


def test_nobody_plays_with_who_has_left_the_waiting_room(place: Path, tmp_path: Path) -> None:
    async def leave() -> None:
        clock = Clock()
        live = Live(loaded_study(TOGETHER, place), tmp_path, clock)
        one, two = await newcomer(live), await newcomer(live)
        await until(one, "room")
        clock.now += 6  # nothing is heard of the first one any more
        await two.go()
        await two.beat()
        await live.tick()
        assert two.now["do"] == "room"
        await live.close()

    run(leave)


def agree(data: StudyData) -> None:
    """The tables say the same of each other, whoever else played meanwhile."""
    chosen = Counter(
        (row["participant"], row["game"], row["trial"])
        for row in data.tables["steps"]
        if row["by"] == "person"
    )
    lasted = Counter((row["game"], row["trial"], row["seat"]) for row in data.tables["steps"])
    stood_in = Counter(
        (row["game"], row["trial"])
        for row in data.tables["steps"]
        if row["participant"] and row["by"] != "person"
    )
    won = Counter[str]()
    for row in data.tables["episodes"]:
        assert row["own_steps"] == chosen[row["participant"], row["game"], row["trial"]]
        assert row["stood_in"] == stood_in[row["game"], row["trial"]] - (row["steps"] - row["own_steps"])
        assert row["steps"] == lasted[row["game"], row["trial"], row["seat"]]
        won[row["participant"]] += row["block"] != "practice" and row["success"] and not row["left"]
    for person in data.tables["participants"]:
        assert person["successes"] == won[person["participant"]]


def test_tables_agree_where_several_play_at_once(place: Path, tmp_path: Path) -> None:
    async def play() -> None:
        live, rng = Live(loaded_study(ALONE, place), tmp_path), random.Random(5)
        people = [await newcomer(live) for _ in range(3)]
        for _ in range(10_000):
            if all(one.now["do"] == "end" for one in people):
                break
            await play_on(rng.choice(people), rng, 1)
        await live.close()

    run(play)
    data = study_data(loaded_study(ALONE, place), tmp_path)
    assert data.replayed == 6
    agree(data)


def test_the_script_takes_over_when_somebody_leaves_and_hands_back(place: Path, tmp_path: Path) -> None:
    async def leave() -> None:
        clock = Clock()
        live = Live(loaded_study(TOGETHER, place), tmp_path, clock)
        one, two = await newcomer(live), await newcomer(live)
        await one.go()
        await two.go()
        await live.tick()
        await one.act("left")
        assert two.page is not None
        live.go(two.page)
        for _ in range(6):
            clock.now += 1
            await one.beat()
            await live.tick()
        assert one.now["t"] == 1, "the step is taken without who has left"
        await one.act("left")
        assert one.now["t"] == 2
        back = await Taking(live, two.person).come()
        await live.tick()
        assert (back.now["do"], back.now["t"]) == ("play", 2)
        await one.act("left")
        assert one.now["t"] == 2, "the one who is back is waited for"
        await back.act("left")
        assert (one.now["t"], back.now["t"]) == (3, 3)
        rng = random.Random(1)
        for _ in range(1000):
            if one.now["do"] == back.now["do"] == "end":
                break
            await play_on(one, rng, 1)
            await play_on(back, rng, 1)
        assert one.now["do"] == back.now["do"] == "end"
        await live.close()

    run(leave)
    events = list(read_log(tmp_path / FILE))
    by = [event["by"] for event in events if event["event"] == "step"]
    assert [sorted(one.values()) for one in by[:3]] == [
        ["person", "script"],
        ["person", "script"],
        ["person", "person"],
    ]
    assert [event["event"] for event in events if event["event"] in ("gone", "back")] == ["gone", "back"]
    data = study_data(loaded_study(TOGETHER, place), tmp_path)
    assert data.replayed == 2
    agree(data)
    assert [row["left"] for row in data.tables["participants"]] == [0, 1]
    stood_in = {row["participant"]: row["stood_in"] for row in data.tables["episodes"] if row["trial"] == 1}
    assert (stood_in["p0001"], stood_in["p0002"]) == (2, 0)


def test_who_is_late_is_not_waited_for(place: Path, tmp_path: Path) -> None:
    async def dawdle() -> None:
        clock = Clock()
        live = Live(loaded_study(TOGETHER, place), tmp_path, clock)
        one, two = await newcomer(live), await newcomer(live)
        await one.go()
        await two.go()
        await live.tick()
        await one.act("left")
        for _ in range(20):
            clock.now += 1
            await one.beat()
            await two.beat()
            await live.tick()
        assert (one.now["t"], two.now["t"]) == (1, 1)
        await live.close()

    run(dawdle)
    (step,) = [event for event in read_log(tmp_path / FILE) if event["event"] == "step"]
    assert sorted(step["by"].values()) == ["person", "script"]


def test_a_lid_that_was_closed_for_an_hour_and_a_clock_that_jumps_change_nothing(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Jumping(datetime):
        hours = 0

        @classmethod
        def now(cls, tz: Any = None) -> Any:
            cls.hours -= 1
            return datetime.now(tz) + timedelta(hours=cls.hours)

    monkeypatch.setattr(log, "datetime", Jumping)

    async def sleep() -> None:
        clock = Clock()
        live = Live(loaded_study(ALONE, place), tmp_path, clock)
        one = await newcomer(live)
        await until(one, "play")
        await one.act("left")
        before = one.now
        clock.now += 3600
        await live.tick()
        again = await Taking(live, one.person).come()
        assert (again.now["on"], again.now["view"]) == (before["on"], before["view"])
        await play_on(again, random.Random(1))
        assert again.now["do"] == "end"
        await live.close()

    run(sleep)
    events = list(read_log(tmp_path / FILE))
    assert [e["time"] for e in events] == sorted((e["time"] for e in events), reverse=True), (
        "the clock went back"
    )
    assert [e["mono"] for e in events] == sorted(e["mono"] for e in events)
    assert study_data(loaded_study(ALONE, place), tmp_path).replayed == 2


def test_a_trained_agent_that_does_not_fit_is_refused_before_anybody_comes(
    place: Path, tmp_path: Path
) -> None:
    pytest.importorskip("torch", reason="a trained agent needs PyTorch")
    text = TOGETHER.replace("jill: person", "jill: shipped:talkitout")
    with pytest.raises(UsageError, match="block 1: "):
        Live(loaded_study(text, place), tmp_path)
    assert list(tmp_path.iterdir()) == []
