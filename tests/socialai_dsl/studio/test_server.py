"""The server: whoever lacks the token or comes from another page gets nothing, and a lost process harms nobody else."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from socialai_dsl.cli.main import main

uvicorn = pytest.importorskip("uvicorn", reason="no test of the studio's server without the extra `studio`")
pytest.importorskip("starlette", reason="no test of the studio's server without the extra `studio`")
websocket = pytest.importorskip(
    "websockets.sync.client", reason="no test of the studio's server without websockets"
)


from websockets.exceptions import WebSocketException  # noqa: E402

from socialai_dsl.studio import server  # noqa: E402

SCENARIOS = Path(__file__).parents[3] / "scenarios"


@dataclass
class Client:
    """Asks a server that runs in a thread of this process."""

    port: int

    def get(self, path: str, host: str | None = None) -> HTTPResponse:
        with closing(HTTPConnection("127.0.0.1", self.port, timeout=30)) as connection:
            connection.request("GET", path, headers={"Host": host or f"127.0.0.1:{self.port}"})
            answer = connection.getresponse()
            answer.read()
            return answer

    def window(self, path: str = "session?token=token", origin: str | None = "own") -> Any:
        own = f"http://127.0.0.1:{self.port}"
        return websocket.connect(
            f"ws://127.0.0.1:{self.port}/{path}", origin=own if origin == "own" else origin, max_size=None
        )


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    shutil.copy(SCENARIOS / "talkitout.yaml", tmp_path)
    studio = server.Studio(tmp_path, "talkitout.yaml", "token", "127.0.0.1")
    listening = socket.create_server(("127.0.0.1", 0))
    running = uvicorn.Server(uvicorn.Config(studio.app, log_level="error", ws="websockets-sansio"))
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
    thread.start()
    while not running.started:
        time.sleep(0.02)
    yield Client(listening.getsockname()[1])
    running.should_exit = True
    thread.join(30)
    assert not thread.is_alive()


class Window:
    def __init__(self, opened: Any) -> None:
        self.opened, self.number = opened, 0

    def ask(self, do: str, /, **more: Any) -> dict[str, Any]:
        self.number += 1
        self.opened.send(json.dumps({"id": self.number, "do": do, **more}))
        answer: dict[str, Any] = json.loads(self.opened.recv(60))
        assert answer.pop("id") == self.number
        return answer


def test_the_page_needs_the_token_and_allows_no_script_but_ours(client: Client) -> None:
    assert client.get("/").status == 403
    assert client.get("/?token=wrong").status == 403
    page = client.get("/?token=token")
    assert page.status == 200
    policy = page.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "unsafe" not in policy
    assert client.get("/?token=token", host="evil.example:8765").status == 403
    assert client.get("/static/studio.js").status == 200
    for name in ("server.py", "..%2fserver.py", "%2e%2e/files.py", "editor.d.ts"):
        assert client.get(f"/static/{name}").status == 404


@pytest.mark.parametrize("path", ["session", "language"])
@pytest.mark.parametrize(
    ("query", "origin"),
    [("", "own"), ("?token=wrong", "own"), ("?token=token", None), ("?token=token", "http://evil.example")],
)
def test_websockets_need_token_and_origin(client: Client, path: str, query: str, origin: str | None) -> None:
    with pytest.raises(WebSocketException), client.window(path + query, origin) as opened:
        opened.recv(5)


def test_a_window_reads_plays_and_saves(client: Client, tmp_path: Path) -> None:
    with client.window() as opened:
        window = Window(opened)
        listed = window.ask("list")
        assert listed["files"] == ["talkitout.yaml"]
        assert "shipped:talkitout" in listed["runs"], "a trained agent to watch"
        found = window.ask("read", name="talkitout.yaml")
        drawn = window.ask("draw", path="talkitout.yaml", text=found["text"], seed=3)
        assert drawn["trace"]["scenario"] == "talkitout"
        assert window.ask("act", movement="forward")["more"]["moments"][0]["t"] == 1
        window.ask("draft", name="talkitout.yaml", text="typed")
        assert window.ask("read", name="talkitout.yaml")["draft"] == "typed"
        text = found["text"].replace("horizon: 100", "horizon: 90")
        assert "digest" in window.ask("save", name="talkitout.yaml", text=text, digest=found["digest"])
        assert window.ask("save", name="talkitout.yaml", text="mine", digest=found["digest"])["conflict"]
        assert (tmp_path / "talkitout.yaml").read_text() == text
        assert window.ask("copy", shipped="dance")["name"] == "dance.yaml"
        created = window.ask("create", template="ask-a-guide", called="mine")["name"]
        assert window.ask("draw", path=created, text=(tmp_path / created).read_text())["findings"] == []
        for refused in (
            window.ask("read", name="../x.yaml"),
            window.ask("draw", path="../x.yaml", text=""),
            window.ask("begin", player="../run"),
            window.ask("begin", player="shipped:../run"),
            window.ask("save", name="x.yaml"),
            window.ask("nonsense"),
            window.ask("copy", shipped="../x"),
            window.ask("create", template="empty", called="../x"),
        ):
            assert refused["refused"]


def test_what_takes_too_long_is_stopped_and_says_so(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    with client.window() as opened:
        window = Window(opened)
        found = window.ask("read", name="talkitout.yaml")
        monkeypatch.setattr(server, "_USUAL_SECONDS", 0.001)
        stopped = window.ask("draw", path="talkitout.yaml", text=found["text"])
        assert "was stopped" in stopped["refused"]
        assert stopped["lost"]
        monkeypatch.setattr(server, "_USUAL_SECONDS", 60)
        assert "trace" in window.ask("draw", path="talkitout.yaml", text=found["text"])


def test_a_process_that_dies_is_replaced_and_harms_no_other(client: Client) -> None:
    with client.window() as opened, client.window() as other:
        window, neighbour = Window(opened), Window(other)
        found = window.ask("read", name="talkitout.yaml")
        assert "trace" in window.ask("draw", path="talkitout.yaml", text=found["text"])
        deadline = time.monotonic() + 30
        # The one that has loaded everything is on its way out.
        while len(multiprocessing.active_children()) > 1:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        (own,) = multiprocessing.active_children()
        assert "trace" in neighbour.ask("draw", path="talkitout.yaml", text=found["text"])
        own.kill()
        lost = window.ask("act", movement="forward")
        assert lost["lost"]
        assert "has ended" in lost["refused"]
        assert "more" in neighbour.ask("act", movement="forward")
        assert "trace" in window.ask("draw", path="talkitout.yaml", text=found["text"])


def test_a_process_cannot_fill_the_machine() -> None:
    command = (
        "import os, socket\nfrom socialai_dsl.studio.worker import MOST_BYTES, answer_window\n"
        "ours, theirs = socket.socketpair()\nours.close()\nanswer_window(theirs, os.getcwd())\nbytearray(MOST_BYTES)"
    )
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, timeout=60)
    assert "MemoryError" in done.stderr


@pytest.mark.thorough("starts a process")
def test_ctrl_c_ends_it_without_a_word_and_no_module_of_the_folder_was_imported(tmp_path: Path) -> None:
    shutil.copy(SCENARIOS / "talkitout.yaml", tmp_path)
    for name in ("yaml", "multiprocessing", "socialai_dsl"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a module of the folder was imported')\n")
    # As the installed command starts, which does not look for modules in the present folder.
    command = "import sys; sys.path.remove(''); from socialai_dsl.cli.main import main; sys.exit(main())"
    running = subprocess.Popen(
        [sys.executable, "-c", command, "studio", "--no-browser", "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=tmp_path,
    )
    assert running.stdout is not None
    found = re.search(r"http://127.0.0.1:(\d+)/\?token=(\S+)", running.stdout.readline())
    assert found is not None
    with Client(int(found[1])).window(f"session?token={found[2]}") as opened:
        text = (tmp_path / "talkitout.yaml").read_text()
        assert "trace" in Window(opened).ask("draw", path="talkitout.yaml", text=text)
        os.killpg(running.pid, signal.SIGINT)  # as a terminal does
        _, told = running.communicate(timeout=30)
    assert (told, running.returncode) == ("", 0)


@pytest.mark.parametrize("failing", [lambda address: False, Mock(side_effect=webbrowser.Error("none"))])
def test_without_a_browser_it_prints_the_address(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], failing: Any
) -> None:
    monkeypatch.setattr(webbrowser, "open", failing)
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, sockets: sockets[0].close())
    assert main(["studio", str(tmp_path), "--port", "0"]) == 0
    told = capsys.readouterr().out
    assert "http://127.0.0.1:" in told
    assert "no browser could be opened" in told


def test_mistakes_of_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    binary = tmp_path / "x.bin"
    binary.write_bytes(b"\0")
    with socket.create_server(("127.0.0.1", 0)) as used:
        port = used.getsockname()[1]
        for words, told in (
            ([str(tmp_path / "none")], "there is no"),
            ([str(binary)], "is no scenario's file"),
            ([str(tmp_path), "--port", str(port)], "is in use"),
            ([str(tmp_path), "--port", "99999"], "expected 0 to 65535"),
            ([str(tmp_path), "--host", "203.0.113.1"], "--host"),
        ):
            assert main(["studio", "--no-browser", *words]) == 2
            assert told in capsys.readouterr().err
