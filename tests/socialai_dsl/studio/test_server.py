"""The server: whoever lacks the token or comes from another page gets nothing, and a lost process harms nobody else."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from socialai_dsl.cli.main import main

uvicorn = pytest.importorskip("uvicorn", reason="no test of the studio's server without the extra `studio`")
pytest.importorskip("starlette", reason="no test of the studio's server without the extra `studio`")
websocket = pytest.importorskip(
    "websockets.sync.client", reason="no test of the studio's server without websockets"
)


from websockets.exceptions import WebSocketException  # noqa: E402

from socialai_dsl.studio import engine  # noqa: E402
from tests.socialai_dsl.studio.clients import Client, Window, serving  # noqa: E402
from tests.socialai_dsl.studio.hostile import FILES, GAME, texts  # noqa: E402
from tests.socialai_dsl.studio.processes import wait_until_none_works, workers  # noqa: E402

SCENARIOS = Path(__file__).parents[3] / "scenarios"
MOST = 3


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    shutil.copy(SCENARIOS / "talkitout.yaml", tmp_path)
    with serving(tmp_path, "talkitout.yaml", MOST) as found:
        yield found


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
    for host in ("localhost:80", "localhost", "[::1]:8765", "[::1]", "127.0.0.1"):
        assert client.get("/?token=token", host=host).status == 200
    for host in ("localhost.evil.example", "evil.example", "[::1", "127.0.0.1.evil.example:1"):
        assert client.get("/?token=token", host=host).status == 403
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
        assert {"name": "shipped:talkitout", "scenario": "talkitout"} in listed["agents"]
        found = window.ask("read", name="talkitout.yaml")
        drawn = window.ask("draw", path="talkitout.yaml", text=found["text"], room={"seed": 3})
        assert drawn["episode"]["trace"]["scenario"] == "talkitout"
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
            window.ask("add", name="a\nb.yaml", text=""),
            window.ask("save", name=".x.yaml", text="", digest=None),
            window.ask("draft", name="../x.yaml", text=""),
        ):
            assert refused["refused"]


def test_what_takes_too_long_is_stopped_and_says_so(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    with client.window() as opened:
        window = Window(opened)
        found = window.ask("read", name="talkitout.yaml")
        monkeypatch.setattr(engine, "_USUAL_SECONDS", 0.001)
        stopped = window.ask("draw", path="talkitout.yaml", text=found["text"])
        assert "was stopped" in stopped["refused"]
        assert stopped["lost"]
        monkeypatch.setattr(engine, "_USUAL_SECONDS", 60)
        assert "episode" in window.ask("draw", path="talkitout.yaml", text=found["text"])


def test_a_process_that_dies_is_replaced_and_harms_no_other(client: Client) -> None:
    with client.window() as opened, client.window() as other:
        window, neighbour = Window(opened), Window(other)
        found = window.ask("read", name="talkitout.yaml")
        assert "episode" in window.ask("draw", path="talkitout.yaml", text=found["text"])
        deadline = time.monotonic() + 30
        # The one that has loaded everything is on its way out.
        while len(workers()) > 1:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        (own,) = workers()
        assert "episode" in neighbour.ask("draw", path="talkitout.yaml", text=found["text"])
        os.kill(own, signal.SIGKILL)
        lost = window.ask("act", movement="forward")
        assert lost["lost"]
        assert "has ended" in lost["refused"]
        assert "more" in neighbour.ask("act", movement="forward")
        assert "episode" in window.ask("draw", path="talkitout.yaml", text=found["text"])


def test_whatever_a_window_sends_is_answered_and_its_game_goes_on(
    client: Client, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    outside = sorted(tmp_path.parent.iterdir())
    with client.window() as opened:
        window = Window(opened)
        text = window.ask("read", name="talkitout.yaml")["text"]
        assert "episode" in window.ask("draw", path="talkitout.yaml", text=text)
        harmless = [one for one in GAME if one["do"] not in ("draw", "begin", "act", "auto", "back", "place")]

        @settings(
            max_examples=120, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
        )
        @given(texts(harmless + FILES) | st.binary(max_size=30))
        def each(message: str | bytes) -> None:
            opened.send(message)
            answer = json.loads(opened.recv(60))
            assert not answer.get("lost"), answer

        each()
        opened.send('{"id": 8, "do": "draw", "text": "' + "a" * (3 << 20))
        assert json.loads(opened.recv(60))["id"] == 8
        opened.send(['{"id": 9, ', '"do": "layout"', "}"])  # in frames
        assert json.loads(opened.recv(60))["do"] == "layout"
        assert window.ask("act", movement="left")["more"]["moments"][0]["t"] == 1, "no message ended its game"
    assert sorted(tmp_path.parent.iterdir()) == outside
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "message",
    [
        b"\0",
        "",
        "[]",
        "null",
        '{"jsonrpc": "2.0"}',
        '{"jsonrpc": "2.0", "id": 1}' + "x",
        '{"jsonrpc": "1.0", "id": 1, "method": "shutdown"}',
        '{"jsonrpc": "2.0", "id": [], "method": "shutdown"}',
        '{"jsonrpc": "2.0", "id": 1, "method": 3}',
        '{"jsonrpc": "2.0", "id": 1, "method": "a", "params": [1]}',
        '{"jsonrpc": "2.0", "id": 1, "method": "a", "params": ' + "[" * 999,
        '{"jsonrpc": "2.0", "id": 1, "method": "a", "params": {"textDocument": null, "x": "'
        + "a" * (3 << 20)
        + '"}}',
        *(
            json.dumps(
                {
                    "jsonrpc": "2.0",
                    "id": 1,
                    "method": "textDocument/hover",
                    "params": {"textDocument": document},
                }
            )
            for document in (
                3,
                {},
                {"uri": 3},
                {"uri": "file:///etc/x.yaml"},
                {"uri": "http://[/x.yaml"},
                {"uri": "file://{root}/../x.yaml"},
                {"uri": "file://{root}/%2e%2e/x.yaml"},
                {"uri": "file://{root}/x%00.yaml"},
                {"uri": "file://{root}/%ff.yaml"},
            )
        ),
    ],
)
def test_the_language_server_gets_no_message_that_is_none(
    client: Client, tmp_path: Path, message: str | bytes
) -> None:
    if isinstance(message, str):
        message = message.replace("{root}", str(tmp_path))
    hello = {
        "jsonrpc": "2.0",
        "id": 2,
        "method": "initialize",
        "params": {"processId": None, "capabilities": {}},
    }
    with client.window("language?token=token") as opened:
        opened.send(message)
        assert json.loads(opened.recv(60))["error"]["code"] == -32600
        opened.send(json.dumps(hello))
        assert "capabilities" in json.loads(opened.recv(60))["result"]


def test_a_language_server_that_ends_says_so(client: Client) -> None:
    with client.window("language?token=token") as opened:
        opened.send('{"jsonrpc": "2.0", "method": "exit"}')
        with pytest.raises(WebSocketException, match=r"1011.*connect again"):
            opened.recv(60)


CLAIMS = {"do": "check", "path": "talkitout.yaml", "text": (SCENARIOS / "talkitout.yaml").read_text()}
DRAWING = {**CLAIMS, "do": "draw"}


@pytest.mark.parametrize(
    ("path", "asked", "after"),
    [
        ("session", [CLAIMS, CLAIMS], 1.0),
        ("session", [CLAIMS, CLAIMS], 0.0),
        ("session", [CLAIMS, CLAIMS, DRAWING, DRAWING], 0.05),
        ("session", [DRAWING, {"do": "begin", "player": "script"}, *[{"do": "auto"}] * 30], 0.3),
        ("language", [], 0.0),
        ("language", [{"jsonrpc": "2.0", "method": "exit"}], 0.0),
    ],
)
def test_nothing_is_left_of_a_window_that_is_closed_while_it_is_served(
    client: Client, path: str, asked: list[dict[str, Any]], after: float
) -> None:
    for gently in (True, False):
        with client.window(f"{path}?token=token") as opened:
            for number, one in enumerate(asked):
                opened.send(json.dumps({"id": number, **one} if path == "session" else one))
            time.sleep(after)
            if not gently:
                opened.socket.shutdown(socket.SHUT_RDWR)
        wait_until_none_works()


def test_what_was_sent_last_before_a_window_was_closed_is_kept(client: Client, tmp_path: Path) -> None:
    typed = {"do": "draft", "name": "talkitout.yaml", "text": "typed", "base": None}
    with client.window() as opened:
        name = Window(opened).ask("hello", window=None)["window"]
        for number, one in enumerate((DRAWING, typed)):
            opened.send(json.dumps({"id": number, **one}))
    with client.window() as opened:
        window = Window(opened)
        assert window.ask("hello", window=name)["window"] == name
        assert window.ask("read", name="talkitout.yaml")["draft"] == "typed"


def test_a_window_that_is_loaded_again_has_its_own_draft(client: Client) -> None:
    with client.window() as opened, client.window() as other:
        window, neighbour = Window(opened), Window(other)
        mine, theirs = (one.ask("hello", window=None)["window"] for one in (window, neighbour))
        assert mine != theirs
        for one, text in ((window, "mine"), (neighbour, "theirs")):
            one.ask("draft", name="talkitout.yaml", text=text)
        assert neighbour.ask("hello", window=mine)["window"] == theirs, (
            "a tab that was doubled is another window"
        )
        opened.close()
        with client.window() as again:
            anew = Window(again)
            assert anew.ask("hello", window=mine)["window"] == mine
            found = anew.ask("read", name="talkitout.yaml")
            assert (found["draft"], found["elsewhere"], found["others"]) == ("mine", 1, [])


@pytest.mark.parametrize("path", ["session", "language"])
def test_one_window_too_many_is_told_and_opens_when_another_closes(client: Client, path: str) -> None:
    address, deadline = f"{path}?token=token", time.monotonic() + 30
    with client.window(address), client.window(address), ExitStack() as third:
        third.enter_context(client.window(address))
        with (
            pytest.raises(
                WebSocketException, match=r"4429.*as many windows are open as may be \(3\); close one"
            ),
            client.window(address) as too_many,
        ):
            too_many.recv(30)
        third.close()
        while True:
            with client.window(address) as opened, suppress(WebSocketException):
                opened.send('{"id": 1, "do": "hello", "window": null}')
                assert "4429" not in opened.recv(30)
                break
            assert time.monotonic() < deadline


def test_bytes_that_are_no_text_end_the_connection_and_nothing_else(
    client: Client, capfd: pytest.CaptureFixture[str]
) -> None:
    with client.window() as opened:
        Window(opened).ask("draw", path="talkitout.yaml", text=DRAWING["text"])
        opened.send(b"\xff\xfe", text=True)
        with pytest.raises(WebSocketException, match="1007"):
            opened.recv(30)
    wait_until_none_works()
    assert capfd.readouterr().err == ""


def test_a_page_of_another_studio_is_told(client: Client) -> None:
    with (
        pytest.raises(WebSocketException, match=r"4403.*another studio answers here"),
        client.window("session?token=x") as opened,
    ):
        opened.recv(30)


def test_an_address_is_kept_for_the_next_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, sockets: sockets[0].close())
    told: list[str] = []
    monkeypatch.setattr(webbrowser, "open", told.append)
    other = tmp_path / "other"
    other.mkdir()
    for folder, *more in ((tmp_path, "--port", "0"), (tmp_path,), (other, "--port", "0")):
        assert main(["studio", str(folder), *map(str, more)]) == 0
    assert told[0] == told[1], "a page that is open finds the server again"
    assert told[2].partition("token=")[2] != told[0].partition("token=")[2]
    for file in Path(os.environ["XDG_STATE_HOME"]).rglob("*.json"):
        assert file.stat().st_mode & 0o077 == 0
        file.chmod(0o644)
    assert main(["studio", str(tmp_path)]) == 0
    assert told[3] != told[0], "others could have read it"
    for file in Path(os.environ["XDG_STATE_HOME"]).rglob("*.json"):
        file.write_text("{}")
    assert main(["studio", str(tmp_path)]) == 0
    monkeypatch.setenv("XDG_STATE_HOME", "/proc/none")
    assert main(["studio", str(tmp_path)]) == 0
    assert len(set(told[3:])) == 3


def test_a_process_cannot_fill_the_machine() -> None:
    command = (
        "import os, socket\nfrom socialai_dsl.studio.worker import MOST_BYTES, answer_window\n"
        "ours, theirs = socket.socketpair()\nours.shutdown(socket.SHUT_WR)\nanswer_window(theirs, os.getcwd())\n"
        "bytearray(MOST_BYTES)"
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
        assert "episode" in Window(opened).ask("draw", path="talkitout.yaml", text=text)
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
            ([str(tmp_path), "--windows", "0"], "--windows: got 0, expected at least 1"),
        ):
            assert main(["studio", "--no-browser", *words]) == 2
            assert told in capsys.readouterr().err
