"""The inhabitants of a scenario: numbers, names, voices, kinds, statuses, and reserved names."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as Items
from dataclasses import dataclass, field, replace

from socialai_dsl.diagnostics import advice_on, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.schema.scenario import (
    CastMember,
    Expression,
    Frame,
    ObjectGroup,
    Register,
    Scenario,
    Sequence,
)
from socialai_dsl.semantics import groups, object_facts, rows, slots, texts
from socialai_dsl.semantics.cast import AGENT, FOLLOWED, Case, Member, Version, fillings, members
from socialai_dsl.semantics.object_facts import initial
from socialai_dsl.semantics.plans import Entity
from socialai_dsl.semantics.resolve_names import slot_truth
from socialai_dsl.semantics.resolver import ANY_TEXT, ENTITY, INT, Declaration, Resolver, text_value
from socialai_dsl.semantics.scope import (
    Define,
    Draws,
    Findings,
    Objects,
    PlayedFrame,
    ReportedError,
    Scope,
    Symbols,
    dotted,
    frames_of,
    is_nothing,
    parse_define,
    quoted,
    reset_scope,
    select,
    step_scope,
    surviving,
    with_article,
)
from socialai_dsl.semantics.terms import (
    CELL,
    COLOR,
    DIRECTION,
    Const,
    ObjectType,
    Quantification,
    Read,
    SitedTerm,
    Term,
    Type,
    constants,
)
from socialai_dsl.semantics.terms import number as number_of
from socialai_dsl.semantics.words import RESERVED, VALUES
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import is_plain

_OF_LAYOUTS = frozenset({"let", "last", "heard", "pending", "memory", "member", "one_of", "state"})
"""Keys of layouts and descriptions beside the names of objects and members of the cast."""

_ATTRIBUTES = frozenset({"name", "kind", "index", "cell"})
"""What things and members of the cast have already, so that no look and no register of the world may be called so."""
_TAKEN = _ATTRIBUTES | {"frame", "clock"}
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
    _check_files(scenario, findings)
    cast = members(scenario)
    npcs = [name for name in cast if name != AGENT]
    numbers = {AGENT: 0} | {name: i for i, name in enumerate(npcs, 1)}
    objects: dict[str, Objects] = {}
    following = len(numbers)
    for name, group in scenario.objects.items():
        count = _count(group.count, group.at)
        type_ = types.get(group.type)
        if type_ is None:
            type_ = _probably(group.type, types, findings, ("objects", name, "type"))
        type_ = _own_type(type_, group)
        objects[name] = Objects(name, type_, range(following, following + (count or 1)), count is None)
        following += count or 1
    defines = _defines(scenario.define, ("define",), findings)
    _check_names(scenario, findings)
    roles = _roles(scenario, findings)
    groups: dict[str, tuple[str, ...]] = {}
    for name in cast:
        base = name.partition("[")[0]
        if base != name:
            groups[base] = (*groups.get(base, ()), name)
    symbols = Symbols(scenario, cast, numbers, roles, groups, objects, types, defines, *sizes, prelude.colors)
    return replace(symbols, slots=slots.filled(symbols, findings)) if scenario.grammar.slots else symbols


def _check_files(scenario: Scenario, findings: Findings) -> None:
    """What `one_of` draws are files of different names, at least one."""
    for name, member in scenario.cast.items():
        if member.one_of is None:
            continue
        path: DataPath = ("cast", name, "one_of")
        if not member.one_of:
            findings.error("S106", "there is nothing to draw from", findings.places.key_span(path))
        for i, file in enumerate(member.one_of):
            if file.npc in [other.npc for other in member.one_of[:i]]:
                span = findings.places.value_span((*path, i, "npc"))
                findings.error("S213", f"`{file.npc}` is the name of another of these files", span)


def _roles(scenario: Scenario, findings: Findings) -> dict[str, str]:
    """Role -> the member that plays it; reports roles that do not exist or are played twice."""
    played: dict[str, str] = {}
    for name, member in scenario.cast.items():
        role = member.role
        if role is None:
            continue
        span = findings.at(("cast", name, "role"), 0, len(role))
        if role not in scenario.roles:
            advice = advice_on(role, scenario.roles, "roles are declared under `roles:`")
            findings.no_such(role, f"unknown role `{role}`", span, **advice)
        elif name != name.partition("[")[0]:
            message = f"a role is played by one member of the cast; `{name.partition('[')[0]}` is a group"
            if name.endswith("[0]"):
                findings.error(
                    "S213", message, span, hint="give the group the `frame` and `place` of the role"
                )
        elif role in played:
            message = f"`{played[role]}` plays the role `{role}` already"
            findings.error("S213", message, span, hint="a role is played by one member of the cast")
        played.setdefault(role, name)
    return played


def _own_type(type_: ObjectType, group: ObjectGroup) -> ObjectType:
    """The type of an object that is `one_way` or `dark`."""
    if group.one_way:
        toggled = {before: after for before, after in type_.toggled.items() if before == type_.initial}
        type_ = replace(type_, toggled=toggled)
    if group.dark:
        looks = type_.shown.get(type_.initial, (type_.initial, 0))
        type_ = replace(type_, shown=dict.fromkeys(range(len(type_.states)), looks))
    return type_


def _count(count: int | None, at: Items[object] | None) -> int | None:
    """How many a group has; None for a single object."""
    if count is None and at is not None and any(isinstance(cell, tuple) for cell in at):
        return len(at)
    return count


def _probably(name: str, types: Mapping[str, ObjectType], findings: Findings, path: DataPath) -> ObjectType:
    """The type that was meant by a name that is none, which is reported."""
    advice = advice_on(name, types, "types are " + ", ".join(types))
    findings.error("S309", f"unknown object type `{name}`", findings.at(path, 0, len(name)), **advice)
    return types[advice["suggestion"]] if advice["suggestion"] else next(iter(types.values()))


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
        if (name in RESERVED and name != AGENT) or (name in _ATTRIBUTES and path[0] in ("state", "looks")):
            message = f"`{name}` is a word of the language; call the {kind} something else"
            findings.error("S213", message, span)
        elif name in _OF_LAYOUTS and path[0] in ("objects", "cast"):
            message = f"`{name}` is a key of every layout; call the {kind} something else"
            findings.error("S213", message, span)
        elif name in taken:
            article = "an" if taken[name] == "object" else "a"
            findings.error("S213", f"`{name}` is the name of {article} {taken[name]} already", span)
        taken.setdefault(name, kind)
    shared = dict.fromkeys(scenario.looks, "look") | dict.fromkeys(
        scenario.grammar.slots, "slot of the grammar"
    )
    for path, frame in frames_of(scenario):
        _check_frame_names(path, frame, shared, findings)


def mean_two_things(scenario: Scenario) -> bool:
    """Whether a name is declared twice."""
    names = [name for _, _, name in _names(scenario)]
    return len(set(names)) < len(names)


def _check_frame_names(path: DataPath, frame: Frame, shared: Mapping[str, str], findings: Findings) -> None:
    """No slot, register or definition may be called as something else; `shared`: what all frames know."""
    own: dict[str, str] = {}
    for kind, section in (("slot", frame.slots), ("register", frame.let), ("definition", frame.define)):
        for key in section:
            name = (parse_define(key) or (key, ()))[0]
            part = {"slot": "slots", "register": "let", "definition": "define"}[kind]
            span = findings.places.key_span((*path, part, key))
            if name in RESERVED or name in _TAKEN:
                findings.error(
                    "S213", f"`{name}` is a word of the language; call the {kind} something else", span
                )
            elif name in own or name in shared:
                of = f"{own[name]} of this frame" if name in own else shared[name]
                findings.error("S213", f"`{name}` is the name of a {of} already", span)
            own.setdefault(name, kind)


def _names(scenario: Scenario) -> Iterator[tuple[str, DataPath, str]]:
    for name in dict.fromkeys(name.partition("[")[0] for name in scenario.cast):
        yield "member of the cast", ("cast", name), name
    for name in scenario.objects:
        yield "object", ("objects", name), name
    for name in scenario.grammar.slots:
        yield "slot of the grammar", ("grammar", "slots", name), name
    for name in scenario.let:
        yield "`let`", ("let", name), name
    for key in scenario.define:
        yield "`define`", ("define", key), (parse_define(key) or (key, ()))[0]
    for name in scenario.memory:
        yield "memory", ("memory", name), name
    for name in scenario.state:
        yield "`state`", ("state", name), name
    for name in scenario.looks:
        yield "look", ("looks", name), name
    for name in scenario.tables:
        yield "table", ("tables", name), name
    for name in scenario.roles:
        yield "role", ("roles", name), name


# -- frames and who plays them -----------------------------------------------------------------------------------


def played_frames(symbols: Symbols, findings: Findings) -> dict[str, PlayedFrame]:
    """Member -> its frame; reports unknown frames, slots left empty, and slots that do not exist."""
    played: dict[str, PlayedFrame] = {}
    for key, member in symbols.cast.items():
        for version in member.versions:
            _check_version(symbols, findings, version, any("frame" in one for one in member.versions))
        if any("frame" in version and FOLLOWED not in version for version in member.versions):
            continue
        first, *others = member.cases(FOLLOWED)
        if others:
            _differ(findings, member, first, others[0])
        followed = next((case for case in (first, *others) if case.raw is not None), None)
        if followed is not None:
            called, path = str(followed.path[-1]), followed.path
            played[key] = played_frame(symbols, findings, key, called, followed.raw, path)
    return played


def _differ(findings: Findings, member: Member, first: Case, other: Case) -> None:
    """Report two versions of a member that follow different frames."""
    (one, _), (two, place) = (member.versions[case.numbers[0]]["npc"] for case in (first, other))
    message = f"`{two}` and `{one}` follow different frames"
    if None in (first.raw, other.raw):
        of_one, of_two = (
            f"the frame `{case.path[-1]}`" if case.raw is not None else "no frame" for case in (first, other)
        )
        message = f"`{two}` follows {of_two}, `{one}` follows {of_one}"
    message += "; the files of `one_of` must share one"
    hint = "let both extend a file with the frame, and put what differs into its slots"
    findings.error("S315", message, findings.places.value_span(place), hint=hint)


def _check_version(symbols: Symbols, findings: Findings, version: Version, framed: bool) -> None:
    """Whether a member follows a frame that there is, and fills its slots; `framed`: one of its versions has one."""
    filled = {slot: version[f"with.{slot}"].path for slot in fillings(version)}
    own = {slot: path for slot, path in filled.items() if path[0] == "cast"}
    called, place = version["npc"]
    frame = version.get("frame")
    if frame is None:
        for slot, path in own.items() if not framed else ():
            who = called if "one_of" in path else path[1]
            message = f"`{who}` follows no frame, so it has no slot `{slot}`"
            findings.error("S303", message, findings.places.key_span(path), hint="add `frame:`")
        return
    if FOLLOWED not in version:
        near = did_you_mean(frame.raw, [str(path[-1]) for path, _ in frames_of(symbols.scenario)])
        message = f"unknown frame `{frame.raw}`"
        findings.no_such(frame.raw, message, findings.at(frame.path, 0, len(frame.raw)), suggestion=near)
        return
    slots = version[FOLLOWED].raw.slots
    for slot, type_ in slots.items():
        if slot not in filled and did_you_mean(slot, [s for s in filled if s not in slots]) is None:
            message = f"frame `{frame.raw}` has a slot `{slot}` ({type_}) that `{called}` does not fill"
            hint = f"add `with: {{{slot}: ...}}`"
            findings.error("S302", message, findings.places.key_span(place), hint=hint)
    for slot, path in own.items():
        if slot not in slots:
            near = did_you_mean(slot, slots)
            has = "its slots are " + ", ".join(slots) if slots else "it has no slots"
            findings.error(
                "S303", f"frame `{frame.raw}` has no slot `{slot}`", findings.places.key_span(path),
                suggestion=near, hint=None if near else has,
            )  # fmt: skip


def played_frame(
    symbols: Symbols,
    findings: Findings,
    member: str,
    name: str,
    frame: Frame,
    path: DataPath,
    looked_at: bool = False,
) -> PlayedFrame:
    """A frame as a member plays it; slots that are not filled have no text."""
    texts = {
        slot: symbols.cast[member].filling(slot) if not looked_at else None
        for slot, type_ in frame.slots.items()
        if type_ in SUBSTITUTED
    }
    defines = _defines(frame.define, (*path, "define"), findings)
    return PlayedFrame(member, symbols.numbers[member], name, frame, path, defines, texts, looked_at)


def check_slots(resolver: Resolver) -> None:
    """Everything that fills a slot is looked at, though the frame may never use it."""
    for member, played in resolver.frames.items():
        for slot, cases in played.texts.items():
            for case in cases or ():
                scope = step_scope(case.path, f"cast.{member}.with.{slot}", member)
                with surviving():
                    if played.model.slots[slot] == "bool":
                        slot_truth(resolver, slot, case.raw, scope)
                    else:
                        texts.parts(resolver, resolver.findings.text(case.path, str(case.raw)), scope)


# -- registers ---------------------------------------------------------------------------------------------------


def declare_registers(resolver: Resolver) -> None:
    """Make every register known: what is drawn by `one_of`, lets, names, and each frame's slots and registers."""
    symbols, registers = resolver.symbols, resolver.registers
    for name, member in symbols.cast.items():
        if member.drawn is not None:
            pick = Quantification(member.drawn.type, "pick", "each", constants(member.drawn.type), None)
            span = resolver.findings.places.key_span(("cast", name, "one_of"))
            registers.put(member.drawn.path, SitedTerm(pick, f"cast.{member.drawn.path}", span))
    for name, raw in symbols.scenario.let.items():
        path: DataPath = ("let", name)
        if isinstance(raw, Sequence):
            groups.declare(resolver, name, raw)
        else:
            registers.declare(Declaration(f"let.{name}", name, path, raw, reset_scope(path)))
    for name, start in symbols.scenario.state.items():
        path = ("state", name)
        _declare_register(resolver, f"state.{name}", name, path, start, reset_scope(path))
    if symbols.scenario.looks:
        rows.declare_looks(resolver)
    object_facts.declare(resolver)
    for name in symbols.cast:
        declare_name(resolver, name)
    for played in resolver.frames.values():
        declare_frame(resolver, played)


