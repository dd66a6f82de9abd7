"""Findings in authors' files: their form, their catalogue, and their text."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final, TypedDict, Unpack

from socialai_dsl.cures import Cure, Hint
from socialai_dsl.source import Source, Span, TextEdit
from socialai_dsl.vocabulary import composed

CODES: Final[dict[str, str]] = {
    # S0xx: the file as text and as YAML
    "S001": "not YAML",
    "S002": "a key given twice",
    "S003": "a plain word that YAML tools read differently",
    "S004": "larger or deeper than the language allows",
    "S005": "anchors, aliases, merge keys, tags and directives are not part of the language",
    "S006": "encoding or control character",
    "S007": "a file that cannot be read",
    "W008": "a comment that ignores nothing",
    "W009": "a text that a comment cuts short",
    # S1xx: the shape of the document
    "S101": "unknown key",
    "S102": "a comma inside { } ends the value",
    "S103": "not a word of the language",
    "S104": "wrong type of value",
    "S105": "missing key",
    "S106": "value out of range",
    "S107": "keys that exclude each other",
    "S108": "unknown kind of file",
    # S2xx: expressions and names
    "S201": "unknown name",
    "S202": "a bracket is not closed",
    "S203": "an operator the language writes differently",
    "S204": "a value of the wrong type",
    "S205": "unknown verb or activity",
    "S206": "unknown parameter",
    "S207": "comparisons do not chain",
    "S208": "definitions in a circle",
    "S209": "uses of one name that disagree about its type",
    "S210": "not an expression",
    "S211": "wrong number or kind of arguments",
    "S212": "an expression that is too long or too deep",
    "S213": "a name that is already taken",
    "S214": "a number too large to compute",
    # S3xx: frames, states, objects
    "S301": "unknown state",
    "S302": "a slot that is not filled",
    "S303": "unknown slot",
    "S304": "a step that never ends",
    "S305": "unknown register",
    "W306": "a state that is never entered",
    "S307": "a body action where the body has already moved",
    "S308": "a frame has either steps or states",
    "S309": "unknown object type",
    "S310": "a state the character does not have",
    "W311": "a rule that never fires",
    "S312": "states that go round within one step",
    "S313": "two frames that move one body",
    "W314": "something that can never hold",
    "S315": "files of `one_of` that differ where they must not",
    "S316": "no success or no room is possible",
    "W317": "a definition or frame that nothing uses",
    "S318": "a register that nothing sets",
    "W319": "a condition that always holds",
    "S320": "an action that the agent does not have",
    "W321": "a gesture or look that is not in the picture",
    # S4xx: what can be said
    "S401": "an utterance that nobody can say",
    "S402": "a value that cannot be said",
    "W403": "a right answer that is not among those of the probe",
    "W404": "a probe with a single answer",
    "S405": "a text that is not one line, or a name that reads as something else",
    "W406": "texts that look alike and are not",
    "W407": "a text that reads like a value",
    # S5xx: variants, parameters and files that belong together
    "S501": "no such path in the scenario",
    "S502": "an added key that exists already",
    "S503": "unknown variant",
    "S504": "unknown scenario",
    "S505": "a file outside the scenario's folder",
    "S506": "files that include each other in a circle",
    "S507": "too many or too large included files",
    "S508": "not a scenario name",
    "W509": "a variant that changes nothing",
    # S6xx: the room
    "S601": "a placement without a free cell",
    "S602": "a place outside of the room",
    "W603": "somebody or something that is absent in some rooms",
    # S7xx: experiments
    "S701": "settings for a condition that does not exist",
    "S702": "a seed given twice",
    "S703": "an agent that cannot be found",
    "S704": "a script that the scenario does not have",
    # S8xx: what trying it out shows
    "S801": "a claim that does not hold",
    "W802": "something that never happens, or is not decided",
    "S803": "a test that fails",
    "S804": "a step of a test after the end of the episode",
    # S9xx: studies with people
    "S901": "more episodes than rooms",
    "S902": "a design that cannot be balanced",
    "S903": "a page or picture that is missing",
    "S904": "a block without a person",
    "W905": "groups that cannot be filled alike",
}
"""Code -> one-line title, for every finding the product can make."""


class Severity(StrEnum):
    """How bad a finding is: errors keep a scenario from running, warnings do not."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Diagnostic:
    """One finding in an author's file.

    Attributes:
        code: key of `CODES`.
        message: what is wrong, one sentence without final full stop, names in backquotes.
        span: where.
        severity: error or warning.
        hint: what to do about it, shown on a line of its own; None where the message says it.
        suggestion: the word that was probably meant in the place of `span`, shown as "did you mean `x`?".
        suggestion_place: where that word is, e.g. "let, line 18" or "talkitout.yaml:43".
        notes: lines that say more, such as why it is so.
    """

    code: str
    message: str
    span: Span
    severity: Severity = Severity.ERROR
    hint: Hint = None
    suggestion: str | None = None
    suggestion_place: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The message with its suggestion, on one line, safe to print."""
        if self.suggestion is None:
            return printable(self.message)
        place = f" ({self.suggestion_place})" if self.suggestion_place else ""
        quoted = self.suggestion if self.suggestion.startswith('"') else f"`{self.suggestion}`"
        return printable(f"{self.message}; did you mean {quoted}{place}?")

    @property
    def help(self) -> str | None:
        """The hint on one line, safe to print."""
        return printable(str(self.hint)) if self.hint else None

    @property
    def edits(self) -> tuple[TextEdit, ...]:
        """The changes of files after which it is gone; none where only advice can be given."""
        if isinstance(self.hint, Cure):
            return self.hint.edits
        return (TextEdit(self.span, self.suggestion),) if self.suggestion is not None else ()

    @property
    def cure(self) -> str:
        """What its `edits` do, in words."""
        title = self.hint.title if isinstance(self.hint, Cure) else ""
        return title or f"write `{self.suggestion}`"

    def __str__(self) -> str:
        """`file:line:col: CODE message; did you mean ...?`, safe to print."""
        return f"{printable(str(self.span))}: {self.code} {self.text}"


class Advice(TypedDict, total=False):
    """What a finding says beside its message: attributes of the `Diagnostic`."""

    hint: Hint
    suggestion: str | None
    suggestion_place: str | None


class ScenarioError(Exception):
    """A scenario that cannot be used, with all findings.

    Attributes:
        diagnostics: the findings, sorted by place; at least one is an error.
        sources: name -> source, for all files the findings point into that could be read.
    """

    def __init__(
        self, diagnostics: Iterable[Diagnostic], sources: Mapping[str, Source] | None = None
    ) -> None:
        self.diagnostics: tuple[Diagnostic, ...] = tuple(diagnostics)
        self.sources: dict[str, Source] = dict(sources or {})
        super().__init__(self.diagnostics, self.sources)

    def __str__(self) -> str:
        """The findings as text, as a terminal would show them."""
        return render_text(self.diagnostics, self.sources)


class DiagnosticBag:
    """Collects findings; iterating gives them sorted by place and without repetitions."""

    def __init__(self, diagnostics: Iterable[Diagnostic] = ()) -> None:
        # A dict as an ordered set: findings at one place keep the order in which they were made.
        self._found: dict[Diagnostic, None] = dict.fromkeys(diagnostics)

    def add(self, diagnostic: Diagnostic) -> None:
        """Add one finding."""
        self._found[diagnostic] = None

    def extend(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Add several findings."""
        self._found.update(dict.fromkeys(diagnostics))

    def drop(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Leave out several findings."""
        for diagnostic in diagnostics:
            self._found.pop(diagnostic, None)

    def error(self, code: str, message: str, span: Span, **advice: Unpack[Advice]) -> None:
        """Add an error."""
        self.add(Diagnostic(code, message, span, Severity.ERROR, **advice))

    def warning(self, code: str, message: str, span: Span, **advice: Unpack[Advice]) -> None:
        """Add a warning."""
        self.add(Diagnostic(code, message, span, Severity.WARNING, **advice))

    @property
    def has_errors(self) -> bool:
        """Whether at least one finding is an error."""
        return any(d.severity is Severity.ERROR for d in self._found)

    def raise_errors(self, sources: Mapping[str, Source] | None = None) -> None:
        """Raise ScenarioError with all findings if one of them is an error."""
        if self.has_errors:
            raise ScenarioError(self, sources)

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(sorted(self._found, key=lambda d: (d.span.file, d.span.line, d.span.column)))

    def __len__(self) -> int:
        return len(self._found)


def did_you_mean(word: str, candidates: Iterable[str]) -> str | None:
    """The candidate that `word` is most likely a slip for, or None if none is near.

    It never looks like `word` itself.
    Case, and `-` or a space for `_`, do not count. Up to a quarter of the letters may differ (an exchange of
    neighbours is one difference); a candidate that `word` begins, or that begins `word`, is near as well.
    Inside of `bounded_suggestions` only as many candidates are looked at as its effort allows.
    """
    if not 2 <= len(word) <= _LONGEST_SUGGESTION:
        return None
    folded, shown = _fold(word), composed(word)
    effort = _effort.get()
    best: tuple[int, int, str] | None = None
    for candidate in candidates:
        if len(candidate) > _LONGEST_SUGGESTION or composed(candidate) == shown:
            continue
        if effort is not None:
            if effort.left <= 0:
                break
            effort.left -= _EFFORT_OF_A_LOOK + len(word) * len(candidate)
        distance = _nearness(folded, _fold(candidate))
        if distance is None:
            continue
        rank = (distance, abs(len(candidate) - len(word)), candidate)
        if best is None or rank < best:
            best = rank
    return best[2] if best else None


def suggested(
    word: str, candidates: Iterable[str], otherwise: str = "", quoted: Callable[[str], str] = str
) -> str:
    """`; did you mean x?`, to be put behind a message; what is said `otherwise` where no candidate is near."""
    near = did_you_mean(word, candidates)
    return otherwise if near is None else f"; did you mean {quoted(near)}?"


def advice_on(word: str, known: Iterable[str], otherwise: str) -> Advice:
    """What the finding about an unknown word adds: the one that it is most likely a slip for, else a hint."""
    near = did_you_mean(word, known)
    return {"suggestion": near, "hint": None if near else otherwise}


@contextmanager
def bounded_suggestions(effort: int = 1_500_000) -> Iterator[None]:
    """Look for suggestions with a fixed effort only, however many words are misspelt and names are known.

    Args:
        effort: how many pairs of letters are compared.
    """
    token = _effort.set(_Effort(effort))
    try:
        yield
    finally:
        _effort.reset(token)


@dataclass
class _Effort:
    """How many pairs of letters may still be compared."""

    left: int


_effort: ContextVar[_Effort | None] = ContextVar("effort", default=None)

_EFFORT_OF_A_LOOK: Final = 8
_LONGEST_SUGGESTION: Final = 80


def _fold(word: str) -> str:
    return word.casefold().replace("-", "_").replace(" ", "_")


def _nearness(word: str, candidate: str) -> int | None:
    """Edit distance, or None if it is above the cut-off."""
    longer, shorter = max(len(word), len(candidate)), min(len(word), len(candidate))
    cut_off = (longer + 2) // 4
    distance = _edit_distance(word, candidate, cut_off) if longer - shorter <= cut_off else cut_off + 1
    if distance <= cut_off:
        return distance
    begins = candidate.startswith(word) or word.startswith(candidate)
    # Behind every slip of the keyboard, but still better than nothing.
    return longer if begins and shorter >= 3 and longer <= 3 * shorter else None


def _edit_distance(a: str, b: str, cut_off: int) -> int:
    """Insertions, deletions, replacements and exchanges of neighbours; at most `cut_off + 1`."""
    before_last: list[int] = []
    last = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        row = [i]
        for j, y in enumerate(b, 1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and y == a[i - 2]:
                cost = min(cost, before_last[j - 2] + 1)
            row.append(cost)
        if min(row) > cut_off and min(last) > cut_off:
            return cut_off + 1
        before_last, last = last, row
    return min(last[-1], cut_off + 1)


def printable(text: str) -> str:
    r"""`text` on one line with everything a terminal could act on escaped.

    Control characters (C0, C1, line breaks, tabs), bidirectional and invisible formatting characters,
    surrogates and unusual spaces become `\n`, `\x1b`, `\u202e` and so on. All text that reaches a terminal
    passes here.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escaped(c) for c in text)


