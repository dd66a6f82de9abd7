"""Effects to code, and what follows: what is remembered, put off and put back, links and timers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Set
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import chain
from typing import Generic, TypeAlias, TypeVar

from socialai_dsl.compiler.assembler import (
    NOWHERE,
    Block,
    Label,
    Registers,
    entity_register,
    found_path,
    label,
    said_path,
    seat_path,
)
from socialai_dsl.compiler.cells import ROW
from socialai_dsl.compiler.expressions import Expressions, Lines
from socialai_dsl.compiler.folding import FALSE, fold_whole
from socialai_dsl.compiler.hands import back_into_hands, move_into, out_of_hands
from socialai_dsl.compiler.rows import row, row_of
from socialai_dsl.compiler.those import Choice, MemberSelection, sizes
from socialai_dsl.program import CELL, Field, Op, Register, SeatRegister, constant
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.changes import Mobility
from socialai_dsl.semantics.plans import (
    Assignment,
    CheckedScenario,
    Drawn,
    Effect,
    Entity,
    FramePlan,
    RulePlan,
    StepPlan,
)
from socialai_dsl.semantics.terms import BOOL, Const, ObjectType, SitedTerm, Term, Type, numbers_of
from socialai_dsl.semantics.words import EFFECTS
from socialai_dsl.widths import LARGEST_NUMBER

# -- what the effect `reset` puts back -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Home:
    """Registers that hold how a thing was at first: its cell and its fields, without what cannot change."""

    cell: int | None
    fields: dict[Field, int]


class Homes:
    """Makes room for what a `reset` may put back: `NAME.reset.home`, the cell, then the fields of a `Home`."""

    def __init__(self, checked: CheckedScenario, registers: Registers) -> None:
        self.checked = checked
        mobility = Mobility(checked)
        self.pointing = mobility.pointing
        self.of = {
            number: _reserve(checked.entities[number], mobility, registers, len(checked.entities))
            for number in sorted(set(_named(checked)))
        }

    def save(self, to: Expressions) -> None:
        """Emit, at the end of a reset, that everything is remembered as it is."""
        block = to.block
        for number, home in self.of.items():
            if home.cell is not None:
                _save_cell(block, number, home.cell)
            for field, register in home.fields.items():
                block.emit(Op.LOAD, register, entity_register(number, field))

    def is_fixed(self, thing: Entity) -> bool:
        """Whether nothing but its status can change."""
        points = thing.role == "npc" and self.pointing
        return self.of[thing.number] == Home(None, {}) and not thing.contains and not points

    def put_back(self, to: Expressions, number: int) -> None:
        """Emit that a thing is where and as it was, and what lay in it lies in it again; its status is left alone."""
        block, thing, home = to.block, self.checked.entities[number], self.of[number]
        own = constant(number)
        if home.cell is not None:
            block.emit(Op.PLACE, own, home.cell)
        if Field.GONE in home.fields:
            with block.when(Op.IF_NE, home.fields[Field.GONE], constant(0)):
                block.emit(Op.VANISH, own)
        for field in (Field.DIR, Field.INSIDE):
            if field in home.fields:
                block.emit(Op.SET_FIELD, own, field, home.fields[field])
        if Field.CARRIER in home.fields:
            back_into_hands(to, number, home.fields[Field.CARRIER])
        if thing.role == "npc" and self.pointing:
            block.emit(Op.SET_FIELD, own, Field.POINTING, constant(0))
        for content in thing.contains:
            self._put_back_into(block, content, number)

    def _put_back_into(self, block: Block, number: int, holder: int) -> None:
        """What lay in a thing at first lies in it again."""
        home = self.of[number]
        assert home.cell is not None, "internal: contents can move"
        assert {Field.GONE, Field.INSIDE} <= home.fields.keys(), (
            "internal: contents vanish and lie in something"
        )
        elsewhere = Label()
        block.test(Op.IF_NE, home.fields[Field.GONE], constant(0), elsewhere)
        block.test(Op.IF_EQ, home.fields[Field.INSIDE], constant(holder), elsewhere)
        block.emit(Op.PLACE, constant(number), home.cell)
        block.emit(Op.VANISH, constant(number))
        block.emit(Op.SET_FIELD, constant(number), Field.INSIDE, constant(holder))
        block.bind(elsewhere)


def _named(checked: CheckedScenario) -> Iterator[int]:
    """What a `reset` names, and what may lie in that."""
    for plan in checked.causing:
        for effect in plan.causes:
            if effect.name == "reset":
                for target in effect.entities:
                    for number in numbers_of(target):
                        yield number
                        yield from checked.entities[number].contains


def _reserve(thing: Entity, mobility: Mobility, registers: Registers, entities: int) -> Home:
    number, path = thing.number, f"{label(thing)}.reset.home"

    changing = (
        (Field.GONE, "gone", BOOL, mobility.vanishing),
        (Field.DIR, "facing", terms.DIRECTION, mobility.turning),
        (Field.INSIDE, "inside", Type("entity", 0, entities - 1), mobility.contents),
        (Field.CARRIER, "carrier", Type("int", 0, entities), mobility.carried),
    )
    moves = number in mobility.walking | mobility.vanishing
    cell = registers.add(path, terms.CELL) if moves else None
    return Home(
        cell,
        {
            field: registers.add(f"{path}.{name}", type_)
            for field, name, type_, numbers in changing
            if number in numbers
        },
    )


def _save_cell(block: Block, number: int, register: int) -> None:
    """The cell, also of what is not in the room because it lies in something."""
    with block.scratch():
        cell = block.temporary()
        block.emit(Op.MUL, cell, entity_register(number, Field.Y), constant(ROW))
        block.emit(Op.ADD, cell, cell, entity_register(number, Field.X))
        block.emit(Op.ADD, cell, cell, constant(CELL))
        block.emit(Op.MAX, register, cell, constant(NOWHERE))


# -- effects: all values are computed before anything changes ------------------------------------------------


V = TypeVar("V")
W = TypeVar("W")


@dataclass(frozen=True, slots=True)
class Values(Generic[V]):
    """Where the values are that a rule or step needs: as operands, or as registers that keep them.

    Attributes:
        sets: of each register that is set. keys: of each of these the first register of its row and the operand of its
        place, where it is one of a key. targets: for each effect, of what it is about. values: for each effect, of
        its value, if it has one. line: of what is said, if anything is. chosen: sets of bits, one for each condition in
        `those(...)`, see `compiler/those.py`.
    """

    sets: tuple[V, ...]
    keys: tuple[tuple[int, V] | None, ...]
    targets: tuple[tuple[V, ...], ...]
    values: tuple[V | None, ...]
    line: V | None
    chosen: tuple[V, ...] = ()

    def each(self) -> Iterator[V]:
        """All of them, in the order of the attributes."""
        yield from self.sets
        yield from (key[1] for key in self.keys if key is not None)
        yield from chain.from_iterable(self.targets)
        yield from (value for value in self.values if value is not None)
        yield from () if self.line is None else (self.line,)
        yield from self.chosen

    def mapped(self, change: Callable[[V], W]) -> Values[W]:
        """The same with another in place of each, made in the order of `each`."""
        return Values(
            tuple(map(change, self.sets)),
            tuple(None if key is None else (key[0], change(key[1])) for key in self.keys),
            tuple(tuple(map(change, targets)) for targets in self.targets),
            tuple(None if value is None else change(value) for value in self.values),
            None if self.line is None else change(self.line),
            tuple(map(change, self.chosen)),
        )


Operands: TypeAlias = Values[int]


def _chooses(what: RulePlan | StepPlan) -> bool:
    """Whether a rule affects or sets only those for which a condition holds."""
    return any(item.only is not None for item in what.sets) or any(effect.only for effect in what.causes)


class Effects:
    """Emits effects through `to`; after one on a register that computed statuses `read` these are settled again."""

    def __init__(self, to: Expressions, lines: Lines, homes: Homes, read: Set[str]) -> None:
        self.to, self.lines, self.homes, self.read = to, lines, homes, read
        self.checked, self.registers = to.checked, to.registers

    def compute(self, what: RulePlan | StepPlan, failed: Label, speaker: Entity | None) -> Operands:
        """Compute all values; a pick that finds nothing skips to `failed`."""
        to = self.to
        chosen = MemberSelection(to, what) if _chooses(what) else None
        to.failed = failed
        set_to = chosen.set_to if chosen else lambda item: to.sited_copy(item.value)
        sets = tuple(map(set_to, what.sets))
        keys = tuple(self._key(item, what) for item in what.sets)
        targets: list[tuple[int, ...]] = []
        values: list[int | None] = []
        for effect in what.causes:
            to.site = effect.site
            targets.append(tuple(self._steady(to.value_alone(entity), what) for entity in effect.entities))
            if effect.each and chosen is not None:
                values.append(chosen.value_of(effect))
            else:
                value = effect.value
                values.append(None if value is None else self._steady(to.value_alone(value), what))
        line = None
        if what.say is not None:
            assert speaker is not None, "internal: nobody is there to say it"
            line = self._steady(self.lines.say(to, speaker, what.say), what)
        to.failed = None
        to.block.span = what.span
        return Values(sets, keys, tuple(targets), tuple(values), line, chosen.bits if chosen else ())

    def _key(self, item: Assignment, what: RulePlan | StepPlan) -> tuple[int, int] | None:
        """The first register of a row, and the place of the one that is set."""
        if item.target is None:
            return None
        self.to.site = item.key_site
        mark, (first, place) = self.to.block.taken, row(self.to, item.target)
        return first, self._steady(self.to.alone(mark, place), what)

    def carry_out(self, what: RulePlan | StepPlan, operands: Operands, speaker: Entity | None) -> None:
        """Set, reward, cause, say."""
        block = self.to.block
        only = Choice(block, operands.chosen).of if operands.chosen else nullcontext
        for item, operand, key in zip(what.sets, operands.sets, operands.keys, strict=True):
            with only(item.only):
                self.to.store(item.paths[0], operand, _empties(item), key)
        if any(path in self.read for item in what.sets for path in item.paths):
            block.emit(Op.LOAD, Register.CHANGED, constant(1))
        if isinstance(what, RulePlan) and (what.reward or what.rewards):
            block.emit(Op.REWARD, constant(what.reward))
            self._reward_seats(what.rewards)
        for effect, targets, value in zip(what.causes, operands.targets, operands.values, strict=True):
            for i, (term, entity) in enumerate(zip(effect.entities, targets, strict=True)):
                with only(effect.only[i] if effect.only else None):
                    self._cause(effect, term, entity, value)
        if operands.line is not None and speaker is not None and what.say is not None:
            self.lines.speak(self.to, speaker, operands.line, what.say)

    def _reward_seats(self, rewards: tuple[int, ...]) -> None:
        """Add to what the seats other than the agent's get in this step."""
        for number, reward in zip(self.checked.seated, rewards, strict=False):
            register = self.registers.by_path[seat_path(self.checked.entities[number], SeatRegister.BONUS)]
            with self.to.block.scratch():
                total = self.to.into_temporary(Op.ADD, register, constant(reward))
                total = self.to.into_temporary(Op.MAX, total, constant(-LARGEST_NUMBER))
                self.to.block.emit(Op.MIN, register, total, constant(LARGEST_NUMBER))

    def _steady(self, value: int, what: RulePlan | StepPlan) -> int:
        """The operand of a value that nothing the rule sets can change."""
        is_set = value in {self.registers.by_path[path] for item in what.sets for path in item.paths}
        return self.to.into_temporary(Op.LOAD, value) if is_set else value

    def _cause(self, effect: Effect, term: Term, entity: int, value: int | None) -> None:
        block = self.to.block
        block.span = effect.span
        if effect.name == "vanish":
            block.emit(Op.VANISH, entity)
            out_of_hands(self.to, term, entity)
        elif effect.name == "reset":
            self._reset(term, entity)
        elif value is None:
            self._change(effect, term, entity)
        elif effect.name == "become":
            block.emit(Op.BECOME, entity, value)
        elif effect.name == "move_into":
            assert effect.value is not None, "internal: `move_into` says into what"
            move_into(self.to, term, entity, effect.value, value)
        else:
            assert effect.value is not None, "internal: `put` says where"
            if effect.value.type.kind == "entity":  # what has left the room is on no cell any more
                value = self.to.into_temporary(Op.CELL_OF, value)
            block.emit(Op.PLACE, entity, value)

    def _change(self, effect: Effect, term: Term, entity: int) -> None:
        """Open, close, lock, reveal; unlock only what is locked."""
        block = self.to.block
        kind = _type(self.checked.entities[numbers_of(term)[0]])
        states = kind.states
        word = EFFECTS[effect.name]
        if word.makes is not None:
            block.emit(Op.BECOME, entity, constant(states.index(word.makes)))
            return
        assert word.needs is not None, "internal: an effect that leads to a status, or needs one"
        status = self.to.into_temporary(Op.FIELD, entity, Field.STATUS)
        with block.when(Op.IF_EQ, status, constant(states.index(word.needs))):
            block.emit(Op.BECOME, entity, constant(kind.unlocked))

    def _reset(self, term: Term, entity: int) -> None:
        """Back to what it was at first, which may differ from one object of a group to the next."""
        block = self.to.block
        numbers = numbers_of(term)
        things = [self.checked.entities[number] for number in numbers]
        fixed = all(self.homes.is_fixed(thing) and thing.initial is None for thing in things)
        alike = len({thing.status for thing in things}) == 1 and not any(thing.timer for thing in things)
        if fixed and (alike or len(things) == 1):
            self._become_initial(things[0], entity)
            return
        done = Label()
        for thing in things[:-1]:
            with block.when(Op.IF_EQ, entity, constant(thing.number), then=done):
                self._put_back(thing, entity)
        self._put_back(things[-1], entity)
        block.bind(done)

    def _put_back(self, thing: Entity, entity: int) -> None:
        self._become_initial(thing, entity)
        self.homes.put_back(self.to, thing.number)

    def _become_initial(self, thing: Entity, entity: int) -> None:
        """Its status is the first, and its timer counts from the beginning."""
        timer = self.registers.by_path.get(f"{label(thing)}.timer")
        if timer is not None:
            self.to.block.emit(Op.LOAD, timer, constant(0))
        if thing.role == "object":
            status = constant(thing.status) if thing.initial is None else self.to.value(thing.initial)
            self.to.block.emit(Op.BECOME, entity, status)


