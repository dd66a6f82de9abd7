"""Words that are written like functions: of numbers, of a direction, of the step before, of a group."""

from __future__ import annotations

from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.semantics import groups
from socialai_dsl.semantics.groups import check_moment
from socialai_dsl.semantics.resolver import INT
from socialai_dsl.semantics.terms import (
    DIRECTION,
    Const,
    Heard,
    HeardNoun,
    Operation,
    SitedTerm,
    Speaker,
    Term,
    draws,
    number,
    walk,
)
from socialai_dsl.semantics.words.use import Use, Value


def _computed(use: Use) -> Term:
    """A function of numbers that the engine has an operation for."""
    args = tuple(use.value(place, INT) for place in range(len(use.args)))
    return use.resolver.computed(use.signature.name, args, use.node, use.scope)


def _opposite(use: Use) -> Term:
    way = use.value(0, DIRECTION)
    if isinstance(way, Const):
        return Const(DIRECTION, (way.value + 2) % 4)
    return Operation(DIRECTION, "turn", (way, number(2)))


def _before(use: Use) -> Term:
    """`prev(e)`: a register that takes the value of e when a step begins."""
    if use.scope.nested:
        message = "`prev` cannot stand inside any(...), pick(...) and the like; put them inside `prev`"
        raise use.fail("S211", message)
    check_moment(use.resolver, use.signature, use.node, use.scope)
    term = use.value(0, use.expected)
    if any(isinstance(part, Heard | HeardNoun | Speaker) for part in walk(term)):
        message = "what was heard is forgotten when a step ends; note it in a register of the frame"
        raise use.fail("S211", message)
    if draws(term):
        message = "`prev` asks how things were, so nothing can be drawn in it"
        raise use.fail("S211", message, hint="draw it in `let`, and use that")
    site = f"{use.scope.draws.site}.prev[{use.node.at}]"
    span = use.resolver.findings.node(use.scope.path, use.node)
    return use.resolver.registers.remember(SitedTerm(term, site, span))


def _whole_group(use: Use) -> Term:
    """Of a group without a condition: `pick(doors)`."""
    assert isinstance(use.node, ast.Call), "internal: it has an argument"
    return groups.pick(use.resolver, use.node, use.expected, use.scope)


def _needs_more(use: Use) -> Term:
    name = use.signature.name
    parts = "d in doors to agent" if name == "nearest" else "d in doors where ..."
    raise use.fail("S211", f"write `{name}({parts})`")


FUNCTIONS: Final = (
    Value("min", "none", ("int", "int"), "number", "the smaller number", meaning=_computed),
    Value("max", "none", ("int", "int"), "number", "the larger number", meaning=_computed),
    Value("abs", "none", ("int",), "number", "the number without its sign", meaning=_computed),
    Value("opposite", "none", ("direction",), "direction", "the direction turned by 180 degrees", meaning=_opposite),
    Value("prev", "none", ("any",), "the same",
          "the value of e when the step began; it finds nothing now if e found nothing then", momentary=True,
          also=("previous", "before"), meaning=_before),
)  # fmt: skip

QUANTIFIERS: Final = (
    Value("any", "none", ("group",), "condition", "c holds for at least one d: `any(d in doors where d.open)`",
          also=("exists", "some"), meaning=_needs_more),
    Value("all", "none", ("group",), "condition", "c holds for each d: `all(d in doors where d.open)`",
          also=("forall", "for_all", "every"), meaning=_needs_more),
    Value("count", "none", ("group",), "number", "the number of d for which c holds: `count(d in doors where d.open)`",
          also=("len", "number_of", "how_many"), meaning=_whole_group),
    Value("first", "none", ("group",), "one of them", "the first d for which c holds: `first(d in doors where d.open)`",
          meaning=_whole_group),
    Value("pick", "none", ("group",), "one of them",
          "one d for which c holds, drawn anew at each use: `pick(doors)`, `pick(d in doors where d.open)`, "
          "`pick(red | 2 * blue)`", also=("choice", "sample", "draw", "random", "one_of"),
          meaning=_whole_group),
    Value("nearest", "none", ("group",), "one of them",
          "the d nearest to y for which c holds, the first of equally near ones: `nearest(d in doors to "
          "agent)`", also=("closest",), meaning=_needs_more),
    Value("those", "none", ("group",), "of them",
          "in `cause` and `set`: every d for which c held before the rule's effects", meaning=_needs_more),
)  # fmt: skip
