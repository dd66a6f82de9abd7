"""Messages as nobody should send them: those of the studio with parts missing, added or replaced, and what is none."""

from __future__ import annotations

import json
import socket
from typing import Any

from hypothesis import strategies as st

GAME: list[dict[str, Any]] = [
    {"do": "draw", "path": "talkitout.yaml", "text": "scenario: x\n", "room": {"seed": 3, "layout": {}}},
    {"do": "begin", "room": {"seed": 3, "index": 2}, "player": "random", "variant": ""},
    {"do": "begin", "seat": "agent", "others": {"bob": "nobody"}},
    {
        "do": "show",
        "shown": {"room": {"test_episode": 1}, "variant": "+oracle", "acts": ["left", "How are you"]},
    },
    {"do": "act", "movement": "left", "sentence": None, "line": None},
    {"do": "act", "line": "forward How are you"},
    {"do": "auto"},
    {"do": "act", "movement": "left", "acts": {"bob": [0, 0, 0, 0]}, "stands_in": True},
    {"do": "choose", "line": "forward How are you"},
    {"do": "glance", "seat": "bob"},
    {"do": "back", "to": 0},
    {"do": "place", "who": "wizard", "at": [1, 1]},
    {"do": "look", "who": "wizard"},
    {"do": "layout"},
    {"do": "write_layout", "text": "scenario: x\n"},
    {"do": "replay"},
    {"do": "check", "path": "talkitout.yaml", "text": "scenario: x\n"},
    {"do": "test", "path": "talkitout.yaml", "text": "scenario: x\n"},
    {"do": "write_test", "name": "mine", "former": "tests_of: talkitout.yaml\ntests:\n"},
]
FILES: list[dict[str, Any]] = [
    {"do": "hello", "window": None},
    {"do": "list"},
    {"do": "invite", "seat": "bob", "seconds": 60.0},
    {"do": "read", "name": "talkitout.yaml", "adopt": False},
    {"do": "save", "name": "other.yaml", "text": "x", "digest": None, "over": True},
    {"do": "draft", "name": "talkitout.yaml", "text": "typed", "base": None},
    {"do": "take", "name": "talkitout.yaml", "draft": "0" * 16},
    {"do": "discard", "name": "talkitout.yaml", "draft": "0" * 16},
    {"do": "copy", "shipped": "dance"},
    {"do": "create", "template": "empty", "called": "mine"},
    {"do": "add", "name": "added.yaml", "text": "x"},
    {"do": "explain", "code": "S101"},
]

_scalars = (
    st.none()
    | st.booleans()
    | st.integers(-(1 << 70), 1 << 70)
    | st.floats()
    | st.text()
    | st.sampled_from(
        ["../x.yaml", "a\nb.yaml", ".x.yaml", "\0", "/etc/passwd", "a" * 3000, 10**400, -1, 1 << 63]
    )
)
_values = st.recursive(
    _scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner), max_leaves=5
)
_NESTED = [
    "[" * 5000,
    '{"id": 1, "do": ' + '{"a":' * 400 + "1" + "}" * 401,
    '{"id": 1, "do": "auto", "x": ' + "[" * 999,
]


@st.composite
def _changed(draw: st.DrawFn, known: list[dict[str, Any]]) -> str:
    message = {"id": 7, **draw(st.sampled_from(known))}
    for _ in range(draw(st.integers(0, 2))):
        key = draw(st.sampled_from([*message, "do", "id", "more"]))
        message[key] = draw(_values)
        if draw(st.booleans()):
            del message[key]
    return json.dumps(message)


def texts(known: list[dict[str, Any]]) -> st.SearchStrategy[str]:
    """Texts of which some are messages of this kind."""
    changed = _changed(known)
    cut = st.builds(lambda text, end: text[:end], changed, st.integers(0, 40))
    return changed | changed | cut | _values.map(json.dumps) | st.text() | st.sampled_from(_NESTED)


def answer_wrongly(connection: socket.socket, root: str) -> None:
    """Be a window's process that answers with what the question's text asks for."""
    with connection.makefile("r", encoding="utf-8") as questions:
        for line in questions:
            connection.sendall(json.loads(line)["text"].encode("latin-1"))
            connection.shutdown(socket.SHUT_WR)
