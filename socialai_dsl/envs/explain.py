"""Explanations of the last step: rules that fired, reasons why others did not, and members in the way.

The episode is played again by a program that notes what was asked and what was false (`compiler.notes`), on the same
engine, from the same moment, with the same actions. That it ends in the same state is checked each time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.compilation import ConditionPart, Note, Value, compile_noting
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.table import Start, Table
from socialai_dsl.envs.values import shown, utterance_text
from socialai_dsl.program import (
    CELL,
    ENTITY_FIELDS,
    FIRST_ENTITY,
    SECRET,
    EntityColumn,
    Field,
    Flag,
    Header,
    LineColumn,
    Program,
    Register,
    place_of,
)
from socialai_dsl.program_suite import ProgramSuite
from socialai_dsl.schema.annotations import keys_of
from socialai_dsl.schema.scenario import DOES, Model
from socialai_dsl.semantics.plans import CheckedScenario, FramePlan, OutcomePlan, RulePlan, StepPlan
from socialai_dsl.semantics.terms import Const, Read, Readings, Term
from socialai_dsl.semantics.words import ACTIVITIES
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import spelt


@dataclass
class Recording:
    """A moment, and what all seats have done since then.

    Attributes:
        actions: of each step, int64 (S, heads) as bytes.
        taken: of each step, on which seats somebody sat, bool (S,); empty where the agent plays alone.
    """

    start: Start
    actions: list[bytes] = field(default_factory=list)
    taken: list[NDArray[np.bool_]] = field(default_factory=list)


# -- who or what stands in the way ---------------------------------------------------------------------------


Cell = tuple[int, int]

_STEPS: Final = ((0, 1), (0, -1), (1, 0), (-1, 0))
_FREE, _BODY, _THING = 1, 1_000, 100_000
"""What a step costs: a way round is better than one through a member of the cast, and that than one through a thing."""
_AGENT: Final = 0


@dataclass(frozen=True)
class RoomState:
    """A room as it is now.

    Attributes:
        program: what is played. registers: int32 (R,). board: looks of the cells, then lines of solid ones.
    """

    program: Program
    registers: NDArray[np.int32]
    board: NDArray[Any]

    def obstruction(self, mover: int, goal: int, beside: bool) -> str | None:
        """Why an inhabitant has no way to an entity or cell, or to a free cell `beside` it; None if it has one."""
        start, end = self._cell(mover), self._cell(goal)
        if end is None:
            return "its goal is not in the room"
        if start is None or start == end:
            return None
        costs = self._costs(mover)
        ends = {(end[0] + dx, end[1] + dy) for dx, dy in _STEPS} & costs.keys() if beside else {end}
        if not beside:
            costs[end] = _FREE
        if start in ends:
            return None
        way = _cheapest(start, ends, costs)
        if way is None:
            return "there is no way: walls lie between"
        found = list(dict.fromkeys(name for cell in way if costs[cell] > _FREE for name in self._in(cell)))
        return f"there is no way: {_listed(found)} in the way" if found else None

    def _cell(self, number: int) -> Cell | None:
        """Where an entity is; a goal may be a cell itself."""
        if number >= CELL:
            return place_of(number)
        fields = self.registers[FIRST_ENTITY + ENTITY_FIELDS * number :]
        if fields[Field.GONE] or fields[Field.X] < 0:
            return None
        return int(fields[Field.X]), int(fields[Field.Y])

    def _costs(self, mover: int) -> dict[Cell, int]:
        """What it costs to step on a cell; those of walls are left out."""
        width, height = (self.program.header(h) for h in (Header.CANVAS_WIDTH, Header.CANVAS_HEIGHT))
        taken = {self._cell(number): number for number in range(len(self.program.entities))}
        deadly, costs = self.program.header(Header.DEADLY), {}
        for y in range(height):
            solid = int(self.board[width * height + 1 + y])
            for x in range(width):
                code = int(self.board[y * width + x]) & 0xFF
                kills = code < 32 and deadly >> code & 1
                if (solid >> x & 1 and (x, y) in taken) or kills:
                    costs[x, y] = _THING
                elif not solid >> x & 1:
                    costs[x, y] = _FREE
        hidden = self.program.header(Header.FLAGS) & Flag.NPCS_HIDDEN
        for number, entity in enumerate(self.program.entities):
            cell = self._cell(number)
            blocks = entity.role != "object" and number != mover and not (mover == _AGENT and hidden)
            if blocks and cell is not None and costs.get(cell) == _FREE:
                costs[cell] = _BODY
        return costs

    def _in(self, cell: Cell) -> Iterator[str]:
        """Who and what is in a cell, with its place."""
        names = [str(e) for n, e in enumerate(self.program.entities) if self._cell(n) == cell]
        yield from (f"{name} at {cell[0]},{cell[1]}" for name in names or ["what is deadly"])


def _cheapest(start: Cell, ends: set[Cell], costs: dict[Cell, int]) -> list[Cell] | None:
    """The cells of a cheapest way behind its start; None if there is none."""
    left: list[tuple[int, Cell]] = [(0, start)]
    before: dict[Cell, Cell] = {}
    spent = {start: 0}
    while left:
        cost, cell = heappop(left)
        if cell in ends:
            way = [cell]
            while before[way[-1]] != start:
                way.append(before[way[-1]])
            return way[::-1]
        for dx, dy in _STEPS:
            following = cell[0] + dx, cell[1] + dy
            if following in costs and cost + costs[following] < spent.get(following, 1 << 60):
                spent[following] = cost + costs[following]
                before[following] = cell
                heappush(left, (spent[following], following))
    return None


def _listed(names: Sequence[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last} are" if others else f"{last} is"


# -- rules and their reasons ---------------------------------------------------------------------------------


class Explainer:
    """Plays the steps of an environment again and reads what was noted in the last one.

    Args:
        program: what the environment plays. scenario: what it was compiled from.
        suite: the suite it is a member of, None if it plays alone.
        number: which member it is.
        seats: how many seats the environment plays.
    """

    def __init__(
        self,
        program: Program,
        scenario: CheckedScenario,
        suite: ProgramSuite | None,
        number: int,
        seats: int,
    ) -> None:
        self._checked = scenario
        self._program = program
        self._noting = compile_noting(scenario)
        self._table = Table([_alone(self._noting.program, suite, number)], 1, all_seats=seats > 1)
        self._table.reset(0, None)
        self._recording: Recording | None = None
        self._steps = 0
        self._fired = np.zeros_like(self._table.batch.counters)

    def explain(self, recording: Recording, reached: NDArray[np.int32] | None) -> dict[str, Any]:
        """Explain the last step of a recording, which led to these registers, int32 (R,), if they are known.

        See `ScenarioEnv.explain`.
        """
        self._play(recording)
        registers = self._table.state.registers[0]
        known = self._noting.first
        same = reached is None or np.array_equal(registers[:known], reached[:known])
        assert same, "internal: the step that was explained went another way"
        notes = _Notes(self._noting.program, self._program, registers, self._table.state.boards[0])
        story = _Story(self._checked, self._noting.rules, self._noting.outcomes, notes, self._fired)
        entries = list(story.entries())
        return {
            "t": int(registers[Register.T]),
            "fired": [entry for entry in entries if entry["fired"]],
            "others": [entry for entry in entries if not entry["fired"]],
        }

    def _play(self, recording: Recording) -> None:
        """Play what was recorded, from where it was left: a recording only grows."""
        if recording is not self._recording:
            self._begin(recording.start)
            self._recording, self._steps = recording, 0
        state, batch = self._table.state, self._table.batch
        for step in range(self._steps, len(recording.actions)):
            if recording.taken:
                batch.ports.taken[:] = recording.taken[step]
            state.registers[0, self._noting.first :] = 0
            before = batch.counters.copy()
            action = np.frombuffer(recording.actions[step], np.int64)
            batch.ports.actions[:] = action.reshape(batch.ports.actions.shape)
            batch.step(Task.STEP_ONLY)
            self._fired = np.asarray(batch.counters - before)
        self._steps = len(recording.actions)

    def _begin(self, start: Start) -> None:
        state = self._table.state
        state.keys[0] = self._table.own_keys(start.key)
        state.registers[:] = 0
        state.registers[0, : self._noting.first] = start.registers[: self._noting.first]
        state.boards[0] = start.board[: state.boards.shape[1]]
        state.tokens[:] = 0


def _alone(program: Program, suite: ProgramSuite | None, number: int) -> Program | ProgramSuite:
    """The program with the action space of the suite that it is a member of."""
    if suite is None:
        return program
    return ProgramSuite(
        suite.name,
        (program,),
        (suite.members[number],),
        suite.actions,
        suite.sentences,
        (suite.template_maps[number],),
        (suite.slot_maps[number],),
    )


@dataclass(frozen=True)
class _Notes:
    """What such a program has noted, in words."""

    noting: Program
    program: Program
    registers: NDArray[np.int32]
    board: NDArray[Any]

    def number(self, note: Note) -> int:
        """The number in `Note.register`."""
        return int(self.registers[note.register])

    def values(self, part: ConditionPart) -> dict[str, Any]:
        """The values of a part, by their text."""
        return {value.words: self._value(value) for value in part.values if value.words}

    def why(self, note: Note, words: str) -> str:
        """Why a rule did not fire: its first part that was false."""
        number = self.number(note)
        part = note.parts[abs(number) - 1]
        written = part.words or words
        if number < 0:
            return f"{written} finds nothing" if written else "something that it needs is not there"
        match part.key:
            case "hears":
                return f"{words}: {self._heard(part)}"
            case "once":
                return "it fires once, and has fired before"
            case "after" | "for":
                return f"{words}: turn {self._plain(part)[0]} of this state"
            case "chance":
                return f"{words}: not drawn"
            case "do":
                hindered = self._hindered(note.plan)
                return f"{words} is not finished" + (f": {hindered}" if hindered else "")
        values = ", ".join(f"{name} is {spelt(value)}" for name, value in self.values(part).items())
        return f"{written} is false" + (f": {values}" if values else "")

    def _hindered(self, plan: RulePlan | StepPlan | OutcomePlan) -> str | None:
        """What keeps a member from getting where an entry of `steps` lets it go."""
        if not isinstance(plan, StepPlan) or (goes := ACTIVITIES[plan.activity.name].goes) is None:
            return None
        member, number = plan.name.partition(".")[0], plan.name.rpartition("[")[2].rstrip("]")
        goal = self._goal(plan.activity.args[0], f"{member}.aim[{number}]")
        mover = [str(entity) for entity in self.program.entities].index(member)
        if goal is None or goal < 0:
            return None
        moment = RoomState(self.program, self.registers, self.board)
        return moment.obstruction(mover, goal, beside=goes == "beside")

    def _goal(self, term: Term, noted: str) -> int | None:
        """The entity or cell that an activity is about, if a register or the scenario says it."""
        if isinstance(term, Const):
            return term.value
        wanted = (term.path, noted) if isinstance(term, Read) else (noted,)
        found = {name.path: name.register for name in self.noting.registers}
        register = next((found[path] for path in wanted if path in found), None)
        return None if register is None else int(self.registers[register])

    def _plain(self, part: ConditionPart) -> list[int]:
        return [int(self.registers[value.name.register]) for value in part.values]

    def _value(self, value: Value) -> Any:
        number, name = int(self.registers[value.name.register]), value.name
        known = not name.values or name.low <= number <= name.high
        if name.kind == "entity" and not 0 <= number < len(self.program.entities):
            known = False
        return shown(self.program, name, number) if known else None

    def _heard(self, part: ConditionPart) -> str:
        """What was heard instead, or why nothing was."""
        count, *classes, distance = self._plain(part)
        said = int(self.registers[Register.UTTERANCE])
        own = str(utterance_text(self.program, said)) if said else ""
        if count == 0:
            if not said:
                return "nothing was heard"
            agent = self.program.table(Header.ENTITY_AT)[0]
            near, far = int(agent[EntityColumn.NEAR]), int(agent[EntityColumn.FAR])
            if near <= distance <= far:
                return f'nothing was heard, though the agent said "{own}"'
            return (
                f'nothing was heard: the agent said "{own}" at distance {distance}, its voice carries {far}'
            )
        spoken = int(self.registers[Register.CLASS])
        texts = [own if said and number == spoken else self._text(number) for number in classes[:count]]
        return "heard " + " and ".join(dict.fromkeys(f'"{text}"' for text in texts))

    def _text(self, number: int) -> str:
        """A line of this class: one that was said in this step, if it can be told."""
        program = self.program
        table = program.table(Header.LINE_AT)
        first, heard = program.header(Header.HEARD), int(self.registers[Register.HEARD])
        lines = [int(line) for line in self.registers[first : first + heard]]
        fitting = np.flatnonzero(table[:, LineColumn.CLASS] % SECRET == number).tolist()
        told = [line for line in lines if line in fitting] or fitting
        return program.lines[told[0]] if len(told) == 1 else "something else"


@dataclass(frozen=True)
class _Story:
    """The rules of a step in the order in which they were asked."""

    checked: CheckedScenario
    rules: dict[int, Note]
    outcomes: dict[int, Note]
    notes: _Notes
    raised: NDArray[np.int64]

    def entries(self) -> Iterator[dict[str, Any]]:
        """One for each rule that was asked, and for those that would have come after one that fired."""
        counter = 0
        for frame in self.checked.frames:
            size = len(frame.steps) + len(frame.rules)
            yield from self._frame(frame, range(counter, counter + size))
            counter += size
        for number in range(counter, counter + len(self.checked.rules)):
            yield from self._asked(number, "world", {}, "world rule")
        ended = self.raised[counter + len(self.checked.rules) :]
        listed = [(note.plan, note, bool(ended[number])) for number, note in sorted(self.outcomes.items())]
        yield from self._list(listed, "outcome", {}, "outcome")

    def _frame(self, frame: FramePlan, counters: range) -> Iterator[dict[str, Any]]:
        if frame.steps:
            for number, step in zip(counters, frame.steps, strict=True):
                named = {"state": step.state} if step.state else {}
                yield from self._asked(number, frame.member, named, "step")
            return
        numbers = iter(counters)
        lists: list[tuple[str, str, list[tuple[Any, Note | None, bool]]]] = []
        for state in frame.states:
            for part, rules in (("first", state.first), ("then", state.then)):
                own = [next(numbers) for _ in rules]
                found = [
                    (rule, self.rules.get(number), bool(self.raised[number]))
                    for rule, number in zip(rules, own, strict=True)
                ]
                lists.append((state.name, part, found))
        for name, part, found in _in_turn([one for one in lists if self._is_asked(one[2])]):
            yield from self._list(found, frame.member, {"state": name, "list": part}, "rule")

    def _is_asked(self, found: Iterable[tuple[Any, Note | None, bool]]) -> bool:
        return any(fired or (note is not None and self.notes.number(note)) for _, note, fired in found)

    def _list(
        self, found: Sequence[tuple[Any, Note | None, bool]], who: str, more: dict[str, Any], kind: str
    ) -> Iterator[dict[str, Any]]:
        """A list of which the first that holds fires; nothing if it was not read."""
        if not self._is_asked(found):
            return
        before: Span | None = None
        for plan, note, fired in found:
            entry = self._entry(plan, who, more, kind, fired)
            if not fired and before is not None:
                entry["why"] = f"not asked: line {before.line} came first"
            elif not fired and note is not None:
                entry |= self._reason(note)
            yield entry
            if fired:
                before = _span(plan)

    def _asked(self, number: int, who: str, more: dict[str, Any], kind: str) -> Iterator[dict[str, Any]]:
        """One that is asked for itself; nothing if it was not."""
        note = self.rules.get(number)
        fired = bool(self.raised[number])
        if note is None or not (fired or self.notes.number(note)):
            return
        entry = self._entry(note.plan, who, more, kind, fired)
        yield entry if fired else entry | self._reason(note)

    def _reason(self, note: Note) -> dict[str, Any]:
        number = self.notes.number(note)
        part = note.parts[abs(number) - 1]
        words = part.words or self._words_of(note.plan, part.key)
        values = self.notes.values(part) if number > 0 else {}
        return {"why": self.notes.why(note, words), "part": words, "values": values}

    def _entry(
        self, plan: RulePlan | StepPlan | OutcomePlan, who: str, more: dict[str, Any], kind: str, fired: bool
    ) -> dict[str, Any]:
        span = _span(plan)
        return {
            "who": who,
            "kind": kind,
            **more,
            "name": plan.name,
            "at": f"{span.file}:{span.line}",
            "words": self._words_of(plan),
            "fired": fired,
        }

    def _words_of(self, plan: RulePlan | StepPlan | OutcomePlan, key: str = "") -> str:
        """How a rule is written, in one line, or one of its keys."""
        readings = self.checked.readings or Readings()
        model = readings.entries.get(_site(plan))
        if model is None:
            return ""
        written = _written(model)
        if key:
            return f"{key}: {_flow(written[key])}" if key in written else ""
        asked = [key for key in keys_of(type(model)) if key not in (*DOES, "id", "state")]
        keys = [key for key in (*asked, *DOES) if key in written]
        return ", ".join(f"{word}: {_flow(written[word])}" for word in keys)


def _in_turn(lists: list[tuple[str, str, list[tuple[Any, Note | None, bool]]]]) -> Iterator[Any]:
    """Lists of a frame that were read in a step: `first`, then the lists of `then` as `goto_now` leads through them."""
    left = [one for one in lists if one[1] == "then"]
    yield from (one for one in lists if one[1] == "first")
    while left:
        aims = {plan.goto_now for _, _, found in left for plan, _, fired in found if fired and plan.goto_now}
        following = next((one for one in left if one[0] not in aims), left[0])
        left.remove(following)
        yield following


def _span(plan: RulePlan | StepPlan | OutcomePlan) -> Span:
    return plan.condition.span if isinstance(plan, OutcomePlan) else plan.span


def _site(plan: RulePlan | StepPlan | OutcomePlan) -> str:
    """What a rule is called among the readings."""
    if isinstance(plan, OutcomePlan):
        return plan.condition.site
    return plan.site if isinstance(plan, RulePlan) else plan.name


def _written(model: Model) -> dict[str, Any]:
    """The keys that an author wrote, with their values."""
    given = model.model_dump(by_alias=True, exclude_unset=True)
    return {key: value for key, value in given.items() if value not in (None, (), {})}


def _flow(value: Any) -> str:
    """A value as it could be written in one line of YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list | tuple):
        return _flow(value[0]) if len(value) == 1 else "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, float):
        return f"{value:g}"
    return spelt(value) if isinstance(value, bool) else " ".join(str(value).split())
