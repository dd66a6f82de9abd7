"""The files that one scenario may be made of: found by name, read once, counted, kept as positioned trees."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, did_you_mean
from socialai_dsl.loader.reader import (
    MAX_FILES,
    MAX_NAME,
    MAX_TOTAL_BYTES,
    display_name,
    is_file,
    read_document,
    read_source,
)
from socialai_dsl.source import Node, Source, Span

SUFFIXES: Final = (".yaml", ".yml")

_VARIANT: Final = re.compile(r"[A-Za-z0-9_-]{1,80}")
_PARAMETER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")


@dataclass(frozen=True)
class Part:
    """A piece of a name and where it stands."""

    text: str
    span: Span


@dataclass(frozen=True)
class ScenarioName:
    """A scenario's name, taken apart.

    Attributes:
        base: a path or the name of a shipped scenario.
        variants: the variants to apply, in order.
        params: parameter -> value as written.
    """

    base: Part
    variants: tuple[Part, ...]
    params: dict[str, Part]


def shipped_folder() -> Path:
    """The folder of the scenarios that come with the product, in a checkout as well as installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "scenarios"
    return installed if installed.is_dir() else package.parent / "scenarios"


def shipped_experiments() -> dict[str, Path]:
    """The files of the experiments that come with the product, by name."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "experiments" / "shipped"
    folder = installed if installed.is_dir() else package.parent / "experiments"
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def looks_like_path(text: str) -> bool:
    """Whether a name is meant as a file rather than as a shipped scenario."""
    return "/" in text or "\\" in text or text.endswith(SUFFIXES)


def name_source(text: str) -> Source:
    """A name from outside any file (a command line, a call) as a source that findings can point into."""
    return Source("scenario name", text)


def parse_name(text: str, start: Span, found: DiagnosticBag, folder: Path | None = None) -> ScenarioName:
    """Take a name apart; what cannot be understood is added to `found` as S508.

    Args:
        text: the name.
        start: where its first character stands.
        found: takes the findings.
        folder: where relative paths start, if a file whose name holds `+` or `?` shall be recognised.
    """
    if not text.strip() or len(text) > MAX_NAME or not text.isprintable():
        found.add(Diagnostic("S508", "a scenario's name is one line of visible characters", start))
        return ScenarioName(Part("", start), (), {})

    question = len(text) if _is_file(text, folder) else _index(text, "?", 0)
    plus = question if _is_file(text[:question], folder) else _plus(text, question)
    variants = _pieces(text, "+", plus + 1, question, start)
    for variant in variants:
        if not _VARIANT.fullmatch(variant.text):
            found.add(Diagnostic("S508", "a variant's name is made of letters, digits and `_`", variant.span))
    params = {}
    for piece in _pieces(text, "&", question + 1, len(text), start):
        key, equals, value = piece.text.partition("=")
        if not equals or not _PARAMETER.fullmatch(key):
            found.add(Diagnostic("S508", f"`{piece.text}` is not of the form parameter=value", piece.span))
        elif key in params:
            found.add(Diagnostic("S508", f"the parameter `{key}` is given twice", piece.span))
        else:
            params[key] = Part(value, piece.span)
    return ScenarioName(_part(text, 0, plus, start), variants, params)


def _is_file(text: str, folder: Path | None) -> bool:
    return folder is not None and is_file(folder / text)


def _index(text: str, character: str, begin: int) -> int:
    found = text.find(character, begin)
    return len(text) if found < 0 else found


def _plus(text: str, question: int) -> int:
    """The first `+` of the last part of the path."""
    return min(question, _index(text, "+", text.rfind("/", 0, question) + 1))


def _pieces(text: str, separator: str, begin: int, end: int, start: Span) -> tuple[Part, ...]:
    """`text[begin:end]` split at the separator; nothing if `begin` lies behind `end`."""
    pieces = []
    while begin <= end:
        stop = min(end, _index(text, separator, begin))
        pieces.append(_part(text, begin, stop, start))
        begin = stop + 1
    return tuple(pieces)


def _part(text: str, begin: int, end: int, start: Span) -> Part:
    return Part(text[begin:end], start.shifted(begin, max(1, end - begin)))


def merge(base: Node, over: Node, key: str = "") -> Node:
    """`base` overlaid with `over`: mappings are merged key by key, all else is replaced.

    Keys of the base keep their place, those that only `over` has follow in its order. Of a grammar, `nouns` and `slots`
    replace each other. Both trees are used up; `key` is where in their files they stand.
    """
    if not isinstance(base.children, dict) or not isinstance(over.children, dict):
        return over
    for former, instead in (("nouns", "slots"), ("slots", "nouns")):
        if key == "grammar" and instead in over.children and former not in over.children:
            base.children.pop(former, None)
    for word, part in over.children.items():
        below = base.children.get(word)
        base.children[word] = part if below is None else merge(below, part, word)
    over.children = base.children
    return over


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
        self._documents: dict[Path, Node] = {}
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

    def read(self, path: Path, asked: Span | None = None) -> Node:
        """A file as a tree of its own, free to be changed; each is read once.

        Args:
            path: the file, resolved.
            asked: where its name is written; None for the file that was named from outside.

        Raises:
            ScenarioError: what is wrong with the file; S505 and S507 at `asked`.
        """
        if path in self._documents:
            return self._documents[path].copy()
        start = asked or Span(display_name(path), 1, 1)
        if asked is not None:
            self.resolved(path, asked)
        if len(self._documents) == MAX_FILES:
            raise self.error("S507", f"a scenario is made of at most {MAX_FILES} files", start)
        source = replace(self._texts.get(path) or read_source(path, display_name(path)), path=path)
        self._bytes += len(source.text)
        if self._bytes > MAX_TOTAL_BYTES:
            message = f"the files of a scenario have more than {MAX_TOTAL_BYTES >> 20} MiB together"
            raise self.error("S507", message, start)
        self.sources[source.name] = source
        self._documents[path] = read_document(source)
        return self._documents[path].copy()


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
