"""The scope of an expression: the meaning of names, and the place and wording of its mistakes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, TypeVar, Unpack

from socialai_dsl import cures
from socialai_dsl.diagnostics import Advice, DiagnosticBag, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import ParseProblem, parse_expression, parse_text, rebuilt, unparse
from socialai_dsl.schema.annotations import held_at
from socialai_dsl.schema.scenario import Expression, Frame, Scenario
from socialai_dsl.semantics.cast import Cases, Member
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import (
    SIDE,
    TURN,
    Compare,
    Const,
    ObjectType,
    Select,
    Term,
    Type,
    all_of,
    arithmetic,
    chosen,
    entity,
    equals,
    integer,
    may_be_nothing,
    numbers_of,
    where_there_is,
)
from socialai_dsl.source import Data, DataPath, Node, Span, TextEdit
from socialai_dsl.vocabulary import NOUN, Sentences, Slot
from socialai_dsl.widths import LARGEST_NUMBER

Scalar = int | bool | float | str

V = TypeVar("V")

KEY: Final = "(key)"
"""The last step of the path of an expression that is the key itself: `trust(speaker)` in `set`."""

_BREAK: Final = re.compile(r"[\t\n\r]")
"""What ends a line, or moves what follows."""


class ReportedError(Exception):
    """A value that means nothing; the reason has been reported."""


_EXACTLY: Final = 10**12
"""Numbers below are written with all their digits."""


@dataclass(frozen=True)
class Findings:
    """Where findings go, and where the parts of the file stand.

    Attributes:
        bag: takes the findings.
        places: the document, whose parts know where they are written.
        params: the file's parameters with their values, for `$name`.
        unknown: the names that were found to mean nothing where they stand.
    """

    bag: DiagnosticBag
    places: Node
    params: Mapping[str, Scalar] = field(default_factory=dict)
    unknown: set[str] = field(default_factory=set)

    def part(self, path: DataPath) -> Data:
        """What is written at `path`; None if there is nothing."""
        part = self.places.get(path)
        return part.data if part is not None else None

    def is_list(self, path: DataPath) -> bool:
        """Whether a list is written at `path`."""
        part = self.places.get(path)
        return part is not None and isinstance(part.children, list)

    def each(self, path: DataPath, values: Iterable[V]) -> Iterator[tuple[DataPath, V]]:
        """The values at `path` with their paths; one may stand there without being a list."""
        is_list = self.is_list(path)
        for i, value in enumerate(values):
            yield (*path, i) if is_list else path, value

    def at(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of a character of the text at `path`."""
        if path[-1:] == (KEY,):
            span = self.places.key_span(path[:-1])
            quote = int(span.width > len(str(path[-2])))
            return span.shifted(offset + quote, width)
        return self.places.locate(path, offset, width)

    def node(self, path: DataPath, node: ast.Expr) -> Span:
        """The place of a part of the expression at `path`."""
        return self.at(path, *_extent(node))

    def instead(self, path: DataPath, node: ast.Expr, text: str, only_name: bool = False) -> TextEdit | None:
        """The edit that writes something else in the place of a part of the expression at `path`.

        `only_name`: in that of `name(...)` of `subject.name(...)`.
        """
        start = node.at - isinstance(node, ast.Text)
        if only_name and isinstance(node, ast.Call | ast.Attribute):
            start = node.name_at
        return cures.over_part(self.places, path, start, node.end, text) if node.end > start else None

    def error(self, code: str, message: str, span: Span, **more: Unpack[Advice]) -> None:
        """Report an error."""
        self.bag.error(code, message, span, **more)

    def warning(self, code: str, message: str, span: Span, **more: Unpack[Advice]) -> None:
        """Report a warning."""
        self.bag.warning(code, message, span, **more)

    def too_large(
        self, what: str, far: int, span: Span, when: str = "", **more: Unpack[Advice]
    ) -> ReportedError:
        """Report a number that nothing can keep; raising the result gives up the value it is in."""
        number = f"{far:,}" if abs(far) < _EXACTLY else f"{far:.1e}"
        limit = LARGEST_NUMBER if far > 0 else -LARGEST_NUMBER
        message = f"{what} can be {number}{when}, and numbers go {'up' if far > 0 else 'down'} to {limit:,}"
        return self.fail("S106", message, span, **more)

    def no_such(self, word: str, message: str, span: Span, **more: Unpack[Advice]) -> ReportedError:
        """Report a name that means nothing there."""
        self.unknown.add(word)
        return self.fail("S201", message, span, **more)

    def fail(self, code: str, message: str, span: Span, **more: Unpack[Advice]) -> ReportedError:
        """Report an error; raising the result gives up the value it is in."""
        self.bag.error(code, message, span, **more)
        return ReportedError()

    def expression(self, path: DataPath, raw: Scalar) -> ast.Expr:
        """The tree of the expression at `path`, its parameters replaced by their values."""
        if isinstance(raw, bool):
            return ast.Truth(raw)
        if isinstance(raw, float):
            raise self.fail("S204", f"`{raw:g}` is not a whole number", self.at(path))
        if isinstance(raw, int):
            return ast.Number(raw) if raw >= 0 else ast.Negative(ast.Number(-raw))
        try:
            return self._filled(parse_expression(raw), path)
        except ParseProblem as problem:
            raise self._problem(problem, path) from None

    def text(self, path: DataPath, raw: str) -> ast.Text:
        """The tree of the text at `path`, its parameters replaced by their values."""
        if not self.must_be_one_line(path, raw):
            raise ReportedError
        try:
            filled = self._filled(parse_text(raw), path)
        except ParseProblem as problem:
            raise self._problem(problem, path) from None
        assert isinstance(filled, ast.Text), "internal: a text became something else"
        return filled

    def must_be_one_line(self, path: DataPath, text: str) -> bool:
        """Whether a text at `path` is one line, else that is reported: what is said is heard line by line."""
        match = _BREAK.search(text)
        if match is None:
            return True
        what = "line break"
        hint: cures.Hint = "write it on one line, or behind `>-`, which makes one line of several"
        if match.group() == "\t":
            what, hint = (
                "tab",
                cures.propose(
                    "write a blank", cures.over_part(self.places, path, match.start(), match.end(), " ")
                ),
            )
        message = f"there is a {what} in a text that is said or shown"
        self.error("S405", message, self.at(path, match.start()), hint=hint)
        return False

    def _problem(self, problem: ParseProblem, path: DataPath) -> ReportedError:
        code = "S212" if problem.code == "S004" else problem.code
        hint: cures.Hint = problem.hint
        held = held_at(Scenario, path)
        if problem.words and (held is None or held.kind not in ("activity", "effect", "place")):
            hint = f"{hint}; a text is quoted: {as_text(problem.words, self.part(path))}"
        if problem.instead is not None:
            start, end, text = problem.instead
            edit = cures.over_part(self.places, path, start, end, text)
            hint = (
                cures.write(text.strip(), edit, problem.hint or "")
                if text
                else cures.propose("delete it", edit)
            )
        return self.fail(code, problem.message, self.at(path, problem.offset), hint=hint)

    def _filled(self, node: ast.Expr, path: DataPath) -> ast.Expr:
        if isinstance(node, ast.Parameter):
            return self._parameter(node, path)
        if isinstance(node, ast.Text) and any(
            _BREAK.search(part) for part in node.parts if isinstance(part, str)
        ):
            message, hint = "there is a line break or a tab in a text", "a text is one line"
            raise self.fail("S405", message, self.node(path, node), hint=hint)
        replaced: ast.Expr = rebuilt(node, lambda part: self._filled(part, path))
        return replaced

    def _parameter(self, node: ast.Parameter, path: DataPath) -> ast.Expr:
        span = self.at(path, node.at, len(node.id) + 1)
        if node.id not in self.params:
            near = did_you_mean(node.id, self.params)
            suggestion = f"${near}" if near else None
            raise self.fail("S206", f"unknown parameter `{node.id}`", span, suggestion=suggestion)
        value = self.params[node.id]
        if isinstance(value, str):
            try:
                tree = parse_expression(value)
            except ParseProblem as problem:
                message = f"the value `{value}` of `{node.id}` is not an expression: {problem.message}"
                raise self.fail("S206", message, span) from None
            if named := next((part for part in tree.walk() if isinstance(part, ast.Parameter)), None):
                message = f"the value `{value}` of `{node.id}` names a parameter, `{named.id}`, and a value names none"
                raise self.fail("S206", message, span)
            return ast.moved(tree, lambda _: node.at)
        if isinstance(value, float):
            raise self.fail("S204", f"the parameter `{node.id}` is {value:g}, not a whole number", span)
        return ast.moved(self.expression((), value), lambda _: node.at)


