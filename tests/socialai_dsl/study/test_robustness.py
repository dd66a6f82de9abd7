"""The real server, killed at random moments and on a full disk: nothing is lost, and nothing is there twice."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from datetime import datetime
from http.client import HTTPConnection, HTTPException
from itertools import count
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from socialai_dsl.study.log import FILE, read_log
from socialai_dsl.study.replay import study_data
from tests.socialai_dsl.study.participants import loaded_study

resource = pytest.importorskip("resource", reason="limits are those of POSIX")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="kills and limits are those of POSIX")

STUDY = """\
study: robust
consent: I agree.
blocks:
- {name: alone, scenario: talkitout_no_liar, episodes: 200, groups: [1]}
- name: two
  scenario: together/help_together
  episodes: 200
  groups: [2]
  seats: {agent: person, jill: person}
  wait: 3600
  away: 600
  act_within: 3600
assign: {groups: 2}
"""
KILLS = 50


class Server:
    """A server in a process of its own, always at the same address."""

    def __init__(
        self, folder: Path, out: Path, limit: int | None = None, environment: Mapping[str, str] | None = None
    ) -> None:
        self._folder, self._out, self._limit = folder, out, limit
        self._environment = {**os.environ, **(environment or {})}
        self.port, self.links = 0, []
        self.process: subprocess.Popen[str]

    @property
    def at(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start(self, links: int = 0) -> None:
        command = [sys.executable, "-m", "socialai_dsl", "study", "run", "study.yaml"]
        more = ["--port", str(self.port), "--out", str(self._out)]
        more += ["--links", str(links)] if links else []

        def bounded() -> None:
            if self._limit is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (self._limit, resource.RLIM_INFINITY))

        self.process = subprocess.Popen(
            [*command, *more],
            cwd=self._folder,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=bounded,
            env=self._environment,
        )
        assert self.process.stdout is not None
        if links:
            said = [self.process.stdout.readline().strip() for _ in range(3 + links)]
            self.port = int(said[0].removesuffix("/join").rpartition(":")[2])
            self.links = [line.rpartition("/")[2] for line in said[3:]]

    def answers(self) -> bool:
        line = HTTPConnection("127.0.0.1", self.port, timeout=10)
        with suppress(OSError, HTTPException), closing(line):
            line.request("GET", "/")
            return line.getresponse().status == 404
        return False

    def wait(self) -> None:
        while not self.answers():
            assert self.process.poll() is None, "the server ended by itself"
            time.sleep(0.05)

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


@contextmanager
def served(
    folder: Path,
    out: Path,
    links: int,
    limit: int | None = None,
    environment: Mapping[str, str] | None = None,
) -> Iterator[Server]:
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    server = Server(folder, out, limit, environment)
    server.start(links)
    try:
        server.wait()
        yield server
    finally:
        server.kill()


class Client(threading.Thread):
    """Somebody who plays, and comes again as often as the connection is lost.

    Each act has a number of its own, as the time at which it was chosen.

    Attributes:
        sent: number of an act -> movement. seen: those after which the next picture came. disk: how often it was full.
    """

    _numbers = count(1)

    def __init__(self, server: Server, code: str) -> None:
        super().__init__(daemon=True)
        self._server, self._code, self._rng = server, code, random.Random(code)
        self.over = threading.Event()
        self.sent: dict[int, str] = {}
        self.seen: list[int] = []
        self.disk = 0
        self.wrong: list[str] = []

    def run(self) -> None:
        while not self.over.is_set():
            with suppress(WebSocketException, OSError, EOFError, TimeoutError):
                self._play()
            time.sleep(0.02)

    def _play(self) -> None:
        at = self._server.at
        uri = f"{at.replace('http', 'ws')}/seat/{self._code}"
        with connect(uri, origin=at, open_timeout=5) as line:  # type: ignore[arg-type]
            asked: tuple[str, int] | None = None
            while not self.over.is_set():
                screen = self._next(line)
                if screen is None:
                    continue
                if screen.get("notice") == "disk":
                    self.disk += 1
                    asked = None  # it has not happened, and is chosen again
                elif asked is not None and screen["on"] == asked[0]:
                    continue
                elif asked is not None:
                    self.seen.append(asked[1])
                    asked = None
                if screen["do"] in ("end", "room") or screen.get("waiting"):
                    continue
                time.sleep(0.02)
                if screen["do"] == "consent" or screen.get("ended"):
                    line.send(json.dumps({"do": "go", "on": screen["on"]}))
                    continue
                number = next(self._numbers)
                self.sent[number] = self._rng.choice(["left", "right", "forward"])
                act = {"do": "act", "on": screen["on"], "movement": self.sent[number], "said": None}
                line.send(json.dumps({**act, "shown": 0.0, "acted": float(number)}))
                asked = screen["on"], number

    def _next(self, line: Any) -> dict[str, Any] | None:
        try:
            screen: dict[str, Any] = json.loads(line.recv(timeout=0.5))
        except TimeoutError:
            line.send('{"do":"beat"}')
            return None
        return screen


def compare(clients: list[Client], folder: Path, out: Path) -> int:
    """See that the log has each act once, as it was sent, and none that nobody sent; how many were seen."""
    sent = {number: move for client in clients for number, move in client.sent.items()}
    logged: Counter[int] = Counter()
    steps: Counter[tuple[str, int, int]] = Counter()
    for event in read_log(out / FILE):
        if event["event"] != "step":
            continue
        steps[event["game"], event["episode"], event["t"]] += 1
        for time_ in event["times"].values():
            logged[int(time_["acted"])] += 1
            assert time_["movement"] == sent[int(time_["acted"])]
    assert set(logged.values()) <= {1}, "nothing twice"
    assert set(steps.values()) <= {1}
    seen = [number for client in clients for number in client.seen]
    assert len(set(seen)) == len(seen)
    assert [number for number in seen if number not in logged] == [], (
        "what was shown to have happened has happened"
    )
    assert study_data(loaded_study(STUDY, folder), out).replayed > 0
    return len(seen)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_server_that_is_killed_at_random_moments_loses_nothing(tmp_path: Path) -> None:
    """Also while it starts, and between what two people who play together choose."""
    rng, out = random.Random(11), tmp_path / "out"
    with served(tmp_path, out, links=4) as server:
        clients = [Client(server, code) for code in server.links]
        for client in clients:
            client.start()
        for _ in range(KILLS):
            if rng.random() < 0.8:
                server.wait()
            time.sleep(rng.uniform(0, 1.5))
            server.kill()
            server.start()
        server.wait()
        time.sleep(5)
        for client in clients:
            client.over.set()
        for client in clients:
            client.join(20)
    seen = compare(clients, tmp_path, out)
    print(f"killed {KILLS} times; {seen} acts were shown to have happened, and each is there once")
    assert seen > KILLS
    starts = sum(event["event"] == "server" for event in read_log(out / FILE))
    assert starts > KILLS // 2


@pytest.mark.thorough("plays while the clock of the server is set, which needs libfaketime")
def test_a_clock_that_is_set_while_people_play_changes_nothing(tmp_path: Path) -> None:
    """By a day and by a month, to and fro: the log has the times as they were, each act once, and goes on."""
    library = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
    if library is None:
        pytest.skip("needs libfaketime")
    out, offset = tmp_path / "out", tmp_path / "offset"
    offset.write_text("+0", encoding="utf-8")
    environment = {
        "LD_PRELOAD": str(library),
        "FAKETIME_TIMESTAMP_FILE": str(offset),
        "FAKETIME_CACHE_DURATION": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }
    with served(tmp_path, out, links=4, environment=environment) as server:
        clients = [Client(server, code) for code in server.links]
        for client in clients:
            client.start()
        for moved in ("+0", "-1d", "+30d", "-30d", "+0"):
            offset.write_text(moved, encoding="utf-8")
            time.sleep(2)  # the library reads the file once a second
            so_far = [len(client.seen) for client in clients]
            until = time.monotonic() + 60
            while any(len(one.seen) == seen for one, seen in zip(clients, so_far, strict=True)):
                assert time.monotonic() < until, f"nobody plays on at {moved}"
                time.sleep(0.05)
        for client in clients:
            client.over.set()
        for client in clients:
            client.join(20)
    assert compare(clients, tmp_path, out) > 0
    events = list(read_log(out / FILE))
    days = [datetime.fromisoformat(event["time"]).toordinal() for event in events]
    assert max(days) - min(days) >= 59, "the clock was set"
    seconds = [event["mono"] for event in events]
    assert seconds == sorted(seconds)


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A disk of 256 KiB. Skips the test where nothing can be mounted."""
    folder.mkdir()
    mounting = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mounting, capture_output=True).returncode:
        pytest.skip("needs the right to mount a small disk")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def fill_up(client: Client) -> None:
    """Wait until the disk is full for somebody who plays."""
    while client.disk < 3:
        time.sleep(0.05)


