"""The opened folder: its scenarios, and nothing outside of it."""

from __future__ import annotations

import hashlib
import os
import re
import threading
import unicodedata
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from socialai_dsl.atomic import read_json, write_text
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.errors import UsageError
from socialai_dsl.loader.reader import FORBIDDEN, MAX_FILE_BYTES, SUFFIXES, read_source
from socialai_dsl.loader.resolved import taken_apart
from socialai_dsl.runs.folder import CONFIG
from socialai_dsl.studio.drafts import Draft, Drafts, new_window
from socialai_dsl.trainer.shipped import PREFIX, located, shipped_agents

PLAYERS: Final = ("me", "script", "random")
_MOST_FILES: Final = 500
_LONGEST_PART: Final = 200
_LONGEST_NAME: Final = 1000
_LINE_END_OR_BACKSLASH: Final = re.compile(r"[\t\n\r\\]")


class FileError(ValueError):
    """A file cannot be read or written; the message says why."""


class ConflictError(FileError):
    """Another program or window has written the file since it was read."""


@dataclass(frozen=True)
class Opened:
    """A file as a window opens it.

    Attributes:
        text, digest: what the file holds; empty and None where it is gone, and drafts of it are left.
        draft: what this window, or one that was closed, had typed into it.
        others: further drafts of windows that are closed, and of what was written over.
        elsewhere: how many other windows have typed into it and not saved.
    """

    text: str
    digest: str | None
    draft: Draft | None
    others: list[Draft]
    elsewhere: int


