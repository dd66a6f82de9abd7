"""A studio's server in a thread of this process, and who talks to it."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any

import uvicorn
from websockets.sync import client as websocket

from socialai_dsl.studio import server
from tests.socialai_dsl.studio.processes import wait_until_none_works


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


@contextmanager
def serving(folder: Path, opened: str, most: int) -> Iterator[Client]:
    """A studio of a folder, whose token is `token`."""
    studio = server.Studio(folder, opened, "token", "127.0.0.1", most)
    listening = socket.create_server(("127.0.0.1", 0))
    running = uvicorn.Server(uvicorn.Config(studio.app, log_level="error", ws="websockets-sansio"))
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
    thread.start()
    while not running.started:
        time.sleep(0.02)
    yield Client(listening.getsockname()[1])
    wait_until_none_works()
    running.should_exit = True
    thread.join(30)
    assert not thread.is_alive()


class Window:
    """Asks questions over a connection, and waits for the answer of each; what nobody has asked for is kept."""

    def __init__(self, opened: Any) -> None:
        self.opened, self.number = opened, 1000  # hostile messages have small numbers
        self.told: list[dict[str, Any]] = []

    def ask(self, do: str, /, **more: Any) -> dict[str, Any]:
        number = self.say(do, **more)
        answer = self.answer(number)
        assert answer.pop("do") in (do, "refused")
        return answer

    def say(self, do: str, /, **more: Any) -> int:
        """Ask without waiting; the number of the question."""
        self.number += 1
        self.opened.send(json.dumps({"id": self.number, "do": do, **more}))
        return self.number

    def answer(self, number: int) -> dict[str, Any]:
        """The answer to a question."""
        while (said := json.loads(self.opened.recv(60))).pop("id") != number:
            self.told.append(said)
        return dict(said)

    def hears(self, do: str, **what: Any) -> dict[str, Any]:
        """What comes without being asked for, up to a message of this word that says this."""
        while True:
            if not self.told:
                said = json.loads(self.opened.recv(60))
                assert said.pop("id") == 0, said
                self.told.append(said)
            found = self.told.pop(0)
            if found["do"] == do and what.items() <= found.items():
                return found
