"""Data to models, with pydantic's errors in words for authors, at the place in the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, Generic, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from socialai_dsl import cures
from socialai_dsl.diagnostics import DiagnosticBag, advice_on, did_you_mean
from socialai_dsl.schema.annotations import (
    CALLED,
    annotation_at,
    expectation,
    held_at,
    home_of,
    keys_of,
    literals,
    may_hide,
    model_at,
)
from socialai_dsl.schema.holds import branches
from socialai_dsl.schema.scenario import (
    LANGUAGE_TAG,
    NOT_BLANK,
    FirstRule,
    Register,
    Scenario,
    State,
    Step,
    ThenRule,
    WorldRule,
)
from socialai_dsl.source import Data, DataPath, Node, Span, TextEdit

_KEYS = {key for model in (FirstRule, ThenRule, Step, WorldRule) for key in keys_of(model)}
"""Keys of rules, which are mostly written inside { }."""


@dataclass
class Repair:
    """A document that is changed into what was probably meant; its parts still know where they are written.

    Attributes:
        tree: the document.
        lost: paths of parts that were left out although they may have meant something.
    """

    tree: Node
    lost: list[DataPath] = field(default_factory=list)

    def rename(self, path: DataPath, key: str) -> bool:
        """Read the entry at `path` under another key; whether that key was free."""
        siblings = self._siblings(path)
        if siblings is None or (key in siblings and not siblings[key].left_out):
            return False
        entries = [(key if k == path[-1] else k, part) for k, part in siblings.items() if k != key]
        siblings.clear()
        siblings.update(entries)
        return True

    def leave_out(self, path: DataPath) -> None:
        """Go on without the entry at `path`; an item of a list stays, since the others are known by their number."""
        siblings = self._siblings(path)
        if siblings is not None:
            siblings[str(path[-1])].left_out = True
        self.lost.append(path)

    def _siblings(self, path: DataPath) -> dict[str, Node] | None:
        """The mapping that holds the entry at `path`; None if there is no such entry, or not any more."""
        around = [self.tree.get(path[:length]) for length in range(len(path) + 1)]
        if any(part is None or part.left_out for part in around):
            return None
        siblings = self.tree.at(path[:-1]).children
        return siblings if isinstance(siblings, dict) else None


def fill_gaps(repaired: Repair, bag: DiagnosticBag, path: DataPath = ()) -> None:
    """Report every key and list item without a value, and what a comma inside { } has cut off."""
    part = repaired.tree.at(path)
    if isinstance(part.children, dict):
        _join_cut_values(repaired, part.children, path, bag)
    for key, child in list(part.items()):
        if child.is_empty and isinstance(part.children, list):
            _report_nothing(key, child, bag)
            child.value = ""
        fill_gaps(repaired, bag, (*path, key))


def _join_cut_values(repaired: Repair, entries: dict[str, Node], path: DataPath, bag: DiagnosticBag) -> None:
    before: str | None = None
    cut: dict[str, list[tuple[str, Node]]] = {}
    for key, part in list(entries.items()):
        if not part.is_empty:
            before = key
            continue
        head = entries[before].value if before is not None else None
        if before is not None and isinstance(head, str) and _looks_cut(key, part, head, path):
            cut.setdefault(before, []).append((key, part))
            del entries[key]
        else:
            _report_nothing(key, part, bag)
            repaired.leave_out((*path, key))
    for key, pieces in cut.items():
        head = entries[key].value
        whole = ", ".join([str(head), *(piece for piece, _ in pieces)])
        entries[key].value = whole
        first, part = pieces[0]
        hint = _joined(key, whole, entries[key], pieces[-1][1])
        word, space, rest = first.partition(" ")
        if space and word in _KEYS and part.span.key is not None:
            colon = f"{word}: {rest}"
            hint = cures.write(colon, TextEdit(part.span.key, colon), "a colon is missing")
        message = f"unknown key `{first}`: inside {{ }} a comma ends the value, so `{key}` is only `{head}`"
        bag.error("S102", message, part.key_span(), hint=hint)


def _joined(key: str, whole: str, head: Node, last: Node) -> cures.Cure | str:
    """The proposal to quote a value together with what a comma has cut off it."""
    text = cures.in_quotes(whole)
    source, behind = head.source, last.span.key
    edit = None
    if behind is not None:
        edit = source.edit(head.span.start, source.index(behind) + behind.width, text)
    return cures.write(f"{key}: {text}", edit, "or put every key on a line of its own")


def _looks_cut(key: str, part: Node, before: str, path: DataPath) -> bool:
    """Whether a key without a value is the rest of the value before it."""
    if not part.span.flow:
        return False
    in_text = path[-1:] == ("with",) or (isinstance(path[-1], int) and key not in _KEYS) if path else False
    return in_text or not key.isidentifier() or before.count("(") > before.count(")")


def _report_nothing(key: str | int, part: Node, bag: DiagnosticBag) -> None:
    what = "an item of this list is empty" if isinstance(key, int) else f"nothing is given for `{key}`"
    bag.error("S104", what, part.key_span(), hint="write a value, or leave the key out")


# -- keys that stand one level too far left or right ---------------------------------------------------------


_MEANT: Final = {
    "if": "when", "condition": "when", "while": "until", "wait": "for", "duration": "for", "act": "do", "action": "do",
    "activity": "do", "next": "goto", "effect": "cause", "says": "say", "hear": "hears", "probability": "chance",
    "position": "at", "location": "place", "where": "place",
}  # fmt: skip
"""What authors write for a key -> what it is called here."""

_EXTENDS = "extends"
"""A key that is gone when the models see a file."""

_OF_VARIANTS: Final = ("remove", "set", "add")
"""Keys of variants, which authors write in a scenario that builds on another."""


class _Mender:
    """Moves keys that are indented one level too little or too much; reports S101 once for keys that follow each other.

    Args:
        model: what the document should be.
        tree: the document; changed.
        bag: takes the findings.
    """

    def __init__(self, model: type[BaseModel], tree: Node, bag: DiagnosticBag) -> None:
        self._model = model
        self._tree = tree
        self._bag = bag
        self._quiet = False

    def mend(self, path: DataPath) -> None:
        """Mend what stands at and below a path, the outermost first."""
        part = self._tree.at(path)
        if isinstance(part.children, list):
            for i in range(len(part.children)):
                self.mend((*path, i))
        if not isinstance(part.children, dict) or next(iter(part.children.values()), part).span.flow:
            return
        self._indent(path, part.children)
        self._dedent(path, part.children)
        for key in list(part.children):
            if key in part.children:
                self.mend((*path, key))

    def _indent(self, path: DataPath, entries: dict[str, Node]) -> None:
        """Move keys that belong into the entry above them."""
        above: str | None = None
        moving = False
        for key, part in list(entries.items()):
            emptied = above is not None and entries[above].is_empty and key in self._words_of((*path, above))
            if self._fits(path, key, part) and not emptied:
                above, moving = key, False
            elif above is not None and self._takes((*path, above), entries[above], key, part):
                if not moving:
                    message = f"`{key}` belongs to `{above}`, but is not indented further than it"
                    self._report(part, message, "indent it one level further")
                moving = True
                entries[above].children = entries[above].children or {}
                self._move((*path, key), (*path, above))

    def _dedent(self, path: DataPath, entries: dict[str, Node]) -> None:
        """Move keys that belong beside the entry that they stand in, or further out."""
        known = model_at(self._model, path)
        moving = False
        for key, part in list(entries.items()):
            home = None if self._fits(path, key, part) else self._home(path, known, key, part)
            if home is None:
                moving = False
                continue
            if not moving:
                owner = model_at(self._model, home)
                where = CALLED[owner] if owner in CALLED else f"`{home[-1]}`"
                inside = f"`{path[-1]}`" if isinstance(path[-1], str) else "an item of a list"
                message = f"`{key}` stands in {inside}, but belongs to {where}"
                self._report(part, message, "indent it less")
            moving = True
            self._move((*path, key), home)

    def _move(self, path: DataPath, to: DataPath) -> None:
        """Move an entry into another mapping; what stands wrong in it does so for the same reason."""
        key, before, after = str(path[-1]), self._tree.at(path[:-1]).children, self._tree.at(to).children
        assert isinstance(before, dict), "internal: what is moved is an entry"
        assert isinstance(after, dict), "internal: entries are moved into mappings"
        after[key] = before.pop(key)
        quiet, self._quiet = self._quiet, True
        self.mend((*to, key))
        self._quiet = quiet

    def _home(self, path: DataPath, known: type[BaseModel] | None, key: str, part: Node) -> DataPath | None:
        """The mapping further out that lacks a key which does not fit at `path`."""
        for length in range(len(path) - 1, -1, -1):
            outer = path[:length]
            around = self._tree.at(outer).children
            if not isinstance(around, dict) or key in around:
                continue
            owner = model_at(self._model, outer)
            if owner is not None and key in keys_of(owner):
                return outer
            elements = _elements(annotation_at(self._model, outer))
            if owner is None and known in elements and (part.children == {} or _looks_like(part, elements)):
                return outer
        return None

    def _fits(self, path: DataPath, key: str, part: Node) -> bool:
        """Whether a key may stand where it stands, also if it is misspelt."""
        known = model_at(self._model, path)
        if known is not None:
            keys = [*keys_of(known), *([_EXTENDS] if not path else [])]
            return key in keys or did_you_mean(key, keys) is not None
        annotation = annotation_at(self._model, path)
        elements = _elements(annotation)
        held = _held(annotation)
        if part.children == {} or _looks_like(part, elements) or any(get_origin(one) is dict for one in held):
            return True
        if part.children is None and len(elements) < len(held):
            return True  # an expression, say
        return not held or not self._is_word_of(path, elements, key)

    def _is_word_of(self, path: DataPath, elements: list[type[BaseModel]], key: str) -> bool:
        """Whether a key is a word of what is in a mapping of names, or of what is around it."""
        owners = [*elements, *(model_at(self._model, path[:length]) for length in range(len(path)))]
        return any(owner is not None and key in keys_of(owner) for owner in owners)

    def _words_of(self, path: DataPath) -> list[str]:
        """The keys of the model at a path, if there is one."""
        owner = model_at(self._model, path)
        return keys_of(owner) if owner is not None else []

    def _takes(self, path: DataPath, above: Node, key: str, part: Node) -> bool:
        """Whether the entry above, at a path, can have the key."""
        if not above.is_empty and (
            not isinstance(above.children, dict) or key in above.children or _is_closed(above.children)
        ):
            return False
        owner = model_at(self._model, path)
        if owner is not None:
            return key in keys_of(owner)
        annotation = annotation_at(self._model, path)
        return _looks_like(part, _elements(annotation)) or (above.is_empty and bool(_held(annotation)))

    def _report(self, part: Node, message: str, hint: str) -> None:
        if not self._quiet:
            self._bag.error("S101", message, part.key_span(), hint=hint)


def _is_closed(entries: dict[str, Node]) -> bool:
    """Whether a mapping is written in braces, so that nothing on other lines can belong to it."""
    return not entries or next(iter(entries.values())).span.flow


def _held(annotation: Any) -> list[Any]:
    """What an entry of a mapping of names can be; nothing for anything else."""
    names = (get_args(part)[1] for part in branches(annotation) if get_origin(part) is dict)
    return [held for entry in names for held in branches(entry)]


def _elements(annotation: Any) -> list[type[BaseModel]]:
    """The models that an entry of a mapping of names can be."""
    return [held for held in _held(annotation) if isinstance(held, type) and issubclass(held, BaseModel)]


def _looks_like(part: Node, models: list[type[BaseModel]]) -> bool:
    """Whether a mapping has keys of one of some models, also if they are misspelt."""
    keys = part.children if isinstance(part.children, dict) else ()
    known = [keys_of(model) for model in models]
    return any(key in own or did_you_mean(key, own) is not None for own in known for key in keys)


# -- models --------------------------------------------------------------------------------------------------


M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class ShapedFile(Generic[M]):
    """A document as models.

    Attributes:
        model: None if not even the rest of the file can be used.
        tree: the document the model was made from, with mistakes of shape repaired.
        lost: what was left out that other parts of the file may name.
    """

    model: M | None
    tree: Node
    lost: tuple[DataPath, ...] = ()


def model_of(
    model: type[M],
    tree: Node,
    bag: DiagnosticBag,
    *,
    partial: bool = False,
    parameters: bool = True,
) -> ShapedFile[M]:
    """The model of a document; `bag` says what is wrong with its shape.

    After mistakes that leave no doubt the model is made of what was meant, so that the rest can be checked.

    Args:
        model: what it should be.
        tree: the document.
        bag: takes the findings.
        partial: missing keys are fine, as in a base that others build on; the model is then None.
        parameters: `$name` that is left may stand for anything: that there is no such parameter has been said, or a
            scenario will give it.
    """
    repaired = Repair(tree.copy())
    known = len(bag)
    made = _tried(model, repaired.tree.data)
    if made is None:
        _Mender(model, repaired.tree, bag).mend(())
    fill_gaps(repaired, bag)
    if made is not None and len(bag) == known:
        return ShapedFile(made, repaired.tree)
    try:
        made = _made(model, repaired.tree.data)
    except ValidationError as error:
        _Report(model, repaired, bag, partial, parameters).add_all(error)
        data = repaired.tree.data
        made = _tried(model, data)
        if made is None and model is Scenario and not partial and isinstance(data, dict):
            missing = [key for key in _STAND_INS if key not in data]
            repaired.lost += [(key,) for key in missing]
            made = _tried(model, data | {key: _STAND_INS[key] for key in missing})
    lost = tuple(path for path in repaired.lost if may_hide(model, path))
    return ShapedFile(made, repaired.tree, lost)


def _made(model: type[M], data: object) -> M:
    """The model of data; a field that has an alias (`for`, `with`) is known by that alone."""
    return model.model_validate(data, by_alias=True, by_name=False)


def _tried(model: type[M], data: object) -> M | None:
    """The model of data; None if the data has mistakes."""
    with suppress(ValidationError):
        return _made(model, data)
    return None


_STAND_INS: Final[dict[str, Data]] = {
    "scenario": "unnamed",
    "grammar": {"templates": ["Hello"], "nouns": ["you"]},
    "room": {"size": 30},
    "cast": {"agent": {}},
    "outcome": [{"success": "t == 1"}],
}
"""What stands for the parts that every scenario needs where a file lacks them, so that its other mistakes are found."""

PARAMETER: Final = re.compile(r"\$[A-Za-z_]\w*")
"""A parameter that is a whole value; known ones of scenarios have been put in before."""


@dataclass(frozen=True)
class _Finding:
    """One of pydantic's errors with its place in the data."""

    path: DataPath
    kind: str
    value: object
    context: Mapping[str, Any]
    about_key: bool

    @property
    def key(self) -> str:
        """The key whose value it is, or in whose value; empty where there is none."""
        return next((str(part) for part in reversed(self.path) if isinstance(part, str)), "")


