"""The inhabitants of a scenario: numbers, names, voices, and the names nobody may take twice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from socialai_dsl.diagnostics import did_you_mean
from socialai_dsl.schema import CastMember, Scenario
from socialai_dsl.schema.positions import DataPath
from socialai_dsl.semantics.findings import Findings, dotted, surviving
from socialai_dsl.semantics.registers import Declaration
from socialai_dsl.semantics.resolve_names import slot_truth
from socialai_dsl.semantics.scope import (
    Define,
    Objects,
    PlayedFrame,
    Scope,
    Symbols,
    at_every_step,
    parse_define,
    reset_scope,
)
from socialai_dsl.semantics.signatures import WORDS
from socialai_dsl.semantics.terms import COLOR, DIRECTION, Const, ObjectType, Type

if TYPE_CHECKING:
    from socialai_dsl.semantics.resolve import Resolver

AGENT = "agent"

_TAKEN = frozenset({"name", "kind", "index", "cell", "frame", "clock"})
"""What a member of the cast has already, so that no slot or register of its frame may be called so."""


@dataclass(frozen=True)
class Prelude:
    """The object types that every scenario can use, and the colours they have where none is given."""

    types: Mapping[str, ObjectType]
    colors: Mapping[str, str] = field(default_factory=dict)


SUBSTITUTED = ("text", "utterance", "bool")
"""Types of slots that are put in wherever they are used; all others are registers."""


def symbols_of(
    scenario: Scenario,
    prelude: Prelude,
    sizes: tuple[tuple[int, int], tuple[int, int]],
    findings: Findings,
) -> Symbols:
    """The symbol table; reports names that are taken, unknown object types, and definitions of no form."""
    types = prelude.types
    cast = scenario.members()
    npcs = [name for name in cast if name != AGENT]
    numbers = {AGENT: 0} | {name: i for i, name in enumerate(npcs, 1)}
    objects: dict[str, Objects] = {}
    following = len(numbers)
    for name, group in scenario.objects.items():
        count = _count(group.count, group.at)
        type_ = types.get(group.type)
        if type_ is None:
            _unknown_type(group.type, types, findings, ("objects", name, "type"))
            type_ = next(iter(types.values()))
        objects[name] = Objects(name, type_, range(following, following + (count or 1)), count is None)
        following += count or 1
    defines = _defines(scenario.define, ("define",), findings)
    _check_names(scenario, findings)
    return Symbols(scenario, cast, numbers, objects, types, defines, *sizes, prelude.colors)


def _count(count: int | None, at: Sequence[object] | None) -> int | None:
    """How many a group has; None for a single object."""
    if count is None and at is not None and any(isinstance(cell, tuple) for cell in at):
        return len(at)
    return count


def _unknown_type(name: str, types: Mapping[str, ObjectType], findings: Findings, path: DataPath) -> None:
    near = did_you_mean(name, types)
    hint = None if near else "types are " + ", ".join(types)
    findings.error(
        "S309", f"unknown object type `{name}`", findings.at(path, 0, len(name)), suggestion=near, hint=hint
    )


def _defines(written: Mapping[str, object], path: DataPath, findings: Findings) -> dict[str, Define]:
    defines: dict[str, Define] = {}
    for key, raw in written.items():
        parsed = parse_define(key)
        if parsed is None:
            message = f"`{key}` is neither a name nor name(a, b)"
            findings.error("S210", message, findings.places.key_span((*path, key)))
            continue
        name, parameters = parsed
        defines[name] = Define(name, parameters, raw, (*path, key))  # type: ignore[arg-type]
    return defines


def _check_names(scenario: Scenario, findings: Findings) -> None:
    """No name may mean two things."""
    taken: dict[str, str] = {}
    for kind, path, name in _names(scenario):
        span = findings.places.key_span(path)
        if name in WORDS and name != AGENT:
            message = f"`{name}` is a word of the language; call the {kind} something else"
            findings.error("S213", message, span)
        elif name in taken:
            findings.error("S213", f"`{name}` is the name of a {taken[name]} already", span)
        taken.setdefault(name, kind)
    for frame_name, frame in scenario.frames.items():
        own: dict[str, str] = {}
        for kind, section in (("slot", frame.slots), ("register", frame.let), ("definition", frame.define)):
            for key in section:
                name = (parse_define(key) or (key, ()))[0]
                part = {"slot": "slots", "register": "let", "definition": "define"}[kind]
                span = findings.places.key_span(("frames", frame_name, part, key))
                if name in WORDS or name in _TAKEN:
                    findings.error(
                        "S213", f"`{name}` is a word of the language; call the {kind} something else", span
                    )
                elif name in own:
                    findings.error(
                        "S213", f"`{name}` is the name of a {own[name]} of this frame already", span
                    )
                own.setdefault(name, kind)


def _names(scenario: Scenario) -> Iterator[tuple[str, DataPath, str]]:
    for name in scenario.cast:
        yield "member of the cast", ("cast", name), name
    for name in scenario.objects:
        yield "object", ("objects", name), name
    for name in scenario.let:
        yield "`let`", ("let", name), name
    for key in scenario.define:
        yield "`define`", ("define", key), (parse_define(key) or (key, ()))[0]


# -- frames and who plays them -----------------------------------------------------------------------------------


def played_frames(symbols: Symbols, findings: Findings) -> dict[str, PlayedFrame]:
    """Member -> its frame; reports unknown frames, slots left empty, and slots that do not exist."""
    played: dict[str, PlayedFrame] = {}
    for name, member in symbols.cast.items():
        if member.frame is None:
            if member.with_:
                _check_no_slots(name, member, symbols, findings)
            continue
        frame = symbols.scenario.frames.get(member.frame)
        if frame is None:
            path = symbols.member_path(name, "frame")
            near = did_you_mean(member.frame, symbols.scenario.frames)
            span = findings.at(path, 0, len(member.frame))
            findings.error("S201", f"unknown frame `{member.frame}`", span, suggestion=near)
            continue
        _check_slots(name, member, symbols, findings)
        played[name] = played_frame(symbols, findings, name, member.frame, member.with_)
    return played


def played_frame(
    symbols: Symbols,
    findings: Findings,
    member: str,
    frame_name: str,
    filled: Mapping[str, object],
    looked_at: bool = False,
) -> PlayedFrame:
    """A frame as a member plays it; slots that are not `filled` have no text."""
    frame = symbols.scenario.frames[frame_name]
    texts = {
        slot: symbols.with_path(member, slot) if slot in filled else None
        for slot, type_ in frame.slots.items()
        if type_ in SUBSTITUTED
    }
    defines = _defines(frame.define, ("frames", frame_name, "define"), findings)
    return PlayedFrame(member, symbols.numbers[member], frame_name, frame, defines, texts, looked_at)


def check_slots(resolver: Resolver) -> None:
    """Everything that fills a slot is looked at, though the frame may never use it."""
    for member, played in resolver.frames.items():
        filled = resolver.symbols.cast[member].with_
        for slot, path in played.texts.items():
            if path is None:
                continue
            scope = at_every_step(reset_scope(path, f"cast.{member}.with.{slot}", member))
            with surviving():
                if played.model.slots[slot] == "bool":
                    slot_truth(resolver, member, slot, scope)
                else:
                    resolver.utterances.parts(resolver.findings.text(path, str(filled[slot])), scope)


def _check_no_slots(name: str, member: CastMember, symbols: Symbols, findings: Findings) -> None:
    own = symbols.scenario.cast[name].with_
    for slot in own:
        findings.error(
            "S303", f"`{name}` follows no frame, so it has no slot `{slot}`",
            findings.places.key_span(("cast", name, "with", slot)), hint="add `frame:`",
        )  # fmt: skip


def _check_slots(name: str, member: CastMember, symbols: Symbols, findings: Findings) -> None:
    assert member.frame is not None, "internal: only for members with a frame"
    slots = symbols.scenario.frames[member.frame].slots
    for slot, type_ in slots.items():
        if (
            slot not in member.with_
            and did_you_mean(slot, [s for s in member.with_ if s not in slots]) is None
        ):
            findings.error(
                "S302", f"frame `{member.frame}` has a slot `{slot}` ({type_}) that `{name}` does not fill",
                findings.places.key_span(("cast", name)), hint=f"add `with: {{{slot}: ...}}`",
            )  # fmt: skip
    for slot in member.with_:
        path = symbols.with_path(name, slot)
        if slot not in slots and path[0] == "cast":
            near = did_you_mean(slot, slots)
            has = "its slots are " + ", ".join(slots) if slots else "it has no slots"
            findings.error(
                "S303", f"frame `{member.frame}` has no slot `{slot}`", findings.places.key_span(path),
                suggestion=near, hint=None if near else has,
            )  # fmt: skip


# -- registers ---------------------------------------------------------------------------------------------------


def declare_registers(resolver: Resolver) -> None:
    """Make every register known: lets, names, and each frame's slots and registers."""
    symbols, registers = resolver.symbols, resolver.registers
    for name, raw in symbols.scenario.let.items():
        path: DataPath = ("let", name)
        registers.declare(Declaration(f"let.{name}", name, path, raw, reset_scope(path)))
    for name, member in symbols.cast.items():
        declare_name(resolver, name, member)
    for played in resolver.frames.values():
        declare_frame(resolver, played)


