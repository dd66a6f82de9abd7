"""A scenario's models and positions to a checked scenario, or to all mistakes of meaning at once."""

from __future__ import annotations

import re
from collections.abc import Collection, Container, Iterable, Iterator, Mapping
from dataclasses import replace
from operator import itemgetter
from typing import Final, get_args

from socialai_dsl import cures
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, Severity, advice_on, did_you_mean
from socialai_dsl.schema.scenario import CHANNELS, Expression, Outcome, Property, Scenario, Sequence
from socialai_dsl.semantics import (
    addressing,
    behaviour,
    entities,
    groups,
    hearing,
    object_facts,
    possible,
    rows,
    seats,
    setup,
    tables,
)
from socialai_dsl.semantics.cast import AGENT
from socialai_dsl.semantics.dialogues import dialogues
from socialai_dsl.semantics.entities import Prelude, entities_of
from socialai_dsl.semantics.free_cells import PartialEvaluation, check_absences, check_placements
from socialai_dsl.semantics.groups import performs
from socialai_dsl.semantics.plans import (
    CheckedScenario,
    Drawn,
    FramePlan,
    OutcomePlan,
    PropertyKind,
    PropertyPlan,
    RulePlan,
    StepPlan,
)
from socialai_dsl.semantics.possible import check_possible
from socialai_dsl.semantics.probes import probes
from socialai_dsl.semantics.ranges import Ranges
from socialai_dsl.semantics.resolve import ScenarioResolver
from socialai_dsl.semantics.resolver import (
    INT,
    MAX_ALL_TEXTS,
    MAX_TEXTS,
    Resolver,
    number_of_texts,
    texts_of,
    words_of_values,
)
from socialai_dsl.semantics.scope import (
    Findings,
    PlayedFrame,
    ReportedError,
    Scalar,
    frames_of,
    step_scope,
    surviving,
)
from socialai_dsl.semantics.setup import room_plan, room_sizes
from socialai_dsl.semantics.terms import (
    BOOL,
    Const,
    Line,
    Quantification,
    SitedTerm,
    Type,
    walk,
)
from socialai_dsl.semantics.texts import texts_in_order
from socialai_dsl.semantics.unseen import check_unseen
from socialai_dsl.source import DataPath, Node, Span
from socialai_dsl.vocabulary import PRIMITIVES, mark_of, pieces
from socialai_dsl.vocabulary import words as words_of
from socialai_dsl.widths import MOST_WORDS, UNSPOKEN

KINDS: tuple[PropertyKind, ...] = get_args(PropertyKind)
DEADLY = "deadly"

_WITH = {
    "share": ("reachable", "within", "script", "needs", "knowable"),
    "draw": ("needs",),
    "at_most": ("rival",),
}
"""Keys that say more, and what they can be said about."""

Draw = tuple[str, tuple[int, ...]]
"""A register, and its values; one that is drawn with a greater chance is there several times."""


def properties(
    resolver: Resolver,
    outcomes: tuple[OutcomePlan, ...],
    drawn: Iterable[Drawn],
    patches: Container[str] | None,
) -> Iterator[PropertyPlan]:
    """The entries of `check`, in the order written; those with a mistake are left out once it has been reported.

    `patches` are the files that patch the scenario; None: nothing changes it. What changes it may fix or take away what
    an entry asks about. That is no mistake but a reason not to ask, unless a patch wrote the entry.
    """
    lets = {item.path: item for item in drawn if item.path.startswith("let.")}
    bag = resolver.findings.bag
    for i, entry in enumerate(resolver.symbols.scenario.check):
        with surviving():
            written, before = _Entry(resolver, entry, ("check", i)), [*bag]
            try:
                yield written.plan(outcomes, lets)
            except ReportedError:
                found = [d for d in bag if d not in before]
                if not found or patches is None or any(d.span.file in patches for d in found):
                    raise
                bag.drop(found)
                yield written.unasked(found)


def _told_apart(resolver: Resolver, drawn: Iterable[Drawn]) -> Iterator[str]:
    """The draws by whose values results are told apart."""
    lets = [item.path for item in drawn if item.path.startswith("let.")]
    for path, name in resolver.findings.each(("results_by",), resolver.symbols.scenario.results_by):
        with surviving():
            yield _let(resolver, path, name, lets).removeprefix("let.")


def _kept(resolver: Resolver, drawn: Iterable[Drawn]) -> Iterator[str]:
    """The registers of the draws that stay the same in a session."""
    session = resolver.symbols.scenario.session
    lets = dict.fromkeys(
        item.path.partition("[")[0]
        for item in drawn
        if item.path.startswith("let.")
        and any(isinstance(part, Quantification) and part.op == "pick" for part in walk(item.value))
    )
    for path, name in resolver.findings.each(("session", "same"), session.same if session else ()):
        with surviving():
            yield _let(resolver, path, name, lets)