def _escaped(character: str) -> str:
    short = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}.get(character)
    if short:
        return short
    number = ord(character)
    if number < 0x100:
        return f"\\x{number:02x}"
    return f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"


_COLORS: Final = {Severity.ERROR: "\x1b[1;31m", Severity.WARNING: "\x1b[1;33m"}
_BOLD, _CYAN, _RESET = "\x1b[1m", "\x1b[36m", "\x1b[0m"


def render_text(
    diagnostics: Iterable[Diagnostic], sources: Mapping[str, Source] | None = None, color: bool = False
) -> str:
    """The findings for a terminal, one block each: the finding, the source line, a caret, notes, the help line.

    Args:
        diagnostics: shown in the order given.
        sources: name -> source; findings in other files are shown without their line.
        color: whether to colour with ANSI sequences (nothing else in the result is a control character but
            the line breaks).
    """
    return "\n".join(_render_one(d, (sources or {}).get(d.span.file), color) for d in diagnostics)


def _render_one(diagnostic: Diagnostic, source: Source | None, color: bool) -> str:
    paint = _COLORS[diagnostic.severity] if color else ""
    bold, cyan, reset = (_BOLD, _CYAN, _RESET) if color else ("", "", "")
    place = printable(str(diagnostic.span))
    lines = [f"{bold}{place}:{reset} {paint}{diagnostic.code}{reset} {bold}{diagnostic.text}{reset}"]
    if source is not None:
        lines += _snippet(diagnostic.span, source, paint, reset)
    lines += [f"  {printable(note)}" for note in diagnostic.notes]
    if diagnostic.help:
        lines.append(f"  {cyan}help:{reset} {diagnostic.help}")
    return "\n".join(lines)