def _empties(item: Assignment) -> bool:
    """Whether a register is set to nothing."""
    term = item.value.term
    return isinstance(term, Const) and term.value < term.type.low


# -- what is kept: `prev(...)` and open memories as a step begins, acts as it ends -----


def remember(to: Expressions) -> None:
    """At the start of a step: values of `prev` and the like from the state that the last step left.

    Then nobody has said anything yet.
    """
    block = to.block
    for item in to.checked.remembered:
        _remember(to, item)
    for memory in to.checked.memories:
        if memory.open is not None:
            _note_whether(to, f"{memory.path}.open", memory.open)
    for entity in to.checked.entities:
        said = to.registers.by_path.get(said_path(entity))
        if said is not None:
            block.emit(Op.LOAD, said, constant(0))


def _remember(to: Expressions, item: Drawn) -> None:
    """One value, and whether there is one, unless there always is."""
    block = to.block
    found, missing = to.registers.by_path.get(found_path(item.path)), Label()
    if found is None and item.type.kind == "bool":
        _note_whether(to, item.path, item.value)
        return
    with block.scratch():
        if found is not None:
            block.emit(Op.LOAD, found, constant(0))
            # `accepts` reads the condition alone, without `found`.
            if item.type.kind == "bool":
                block.emit(Op.LOAD, to.registers.by_path[item.path], constant(0))
        to.note_value(item.path, item.value, missing if found is not None else None)
        if found is not None:
            block.emit(Op.LOAD, found, constant(1))
        block.bind(missing)


