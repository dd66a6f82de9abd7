"""Frames: which rule fires, what it does, and how states and steps follow each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from socialai_dsl.grammar import ast
from tests.reference import bodies, chance, speech
from tests.reference.conditions import CONDITIONS
from tests.reference.effects import Cause, affect, assign, assignments, causes
from tests.reference.evaluate import Context, NothingFoundError, evaluate, holds, pattern, there
from tests.reference.script import Belief, Entry, Frame, Rule, Source, Step
from tests.reference.source import Sources
from tests.reference.world import NO_CELL, NOTHING, Entity, World


@dataclass
class Consequence:
    """What a rule will do: all its values computed, nothing done yet."""

    rule: Any
    activity: bodies.Activity | None = None
    registers: dict[str, Any] = field(default_factory=dict)
    causes: list[Cause] = field(default_factory=list)
    say: str | None = None
    to: Entity | None = None


@dataclass
class Turn:
    """One member's turn between its activity and what follows it."""

    activity: bodies.Activity
    read_then: bool = True
    afterwards: Consequence | None = None
    say: str | None = None  # one utterance per turn: the first is kept
    filled: dict[str, Any] | None = None  # of a performed utterance
    to: Entity | None = None  # who is addressed
    tone: str | None = None  # that of the moment at which it is said


