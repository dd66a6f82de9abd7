"""The journal of a study: its log, and where everybody is by what the log says."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from socialai_dsl.checking.studies import LoadedStudy, block_name
from socialai_dsl.errors import UsageError
from socialai_dsl.study.arena import Arena
from socialai_dsl.study.log import FILE, Event, Log, follow
from socialai_dsl.study.progress import Progress
from socialai_dsl.study.replay import header_of, study_file


class Journal:
    """What happens in a study: applied at once, on disk before it is shown.

    Args:
        loaded: the study.
        folder: holds the log; it is there.
        arenas: what is played, by the number of the block.
        simulated: whether those who take part are simulated, which the log says.

    Attributes:
        progress: where everybody is.
        spent: what language models have taken, as the last event says that tells it.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it holds another study, or this one as it was before a scenario or the file was changed.
    """

    def __init__(
        self, loaded: LoadedStudy, folder: Path, arenas: Mapping[int, Arena], simulated: bool
    ) -> None:
        self._loaded, self._simulated = loaded, simulated
        self._file, self._header = folder / FILE, header_of(loaded, arenas)
        self.progress = Progress(loaded)
        self.spent: dict[str, Any] = {}
        known = self.read() if self._file.exists() and self._file.stat().st_size else 0
        self._log = Log(self._file)
        if not known:
            place = study_file(loaded, folder)
            self.do("study", **self._header, file=place, **({"simulated": True} if simulated else {}))
        self.do("server")

    def read(self) -> int:
        """Be where the log says; how many events it has."""
        self.progress, count = Progress(self._loaded), 0

        def take(event: Event) -> None:
            nonlocal count
            if event["event"] == "study":
                self._check(event)
            self.spent = event.get("spent", self.spent)
            self.progress.apply(event)
            count += 1

        follow(self._file, take)
        return count

    def _check(self, event: Event) -> None:
        """See that the log is of this study as it is now. Raises UsageError."""
        own = self._header
        if event["study"] != own["study"]:
            raise UsageError(f"{self._file}: holds the study {event['study']!r}, expected {own['study']!r}")
        if bool(event.get("simulated")) != self._simulated:
            was = "a rehearsal" if event.get("simulated") else "what people have done"
            raise UsageError(f"{self._file}: holds {was}, and simulated participants stay apart from people")
        names = {block_name(self._loaded, number): one.name for number, one in self._loaded.played.items()}
        was = event["programs"]
        changed = {names[block] for block, sha in own["programs"].items() if was.get(block) != sha}
        if changed:
            raise UsageError(
                f"{self._file}: was begun with another version of {', '.join(sorted(changed))}; what people have "
                "played and what they would play must not differ. Take the change back, or begin a new study with --out"
            )
        if event["digest"] != own["digest"]:
            raise UsageError(
                f"{self._file}: was begun with another text of {self._loaded.resolved.path.name} or of its pages. Take "
                "the change back, or begin a new study with --out"
            )

    def do(self, kind: str, **more: Any) -> Event:
        """Let something happen: it is applied at once, and shown once it is stored."""
        event = self._log.add(kind, **more)
        self.progress.apply(event)
        return event

    async def flushed(self) -> None:
        """Wait until everything that has happened is on disk.

        Raises:
            OSError: it cannot be written; whoever waited has to `read` what is there.
        """
        await self._log.flushed()

    def close(self) -> None:
        """Let the log go."""
        self._log.close()