def _note_whether(to: Expressions, path: str, condition: SitedTerm) -> None:
    """Let a register tell whether a condition holds; it is 0 from the reset on."""
    if fold_whole(condition.term, to.facts, to.classes) == FALSE:
        return
    to.block.span = condition.span
    to.note_whether(to.registers.by_path[path], condition)


def push_acts(to: Expressions) -> None:
    """Each open memory takes in what the agent did in this step and forgets the oldest act."""
    block, by_path = to.block, to.registers.by_path
    for memory in to.checked.memories:
        shut = Label()
        if memory.open is not None:
            block.span = memory.open.span
            block.test(Op.IF_NE, by_path[f"{memory.path}.open"], constant(0), shut)
        for part, newest in (("move", Register.ACTION), ("utterance", Register.UTTERANCE)):
            places = [by_path[f"{memory.path}[{k}].{part}"] for k in range(memory.length)]
            for place, newer in zip(places, (*places[1:], newest), strict=True):
                block.emit(Op.LOAD, place, newer)
        filled = by_path[f"{memory.path}.filled"]
        with block.scratch():
            more = to.into_temporary(Op.ADD, filled, constant(1))
            block.emit(Op.MIN, filled, more, constant(memory.length))
        block.bind(shut)


# -- rules of `first` with a body action of their own: the rest waits, with its values, until that is done ---