def _extent(node: ast.Expr) -> tuple[int, int]:
    """Offset and width of what a caret should mark."""
    match node:
        case ast.Name(id=word):
            return node.at, len(word)
        case ast.Attribute(name=word) | ast.Call(name=word):
            return node.name_at, len(word)
        case ast.Parameter(id=word):
            return node.at, len(word) + 1
        case ast.Number(value=value):
            return node.at, len(str(value))
        case ast.Text() if node.end > node.at:
            return node.at - 1, node.end - node.at + 1
        case _:
            return node.at, 1


def as_text(text: str, whole: object) -> str:
    """How a text is written in an expression: where that is the whole value, YAML takes the outer quotes away."""
    return f"""'"{text}"'""" if text == whole else f'"{text}"'


def surviving() -> suppress:
    """Go on after a value that failed; its reason has been reported."""
    return suppress(ReportedError)


def is_nothing(raw: object) -> bool:
    """Whether `none` is written, where a register starts or is set."""
    return isinstance(raw, str) and raw.strip() == "none"


def dotted(path: DataPath) -> str:
    """`("outcome", 0, "success")` as `outcome[0].success`."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


# -- words of messages ---------------------------------------------------------------------------------------


_KINDS: Final = {
    "bool": "a condition",
    "int": "a number",
    "direction": "a direction",
    "color": "a colour",
    "action": "an action",
    "entity": "an object or a member of the cast",
    "text": "a text",
    "noun": "a noun",
    "status": "a status",
    "look": "a look",
    "utterance": "an utterance",
    "cell": "a cell",
}


_PLACEHOLDERS: Final = {
    "entity": "x",
    "entities": "x",
    "int": "n",
    "direction": "up",
    "turn": "left",
    "utterance": '"..."',
    "state": "state",
    "status": "status",
    "action": "action",
    "side": "top",
    "group": "group",
    "actions": "a | b",
    "any": "x",
    "sequence": "dance",
}


def usage(signature: Signature) -> str:
    """How an instruction is written: `next_to(x)`."""
    if not signature.takes:
        return signature.name
    least = len(signature.takes) - signature.optional
    return f"{signature.name}({', '.join(_PLACEHOLDERS[kind] for kind in signature.takes[: least or None])})"


def wrong_count(signature: Signature, given: int) -> str:
    """The message about too few or too many values in brackets."""
    many, least = len(signature.takes), len(signature.takes) - signature.optional
    number = f"{least} or {many}" if least < many else f"{many}"
    takes = "nothing in brackets" if not many else f"{number} value{'s' if many > 1 else ''} in brackets"
    return f"`{signature.name}` takes {takes}: `{usage(signature)}`; {given} given"


def with_article(name: str) -> str:
    """A name with its article: `an apple`, `a remote door`."""
    return f"{'an' if name[:1] in 'aeiou' else 'a'} {name.replace('_', ' ')}"


def described(type_: Type) -> str:
    """A type with its article: `a colour`, `a number`."""
    if type_.words == TURN.words and type_.kind == "int":
        return "a turn (left or right)"
    if type_.words == SIDE.words and type_.kind == "int":
        return "a wall (top, bottom, left or right)"
    return _KINDS[type_.kind]


def words_of(type_: Type) -> str:
    """The words of a type for a help line."""
    return ", ".join(type_.words)


def spoken(type_: Type, value: int) -> str:
    """A value as it is said in a text."""
    return type_.words[value - type_.low] if type_.words else str(value)


def quoted(node: ast.Expr) -> str:
    """An expression as an author would write it, with `...` for conditions of quantifiers and places."""
    return unparse(node, shortened=True)


# -- names: the symbol table of a scenario, and what is known at one place of it -----------------------------


DEFINE = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\(\s*([A-Za-z_]\w*(?:\s*,\s*[A-Za-z_]\w*)*)\s*\))?\s*")


@dataclass(frozen=True)
class Objects:
    """An object, or a group of them: numbers of its entities, in order."""

    name: str
    type: ObjectType
    numbers: range
    single: bool

    def called(self, index: int) -> str:
        """How one of them is called: `doors[0]`."""
        return self.name if self.single else f"{self.name}[{index}]"


@dataclass(frozen=True)
class Define:
    """A definition: its parameters, and where its expression stands."""

    name: str
    parameters: tuple[str, ...]
    raw: Expression
    path: DataPath


@dataclass(frozen=True)
class FilledSlot:
    """What a slot of the grammar can be: its words, and what each stands for where that is in the room or a colour."""

    words: Type
    values: tuple[Const, ...] = ()


@dataclass(frozen=True)
class Symbols:
    """Everything a scenario declares, by name.

    Attributes:
        cast: the members, the agent too, in the order written.
        numbers: member -> number of its entity.
        roles: role -> the member that plays it.
        groups: name of a group in the cast -> its members.
        objects: name -> its entities.
        types: the object types of the prelude. default_colors: type -> its colour where none is given.
        width, height: least and largest size of the room.
        slots: of a grammar with `slots`, what each can be.
    """

    scenario: Scenario
    cast: Mapping[str, Member]
    numbers: Mapping[str, int]
    roles: Mapping[str, str]
    groups: Mapping[str, tuple[str, ...]]
    objects: Mapping[str, Objects]
    types: Mapping[str, ObjectType]
    defines: Mapping[str, Define]
    width: tuple[int, int]
    height: tuple[int, int]
    default_colors: Mapping[str, str]
    slots: Mapping[str, FilledSlot] = field(default_factory=dict)

    @cached_property
    def sentences(self) -> Sentences:
        """What the agent can say."""
        grammar = self.scenario.grammar
        slots = [Slot(name, slot.words.words) for name, slot in self.slots.items()]
        if grammar.nouns:
            slots = [Slot(NOUN, tuple(map(str, grammar.nouns)))]
        return Sentences.of(grammar.templates, slots)

    @property
    def entities(self) -> int:
        """How many entities there are."""
        return len(self.numbers) + sum(len(o.numbers) for o in self.objects.values())

    @property
    def nouns(self) -> Type:
        """The nouns of the grammar as a type."""
        words = tuple(str(noun) for noun in self.scenario.grammar.nouns)
        return Type("noun", 0, len(words) - 1, words)

    def object_of(self, number: int) -> Objects | None:
        """The group an entity belongs to; None for the cast."""
        return next((o for o in self.objects.values() if number in o.numbers), None)

    def member_of(self, number: int) -> str | None:
        """The cast member with this number; None for objects."""
        return next((name for name, n in self.numbers.items() if n == number), None)

    def members_of(self, numbers: Iterable[int]) -> list[str | None]:
        """The same of several numbers."""
        return [self.member_of(number) for number in numbers]

    def called(self, number: int) -> str:
        """An entity in the scenario's own words: `boxes[1]`, `bob`."""
        objects = self.object_of(number)
        return objects.called(number - objects.numbers[0]) if objects else str(self.member_of(number))

    def word(self, value: Const) -> str:
        """A known value in the scenario's own words: `boxes[1]`, `bob`, `red`, `3`."""
        return self.called(value.value) if value.type.kind == "entity" else spoken(value.type, value.value)

    @cached_property
    def declared(self) -> dict[str, str]:
        """Every name of the scenario and what it is: let, object, cast, define, memory, roles, slot of the grammar."""
        found = dict.fromkeys(self.scenario.let, "let")
        found |= dict.fromkeys(self.scenario.grammar.slots, "grammar.slots")
        found |= dict.fromkeys(self.defines, "define")
        found |= dict.fromkeys(self.scenario.memory, "memory")
        found |= dict.fromkeys(self.scenario.state, "state")
        found |= dict.fromkeys(self.scenario.looks, "looks")
        found |= dict.fromkeys(self.scenario.tables, "tables")
        found |= dict.fromkeys(self.scenario.roles, "roles")
        found |= {name: "object" if o.single else "objects" for name, o in self.objects.items()}
        return found | dict.fromkeys((*self.cast, *self.groups), "cast")

    @staticmethod
    def default_name(member: str) -> str:
        """How a member of the cast is called that has no `name`: its key, `peers[0]` as `Peers 1`."""
        group, _, number = member.removesuffix("]").partition("[")
        key = f"{group} {int(number) + 1}" if number else member
        return key[:1].upper() + key[1:].replace("_", " ")

    def group_of(self, member: str) -> tuple[str, int] | None:
        """The group that a member of the cast belongs to and its place in it; None if it stands for itself."""
        for name, members in self.groups.items():
            if member in members:
                return name, members.index(member)
        return None


