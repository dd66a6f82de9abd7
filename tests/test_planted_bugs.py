"""The comparison with the reference has teeth: planted mistakes in what the language means are all found.

They are planted in the resolved scenario before it is compiled (what a wrong compiler would make of it), in the
instructions that the compiler wrote, one kind after the other, and in the reference's order of events (what a wrong
engine would do). So the compiler and the engine need no tests of what each construct is worth: those of their own are
about what the comparison cannot see, such as short code and sound tables.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.compiler.tables import InvalidProgramError, verify
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.frontend import load
from socialai_dsl.program import TESTS, FrameColumn, Header, Op, OpClass, Program
from socialai_dsl.program.instructions import TABLE
from socialai_dsl.semantics import plans, terms
from socialai_dsl.semantics.plans import CheckedScenario, FramePlan, RulePlan
from tests.agreement import Disagreement, Pair, agree, seats_agree
from tests.quick import one_in
from tests.reference import bodies
from tests.reference.interpreter import Action, Reference, Result
from tests.reference.world import Entity

SAMPLES = Path(__file__).parent / "data" / "agreement"
COUNTING = str(SAMPLES / "counting.yaml")
WALKERS = str(SAMPLES / "walkers.yaml")
CROWD = str(SAMPLES / "crowd.yaml")
PERILS = str(SAMPLES / "perils.yaml")
CREW = str(SAMPLES / "crew.yaml")
LOOKOUTS = str(SAMPLES / "lookouts.yaml")
PARTNERS = str(SAMPLES / "partners.yaml")
SHIPPED_SAMPLES = ("talkitout+oracle", "showme+oracle", "school/boxes+pointing", "novel/interpreter")
EPISODES = 60
STEPS = 800

Change = Callable[[CheckedScenario], CheckedScenario]


def in_frames(change: Callable[[FramePlan], FramePlan]) -> Change:
    return lambda checked: replace(checked, frames=tuple(change(frame) for frame in checked.frames))


def in_rules(change: Callable[[RulePlan], RulePlan]) -> Change:
    def frame(plan: FramePlan) -> FramePlan:
        states = tuple(
            replace(s, first=tuple(map(change, s.first)), then=tuple(map(change, s.then)))
            for s in plan.states
        )
        return replace(plan, states=states)

    return in_frames(frame)


def in_setup(change: Callable[[Any], Any]) -> Change:
    return lambda checked: replace(checked, setup=tuple(change(item) for item in checked.setup))


def last_rule_wins(plan: FramePlan) -> FramePlan:
    return replace(plan, states=tuple(replace(s, then=s.then[::-1]) for s in plan.states))


def any_place(item: Any) -> Any:
    return replace(item, where=None) if isinstance(item, plans.Placing) else item


def any_color(item: Any) -> Any:
    return replace(item, distinct_from=()) if isinstance(item, plans.Coloring) else item


def liar_may_be_right(rule: RulePlan) -> RulePlan:
    def open_up(part: Any) -> Any:
        if isinstance(part, terms.FieldOf) and isinstance(part.entity, terms.Quantification):
            return replace(part, entity=replace(part.entity, condition=None))
        return part

    return (
        replace(rule, say=replace(rule.say, parts=tuple(map(open_up, rule.say.parts)))) if rule.say else rule
    )


def no_time_for_goto_now(rule: RulePlan) -> RulePlan:
    return replace(rule, goto=rule.goto_now, goto_now=None) if rule.goto_now else rule


def everything_is_success(checked: CheckedScenario) -> CheckedScenario:
    return replace(checked, outcomes=checked.outcomes[::-1])


def farther(checked: CheckedScenario) -> CheckedScenario:
    return replace(checked, entities=tuple(replace(e, near=e.near, far=e.far + 1) for e in checked.entities))


PLANTED: dict[str, tuple[str, Change]] = {
    "`after` off by one": (
        COUNTING,
        in_rules(lambda rule: replace(rule, after=rule.after + 1 if rule.after else 0)),
    ),
    "`once` ignored": (COUNTING, in_rules(lambda rule: replace(rule, once=False))),
    "the last rule that holds fires": (COUNTING, in_frames(last_rule_wins)),
    "goto_now waits a turn": (COUNTING, in_rules(no_time_for_goto_now)),
    "a rule of `first` does not take the whole turn": (
        COUNTING,
        in_rules(lambda rule: replace(rule, do=None)),
    ),
    "sets are lost": (COUNTING, in_rules(lambda rule: replace(rule, sets=()))),
    "sets see each other": (COUNTING, in_rules(lambda rule: replace(rule, sets=rule.sets[::-1][:1]))),
    "chance is certain": (COUNTING, in_rules(lambda rule: replace(rule, chance=None))),
    "voices carry one cell too far": ("talkitout+oracle", farther),
    "the liar may name the right door": ("talkitout+oracle", in_rules(liar_may_be_right)),
    "NPCs may block doors": ("talkitout+oracle", in_setup(any_place)),
    "two doors may share a colour": ("talkitout", in_setup(any_color)),
    "the outcome list is read from below": ("talkitout+oracle", everything_is_success),
    "the picture is taken before the NPCs act": (
        WALKERS,
        lambda checked: replace(checked, picture_before_npcs=not checked.picture_before_npcs),
    ),
    "effects are lost": (
        WALKERS,
        in_frames(lambda plan: replace(plan, steps=tuple(replace(s, causes=()) for s in plan.steps))),
    ),
    "steps last one turn": (
        WALKERS,
        in_frames(lambda plan: replace(plan, steps=tuple(replace(s, duration=1) for s in plan.steps))),
    ),
    "hidden NPCs who are always audible are silent": (
        "talkitout_no_liar+as_coded+unsocial",
        lambda checked: replace(checked, entities=tuple(replace(e, audible=False) for e in checked.entities)),
    ),
    "nobody goes out of the way": (
        CROWD,
        lambda checked: replace(
            checked, entities=tuple(replace(e, pushed_by_bodies=False) for e in checked.entities)
        ),
    ),
    "the agent does not hear itself": (PERILS, lambda checked: replace(checked, own_voice=False)),
}


@pytest.mark.parametrize("bug", one_in(8, PLANTED, "plays on the slow interpreter"))
def test_a_wrong_compiler_is_found_out(bug: str) -> None:
    name, change = PLANTED[bug]
    checked = load(name).checked
    wrong = change(checked)
    assert wrong != checked, "nothing was planted"
    with pytest.raises(Disagreement):
        agree(name, EPISODES, seed=5, program=compile_scenario(wrong))


# -- instructions ------------------------------------------------------------------------------------------------


def others(program: Program, op: Op, write: Callable[[np.ndarray], None]) -> Program:
    """The program with all instructions of one kind written otherwise; `write` gets them, int64 (rows, 4)."""
    words = program.words.copy()
    start = program.header(Header.CODE_AT)
    code = words[start : start + program.code.size].reshape(-1, 4)
    rows = code[code[:, 0] == op]
    write(rows)
    code[code[:, 0] == op] = rows
    return replace(program, words=words)


def left_out(rows: np.ndarray) -> None:
    """They do nothing; a test holds."""
    rows[:] = (Op.SKIP, 0, 0, 0)


def never(rows: np.ndarray) -> None:
    """They do not hold."""
    rows[:, :3] = (Op.SKIP, 0, 0)


def taken_for(op: Op) -> Callable[[np.ndarray], None]:
    """They are others."""

    def write(rows: np.ndarray) -> None:
        rows[:, 0] = op

    return write


ALIKE = (
    (Op.IF_EQ, Op.IF_NE, Op.IF_LT, Op.IF_LE),
    (Op.IF_SAME_CELL, Op.IF_NEXT_TO, Op.IF_FACES, Op.IF_IN_FRONT_OF, Op.IF_EYE_CONTACT, Op.IF_FACES_TOWARD),
    (Op.IF_IN_LINE, Op.IF_REACHES, Op.IF_LOOKS_AT, Op.IF_UNOBSTRUCTED),
    (Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.MOD, Op.MIN, Op.MAX),
    (Op.LOAD, Op.ABS, Op.COUNT_BITS, Op.LOWEST_BIT),
    (Op.DISTANCE, Op.QUADRANT),
    (Op.HEARD_FROM, Op.HEARD_NOUN),
    (Op.GO_TO, Op.GO_NEXT_TO, Op.FACE),
    (Op.POINT, Op.EXPLORE),
    (Op.B_NEXT_TO, Op.B_IN_FRONT_OF),
    (Op.B_AND, Op.B_OR, Op.B_WITHOUT),
)
"""Instructions with the same operands; each is taken for the next."""

UNSEEN = {Op.COUNT, Op.IF_UNPINNED}
"""What an episode does not show: how often a rule fired, which the counters tell, and what a layout gives."""

WRONG = {
    **{
        f"{op.name} is left out": (op, left_out)
        for op, entry in TABLE.items()
        if entry.op_class is not OpClass.CONTROL and op not in UNSEEN
    },
    **{f"{op.name} never holds": (op, never) for op in TESTS if op not in UNSEEN},
    **{
        f"{op.name} is {group[k - 1].name}": (op, taken_for(group[k - 1]))
        for group in ALIKE
        for k, op in enumerate(group)
    },
}
WRITTEN = [*SHIPPED_SAMPLES, *sorted(str(path) for path in SAMPLES.glob("*.yaml"))]


@pytest.fixture(scope="module")
def programs() -> dict[str, Program]:
    return {name: compile_scenario(load(name).checked) for name in WRITTEN}


@pytest.mark.parametrize("bug", one_in(10, WRONG, "plays on the slow interpreter"))
def test_a_wrong_instruction_is_found_out(bug: str, programs: dict[str, Program]) -> None:
    """By a comparison, or already by the verifier."""
    op, write = WRONG[bug]
    often = {name: int(np.count_nonzero(program.code[:, 0] == op)) for name, program in programs.items()}
    written = sorted((name for name in often if often[name]), key=lambda name: -often[name])
    assert written, f"no sample has {op.name}"
    with pytest.raises((Disagreement, InvalidProgramError, RoomError)):
        compare({name: others(programs[name], op, write) for name in written})


def compare(programs: dict[str, Program]) -> None:
    """Verify each program, and play it beside the reference: a little of all first, then more."""
    for name, program in programs.items():
        verify(program)
        agree(name, 2, seed=5, program=program)
    for name, program in programs.items():
        agree(name, EPISODES, seed=6, program=program)


# -- order -------------------------------------------------------------------------------------------------------


def npcs_in_reverse(program: Program) -> Program:
    """The rows of the frame table in reverse: NPCs act in the wrong order."""
    words = program.words.copy()
    start, rows = program.header(Header.FRAME_AT), program.header(Header.FRAMES)
    table = words[start : start + rows * FrameColumn.COLUMNS].reshape(rows, FrameColumn.COLUMNS)
    table[:] = table[::-1].copy()
    return replace(program, words=words)


def test_the_order_of_npcs_matters() -> None:
    program = compile_scenario(load(COUNTING).checked)
    with pytest.raises(Disagreement):
        agree(COUNTING, EPISODES, seed=5, program=npcs_in_reverse(program))


class SpeaksBeforeMoving(Reference):
    """Delivers the agent's utterance from where it stood before its body action."""

    def step(self, action: Action) -> Result:
        early = [(npc, npc.cell) for npc in self.world.npcs]
        assert early, "this needs NPCs"
        utter, primitive = self.utter, self.primitive
        self.utter = lambda *_: None  # type: ignore[method-assign]

        def speak_then_move(chosen: Action) -> str:
            utter(self.world.agent, chosen)
            return primitive(chosen)

        self.primitive = speak_then_move  # type: ignore[method-assign]
        try:
            return super().step(action)
        finally:
            self.utter, self.primitive = utter, primitive  # type: ignore[method-assign]