@dataclass(frozen=True, slots=True)
class _Kept:
    """A register that keeps a value, and the range of the value; a known value needs no register (None)."""

    register: int | None
    low: int
    high: int


class DeferredRules:
    """The rules of a frame that are done in two parts; `MEMBER.kept[k]` hold values, `MEMBER.pending` which rule.

    Attributes:
        rules: they, in the order of their numbers in `MEMBER.pending`, from 1; 0: none.
    """

    def __init__(self, frame: FramePlan, speaker: Entity, registers: Registers, lines: Lines) -> None:
        self.member, self.speaker, self.registers, self.lines = frame.member, speaker, registers, lines
        self.rules = [rule for state in frame.states for rule in state.first if _has_more(rule)]
        self._count = 0
        self._kept = [self._room(rule) for rule in self.rules]
        self._pending = (
            registers.add(f"{frame.member}.pending", Type("int", 0, len(self.rules)), fleeting=True)
            if self.rules
            else 0
        )

    def note(self, to: Expressions, rule: RulePlan, operands: Operands) -> None:
        """Emit that the rest of a rule is to be carried out later, with these values."""
        kept = self._kept[self.rules.index(rule)]
        for part, operand in zip(kept.each(), operands.each(), strict=True):
            if part.register is not None:
                with to.block.scratch():
                    to.block.emit(Op.LOAD, part.register, _cut(to, operand, part))
        to.block.emit(Op.LOAD, self._pending, constant(1 + self.rules.index(rule)))

    def is_pending(self, rule: RulePlan) -> tuple[int, int]:
        """The operands that are equal if this rule is to be carried out."""
        return self._pending, constant(1 + self.rules.index(rule))

    def recall(self, to: Expressions, rule: RulePlan) -> Operands:
        """Emit that the values are fetched and forgotten."""
        kept = self._kept[self.rules.index(rule)]
        fetched = [_fetch(to, part) for part in kept.sets]
        sets = tuple(to.into_temporary(Op.LOAD, operand) for operand in fetched)
        others = replace(kept, sets=()).mapped(lambda part: _fetch(to, part))
        for part in kept.each():
            if part.register is not None:
                to.block.emit(Op.LOAD, part.register, constant(0))
        to.block.emit(Op.LOAD, self._pending, constant(0))
        return replace(others, sets=sets)

    def _room(self, rule: RulePlan) -> Values[_Kept]:
        sets = []
        for item in rule.sets:
            name = self.registers.named(item.paths[0])
            sets.append(self._kept_range(name.low, name.high))
        line = None if rule.say is None else self._kept_range(*self.lines.bounds(self.speaker, rule.say))
        return Values(
            tuple(sets),
            tuple(self._kept_key(item) for item in rule.sets),
            tuple(tuple(self._kept_term(entity) for entity in effect.entities) for effect in rule.causes),
            tuple(None if e.value is None else self._kept_term(e.value) for e in rule.causes),
            line,
            tuple(self._kept_range(0, (1 << bits) - 1) for bits in (sizes(rule) if _chooses(rule) else ())),
        )

    def _kept_key(self, item: Assignment) -> tuple[int, _Kept] | None:
        """The place in a row; the registers of the row that it may name are next to each other."""
        if item.target is None:
            return None
        first, low, high = row_of(self.registers, item.target)
        return first, self._kept_range(low, high)

    def _kept_term(self, term: Term) -> _Kept:
        if isinstance(term, Const):
            return _Kept(None, term.value, term.value)
        type_ = self.registers.cut(term.type)
        return self._kept_range(type_.low, type_.high)

    def _kept_range(self, low: int, high: int) -> _Kept:
        if low == high:
            return _Kept(None, low, high)
        path = f"{self.member}.kept[{self._count}]"
        self._count += 1
        return _Kept(
            self.registers.add(path, Type("int", min(0, low), max(0, high)), fleeting=True), low, high
        )


