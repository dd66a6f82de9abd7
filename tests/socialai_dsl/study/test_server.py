"""The server answers its own address alone, and nobody reaches anything but their own seat."""

from __future__ import annotations

import asyncio
import hmac
import json
import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from socialai_dsl.cli.main import main
from socialai_dsl.errors import UsageError
from socialai_dsl.study.rehearsal import rehearse
from socialai_dsl.study.replay import study_data
from socialai_dsl.study.server import StudyServer
from socialai_dsl.web.pages import Address
from tests.socialai_dsl.study.participants import ALONE, TOGETHER, loaded_study, run

PICTURED = ALONE.replace("[Walk.]", '["Look: ![a room](room.png)", Walk.]')


@contextmanager
def served(folder: Path, out: Path, *options: str) -> Iterator[tuple[subprocess.Popen[str], str, list[str]]]:
    """A server in a process of its own: the process, its address and the links that it has printed."""
    command = [sys.executable, "-m", "socialai_dsl", "study", "run", "study.yaml", "--port", "0"]
    process = subprocess.Popen(
        [*command, "--out", str(out), *options], cwd=folder, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    try:
        lines = [process.stdout.readline().strip() for _ in range(3)]
        links = [process.stdout.readline().strip() for o in options if o == "2" for _ in range(2)]
        at = lines[0].split(": ")[1].removesuffix("/join")
        for _ in range(200):
            try:
                httpx.get(at)
                break
            except httpx.TransportError:
                time.sleep(0.1)
        yield process, at, links
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)
        process.stdout.close()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "study.yaml").write_text(PICTURED, encoding="utf-8")
    (tmp_path / "room.png").write_bytes(b"\x89PNG picture")
    (tmp_path / "secret.txt").write_text("the solution", encoding="utf-8")
    return tmp_path


def test_nobody_reaches_what_is_not_theirs(folder: Path) -> None:
    out = folder / "out"
    with served(folder, out, "--links", "2") as (_, at, links):
        code = links[0].rpartition("/")[2]
        page = httpx.get(f"{at}/p/{code}")
        assert page.status_code == 200
        assert "default-src 'none'" in page.headers["content-security-policy"]
        assert httpx.get(f"{at}/picture/0").content == b"\x89PNG picture"
        for path in (
            *(
                "/picture/1",
                "/picture/..%2Fsecret.txt",
                "/static/../key",
                "/static/%2e%2e/server.py",
                "/key",
                "/log.jsonl",
            ),
            *("/p/", f"/p/{code[:-1]}x", "/p/p0001", "/seat/p0001"),
        ):
            assert httpx.get(at + path).status_code == 404, path
        for headers in ({"host": "evil.example"}, {"host": "evil.example:80"}):
            assert httpx.get(f"{at}/p/{code}", headers=headers).status_code == 403
            assert httpx.get(f"{at}/join", headers=headers).status_code == 403
        seat = f"{at.replace('http', 'ws')}/seat/{code}"
        for origin in (None, "http://evil.example", at.replace("http", "https")):
            with pytest.raises(InvalidStatus), connect(seat, origin=origin):
                pass
        with connect(seat, origin=at) as line:
            assert '"do":"consent"' in line.recv()
            line.send("x" * 100_000)
            with pytest.raises(ConnectionClosed):
                line.recv()
        with connect(seat[:-1] + "x", origin=at) as line, pytest.raises(ConnectionClosed, match="4404"):
            line.recv()
    for private in ("key", "log.jsonl"):
        assert stat.S_IMODE((out / private).stat().st_mode) == 0o600


def test_who_comes_from_a_platform_gets_a_link_of_their_own_and_the_same_again(folder: Path) -> None:
    out = folder / "out"
    with served(folder, out) as (_, at, _links):
        first = httpx.get(f"{at}/join?PROLIFIC_PID=abc").headers["location"]
        assert httpx.get(f"{at}/join?PROLIFIC_PID=abc").headers["location"] == first
        assert httpx.get(f"{at}/join?PROLIFIC_PID=other").headers["location"] != first
    with served(folder, out) as (_, at, _links):
        assert httpx.get(f"{at}/join?PROLIFIC_PID=abc").headers["location"] == first, "after a new start, too"
    assert (out / "recruited.csv").read_text(encoding="utf-8").split() == ["p0001,abc", "p0002,other"]
    assert "abc" not in (out / "log.jsonl").read_text(), "ids are kept apart from the data"


@pytest.mark.parametrize("left", ["", "00ff\n", "zz" * 32])
def test_links_are_made_from_a_whole_secret_or_from_none(left: str, place: Path, tmp_path: Path) -> None:
    """A full disk leaves an empty file, from which anybody could make links."""

    async def code() -> str:
        server = StudyServer(loaded_study(ALONE, place), tmp_path, "127.0.0.1")
        await server.live.close()
        return server.code("p0001")

    (tmp_path / "key").touch(mode=0o600)
    (tmp_path / "key").write_text(left, encoding="ascii")
    if left:
        with pytest.raises(UsageError, match="key: got"):
            run(code)
        assert (tmp_path / "key").read_text(encoding="ascii") == left
        return
    made = run(code)
    assert made != hmac.new(b"", b"p0001", "sha256").hexdigest()[:40]
    assert run(code) == made
    assert stat.S_IMODE((tmp_path / "key").stat().st_mode) == 0o600