class PaysForTheStepBefore(Reference):
    """Computes the reward with t before the step."""

    def judge(self) -> list[Result]:
        self.world.t -= 1
        results = super().judge()
        self.world.t += 1
        return results


def play_all(pair: Pair) -> None:
    rng = np.random.default_rng(5)
    for episode in range(EPISODES):
        pair.play(5, episode, rng)


@pytest.mark.parametrize(
    ("wrong", "name"), [(SpeaksBeforeMoving, COUNTING), (PaysForTheStepBefore, "talkitout+oracle")]
)
def test_a_wrong_order_of_events_is_found_out(wrong: type[Reference], name: str) -> None:
    loaded = load(name)
    pair = Pair.of(loaded)
    pair.reference = wrong(loaded.scenario)
    with pytest.raises(Disagreement):
        play_all(pair)


# -- several seats -----------------------------------------------------------------------------------------------


def seats_in_reverse(checked: CheckedScenario) -> CheckedScenario:
    return replace(checked, seated=checked.seated[::-1])


def all_for_all(checked: CheckedScenario) -> CheckedScenario:
    return replace(checked, outcomes=tuple(replace(outcome, seats=None) for outcome in checked.outcomes))


PLANTED_IN_SEATS: dict[str, tuple[str, Change]] = {
    "the order of the seats": (CREW, seats_in_reverse),
    "a voice carries one cell too far": (CREW, farther),
    "a success is one of all": (PARTNERS, all_for_all),
    "a player hears nothing of what it says": (PARTNERS, lambda checked: replace(checked, own_voice=False)),
    "the picture is taken before the NPCs act": (
        CREW,
        lambda checked: replace(checked, picture_before_npcs=not checked.picture_before_npcs),
    ),
}


