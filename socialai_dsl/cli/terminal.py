"""What commands print: its colours, lines that are written over, JSON, tables."""

import json
import os
from collections.abc import Callable, Sequence
from typing import IO, Any


def shows_color(stream: IO[Any]) -> bool:
    """Whether to colour: a terminal that is not dumb, unless NO_COLOR is set to anything (no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def json_text(value: Any) -> str:
    """A value as the JSON that commands print."""
    return json.dumps(value, indent=2, ensure_ascii=False)


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of a table, whose columns begin one below the other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = [[f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)] for row in rows]
    return ["  ".join(row).rstrip() for row in padded]


class ProgressLine:
    """Says how far something is: on a terminal in one line that is written over, elsewhere in a line each."""

    def __init__(self, stream: IO[str]) -> None:
        self._stream, self._is_shown = stream, False

    def show(self, line: str) -> None:
        """Say this."""
        if self._stream.isatty():
            print(f"\r{line}\x1b[K", end="", file=self._stream, flush=True)
            self._is_shown = True
        else:
            print(line, file=self._stream, flush=True)

    def clear(self) -> None:
        """Take the line away."""
        if self._is_shown:
            print("\r\x1b[K", end="", file=self._stream, flush=True)
            self._is_shown = False

    def above(self, stream: IO[str]) -> Callable[[str], None]:
        """Write lines of a report to another stream, where they do not mix with this one."""

        def say(line: str) -> None:
            self.clear()
            print(line, file=stream, flush=True)

        return say