@dataclass(frozen=True)
class PlayedFrame:
    """A frame as one member plays it.

    Attributes:
        member: who; `number` is its entity.
        name, model: the frame.
        defines: its definitions.
        path: where it is written.
        texts: slots that are substituted wherever they are used (text, utterance, bool) -> what fills them; None if
            nobody does, as when a frame is only looked at.
        looked_at: nobody plays it; it is checked all the same.
    """

    member: str
    number: int
    name: str
    model: Frame
    path: DataPath
    defines: Mapping[str, Define]
    texts: Mapping[str, Cases | None]
    looked_at: bool = False

    def register(self, name: str) -> str:
        """The path of one of its registers."""
        return f"{self.name} of nobody.{name}" if self.looked_at else f"{self.member}.{name}"

    @property
    def address(self) -> DataPath:
        """The name of its draw sites, in any file."""
        return ("frames", self.name)


class Draws:
    """Numbers the picks of one value, in source order; `site` names the value (see draws.py)."""

    def __init__(self, site: str) -> None:
        self.site = site
        self._next = 0

    def number(self) -> int:
        """The next ordinal."""
        self._next += 1
        return self._next - 1


@dataclass(frozen=True)
class Macro:
    """An argument of a definition: an expression that is resolved where it is used, in its own scope."""

    node: ast.Expr
    scope: Scope


