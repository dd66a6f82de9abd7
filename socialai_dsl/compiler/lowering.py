"""The first two passes: allocation of everything in a scenario, then code for every part, each once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

from socialai_dsl.compiler.activities import (
    ACTING,
    FULFILLED,
    NOTHING,
    Activities,
    has_aim,
)
from socialai_dsl.compiler.assembler import (
    Block,
    CodeTable,
    Label,
    Registers,
    Sites,
    label,
    seat_path,
    state_names,
)
from socialai_dsl.compiler.beliefs import perceive
from socialai_dsl.compiler.effects import (
    DeferredRules,
    Effects,
    Homes,
    links,
    push_acts,
    remember,
    tick,
)
from socialai_dsl.compiler.expressions import Expressions, Lines, chance_word, note_what_is_said
from socialai_dsl.compiler.folding import FALSE, SEVERAL, Classes, Facts, fold, fold_whole, mentions
from socialai_dsl.compiler.questions import ask
from socialai_dsl.compiler.setup import ComputedStatuses, require, reset
from socialai_dsl.compiler.step_order import (
    Again,
    Enter,
    Leave,
    begun_with,
    entries_of,
    first_entry,
    levels,
    way_after,
)
from socialai_dsl.grammar.ast import every
from socialai_dsl.program import Body, Header, Op, SeatRegister, constant
from socialai_dsl.semantics import plans, terms
from socialai_dsl.semantics.plans import (
    FOR_EVER,
    CheckedScenario,
    FramePlan,
    NestedSteps,
    OutcomePlan,
    RulePlan,
    StepPlan,
)
from socialai_dsl.semantics.terms import ACTION, BOOL, Pattern, Read, Type
from socialai_dsl.semantics.words import ACTIVITIES
from socialai_dsl.widths import LARGEST_NUMBER


class RuleConditions:
    """The conditions of a rule while its code is emitted; this one notes nothing."""

    def unless(self, key: str, otherwise: Label) -> Label:
        """Where to skip to if what is written under a key does not hold; `otherwise` is where the rule ends."""
        return otherwise

    def nothing(self, key: str, otherwise: Label) -> Label:
        """Where to skip to if a value finds nothing."""
        return otherwise

    def condition(self, to: Expressions, key: str, sited: terms.SitedTerm, otherwise: Label) -> None:
        """Emit a condition."""
        to.sited_condition(sited, otherwise)

    def report(self, to: Expressions, otherwise: Label) -> None:
        """Emit what notes the parts that are false, right before `otherwise`."""


class NoteTaker:
    """Gives out what notes the rules. This one notes nothing, so that a program is what it would be without."""

    recording = False
    """Whether every rule is asked, also one that cannot hold."""

    def rule(
        self, to: Expressions, counter: int, plan: RulePlan | StepPlan, entity: int | None
    ) -> RuleConditions:
        """For the code of a rule or an entry of `steps` of a member of the cast; None: of the world."""
        return _NOTHING_NOTED

    def outcome(self, to: Expressions, number: int, plan: OutcomePlan) -> RuleConditions:
        """For the code of an outcome."""
        return _NOTHING_NOTED

    def declare(self, registers: Registers) -> None:
        """Let a program have the registers that this takes."""


_NOTHING_NOTED = RuleConditions()
NO_NOTES = NoteTaker()


@dataclass(frozen=True)
class Allocation:
    """The context of one scenario's code; lowering adds registers of its own, sites, lines and code.

    Attributes:
        inbox: the first register of the inboxes. inbox_of: that of the inbox of each member with a frame.
        inbox_size: entries of an inbox.
        rules: name of each counted rule, in the order of their counters.
    """

    checked: CheckedScenario
    notes: NoteTaker
    registers: Registers
    classes: Classes
    lines: Lines
    homes: Homes
    computed: ComputedStatuses
    inbox: int
    inbox_of: dict[str, int]
    inbox_size: int
    sites: Sites
    code: CodeTable = field(default_factory=CodeTable)
    rules: list[str] = field(default_factory=list)

    def expressions(self, facts: Facts | None = None, inbox: int = -1) -> Expressions:
        """An emitter into a fresh block, given these facts."""
        to = Expressions(Block(), self.checked, self.registers, self.classes, self.sites, inbox)
        to.facts = facts or to.facts
        return to


def allocate(checked: CheckedScenario, notes: NoteTaker, numbered: Lines | None) -> Allocation:
    """Where everything of a scenario is; lines are numbered as in `numbered`, if that is given."""
    registers = Registers.of(checked)
    classes = Classes(checked)
    lines = Lines(checked, classes)
    if numbered is not None:
        lines.adopt(numbered)
    note_what_is_said(checked, lines, registers)
    seat_registers(checked, registers)
    homes = Homes(checked, registers)
    # A member hears each of the others at most once between two of its turns.
    # Of a member with a seat perhaps twice: when it has spoken in its turn, and a player sits down and speaks.
    inbox_size = 1 + len(checked.frames) + 2 * len(checked.seated)
    entry_size = 3 if classes.speakers_matter else 1
    inbox = registers.reserve(0)
    inbox_of = {frame.member: registers.reserve(1 + entry_size * inbox_size) for frame in checked.frames}
    computed = ComputedStatuses(checked)
    sites = Sites(checked.kept, checked.session)
    return Allocation(
        checked, notes, registers, classes, lines, homes, computed, inbox, inbox_of, inbox_size, sites
    )


def seat_registers(checked: CheckedScenario, registers: Registers) -> None:
    """Allocate the registers of the seats but the agent's, `MEMBER.seat.NAME`, in the order of `SeatRegister`."""
    ranges = {
        SeatRegister.TAKEN: BOOL,
        SeatRegister.ACTION: ACTION,
        SeatRegister.UTTERANCE: Type("int", 0, len(checked.sentences.by_number())),
        SeatRegister.SHARE: Type("int", 0, 100),
        SeatRegister.BONUS: Type("int", -LARGEST_NUMBER, LARGEST_NUMBER),
    }
    for number in checked.seated:
        for which in SeatRegister:
            if which in ranges:
                registers.add(seat_path(checked.entities[number], which), ranges[which], fleeting=True)
            elif which != SeatRegister.COUNT:
                registers.reserve(1)


