"""Sequences and memories: what is performed, remembered, and compared element by element."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from socialai_dsl.grammar import ast
from socialai_dsl.schema import Frame, Sequence
from socialai_dsl.semantics import resolve_groups
from socialai_dsl.semantics.build import all_of, number
from socialai_dsl.semantics.findings import FailedError, surviving
from socialai_dsl.semantics.plans import MemoryPlan
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Draws, Scope, at_every_step, reset_scope
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    Chance,
    Compare,
    Const,
    Quantified,
    Read,
    Select,
    Sited,
    Term,
    Type,
)
from socialai_dsl.semantics.wording import quoted


@dataclass(frozen=True)
class Acts:
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
    words = ("", *resolver.utterances.all_texts())
    return Type("utterance", 0, len(words) - 1, words)


# -- what is declared ----------------------------------------------------------------------------------------------


def declare(resolver: Resolver, name: str, model: Sequence) -> None:
    """Make the elements of a sequence known, each drawn at a site of its own."""
    span = resolver.findings.places.key_span(("let", name))
    moves = tuple(Const(ACTION, ACTION.words.index(move)) for move in model.moves)
    for k in range(model.sequence):
        element = f"let.{name}[{k}]"
        move = moves[0] if len(moves) == 1 else Quantified(ACTION, "pick", "each", moves, None)
        resolver.registers.put(f"{element}.move", Sited(move, f"{element}.move", span))
        utterance = _utterance(utterance_type(resolver), model.utterance.chance if model.utterance else 0.0)
        resolver.registers.put(f"{element}.utterance", Sited(utterance, f"{element}.utterance", span))


def _utterance(type_: Type, chance: float) -> Term:
    """With some probability one of the grammar's utterances, all alike; else silence."""
    silence = Const(type_, 0)
    if not chance:
        return silence
    said = tuple(Const(type_, value) for value in range(1, type_.high + 1))
    return Select(
        type_, (Chance(chance, 0),), (Quantified(type_, "pick", "each", said, None, ordinal=1),), silence
    )


def memories(resolver: Resolver) -> Iterator[MemoryPlan]:
    """What is remembered of the agent's acts."""
    for name, model in resolver.symbols.scenario.memory.items():
        path = ("memory", name, "while")
        open_: Sited | None = None
        with surviving():
            if model.while_ is not None:
                scope = at_every_step(reset_scope(path))
                term = resolver.written(path, model.while_, BOOL, scope)
                open_ = Sited(term, scope.draws.site, resolver.findings.at(path))
            yield MemoryPlan(f"memory.{name}", model.last, utterance_type(resolver), open_)


def performs(frame: Frame) -> bool:
    """Whether who follows a frame may perform a sequence, and so say whatever the grammar can."""
    states = (frame.states or {}).values()
    doing = [step.do for step in frame.steps or ()] + [state.do for state in states]
    doing += [rule.do for state in states for rule in state.first]
    return any(do is not None and "perform" in do for do in doing)


# -- what is used --------------------------------------------------------------------------------------------------


def acts_at(resolver: Resolver, node: ast.Expr, scope: Scope) -> Acts | None:
    """The sequence or memory that an expression names; None if it names something else."""
    if not isinstance(node, ast.Name) or node.id in scope.variables:
        return None
    scenario, frame = resolver.symbols.scenario, scope.frame
    if frame is not None and frame.model.slots.get(node.id) == "sequence":
        return _in_slot(resolver, frame.member, node.id, frame.looked_at)
    model = scenario.let.get(node.id)
    if isinstance(model, Sequence):
        return Acts(f"let.{node.id}", model.sequence, utterance_type(resolver), remembered=False)
    if node.id in scenario.memory:
        length = scenario.memory[node.id].last
        return Acts(f"memory.{node.id}", length, utterance_type(resolver), remembered=True)
    return None


def _in_slot(resolver: Resolver, member: str, slot: str, looked_at: bool) -> Acts:
    """The sequence that fills a slot, the same in every file of a `one_of`."""
    symbols, findings = resolver.symbols, resolver.findings
    alternatives = symbols.alternatives[member]
    if looked_at or not all(slot in alternative.with_ for alternative in alternatives):
        raise FailedError  # a slot that nobody fills is reported where it is left empty
    found: list[Acts] = []
    for which, alternative in enumerate(alternatives):
        path = symbols.with_path(member, slot, which)
        node = findings.expression(path, alternative.with_[slot])
        acts = acts_at(resolver, node, Scope(path, Draws(f"cast.{member}.with.{slot}"), member))
        if acts is None and resolver.is_bare(node, Scope(path, Draws(""), member)):
            resolver.value(node, None, Scope(path, Draws(""), member))
        if acts is None or acts.remembered:
            hint = "a sequence is drawn in `let`: {sequence: 3, moves: [left, right, forward]}"
            raise findings.fail("S204", f"`{quoted(node)}` is not a sequence", findings.at(path), hint=hint)
        if found and acts != found[0]:
            message = f"the files of `{member}` have different sequences in `{slot}`; they must share one"
            raise findings.fail("S315", message, findings.at(path))
        found.append(acts)
    return found[0]


def same(resolver: Resolver, left: Acts, right: Acts, node: ast.Compare, scope: Scope) -> Term:
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


def incomparable(resolver: Resolver, node: ast.Compare, left: bool, scope: Scope) -> FailedError:
    """Only one side of a comparison, the left or the right one, is a sequence or memory; reports what is wrong."""
    acts, other = (node.left, node.right) if left else (node.right, node.left)
    if not resolve_groups.is_group(resolver, other, scope):
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
