"""Groups: quantifiers, subjects of verbs, sequences and memories."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from collections.abc import Sequence as Items
from dataclasses import dataclass, replace
from typing import Final, cast

from socialai_dsl import cures
from socialai_dsl.diagnostics import advice_on, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import Frame, Sequence
from socialai_dsl.semantics.plans import MemoryPlan
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import (
    Draws,
    Macro,
    ReportedError,
    Scope,
    described,
    quoted,
    spoken,
    step_scope,
    surviving,
    usage,
)
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    CELL,
    COLOR,
    Chance,
    Compare,
    Const,
    FieldOf,
    Here,
    Quantification,
    Quantifier,
    Read,
    Select,
    SitedTerm,
    Term,
    Type,
    Variable,
    all_of,
    between,
    constants,
    entity,
    number,
)

MAX_GROUP = 256
WIDE: Final = 4096
"""Types with more values than this are not walked through value by value."""
MAX_WEIGHT = 100
THOSE: Final = "those"
_MOST_CELLS = 28 * 28


@dataclass(frozen=True)
class Group:
    """Known values of one type, in order; a weight repeats a value. `bounds` narrow a range whose ends are drawn."""

    type: Type
    items: tuple[Const, ...]
    bounds: tuple[Term, Term] | None = None


_GROUPS: Final = (
    "a group is the name of objects with `count`, `colors`, `nouns`, a range 1..3, or alternatives a | b"
)


def is_group(resolver: Resolver, node: ast.Expr, scope: Scope) -> bool:
    """Whether an expression stands for several values."""
    match node:
        case ast.Alternatives() | ast.Interval():
            return True
        case ast.Attribute(subject=ast.Name(id=slot), name="words"):
            return slot in resolver.symbols.slots and slot not in scope.variables
        case ast.Name(id=word):
            bound = scope.variables.get(word)
            if bound is not None:
                return isinstance(bound, Macro) and is_group(resolver, bound.node, bound.scope)
            objects = resolver.symbols.objects.get(word)
            return (
                word in ("colors", "nouns", "cells")
                or is_everybody(resolver, word)
                or word in resolver.symbols.groups
                or (objects is not None and not objects.single)
            )
    return False


def group(resolver: Resolver, node: ast.Expr, expected: Type | None, scope: Scope) -> Group:
    """The members of a group; bare words in it are of the expected type."""
    match node:
        case ast.Interval():
            return _interval(resolver, node, scope)
        case ast.Alternatives(options=options):
            return _alternatives(resolver, node, options, expected, scope)
        case ast.Attribute(subject=ast.Name(id=slot)) if is_group(resolver, node, scope):
            type_ = resolver.symbols.slots[slot].words
            return Group(type_, constants(type_))
        case ast.Name(id=word) if word in scope.variables:
            bound = scope.variables[word]
            if isinstance(bound, Macro) and is_group(resolver, bound.node, bound.scope):
                return group(resolver, bound.node, expected, bound.scope)
        case ast.Name(id="cells"):
            return _cells(resolver, node, scope)
        case ast.Name(id=word) if (whole := _type_of_all(resolver, word)) is not None:
            if whole.size == 0:
                raise resolver.fail("S201", "this grammar has slots, and no `nouns`", node, scope)
            return Group(whole, constants(whole))
    single = resolver.value(node, expected, scope)
    if isinstance(single, Const):
        return Group(single.type, (single,))
    message = f"`{quoted(node)}` is {described(single.type)}, here a group is needed"
    raise resolver.fail("S204", message, node, scope, hint=_one_by_one(resolver, node, scope) or _GROUPS)


def _one_by_one(resolver: Resolver, node: ast.Expr, scope: Scope) -> cures.Hint:
    """The proposal to ask of each what is asked of a group as a whole: `c in coins where seen(c)` for `seen(coins)`."""
    parts = [part for part in node.walk() if isinstance(part, ast.Name) and is_group(resolver, part, scope)]
    if len(parts) != 1:
        return None
    group, letter = parts[0], parts[0].id[0]
    asked = ast.rebuilt(node, lambda part: ast.Name(letter) if part is group else part)
    return resolver.instead(f"{letter} in {group.id} where {ast.unparse(asked)}", node, scope)


def must_be_known(resolver: Resolver, node: ast.Expr, scope: Scope) -> None:
    """Report a name that means nothing where only a group can stand, so that no text is taken for meant."""
    if (
        isinstance(node, ast.Name)
        and resolver.means_nothing(node.id, scope)
        and not is_group(resolver, node, scope)
    ):
        advice = advice_on(node.id, [*resolver.symbols.objects, *resolver.symbols.groups], _GROUPS)
        raise resolver.no_such(node.id, f"there is no group `{node.id}`", node, scope, **advice)


def is_everybody(resolver: Resolver, word: str) -> bool:
    """Whether a word stands for all members of the cast, or for all objects, and for nothing that is declared."""
    symbols = resolver.symbols
    return word not in symbols.declared and (word == "cast" or (word == "objects" and bool(symbols.objects)))


def _type_of_all(resolver: Resolver, word: str) -> Type | None:
    """The type that has exactly the members of a group, of the cast, of things, or of colours or nouns."""
    symbols = resolver.symbols
    if word in ("colors", "nouns"):
        return COLOR if word == "colors" else symbols.nouns
    if is_everybody(resolver, word):
        members = len(symbols.numbers)
        return (
            Type("entity", 0, members - 1)
            if word == "cast"
            else Type("entity", members, symbols.entities - 1)
        )
    numbers: Items[int] = [symbols.numbers[name] for name in symbols.groups.get(word, ())]
    if word in symbols.objects:
        numbers = symbols.objects[word].numbers
    return Type("entity", numbers[0], numbers[-1]) if numbers else None


def _cells(resolver: Resolver, node: ast.Name, scope: Scope) -> Group:
    """All floor cells of the room; a search over cells cannot be done for each of many cells."""
    bound = (term for term in scope.variables.values() if isinstance(term, Variable))
    if scope.here or any(term.type.kind == "cell" for term in bound):
        message = "`cells` cannot stand inside another search over cells"
        raise resolver.fail(
            "S211", message, node, scope, hint="draw or compute one of the two in `let` first"
        )
    return Group(CELL, ())


def _interval(resolver: Resolver, node: ast.Interval, scope: Scope) -> Group:
    low, high = resolver.value(node.low, INT, scope), resolver.value(node.high, INT, scope)
    type_ = Type("int", low.type.low, high.type.high)
    known = isinstance(low, Const) and isinstance(high, Const)
    if type_.size < 1:
        raise resolver.fail(
            "S106", f"the range {quoted(node)} is empty: its end is below its start", node, scope
        )
    if type_.size > MAX_GROUP:
        raise resolver.fail(
            "S106", f"a range has at most {MAX_GROUP} values, this one {type_.size}", node, scope
        )
    return Group(type_, constants(type_), None if known else (low, high))


def _alternatives(
    resolver: Resolver, node: ast.Expr, options: tuple[ast.Expr, ...], expected: Type | None, scope: Scope
) -> Group:
    parts = [_weighted(resolver, option, scope) for option in options]
    lead = next((p for _, p in parts if not resolver.is_bare(p, scope)), None)
    if expected is None and lead is not None:
        expected = group(resolver, lead, None, scope).type
    items: list[Const] = []
    for weight, option in parts:
        members = group(resolver, option, of_any_range(expected), scope)
        if members.bounds is not None:
            raise resolver.fail(
                "S204", f"the ends of `{quoted(option)}` are not known numbers", option, scope
            )
        items += members.items * weight
    return _joined(resolver, node, items, scope)


def of_any_range(expected: Type | None) -> Type | None:
    """What is expected of the members of a group: numbers and things of any range."""
    if expected is not None and expected.kind in ("int", "entity") and not expected.words:
        return replace(expected, low=0, high=0)
    return expected


def _weighted(resolver: Resolver, option: ast.Expr, scope: Scope) -> tuple[int, ast.Expr]:
    match option:
        case ast.Arithmetic(op="*", left=ast.Number(value=weight), right=ast.Number(value=value)):
            total = weight * value
            message = f"`{quoted(option)}` is the number {total} here, not {value} with a weight"
            often = " | ".join([str(value)] * weight) if weight in range(1, 7) else f"{value} | {value} | ..."
            hint = resolver.instead(often, option, scope, f"for the number {total} write `{total}`")
            raise resolver.fail("S203", message, option, scope, hint=hint)
        case ast.Interval(
            low=ast.Arithmetic(op="*", left=ast.Number(), right=ast.Number()) as low, high=high
        ):
            each = f"{quoted(low.left)} * ({quoted(low.right)}..{quoted(high)})"
            message = f"`{quoted(option)}` begins at `{quoted(low)}`, and has no weight"
            hint = resolver.instead(each, option, scope, "then each has the weight")
            raise resolver.fail("S203", message, option, scope, hint=hint)
        case ast.Arithmetic(op="*", left=ast.Number(value=weight), right=right) if not isinstance(
            right, ast.Number
        ):
            if not 1 <= weight <= MAX_WEIGHT:
                raise resolver.fail("S106", f"a weight is from 1 to {MAX_WEIGHT}", option, scope)
            return weight, right
    return 1, option


def _joined(resolver: Resolver, node: ast.Expr, items: list[Const], scope: Scope) -> Group:
    """Alternatives under one type that has room for all of them."""
    kinds = {item.type.kind for item in items}
    if len(kinds) > 1:
        first = items[0].type
        other = next(item.type for item in items if item.type.kind != first.kind)
        message = f"`{quoted(node)}` mixes {described(first)} with {described(other)}"
        raise resolver.fail("S204", message, node, scope)
    if kinds == {"text"}:
        words = tuple(dict.fromkeys(spoken(item.type, item.value) for item in items))
        type_ = Type("text", 0, len(words) - 1, words)
        return Group(type_, tuple(Const(type_, words.index(spoken(i.type, i.value))) for i in items))
    if kinds <= {"int", "entity"} and not items[0].type.words:
        numbers = [item.value for item in items]
        type_ = Type(items[0].type.kind, min(numbers), max(numbers))
        return Group(type_, tuple(Const(type_, value) for value in numbers))
    return Group(items[0].type, tuple(items))


def quantified(resolver: Resolver, node: ast.Quantifier, expected: Type | None, scope: Scope) -> Term:
    """`pick(x in group where condition to target)` and its kin."""
    check_quantifier(resolver, node, scope)
    if node.name == THOSE:
        message = "`those` says what is affected in `cause`, and whose register in `set`"
        hint = f"a condition asks `any({node.var} in {quoted(node.group)} where ...)`, or `all`, `count`, `first`"
        raise resolver.fail("S211", message, node, scope, hint=hint)
    chooses = node.name in ("pick", "first", "nearest")
    ordinal = scope.draws.number() if node.name == "pick" else 0
    members = group(resolver, node.group, of_any_range(expected) if chooses else None, scope)
    variable = variable_called(node.var, scope)
    inner = replace(scope.binding(node.var, Variable(members.type, variable)), nested=scope.nested + 1)
    condition = resolver.value(node.where, BOOL, inner) if node.where is not None else None
    to = resolver.somewhere(node.to, scope) if node.to is not None else None
    return quantification(cast(Quantifier, node.name), members, variable, condition, scope, ordinal, to)


def check_quantifier(resolver: Resolver, node: ast.Quantifier, scope: Scope) -> None:
    """Report a quantifier that is not known, or lacks a part."""
    if node.name not in resolver.words.quantifiers:
        message = f"`{node.name}({node.var} in ...)` is not known"
        if node.name in resolver.words.reserved and node.where is None and node.to is None:
            condition = f"{node.name}(({node.var} in {quoted(node.group)}))"
            hint = resolver.instead(
                condition, node, scope, "a comparison with `in` takes brackets of its own"
            )
            raise resolver.fail("S205", message, node, scope, hint=hint)
        words = resolver.words
        meant = next((word for word in words.quantifiers if node.name in words.values[word].also), None)
        if meant is not None:
            place = cures.over_part(
                resolver.findings.places, scope.path, node.at, node.at + len(node.name), meant
            )
            raise resolver.fail("S205", message, node, scope, hint=cures.write(meant, place))
        raise resolver.fail(
            "S205", message, node, scope, suggestion=did_you_mean(node.name, resolver.words.quantifiers)
        )
    if node.var in resolver.words.reserved or node.var in resolver.symbols.declared:
        message = f"the variable `{node.var}` has a name that means something already"
        if isinstance(node.group, ast.Name) and is_group(resolver, ast.Name(node.var), scope):
            swapped = replace(node, var=node.group.id, group=ast.Name(node.var))
            if resolver.means_nothing(node.group.id, scope):
                message = (
                    f"`{node.group.id}` is no group, and `{node.var}` is one: the variable stands before `in`"
                )
                raise resolver.fail(
                    "S213", message, node, scope, hint=resolver.instead(ast.unparse(swapped), node, scope)
                )
        raise resolver.fail("S213", message, node, scope, hint="call it by a letter, such as `d`")
    if node.name == "nearest" and node.to is None:
        raise resolver.fail("S211", "`nearest` needs `to`: nearest(d in doors to agent)", node, scope)
    if node.name != "nearest" and node.to is not None:
        raise resolver.fail("S211", f"`to` belongs to `nearest`, not to `{node.name}`", node, scope)
    if node.name in ("any", "all", THOSE) and node.where is None:
        raise resolver.fail("S211", f"`{node.name}` needs `where` and a condition", node, scope)


def pick(resolver: Resolver, node: ast.Call, expected: Type | None, scope: Scope) -> Term:
    """`pick(group)` and `first(group)`, `count(group)`: without a condition."""
    ordinal = scope.draws.number() if node.name == "pick" else 0
    members = group(resolver, node.args[0], of_any_range(expected) if node.name != "count" else None, scope)
    return quantification(
        cast(Quantifier, node.name), members, variable_called("each", scope), None, scope, ordinal
    )


def quantification(
    op: Quantifier,
    members: Group,
    variable: str,
    condition: Term | None,
    scope: Scope,
    ordinal: int = 0,
    to: Term | None = None,
) -> Quantification:
    """The term of a quantifier."""
    if members.bounds is not None:
        inside = between(Variable(members.type, variable), *members.bounds)
        condition = inside if condition is None else all_of([inside, condition])
    type_ = members.type
    if op in ("any", "all"):
        type_ = BOOL
    elif op == "count":
        type_ = Type("int", 0, len(members.items))
    site = scope.pick_site if op == "pick" else ""
    cells = members.type.kind == "cell"
    if cells and op == "count":
        type_ = Type("int", 0, _MOST_CELLS)
    return Quantification(type_, op, variable, members.items, condition, to, ordinal, site, cells)


def any_member(resolver: Resolver, node: ast.Expr, scope: Scope, relation: Callable[[Term], Term]) -> Term:
    """Whether a relation holds to any member of the group at `node`."""
    members = group(resolver, node, None, scope)
    if members.type.kind not in ("entity", "cell"):
        message = (
            f"`{quoted(node)}` is {described(members.type)}, here somebody or something in the room is needed"
        )
        raise resolver.fail("S204", message, node, scope)
    variable = variable_called("each", scope)
    condition = relation(Variable(members.type, variable))
    return quantification("any", members, variable, condition, scope)


def variable_called(word: str, scope: Scope) -> str:
    """The name of a variable, which differs from those around it."""
    return f"{word}#{scope.nested}" if scope.nested else word


# -- subjects: what may stand before the dot, and when it may be asked ---------------------------------------


def check_points(resolver: Resolver, name: str, who: Term, node: ast.Expr, scope: Scope) -> None:
    """Report what cannot point: an object, and the agent, which has no arm to do it with."""
    if who.type.high >= len(resolver.symbols.numbers):
        raise resolver.fail("S204", f"only NPCs point, so only they have `{name}`", node, scope)
    if who.type.high == 0:
        raise resolver.fail("S204", "the agent never points; only NPCs do", node, scope)


def check_moment(resolver: Resolver, signature: Signature, node: ast.Expr, scope: Scope) -> None:
    """Report what speaks of a step where there is none yet."""
    if signature.momentary and scope.at_reset:
        message = (
            f"`{signature.name}` speaks of a step, but this value is computed once, before the first step"
        )
        hint = "a `define` is recomputed at every use" if "let" in scope.path else None
        if "beliefs" in scope.path:
            hint = "a belief is there from the start, so it is about something that is true before the first step"
        raise resolver.fail("S204", message, node, scope, hint=hint)


def _needs_somebody(resolver: Resolver, signature: Signature, node: ast.Expr, scope: Scope) -> ReportedError:
    """Report a verb without a subject; the cure puts one before it: what else the expression asks about, else the first
    member or thing that there is.
    """
    known = resolver.symbols.objects if signature.subject == "object" else resolver.symbols.numbers
    near = next((name for name in resolver.subjects_around() if name in known), next(iter(known), ""))
    message = f"`{signature.name}` needs somebody: `{near or 'door'}.{signature.name}`"
    hint = (
        resolver.instead(f"{near}.{ast.unparse(node)}", node, scope, "or whoever it is about")
        if near
        else None
    )
    return resolver.fail("S211", message, node, scope, hint=hint)


def subject_of(
    resolver: Resolver, subject: ast.Expr | None, signature: Signature, node: ast.Expr, scope: Scope
) -> Term | None:
    """The subject of a verb: the part before the dot, else the NPC itself. None: the candidate cell."""
    if subject is None:
        if scope.member is None:
            raise _needs_somebody(resolver, signature, node, scope)
        return entity(resolver.symbols.numbers[scope.member])
    if isinstance(subject, ast.Name) and subject.id == "here" and "here" not in scope.variables:
        if not scope.here:
            raise resolver.fail(
                "S201", "`here` is the candidate cell; it means something only in a place", subject, scope
            )
        if signature.cell and not signature.candidate:
            return Here(CELL, "cell")
        if not signature.candidate:
            raise resolver.fail("S211", f"a cell cannot be asked for `{signature.name}`", node, scope)
        return None
    if is_group(resolver, subject, scope):
        group = quoted(subject)
        letter = group[0] if group[0].isalpha() else "x"
        asked = f"{letter}.{usage(signature)}"
        hint = f"`any({letter} in {group} where {asked} ...)`, or `all`, `first`, `pick`"
        raise resolver.fail("S204", f"`{group}` is a group: say which of them", subject, scope, hint=hint)
    who = resolver.value(subject, None, scope)
    if who.type.kind == "cell" and (signature.candidate or signature.cell):
        return who
    return resolver.fit(who, ENTITY, subject, scope)


def must_be_agent(resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope) -> None:
    """Report a question that only a player can answer, asked of a member without a seat."""
    subject = None if isinstance(node, ast.Name) else node.subject
    if subject is None and scope.member == "agent":
        return
    if isinstance(subject, ast.Name) and subject.id == "agent":
        return
    name = node.id if isinstance(node, ast.Name) else node.name
    hint = "what an NPC has heard is `heard(...)`, or `hears:` in a rule" if name == "said" else None
    called = subject.id if isinstance(subject, ast.Name) else None
    if called is not None and called in resolver.symbols.scenario.cast:
        if name in OF_PLAYERS:
            hint = f"or give `{called}` a seat: `seat: open`"
        elif name == "noun" and resolver.symbols.cast[called].value("seat") is not None:
            templates = resolver.symbols.scenario.grammar.templates
            text = next((one for one in templates if "<noun>" in one), "<noun>").replace("<noun>", "<n>")
            hint = f'of `{called}` it is `first(n in nouns where {called}.said("{text}"))`'
    raise resolver.fail(
        "S211", f"`{name}` is known of the agent only: `agent.{name}`", node, scope, hint=hint
    )


OF_PLAYERS: Final = ("did", "action")
"""Words that are known of every member with a seat."""


# -- which values something can have, as far as its declaration says -----------------------------------------


_ALL_COLORS = frozenset(range(COLOR.low, COLOR.high + 1))
_DRAWN_FREELY = ("random", "distinct")


def values_of(resolver: Resolver, term: Term) -> frozenset[int] | range:
    """The values that a term can have; those of its whole type, which may be wide, where nothing more is known."""
    match term:
        case Const(value=value):
            return frozenset({value})
        case Read(path=path) if (drawn := resolver.registers.drawn_at_reset(path)) is not None:
            return values_of(resolver, drawn)
        case Quantification(op="pick" | "first" | "nearest", items=items):
            return frozenset(item.value for item in items)
        case Select(values=values, default=default):
            return _union([values_of(resolver, value) for value in (*values, default)])
        case FieldOf(entity=who, name="color"):
            return frozenset().union(*(_colors(resolver, number) for number in values_of(resolver, who)))
    return term.type.values


def _union(parts: list[frozenset[int] | range]) -> frozenset[int] | range:
    """All of some values; of a wide range not one by one."""
    if any(isinstance(part, range) and len(part) > WIDE for part in parts):
        return range(min(map(min, parts)), max(map(max, parts)) + 1)
    return frozenset().union(*parts)


def _colors(resolver: Resolver, number: int) -> frozenset[int]:
    """The colours that an object or a member of the cast can have."""
    symbols = resolver.symbols
    for objects in symbols.objects.values():
        if number not in objects.numbers:
            continue
        given = symbols.scenario.objects[objects.name].color or (
            symbols.default_colors.get(objects.type.name, "random"),
        )
        single = not resolver.findings.is_list(("objects", objects.name, "color"))
        place = 0 if single else objects.numbers.index(number)
        return _written(resolver, given[place]) if place < len(given) else _ALL_COLORS
    member = symbols.member_of(number)
    cases = symbols.cast[member].cases("color") if member is not None else ()
    return frozenset().union(*(_written(resolver, case.raw) for case in cases)) or _ALL_COLORS


def _written(resolver: Resolver, raw: object) -> frozenset[int]:
    """The colours that a `color:` can mean."""
    if not isinstance(raw, str) or raw in _DRAWN_FREELY:
        return _ALL_COLORS
    try:
        return _values_named(resolver, resolver.findings.expression((), raw))
    except ReportedError:
        return _ALL_COLORS  # which is reported where it is resolved


def _values_named(resolver: Resolver, node: ast.Expr) -> frozenset[int]:
    match node:
        case ast.Name(id=word) if word in COLOR.words:
            return frozenset({COLOR.low + COLOR.words.index(word)})
        case ast.Call(name="pick", args=(ast.Alternatives(options=options),), subject=None):
            return frozenset().union(*(_values_named(resolver, option) for option in options))
        case ast.Conditional(value=value, other=other):
            return _values_named(resolver, value) | _values_named(resolver, other)
        case ast.Call(name="permuted", args=(ast.Attribute(name="color") as colors,), subject=None):
            return _values_named(resolver, colors)
        case ast.Attribute(subject=ast.Name(id=name), name="color") if name in resolver.symbols.objects:
            numbers = resolver.symbols.objects[name].numbers
            return frozenset().union(*(_colors(resolver, number) for number in numbers))
    return _ALL_COLORS


# -- sequences and memories: what is performed, remembered, and compared element by element ------------------


@dataclass(frozen=True)
class ActSequence:
    """A sequence or a memory: acts in a row, each a move and an utterance in registers of their own."""

    path: str
    length: int
    utterances: Type
    remembered: bool

    def elements(self) -> tuple[Term, ...]:
        """Move and utterance of each act in turn."""
        return tuple(
            term
            for k in range(self.length)
            for term in (
                Read(ACTION, f"{self.path}[{k}].move"),
                Read(self.utterances, f"{self.path}[{k}].utterance"),
            )
        )


def utterance_type(resolver: Resolver) -> Type:
    """Every utterance of the grammar as a value; 0 is silence."""
    words = ("", *resolver.symbols.sentences.by_number())
    return Type("utterance", 0, len(words) - 1, words)


# -- what is declared ----------------------------------------------------------------------------------------------


def declare(resolver: Resolver, name: str, model: Sequence) -> None:
    """Make the elements of a sequence known, each drawn at a site of its own."""
    span = resolver.findings.places.key_span(("let", name))
    moves = tuple(Const(ACTION, ACTION.words.index(move)) for move in model.moves)
    for k in range(model.sequence):
        element = f"let.{name}[{k}]"
        move = moves[0] if len(moves) == 1 else Quantification(ACTION, "pick", "each", moves, None)
        resolver.registers.put(f"{element}.move", SitedTerm(move, f"{element}.move", span))
        utterance = _utterance(utterance_type(resolver), model.utterance.chance if model.utterance else 0.0)
        resolver.registers.put(f"{element}.utterance", SitedTerm(utterance, f"{element}.utterance", span))


def _utterance(type_: Type, chance: float) -> Term:
    """With some probability one of the grammar's utterances, all alike; else silence."""
    silence = Const(type_, 0)
    if not chance:
        return silence
    said = tuple(Const(type_, value) for value in range(1, type_.high + 1) if type_.words[value])
    return Select(
        type_, (Chance(chance, 0),), (Quantification(type_, "pick", "each", said, None, ordinal=1),), silence
    )


