"""The process of a window, whose failures do not end the server.

A window has two of them: one answers a line of JSON with another, one is the language server of its editor.
"""

from __future__ import annotations

import inspect
import json
import os
import resource
import signal
import socket
from collections.abc import Iterable
from typing import Any, Final, TextIO

MOST_BYTES: Final = 4 << 30
"""What a process may hold; a trained agent needs a tenth of it."""


def answer_window(connection: socket.socket, root: str) -> None:
    """Answer questions that come over a connection until it is closed.

    Args:
        connection: to the server.
        root: the folder of the scenarios.
    """
    _settle(root)
    serve(connection.makefile("r", encoding="utf-8"), connection.makefile("w", encoding="utf-8"))


def serve_language(connection: socket.socket, root: str) -> None:
    """Be the language server at this end of a connection; arguments as for `answer_window`."""
    from socialai_dsl.authoring.server import make_server

    _settle(root)
    make_server().start_io(connection.makefile("rb"), connection.makefile("wb"))


def serve(questions: Iterable[str], answers: TextIO) -> None:
    """Answer one line by another.

    `{"do": name, ...}` is answered by what the method of `Session` returns, or by `{"refused": why}`.
    """
    from socialai_dsl.diagnostics import ScenarioError
    from socialai_dsl.studio.session import RefusalError, Session

    session = Session()
    for line in questions:
        try:
            reply = answer(session, json.loads(line))
        except RefusalError as refusal:
            reply = {"refused": str(refusal)}
        except ScenarioError as error:
            reply = {"refused": str(error.diagnostics[0].text)}
        except MemoryError:
            reply = {"refused": f"this needs more than {MOST_BYTES >> 30} GiB of memory"}
        print(json.dumps(reply), file=answers, flush=True)


def answer(session: Any, asked: dict[str, Any]) -> dict[str, Any]:
    """A session's answer to a question.

    Raises:
        RefusalError: it is none, or cannot be done.
    """
    from socialai_dsl.studio.session import ASKED, RefusalError

    method = ASKED.get(str(asked.pop("do", "")))
    if method is None:
        raise RefusalError("got a question that there is no answer to")
    try:
        inspect.signature(method).bind(session, **asked)
    except TypeError as error:
        raise RefusalError(f"got a question that is not complete: {error}") from None
    return method(session, **asked)


def _settle(root: str) -> None:
    """Be a process of this folder, which the server ends and not Ctrl-C, and which cannot fill the machine."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.chdir(root)
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    allowed = MOST_BYTES if most == resource.RLIM_INFINITY else min(MOST_BYTES, most)
    resource.setrlimit(resource.RLIMIT_DATA, (allowed, most))