def test_a_row_that_was_cut_off_spoils_no_other(place: Path, tmp_path: Path) -> None:
    """As a server leaves it that was killed while it wrote down who comes."""

    async def come(*ids: str) -> list[str]:
        server = StudyServer(loaded_study(ALONE, place), tmp_path, "127.0.0.1")
        transport = httpx.ASGITransport(server.app)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            found = [(await client.get(f"/join?PROLIFIC_PID={one}")).headers["location"] for one in ids]
        await server.live.close()
        return found

    (first,) = run(lambda: come('quoted"%2Cid'))
    with open(tmp_path / "recruited.csv", "a", encoding="utf-8") as file:
        file.write('p0002,"cut off')
    again, other = run(lambda: come('quoted"%2Cid', "other"))
    assert again == first
    assert run(lambda: come("other", "cut off")) != [other, first]
    assert run(lambda: come("other"))[0] == other


def test_who_comes_twice_at_once_gets_one_link_and_a_look_ahead_gets_none(
    place: Path, tmp_path: Path
) -> None:
    async def come() -> set[str]:
        server = StudyServer(loaded_study(ALONE, place), tmp_path, "127.0.0.1")
        transport = httpx.ASGITransport(server.app)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            assert (await client.head("/join?PROLIFIC_PID=abc")).status_code == 200
            found = await asyncio.gather(*(client.get("/join?PROLIFIC_PID=abc") for _ in range(5)))
        assert len(server.live.progress.people) == 1
        await server.live.close()
        return {response.headers["location"] for response in found}

    assert len(run(come)) == 1


def test_behind_a_proxy_only_its_address_is_answered(place: Path, tmp_path: Path) -> None:
    async def ask() -> list[int]:
        server = StudyServer(loaded_study(ALONE, place), tmp_path, "127.0.0.1", "https://study.example.org")
        path = await server.invite()
        async with httpx.AsyncClient(transport=httpx.ASGITransport(server.app)) as client:
            found = [
                (await client.get(f"{at}{path}")).status_code
                for at in ("http://study.example.org", "http://127.0.0.1")
            ]
        await server.live.close()
        return found

    assert run(ask) == [200, 403]
    address = Address("127.0.0.1", "https://study.example.org/")
    assert address.comes_from_us("study.example.org", "https://study.example.org")
    assert not address.comes_from_us("study.example.org", "http://study.example.org")
    assert not address.comes_from_us("127.0.0.1:8870", "http://127.0.0.1:8870")


def test_two_servers_do_not_write_one_folder(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with served(folder, folder / "out"):
        assert (
            main(["study", "run", str(folder / "study.yaml"), "--port", "0", "--out", str(folder / "out")])
            == 2
        )
    assert "another process is writing this folder" in capsys.readouterr().err


@pytest.mark.thorough("starts a server ten times")
def test_a_server_that_is_killed_loses_no_step(folder: Path) -> None:
    out, taken, code = folder / "out", 0, ""
    for round_ in range(10):
        with served(folder, out, *(["--links", "2"] if not round_ else [])) as (process, at, links):
            code = code or links[0].rpartition("/")[2]
            seat = f"{at.replace('http', 'ws')}/seat/{code}"
            with connect(seat, origin=at) as line:
                screen = json.loads(line.recv())
                for _ in range(7):
                    if screen["do"] in ("consent", "page") or screen.get("ended"):
                        line.send(json.dumps({"do": "go", "on": screen["on"]}))
                    elif screen["do"] == "play":
                        act = {"movement": "left", "said": None, "shown": 0.0, "acted": 1.0}
                        line.send(json.dumps({"do": "act", "on": screen["on"], **act}))
                        taken += 1
                    screen = json.loads(line.recv())
                os.kill(process.pid, signal.SIGKILL)
    data = study_data(loaded_study(PICTURED, folder), out)
    assert len(data.tables["steps"]) == taken


@pytest.mark.parametrize("text", [ALONE, TOGETHER.replace("wait: 30", "wait: 5")])
def test_a_rehearsal_goes_through_the_server_and_says_what_came_of_it(
    text: str, place: Path, tmp_path: Path
) -> None:
    loaded = loaded_study(text, place)
    found = rehearse(loaded, tmp_path, 6, pace=0.5, speed=100)
    assert {course.kind for course in found.courses} == {
        "script",
        "random",
        "slow",
        "leaving",
        "reloading",
        "cheating",
    }
    assert all(course.finished or course.left for course in found.courses)
    lines = "\n".join(found.lines(loaded))
    assert "6 simulated participants" in lines
    assert "each came out as it did" in lines


@pytest.mark.parametrize(("jill", "stands_in"), [("script", False), ("person", True)])
def test_a_script_that_the_file_seats_is_no_stand_in(
    jill: str, stands_in: bool, place: Path, tmp_path: Path
) -> None:
    loaded = loaded_study(TOGETHER.replace("jill: person", f"jill: {jill}"), place)
    found = rehearse(loaded, tmp_path, 1, pace=0.5, speed=100, kinds=("random",))
    assert ("2 with a stand-in" in "\n".join(found.lines(loaded))) == stands_in, "nobody else comes"


def test_commands_say_what_they_found(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    rehearsal = ["study", "rehearse", "study.yaml", "--participants", "2", "--speed", "100", "--out", "kept"]
    assert main(rehearsal) == 0
    assert "pay: " in capsys.readouterr().out
    assert main(["study", "status", "study.yaml", "--out", "kept"]) == 0
    assert "alone: 2 came, 0 declined, 2 began, 2 finished" in capsys.readouterr().out
    assert main(["study", "data", "study.yaml", "--out", "kept"]) == 0
    assert "episodes played again" in capsys.readouterr().out
    assert main(rehearsal) == 2
    assert "is not empty" in capsys.readouterr().err
    assert main(["study", "status", "study.yaml", "--out", "nowhere"]) == 2
    assert "nowhere" in capsys.readouterr().err