@dataclass(frozen=True)
class Scope:
    """Where an expression stands and what its names can mean there.

    Attributes:
        path: of the expression's text in the document.
        draws: numbers its picks; `outer` is the value that this one is part of, if its site differs.
        member: whose attribute or frame it is (`self`).
        frame: the frame it stands in.
        variables: variables of quantifiers, and arguments of definitions.
        at_reset: computed once, before the first step.
        here: it is the `where` of a place, so `here` means the candidate cell.
        it: the entity whose attribute is being computed.
        hearing: it belongs to a rule with `hears`, so there is a `speaker`.
        within: names of the definitions it stands in, to find circles. nested: how many quantifiers it stands in.
    """

    path: DataPath
    draws: Draws
    member: str | None = None
    frame: PlayedFrame | None = None
    variables: Mapping[str, Term | Macro] = field(default_factory=dict)
    at_reset: bool = False
    here: bool = False
    it: Const | None = None
    hearing: bool = False
    outer: Draws | None = None
    within: tuple[str, ...] = ()
    nested: int = 0

    def at(self, path: DataPath, site: str) -> Scope:
        """The same names for another value."""
        return replace(self, path=path, draws=Draws(site), outer=None)

    def binding(self, name: str, term: Term | Macro) -> Scope:
        """With one more variable."""
        return replace(self, variables={**self.variables, name: term})

    @property
    def pick_site(self) -> str:
        """The site a pick has to name itself: empty where it is the site of the whole value."""
        return self.draws.site if self.outer is not None else ""