def memories(resolver: Resolver) -> Iterator[MemoryPlan]:
    """The memories of the agent's acts."""
    for name, model in resolver.symbols.scenario.memory.items():
        path = ("memory", name, "while")
        open_: SitedTerm | None = None
        with surviving():
            if model.while_ is not None:
                open_ = resolver.sited(model.while_, BOOL, step_scope(path))
            yield MemoryPlan(f"memory.{name}", model.last, utterance_type(resolver), open_)


def performs(frame: Frame) -> bool:
    """Whether who follows a frame may perform a sequence, and so say whatever the grammar can."""
    states = (frame.states or {}).values()
    doing = [step.do for _, step in frame.entries()] + [state.do for state in states]
    doing += [rule.do for state in states for rule in state.first]
    return any(do is not None and "perform" in do for do in doing)


# -- what is used --------------------------------------------------------------------------------------------------


def acts_at(resolver: Resolver, node: ast.Expr, scope: Scope) -> ActSequence | None:
    """The sequence or memory that an expression names; None if it names something else."""
    if not isinstance(node, ast.Name) or node.id in scope.variables:
        return None
    scenario, frame = resolver.symbols.scenario, scope.frame
    if frame is not None and frame.model.slots.get(node.id) == "sequence":
        return _in_slot(resolver, frame.member, node.id, frame.looked_at)
    model = scenario.let.get(node.id)
    if isinstance(model, Sequence):
        return ActSequence(f"let.{node.id}", model.sequence, utterance_type(resolver), remembered=False)
    if node.id in scenario.memory:
        length = scenario.memory[node.id].last
        return ActSequence(f"memory.{node.id}", length, utterance_type(resolver), remembered=True)
    return None