def _has_more(rule: RulePlan) -> bool:
    more = rule.sets or rule.causes or rule.say is not None or rule.goto or rule.goto_now
    return rule.do is not None and bool(more)


def _fetch(to: Expressions, kept: _Kept) -> int:
    return constant(kept.low) if kept.register is None else _cut(to, kept.register, kept)


def _cut(to: Expressions, operand: int, kept: _Kept) -> int:
    """A value within its range, also where a layout has written the register."""
    least = to.into_temporary(Op.MAX, operand, constant(kept.low))
    return to.into_temporary(Op.MIN, least, constant(kept.high))


# -- links between objects, statuses that follow from conditions, timers that run out ------------------------


def links(to: Expressions) -> None:
    """Emit everything that follows directly from the statuses of objects."""
    entities = to.checked.entities
    for entity in entities:
        _unlock(to, entity)
    for entity in entities:
        _open(to, entity, [other for other in entities if entity.number in other.opens])
    for entity in entities:
        _release(to, entity)
    for entity in entities:
        _hold_back(to, entity)


def _unlock(to: Expressions, switch: Entity) -> None:
    """While a switch is in the room and in an active status, what it unlocks is not locked."""
    targets = [to.checked.entities[number] for number in switch.unlocks]
    lockable = [target for target in targets if target.type and "locked" in target.type.states]
    if not lockable:
        return
    to.block.span = switch.span
    following = Label()
    _works(to, switch, following)
    for target in lockable:
        with to.block.when(Op.IF_EQ, _status(target), constant(_state(target, "locked"))):
            to.block.emit(Op.BECOME, constant(target.number), constant(_type(target).unlocked))
    to.block.bind(following)


