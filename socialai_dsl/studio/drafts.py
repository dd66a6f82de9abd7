"""What was typed and not saved: a draft for each window and file, in a hidden folder beside the scenarios."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
import time
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, ValidationError

from socialai_dsl.atomic import write_text
from socialai_dsl.studio.messages import WindowId

FOLDER: Final = ".studio"
_LARGEST: Final = 16 << 20
_FILE: Final = re.compile(r"[0-9a-f]{16}-[0-9a-f]{16}\.json")


class Draft(BaseModel):
    """A text that is not saved.

    Attributes:
        name: of the file it was typed into. text: what was typed. base: digest of the file that the typing began with;
            None for a new file.
        window: whose it is. time: when it was kept, in seconds since 1970.
        aside: nobody was typing it when it was kept, so that no window opens it without being asked to.
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    name: str
    text: str
    base: str | None
    window: WindowId
    time: float
    aside: bool = False


class Drafts:
    """The drafts of a folder.

    Args:
        root: the folder of the scenarios.
    """

    def __init__(self, root: Path) -> None:
        self._folder = root / FOLDER

    def keep(self, name: str, text: str, base: str | None, window: str, aside: bool = False) -> Draft:
        """Keep a text in place of the window's former draft of this file.

        Raises:
            OSError: it cannot be written.
        """
        draft = Draft(name=name, text=text, base=base, window=window, time=time.time(), aside=aside)
        self._folder.mkdir(mode=0o700, exist_ok=True)
        if not self._is_folder():
            raise NotADirectoryError(0, f"{FOLDER} is no folder")
        write_text(self._file(name, window), draft.model_dump_json())
        return draft

    def of(self, name: str) -> list[Draft]:
        """The drafts of a file, the newest first."""
        return sorted((one for one in self._all() if one.name == name), key=lambda one: -one.time)

    def names(self) -> set[str]:
        """The files that have drafts."""
        return {one.name for one in self._all()}

    def forget(self, name: str, window: str) -> None:
        """Delete a window's draft of a file.

        Raises:
            OSError: it cannot be deleted.
        """
        if self._is_folder():
            self._file(name, window).unlink(missing_ok=True)

    def hand_over(self, draft: Draft, window: str, aside: bool = False) -> Draft:
        """Make a draft another window's.

        Raises:
            OSError: it cannot be written.
        """
        handed = self.keep(draft.name, draft.text, draft.base, window, aside)
        self.forget(draft.name, draft.window)
        return handed

    def _file(self, name: str, window: str) -> Path:
        return self._folder / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}-{window}.json"

    def _all(self) -> list[Draft]:
        """All drafts that can be read. Links are not followed, so that nothing outside of the folder is shown."""
        try:
            names = os.listdir(self._folder) if self._is_folder() else []
        except OSError:
            return []
        found = [_read(self._folder / name) for name in names if _FILE.fullmatch(name)]
        return [one for one in found if one is not None and self._file(one.name, one.window).name in names]

    def _is_folder(self) -> bool:
        """Whether drafts lie in a folder of their own, not in one that a link leads to."""
        try:
            return stat.S_ISDIR(os.lstat(self._folder).st_mode)
        except OSError:
            return False


def new_window() -> str:
    """A name that no window has had."""
    return secrets.token_hex(8)


def _read(path: Path) -> Draft | None:
    """The draft in a file; None if that is a link, or holds none."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return None
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return None
        try:
            return Draft.model_validate_json(file.read(_LARGEST))
        except (OSError, ValidationError):
            return None
