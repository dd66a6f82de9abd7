"""A checked scenario as plans: places, activities, rules, frames, every name resolved."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, Literal, Self

from socialai_dsl.schema.scenario import DialogueRoom
from socialai_dsl.semantics.terms import (
    Line,
    ObjectType,
    Pattern,
    Read,
    ReadEach,
    Readings,
    SitedTerm,
    Term,
    Type,
)
from socialai_dsl.source import Span
from socialai_dsl.vocabulary import Sentences, Side

FOR_EVER: Final = -1
"""The duration of a step that never ends."""

# --- places -----------------------------------------------------------------------------------------------------


RegionName = Literal[
    "anywhere", "left_half", "right_half", "top_half", "bottom_half", "column", "row", "rect", "next_to",
    "in_front_of", "wall",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Region:
    """A set of cells.

    `name` and `args`: anywhere; left_half, right_half, top_half, bottom_half; column(x); row(y); rect(x0, y0, x1, y1);
    next_to(entity), in_front_of(entity); wall (side in `side`, cells at least `margin` from its corners).
    `where`: of these cells those for which it holds, which reads only the size of the room and the cell; of what the
    room is built of.
    """

    name: RegionName
    args: tuple[Term, ...] = ()
    side: Side | None = None
    margin: int = 1
    where: Term | None = None

    @property
    def around(self) -> bool:
        """Whether it lies around something in the room, and so is known once that is put somewhere."""
        return self.name in ("next_to", "in_front_of")


@dataclass(frozen=True, slots=True)
class Placing:
    """Where an entity is put: exactly one of `at` (x, y), `regions` (their union, filtered by `where`), `inside` (in
    another object: on its cell, but out of the room until that is opened; or, `in_hands`, carried by a member of the
    cast), or nowhere. With `overlap` cells that are
    taken count as well.
    """

    entity: int
    site: str
    number: int
    span: Span
    at: tuple[Term, Term] | None = None
    regions: tuple[Region, ...] = ()
    where: Term | None = None
    where_site: str = ""
    nowhere: bool = False
    inside: Term | None = None
    in_hands: bool = False
    overlap: bool = False
    when: Term | None = None
    """Done only if this holds: of several for one entity (`one_of`), one does."""


# --- what happens -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Activity:
    """One body action a turn, by the name of its word; `wander` is a choose, `follow` a go_next_to.

    `until`: it is finished when this holds, and before it begins if it holds then; None: as its word says.
    `weights` go with the args of choose. The args of perform are the elements of the sequence in turn, each as its move
    and its utterance.
    """

    name: str
    args: tuple[Term, ...]
    site: str
    span: Span
    weights: tuple[int, ...] = ()
    ordinal: int = 0
    until: Term | None = None


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect on an object or NPC: open, close, lock, unlock, reset (status, presence, place and content as at the
    start of the episode), vanish, become (status in `value`), put (on the cell of `value`), move_into (the object
    `value`), reveal (becomes opened).

    `only`: of each of the entities the condition on which it is affected, or empty: all are. `each`: `value` is that of
    the one entity that it has, and computed only if that is affected.
    """

    name: Literal[
        "open", "close", "lock", "unlock", "reset", "vanish", "become", "put", "move_into", "reveal"
    ]
    entities: tuple[Term, ...]
    span: Span
    value: Term | None = None
    site: str = ""
    only: tuple[Term, ...] = ()
    each: bool = False


@dataclass(frozen=True, slots=True)
class Assignment:
    """What a register is set to; it is known which, by its path, or it is the one of a key (`target`).

    `only`: the condition on which it is set. `each`: the value is computed only if it is.
    """

    path: str
    value: SitedTerm
    target: ReadEach | None = None
    key_site: str = ""
    only: SitedTerm | None = None
    each: bool = False

    @property
    def paths(self) -> tuple[str, ...]:
        """Every register that it may set."""
        if self.target is None:
            return (self.path,)
        return tuple(register.path for register in self.target.registers)