def _open(to: Expressions, door: Entity, openers: Iterable[Entity]) -> None:
    """A door is open exactly while one of what opens it is in the room and in an active status."""
    block = to.block
    opened, done = Label(), Label()
    for opener in openers:
        block.span = opener.span
        idle = Label()
        _works(to, opener, idle)
        block.skip(opened)
        block.bind(idle)
    if not opened.uses:
        return
    _become(to, door, "closed", done)
    block.skip(done)
    block.bind(opened)
    _become(to, door, "open", done)
    block.bind(done)


def _release(to: Expressions, holder: Entity) -> None:
    """What is opened while something lies in it is replaced by that."""
    if not holder.contains:
        return
    block = to.block
    block.span = holder.span
    shut = Label()
    block.test(Op.IF_EQ, _status(holder), constant(_state(holder, "opened")), shut)
    block.test(Op.IF_EQ, entity_register(holder.number, Field.GONE), constant(0), shut)
    for content in holder.contains:
        elsewhere = Label()
        block.test(Op.IF_EQ, entity_register(content, Field.INSIDE), constant(holder.number), elsewhere)
        block.test(Op.IF_EQ, entity_register(content, Field.GONE), constant(1), elsewhere)
        if to.checked.entities[content].carryable:
            block.test(Op.IF_EQ, entity_register(content, Field.CARRIER), constant(0), elsewhere)
        block.emit(Op.VANISH, constant(holder.number))
        block.emit(Op.PLACE, constant(content), constant(holder.number))
        block.bind(elsewhere)
    block.bind(shut)