# -- frames: for each state and each class of utterance heard, only the rules that can then fire -------------


AGENT = 0


@dataclass(frozen=True, slots=True)
class FrameCode:
    """Where the code of a frame instance is.

    Attributes:
        rows: of the state table: activity, `first` by class, `then` by class. perceive: of beliefs. deferred: of what
        rules of `first` do after the body action.
    """

    rows: list[list[int]]
    perceive: int
    deferred: int


def frame_code(allocation: Allocation, number: int, frame: FramePlan) -> FrameCode:
    """The code of frame instance `number`: rows of the state table, and what is shared by its states."""
    compiler = _FrameCompiler(allocation, number, frame)
    return FrameCode(compiler.rows(), compiler.perceive(), compiler.deferred())


def _conditions(
    to: Expressions,
    rule: RulePlan,
    asked: RuleConditions,
    following: Label,
    once: int | None,
    clock: int | None = None,
) -> None:
    """Fall through if all conditions of a rule hold, else skip to `following`.

    `once` is the register that says whether it has fired, `clock` that of the frame.
    """
    block = to.block
    block.span = rule.span
    if rule.hears:
        to.condition(fold(terms.Heard(rule.hears), to.facts, to.classes), asked.unless("hears", following))
    if once is not None:
        block.test(Op.IF_EQ, once, constant(0), asked.unless("once", following))
    if rule.after:
        assert clock is not None, "internal: the world has no clock"
        block.test(Op.IF_LE, constant(rule.after), clock, asked.unless("after", following))
    if rule.when is not None:
        asked.condition(to, "when", rule.when, following)
    block.span = rule.span
    if rule.chance is not None:
        site = to.sites.row(f"{rule.site}.chance")
        block.test(Op.IF_CHANCE, chance_word(rule.chance), site, asked.unless("chance", following))