@pytest.mark.parametrize("bug", one_in(3, PLANTED_IN_SEATS, "plays on the slow interpreter"))
def test_a_wrong_compiler_of_seats_is_found_out(bug: str) -> None:
    name, change = PLANTED_IN_SEATS[bug]
    loaded = load(name)
    wrong = change(loaded.checked)
    assert wrong != loaded.checked, "nothing was planted"
    with pytest.raises((Disagreement, InvalidProgramError)):
        seats_agree(loaded, STEPS, seed=5, program=compile_scenario(wrong))


class MoveInReverse(Reference):
    """The last seat moves first."""

    def move(self, players: list[Entity], actions: Mapping[str, Action]) -> None:
        super().move(players[::-1], actions)


class SpeakInReverse(Reference):
    """The last seat speaks first."""

    def speak(self, players: list[Entity], actions: Mapping[str, Action]) -> None:
        super().speak(players[::-1], actions)


class ScriptsMoveAsWell(Reference):
    """The frame of a member that is played has its body and its voice."""

    def npc_turn(self, npc: Entity) -> None:
        taken, npc.taken = npc.taken, False
        super().npc_turn(npc)
        npc.taken = taken


class ScriptsRest(Reference):
    """The frame of a member that is played waits."""

    def npc_turn(self, npc: Entity) -> None:
        if not npc.taken:
            super().npc_turn(npc)