def declare_name(resolver: Resolver, name: str) -> None:
    """The name of a member of the cast; by default its key."""
    symbols, registers, register = resolver.symbols, resolver.registers, f"{name}.name"
    default = symbols.default_name(name)
    cases = symbols.cast[name].cases("name")
    if all(case.raw is None or is_plain_name(resolver, str(case.raw)) for case in cases):
        term = select(cases, [text_value(default if case.raw is None else str(case.raw)) for case in cases])
        if isinstance(term, Const):
            registers.known(register, term)
        else:
            span = resolver.findings.places.key_span(("cast", name, "one_of"))
            registers.put(register, SitedTerm(term, f"cast.{register}", span))
        return
    raws = (f'"{default}"' if case.raw is None else str(case.raw) for case in cases)
    named = tuple(replace(case, raw=raw) for case, raw in zip(cases, raws, strict=True))
    scope = reset_scope(cases[0].path, f"cast.{register}", name)
    registers.declare(Declaration(register, register, cases[0].path, named, scope, ANY_TEXT, constant=True))


def is_plain_name(resolver: Resolver, raw: str) -> bool:
    """Whether a name is meant as it is written: words, and not something that is declared, or an attribute of it."""
    subject = re.split(r"[\s'.-]", raw.strip(" '.-"), maxsplit=1)[0]
    return is_plain(raw) and not (" " not in raw.strip() and subject in resolver.symbols.declared)


