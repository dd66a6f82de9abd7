"""Seats: which members of the cast players outside of the file can play, and what each of them is paid."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from socialai_dsl import cures
from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.semantics.cast import AGENT
from socialai_dsl.semantics.resolver import Resolver
from socialai_dsl.semantics.scope import Findings, Scope, Symbols, surviving
from socialai_dsl.semantics.terms import Const, entity
from socialai_dsl.source import DataPath
from socialai_dsl.widths import MOST_SEATS

_OPEN = "open"


def seated(symbols: Symbols) -> tuple[str, ...]:
    """The members of the cast with a seat: the agent, then the others in the order written."""
    return (AGENT, *(name for name in symbols.scenario.cast if name != AGENT and _has_seat(symbols, name)))


def _has_seat(symbols: Symbols, name: str) -> bool:
    return bool(symbols.cast[name].value("seat") == _OPEN)


def player_before_the_dot(
    resolver: Resolver, node: ast.Call | ast.Attribute | ast.Name, scope: Scope
) -> Const | None:
    """The member with a seat, other than the agent, that stands before the dot or whose frame it is; None: none."""
    if isinstance(node, ast.Name):
        name = scope.member
    else:
        subject = node.subject
        name = scope.member if subject is None else subject.id if isinstance(subject, ast.Name) else None
        name = scope.member if name == "self" else name
    name = resolver.symbols.roles.get(name, name) if name is not None else None
    others = seated(resolver.symbols)[1:]
    return entity(resolver.symbols.numbers[name]) if name in others else None


def check_seats(symbols: Symbols, findings: Findings) -> None:
    """Report a seat that is none, more seats than there can be, and what several seats cannot have yet."""
    scenario, places = symbols.scenario, findings.places
    own: DataPath = ("cast", AGENT, "seat")
    if _has_seat(symbols, AGENT):
        hint = cures.propose("delete it", cures.deleted(places, own))
        findings.error("S107", "the agent always has a seat", places.key_span(own), hint=hint)
    others = seated(symbols)[1:]
    if len(others) >= MOST_SEATS:
        span = places.key_span(("cast", others[MOST_SEATS - 1], "seat"))
        message = f"a scenario has at most {MOST_SEATS} seats, this one {1 + len(others)}"
        findings.error("S106", message, span)
    if not others:
        if scenario.observe.seats == "hidden":
            message = "the agent alone has a seat, so there is nothing to hide"
            hint = cures.propose("delete it", cures.deleted(places, ("observe", "seats")))
            findings.warning("W317", message, places.key_span(("observe", "seats")), hint=hint)
        return
    for is_there, path, what in (
        (scenario.grammar.to is not None, ("grammar", "to"), "`grammar.to`"),
        (not scenario.overheard, ("overheard",), "`overheard: false`"),
    ):
        if is_there:
            message = f"{what} says whom an utterance addresses, which is known with one seat only"
            hint = cures.propose(
                "delete it", cures.deleted(places, path), also="or leave the other seats out"
            )
            findings.error("S107", message, places.key_span(path), hint=hint)


def numbered(
    symbols: Symbols, findings: Findings, written: Mapping[DataPath, str]
) -> Iterator[tuple[DataPath, int]]:
    """The seats of members that are named at some places, by number from 0 on; those of a group one by one."""
    seats = seated(symbols)
    for path, name in written.items():
        with surviving():
            members = symbols.groups.get(name, (name,))
            if not set(members) <= set(seats):
                raise _no_seat(symbols, findings, path, name)
            yield from ((path, seats.index(member)) for member in members)


def rewards(symbols: Symbols, findings: Findings, raw: int | Mapping[str, int], path: DataPath) -> list[int]:
    """What a rule pays each seat, in per cent: the same to all, or by member, and nothing to those left out."""
    count = len(seated(symbols))
    if not isinstance(raw, Mapping):
        return [raw] * count
    found = [0] * count
    for place, seat in numbered(symbols, findings, {(*path, name): name for name in raw}):
        found[seat] = raw[str(place[-1])]
    return found


def _no_seat(symbols: Symbols, findings: Findings, path: DataPath, name: str) -> Exception:
    """What to raise where a member is named that has no seat, once it is reported."""
    seats, places = seated(symbols), findings.places
    known = (*symbols.scenario.cast, *symbols.groups)
    span = places.key_span(path) if path[-1] == name else findings.at(path, width=len(name))
    if name not in known:
        near = did_you_mean(name, [*seats, *symbols.groups])
        return findings.no_such(name, f"`{name}` is no member of the cast", span, suggestion=near)
    edit = cures.added(places, ("cast", name), "seat: open") if name in symbols.scenario.cast else None
    hint = cures.propose("give it one: `seat: open`", edit)
    return findings.fail("S204", f"`{name}` has no seat", span, hint=hint)