@dataclass(frozen=True, slots=True)
class RulePlan:
    """A rule with everything resolved. `name` is its address: `wizard.courtesy.acquainted.then[0]` or its id."""

    name: str
    site: str
    span: Span
    hears: tuple[Pattern, ...] = ()
    when: SitedTerm | None = None
    after: int = 0
    chance: float | None = None
    once: bool = False
    do: Activity | None = None
    sets: tuple[Assignment, ...] = ()
    causes: tuple[Effect, ...] = ()
    say: Line | None = None
    goto: str | None = None
    goto_now: str | None = None
    reward: int = 0
    """Per cent of the success reward that a rule of the world adds to the agent's reward of the step."""
    rewards: tuple[int, ...] = ()
    """The same for each of the other seats; empty: they get nothing."""


@dataclass(frozen=True, slots=True)
class StatePlan:
    """A state: rules before the activity, the activity, rules after it."""

    name: str
    first: tuple[RulePlan, ...]
    activity: Activity
    then: tuple[RulePlan, ...]
    span: Span

    @property
    def rules(self) -> tuple[RulePlan, ...]:
        """All of them, in the order written."""
        return (*self.first, *self.then)


@dataclass(frozen=True, slots=True)
class StepPlan:
    """An entry of `steps`.

    Attributes:
        state: its name, if any. place: its number; of a nested entry those on the way to it, `2.0`.
        when: without it, the entry is left out. until: what ends it.
        duration: for how many turns, or FOR_EVER.
        lasted: whether it has lasted for as many turns as a value that is computed says.
    """

    name: str
    state: str | None
    activity: Activity
    span: Span
    place: str = ""
    when: SitedTerm | None = None
    until: SitedTerm | None = None
    duration: int | None = None
    lasted: SitedTerm | None = None
    sets: tuple[Assignment, ...] = ()
    causes: tuple[Effect, ...] = ()
    say: Line | None = None

    @property
    def ends_with_its_activity(self) -> bool:
        """Whether nothing else says how long it lasts."""
        return self.until is None and self.duration is None and self.lasted is None


@dataclass(frozen=True, slots=True)
class NestedSteps:
    """Entries of `steps` that are repeated, or left out together.

    Attributes:
        body: numbers of entries, and what is nested in turn; not empty.
        rounds: how often at most, at least once. register: the path of what counts the rounds that are over.
        when: without it, all of them are left out. going: what a round needs to begin; until: what prevents it, but for
            the first.
    """

    body: tuple[int | NestedSteps, ...]
    rounds: int
    register: str
    when: SitedTerm | None = None
    going: SitedTerm | None = None
    until: SitedTerm | None = None


@dataclass(frozen=True, slots=True)
class FramePlan:
    """A frame as one member plays it; exactly one of `states` and `steps` is not empty."""

    member: str
    frame: str
    entity: int
    span: Span
    start: str = ""
    states: tuple[StatePlan, ...] = ()
    steps: tuple[StepPlan, ...] = ()
    written: bool = True
    """False: the file does not have it; it serves members whose beliefs may be wrong."""
    nesting: tuple[int | NestedSteps, ...] | None = None
    """Where some entries of `steps` are nested: their numbers in order, without those that never begin."""

    @property
    def rules(self) -> tuple[RulePlan, ...]:
        """The rules of all states, in the order written."""
        return tuple(rule for state in self.states for rule in state.rules)

    @property
    def causing(self) -> tuple[RulePlan | StepPlan, ...]:
        """Its parts that have effects."""
        return (*self.steps, *self.rules)

    @property
    def activities(self) -> tuple[Activity, ...]:
        """Everything that the member may do."""
        own = (*(step.activity for step in self.steps), *(state.activity for state in self.states))
        return (*own, *(rule.do for rule in self.rules if rule.do is not None))

    @property
    def order(self) -> tuple[int | NestedSteps, ...]:
        """The numbers of the entries of `steps` that are not left out for good, nested as they are written."""
        if self.nesting is not None:
            return self.nesting
        return tuple(k for k, step in enumerate(self.steps) if step.duration != 0)

    @property
    def in_a_row(self) -> bool:
        """Whether every entry of `steps` follows the one before it."""
        return self.nesting is None and all(step.when is None for step in self.steps)


