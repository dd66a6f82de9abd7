"""Endings of episodes in words: the line of the scenario's file that decided."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.loader.reader import SUFFIXES, shipped_folder
from socialai_dsl.loader.yaml_errors import comment_in
from socialai_dsl.program_suite import Playable
from socialai_dsl.source import Source

_WITHOUT_A_LINE: Final = {"deadly": "stepped on what is deadly", "timeout": "out of time"}


@dataclass(frozen=True)
class Ending:
    """One way an episode can end.

    Attributes:
        name: the outcome's, as programs call it; of a suite the member's name comes first.
        success: whether it counts as success.
        text: what the file says there, or a phrase for what every scenario has.
        file, line: where that is, `scenarios/...` for what ships; None for what every scenario has.
    """

    name: str
    success: bool
    text: str
    file: str | None = None
    line: int | None = None

    def short(self, width: int) -> str:
        """The text, cut to `width` characters."""
        return self.text if len(self.text) <= width else self.text[: width - 1] + "…"

    @property
    def place(self) -> str:
        """`file:line`, empty if there is none."""
        return f"{self.file}:{self.line}" if self.file is not None else ""

    def figures(self, share: float, episodes: int) -> dict[str, Any]:
        """The ending as a JSON-able object, with the share of the episodes that ended so."""
        return {
            "outcome": self.name,
            "success": self.success,
            "text": self.text,
            "file": self.file,
            "line": self.line,
            "episodes": round(share * episodes),
            "share": share,
        }


def endings_of(loaded: Loaded, program: Playable) -> list[Ending]:
    """The ways that an episode can end, in the order of `program.outcomes`."""
    sources = _sources(loaded)
    folder = loaded.resolved.path.parent
    return [_ending(outcome, sources, folder) for outcome in program.outcome_table]


def _ending(outcome: Any, sources: Mapping[str, Source], folder: Path) -> Ending:
    member, colon, name = outcome.name.rpartition(": ")
    prefix = member + colon
    if outcome.span is None:
        return Ending(outcome.name, outcome.success, prefix + _WITHOUT_A_LINE.get(name, name))
    line = sources[outcome.span.file].line(outcome.span.line).strip().removeprefix("- ").lstrip()
    line = line[: comment_in(line)].rstrip()
    if line.startswith("{") and line.endswith("}"):
        line = line[1:-1].strip()
    file = short_file(outcome.span.file)
    path = Path(outcome.span.file).resolve()
    if path.is_relative_to(folder) and not path.is_relative_to(shipped_folder().resolve()):
        file = path.relative_to(folder).as_posix()  # wherever the scenario's files, or their copies, are
    return Ending(outcome.name, outcome.success, prefix + line, file, outcome.span.line)


def short_file(file: str) -> str:
    """A file's name without folders of this machine: `scenarios/...` for what ships, relative, or the name alone."""
    path, shipped = Path(file).resolve(), shipped_folder().resolve()
    if path.is_relative_to(shipped):
        return f"scenarios/{path.relative_to(shipped).as_posix()}"
    return Path(file).name if Path(file).is_absolute() else file


def short_name(spec: str) -> str:
    """What people call a scenario or an agent: of a file its name, of a folder of this machine the last part."""
    path, mark, parameters = spec.partition("?")
    is_file = Path(path).name.partition("+")[0].endswith(SUFFIXES)
    return (Path(path).name if is_file or Path(path).is_absolute() else path) + mark + parameters


def _sources(loaded: Loaded) -> dict[str, Source]:
    """Every file read, by the name that places in it have."""
    found = dict(loaded.resolved.files)
    if isinstance(loaded, LoadedSuite):
        for member in loaded.members:
            found |= member.resolved.files
    return found