def reset_scope(path: DataPath, site: str | None = None, member: str | None = None) -> Scope:
    """The scope of a value computed at reset."""
    return Scope(path, Draws(site or dotted(path)), member=member, at_reset=True)


def object_scope(objects: Objects, index: int, path: DataPath, key: str, *, at_reset: bool) -> Scope:
    """The scope of a value of one member of a group of objects, which is `it`."""
    draws = Draws(f"objects.{objects.called(index)}.{key}")
    return Scope(path, draws, at_reset=at_reset, it=entity(objects.numbers[index]))


def step_scope(path: DataPath, site: str | None = None, member: str | None = None) -> Scope:
    """The scope of a value that is computed anew in every step."""
    return Scope(path, Draws(site or dotted(path)), member=member)


def parse_define(key: str) -> tuple[str, tuple[str, ...]] | None:
    """`near(a, b)` as its name and parameters; None if it is not of this form."""
    match = DEFINE.fullmatch(key)
    if match is None:
        return None
    parameters = match.group(2)
    return match.group(1), tuple(p.strip() for p in parameters.split(",")) if parameters else ()


def frames_of(scenario: Scenario) -> Iterator[tuple[DataPath, Frame]]:
    """Every frame with the place where it is written; of the files of a `one_of`, which share theirs, the first's."""
    for name, frame in scenario.frames.items():
        yield ("frames", name), frame
    for member, described in scenario.cast.items():
        for name, frame in described.one_of[0].frames.items() if described.one_of else ():
            yield ("cast", member, "one_of", 0, "frames", name), frame