def declare_frame(resolver: Resolver, played: PlayedFrame) -> None:
    """Slots that are registers, and the frame's `let`."""
    for slot, kind in played.model.slots.items():
        if kind not in SUBSTITUTED and kind != "sequence" and not played.looked_at:
            _declare_slot(resolver, played.member, slot, kind)
    for name, raw in played.model.let.items():
        path = (*played.path, "let", name)
        site = f"{played.member}/{dotted((*played.address, 'let', name))}"
        framed = Scope(path, Draws(site), played.member, played, at_reset=True)
        _declare_register(resolver, played.register(name), name, path, raw, framed, imagined=played.looked_at)


def _declare_register(
    resolver: Resolver,
    register: str,
    name: str,
    path: DataPath,
    raw: Expression | Register,
    scope: Scope,
    imagined: bool = False,
) -> None:
    """A register with its start value, or one for each of a group, and its range if that is given."""
    if not isinstance(raw, Register):
        resolver.registers.declare(Declaration(register, name, path, raw, scope, imagined=imagined))
        return
    given: Type | None = None
    keys: tuple[Const, ...] = ()
    with surviving():
        given = _range(resolver, (*path, "range"), raw.range) if raw.range is not None else None
    if raw.for_ is not None:
        try:
            keys = rows.keys(resolver, (*path, "for"), raw.for_)
        except ReportedError:
            return
    start = (*path, "start")
    scope = scope.at(start, scope.draws.site)
    declared = Declaration(register, name, start, raw.start, scope, range=given, imagined=imagined)
    nothing = is_nothing(raw.start)
    resolver.registers.declare(replace(declared, for_each=keys, starts_with_nothing=nothing))