class Folder:
    """The scenarios of a folder, and the drafts of its windows.

    Args:
        root: the folder.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self._drafts = Drafts(self.root)
        self._turn = threading.RLock()

    def scenarios(self) -> list[str]:
        """Names of YAML files, as seen from the folder, without hidden ones; also of those that only have drafts."""
        found: list[str] = []
        for place, folders, files in os.walk(self.root):
            folders[:] = sorted(name for name in folders if not name.startswith((".", "node_modules")))
            names = (Path(place, name).relative_to(self.root).as_posix() for name in sorted(files))
            found += [name for name in names if self._may_be_opened(name)]
            if len(found) >= _MOST_FILES:
                break
        gone = {name for name in self._drafts.names() if self._may_be_opened(name)} - set(found)
        return [*found[:_MOST_FILES], *sorted(gone)]

    def runs(self) -> list[str]:
        """Folders of runs that have a checkpoint, as seen from the folder."""
        found = [
            path.parent for depth in ("*", "*/*", "*/*/*") for path in self.root.glob(f"{depth}/checkpoints")
        ]
        inside = (path for path in found if path.resolve().is_relative_to(self.root))
        return sorted(path.relative_to(self.root).as_posix() for path in inside)

    def players(self) -> list[str]:
        """The trained agents to watch: of the folder's runs, and those that ship."""
        return [*self.runs(), *(PREFIX + name for name in shipped_agents())]

    def trained_on(self, name: str) -> str:
        """The scenario on which one of `players` was trained, as the stem of its file; empty where nobody knows."""
        folder = located(name) if name.startswith(PREFIX) else self.root / name
        try:
            scenario = read_json(folder / CONFIG).get("scenario")
        except (OSError, ValueError, UsageError):
            return ""
        return Path(taken_apart(str(scenario))[0]).stem

    def player(self, name: str) -> str:
        """A player as `Session.begin` knows it; runs are named as seen from the folder.

        Raises:
            FileError: there is none of this name.
        """
        if name in PLAYERS:
            return name
        if name not in self.players():
            raise FileError(f"{_shown(name)}: there is no such run in the folder")
        return name if name.startswith(PREFIX) else str(self.root / name)

    def path(self, name: str) -> Path:
        """Where a scenario of this name lies, links followed. Every operation asks here what a name may be.

        Raises:
            FileError: it may not be the name of a scenario, or a link leads out of the folder or to something else.
        """
        wrong = name_problem(name)
        if wrong:
            raise FileError(f"{_shown(name)}: {wrong}")
        try:
            path = (self.root / name).resolve()
            wrong = name_problem(path.relative_to(self.root).as_posix())
        except (OSError, RuntimeError, ValueError):
            raise FileError(f"{name}: lies outside of the opened folder") from None
        if wrong:
            raise FileError(f"{name}: is a link to something that is no scenario of this folder")
        return path

    def read(self, name: str) -> tuple[str, str]:
        """The text of a scenario, its lines ended as editors on pages end them, and its digest.

        Raises:
            FileError: it cannot be read, or is no text.
        """
        path = self.path(name)
        try:
            text = "\n".join(read_source(path).lines())
        except ScenarioError as error:
            raise FileError(f"{name}: {error.diagnostics[0].text}") from None
        return text, digest(text)

    def write(self, name: str, text: str, known: str | None, window: str, over: bool = False) -> str:
        """Write a scenario, and forget this window's draft of it.

        Args:
            name: of the file.
            text: what it is to hold.
            known: digest of what it held when it was read; None for a new file.
            window: who writes.
            over: write over what was written by others since; that is kept as a draft.

        Returns:
            The digest of the text.

        Raises:
            ConflictError: it holds something else by now.
            FileError: it cannot be written.
        """
        path = self.path(name)
        if len(text.encode()) > MAX_FILE_BYTES:
            raise FileError(f"{name}: the text is larger than {MAX_FILE_BYTES // 1024} KiB")
        with self._turn, _told(name, "cannot be written"):
            if path.exists():
                if not os.access(path, os.W_OK):
                    raise FileError(f"{name}: this user may not write the file")
                self._make_way(name, text, known, over)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_text(path, text)
            self._drafts.forget(name, window)
        return digest(text)

    def create(self, name: str, text: str, window: str) -> str:
        """Write a new file under this name, or where there is one under the name with a number; which it is."""
        self.path(name)
        stem, suffix = os.path.splitext(name)
        with self._turn:
            number, free = 2, name
            while self.is_taken(free):
                free, number = f"{stem}_{number}{suffix}", number + 1
            self.write(free, text, None, window)
        return free

    def holds(self, name: str, text: str) -> bool:
        """Whether there is a file of this name with just this text."""
        try:
            return self.read(name)[0] == text
        except FileError:
            return False

    def is_taken(self, name: str) -> bool:
        """Whether there is something of this name, or of one that some file systems do not tell from it."""
        path = self.root / name
        try:
            return _folded(path.name) in map(_folded, os.listdir(path.parent))
        except OSError:
            return False

    # -- what was typed and not saved ------------------------------------------------------------------------

    def open(self, name: str, window: str, live: Collection[str], adopt: bool = True) -> Opened:
        """A file as a window opens it.

        Args:
            name: of the file.
            window: who opens it.
            live: the windows that are open.
            adopt: what a closed window has typed last becomes this one's draft, unless this one has its own.

        Raises:
            FileError: it cannot be read, or is no text.
        """
        path = self.path(name)
        with self._turn:
            drafts = self._drafts.of(name)
            text, known = ("", None) if drafts and not path.exists() else self.read(name)
            closed = [one for one in drafts if one.window == window or one.window not in live]
            for one in [one for one in closed if one.text == text and known is not None]:
                closed.remove(one)
                with suppress(OSError):
                    self._drafts.forget(name, one.window)
            own = next((one for one in closed if one.window == window), None)
            left = own or next((one for one in closed if adopt and not one.aside), None)
            if own is None and left is not None:
                with suppress(OSError):  # then it stays where it is
                    own = self._drafts.hand_over(left, window)
            elsewhere = {one.window for one in drafts} & {*live} - {window}
            return Opened(
                text, known, own or left, [one for one in closed if one is not left], len(elsewhere)
            )

    def keep_draft(self, name: str, text: str, base: str | None, window: str) -> None:
        """Keep what was typed into a file, until it is saved.

        Raises:
            FileError: it cannot be kept.
        """
        self.path(name)
        with self._turn, _told(name, "the draft cannot be kept"):
            self._drafts.keep(name, text, base, window)

    def take_draft(self, name: str, draft: str, window: str, live: Collection[str]) -> Draft:
        """Make the draft of a closed window this window's, whose own is put aside.

        Raises:
            FileError: there is none, or it cannot be kept.
        """
        with self._turn, _told(name, "the draft cannot be kept"):
            taken = self._closed(name, draft, live)
            own = [one for one in self._drafts.of(name) if one.window == window]
            for one in own:
                self._drafts.hand_over(one, new_window(), aside=True)
            return self._drafts.hand_over(taken, window)

    def discard_draft(self, name: str, draft: str, live: Collection[str]) -> None:
        """Delete the draft of a closed window.

        Raises:
            FileError: there is none, or it cannot be deleted.
        """
        with self._turn, _told(name, "the draft cannot be deleted"):
            self._drafts.forget(name, self._closed(name, draft, live).window)

    def forget_draft(self, name: str, window: str) -> None:
        """Forget what a window has typed, since it equals the file.

        Raises:
            FileError: it cannot be deleted.
        """
        self.path(name)
        with self._turn, _told(name, "the draft cannot be deleted"):
            self._drafts.forget(name, window)

    def _closed(self, name: str, draft: str, live: Collection[str]) -> Draft:
        """The draft of a window that is closed."""
        self.path(name)
        found = next(
            (one for one in self._drafts.of(name) if one.window == draft and draft not in live), None
        )
        if found is None:
            raise FileError(f"{name}: there is no such draft any more")
        return found

    def _make_way(self, name: str, text: str, known: str | None, over: bool) -> None:
        """Let a text be written over what a file holds, unless that is news to who writes it."""
        there, now = self.read(name)
        if there == text or now == known:
            return
        if not over:
            raise ConflictError(f"{name} was changed elsewhere since it was opened here")
        self._drafts.keep(name, there, digest(text), new_window(), aside=True)

    def _may_be_opened(self, name: str) -> bool:
        try:
            self.path(name)
        except FileError:
            return False
        return True