_SHOWN_BEFORE, _SHOWN = 80, 120


def _snippet(span: Span, source: Source, paint: str, reset: str) -> Sequence[str]:
    line = source.line(span.line)
    if not line.strip():
        return []
    start = max(0, span.column - 1 - _SHOWN_BEFORE)
    end = min(len(line), start + _SHOWN)
    cut, before = "…" if start else "", _flat(line[start : span.column - 1])
    marked = _flat(line[span.column - 1 : min(end, span.column - 1 + span.width)])
    shown = cut + _flat(line[start:end]) + ("…" if end < len(line) else "")
    caret = "^" + "~" * (_cells(marked) - 1)
    gutter = f"{span.line:>4} | "
    return [gutter + shown, " " * (len(gutter) + len(cut) + _cells(before)) + paint + caret + reset]


def _flat(line: str) -> str:
    return printable(line.replace("\t", "    "))


def _cells(text: str) -> int:
    """How many terminal cells a printable text takes."""
    if text.isascii():
        return len(text)
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )


def counted(number: int, noun: str) -> str:
    """`1 file`, `2 files`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def is_usage(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether all that is wrong lies in how a scenario was named, or in a file that cannot be read (S007).

    Such findings point into the name itself, which is no file.
    """
    return all(d.code == "S007" or not Path(d.span.file).is_file() for d in diagnostics)


def to_json(
    diagnostics: Iterable[Diagnostic], sources: Mapping[str, Source] | None = None
) -> list[dict[str, Any]]:
    """The findings as JSON-able objects: file, line, column, severity, code, message, hint, and with `sources` edits.

    `edits` are the changes that cure it: what stands from `line` and `column` to before `end_line` and `end_column` of
    `file` becomes `text`.

    Args:
        diagnostics: the findings.
        sources: name -> source of the files that the changes are made in.
    """
    return [
        {
            "file": d.span.file,
            "line": d.span.line,
            "column": d.span.column,
            "severity": d.severity.value,
            "code": d.code,
            "message": d.text,
            "hint": d.help,
        }
        | ({} if sources is None else {"edits": [_edit_to_json(edit, sources) for edit in d.edits]})
        for d in diagnostics
    ]


def _edit_to_json(edit: TextEdit, sources: Mapping[str, Source]) -> dict[str, Any]:
    start, end = sources[edit.span.file].ends(edit)
    return {
        "file": start.file,
        "line": start.line,
        "column": start.column,
        "end_line": end.line,
        "end_column": end.column,
        "text": edit.text,
    }