def _range(resolver: Resolver, path: DataPath, raw: Expression) -> Type:
    """`a..b` as a type."""
    node = resolver.findings.expression(path, raw)
    if isinstance(node, ast.Interval):
        scope = reset_scope(path)
        low, high = (resolver.value(end, INT, scope) for end in (node.low, node.high))
        if isinstance(low, Const) and isinstance(high, Const) and low.value <= high.value:
            return Type("int", low.value, high.value)
        if isinstance(low, Const) and isinstance(high, Const):
            ordered = f"{high.value}..{low.value}"
            hint = resolver.instead(ordered, node, scope, "from the least to the greatest number")
            message = f"`{quoted(node)}` is empty: it ends below its start"
            raise resolver.fail("S204", message, node, scope, hint=hint)
    message = "a range is written a..b, from the least to the greatest number"
    raise resolver.findings.fail("S204", message, resolver.findings.at(path))


def _declare_slot(resolver: Resolver, member: str, slot: str, kind: str) -> None:
    cases = resolver.symbols.cast[member].filling(slot)
    if cases is None:
        return
    types = {
        "object": ENTITY,
        "npc": ENTITY,
        "direction": DIRECTION,
        "color": COLOR,
        "int": INT,
        "noun": resolver.symbols.nouns,
        "cell": CELL,
    }
    path = cases[0].path
    scope = reset_scope(path, f"cast.{member}.with.{slot}", member)
    resolver.registers.declare(Declaration(f"{member}.{slot}", slot, path, cases, scope, types[kind]))