class _FrameCompiler:
    """One frame as one member plays it."""

    def __init__(self, shared: Allocation, number: int, frame: FramePlan) -> None:
        self.shared, self.number, self.frame = shared, number, frame
        self.states = state_names(frame)
        self.clock = shared.registers.by_path[f"{frame.member}.clock"]
        self.counters: dict[str, int] = {}
        for counted in frame.steps or frame.rules:
            self.counters[counted.name] = len(shared.rules)
            shared.rules.append(counted.name)
        self.once = {
            rule.name: shared.registers.add(f"{frame.member}.fired.{rule.name}", BOOL)
            for rule in frame.rules
            if rule.once
        }
        self.aims = {
            k: shared.registers.add(
                f"{frame.member}.aim[{k}]", self._range_of_aim(step.activity), fleeting=True
            )
            for k, step in enumerate(frame.steps)
            if has_aim(step.activity) and step.ends_with_its_activity
        }
        self.rounds = {
            nested.register: shared.registers.add(nested.register, Type("int", 0, nested.rounds - 1))
            for nested in every(NestedSteps, frame.nesting)
            if nested.rounds > 1
        }
        self.speaker = shared.checked.entities[frame.entity]
        self._is_agents = frame.entity == AGENT or frame.entity in shared.checked.seated
        self.later = DeferredRules(frame, self.speaker, shared.registers, shared.lines)

    def _range_of_aim(self, activity: plans.Activity) -> Type:
        word = ACTIVITIES[activity.name]
        if word.act is not None:
            return Type("int", NOTHING, FULFILLED if word.of_hands else ACTING)
        return Type("int", NOTHING, self.shared.registers.cut(activity.args[0].type).high)

    def rows(self) -> list[list[int]]:
        if self.frame.steps:
            idle = [0] * (1 + 2 * (self.shared.classes.count + 1))
            return [*(self._step_row(k) for k in range(len(self.frame.steps))), idle]
        return [self._state_row(k) for k in range(len(self.frame.states))]

    def perceive(self) -> int:
        """The address of what is done at the start of a turn; 0 if nothing is."""
        if not any(belief.member == self.frame.member for belief in self.shared.checked.beliefs):
            return 0
        to = self._expressions(Facts())
        perceive(to, self.frame.member)
        return self.shared.code.add(to.block, f"{self.frame.member}.believes")

    def deferred(self) -> int:
        """The address of what rules of `first` do after the body action that they have chosen."""
        to = self._expressions(Facts())
        for rule in self.later.rules:
            with to.block.scratch():
                to.block.span = rule.span
                with to.block.when(Op.IF_EQ, *self.later.is_pending(rule)):
                    self._effects(to).carry_out(rule, self.later.recall(to, rule), self.speaker)
                    to.block.span = rule.span
                    self._go(to, rule, follow=False)
        if self.later.rules:
            to.block.halt()  # where none of them is pending
        return self.shared.code.add(to.block, f"{self.frame.member}.{self.frame.frame}.deferred")

    # --- shared by both forms ---

    def _row(
        self,
        k: int,
        activity: plans.Activity | None,
        first: Callable[[Expressions], None],
        then: Callable[[Expressions], None],
    ) -> list[int]:
        where = f"{self.frame.member}.{self.frame.frame}.{self.states[k]}"
        return [
            self._activity(activity, where, None if self._is_agents else self.aims.get(k)),
            *self._by_class(first, f"{where}.first"),
            *self._by_class(then, f"{where}.then"),
        ]

    def _by_class(self, emit: Callable[[Expressions], None], label: str) -> list[int]:
        if self.shared.notes.recording:
            to = self._expressions(Facts(heard=SEVERAL))
            emit(to)
            return [self.shared.code.add(to.block, label)] * (self.shared.classes.count + 1)
        addresses: dict[object, int] = {}
        for heard, fitting in (*enumerate(self._fitting), (SEVERAL, SEVERAL)):
            if fitting not in addresses:
                to = self._expressions(Facts(heard=heard))
                emit(to)
                addresses[fitting] = self.shared.code.add(to.block, label)
        return [addresses[fitting] for fitting in (*self._fitting, SEVERAL)]

    @cached_property
    def _fitting(self) -> list[tuple[bool, ...]]:
        """For each utterance class, which patterns of the frame it fits: classes that fit the same share their code."""
        classes = self.shared.classes
        matching = [classes.matching(pattern) for pattern in dict.fromkeys(every(Pattern, self.frame))]
        return [tuple(heard in matched for matched in matching) for heard in range(classes.count)]

    def _expressions(self, facts: Facts) -> Expressions:
        return self.shared.expressions(facts, self.shared.inbox_of[self.frame.member])

    def _activity(self, activity: plans.Activity | None, label: str, aim: int | None) -> int:
        if activity is None or activity.name == "stay":
            return 0
        to = self._expressions(Facts())
        self._activities(to, aim).emit(activity)
        return self.shared.code.add(to.block, f"{label}.do")

    def _activities(self, to: Expressions, aim: int | None = None) -> Activities:
        shared = self.shared
        return Activities(to, shared.checked, shared.lines, self.frame.entity, self.clock, aim)

    def _effects(self, to: Expressions) -> Effects:
        return Effects(to, self.shared.lines, self.shared.homes, self.shared.computed.read)

    # --- frames by states ---

    def _state_row(self, k: int) -> list[int]:
        state = self.frame.states[k]
        return self._row(
            k,
            state.activity,
            lambda to: self._rules(to, state.first, follow=False),
            lambda to: self._rules(to, state.then, follow=True),
        )

    def _rules(
        self, to: Expressions, rules: tuple[RulePlan, ...], follow: bool, clock: int | None = None
    ) -> None:
        """Rules top to bottom; the first that holds fires. `clock` is known right after a goto_now."""
        for rule in rules:
            heard = fold(terms.Heard(rule.hears), to.facts, self.shared.classes) if rule.hears else None
            when = fold_whole(rule.when.term, to.facts, self.shared.classes) if rule.when else None
            if FALSE not in (heard, when) and (clock is None or rule.after <= clock):
                self._rule(to, rule, follow)
            elif self.shared.notes.recording:
                self._ask_in_vain(to, rule)
        to.block.halt()

    def _ask_in_vain(self, to: Expressions, rule: RulePlan) -> None:
        """Only note what keeps a rule from firing here."""
        following = Label()
        asked = self._asked(to, rule)
        self._conditions(to, rule, asked, following)
        asked.report(to, following)
        to.block.bind(following)

    def _asked(self, to: Expressions, what: RulePlan | StepPlan) -> RuleConditions:
        return self.shared.notes.rule(to, self.counters[what.name], what, self.frame.entity)

    def _conditions(self, to: Expressions, rule: RulePlan, asked: RuleConditions, following: Label) -> None:
        _conditions(to, rule, asked, following, self.once.get(rule.name), self.clock)

    def _rule(self, to: Expressions, rule: RulePlan, follow: bool) -> None:
        block = to.block
        following = Label()
        with block.scratch():
            asked = self._asked(to, rule)
            self._conditions(to, rule, asked, following)
            operands = self._effects(to).compute(rule, asked.nothing("values", following), self.speaker)
            start = len(block.instructions)
            block.emit(Op.COUNT, self.counters[rule.name])
            if rule.do is None:
                self._effects(to).carry_out(rule, operands, self.speaker)
            elif rule in self.later.rules:
                self.later.note(to, rule, operands)
            if rule.once:
                block.emit(Op.LOAD, self.once[rule.name], constant(1))
            block.span = rule.span
            if rule.do is None:
                self._go(to, rule, follow)
                block.fuse_answer(start)
            else:
                self._activities(to).emit(rule.do)
                block.halt()
            asked.report(to, following)
            block.bind(following)

    def _go(self, to: Expressions, rule: RulePlan, follow: bool) -> None:
        """Enter the next state; after goto_now in `then`, look at the new state's `then` at once."""
        target = rule.goto or rule.goto_now
        if target is None:
            to.block.halt()
            return
        number = self.states.index(target)
        to.block.emit(Op.GOTO, self.number, number)
        if rule.goto_now is not None and follow:
            self._rules(to, self.frame.states[number].then, follow=True, clock=0)
        else:
            to.block.halt()

    # --- frames by steps ---

    def _step_row(self, k: int) -> list[int]:
        step = self.frame.steps[k]
        return self._row(
            k, step.activity, lambda to: self._begin_turn(to, k), lambda to: self._end_step(to, k)
        )

    def _begin_turn(self, to: Expressions, k: int) -> None:
        """At the start of a turn in entry k: what is left out, or fulfilled before it begins, takes no turn."""
        block = to.block
        found = levels(self.frame.order, k)
        exits = [(level.nested, Label()) for level in found if level.nested is not None]
        left = self._first_turn(to, k, begun_with(found), {id(nested): exit for nested, exit in exits})
        goes_on = self._take(to, k, begins=False)
        for node in (left, *way_after(found)):
            if isinstance(node, Leave | Label):
                exit = node if isinstance(node, Label) else exits.pop()[1]
                block.bind(exit)
                goes_on = goes_on or bool(exit.uses)
                if goes_on and isinstance(node, Leave) and node.nested.rounds > 1:
                    block.emit(Op.LOAD, self.rounds[node.nested.register], constant(0))
            elif isinstance(node, Enter):
                exits.append((node.nested, Label()))
                if goes_on:
                    self._be_in(to, first_entry(node.nested), node.nested.when, node.nested.going)
                    self._enter(to, node.nested, exits[-1][1])
            elif isinstance(node, Again) and goes_on:
                self._another_round(to, node.nested, exits[-1][1])
            elif isinstance(node, int) and goes_on:
                goes_on = self._take_or_leave(to, node)
        if goes_on:
            self._stay_in(to, len(self.frame.steps))

    def _first_turn(
        self, to: Expressions, k: int, begun: Sequence[NestedSteps], exits: Mapping[int, Label]
    ) -> Label:
        """In the first turn of entry k, what it needs to begin, and a round of nested steps that begins with it.

        Where a round does not begin, on to its exit; where the entry does not, on to the label that is returned.
        """
        block, left = to.block, Label()
        when = self.frame.steps[k].when
        if when is None and not any(nested.when or nested.going or nested.until for nested in begun):
            return left
        with block.when(Op.IF_EQ, self.clock, constant(0)):
            for i, nested in enumerate(begun):
                begins = Label()
                for inner in begun[i + 1 :]:  # else a round of these begins, within one of the others
                    if inner.rounds > 1:
                        block.test(Op.IF_EQ, self.rounds[inner.register], constant(0), begins)
                another = Label()
                if nested.rounds > 1:
                    block.test(Op.IF_EQ, self.rounds[nested.register], constant(0), another)
                self._enter(to, nested, exits[id(nested)])
                if nested.rounds > 1:
                    block.skip(begins)
                    block.bind(another)
                    self._unless_over(to, nested, exits[id(nested)])
                block.bind(begins)
            if when is not None:
                to.sited_condition(when, left)
        return left

    def _be_in(self, to: Expressions, entry: int, *asked: object) -> bool:
        """Enter an entry before its conditions are evaluated, where they read the frame's own state or clock.

        Returns whether it did.
        """
        member = self.frame.member
        goes = mentions(asked, terms.InState, lambda term: term.member == member) or mentions(
            asked, terms.Read, lambda term: term.path == f"{member}.clock"
        )
        if goes:
            to.block.emit(Op.GOTO, self.number, entry)
        return goes

    def _enter(self, to: Expressions, nested: NestedSteps, exit: Label) -> None:
        """Fall through if a first round begins."""
        for condition in (nested.when, nested.going):
            if condition is not None:
                to.sited_condition(condition, exit)

    def _unless_over(self, to: Expressions, nested: NestedSteps, exit: Label) -> None:
        """Fall through if another round begins, of those that there are."""
        if nested.going is not None:
            to.sited_condition(nested.going, exit)
        if nested.until is not None:
            unfulfilled = Label()
            to.sited_condition(nested.until, unfulfilled)
            to.block.skip(exit)
            to.block.bind(unfulfilled)

    def _another_round(self, to: Expressions, nested: NestedSteps, exit: Label) -> None:
        """Fall through if another round begins, and count it."""
        self._count_round(to, nested, exit)
        self._be_in(to, first_entry(nested), nested.going, nested.until)
        self._unless_over(to, nested, exit)

    def _count_round(self, to: Expressions, nested: NestedSteps, last: Label) -> None:
        block, register = to.block, self.rounds[nested.register]
        block.test(Op.IF_LT, register, constant(nested.rounds - 1), last)
        with block.scratch():
            more = to.into_temporary(Op.ADD, register, constant(1))
            block.emit(Op.MIN, register, more, constant(nested.rounds - 1))

    def _take_or_leave(self, to: Expressions, entry: int) -> bool:
        """As `_take`, of an entry that begins unless it is left out."""
        left, step = Label(), self.frame.steps[entry]
        is_there = self._be_in(to, entry, step.when, step.activity if self._skippable(step) else None)
        if step.when is not None:
            to.sited_condition(step.when, left)
        goes_on = self._take(to, entry, begins=not is_there)
        to.block.bind(left)
        return goes_on or bool(left.uses)

    def _take(self, to: Expressions, entry: int, *, begins: bool) -> bool:
        """Take this turn in an entry, which begins or goes on, unless it is fulfilled; whether it may be."""
        block, step = to.block, self.frame.steps[entry]
        aim = self.aims.get(entry) if self._is_agents else None
        activities = self._activities(to, aim)
        if aim is not None:
            # A player in the script's place need not do what the entry says, so notes are taken before it acts.
            activities.emit(step.activity, acting=False)
        if not self._skippable(step):
            self._stay_in(to, entry if begins else None)
            return False
        stop, leave = Label(), Label()
        activities.unless_finished(step.activity, stop, stop)
        block.skip(leave)
        block.bind(stop)
        self._stay_in(to, entry if begins else None)
        block.bind(leave)
        return True

    def _stay_in(self, to: Expressions, entry: int | None) -> None:
        """Take this turn in an entry that begins; None: in the one that goes on."""
        if entry is not None:
            to.block.emit(Op.GOTO, self.number, entry)
        to.block.halt()

    @staticmethod
    def _skippable(step: StepPlan) -> bool:
        has_effects = step.sets or step.causes or step.say is not None
        lapses = step.activity.until is not None or ACTIVITIES[step.activity.name].lapses
        return lapses and not has_effects and step.ends_with_its_activity

    def _end_step(self, to: Expressions, k: int) -> None:
        """The entry's effects and the next entry, once it has ended."""
        step = self.frame.steps[k]
        block = to.block
        running, ended = Label(), Label()
        block.span = step.span
        asked = self._asked(to, step)
        if step.duration is not None and step.duration > 0:
            not_yet = Label()
            still = asked.unless("for", running) if step.until is None else not_yet
            block.test(Op.IF_LE, constant(step.duration), self.clock, still)
            block.skip(ended)
            block.bind(not_yet)
        if step.lasted is not None:
            not_yet = Label()
            still = asked.unless("for", running) if step.until is None else not_yet
            to.sited_condition(step.lasted, still)
            block.skip(ended)
            block.bind(not_yet)
        if step.until is not None:
            asked.condition(to, "until", step.until, running)
        elif step.duration == FOR_EVER:
            block.halt()
            return
        elif step.ends_with_its_activity:
            unfinished = asked.unless("do", running)
            self._activities(to, self.aims.get(k)).unless_finished(step.activity, unfinished, ended)
        block.bind(ended)
        failed = asked.nothing("values", running)
        operands = self._effects(to).compute(step, failed, self.speaker)
        start = len(block.instructions)
        block.emit(Op.COUNT, self.counters[step.name])
        self._effects(to).carry_out(step, operands, self.speaker)
        self._go_on(to, k)
        block.fuse_answer(start)
        asked.report(to, running)
        block.bind(running)
        block.halt()

    def _go_on(self, to: Expressions, k: int) -> None:
        """Go to what follows entry k: the next one, the first of another round, or what comes after the rounds."""
        block, end = to.block, len(self.frame.steps)
        found = levels(self.frame.order, k)
        if not found:  # it is left out for good, and nothing leads here
            block.emit(
                Op.GOTO, self.number, min((n for n in entries_of(self.frame.order) if n > k), default=end)
            )
            block.halt()
        for level in reversed(found):
            following = level.body[level.index + 1 :]
            if following or level.nested is None:
                block.emit(Op.GOTO, self.number, first_entry(following[0]) if following else end)
                block.halt()
                return
            if level.nested.rounds > 1:
                last = Label()
                self._count_round(to, level.nested, last)
                block.emit(Op.GOTO, self.number, first_entry(level.nested))
                block.halt()
                block.bind(last)
                block.emit(Op.LOAD, self.rounds[level.nested.register], constant(0))


