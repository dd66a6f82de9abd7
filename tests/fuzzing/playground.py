"""A folder with scenarios to extend, secrets outside of it, and an ear on what is opened and executed."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.trainer.shipped import agents_folder

ROOT = Path(__file__).parents[2]
DIAGNOSTICS = ROOT / "tests" / "diagnostics"
SECRET = "secret-666"
"""In the text of every file that nobody may read."""

_EXECUTING = ("exec", "compile", "import", "subprocess", "os.system", "os.exec", "os.spawn", "os.posix_spawn",
              "socket", "pickle", "ctypes", "marshal.loads", "code.__new__", "os.remove", "os.rename", "shutil",
              "os.mkdir", "os.rmdir", "os.symlink", "os.link", "os.chmod")  # fmt: skip
"""Beginnings of the names of events that reading a file never gives rise to."""


class Ear:
    """Hears of everything that Python opens, lists or executes while it listens.

    Attributes:
        opened: paths, in order. executed: names of other events that ought not to be.
    """

    def __init__(self) -> None:
        self.opened: list[str] = []
        self.executed: list[str] = []


_listening: list[Ear] = []


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if not _listening:
        return
    if event in ("open", "os.listdir", "os.scandir"):
        path = arguments[0]
        if isinstance(path, str | bytes | os.PathLike):
            _listening[-1].opened.append(os.fsdecode(path))
    elif event.startswith(_EXECUTING):
        _listening[-1].executed.append(event)


sys.addaudithook(_hear)  # for the life of the process; silent unless somebody listens


@contextmanager
def listening() -> Iterator[Ear]:
    """Hear what happens meanwhile."""
    ear = Ear()
    _listening.append(ear)
    try:
        yield ear
    finally:
        _listening.remove(ear)


class Playground:
    """A folder of scenarios, `user`, and beside it what it must not get at.

    Attributes:
        folder: where files are read. file: the one whose text is made up.
    """

    def __init__(self, place: Path) -> None:
        self.folder = (place / "user").resolve()
        self.folder.mkdir(parents=True)
        self.file = self.folder / "fuzz.yaml"
        for name in ("small.yaml", "rich.yaml", "town.yaml"):
            shutil.copy(DIAGNOSTICS / name, self.folder)
        shutil.copytree(DIAGNOSTICS / "guides", self.folder / "guides")
        (self.folder / "small_x.yaml").write_text("variant: small_x\nof: small.yaml\nset: {horizon: 9}\n")
        for name in ("outside", "user2"):
            (place / name).mkdir()
            (place / name / "secret.yaml").write_text(f"scenario: secret\nabout: {SECRET}\n")
        (place / "secret.yaml").write_text(f"scenario: secret\nabout: {SECRET}\n")
        os.symlink(place / "outside" / "secret.yaml", self.folder / "link.yaml")
        os.symlink(place / "outside", self.folder / "linked")
        os.symlink("loop.yaml", self.folder / "loop.yaml")
        self._allowed = (self.folder, shipped_folder().resolve(), agents_folder())

    def outside(self, ear: Ear) -> list[str]:
        """What was opened or listed that lies neither in the folder nor among the scenarios and agents that ship."""
        real = [Path(os.path.realpath(path)) for path in ear.opened]
        return [
            str(path) for path in real if not any(path.is_relative_to(folder) for folder in self._allowed)
        ]
