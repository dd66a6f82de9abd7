"""What a person plays, on disk before the next picture is shown."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

FORMAT: Final = "socialai-played/1"
FILE: Final = "played.jsonl"


class Journal:
    """The file of one session, a line of JSON for each event: `session`, `episode`, `step`, `undo` and `end`.

    Args:
        file: must not be there yet, so that nothing which was played is ever replaced.
        about: what the first line says of the session.

    Raises:
        OSError: it cannot be written.
    """

    def __init__(self, file: Path, about: Mapping[str, Any]) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        self._file = open(file, "x", encoding="utf-8")  # noqa: SIM115 - closed by `close`
        self.note("session", format=FORMAT, **about)

    def note(self, event: str, **more: Any) -> None:
        """Append an event with the present time; it is on disk when this returns.

        Raises:
            OSError: it cannot be written.
        """
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._file.write(json.dumps({"event": event, "time": now, **more}, ensure_ascii=False) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let the file go."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_journal(file: Path) -> list[dict[str, Any]]:
    """The events of a session, up to a line that was cut off.

    Raises:
        OSError: it cannot be read.
        ValueError: it is none of ours.
    """
    events: list[dict[str, Any]] = []
    for line in file.read_bytes().split(b"\n")[:-1]:
        try:
            event = json.loads(line)
        except ValueError:
            break
        if not isinstance(event, dict):
            break
        events.append(event)
    if not events or events[0].get("format") != FORMAT:
        raise ValueError(f"{file}: expected a session of the format {FORMAT}")
    return events