# -- rules of the world: once a step, after all turns, each that holds fires ---------------------------------


def world_rules(to: Expressions, allocation: Allocation) -> None:
    """Emit the rules top to bottom, and add their names to those that are counted."""
    notes = allocation.notes
    for rule in to.checked.rules:
        allocation.rules.append(rule.name)
        asked = notes.rule(to, len(allocation.rules) - 1, rule, None)
        if rule.when is None or fold(rule.when.term, to.facts, to.classes) != FALSE:
            _world_rule(to, allocation, rule, asked)
        elif notes.recording:  # what keeps it from ever firing
            following = Label()
            asked.condition(to, "when", rule.when, following)
            asked.report(to, following)
            to.block.bind(following)


def _world_rule(to: Expressions, allocation: Allocation, rule: RulePlan, asked: RuleConditions) -> None:
    assert not rule.hears, "internal: the world has no ears"
    assert rule.say is None, "internal: the world has no voice"
    assert rule.do is None, "internal: the world has no body"
    block = to.block
    following = Label()
    with block.scratch():
        fired = to.registers.add(f"world.fired.{rule.name}", BOOL) if rule.once else None
        _conditions(to, rule, asked, following, fired)
        effects = Effects(to, allocation.lines, allocation.homes, allocation.computed.read)
        operands = effects.compute(rule, asked.nothing("values", following), None)
        block.emit(Op.COUNT, len(allocation.rules) - 1)
        effects.carry_out(rule, operands, None)
        if fired is not None:
            block.emit(Op.LOAD, fired, constant(1))
        asked.report(to, following)
        block.bind(following)