class _Report:
    """Words one validation's errors."""

    def __init__(
        self,
        model: type[BaseModel],
        repaired: Repair,
        bag: DiagnosticBag,
        partial: bool,
        parameters: bool,
    ) -> None:
        self._model = model
        self._repaired = repaired
        self._places = repaired.tree.copy()
        self._data = self._places.data
        self._bag = bag
        self._partial = partial
        self._parameters = parameters
        self._extra: dict[DataPath, list[str]] = {}

    def add_all(self, error: ValidationError) -> None:
        """Report everything, one finding for each place."""
        found = [self._placed(e) for e in error.errors(include_url=False)]
        by_path: dict[tuple[DataPath, bool], list[_Finding]] = {}
        for finding in found:
            by_path.setdefault((finding.path, finding.about_key), []).append(finding)
            if finding.kind == "extra_forbidden":
                self._extra.setdefault(finding.path[:-1], []).append(str(finding.path[-1]))
        deeper = {finding.path[:i] for finding in found for i in range(len(finding.path))}
        for (path, about_key), findings in by_path.items():
            if path in deeper and isinstance(findings[0].value, dict) and not about_key:
                continue  # a mapping was meant, and the findings in it say what is wrong with it
            if path in deeper and all(_counts_only_right_items(finding) for finding in findings):
                continue
            self._add(findings)

    def _placed(self, error: Any) -> _Finding:
        """The error at a path that exists: names of union branches are no part of the file."""
        path: list[str | int] = []
        part: Any = self._data
        location = list(error["loc"])
        about_key = location[-1:] == ["[key]"]
        if about_key:
            location.pop()
        missing = location.pop() if error["type"] == "missing" else None
        for step in location:
            if _has(part, step):
                part = part[step]
                path.append(step)
        if missing is not None:
            path.append(missing)
        return _Finding(tuple(path), error["type"], part, error.get("ctx", {}), about_key)

    def _add(self, findings: list[_Finding]) -> None:
        first = findings[0]
        if first.kind == "extra_forbidden":
            self._unknown_key(first)
        elif first.kind == "missing":
            self._missing_key(first)
        elif first.about_key:
            self._bad_name(first)
        else:
            self._wrong_value(findings)
            self._repaired.leave_out(first.path)

    # -- keys ------------------------------------------------------------------------------------------------

    def _unknown_key(self, finding: _Finding) -> None:
        key = str(finding.path[-1])
        span = self._places.key_span(finding.path)
        owner = model_at(self._model, finding.path[:-1])
        known = keys_of(owner) if owner is not None else []
        if len(finding.path) == 1 and "variant" not in known:
            known = [*known, _EXTENDS]
        called = CALLED.get(owner, "this mapping") if owner is not None else "this mapping"
        if owner is ThenRule and key == "do":
            message = "the body has already moved when `then` is read: put `do` in the state or in `first`"
            self._bag.error("S307", message, span)
            near = None
        else:
            meant = _MEANT.get(key)
            near = meant if meant in known else did_you_mean(key, known)
            near = None if owner is Scenario and key in _OF_VARIANTS else near
            if near is None and owner is Register:
                near = self._left_over(finding.path[:-1], key, known)
            bound = near == "range" and owner is Register and ".." not in str(finding.value)
            if bound and type(finding.value) is int:  # `max: 9` is not a range under another name
                self._bound(key, called, finding.path, finding.value)
            else:
                self._unknown_word(key, owner, called, known, near, span)
            near = None if bound else near
        if near is None or near == _EXTENDS or not self._repaired.rename(finding.path, near):
            self._repaired.leave_out(finding.path)

    def _left_over(self, parent: DataPath, key: str, known: list[str]) -> str | None:
        """Where a mapping needs all its keys, an unknown one stands for one that is missing."""
        given = self._places.at(parent).data
        assert isinstance(given, dict), "internal: only a mapping misses a key"
        extra = [word for word in self._extra[parent] if did_you_mean(word, known) is None]
        missing = [word for word in known if word not in given]
        return dict(zip(extra, missing, strict=False)).get(key)

    def _bound(self, key: str, called: str, path: DataPath, value: int) -> None:
        """Report the least or greatest number of a register under a key of its own."""
        part, text = self._places.at(path), f"range: {min(0, value)}..{max(0, value)}"
        assert part.span.key is not None, "internal: an unknown key is a key"
        edit = part.source.edit(part.source.index(part.span.key), part.end, text)
        hint = cures.write(text, edit, "from the least to the greatest number")
        self._bag.error("S101", f"unknown key `{key}` in {called}", part.span.key, hint=hint)

    def _unknown_word(
        self, key: str, owner: type | None, called: str, known: list[str], near: str | None, span: Span
    ) -> None:
        elsewhere = None if near else home_of(key, owner)
        listed = ", ".join(f"`{word}`" for word in known)
        if owner is State and near is None:
            hint = f"`{key}` belongs to {elsewhere}" if elsewhere else None
            message = f"`{key}` is not a word of the language; a state has {listed}"
            if elsewhere:
                message = f"a state has no `{key}`; it has {listed}"
            self._bag.error("S103", message, span, hint=hint)
            return
        hint = None if near else f"`{key}` belongs to {elsewhere}" if elsewhere else f"its keys are {listed}"
        if owner is Scenario and key in _OF_VARIANTS:
            hint = f"write what differs from the extended file as keys of its own; `{key}` is for variants (`of:`)"
        self._bag.error("S101", f"unknown key `{key}` in {called}", span, suggestion=near, hint=hint)

    def _missing_key(self, finding: _Finding) -> None:
        key, parent = str(finding.path[-1]), finding.path[:-1]
        extra = self._extra.get(parent, ())
        if self._partial or any(did_you_mean(word, [key]) for word in extra):
            return
        if finding.path in self._repaired.lost:
            return  # it is there without a value, which has been reported
        if any(did_you_mean(word, [_EXTENDS]) for word in self._extra.get((), ())):
            return  # the file it builds on may have it
        owner = model_at(self._model, parent)
        if owner is Register and extra:
            return  # which stand for it
        called = CALLED.get(owner, "this mapping") if owner is not None else "this mapping"
        if parent:
            called = f"`{parent[-1]}`" if isinstance(parent[-1], str) else called
        self._bag.error("S105", f"{called} needs a key `{key}`", self._places.key_span(parent))
        if parent:
            self._repaired.leave_out(parent)

    def _bad_name(self, finding: _Finding) -> None:
        key = str(finding.path[-1])
        span = self._places.key_span(finding.path)
        if finding.path[-2:-1] == ("set",) and "max_length" in finding.context:
            hint = "a name in `define` can stand for a part of it"
            message = f"what is set has more than {finding.context['max_length']} characters"
            self._bag.error("S106", message, span, hint=hint)
        elif finding.context.get("pattern") == LANGUAGE_TAG:
            hint = "a language is a short tag such as `en`, `de` or `pt-BR`"
            self._bag.error("S104", f"`{key}` is not a language", span, hint=hint)
        else:
            hint = (
                "a name has letters, digits and `_`, and does not begin with a digit; 40 characters at most"
            )
            self._bag.error("S104", f"`{key}` is not a name", span, hint=hint)
        self._repaired.leave_out(finding.path)

    # -- values ----------------------------------------------------------------------------------------------

    def _wrong_value(self, findings: list[_Finding]) -> None:
        finding = findings[0]
        if self._stands_for_anything(finding.value):
            return
        written = self._places.get(finding.path)
        if finding.value == "" and written is not None and written.span.read is None:
            return  # an item of a list without a value, which has been reported
        span = self._places.value_span(finding.path)
        for finding in findings:
            if finding.kind in ("greater_than_equal", "less_than_equal", "greater_than", "less_than"):
                hint = self._as_share(finding)
                self._bag.error("S106", f"`{finding.value}` is {_bound(finding)}", span, hint=hint)
                return
            if finding.kind == "too_short" and self._has_reported(finding.path):
                return
            if finding.kind in ("too_short", "too_long", "string_too_short", "string_too_long"):
                self._bag.error("S106", _length(finding), span)
                return
            if finding.kind == "literal_error":
                self._literal(finding, span)
                return
            if finding.context.get("pattern") == NOT_BLANK:
                self._bag.error("S106", f"`{finding.key}` is empty", span)
                return
            if finding.kind == "string_pattern_mismatch":
                hint = "a name has letters, digits and `_`, and does not begin with a digit"
                self._bag.error("S104", f"`{finding.value}` is not a name", span, hint=hint)
                return
        expected = expectation(annotation_at(self._model, finding.path))
        got = _kind_of(finding.value)
        key = finding.key
        hint = self._cure(finding, expected)
        if isinstance(finding.value, float) and expected == "an expression":
            expected = "a whole number or an expression"
        named = f"an entry of `{key}`" if finding.path and isinstance(finding.path[-1], int) else f"`{key}`"
        what = f"{named} must be {expected}" if key else f"expected {expected}"
        self._bag.error("S104", f"{what}, got {got}", span, hint=hint)

    def _stands_for_anything(self, value: object) -> bool:
        return self._parameters and isinstance(value, str) and PARAMETER.fullmatch(value) is not None

    def _has_reported(self, path: DataPath) -> bool:
        """Whether what is wrong in a list has been told; a parameter is one item of it, whatever it stands for."""
        parts = [self._places.get(lost) for lost in self._repaired.lost if lost[:-1] == path]
        return any(part is None or not self._stands_for_anything(part.value) for part in parts)

    def _as_share(self, finding: _Finding) -> cures.Hint:
        """What a number in per cent is where a share is expected."""
        value = finding.value
        if finding.context.get("le") != 1 or not isinstance(value, int | float) or not 2 <= value <= 100:
            return None
        return self._instead(finding.path, f"{value / 100:g}", "it is a share, not per cent")

    def _instead(self, path: DataPath, text: str, also: str = "") -> cures.Cure | str:
        shown = f"{path[-1]}: {text}" if isinstance(path[-1], str) else text
        return cures.write(shown, cures.over_value(self._places, path, text), also)

    def _cure(self, finding: _Finding, expected: str) -> cures.Hint:
        """What to write in place of a value of a wrong kind."""
        value, path = finding.value, finding.path
        if isinstance(value, list) and len(value) == 2 and all(type(item) is int for item in value):
            interval = f"{value[0]}..{value[1]}"
            held = held_at(self._model, path)
            if held is not None and held.kind == "interval":
                return self._instead(path, interval)
            return self._instead(path, f"pick({interval})", "which draws one of them")
        if isinstance(value, list) and expected == "an expression":
            return "conditions are joined with `and` or `or`, alternatives are written a | b"
        if isinstance(value, str) and (assigned := _ASSIGNMENT.fullmatch(value)) and "mapping" in expected:
            return self._instead(path, f"{{{assigned[1]}: {assigned[2]}}}")
        if isinstance(value, float) and expected in ("an expression", "a whole number"):
            percent = f"{value * 100:g}"
            if self._is_percent(path) and 0 <= value <= 1 and percent.isdecimal():
                return self._instead(path, percent, "it is per cent")
            return "numbers in expressions are whole" if expected == "an expression" else None
        if isinstance(value, str) and "number" in expected and (found := _UNIT.fullmatch(value)):
            number = found[1]
            if "whole" in expected and not number.isdecimal():
                return None
            if found[2] == "%" and expected == "a number":
                return self._instead(path, f"{float(number) / 100:g}", "it is a share, not per cent")
            return self._instead(path, number, "a number has no unit")
        called = _CALL.fullmatch(value) if isinstance(value, str) and "mapping" in expected else None
        if called is not None and called[1] in _KEYS:
            return self._instead(path, f"{{{called[1]}: {called[2]}}}")
        if isinstance(value, dict) and expected == "an expression":
            return "an expression has no colon; of each of a group it is asked by `all(d in doors where ...)`"
        if isinstance(value, list | dict) and expected in ("a text", "an expression"):
            return self._quoted(path, "brackets" if isinstance(value, list) else "braces or a colon")
        return None

    def _is_percent(self, path: DataPath) -> bool:
        """Whether the number at a path is per cent of something."""
        owner = model_at(self._model, path[:-1]) if path else None
        fields = owner.model_fields if owner is not None else {}
        return any(
            (field.alias or name) == path[-1] and (field.description or "").startswith("per cent")
            for name, field in fields.items()
        )

    def _quoted(self, path: DataPath, what: str) -> cures.Hint:
        """The proposal to quote what is written as a list or mapping in one line."""
        part = self._places.get(path)
        if part is None or part.substituted:
            return None
        written = part.source.text[part.span.start : part.end]
        if "\n" in written:
            return f"a value with {what} in it has to be quoted"
        return self._instead(path, cures.in_quotes(written), f"a text with {what} in it has to be quoted")

    def _literal(self, finding: _Finding, span: Span) -> None:
        annotation = annotation_at(self._model, finding.path)
        words = [str(word) for word in literals(annotation)]
        if not isinstance(finding.value, str):
            message = f"expected one of {', '.join(words)}, got {_kind_of(finding.value)}"
            self._bag.error("S104", message, span)
            return
        advice = advice_on(finding.value, words, "one of " + ", ".join(words))
        message = f"`{finding.value}` is not a word for `{finding.key}`"
        self._bag.error("S103", message, span, **advice)