# -- values that depend on others ---------------------------------------------------------------------------


def select(cases: Cases, terms: Sequence[Term]) -> Term:
    """The term beside the case that holds; each has one."""
    kinds = {term.type.kind for term in terms}
    assert len(kinds) == 1, "internal: cases of different kinds"
    drawn = cases[0].drawn
    if len(set(terms)) == 1 or drawn is None:
        return terms[0]
    found = {n: term for case, term in zip(cases, terms, strict=True) for n in case.numbers}
    each = [found[number] for number in drawn.type.values]
    if kinds == {"text"}:
        return text_of([(equals(drawn, number), term) for number, term in enumerate(each)])
    type_ = common_type(each)
    typed = [replace(term, type=type_) if isinstance(term, Const) else term for term in each]
    return _with_default(type_, [(equals(drawn, number), term) for number, term in enumerate(typed)])


def _with_default(type_: Type, cases: Sequence[tuple[Term, Term]]) -> Select:
    """The value beside the condition that holds (one does); the most frequent one needs none."""
    default = Counter(value for _, value in cases).most_common(1)[0][0]
    kept = [(condition, value) for condition, value in cases if value != default]
    return Select(type_, tuple(c for c, _ in kept), tuple(v for _, v in kept), default)


def of_each(who: Term, values: Sequence[Term]) -> Term:
    """The value that belongs to whichever entity is meant; `values` in the order of those it can be."""
    numbers = numbers_of(who)
    if len(set(values)) == 1:
        return where_there_is(who, values[0])
    if values[0].type.kind == "text":
        cases = zip(numbers, values, strict=True)
        return where_there_is(who, text_of([(equals(who, number), value) for number, value in cases]))
    return where_there_is(who, chosen(who, numbers, values, common_type(values)))


def beside_word(word: Term, values: Sequence[int], type_: Type) -> Term:
    """The value beside a word of a type; it needs the word: where there is none, nothing is found."""
    place = replace(word, type=integer(0, len(values) - 1))
    first = values[0]
    if list(values) == list(range(first, first + len(values))):
        return replace(arithmetic("+", place, Const(integer(first), first)) if first else place, type=type_)
    return chosen(place, range(len(values)), [Const(type_, value) for value in values], type_)


def common_type(values: Sequence[Term]) -> Type:
    """The type of the last of some values of one kind, with room for all of them."""
    low, high = min(v.type.low for v in values), max(v.type.high for v in values)
    return replace(values[-1].type, low=low, high=high)


def text_of(cases: Sequence[tuple[Term, Term]]) -> Term:
    """The text beside the condition that holds (one does), of one type that has the words of all."""
    words: dict[str, None] = {}
    for _, term in cases:
        values = numbers_of(term)
        words |= {spoken(term.type, value): None for value in values}
    type_ = Type("text", 0, len(words) - 1, tuple(words))
    if len(words) == 1:
        return Const(type_, 0)
    if len(cases) == 1:
        return cases[0][1]
    return _with_default(
        type_, [case for condition, term in cases for case in _words_of(condition, term, type_)]
    )


def _words_of(condition: Term, term: Term, type_: Type) -> Iterator[tuple[Term, Const]]:
    """Each word that a text can be, with the condition that it is."""
    if isinstance(term, Const):
        yield condition, Const(type_, type_.words.index(spoken(term.type, term.value)))
        return
    for value in term.type.values:
        equal = equals(term, value)
        needed = [Compare("<=", Const(term.type, term.type.low), term)] if may_be_nothing(term) else []
        yield all_of([condition, *needed, equal]), Const(type_, type_.words.index(spoken(term.type, value)))