def _let(resolver: Resolver, path: DataPath, word: str, lets: Collection[str]) -> str:
    """The register of a draw that is named at a path."""
    findings = resolver.findings
    if f"let.{word}" not in lets:
        if word in resolver.symbols.scenario.let and findings.bag.has_errors:
            raise ReportedError  # its value means nothing, which has been reported
        near = did_you_mean(word, [known.removeprefix("let.") for known in lets])
        message = f"`{word}` is not drawn in `let`"
        raise findings.no_such(word, message, findings.at(path, width=len(word)), suggestion=near)
    resolver.used.add(("let", word))
    return f"let.{word}"


class _Entry:
    """One entry, and where it stands."""

    def __init__(self, resolver: Resolver, entry: Property, path: DataPath) -> None:
        self._resolver, self._findings = resolver, resolver.findings
        self._entry, self._path = entry, path

    def plan(self, outcomes: tuple[OutcomePlan, ...], lets: dict[str, Drawn]) -> PropertyPlan:
        """The entry with everything resolved."""
        kind, entry = self._kind(), self._entry
        place = (*self._path, kind)
        plan = PropertyPlan(kind, "", self._findings.places.key_span(place), share=entry.share)
        match kind:
            case "reachable" | "never":
                raw = entry.reachable if kind == "reachable" else entry.never
                assert raw is not None, "internal: there is a value for this key"
                goals = _outcomes_called(str(raw), outcomes)
                if goals:
                    return replace(plan, text=f"{kind}: {raw}", goals=goals)
                condition, remembered = self._condition(place, raw)
                return replace(plan, text=f"{kind}: {raw}", condition=condition, remembered=remembered)
            case "within":
                return replace(plan, text=f"within: {entry.within}", steps=entry.within or 0)
            case "oracle":
                return replace(plan, text=f"oracle: {entry.oracle:g}", share=entry.oracle)
            case "knowable":
                text = f"knowable: {str(entry.knowable).lower()}"
                return replace(plan, text=text, expected=bool(entry.knowable))
            case "script":
                return replace(plan, text=f"script: {entry.script}")
            case "rival":
                name, most = self._rival(place, entry.rival or ""), entry.at_most
                if most is None:
                    message = "`rival` needs `at_most`, the share of rooms that it may solve"
                    places = self._findings.places
                    hint = cures.add("at_most: 0.67", cures.added(places, place, "at_most: 0.67"))
                    raise self._findings.fail("S105", message, places.key_span(place), hint=hint)
                return replace(plan, text=f"rival: {name} at most {most:g}", rival=name, share=most)
            case "dilemma":
                assert entry.dilemma is not None, "internal: there is a value for this key"
                written = {"cooperate": entry.dilemma.cooperate, "defect": entry.dilemma.defect}
                frames = tuple(self._frame((*place, key), name) for key, name in written.items())
                if len(seats.seated(self._resolver.symbols)) == 1:
                    message = "a dilemma is one of several players, and only the agent has a seat"
                    hint = "give one to another member of the cast: `seat: open`"
                    raise self._findings.fail(
                        "S107", message, self._findings.places.key_span(place), hint=hint
                    )
                return replace(plan, text=f"dilemma: {frames[0]} or {frames[1]}", frames=frames)
            case "needs":
                members = self._members(place, entry.needs or ())
                tried = (
                    list(lets)
                    if entry.draw is None
                    else [_let(self._resolver, (*self._path, "draw"), entry.draw, lets)]
                )
                found = tuple((path, values) for path in tried if len(set(values := _values(lets[path]))) > 1)
                if entry.draw is not None and not found:
                    raise self._not_a_pick((*self._path, "draw"), entry.draw)
                text, any_draw = f"needs: {', '.join(members)}", entry.draw is None
                return replace(plan, text=text, members=members, draws=found, any_draw=any_draw)
            case "only_through":
                assert entry.only_through is not None, "internal: there is a value for this key"
                word, by = entry.only_through.draw, entry.only_through.by
                path = _let(self._resolver, (*place, "draw"), word, lets)
                members = self._members((*place, "by"), by)
                if len(set(values := _values(lets[path]))) < 2:
                    raise self._not_a_pick((*place, "draw"), word)
                text = f"only_through: {word} by {', '.join(members)}"
                return replace(plan, text=text, members=members, draws=((path, values),))

    def unasked(self, reasons: Iterable[Diagnostic]) -> PropertyPlan:
        """The entry that is not asked."""
        kind, entry = self._kind(), self._entry
        asked = getattr(entry, kind)
        if kind == "needs":
            asked = ", ".join(asked)
        elif entry.dilemma is not None:
            asked = f"{entry.dilemma.cooperate} or {entry.dilemma.defect}"
        elif entry.only_through is not None:
            asked = f"{entry.only_through.draw} by {', '.join(entry.only_through.by)}"
        why = ", ".join(reason.message for reason in reasons)
        return PropertyPlan(
            kind, f"{kind}: {asked}", self._findings.places.key_span((*self._path, kind)), unasked=why
        )

    def _kind(self) -> PropertyKind:
        given = [kind for kind in KINDS if getattr(self._entry, kind) is not None]
        if len(given) != 1:
            listed = ", ".join(f"`{kind}`" for kind in KINDS)
            message = f"a property has {'only one' if given else 'one'} of {listed}"
            span = self._findings.places.value_span(self._path)
            raise self._findings.fail("S107" if given else "S105", message, span)
        for key, kinds in _WITH.items():
            if getattr(self._entry, key) is not None and given[0] not in kinds:
                listed = ", ".join(f"`{kind}`" for kind in kinds)
                message = f"`{key}` says nothing about `{given[0]}`; it goes with {listed}"
                raise self._findings.fail("S107", message, self._findings.places.key_span((*self._path, key)))
        return given[0]

    def _condition(self, path: DataPath, raw: Expression) -> tuple[SitedTerm, tuple[Drawn, ...]]:
        """A condition, and what it alone asks about the step before."""
        registers = self._resolver.registers
        with registers.apart():
            condition = self._resolver.sited(raw, BOOL, step_scope(path))
            own = registers.remembered_in(condition)
        return self._resolver.undrawn(condition, "a property draws nothing itself"), own

    def _members(self, path: DataPath, names: tuple[str, ...]) -> tuple[str, ...]:
        symbols = self._resolver.symbols
        npcs = [name for name in symbols.cast if name != "agent"]
        members: list[str] = []
        for place, name in self._findings.each(path, names):
            if name not in npcs and name not in symbols.groups:
                near = did_you_mean(name, [*npcs, *symbols.groups])
                message = f"`{name}` is no NPC of the cast"
                span = self._findings.at(place, width=len(name))
                raise self._findings.no_such(name, message, span, suggestion=near)
            members += symbols.groups.get(name, (name,))
        return tuple(dict.fromkeys(members))

    def _frame(self, path: DataPath, name: str) -> str:
        """A frame that anybody can follow, since it has no slots."""
        frames, span = self._resolver.symbols.scenario.frames, self._findings.at(path, width=len(name))
        if name not in frames:
            near = did_you_mean(name, frames)
            raise self._findings.no_such(name, f"unknown frame `{name}`", span, suggestion=near)
        if frames[name].slots:
            message = f"frame `{name}` has slots, which not every seat fills"
            raise self._findings.fail("S204", message, span, hint="name a frame without slots")
        return name

    def _rival(self, path: DataPath, name: str) -> str:
        rivals = self._resolver.symbols.scenario.rivals
        if name not in rivals:
            advice = advice_on(name, rivals, "declare it: `rivals: {" + name + ": {steps: [...]}}`")
            raise self._findings.fail(
                "S201", f"there is no rival `{name}`", self._findings.at(path, width=len(name)), **advice
            )
        return name

    def _not_a_pick(self, path: DataPath, word: str) -> Exception:
        message = f"`{word}` is no free choice of several values"
        hint = "name a `let` that is a pick whose condition, if any, reads nothing that is drawn"
        return self._findings.fail("S204", message, self._findings.at(path, width=len(word)), hint=hint)