# -- the list of entities ------------------------------------------------------------------------------------


VIEW = 7
"""Side of the view square where none is given."""

_WITH_CASES = frozenset({"name", "kind", "kind_code", "color", "place", "at", "facing", "frame"})
"""Keys whose value may depend on what is drawn; `frame` is compared as what it names."""


def entities_of(resolver: Resolver) -> Iterator[Entity]:
    """The agent, the NPCs in cast order, the objects in file order."""
    symbols = resolver.symbols
    kinds: list[str] = []
    shown = [name for name in symbols.cast if name != AGENT]
    if any(symbols.cast[name].value("seat") for name in shown):
        shown.append(AGENT)  # others see it
    codes_of = {name: [_code(version, kinds) for version in symbols.cast[name].versions] for name in shown}
    for name in (AGENT, *(n for n in symbols.cast if n != AGENT)):
        member, npc = symbols.cast[name], name != AGENT
        codes = codes_of.get(name, [])
        with surviving():
            _check_shared(resolver, member)
            near, far = _voice(resolver, member)
            number = symbols.numbers[name]
            group = symbols.group_of(name)
            yield Entity(
                number=number,
                key=name if group is None else group[0],
                index=None if group is None else group[1],
                role="npc" if npc else "agent",
                span=resolver.findings.places.key_span(("cast", name)),
                kind=" or ".join(case.raw or "peer" for case in member.cases("kind")) if npc else "",
                kind_code=max(codes, default=0),
                kind_drawn=select(member.each("kind"), [number_of(code) for code in codes])
                if len(set(codes)) > 1
                else None,
                name=resolver.registers.read(f"{name}.name"),
                near=near,
                far=far,
                audible=member.value("audible") == "always",
                pushed_by_bodies=member.value("pushed_by") is not None,
                tone=rows.tone_of(resolver, number) if symbols.scenario.observe.tone and number else None,
                view=member.value("view") or VIEW,
            )
    statuses = initial(resolver)
    for objects in symbols.objects.values():
        yield from _objects(resolver, objects, statuses)


def _code(version: Version, kinds: list[str]) -> int:
    """The status code in the picture: the place of its kind in order of first appearance, if none is given."""
    kind = version["kind"].raw if "kind" in version else "peer"
    if kind not in kinds:
        kinds.append(kind)
    return version["kind_code"].raw if "kind_code" in version else kinds.index(kind)