def _hold_back(to: Expressions, thing: Entity) -> None:
    """While another of its group is not as it was at first, a thing reacts to nothing."""
    others = [to.checked.entities[number] for number in thing.exclusive if number != thing.number]
    if not others:
        return
    block = to.block
    block.span = thing.span
    with block.scratch():
        held = block.temporary()
        block.emit(Op.LOAD, held, constant(0))
        for other in others:
            initial = constant(other.status) if other.initial is None else to.value(other.initial)
            with block.when(Op.IF_NE, _status(other), initial):
                block.emit(Op.LOAD, held, constant(1))
        block.emit(Op.SET_FIELD, constant(thing.number), Field.POKED, held)


def _works(to: Expressions, switch: Entity, otherwise: Label) -> None:
    to.one_of(Op.IF_EQ, _status(switch), _type(switch).active, otherwise)
    to.block.test(Op.IF_EQ, entity_register(switch.number, Field.GONE), constant(0), otherwise)


def _become(to: Expressions, thing: Entity, state: str, unless: Label) -> None:
    """Take a status, or go on to `unless` if it has it."""
    status = constant(_state(thing, state))
    to.block.test(Op.IF_NE, _status(thing), status, unless)
    to.block.emit(Op.BECOME, constant(thing.number), status)


def _status(thing: Entity) -> int:
    return entity_register(thing.number, Field.STATUS)


def _state(thing: Entity, name: str) -> int:
    return _type(thing).states.index(name)


def _type(thing: Entity) -> ObjectType:
    assert thing.type is not None, "internal: only objects have a status"
    return thing.type


# -- timers ----------------------------------------------------------------------------------------------------


def tick(to: Expressions) -> None:
    """Each timer counts the steps in an active status; when it is full the status expires. Else it is empty."""
    for entity in to.checked.entities:
        if entity.timer:
            _tick(to, entity)


def _tick(to: Expressions, entity: Entity) -> None:
    block, kind = to.block, _type(entity)
    block.span = entity.span
    timer = to.registers.by_path[f"{label(entity)}.timer"]
    status, idle = _status(entity), Label()
    with block.scratch():
        to.one_of(Op.IF_EQ, status, kind.active, idle)
        count = to.into_temporary(Op.ADD, timer, constant(1))
        block.emit(Op.MIN, timer, count, constant(entity.timer))
        with block.when(Op.IF_EQ, timer, constant(entity.timer)):
            for before, after in sorted(kind.expired.items()):
                with block.when(Op.IF_EQ, status, constant(before), then=idle):
                    block.emit(Op.BECOME, constant(entity.number), constant(after))
            block.bind(idle)
            block.emit(Op.LOAD, timer, constant(0))