def _in_slot(resolver: Resolver, member: str, slot: str, looked_at: bool) -> ActSequence:
    """The sequence that fills a slot, the same in all cases."""
    findings, cases = resolver.findings, resolver.symbols.cast[member].filling(slot)
    if looked_at or cases is None:
        raise ReportedError  # a slot that nobody fills is reported where it is left empty
    found: list[ActSequence] = []
    for case in cases:
        node = findings.expression(case.path, case.raw)
        acts = acts_at(resolver, node, Scope(case.path, Draws(f"cast.{member}.with.{slot}"), member))
        if acts is None and resolver.is_bare(node, Scope(case.path, Draws(""), member)):
            resolver.value(node, None, Scope(case.path, Draws(""), member))
        if acts is None or acts.remembered:
            hint = "a sequence is drawn in `let`: {sequence: 3, moves: [left, right, forward]}"
            raise findings.fail(
                "S204", f"`{quoted(node)}` is not a sequence", findings.at(case.path), hint=hint
            )
        if found and acts != found[0]:
            message = f"the files of `{member}` have different sequences in `{slot}`; they must share one"
            raise findings.fail("S315", message, findings.at(case.path))
        found.append(acts)
    return found[0]


def same(resolver: Resolver, left: ActSequence, right: ActSequence, node: ast.Compare, scope: Scope) -> Term:
    """Whether two rows of acts are alike, element by element; false while a memory is not full."""
    if left.length != right.length:
        message = f"`{quoted(node.left)}` has {left.length} acts, `{quoted(node.right)}` has {right.length}"
        raise resolver.fail("S106", message, node, scope)
    full = [
        Compare("==", Read(Type("int", 0, acts.length), f"{acts.path}.filled"), number(acts.length))
        for acts in (left, right)
        if acts.remembered
    ]
    pairs = zip(left.elements(), right.elements(), strict=True)
    return all_of([*full, *(Compare("==", a, b) for a, b in pairs)])