def _check_shared(resolver: Resolver, member: Member) -> None:
    """What all that a member can be must have in common: each key of which the language has no cases."""
    for key in CastMember.model_fields.keys() - _WITH_CASES:
        for other in member.cases(key)[1:]:
            message = f"the files of `one_of` must have the same `{key}`"
            span = resolver.findings.places.key_span(other.path)
            resolver.findings.error("S315", message, span, hint=f"give `{key}` beside `one_of`")


def _objects(
    resolver: Resolver,
    objects: Objects,
    statuses: Mapping[int, int | Read],
) -> Iterator[Entity]:
    described = resolver.symbols.scenario.objects[objects.name]
    holding, rolled = object_facts.contained(resolver), _pushed_by_rolling(resolver, objects)
    _check_timer(resolver, objects)
    _check_exclusive(resolver, objects)
    for index, number in enumerate(objects.numbers):
        status = statuses.get(number, objects.type.initial)
        yield Entity(
            number=number,
            key=objects.name,
            index=None if objects.single else index,
            role="object",
            span=resolver.findings.places.key_span(("objects", objects.name)),
            type=objects.type,
            status=status if isinstance(status, int) else objects.type.initial,
            initial=None if isinstance(status, int) else status,
            unlocks=object_facts.links(resolver, object_facts.UNLOCKS).get(number, ()),
            opens=object_facts.links(resolver, object_facts.OPENS).get(number, ()),
            timer=described.timer or 0,
            exclusive=tuple(objects.numbers) if described.exclusive else (),
            pushed_by_rolling=rolled,
            carryable=described.carryable,
            contains=holding.get(number, ()),
        )


def _pushed_by_rolling(resolver: Resolver, objects: Objects) -> bool:
    """Whether only something that rolls can push an object: `pushed_by: marble`."""
    pusher = resolver.symbols.scenario.objects[objects.name].pushed_by
    if pusher is None:
        return False
    path: DataPath = ("objects", objects.name, "pushed_by")
    findings, types = resolver.findings, resolver.symbols.types
    span = findings.at(path, 0, len(pusher))
    if not objects.type.pushed:
        findings.error(
            "S204", f"{with_article(objects.type.name)} cannot be pushed", findings.places.key_span(path)
        )
    elif pusher not in types or not types[pusher].rolls:
        rolling = [name for name, type_ in types.items() if type_.rolls]
        message = f"`{pusher}` does not roll, so it pushes nothing"
        advice = advice_on(pusher, rolling, "what rolls: " + ", ".join(rolling))
        findings.error("S204", message, span, **advice)
    return True


def _check_timer(resolver: Resolver, objects: Objects) -> None:
    described = resolver.symbols.scenario.objects[objects.name]
    if described.timer is not None and not objects.type.expired:
        able = [name for name, type_ in resolver.symbols.types.items() if type_.expired]
        span = resolver.findings.places.key_span(("objects", objects.name, "timer"))
        message = f"a timer ends no status of {with_article(objects.type.name)}"
        resolver.findings.error("S204", message, span, hint="what has one that ends: " + ", ".join(able))


def _check_exclusive(resolver: Resolver, objects: Objects) -> None:
    if objects.single and resolver.symbols.scenario.objects[objects.name].exclusive:
        span = resolver.findings.places.key_span(("objects", objects.name, "exclusive"))
        message = "`exclusive` is for a group, of which one is used: give `count`"
        resolver.findings.error("S204", message, span)


def _voice(resolver: Resolver, member: Member) -> tuple[int, int]:
    """Least and greatest Manhattan distance at which a voice is heard."""
    symbols, (own, *_) = resolver.symbols, member.cases("earshot")
    raw, path = (own.raw, own.path) if own.raw is not None else (symbols.scenario.earshot, ("earshot",))
    if raw == "next_to":
        return 1, 1
    if raw == "room":
        return 0, symbols.width[1] + symbols.height[1]
    findings = resolver.findings
    message = "`earshot` is next_to, room, or a known number of cells"
    if isinstance(raw, str) and raw.isidentifier() and raw in VALUES:  # `all`, say
        findings.error("S204", message, findings.places.value_span(path))
        return 1, 1
    with surviving():
        term: Term = resolver.written(raw, INT, reset_scope(path))
        if isinstance(term, Const) and term.value >= 0:
            return 0, term.value
        findings.error("S204", message, findings.at(path))
    return 1, 1