# -- outcomes: one block for each pair of utterance class and body action, most of them empty ----------------


_BODIES = range(Body.NONE + 1)
"""What the agent can do."""


def outcome_table(allocation: Allocation) -> list[int]:
    """Addresses by (class, action), row by row."""
    checked, notes, code = allocation.checked, allocation.notes, allocation.code
    classes = range(allocation.classes.count)
    if notes.recording:
        to = allocation.expressions()
        _first_that_holds(to, checked, notes)
        return [code.add(to.block, "outcome")] * (len(classes) * len(_BODIES))
    table = []
    for said, action in product(classes, map(Body, _BODIES)):
        to = allocation.expressions(Facts(said=said, action=action))
        _first_that_holds(to, checked, notes)
        table.append(code.add(to.block, f"outcome after class {said}, {action.name.lower()}"))
    return table


def _first_that_holds(to: Expressions, checked: CheckedScenario, notes: NoteTaker) -> None:
    block = to.block
    for number, outcome in enumerate(checked.outcomes):
        never = fold_whole(outcome.condition.term, to.facts, to.classes) == FALSE
        if never and not notes.recording:
            continue
        following = Label()
        asked = notes.outcome(to, number, outcome)
        asked.condition(to, "outcome", outcome.condition, following)
        with block.scratch():
            if outcome.success and (outcome.graded or any(graded for _, graded in outcome.shares)):
                to.failed = asked.nothing("values", following)
            _pay_seats(to, checked, outcome)
            if outcome.graded is not None and outcome.success:
                block.emit(Op.END_GRADED, number, to.sited_value(outcome.graded))
            else:
                block.emit(Op.END, number, outcome.percent if outcome.success else 0)
            to.failed = None
        block.halt()
        asked.report(to, following)
        block.bind(following)
    block.halt()