def _outcomes_called(word: str, outcomes: tuple[OutcomePlan, ...]) -> tuple[str, ...]:
    """The ways to end that a word names: `success`, `failure`, `deadly`, or an outcome's id."""
    match word.strip():
        case "success":
            return tuple(outcome.name for outcome in outcomes if outcome.success)
        case "failure":
            return (*(outcome.name for outcome in outcomes if not outcome.success), DEADLY)
        case "deadly":
            return (DEADLY,)
        case name:
            return tuple(outcome.name for outcome in outcomes if outcome.name == name)


def _values(drawn: Drawn) -> tuple[int, ...]:
    """The values that a draw has in every room, as often as they weigh; none if that depends on other draws."""
    term = drawn.value.term
    if not isinstance(term, Quantification) or term.op != "pick" or term.cells:
        return ()
    found = []
    for item in term.items:
        kept = (
            1
            if term.condition is None
            else PartialEvaluation(variables={term.variable: item.value}).value(term.condition)
        )
        if kept is None:
            return ()
        found += [item.value] * bool(kept)
    return tuple(found)


# -- the whole scenario --------------------------------------------------------------------------------------


_MAX_ROUNDS = 1000

MAX_BODIES: Final = 128
"""How many objects and members of the cast a scenario may have."""

MAX_REGISTERS: Final = 4096
"""How many registers a scenario may have; an environment's row holds twice as many numbers."""

