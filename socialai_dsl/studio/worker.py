"""The process of a window, whose failures do not end the server.

A window has two of them: one answers a line of JSON with another, one is the language server of its editor.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import select
import signal
import socket
import threading
from pathlib import Path
from typing import Any, Final

from socialai_dsl.authoring.server import make_server
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.envs.seats import NOBODY
from socialai_dsl.studio.files import FileError, Folder
from socialai_dsl.studio.judging import JUDGED
from socialai_dsl.studio.messages import QUESTIONS, Question, RefusalError, Refused, parsed
from socialai_dsl.studio.session import ASKED, Session

MOST_BYTES: Final = 4 << 30
"""What a process may hold; a trained agent needs a tenth of it."""
_IDLE_SECONDS: Final = 0.2


def answer_window(connection: socket.socket, root: str) -> None:
    """Answer questions that come over a connection until it is closed.

    Args:
        connection: to the server.
        root: the folder of the scenarios.
    """
    _settle(connection, root)
    desk = Desk(Path(root))
    with (
        contextlib.suppress(OSError),  # the server is gone
        connection.makefile("r", encoding="utf-8", errors="replace") as questions,
        connection.makefile("w", encoding="utf-8") as answers,
    ):
        while True:
            if not select.select([connection], [], [], _IDLE_SECONDS)[0]:
                desk.prepare()
            line = questions.readline()
            if not line:
                return
            answers.write(desk.answer(line) + "\n")
            answers.flush()


def serve_language(connection: socket.socket, root: str) -> None:
    """Be the language server at this end of a connection; arguments as for `answer_window`."""
    _settle(connection, root)
    make_server().start_io(connection.makefile("rb"), connection.makefile("wb"))


class Desk:
    """Answers a window's questions; whatever they are, it answers the next one, too.

    Args:
        root: the folder of the scenarios.
    """

    def __init__(self, root: Path) -> None:
        self._folder, self._session = Folder(root), Session()

    def answer(self, line: str) -> str:
        """The answer to a line of JSON, which is a `Question`: an `Answer`, as JSON."""
        question = parsed(QUESTIONS, line)
        if isinstance(question, Refused):
            return question.model_dump_json()
        try:
            reply = {"id": question.id, "do": question.do, **self._reply(question)}
            return json.dumps(reply, allow_nan=False)
        except (RefusalError, FileError) as refusal:
            why, lost = str(refusal), False
        except ScenarioError as error:
            why, lost = str(error.diagnostics[0]), False
        except MemoryError:
            why, lost = f"this needs more than {MOST_BYTES >> 30} GiB of memory", True
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            why, lost = f"the engine has failed and begins anew; please report it: {said[:1000]}", True
        if lost:
            self._session = Session()
        return Refused(id=question.id, refused=why, lost=lost).model_dump_json()

    def prepare(self) -> None:
        """Do what the next question would otherwise wait for."""
        with contextlib.suppress(
            Exception
        ):  # what fails now fails again when it is asked for, and is told then
            self._session.prepare()

    def _reply(self, question: Question) -> dict[str, Any]:
        more = {name: value for name, value in question if name not in ("id", "do")}
        if "path" in more:
            more["path"] = str(self._folder.path(more["path"]))
        if "player" in more:
            more["player"] = self._folder.player(more["player"])
        if "others" in more:
            more["others"] = {
                seat: who if who == NOBODY else self._folder.player(who)
                for seat, who in more["others"].items()
            }
        if question.do in JUDGED:
            return JUDGED[question.do](**more)
        return ASKED[question.do](self._session, **more)


def _settle(connection: socket.socket, root: str) -> None:
    """Be a process of this folder, which the server ends and not Ctrl-C, and which cannot fill the machine."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(connection,), daemon=True).start()
    os.chdir(root)
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    allowed = MOST_BYTES if most == resource.RLIM_INFINITY else min(MOST_BYTES, most)
    resource.setrlimit(resource.RLIMIT_DATA, (allowed, most))


def _end_with(connection: socket.socket) -> None:
    """End this process when the other end is closed, whatever it does then, as the server may have been killed."""
    other_end = select.poll()
    other_end.register(connection, 0)
    other_end.poll()
    os._exit(0)