def declare_name(resolver: Resolver, name: str, member: CastMember) -> None:
    """The name of a member of the cast; by default its key."""
    path = resolver.symbols.member_path(name, "name")
    raw = member.name if member.name is not None else name[:1].upper() + name[1:].replace("_", " ")
    scope = reset_scope(path, f"cast.{name}.name", name)
    text = Type("text", 0, -1)
    if member.name is None or (isinstance(raw, str) and is_plain_name(resolver, raw)):
        known = Const(Type("text", 0, 0, (str(raw),)), 0)
        resolver.registers.known(f"{name}.name", known)
        return
    raw = str(raw) if isinstance(raw, int) else raw
    resolver.registers.declare(
        Declaration(f"{name}.name", f"{name}.name", path, raw, scope, text, constant=True)
    )


def is_plain_name(resolver: Resolver, raw: str) -> bool:
    """Whether a name is meant as it is written: words, none of which is declared."""
    words = raw.replace("'", " ").replace("-", " ").replace(".", " ").split()
    plain = bool(words) and all(word.isalnum() for word in words)
    return plain and not (len(words) == 1 and raw in resolver.symbols.declared())


def declare_frame(resolver: Resolver, played: PlayedFrame) -> None:
    """Slots that are registers, and the frame's `let`."""
    symbols, member = resolver.symbols, played.member
    nouns = symbols.nouns
    entity, number = Type("entity", 0, 0), Type("int", 0, 0)
    types = {
        "object": entity,
        "npc": entity,
        "direction": DIRECTION,
        "color": COLOR,
        "int": number,
        "noun": nouns,
    }
    for slot, kind in played.model.slots.items():
        if kind in SUBSTITUTED or played.looked_at or slot not in symbols.cast[member].with_:
            continue
        path = symbols.with_path(member, slot)
        scope = reset_scope(path, f"cast.{member}.with.{slot}", member)
        raw = symbols.cast[member].with_[slot]
        resolver.registers.declare(Declaration(f"{member}.{slot}", slot, path, raw, scope, types[kind]))
    for name, raw in played.model.let.items():
        path = (*played.path, "let", name)
        scope = reset_scope(path, f"{member}/{dotted(path)}", member)
        framed = Scope(path, scope.draws, member, played, at_reset=True)
        register = played.register(name)
        resolver.registers.declare(Declaration(register, name, path, raw, framed, imagined=played.looked_at))
