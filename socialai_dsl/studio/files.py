"""The opened folder: its scenarios, and nothing outside of it."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from pathlib import Path
from typing import Final
from urllib.parse import quote

from socialai_dsl.atomic import write_text
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.reader import MAX_FILE_BYTES, SUFFIXES, read_source

_DRAFTS: Final = ".studio"
_MOST_FILES: Final = 500
_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_. -]{0,60}\.(yaml|yml)")


class FileError(ValueError):
    """A file cannot be read or written; the message says why."""


class ConflictError(FileError):
    """Another program has written the file since it was read."""


class Folder:
    """The scenarios of a folder.

    Args:
        root: the folder.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()

    def scenarios(self) -> list[str]:
        """Names of YAML files, as seen from the folder, without hidden ones."""
        found: list[str] = []
        for place, folders, files in os.walk(self.root):
            folders[:] = sorted(name for name in folders if not name.startswith((".", "node_modules")))
            names = (Path(place, name) for name in sorted(files) if name.endswith(SUFFIXES))
            found += [path.relative_to(self.root).as_posix() for path in names if self._is_inside(path)]
            if len(found) >= _MOST_FILES:
                break
        return found[:_MOST_FILES]

    def runs(self) -> list[str]:
        """Folders of runs that have a checkpoint, as seen from the folder."""
        found = [
            path.parent for depth in ("*", "*/*", "*/*/*") for path in self.root.glob(f"{depth}/checkpoints")
        ]
        return sorted(path.relative_to(self.root).as_posix() for path in found if self._is_inside(path))

    def path(self, name: str) -> Path:
        """Where a scenario of this name lies.

        Raises:
            FileError: it is no YAML file, or would lie outside of the folder.
        """
        path = self.root / name
        if "\0" in name or path.suffix not in SUFFIXES:
            raise FileError(f"{name!r}: expected a name that ends in .yaml")
        if not self._is_inside(path) or _DRAFTS in Path(name).parts:
            raise FileError(f"{name}: lies outside of the opened folder")
        return path.resolve()

    def read(self, name: str) -> tuple[str, str]:
        """The text of a scenario, and its digest.

        Raises:
            FileError: it cannot be read, or is no text.
        """
        path = self.path(name)
        try:
            text = read_source(path).text
        except ScenarioError as error:
            raise FileError(f"{name}: {error.diagnostics[0].text}") from None
        return text, digest(text)

    def write(self, name: str, text: str, known: str | None) -> str:
        """Write a scenario, and forget its draft.

        Args:
            name: of the file.
            text: what it is to hold.
            known: digest of what it held when it was read; None for a new file.

        Returns:
            The digest of the text.

        Raises:
            ConflictError: it holds something else by now.
            FileError: it cannot be written.
        """
        path = self.path(name)
        if len(text.encode()) > MAX_FILE_BYTES:
            raise FileError(f"{name}: the text is larger than {MAX_FILE_BYTES // 1024} KiB")
        there = path.exists()
        if there and not os.access(path, os.W_OK):
            raise FileError(f"{name}: this user may not write the file")
        if there and (known is None or self.read(name)[1] != known):
            raise ConflictError(f"{name} was changed elsewhere since it was opened here")
        try:
            write_text(path, text)
        except OSError as error:
            raise FileError(f"{name}: cannot be written: {error.strerror}") from None
        self.forget_draft(name)
        return digest(text)

    def create(self, name: str, text: str) -> str:
        """Write a new file under this name, or where there is one under the name with a number; which it is."""
        if not _NAME.fullmatch(name):
            raise FileError(f"{name!r}: expected letters, digits and underscores, and the ending .yaml")
        stem, number, free = Path(name).stem, 2, name
        while (self.root / free).exists():
            free, number = f"{stem}_{number}.yaml", number + 1
        self.write(free, text, None)
        return free

    # -- what was typed and not saved ------------------------------------------------------------------------

    def keep_draft(self, name: str, text: str) -> None:
        """Keep what was typed into a file beside it, until it is saved."""
        draft = self._draft(name)
        try:
            draft.parent.mkdir(exist_ok=True)
            write_text(draft, text)
        except OSError as error:
            raise FileError(f"{name}: the draft cannot be kept: {error.strerror}") from None

    def draft(self, name: str) -> str | None:
        """The unsaved text of a file; None without one."""
        try:
            return self._draft(name).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            return None

    def forget_draft(self, name: str) -> None:
        """Forget what was typed and not saved."""
        with contextlib.suppress(OSError):
            self._draft(name).unlink()

    def _draft(self, name: str) -> Path:
        self.path(name)
        return self.root / _DRAFTS / quote(name, safe="")

    def _is_inside(self, path: Path) -> bool:
        """Whether a path, its links followed, lies in the folder."""
        try:
            return path.resolve().is_relative_to(self.root)
        except (OSError, RuntimeError, ValueError):
            return False


def digest(text: str) -> str:
    """By which one text is known from another."""
    return hashlib.sha256(text.encode()).hexdigest()