@pytest.mark.thorough("plays until a small disk is full")
@pytest.mark.parametrize("how", ["a small disk", "a limit of files"])
def test_a_study_on_a_full_disk_goes_on_once_there_is_room(how: str, tmp_path: Path) -> None:
    if how == "a small disk":
        with small_disk(tmp_path / "disk") as disk:
            ballast = disk / "ballast"
            ballast.write_bytes(b"x" * (190 * 1024))
            on_a_full_disk(tmp_path, disk / "out", None, lambda server: ballast.unlink())
        return

    def raise_limit(server: Server) -> None:
        free = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, free)

    on_a_full_disk(tmp_path, tmp_path / "out", 40_000, raise_limit)


def on_a_full_disk(folder: Path, out: Path, limit: int | None, make_room: Any) -> None:
    with served(folder, out, links=1, limit=limit) as server:
        client = Client(server, server.links[0])
        client.start()
        fill_up(client)
        before = len(client.seen)
        if limit is None:  # which bounds each file by itself, so that a short line may still have room
            assert httpx.get(f"{server.at}/join?PROLIFIC_PID=x").status_code == 507
        assert all(line.endswith(b"\n") for line in (out / FILE).read_bytes().splitlines(keepends=True))
        make_room(server)
        while len(client.seen) < before + 20:
            time.sleep(0.05)
        link = httpx.get(f"{server.at}/join?PROLIFIC_PID=x").headers["location"]
        assert httpx.get(f"{server.at}/join?PROLIFIC_PID=x").headers["location"] == link
        client.over.set()
        client.join(20)
    compare([client], folder, out)