def incomparable(resolver: Resolver, node: ast.Compare, left: bool, scope: Scope) -> ReportedError:
    """Only one side of a comparison, the left or the right one, is a sequence or memory; reports what is wrong."""
    acts, other = (node.left, node.right) if left else (node.right, node.left)
    if not is_group(resolver, other, scope):
        resolver.value(other, None, scope)  # if it has a mistake of its own, that is what is wrong
    message = f"`{quoted(acts)}` is several acts in a row, `{quoted(other)}` is not"
    return resolver.fail("S204", message, other, scope, hint="a memory is compared with a sequence")


def performed(resolver: Resolver, node: ast.Expr, scope: Scope) -> tuple[Term, ...]:
    """The elements of the sequence that `perform(...)` names."""
    acts = acts_at(resolver, node, scope)
    if acts is None and resolver.is_bare(node, scope):
        resolver.value(node, None, scope)  # a name that means nothing is what is wrong
    if acts is None or acts.remembered:
        message = f"`{quoted(node)}` is not a sequence"
        hint = "only what `let` draws as {sequence: ..., moves: ...} can be performed"
        raise resolver.fail("S204", message, node, scope, hint=hint)
    return acts.elements()


def moves_of(resolver: Resolver, elements: Iterable[Term]) -> list[str]:
    """The moves that a sequence is drawn from."""
    lets = resolver.symbols.scenario.let
    names = {part.path.partition("[")[0].removeprefix("let.") for part in elements if isinstance(part, Read)}
    drawn = [model for name, model in lets.items() if name in names and isinstance(model, Sequence)]
    return list(dict.fromkeys(move for model in drawn for move in model.moves))