def _pay_seats(to: Expressions, checked: CheckedScenario, outcome: OutcomePlan) -> None:
    """Emit the shares of the seats other than the agent's."""
    for number, (percent, graded) in zip(checked.seated, outcome.shares, strict=False):
        register = to.registers.by_path[seat_path(checked.entities[number], SeatRegister.SHARE)]
        share = constant(percent if outcome.success else 0)
        if graded is not None and outcome.success:
            least = to.into_temporary(Op.MAX, to.sited_value(graded), constant(0))
            share = to.into_temporary(Op.MIN, least, constant(100))
        to.block.emit(Op.LOAD, register, share)


def seat_code(allocation: Allocation, number: int) -> int:
    """The address of the code by which a member says what the player on its seat says."""
    to = allocation.expressions()
    speaker = allocation.checked.entities[number]
    said = Read(Type("int", 0, len(allocation.lines.grammar)), seat_path(speaker, SeatRegister.UTTERANCE))
    allocation.lines.perform(to, speaker, said, as_player=True)
    to.block.halt()
    return allocation.code.add(to.block, f"{label(speaker)}.seat")


# -- the whole scenario --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LoweredCode:
    """Where the code of a scenario begins.

    Attributes:
        entries: header word -> address. frames: of each frame instance. outcomes: addresses by (class, action).
        seats: of what says what a player says, for each seat but the agent's.
    """

    entries: dict[Header, int]
    frames: list[FrameCode]
    outcomes: list[int]
    seats: list[int]


def lower(allocation: Allocation) -> LoweredCode:
    """The code of a scenario, collected in the allocation's table."""

    def entry(label: str, *emitters: Callable[[Expressions], None]) -> int:
        to = allocation.expressions()
        for emit in emitters:
            emit(to)
        return allocation.code.add(to.block, label)

    computed, homes, notes = allocation.computed, allocation.homes, allocation.notes
    entries = {Header.RESET_PC: entry("reset", lambda to: reset(to, computed, homes))}
    frames = [frame_code(allocation, number, frame) for number, frame in enumerate(allocation.checked.frames)]
    entries |= {
        Header.REQUIRE_PC: entry("require", require),
        Header.BEFORE_PC: entry("before", *((ask,) if allocation.checked.probes else ()), remember),
        Header.LINKS_PC: entry("links", links),
        Header.SETTLE_PC: entry("settle", computed.settle),
        Header.RULES_PC: entry("rules", push_acts, lambda to: world_rules(to, allocation)),
        Header.TICK_PC: entry("tick", tick),
    }
    outcomes = outcome_table(allocation)
    seats = [seat_code(allocation, number) for number in allocation.checked.seated]
    notes.declare(allocation.registers)
    return LoweredCode(entries, frames, outcomes, seats)