@dataclass(frozen=True, slots=True)
class Drawn:
    """A register given its value at reset: names, `let`s, start values and slots of frames.

    `nothing` is the number that stands for nothing, where it may hold nothing.
    """

    path: str
    type: Type
    value: SitedTerm
    nothing: int | None = None


@dataclass(frozen=True, slots=True)
class Coloring:
    """Colour of an entity at reset: random (value None), or a value; `distinct_from` are the members of the group drawn
    before it, whose colours it must not have.
    """

    entity: int
    site: str
    number: int
    span: Span
    value: SitedTerm | None = None
    distinct_from: tuple[int, ...] = ()
    when: Term | None = None


@dataclass(frozen=True, slots=True)
class Facing:
    """Direction of a cast member at reset: random (value None), a direction, or towards an entity."""

    entity: int
    site: str
    span: Span
    value: SitedTerm | None = None
    toward: Term | None = None
    when: Term | None = None


Setup = Drawn | Coloring | Placing | Facing


@dataclass(frozen=True, slots=True)
class Entity:
    """The agent, an NPC or an object.

    Attributes:
        number: its place in the order agent, NPCs, objects. key, index: `doors`, 2 for doors[2]; index None if single.
        type: of an object. status: initial. kind, kind_code: of an NPC. name: type and term of its name (cast members).
        near, far: Manhattan distances at which its voice is heard.
        view: side of its view square. kind_drawn: the status code of an NPC whose kind is drawn; `kind_code` is then
            the greatest it can be.
        initial: initial status of an object where it is drawn or computed (then `status` is the type's).
        unlocks: objects that are unlocked whenever this one is in an active status (links; a level, not an edge).
    """

    number: int
    key: str
    index: int | None
    role: Literal["agent", "npc", "object"]
    span: Span
    type: ObjectType | None = None
    status: int = 0
    kind: str = ""
    kind_code: int = 0
    name: Term | None = None
    near: int = 1
    far: int = 1
    audible: bool = False
    pushed_by_bodies: bool = False
    """Whether a member of the cast goes out of the way of who walks into it."""
    view: int = 7
    kind_drawn: Term | None = None
    initial: Read | None = None
    unlocks: tuple[int, ...] = ()
    opens: tuple[int, ...] = ()
    """Objects that are open exactly while this one, or another that opens them, is in an active status."""
    timer: int = 0
    """Steps after which an active status expires; 0: never."""
    exclusive: tuple[int, ...] = ()
    """Objects of its group: while one of them is not in its initial status, the others react to nothing."""
    pushed_by_rolling: bool = False
    carryable: bool = False
    tone: Term | None = None
    """The look whose word is heard before what it says."""
    contains: tuple[int, ...] = ()
    """What may lie inside: when this one is opened while something does, it is replaced by that."""


@dataclass(frozen=True, slots=True)
class OutcomePlan:
    """One entry of `outcome`. `name` is its id, or success@LINE; `graded` is a per cent that is computed at the end.

    Attributes:
        percent, graded: what the agent gets. shares: the same for each of the other seats.
        seats: whose success it is, by number; None: that of all.
    """

    name: str
    success: bool
    percent: int
    condition: SitedTerm
    graded: SitedTerm | None = None
    shares: tuple[tuple[int, SitedTerm | None], ...] = ()
    seats: tuple[int, ...] | None = None


@dataclass(frozen=True, slots=True)
class RoomPlan:
    """Sizes (walls included) and what is built: (object type, region, span); regions read only width and height."""

    width: tuple[int, int]
    height: tuple[int, int]
    canvas: tuple[int, int]
    build: tuple[tuple[ObjectType, Region, Span], ...] = ()
    occlusion: bool = False


@dataclass(frozen=True, slots=True)
class LookPlan:
    """An attribute that is seen: its values, and of each entity that has it the path of its register."""

    name: str
    words: tuple[str, ...]
    registers: tuple[tuple[int, str], ...]
    shown: bool