class NobodyDies(Reference):
    """Nothing happens on deadly cells."""

    def die(self) -> int:
        return 0


class TheDeadAct(Reference):
    """Who is out of the room is known for what it does and says."""

    def is_played(self, seat: Entity) -> bool:
        return seat.taken


class UsesLast(Reference):
    """What a player toggled at stays so in the next step."""

    def begin_step(self, played: Collection[str]) -> None:
        uses = [(thing, list(thing.toggled_by)) for thing in self.world.things()]
        super().begin_step(played)
        for thing, users in uses:
            thing.toggled_by = [user for user in users if user is not self.world.agent]


IN_SEATS: dict[type[Reference], str] = {
    MoveInReverse: PARTNERS,
    SpeakInReverse: LOOKOUTS,
    ScriptsMoveAsWell: PARTNERS,
    ScriptsRest: PARTNERS,
    NobodyDies: CREW,
    TheDeadAct: CREW,
    UsesLast: LOOKOUTS,
}


@pytest.mark.parametrize("wrong", one_in(4, IN_SEATS, "plays on the slow interpreter"))
def test_a_wrong_engine_of_seats_is_found_out(wrong: type[Reference]) -> None:
    with pytest.raises(Disagreement):
        seats_agree(load(IN_SEATS[wrong]), STEPS, seed=5, judge=wrong)


def test_a_wrong_choice_among_equal_paths_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bodies, "SEARCH_ORDER", bodies.SEARCH_ORDER[::-1])
    with pytest.raises(Disagreement):
        agree(WALKERS, EPISODES, seed=5)
