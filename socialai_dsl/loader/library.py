"""The files one scenario may be made of: found by name, kept inside their folders, read once, counted."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from socialai_dsl.diagnostics import Diagnostic, ScenarioError, did_you_mean
from socialai_dsl.loader.document import Document
from socialai_dsl.loader.files import display_name, is_file, read_source
from socialai_dsl.loader.limits import MAX_FILES, MAX_TOTAL_BYTES
from socialai_dsl.loader.names import SUFFIXES, shipped_folder
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source, Span


class Library:
    """Reads the files of one scenario; none outside `roots` and the shipped folder is ever opened.

    `texts` (resolved path -> text) stand for files that are not on the disk as they are meant.

    Attributes:
        shipped: the folder of the shipped scenarios, resolved.
        sources: name -> source, of all files read and of names that findings may point into.
    """

    def __init__(self, roots: Iterable[Path], texts: Mapping[Path, Source] | None = None) -> None:
        self.shipped = shipped_folder().resolve()
        self._roots = [*(root.resolve() for root in roots), self.shipped]
        self.sources: dict[str, Source] = {}
        self._texts = texts or {}
        self._documents: dict[Path, Document] = {}
        self._bytes = 0

    def error(
        self, code: str, message: str, span: Span, hint: str | None = None, suggestion: str | None = None
    ) -> ScenarioError:
        """The exception for one finding, with the sources read so far."""
        finding = Diagnostic(code, message, span, hint=hint, suggestion=suggestion)
        return ScenarioError([finding], self.sources)

    def resolved(self, path: Path, asked: Span) -> Path:
        """The file itself, links followed, if it may be read.

        Raises:
            ScenarioError: S505 at `asked` if it lies outside the folders.
        """
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):
            raise self.error("S505", f"`{path.name}` cannot be followed to a file", asked) from None
        if not any(real.is_relative_to(root) for root in self._roots):
            inside = display_name(self._roots[0])
            hint = f"files may be taken from {inside}, folders in it, and the shipped scenarios"
            raise self.error("S505", f"`{path.name}` lies outside the scenario's folder", asked, hint=hint)
        return real

    def find(self, text: str, folder: Path, asked: Span) -> Path:
        """The file that a scenario file names: beside it, else among the shipped ones; `.yaml` may be left out.

        Raises:
            ScenarioError: S504 at `asked` if there is none, S505 if it may not be read.
        """
        if not text.strip() or not text.isprintable() or "\\" in text:
            raise self.error(
                "S504", "this is not the name of a file", asked, hint="folders are divided by `/`"
            )
        spellings = [text] if text.endswith(SUFFIXES) else [text + ".yaml", text]
        for place in dict.fromkeys((folder, self.shipped)):
            for spelling in spellings:
                real = self.resolved(place / spelling, asked)
                if real in self._texts or is_file(real):
                    return real
        near = did_you_mean(text, self._names_in((folder / text).parent, text, asked))
        raise self.error(
            "S504", f"there is no file `{text}` in {display_name(folder)}", asked, suggestion=near
        )

    def _names_in(self, folder: Path, text: str, asked: Span) -> list[str]:
        """Names of the scenario files in a folder, written as `text` is."""
        prefix = text[: text.rfind("/") + 1]
        names = yaml_files(self.resolved(folder, asked))
        return [prefix + (name if text.endswith(SUFFIXES) else name.rsplit(".", 1)[0]) for name in names]

    def matching(self, text: str, folder: Path, asked: Span) -> list[Path]:
        """The files that a name with `*` in its last part stands for, sorted by name.

        Raises:
            ScenarioError: S504 at `asked` if there is none, S505 if one may not be read, S507 if there are too many.
        """
        head, _, pattern = text.rpartition("/")
        if "\\" in text or not text.isprintable() or "*" in head:
            raise self.error(
                "S504", "this is not the name of files", asked, hint="`*` may stand in the last part"
            )
        place = self.resolved(folder / head, asked)
        names = [name for name in yaml_files(place) if _fits(name, pattern)]
        if not names:
            raise self.error("S504", f"no file matches `{text}`", asked)
        if len(names) > MAX_FILES:
            raise self.error("S507", f"`{text}` matches more than {MAX_FILES} files", asked)
        return [self.resolved(place / name, asked) for name in names]

    def read(self, path: Path, asked: Span | None = None) -> Document:
        """A file as a document; each is read once.

        Args:
            path: the file, resolved.
            asked: where its name is written; None for the file that was named from outside.

        Raises:
            ScenarioError: what is wrong with the file; S505 and S507 at `asked`.
        """
        if path in self._documents:
            return self._documents[path]
        start = asked or Span(display_name(path), 1, 1)
        if asked is not None:
            self.resolved(path, asked)
        if len(self._documents) == MAX_FILES:
            raise self.error("S507", f"a scenario is made of at most {MAX_FILES} files", start)
        source = self._texts.get(path) or read_source(path, display_name(path))
        self._bytes += len(source.text)
        if self._bytes > MAX_TOTAL_BYTES:
            message = f"the files of a scenario have more than {MAX_TOTAL_BYTES >> 20} MiB together"
            raise self.error("S507", message, start)
        self.sources[source.name] = source
        self._documents[path] = read_document(source, path=path)
        return self._documents[path]


def _fits(name: str, pattern: str) -> bool:
    """Whether a name is the pattern with something in the place of each `*`, in time proportional to both.

    Each piece between two stars is taken where it first stands: a later place would leave less for the rest.
    """
    first, *middle, last = pattern.split("*") if "*" in pattern else (pattern, "")
    if not (name.startswith(first) and name.endswith(last)) or len(name) < len(first) + len(last):
        return False
    at, end = len(first), len(name) - len(last)
    for piece in middle:
        at = name.find(piece, at, end) + len(piece)
        if at < len(piece):
            return False
    return "*" in pattern or name == pattern


def yaml_files(folder: Path) -> list[str]:
    """The names of the YAML files in a folder, sorted; none if it cannot be listed."""
    try:
        return sorted(name for name in os.listdir(folder) if name.endswith(SUFFIXES))
    except OSError:
        return []