MAX_CHANGES: Final = 2048
"""How many registers and things one rule may change; the engine has sixteen times as many temporaries for values."""


def check_meaning(
    scenario: Scenario,
    name: str,
    places: Node,
    bag: DiagnosticBag,
    prelude: Prelude,
    params: Mapping[str, Scalar] | None = None,
    patches: Container[str] | None = None,
) -> CheckedScenario | None:
    """The meaning of a scenario; None if it has mistakes, which `bag` then holds.

    Types that follow from uses (`pick(left | right)`, registers that are set) are found by resolving again with
    what the uses asked for, until nothing changes; for ranges of registers that is seldom more than once.

    Args:
        scenario: the models.
        name: what the result is called.
        places: where the parts of the file stand.
        bag: takes the findings.
        prelude: object types.
        params: the values of the file's parameters.
        patches: the names of the files that patch it; None: nothing changes it, neither a patch nor a given parameter
            nor a rival that plays.
    """
    words: dict[str, Type] = {}
    ranges = Ranges(scenario.horizon)
    checked: CheckedScenario | None = None
    for _ in range(_MAX_ROUNDS):
        found = DiagnosticBag()
        findings = Findings(found, places, params or {})
        if AGENT not in scenario.cast:
            _no_agent(scenario, findings)
            break
        run = _Run(scenario, findings, prelude, words, ranges.now, patches)
        checked = run.checked(name)
        registers = run.resolver.registers
        settled = registers.words == words
        words = registers.words
        if registers.learned:
            continue
        if found.has_errors or (ranges.settle(registers) and settled):
            run.report_too_far(ranges.too_far)
            run.report_heard(checked is not None)
            if checked is not None:
                check_absences(checked, findings, check_placements(checked, findings))
            if checked is not None and not found.has_errors:
                check_possible(checked, findings)  # else what is missing would seem never to happen
                check_unseen(checked, scenario.observe.tone, findings)
            break
    else:
        raise AssertionError("internal: the types do not settle")
    bag.extend(_without_consequences(findings, scenario))
    return None if found.has_errors else checked


def _no_agent(scenario: Scenario, findings: Findings) -> None:
    """There is nobody to act; perhaps because the name is misspelt."""
    message, places = "the cast has no `agent`", findings.places
    if (near := did_you_mean(AGENT, scenario.cast)) is not None:
        findings.error("S105", f"{message}, but `{near}`", places.key_span(("cast", near)), suggestion=AGENT)
    else:
        findings.error(
            "S105",
            message,
            places.key_span(("cast",)),
            hint=cures.add("agent: {}", cures.added(places, ("cast",), "agent: {}")),
        )


def _without_consequences(findings: Findings, scenario: Scenario) -> Iterator[Diagnostic]:
    """A name that means two things makes many an expression senseless; that need not be said as well."""
    found, follow = findings.bag, set[str]()
    words = {word for slot in scenario.grammar.slots.values() for word in slot}
    # An unknown name that is a word of a slot: there, too, a member or thing of another name was meant.
    if entities.mean_two_things(scenario) or words & findings.unknown:
        follow |= {"S204", "S211"}
    if any(d.severity is Severity.ERROR and d.code != "S318" for d in found):
        follow.add("S318")  # what is put into a register may be what is wrong
    return (d for d in found if d.code not in follow)


