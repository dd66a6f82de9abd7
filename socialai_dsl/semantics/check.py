"""A scenario and its positions to a checked scenario: all mistakes of meaning, found in one go."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from operator import itemgetter
from typing import Final

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, did_you_mean
from socialai_dsl.schema import Scenario, Sequence
from socialai_dsl.schema.base import Expression
from socialai_dsl.schema.positions import DataPath, Positions
from socialai_dsl.schema.world import CHANNELS
from socialai_dsl.semantics import (
    behaviour,
    beliefs,
    checks,
    entities,
    sequences,
    setup,
    statuses,
    tables,
    world,
)
from socialai_dsl.semantics.absence import check_absences
from socialai_dsl.semantics.emptiness import check_placements
from socialai_dsl.semantics.entities import AGENT, Prelude
from socialai_dsl.semantics.findings import Findings, Scalar, surviving
from socialai_dsl.semantics.inhabitants import entities_of
from socialai_dsl.semantics.plans import Checked, FramePlan, OutcomePlan
from socialai_dsl.semantics.possible import check_possible
from socialai_dsl.semantics.probes import probes
from socialai_dsl.semantics.properties import properties
from socialai_dsl.semantics.registers import Ranges
from socialai_dsl.semantics.resolve import ScenarioResolver
from socialai_dsl.semantics.resolver import INT
from socialai_dsl.semantics.room import room_plan, room_sizes
from socialai_dsl.semantics.scope import PlayedFrame, at_every_step, frames_of, reset_scope
from socialai_dsl.semantics.sequences import performs
from socialai_dsl.semantics.terms import BOOL, Const, Line, Sited, Type
from socialai_dsl.semantics.utterances import MAX_TEXTS, number_of_texts, texts_of, words_in_order
from socialai_dsl.vocabulary import PRIMITIVES

_MAX_ROUNDS = 24

MAX_BODIES: Final = 128
"""How many objects and members of the cast a scenario may have."""


def check_meaning(
    scenario: Scenario,
    name: str,
    places: Positions,
    bag: DiagnosticBag,
    prelude: Prelude,
    data: object,
    params: Mapping[str, Scalar] | None = None,
    substituted: frozenset[DataPath] = frozenset(),
) -> Checked | None:
    """What a scenario means; None if something is wrong with it, which `bag` then says.

    Types that follow from uses (`pick(left | right)`, registers that are set) are found by resolving again with
    what the uses asked for, until nothing changes.

    Args:
        scenario: the models.
        name: what the result is called.
        places: where the parts of the file stand.
        bag: takes the findings.
        prelude: object types.
        data: the document the models were made from.
        params: the values of the file's parameters.
        substituted: paths of values that were a parameter as a whole.
    """
    words: dict[str, Type] = {}
    ranges = Ranges(scenario)
    checked: Checked | None = None
    for _ in range(_MAX_ROUNDS):
        found = DiagnosticBag()
        findings = Findings(found, places, params or {}, substituted, data)
        if AGENT not in scenario.cast:
            _no_agent(scenario, findings, places)
            break
        run = _Run(scenario, findings, prelude, words, ranges.now)
        checked = run.checked(name)
        registers = run.resolver.registers
        settled = registers.words == words
        words = registers.words
        if found.has_errors or (ranges.settled(registers.ranges) and settled):
            for path in ranges.unbounded:
                run.report_growth(path)
            if checked is not None:
                check_absences(checked, findings, check_placements(checked, findings))
            if checked is not None and not found.has_errors:
                check_possible(checked, findings)  # else what is missing would seem never to happen
            break
    bag.extend(_without_consequences(found, scenario))
    return None if found.has_errors else checked


def _no_agent(scenario: Scenario, findings: Findings, places: Positions) -> None:
    """There is nobody to act; perhaps because the name is misspelt."""
    message = "the cast has no `agent`"
    if (near := did_you_mean(AGENT, scenario.cast)) is not None:
        findings.error("S105", f"{message}, but `{near}`", places.key_span(("cast", near)), suggestion=AGENT)
    else:
        findings.error("S105", message, places.key_span(("cast",)), hint="add `agent: {}`")


def _without_consequences(found: DiagnosticBag, scenario: Scenario) -> Iterator[Diagnostic]:
    """What is wrong with the grammar makes many a text impossible to say, and a name that means two things makes many
    an expression senseless; that need not be said as well.
    """
    follow: set[str] = set()
    if any(d.code == checks.GRAMMAR_CODE for d in found):
        follow |= {"S401", "S402"}
    if entities.mean_two_things(scenario):
        follow |= {"S204", "S211"}
    return (d for d in found if d.code not in follow)


def _definitions(scenario: Scenario) -> Iterator[DataPath]:
    """Where the definitions of a scenario and of its frames stand."""
    yield from (("define", key) for key in scenario.define)
    for path, frame in frames_of(scenario):
        yield from ((*path, "define", key) for key in frame.define)


@dataclass(frozen=True)
class _Spoken:
    """What the members say: by member, the frame it plays and its lines."""

    frames: dict[str, behaviour.Spoken]

    def lines(self, members: Mapping[str, object]) -> dict[str, list[Line]]:
        """Member -> its lines in the order of its frame."""
        return {name: list(self.frames[name].lines.values()) for name in members if name in self.frames}


class _Run:
    """One resolution of a whole scenario."""

    def __init__(
        self,
        scenario: Scenario,
        findings: Findings,
        prelude: Prelude,
        words: Mapping[str, Type],
        ranges: Mapping[str, Type],
    ) -> None:
        self._scenario = scenario
        self._findings = findings
        sizes = room_sizes(scenario, findings)
        self._symbols = entities.symbols_of(scenario, prelude, sizes, findings)
        self._played = entities.played_frames(self._symbols, findings)
        self.resolver = ScenarioResolver(self._symbols, findings, self._played, words, ranges)

    def checked(self, name: str) -> Checked | None:
        """The checked scenario; None if it cannot be put together."""
        scenario, resolver, findings = self._scenario, self.resolver, self._findings
        if self._symbols.entities > MAX_BODIES:
            part = "objects" if len(scenario.objects) > len(scenario.cast) else "cast"
            found = self._symbols.entities
            message = f"a room holds at most {MAX_BODIES} objects and members of the cast, this one {found}"
            findings.error("S106", message, findings.places.key_span((part,)))
            return None
        checks.check_grammar(scenario, findings)
        entities.declare_registers(resolver)
        entities.check_slots(resolver)
        checks.check_flow(scenario, findings)
        spoken = self._spoken()
        outcomes = tuple(self._outcomes())
        plans = tuple(self._plans(spoken))
        self._look_at_unused()
        tables.look_at_all(resolver)
        placed = setup.placings(resolver)
        colors, turned = list(setup.colorings(resolver)), list(setup.facings(resolver))
        computed, rules = statuses.computed(resolver), tuple(world.rules(resolver))
        remembered, required = tuple(sequences.memories(resolver)), tuple(world.requirements(resolver))
        inhabitants = tuple(entities_of(resolver))
        believed = tuple(beliefs.beliefs(resolver))
        drawn = resolver.registers.drawn()
        in_order = setup.ordered(resolver, placed, colors, turned, drawn)
        room = room_plan(resolver)
        claimed = tuple(properties(resolver, outcomes, drawn))
        asked = probes(resolver)
        if findings.bag.has_errors:
            return None
        for plan in plans:
            checks.check_shadowed(plan, findings)
        self._report_unused()
        names = [resolver.registers.read(f"{member}.name") for member in self._symbols.cast]
        words = words_in_order(scenario.grammar, names, spoken.lines(self._symbols.cast))
        return Checked(
            name=name,
            horizon=scenario.horizon,
            actions=tuple(action for action in PRIMITIVES if action in scenario.actions),
            templates=scenario.grammar.templates,
            nouns=tuple(str(noun) for noun in scenario.grammar.nouns),
            room=room,
            entities=inhabitants,
            setup=in_order,
            frames=plans,
            outcomes=outcomes,
            words_in_order=words,
            npcs_hidden=scenario.observe.npcs == "hidden",
            picture_before_npcs=scenario.observe.image == "before_npcs",
            names_shown=scenario.observe.names == "shown",
            own_voice=scenario.observe.own_voice,
            computed=computed,
            remembered=tuple(resolver.registers.remembered),
            memories=remembered,
            rules=rules,
            require=required,
            egocentric=scenario.observe.directions == "egocentric",
            slope=self._slope(),
            beliefs=tuple(believed),
            channels=self._channels(),
            each_step=round(scenario.reward.each_step * 1_000_000),
            properties=claimed,
            probes=asked,
            readings=resolver.readings,
        )

    def _spoken(self) -> _Spoken:
        """What everybody says, before what anybody hears."""
        found = {member: behaviour.lines_of(self.resolver, played) for member, played in self._played.items()}
        for member, spoken in found.items():
            for line in spoken.lines.values():
                if number_of_texts(line) > MAX_TEXTS:
                    message = f"this can be {number_of_texts(line)} different texts; at most {MAX_TEXTS} are possible"
                    self._findings.error("S212", message, line.span)
                elif member != AGENT:
                    self.resolver.utterances.add_npc_texts(member, texts_of(line))
        for member, played in self._played.items():
            if member != AGENT and performs(played.model):
                self.resolver.utterances.add_npc_texts(member, self.resolver.utterances.all_texts())
        return _Spoken(found)

    def _plans(self, spoken: _Spoken) -> Iterator[FramePlan]:
        # Members act in the order of their entities: the agent, then the cast as written.
        for member, number in sorted(self._symbols.numbers.items(), key=itemgetter(1)):
            if member in self._played:
                yield behaviour.plan(self.resolver, self._played[member], spoken.frames[member])
            elif self._symbols.cast[member].beliefs:
                span = self._findings.places.key_span(("cast", member))
                yield beliefs.watching(member, number, span)

    def _look_at_unused(self) -> None:
        """Frames that nobody plays are checked as if somebody did, so that no mistake waits for its first use."""
        played = {frame.name for frame in self._played.values()}
        npcs = [name for name in self._symbols.cast if name != AGENT]
        # `it` means something only to one of a group, so such a member looks at what nobody plays.
        npc = next((name for name in npcs if self._symbols.group_of(name)), next(iter(npcs), AGENT))
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
        """Definitions, draws and tables that nothing uses (W317), in a scenario of a single file: those of several
        may be there for what else is built of these files.
        """
        places, scenario = self._findings.places, self._scenario
        drawn = [key for key, value in scenario.let.items() if not isinstance(value, Sequence)]
        paths: list[DataPath] = [
            *(("let", key) for key in drawn),
            *(("tables", key) for key in scenario.tables),
            *_definitions(scenario),
        ]
        parts: list[DataPath] = [(name,) for name in scenario.model_fields_set]
        if len({places.key_span(path).file for path in (*parts, *paths)}) > 1:
            return
        for path in paths:
            if path not in self.resolver.used:
                name = str(path[-1]).partition("(")[0].strip()
                hint = "delete it, or use it where it was meant"
                self._findings.warning("W317", f"nothing uses `{name}`", places.key_span(path), hint=hint)

    def _look_at(self, frame: PlayedFrame) -> None:
        remembered = self.resolver.registers.remembered
        asked = len(remembered)
        entities.declare_frame(self.resolver, frame)
        behaviour.plan(self.resolver, frame, behaviour.lines_of(self.resolver, frame))
        del remembered[asked:]  # what only this frame asks about the step before is asked by nobody

    def _outcomes(self) -> Iterator[OutcomePlan]:
        findings = self._findings
        for i, outcome in enumerate(self._scenario.outcome):
            given = [key for key in ("success", "failure") if getattr(outcome, key) is not None]
            path: DataPath = ("outcome", i)
            if len(given) != 1:
                code, what = ("S107", "has only one of") if given else ("S105", "needs")
                message = (
                    f"an outcome {what} `success` and `failure`"
                    if given
                    else "an outcome needs `success` or `failure`"
                )
                findings.error(code, message, findings.places.value_span(path))
                continue
            kind = given[0]
            span = findings.at((*path, kind))
            scope = reset_scope((*path, kind))
            with surviving():
                raw = getattr(outcome, kind)
                term = self.resolver.written((*path, kind), raw, BOOL, at_every_step(scope))
                line = findings.places.key_span((*path, kind)).line
                condition = Sited(term, scope.draws.site, span)
                self.resolver.readings.entries[condition.site] = outcome
                percent, graded = self._reward(outcome.reward, (*path, "reward"))
                if kind == "failure" and "reward" in outcome.model_fields_set:
                    place = findings.places.key_span((*path, "reward"))
                    findings.error("S107", "a failure earns nothing, so it has no `reward`", place)
                name = outcome.id or f"{kind}@{line}"
                yield OutcomePlan(name, kind == "success", percent, condition, graded)

    def _reward(self, raw: Expression, path: DataPath) -> tuple[int, Sited | None]:
        """Per cent of the success reward, or what computes it."""
        scope = at_every_step(reset_scope(path))
        term = self.resolver.written(path, raw, INT, scope)
        span = self._findings.at(path)
        if not isinstance(term, Const):
            return 100, Sited(term, scope.draws.site, span)
        if not 0 <= term.value <= 100:
            message = f"`{term.value}` is not a per cent of the success reward"
            raise self._findings.fail("S106", message, span, hint="from 0 to 100")
        return term.value, None

    def _channels(self) -> int:
        """How many channels the picture has: the first four, or all."""
        given = self._scenario.observe.channels
        if given not in (CHANNELS[:4], CHANNELS):
            message = (
                "`channels` are " + ", ".join(CHANNELS[:4]) + ", and perhaps " + " and ".join(CHANNELS[4:])
            )
            self._findings.error("S106", message, self._findings.places.key_span(("observe", "channels")))
        return 4 if given == CHANNELS[:4] else 6

    def _slope(self) -> int:
        """Thousandths of the success reward that are lost by the horizon: `linear(0.9)`."""
        raw = self._scenario.reward.success
        found = re.fullmatch(r"\s*linear\(\s*(0(?:\.\d{1,3})?|1(?:\.0{1,3})?)\s*\)\s*", raw)
        if found is None:
            message = f"`{raw}` is not a reward; write linear(s), where s from 0 to 1 is lost by the horizon"
            self._findings.error("S204", message, self._findings.at(("reward", "success")))
            return 900
        return round(float(found.group(1)) * 1000)

    def report_growth(self, path: str) -> None:
        """A register whose range has no end."""
        source = self.resolver.registers.source(path)
        name = source[-1]
        span = self._findings.places.key_span(source)
        hint = f"bound it: `set: {{{name}: min({name} * 2, 100)}}`"
        self._findings.error("S106", f"`{name}` can grow without end", span, hint=hint)