@dataclass(frozen=True, slots=True)
class ComputedStatus:
    """A status that follows from a condition: `on` while it holds; `off` once it stops holding.

    An object that is in `on` while the condition is false becomes `off`; in any other status it is left alone.
    """

    entity: int
    on: int
    off: int
    condition: SitedTerm


@dataclass(frozen=True, slots=True)
class BeliefPlan:
    """A belief of a member: at the start of each of its turns the register takes `value` if `when` holds.

    It starts, as a `Drawn` of the setup, with what is true when the episode begins. Of several for one register the
    first that holds counts; where none does, it holds nothing if `forget` holds, or after `lasts` turns (0: never).
    """

    member: str
    path: str
    value: SitedTerm
    when: SitedTerm | None
    forget: SitedTerm | None = None
    lasts: int = 0


@dataclass(frozen=True, slots=True)
class MemoryPlan:
    """The last `length` acts of the agent, oldest first, in steps that began with `open` true (None: all steps).

    Registers: `memory.NAME[k].move` and `memory.NAME[k].utterance` for k < length, and `memory.NAME.filled`, how many
    it holds, at most `length`. A new act goes to the last place and pushes the others towards 0.
    """

    path: str
    length: int
    utterances: Type
    open: SitedTerm | None


PropertyKind = Literal[
    "reachable", "never", "within", "oracle", "script", "rival", "needs", "only_through", "knowable", "dilemma"
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class PropertyPlan:
    """An entry of `check`. `text` is how it was written.

    `reachable` and `never` are about `condition` or, without one, the outcomes of the names in `goals`; `condition` may
    read `remembered`, which belongs to it alone. `share`: the least share of rooms, of `oracle` that of successes;
    None where none is given. `steps`: of `within`. `members`: of `needs` and `only_through`, as in the cast.
    `draws`: the registers whose values are tried (`let.exit`), of which for `needs` one is enough, or with `any_draw`
    whatever else a room draws. `expected`: whether
    what success depends on is to be `knowable`, or not to be. `rival`: whose share of rooms is at most `share`.
    `frames`: of `dilemma`, of those who cooperate and of those who defect.
    `unasked`: why there is nothing to try: what a patch fixed or took away.
    """

    kind: PropertyKind
    text: str
    span: Span
    condition: SitedTerm | None = None
    goals: tuple[str, ...] = ()
    remembered: tuple[Drawn, ...] = ()
    share: float | None = None
    steps: int = 0
    members: tuple[str, ...] = ()
    draws: tuple[tuple[str, tuple[int, ...]], ...] = ()
    any_draw: bool = False
    expected: bool = True
    rival: str = ""
    frames: tuple[str, ...] = ()
    unasked: str = ""


@dataclass(frozen=True, slots=True)
class ProbePlan:
    """An entry of `probes`. Texts are pieces and values, each value with the path of a register of its own.

    Attributes:
        when: None: asked when the episode has ended.
        ask: the question. answer: what is right; a truth value is `yes` or `no`.
        answers: what can be answered, the right answer perhaps not among them.
        remembered: what it alone asks about the step before.
    """

    name: str
    span: Span
    when: SitedTerm | None
    ask: tuple[str | Drawn, ...]
    answer: Drawn
    answers: tuple[tuple[str | Drawn, ...], ...]
    remembered: tuple[Drawn, ...] = ()


@dataclass(frozen=True, slots=True)
class ClaimPlan:
    """A condition after a step of a test.

    Attributes:
        words: as written. expected: whether it is to hold. value: the probe that asks whether it does.
        members: of the cast, whom it names. state: of the one member, whose state it is about; empty of others.
    """

    words: str
    expected: bool
    value: ProbePlan
    span: Span
    members: tuple[str, ...]
    state: str = ""


@dataclass(frozen=True, slots=True)
class LinePlan:
    """A line that a test expects: pieces, and the probes that ask for its values."""

    pieces: tuple[str | ProbePlan, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class DialogueStepPlan:
    """A step of a test.

    Attributes:
        acts: actions of the space, int (heads,) each. typed: the same as written.
        hears: all lines; None: whatever is heard.
        claims: what is so after the acts, or not.
    """

    span: Span
    acts: tuple[tuple[int, ...], ...]
    typed: tuple[str, ...]
    hears: tuple[LinePlan, ...] | None
    claims: tuple[ClaimPlan, ...]


@dataclass(frozen=True, slots=True)
class DialoguePlan:
    """An entry of `tests`.

    Attributes:
        room: where it is played.
        ends: how the last step ends the episode, and where that is written; None: that does not matter.
        reward: what all steps earn, likewise.
        values: the probes of all steps.
    """

    name: str
    span: Span
    room: DialogueRoom
    steps: tuple[DialogueStepPlan, ...]
    ends: tuple[str, Span] | None
    reward: tuple[float, Span] | None
    values: tuple[ProbePlan, ...]


@dataclass(frozen=True)
class CheckedScenario:
    """A scenario in which everything is resolved and nothing is wrong: the compiler's input.

    Attributes:
        sentences: what the agent can say.
        setup: what is drawn at reset after the room, in the order it is done (needs first).
        words_in_order: every word that may be heard, in order of first appearance, lower case.
        computed: statuses that follow from conditions, each after those it reads.
        remembered: registers that take their value at the start of every step, on the state that the last one left.
        memories: what the agent did last. rules: rules of the world, all that hold fire, top to bottom.
        require: a room is drawn again while one of these is false.
        egocentric: the picture shows the directions of NPCs relative to the agent's.
        beliefs: what members take for true. slope: thousandths of the success reward that are lost by the horizon.
        each_step: millionths added to the reward of every step. channels: of the picture, 4, 6 or 8; one
            more where it `shows_carrying`.
        properties: what the scenario claims about itself; probes: what language models are asked; tests: dialogues, if
            it was read with them. No program of the scenario contains any of these.
        accepting: members of the cast who do not take everything they are given, each with the path of the register
            that says whether it does.
        readings: how conditions were written; None if it was not made from a file.
        addressing: a slot, and the member that each of its words addresses. overheard: whether others hear that.
        seated: the members of the cast other than the agent that have a seat, by number.
        session: episodes of a session. kept: registers whose draws stay the same in it.
    """

    name: str
    horizon: int
    actions: tuple[str, ...]
    sentences: Sentences
    room: RoomPlan
    entities: tuple[Entity, ...]
    setup: tuple[Setup, ...]
    frames: tuple[FramePlan, ...]
    outcomes: tuple[OutcomePlan, ...]
    words_in_order: tuple[str, ...]
    npcs_hidden: bool
    picture_before_npcs: bool
    names_shown: bool
    own_voice: bool
    seats_hidden: bool
    computed: tuple[ComputedStatus, ...] = ()
    remembered: tuple[Drawn, ...] = ()
    memories: tuple[MemoryPlan, ...] = ()
    rules: tuple[RulePlan, ...] = ()
    require: tuple[SitedTerm, ...] = ()
    egocentric: bool = False
    lines_marked: bool = False
    beliefs: tuple[BeliefPlan, ...] = ()
    slope: int = 900
    each_step: int = 0
    channels: int = 4
    shows_carrying: bool = False
    looks: tuple[LookPlan, ...] = ()
    properties: tuple[PropertyPlan, ...] = ()
    results_by: tuple[str, ...] = ()
    probes: tuple[ProbePlan, ...] = ()
    tests: tuple[DialoguePlan, ...] = ()
    accepting: tuple[tuple[int, str], ...] = ()
    readings: Readings | None = field(default=None, compare=False, repr=False)
    addressing: tuple[str, tuple[int, ...]] | None = None
    overheard: bool = True
    seated: tuple[int, ...] = ()
    session: int = 1
    kept: tuple[str, ...] = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: nothing changes it."""
        return self

    @property
    def causing(self) -> tuple[RulePlan | StepPlan, ...]:
        """Everything that has effects."""
        return (*self.rules, *(one for frame in self.frames for one in frame.causing))
