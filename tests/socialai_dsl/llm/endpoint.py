"""An OpenAI-compatible endpoint on this machine that answers as a test wants, faults included."""

import json
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

Respond = Callable[[dict[str, Any]], Any]
"""Takes a request; returns a message (or its text), (status, headers, content), or None to hang up.

Content that is not bytes is sent piece by piece.
"""


class Stub:
    """What a stub was asked.

    Attributes:
        url: of the interface. requests: bodies, in the order in which they came. keys: of each request.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.requests: list[dict[str, Any]] = []
        self.keys: list[str] = []


def completion(message: Any, finish_reason: str = "stop") -> bytes:
    """The content of an answer; it takes ten tokens and two."""
    message = {"role": "assistant", "content": message} if isinstance(message, str) else message
    usage = {"prompt_tokens": 10, "completion_tokens": 2, "total_tokens": 12}
    choice = {"index": 0, "message": message, "finish_reason": finish_reason}
    found = {"id": "1", "object": "chat.completion", "created": 0, "model": "stub", "choices": [choice]}
    return json.dumps({**found, "usage": usage}).encode()


def slowly(pieces: Iterable[bytes], seconds: float) -> Iterator[bytes]:
    """Wait before each piece."""
    for piece in pieces:
        time.sleep(seconds)
        yield piece


def stream(text: str) -> tuple[int, dict[str, str], bytes]:
    """The same as events, for requests with `stream`."""
    head = {"id": "1", "object": "chat.completion.chunk", "created": 0, "model": "stub"}
    delta = {"index": 0, "delta": {"role": "assistant", "content": text}, "finish_reason": None}
    end = {"index": 0, "delta": {}, "finish_reason": "stop"}
    usage = {"prompt_tokens": 10, "completion_tokens": 2, "total_tokens": 12}
    chunks = [{"choices": [delta]}, {"choices": [end]}, {"choices": [], "usage": usage}]
    events = [*(json.dumps({**head, **chunk}) for chunk in chunks), "[DONE]"]
    content = "".join(f"data: {event}\n\n" for event in events)
    return 200, {"Content-Type": "text/event-stream"}, content.encode()


@contextmanager
def endpoint(respond: Respond) -> Iterator[Stub]:
    """Serve on a free port of the loopback interface."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            stub.requests.append(body)
            stub.keys.append(self.headers.get("Authorization", ""))
            answer = respond(body)
            self.close_connection = True
            if answer is None:
                return
            status, headers, content = answer if isinstance(answer, tuple) else (200, {}, completion(answer))
            whole = isinstance(content, bytes)
            length = {"Content-Length": str(len(content))} if whole else {}
            self.send_response(status)
            for name, value in {**length, "Connection": "close", **headers}.items():
                self.send_header(name, value)
            with suppress(ConnectionError):  # one who is answered may have left
                self.end_headers()
                for piece in [content] if whole else content:
                    self.wfile.write(piece)

        def log_message(self, format: str, *arguments: Any) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    stub = Stub(f"http://127.0.0.1:{server.server_port}/v1")
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield stub
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