class FrameRunner:
    """Runs the frame of one member of the cast, a turn at a time."""

    def __init__(self, sources: Sources, world: World, me: Entity) -> None:
        self.sources, self.world, self.me = sources, world, me
        self.path = f"{me.key}/frames.{me.frame}"

    @property
    def frame(self) -> Frame | None:
        """The frame that is played."""
        return self.sources.frame_of(self.me.frame)

    # -- a turn --------------------------------------------------------------------------------------------

    def perceive(self) -> None:
        """Step 4a: each belief takes the value of its first source that holds; without one it may be forgotten."""
        for name, belief in self.sources.beliefs_of(self.me):
            site = f"cast.{self.me.key}.beliefs.{name}"
            found = (self.said_by_source(belief, place, source) for place, source in belief.sources(site))
            value = next((one for one in found if one is not NOTHING), NOTHING)
            if value is not NOTHING:
                is_none = belief.may_be_nothing and value == NO_CELL
                self.me.believes[name], self.me.ages[name] = NOTHING if is_none else value, 0
            elif belief.forget is not None and self.forgets(name, belief, site):
                self.me.believes[name] = NOTHING

    def said_by_source(self, belief: Belief, place: str, source: Source) -> Any:
        """What a source says now; nothing if it does not hold."""
        context: Context | None = Context(self.world, self.me)
        frame = self.me.frame if belief.from_ else None
        try:
            if belief.from_:
                context = self.heard(Rule(when=source.when, hears=source.hears, set={"it": source.of}), place)
            when = (
                None if source.when is None else self.sources.expression(f"{place}.when", source.when, frame)
            )
            if context is None or not holds(when, context):
                return NOTHING
            return there(evaluate(self.sources.expression(place, source.of, frame), context))
        except NothingFoundError:
            return NOTHING

    def forgets(self, name: str, belief: Belief, site: str) -> bool:
        """Whether a belief without any source is given up: after so many turns, or on a condition."""
        value = evaluate(self.expression(f"{site}.forget", belief.forget), self.context())
        if isinstance(value, bool):
            return value
        self.me.ages[name] = min(self.me.ages[name] + 1, value)
        return bool(self.me.ages[name] == value)

    def begin(self) -> Turn:
        """Step 4b, first part: `first`, and which activity runs."""
        self.perceive()
        frame = self.frame
        if frame is None:
            return Turn(bodies.Activity("stay"))
        return self.begin_step(frame) if frame.states is None else self.begin_state(frame)

    def perform_utterance(self, turn: Turn) -> None:
        """What is performed is said with the body action; a `say` of the same turn comes too late."""
        spoken = turn.activity.utterance(self.me)
        if spoken:
            self.say(turn, *speech.pair(self.world, self.sources.scenario.grammar, spoken))

    def say(
        self, turn: Turn, text: str, filled: dict[str, Any] | None = None, to: Entity | None = None
    ) -> None:
        """The first thing that is said in a turn counts. That an NPC said it is known at once; it is heard later."""
        if turn.say is None:
            turn.say, turn.filled, turn.to = text, filled, to
            turn.tone = None if self.world.tone is None else self.me.looks.get(self.world.tone)
            if not self.me.taken:
                self.me.utterance = text

    def end(self, turn: Turn) -> str | None:
        """Step 4b, second part, after the body action: `then`, or the end of an entry; returns what is said."""
        frame = self.frame
        if frame is not None:
            self.me.clock += 1
            if frame.states is None:
                self.end_step(frame, turn)
            elif turn.afterwards is not None:
                self.perform(turn.afterwards, turn)
            elif turn.read_then:
                self.read_then(frame, turn)
        # An utterance is heard until the end of its hearer's next turn.
        self.me.inbox.clear()
        return turn.say

    # -- frames with states --------------------------------------------------------------------------------

    def begin_state(self, frame: Frame) -> Turn:
        """The first rule of `first` that holds fires; with a `do` of its own it takes the whole turn."""
        assert frame.states is not None
        turn = Turn(bodies.Activity("stay"))
        path = f"{self.path}.states.{self.me.state}"
        chosen = self.first_that_holds(frame.states[str(self.me.state)].first, f"{path}.first")
        if chosen is not None and chosen.activity is not None:
            turn.activity, turn.read_then, turn.afterwards = chosen.activity, False, chosen
            return turn
        if chosen is not None:
            self.perform(chosen, turn)
        state = frame.states[str(self.me.state)]
        if state.do is not None:
            turn.activity = self.activity(f"{self.path}.states.{self.me.state}.do", state.do)
        return turn

    def read_then(self, frame: Frame, turn: Turn) -> None:
        """`then` of the current state; after a `goto_now` also that of the new one, and so on."""
        assert frame.states is not None
        for _ in range(len(frame.states) + 1):
            path = f"{self.path}.states.{self.me.state}.then"
            chosen = self.first_that_holds(frame.states[str(self.me.state)].then, path)
            if chosen is None:
                return
            self.perform(chosen, turn)
            if chosen.rule.goto_now is None:
                return
        raise AssertionError("goto_now goes round in a circle")

    # -- frames with steps ---------------------------------------------------------------------------------

    def begin_step(self, frame: Frame) -> Turn:
        """The activity of the current entry; what is left out or fulfilled already is skipped without a turn."""
        assert isinstance(self.me.state, int)
        while self.me.state < len(frame.entries):
            entry = frame.entries[self.me.state]
            if self.me.clock == 0 and not self.begins(frame, entry):
                continue
            if entry.step.do is None:
                return Turn(bodies.Activity("stay"))
            activity = self.activity(f"{self.path}.{entry.address}.do", entry.step.do)
            timed = entry.step.until is not None or entry.step.for_ is not None
            bare = not (timed or entry.step.say or entry.step.set or entry.step.cause)
            if self.me.gone or not (bare and activity.fulfilled(self.world, self.me)):
                return Turn(activity)
            self.go_on(frame, self.me.state, entry.inside)
        return Turn(bodies.Activity("stay"))

    def begins(self, frame: Frame, entry: Entry) -> bool:
        """Whether the current entry begins, and with it the rounds of nested steps that it is the first of."""
        number = self.me.state
        assert isinstance(number, int)
        for depth, (address, nested) in enumerate(entry.inside):
            within = self.within(frame, address)
            inner_rounds = any(self.me.rounds.get(inner, 0) for inner, _ in entry.inside[depth + 1 :])
            if within[0] == number and not inner_rounds and not self.round_begins(address, nested):
                for inner, _ in entry.inside[depth:]:
                    self.me.rounds[inner] = 0
                self.go_on(frame, within[-1], entry.inside[:depth])
                return False
        if entry.step.when is None or self.is_true(f"{entry.address}.when", entry.step.when):
            return True
        self.go_on(frame, number, entry.inside)
        return False

    def round_begins(self, address: str, nested: Step) -> bool:
        """Whether the first or another round of nested steps begins, as far as their conditions go."""
        first = not self.me.rounds.get(address, 0)
        if first and nested.when is not None and not self.is_true(f"{address}.when", nested.when):
            return False
        if nested.while_ is not None and not self.is_true(f"{address}.while", nested.while_):
            return False
        return first or nested.until is None or not self.is_true(f"{address}.until", nested.until)

    def is_true(self, address: str, source: Any) -> bool:
        """Whether a condition of steps holds; where something is not found it does not."""
        try:
            return holds(self.expression(f"{self.path}.{address}", source), self.context())
        except NothingFoundError:
            return False

    def end_step(self, frame: Frame, turn: Turn) -> None:
        """Whether the entry ends with this turn; its effects happen when it does."""
        assert isinstance(self.me.state, int)
        if self.me.state == len(frame.entries):
            return
        entry = frame.entries[self.me.state]
        path = f"{self.path}.{entry.address}"
        if not self.entry_ends(entry.step, path, turn.activity):
            return
        try:
            outcome = self.consequence(entry.step, path, self.context())
        except NothingFoundError:
            return
        self.perform(outcome, turn)
        self.go_on(frame, self.me.state, entry.inside)

    def go_on(self, frame: Frame, number: int, inside: tuple[tuple[str, Step], ...]) -> None:
        """What comes after an entry, or after nested steps that end with it: `inside` are those around."""
        self.me.clock = 0
        for address, nested in reversed(inside):
            within = self.within(frame, address)
            later = [one for one in within if one > number]
            if later:
                self.me.state = later[0]
                return
            over = self.me.rounds.get(address, 0) + 1
            if over < self.number_of_rounds(address, nested):
                self.me.rounds[address], self.me.state = over, within[0]
                return
            self.me.rounds[address] = 0
        end = len(frame.entries)
        self.me.state = min((one for one in self.present(frame) if one > number), default=end)

    def skip_empty(self, frame: Frame) -> None:
        """Before the first turn: the first entry that is not left out for good."""
        self.me.state = min(self.present(frame), default=len(frame.entries))

    def within(self, frame: Frame, address: str) -> list[int]:
        """The entries of nested steps that are not left out for good."""
        entries = frame.entries
        return [one for one in self.present(frame) if address in dict(entries[one].inside)]

    def present(self, frame: Frame) -> list[int]:
        """The numbers of all entries but those of `for: 0`, and those in nested steps with `repeat: 0`."""
        found = []
        for number, entry in enumerate(frame.entries):
            rounds = [self.number_of_rounds(address, nested) for address, nested in entry.inside]
            try:
                lasts = entry.step.for_ is None or self.turns_of(entry.step, entry.address) != 0
            except NothingFoundError:
                lasts = True
            if lasts and all(rounds):
                found.append(number)
        return found

    def number_of_rounds(self, address: str, nested: Step) -> int:
        """How often nested steps are done at most."""
        if nested.repeat is None:
            return 1
        return int(evaluate(self.expression(f"{self.path}.{address}.repeat", nested.repeat), self.context()))

    def entry_ends(self, entry: Step, path: str, activity: bodies.Activity) -> bool:
        """`for: n` turns, or until `until` holds, else until the activity is finished."""
        if entry.for_ is None and entry.until is None:
            return activity.finished(self.world, self.me)
        if entry.for_ is not None:
            try:
                turns = self.turns_of(entry, path.removeprefix(f"{self.path}."))
            except NothingFoundError:
                turns = None
            if turns is not None and self.me.clock >= turns:
                return True
        try:
            return entry.until is not None and holds(
                self.expression(f"{path}.until", entry.until), self.context()
            )
        except NothingFoundError:
            return False

    def turns_of(self, entry: Step, address: str) -> int | None:
        """How many turns `for:` asks for; None for `ever`."""
        if entry.for_ == "ever":
            return None
        return int(evaluate(self.expression(f"{self.path}.{address}.for", entry.for_), self.context()))

    # -- rules ---------------------------------------------------------------------------------------------

    def first_that_holds(self, rules: tuple[Rule, ...], path: str) -> Consequence | None:
        """Lists are read top to bottom, the first rule that holds fires."""
        for number, rule in enumerate(rules):
            found = self.fires(rule, f"{path}[{rule.id or number}]")
            if found is not None:
                return found
        return None

    def fires(self, rule: Rule, path: str) -> Consequence | None:
        """What the rule will do, or None if one of its conditions is false or a value cannot be found."""
        if rule.once and path in self.me.fired_once:
            return None
        try:
            if not all(
                CONDITIONS[key](self.me.clock, self.number(f"{path}.{key}", raw))
                for key, raw in rule.asked.items()
            ):
                return None
            context = self.heard(rule, path)
            if context is None or not holds(self.when(rule, path), context):
                return None
            found = self.consequence(rule, path, context)
        except NothingFoundError:
            return None
        # `chance` is drawn only if everything else holds.
        lucky = rule.chance is None or chance.happens(
            self.world.key, f"{path}.chance", self.world.t, rule.chance
        )
        if not lucky:
            return None
        if rule.once:
            self.me.fired_once.add(path)
        return found

    def number(self, path: str, raw: Any) -> int:
        """The number at a path."""
        return int(evaluate(self.expression(path, raw), self.context()))

    def when(self, rule: Rule, path: str) -> Any:
        """The `when` of a rule."""
        return None if rule.when is None else self.expression(f"{path}.when", rule.when)

    def heard(self, rule: Rule, path: str) -> Context | None:
        """The context with `speaker` and the slots of the first utterance that `hears` matches; None without one."""
        context = self.context()
        if not rule.hears:
            return context
        wanted = self.wanted(rule, path)
        for heard in speech.in_speaking_order(self.world, self.me.inbox):
            if rule.addressed is not None and rule.addressed != (heard.to is self.me):
                continue
            for number, source in enumerate(rule.hears):
                captured: dict[str, Any] | None = {}
                if source != "any":
                    value = self.sources.text(f"{path}.hears[{number}]", source, self.me.frame)
                    context.value = value
                    captured = speech.match(pattern(value.tree, context), heard.text, self.world)
                if captured is None:
                    continue
                slots = dict.fromkeys(self.world.fillers)
                known = {
                    **slots,
                    **speech.slots_of(self.world, self.sources.scenario.grammar, heard),
                    **captured,
                }
                # A rule that asks for a slot takes no notice of what has none.
                if all(known[slot] is not None for slot in wanted):
                    return context.knowing(speaker=heard.speaker, **known)
        return None

    def wanted(self, rule: Rule, path: str) -> list[str]:
        """The slots of what was heard that a rule asks for."""
        frame = self.me.frame
        written = [rule.when, rule.do, rule.to, *rule.set, *rule.set.values(), *rule.cause]
        values = [
            self.expression(f"{path}.asked", source)
            for source in written
            if source is not None and source not in self.world.nouns
        ]
        if rule.say is not None:
            values.append(self.sources.text(f"{path}.asked", rule.say, frame))
        return [slot for slot in self.world.fillers if any(asks_for(slot, value.tree) for value in values)]

    def consequence(self, rule: Any, path: str, context: Context) -> Consequence:
        """ "A rule computes first, then acts": all values from the state in which its condition held."""
        found = Consequence(rule)
        if isinstance(rule, Rule) and rule.do is not None:
            found.activity = self.activity(f"{path}.do", rule.do, context)
        found.registers = assignments(self.sources, rule, path, context, self.me.frame)
        found.causes = causes(self.sources, rule, path, context, self.me.frame)
        if rule.say is not None:
            found.say = evaluate(self.sources.text(f"{path}.say", rule.say, self.me.frame), context)
        if getattr(rule, "to", None) is not None:
            found.to = there(evaluate(self.expression(f"{path}.to", rule.to), context))
        return found

    def perform(self, found: Consequence, turn: Turn) -> None:
        """Effects in the order set, cause, say, goto."""
        assign(self.world, self.me, found.registers)
        for verb, targets, status in found.causes:
            for target in targets:
                affect(self.world, target, verb, status)
        if found.say is not None:
            self.say(turn, found.say, to=found.to)
        if isinstance(found.rule, Rule):
            goal = found.rule.goto or found.rule.goto_now
            if goal is not None:
                self.me.state, self.me.clock = goal, 0

    # -- helpers -------------------------------------------------------------------------------------------

    def context(self) -> Context:
        """Questions asked inside the frame."""
        return Context(self.world, self.me, in_frame=True)

    def expression(self, site: str, source: Any) -> Any:
        """A value written inside the frame."""
        return self.sources.expression(site, source, self.me.frame)

    def activity(self, site: str, source: str, context: Context | None = None) -> bodies.Activity:
        """The activity of a `do:`; one whose argument cannot be found is staying."""
        try:
            return bodies.plan(self.expression(site, source), context or self.context())
        except NothingFoundError:
            return bodies.Activity("stay")


def asks_for(slot: str, node: Any) -> bool:
    """Whether an expression needs what was heard in a slot; in what is said or heard `<slot>` is all that it can be."""
    if isinstance(node, ast.Call) and node.name in ("said", "heard"):
        return node.subject is not None and asks_for(slot, node.subject)
    if isinstance(node, ast.Name) and node.id == slot:
        return True
    return any(asks_for(slot, part) for part in node.children())