def _has(part: object, step: object) -> bool:
    """Whether a mapping has a key or a list an item."""
    if isinstance(part, dict):
        return step in part
    return isinstance(part, list) and isinstance(step, int) and step < len(part)


def _counts_only_right_items(finding: _Finding) -> bool:
    """Whether a list is said to be too short only because pydantic does not count items that are wrong."""
    long_enough = isinstance(finding.value, list) and len(finding.value) >= finding.context.get(
        "min_length", 0
    )
    return finding.kind == "too_short" and long_enough


def _bound(finding: _Finding) -> str:
    context = finding.context
    key = next(key for key in ("ge", "gt", "le", "lt") if key in context)
    bound = context[key]
    number = int(bound) if bound == int(bound) else bound
    limits = {"ge": "too small; at least", "gt": "too small; more than", "le": "too large; at most"}
    return f"{limits.get(key, 'too large; at most')} {number} is expected"


def _length(finding: _Finding) -> str:
    context = finding.context
    key = finding.key or "this"
    many = "characters" if isinstance(finding.value, str) else "entries"
    if "max_length" in context:
        return f"`{key}` has more than {context['max_length']} {many}"
    if context["min_length"] > 1:
        return f"`{key}` has fewer than {context['min_length']} {many}"
    return f"`{key}` is empty"


_UNIT: Final = re.compile(r"\s*(\d+(?:\.\d+)?)\s*([a-z]+|%)\s*")
"""A number with what it counts."""

_CALL: Final = re.compile(r"\s*(\w+)\(\s*([\w.]+)\s*\)\s*")
_ASSIGNMENT: Final = re.compile(r"\s*(\w+)\s*=\s*([^=].*)")


def _kind_of(value: object) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f"the text `{value}`" if len(value) <= 40 else "a text"
    if isinstance(value, int | float):
        return f"the number {value}"
    return "a list" if isinstance(value, list) else "a mapping" if isinstance(value, dict) else "nothing"