def opened(path: Path) -> tuple[Path, str]:
    """The folder that a path asks for, and the file in it to show first; empty for a folder alone.

    Raises:
        UsageError: there is nothing there, or something else.
    """
    try:
        if path.is_dir():
            list(path.iterdir())
            return path.resolve(), ""
        if path.is_file() and path.suffix in SUFFIXES:
            return path.resolve().parent, path.name
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    what = f"{path} is no scenario's file" if path.exists() else f"there is no {path}"
    raise UsageError(f"{what}; expected a folder, or a file that ends in .yaml")


def name_problem(name: str) -> str | None:
    """The reason why a scenario may not have this name, as seen from the folder; None if it may.

    A name is that of a YAML file in the folder or in a folder below it, written with `/`. No part of it is hidden or
    leads upwards, none has control characters, line ends or backslashes, and all are short enough for the file that is
    put beside them while they are written.
    """
    if FORBIDDEN.search(name) or _LINE_END_OR_BACKSLASH.search(name):
        return "expected a name without control characters, line ends and backslashes"
    if len(name.encode()) > _LONGEST_NAME:
        return f"expected a name of at most {_LONGEST_NAME} bytes"
    parts = name.split("/")
    if name.startswith("/") or ".." in parts:
        return "lies outside of the opened folder"
    if any(not part or part.startswith(".") for part in parts):
        return "expected a name of which no part is empty or begins with a dot"
    if any(part != part.strip() for part in parts):
        return "expected a name of which no part begins or ends with a blank"
    if any(len(part.encode()) > _LONGEST_PART for part in parts):
        return f"expected a name of which no part has more than {_LONGEST_PART} bytes"
    if not name.endswith(SUFFIXES):
        return "expected a name that ends in .yaml"
    return None


def digest(text: str) -> str:
    """By which one text is known from another."""
    return hashlib.sha256(text.encode()).hexdigest()


@contextmanager
def _told(name: str, what: str) -> Iterator[None]:
    """Say in words that the system does not do something with a file."""
    try:
        yield
    except OSError as error:
        raise FileError(f"{name}: {what}: {error.strerror}") from None


def _folded(name: str) -> str:
    """A file's name, so that two are equal that some file systems do not tell apart."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _shown(name: str) -> str:
    """A name that may be anything, in a message."""
    return ascii(name if len(name) <= 80 else name[:60] + "...")
