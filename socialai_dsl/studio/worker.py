"""A process of its own for each window: it answers JSON lines, so that nothing that happens in it ends the server.

Started as `python -m socialai_dsl.studio.worker ROOT`, or with `--language` as the language server.
"""

from __future__ import annotations

import inspect
import json
import os
import sys
from pathlib import Path
from typing import Any, Final, TextIO

_SMALLEST: Final = """scenario: ready
horizon: 3
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 5}
cast: {agent: {at: [1, 1]}}
outcome: [{failure: agent.did(done)}, {success: agent.did(toggle)}]
"""


def main(words: list[str]) -> None:
    """Answer until the input ends."""
    root = Path(words[-1]).resolve()
    os.chdir(root)
    if words[0] == "--language":
        from socialai_dsl.authoring.server import make_server

        make_server().start_io()
        return
    # Whatever prints must not come between the answers.
    answers, sys.stdout = sys.stdout, sys.stderr
    serve(sys.stdin, answers)


def serve(questions: TextIO, answers: TextIO) -> None:
    """Say `{"ready": true}`, then answer one line by another.

    `{"do": name, ...}` is answered by what the method of `Session` returns, or by `{"refused": why}`.
    """
    from socialai_dsl.diagnostics import ScenarioError
    from socialai_dsl.studio.session import RefusalError, Session

    session = Session()
    session.draw(
        str(Path("ready.yaml").resolve()), _SMALLEST
    )  # compiled code is loaded before anybody waits for it
    print(json.dumps({"ready": True}), file=answers, flush=True)
    session = Session()
    for line in questions:
        try:
            reply = answer(session, json.loads(line))
        except RefusalError as refusal:
            reply = {"refused": str(refusal)}
        except ScenarioError as error:
            reply = {"refused": str(error.diagnostics[0].text)}
        print(json.dumps(reply), file=answers, flush=True)


def answer(session: Any, asked: dict[str, Any]) -> dict[str, Any]:
    """What a session says to a question.

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


if __name__ == "__main__":
    main(sys.argv[1:])