class _Run:
    """One resolution of a whole scenario."""

    def __init__(
        self,
        scenario: Scenario,
        findings: Findings,
        prelude: Prelude,
        words: Mapping[str, Type],
        ranges: Mapping[str, Type],
        patches: Container[str] | None,
    ) -> None:
        self._scenario = scenario
        self._patches = patches
        self._findings = findings
        sizes = room_sizes(scenario, findings)
        self._symbols = entities.symbols_of(scenario, prelude, sizes, findings)
        seats.check_seats(self._symbols, findings)
        self._played = entities.played_frames(self._symbols, findings)
        self.resolver = ScenarioResolver(self._symbols, findings, self._played, words, ranges)
        self._heard: dict[str, dict[DataPath, Line]] | None = None

    def checked(self, name: str) -> CheckedScenario | None:
        """The checked scenario; None if it cannot be put together."""
        scenario, resolver, findings = self._scenario, self.resolver, self._findings
        if self._symbols.entities > MAX_BODIES:
            part = "objects" if len(scenario.objects) > len(scenario.cast) else "cast"
            found = self._symbols.entities
            message = f"a room holds at most {MAX_BODIES} objects and members of the cast, this one {found}"
            findings.error("S106", message, findings.places.key_span((part,)))
            return None
        if not self._grammar_is_whole():
            return None
        for member in seats.seated(self._symbols)[1:]:
            resolver.utterances.add_npc_texts(member, resolver.utterances.all_texts())
        entities.declare_registers(resolver)
        if len(resolver.registers) > MAX_REGISTERS:
            own = len(scenario.let) + len(scenario.state)
            larger = "let" if len(scenario.let) > len(scenario.state) else "state"
            part = larger if own > MAX_REGISTERS // 2 else "frames"
            message = (
                f"a scenario has at most {MAX_REGISTERS:,} registers, this one {len(resolver.registers):,}"
            )
            hint = "each member of the cast has a copy of the registers of its frame"
            findings.error("S106", message, findings.places.key_span((part,)), hint=hint)
            return None
        entities.check_slots(resolver)
        if scenario.observe.tone is not None:
            with surviving():
                rows.check_tone(resolver, scenario.observe.tone)
        possible.check_flow(scenario, findings)
        self._heard = spoken = self._spoken()
        outcomes = tuple(self._outcomes())
        plans = tuple(self._plans(spoken))
        self._look_at_unused()
        if scenario.tables:
            tables.look_at_all(resolver)
        placed = setup.placings(resolver)
        colors, turned = list(setup.colorings(resolver)), list(setup.facings(resolver))
        computed, rules = object_facts.computed(resolver), tuple(behaviour.rules(resolver))
        remembered, required = tuple(groups.memories(resolver)), tuple(behaviour.requirements(resolver))
        inhabitants = tuple(entities_of(resolver))
        believed = tuple(object_facts.beliefs(resolver))
        accepting = tuple(object_facts.accepting(resolver))
        drawn = resolver.registers.drawn()
        in_order = setup.ordered(resolver, placed, colors, turned, drawn)
        room = room_plan(resolver)
        by, kept = tuple(_told_apart(resolver, drawn)), tuple(_kept(resolver, drawn))
        claimed = tuple(properties(resolver, outcomes, drawn, self._patches))
        asked = probes(resolver)
        tested = dialogues(resolver, outcomes)
        for one in (*rules, *(one for plan in plans for one in plan.causing)):
            self._look_at_size(one)
        if scenario.grammar.slots:
            heard = {str(path[-1]) for path in resolver.used if path[:2] == ("grammar", "slots")}
            possible.check_use_of_slots(self._symbols.sentences, heard, findings)
        if findings.bag.has_errors:
            return None
        for plan in plans:
            possible.check_shadowed(plan, findings)
        self._report_unused()
        names = [resolver.registers.read(f"{member}.name") for member in self._symbols.cast]
        texts = texts_in_order(
            self._symbols.sentences,
            names,
            [line for npc in self._symbols.cast if npc != AGENT for line in spoken.get(npc, {}).values()],
            [one.tone for one in inhabitants],
        )
        words: dict[str, None] = {}
        written: set[str] = set()
        for text in texts:
            words |= dict.fromkeys(words_of(text))
            written.update(pieces(text))
        if scenario.observe.lines == "marked":
            shown = scenario.observe.names == "shown"
            called = [word for name in names for word in words_of_values(name.type)] if shown else [None]
            words |= dict.fromkeys(map(mark_of, called))
        if len(written | words.keys()) + len(UNSPOKEN) > MOST_WORDS:
            most = MOST_WORDS - len(UNSPOKEN)
            message = f"its texts have {len(words):,} words in {len(written):,} spellings; {most:,} can be told apart"
            findings.error("S106", message, findings.places.key_span(("scenario",)))
            return None
        return CheckedScenario(
            name=name,
            horizon=scenario.horizon,
            actions=tuple(action for action in PRIMITIVES if action in scenario.actions),
            sentences=self._symbols.sentences,
            room=room,
            entities=inhabitants,
            setup=in_order,
            frames=plans,
            outcomes=outcomes,
            words_in_order=tuple(words),
            npcs_hidden=scenario.observe.npcs == "hidden",
            picture_before_npcs=scenario.observe.image == "before_npcs",
            names_shown=scenario.observe.names == "shown",
            addressing=addressing.of_slot(resolver) if scenario.grammar.to is not None else None,
            overheard=scenario.overheard,
            seated=tuple(self._symbols.numbers[name] for name in seats.seated(self._symbols)[1:]),
            own_voice=scenario.observe.own_voice,
            seats_hidden=scenario.observe.seats == "hidden",
            computed=computed,
            remembered=tuple(resolver.registers.remembered),
            memories=remembered,
            rules=rules,
            require=required,
            egocentric=scenario.observe.directions == "egocentric",
            lines_marked=scenario.observe.lines == "marked",
            slope=self._slope(),
            beliefs=believed,
            channels=self._channels(),
            shows_carrying=self._shows_carrying(),
            looks=tuple(rows.look_plans(resolver)) if scenario.looks else (),
            each_step=round(scenario.reward.each_step * 1_000_000),
            properties=claimed,
            results_by=by,
            session=scenario.session.episodes if scenario.session else 1,
            kept=kept,
            probes=asked,
            tests=tested,
            accepting=accepting,
            readings=resolver.readings,
        )

    def _look_at_size(self, rule: RulePlan | StepPlan) -> None:
        """Report a rule or an entry that changes more at once than a program has room for."""
        sets = [item.value.span for item in rule.sets]
        causes = [effect.span for effect in rule.causes for _ in effect.entities]
        changed = sets + causes
        if len(changed) > MAX_CHANGES:
            message = (
                f"a rule changes at most {MAX_CHANGES:,} registers and things, this one {len(changed):,}"
            )
            hint = "let several rules or entries change some of them each"
            self._findings.error("S106", message, changed[MAX_CHANGES], hint=hint)

    def _grammar_is_whole(self) -> bool:
        """Whether it can be known what the agent can say; mistakes are reported."""
        if not possible.check_grammar(self._scenario.grammar, self._findings):
            return False
        for parts in possible.unclear_templates(self._scenario.grammar):
            self.resolver.utterances.add_unclear(AGENT, parts)
        slots = self._scenario.grammar.slots
        if len(self._symbols.slots) < len(slots):
            return False  # a slot that cannot be filled, which has been reported
        return not slots or possible.check_sentences(self._symbols.sentences, self._findings)

    def _spoken(self) -> dict[str, dict[DataPath, Line]]:
        """What everybody says, before what anybody hears: member -> the lines of its frame."""
        found = {member: behaviour.lines_of(self.resolver, played) for member, played in self._played.items()}
        together = 0
        for member, spoken in found.items():
            for line in spoken.values():
                number, before = number_of_texts(line), together
                together += number
                if number > MAX_TEXTS:
                    message = f"this can be {number} different texts; at most {MAX_TEXTS} are possible"
                    self._findings.error("S212", message, line.span)
                elif before <= MAX_ALL_TEXTS < together:
                    message = (
                        f"all lines up to here can be {together} texts; at most {MAX_ALL_TEXTS} are possible"
                    )
                    self._findings.error("S212", message, line.span)
                elif member != AGENT and together <= MAX_ALL_TEXTS:
                    self.resolver.utterances.add_npc_texts(member, texts_of(line))
        for member, played in self._played.items():
            if member != AGENT and performs(played.model):
                self.resolver.utterances.add_npc_texts(member, self.resolver.utterances.all_texts())
        return found

    def _plans(self, spoken: Mapping[str, Mapping[DataPath, Line]]) -> Iterator[FramePlan]:
        # Members act in the order of their entities: the agent, then the cast as written.
        for member, number in sorted(self._symbols.numbers.items(), key=itemgetter(1)):
            if member in self._played:
                yield behaviour.plan(self.resolver, self._played[member], spoken[member])
            elif self._symbols.cast[member].value("beliefs"):
                span = self._findings.places.key_span(("cast", member))
                yield object_facts.watching(member, number, span)

    def _look_at_unused(self) -> None:
        """Frames that no member plays are checked as if an NPC did, so that no mistake waits for its first use; where a
        variant leaves no NPC, nobody can tell what they would mean.
        """
        played = {frame.name for frame in self._played.values()}
        npcs = [name for name in self._symbols.cast if name != AGENT]
        if not npcs:
            return
        # `it` means something only to one of a group, so such a member looks at what nobody plays.
        npc = next((name for name in npcs if self._symbols.group_of(name)), npcs[0])
        for name in self._scenario.frames:
            if name not in played:
                path: DataPath = ("frames", name)
                frame = self._scenario.frames[name]
                self._look_at(
                    entities.played_frame(
                        self._symbols, self._findings, npc, name, frame, path, looked_at=True
                    )
                )

    def _report_unused(self) -> None:
        """Definitions, draws, tables and frames that nothing uses (W317), in a scenario of a single file: those of
        several may be there for what else is built of these files.
        """
        places, scenario = self._findings.places, self._scenario
        drawn = [key for key, value in scenario.let.items() if not isinstance(value, Sequence)]
        paths: list[DataPath] = [
            *(("let", key) for key in drawn),
            *(("tables", key) for key in scenario.tables),
            *(("define", key) for key in scenario.define),
            *((*path, "define", key) for path, frame in frames_of(scenario) for key in frame.define),
        ]
        followed = {frame.name for frame in self._played.values()}
        followed.update(str(role.frame) for role in scenario.roles.values())
        dilemmas = [claim.dilemma for claim in scenario.check if claim.dilemma is not None]
        followed.update(name for one in dilemmas for name in (one.cooperate, one.defect))
        idle: list[DataPath] = [("frames", key) for key in scenario.frames if key not in followed]
        parts: list[DataPath] = [(name,) for name in scenario.model_fields_set]
        if len({places.key_span(path).file for path in (*parts, *paths, *idle)}) > 1:
            return
        for path in idle:
            otherwise = f"or give it to a member of the cast: `frame: {path[-1]}`"
            hint = cures.propose("delete it", cures.deleted(places, path), also=otherwise)
            self._findings.warning(
                "W317", f"nobody follows the frame `{path[-1]}`", places.key_span(path), hint=hint
            )
        for path in paths:
            if path not in self.resolver.used:
                name = str(path[-1]).partition("(")[0].strip()
                hint = cures.propose(
                    "delete it", cures.deleted(places, path), also="or use it where it was meant"
                )
                self._findings.warning("W317", f"nothing uses `{name}`", places.key_span(path), hint=hint)

    def _look_at(self, frame: PlayedFrame) -> None:
        with self.resolver.registers.apart():
            entities.declare_frame(self.resolver, frame)
            behaviour.plan(self.resolver, frame, behaviour.lines_of(self.resolver, frame))

    def _outcomes(self) -> Iterator[OutcomePlan]:
        findings = self._findings
        for i, outcome in enumerate(self._scenario.outcome):
            given = [key for key in ("success", "failure") if getattr(outcome, key) is not None]
            path: DataPath = ("outcome", i)
            if len(given) != 1:
                joined = "has only one of `success` and" if given else "needs `success` or"
                message = f"an outcome {joined} `failure`"
                findings.error("S107" if given else "S105", message, findings.places.value_span(path))
                continue
            kind = given[0]
            with surviving():
                scope = step_scope((*path, kind))
                condition = self.resolver.sited(getattr(outcome, kind), BOOL, scope)
                line = findings.places.key_span((*path, kind)).line
                self.resolver.readings.entries[condition.site] = outcome
                if kind == "failure":
                    self._pays_nothing(outcome, path)
                name = outcome.id or f"{kind}@{line}"
                meant = self._meant(outcome, path)
                (percent, graded), *shares = self._shares(outcome.reward, (*path, "reward"), meant)
                yield OutcomePlan(
                    name, kind == "success", percent, condition, graded, tuple(shares), meant or None
                )

    def _pays_nothing(self, outcome: Outcome, path: DataPath) -> None:
        """Report what only a success has."""
        places = self._findings.places
        for key, field, message in (
            ("reward", "reward", "a failure earns nothing, so it has no `reward`"),
            ("for", "for_", "a failure is that of all, so it has no `for`"),
        ):
            if field in outcome.model_fields_set:
                self._findings.error("S107", message, places.key_span((*path, key)))

    def _meant(self, outcome: Outcome, path: DataPath) -> tuple[int, ...]:
        """The seats that a success is for; empty: all."""
        written = dict(self._findings.each((*path, "for"), outcome.for_))
        return tuple(sorted({seat for _, seat in seats.numbered(self._symbols, self._findings, written)}))

    def _shares(
        self, raw: Expression | dict[str, Expression], path: DataPath, meant: tuple[int, ...]
    ) -> list[tuple[int, SitedTerm | None]]:
        """Per cent of the success reward for each seat, or what computes it."""
        count = len(seats.seated(self._symbols))
        if not isinstance(raw, dict):
            whole = self._reward(raw, path)
            return [whole if not meant or seat in meant else (0, None) for seat in range(count)]
        found: dict[int, tuple[int, SitedTerm | None]] = {}
        written = {(*path, name): name for name in raw}
        for place, seat in seats.numbered(self._symbols, self._findings, written):
            if meant and seat not in meant:
                message = f"`{place[-1]}` is paid for a success that is not for it"
                hint = "name it in `for`, or leave it out here"
                self._findings.error("S107", message, self._findings.places.key_span(place), hint=hint)
            found[seat] = self._reward(raw[str(place[-1])], place)
        return [found.get(seat, (0, None)) for seat in range(count)]

    def _reward(self, raw: Expression, path: DataPath) -> tuple[int, SitedTerm | None]:
        """Per cent of the success reward, or what computes it."""
        reward = self.resolver.sited(raw, INT, step_scope(path))
        if not isinstance(reward.term, Const):
            return 100, reward
        if not 0 <= reward.term.value <= 100:
            message = f"`{reward.term.value}` is not a per cent of the success reward"
            raise self._findings.fail("S106", message, reward.span, hint="from 0 to 100")
        return reward.term.value, None

    def _channels(self) -> int:
        """How many channels the picture has: the first four, two or four more; not carrying and looks."""
        given = self._scenario.observe.channels or CHANNELS[:4]
        known = (*CHANNELS, *self._scenario.looks)
        plain = tuple(name for name in given if name in CHANNELS[:8])
        if plain not in (CHANNELS[:4], CHANNELS[:6], CHANNELS[:8]) or given != tuple(
            n for n in known if n in given
        ):
            more = f", then {', '.join(self._scenario.looks)}" if self._scenario.looks else ""
            message = (
                f"`channels` are {', '.join(CHANNELS[:4])}, and perhaps pointing and last_act, "
                f"pointing_right and pointing_ahead, and carrying{more}"
            )
            path: DataPath = ("observe", "channels")
            unknown = [name for name in given if name not in known]
            if unknown:
                span = self._findings.places.whole_span((*path, given.index(unknown[0])))
                near = did_you_mean(unknown[0], known)
                self._findings.error(
                    "S106", f"`{unknown[0]}` is no channel", span, suggestion=near, hint=message
                )
            else:
                self._findings.error("S106", message, self._findings.places.key_span(path))
        return len(plain)

    def _shows_carrying(self) -> bool:
        """Whether the picture has a channel for what NPCs carry; by default where something can be carried."""
        given = self._scenario.observe.channels
        possible = (
            any(group.carryable for group in self._scenario.objects.values()) and len(self._symbols.cast) > 1
        )
        return possible if given is None else "carrying" in given

    def _slope(self) -> int:
        """Thousandths of the success reward that are lost by the horizon: `linear(0.9)`."""
        raw = self._scenario.reward.success
        found = re.fullmatch(r"\s*linear\(\s*(0(?:\.\d{1,3})?|1(?:\.0{1,3})?)\s*\)\s*", raw)
        if found is None:
            message = f"`{raw}` is not a reward; write linear(s), where s from 0 to 1 is lost by the horizon"
            self._findings.error("S204", message, self._findings.at(("reward", "success")))
            return 900
        return round(float(found.group(1)) * 1000)

    def report_heard(self, is_whole: bool) -> None:
        """What hearers take for something else; what only some of them tell apart, if the scenario `is_whole`."""
        if self._heard is None:
            return
        hearing.check_speakers(self.resolver, self._heard)
        if is_whole:
            names = [self.resolver.registers.read(f"{member}.name") for member in self._symbols.cast]
            hearing.report_alike(self.resolver, self._heard, names)

    def report_too_far(self, grown: Mapping[str, int]) -> None:
        """Registers that may come to numbers that none can hold: as they are set (`grown`), or to begin with."""
        registers, places = self.resolver.registers, self._findings.places
        found, spans = dict(grown), dict[str, Span]()
        for drawn in (*registers.drawn(), *registers.remembered):
            if not drawn.type.is_kept:
                found.setdefault(drawn.path.partition("(")[0], drawn.type.farthest)
                spans[drawn.path] = drawn.value.span
        for path, far in found.items():
            declaration, hint = registers.declaration(path), "bound it: `min(..., 1000)`"
            if declaration is None:
                self._findings.too_large("this", far, spans[path], hint=hint)
                continue
            name, source, when = declaration.label, declaration.source, ""
            if path in grown and registers.is_set(path):
                when = " in an episode"
                hint = f"bound what it is set to: `set: {{{name}: min(..., 100)}}`"
            span = places.key_span(source if source[-1] == name else source[:-1])
            self._findings.too_large(f"`{name}`", far, span, when, hint=hint)
