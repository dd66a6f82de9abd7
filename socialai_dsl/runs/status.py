"""The status of a run that an experiment works on: its state, and each attempt at it."""

from __future__ import annotations

import errno
import json
import os
import socket
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

from socialai_dsl.atomic import read_json, write_text
from socialai_dsl.errors import UnreadableError

State = Literal["waiting", "running", "done", "failed", "cancelled"]

_BLOCK: Final = 4096
"""Status files fill whole blocks, so that one can be changed on a disk that has none left."""


@dataclass
class Status:
    """What a run's folder says about the run.

    Attributes:
        state: waiting (also: stopped half-way), running, done, failed or cancelled.
        attempts: each time that a process worked on it: host, pid, started, ended, reason, from_frames.
        message: what a person should know, if anything.
    """

    state: State = "waiting"
    attempts: list[dict[str, Any]] = field(default_factory=list)
    message: str | None = None

    @classmethod
    def read(cls, path: Path) -> Status:
        """What a file says; where there is none, that the run is waiting.

        Raises:
            UnreadableError: it says no state.
            OSError: it cannot be read.
        """
        try:
            content = read_json(path)
        except FileNotFoundError:
            return cls()
        if content.get("state") not in get_args(State):
            raise UnreadableError(f"{path}: unknown state {content.get('state')!r}")
        return cls(content["state"], content.get("attempts", []), content.get("message"))

    def write(self, path: Path) -> None:
        """Replace the file; only the run's worker may.

        Raises:
            OSError: it cannot be written.
        """
        text = json.dumps(vars(self), indent=1, ensure_ascii=True)
        text += " " * (-(len(text) + 1) % _BLOCK) + "\n"
        try:
            write_text(path, text)
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            _overwrite(path, text, error)

    def begin(self, pid: int, from_frames: int) -> None:
        """Note that a process works on the run now."""
        self.state, self.message = "running", None
        self.attempts.append(
            {
                "host": socket.gethostname(),
                "pid": pid,
                "started": time.time(),
                "ended": None,
                "reason": None,
                "from_frames": from_frames,
            }
        )

    def end(self, reason: str, ended: float | None = None) -> None:
        """Note why the last attempt ended, if it has not ended yet."""
        if self.attempts and self.attempts[-1]["ended"] is None:
            self.attempts[-1] |= {"ended": time.time() if ended is None else ended, "reason": reason}


def _overwrite(path: Path, text: str, error: OSError) -> None:
    """Write over the blocks that the file has already, which a full disk still lets one do."""
    try:
        with open(path, "r+", encoding="utf-8") as file:
            if os.fstat(file.fileno()).st_size < len(text):
                raise error
            file.write(text)
    except FileNotFoundError:
        raise error from None
