"""What exists in an episode: entities with their state, the room they are in, and plain geometry."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Cell = tuple[int, int]

COLORS = ("red", "green", "blue", "purple", "yellow", "grey")
DIRECTIONS = ("right", "down", "left", "up")
AHEAD = {"right": (1, 0), "down": (0, 1), "left": (-1, 0), "up": (0, -1)}
SIDES = ("top", "bottom", "left", "right")


@dataclass(frozen=True)
class ObjectType:
    """How a type of object looks and behaves; the first status is the initial one unless said otherwise."""

    code: int
    states: tuple[str, ...]
    initial: str
    color: str | None = None  # where a scenario gives none; else it is drawn
    walkable: tuple[str, ...] = ()
    transparent: tuple[str, ...] = ()
    toggled: dict[str, str] = field(default_factory=dict)
    deadly: bool = False
    active: tuple[str, ...] = ()  # statuses in which it works on what it is linked to
    expired: dict[str, str] = field(default_factory=dict)  # what its active statuses become when time is up
    pushed: dict[str, str] = field(default_factory=dict)
    rolls: tuple[str, ...] = ()  # statuses in which it moves by itself


TYPES = {
    "wall": ObjectType(2, ("solid",), "solid", "grey"),
    "floor": ObjectType(3, ("plain",), "plain", "grey", walkable=("plain",), transparent=("plain",)),
    "fence": ObjectType(18, ("solid",), "solid", "grey", transparent=("solid",)),
    "lava": ObjectType(9, ("hot",), "hot", "red", ("hot",), ("hot",), deadly=True),
    "platform": ObjectType(17, ("empty",), "empty", "purple", transparent=("empty",)),
    "ball": ObjectType(6, ("plain", "tagged"), "plain", transparent=("plain", "tagged")),
    "door": ObjectType(
        4,
        ("open", "closed", "locked"),
        "closed",
        walkable=("open",),
        transparent=("open",),
        toggled={"closed": "open", "open": "closed"},
    ),
    "remote_door": ObjectType(19, ("open", "closed"), "closed", walkable=("open",), transparent=("open",)),
    "switch": ObjectType(
        12,
        ("idle", "pressed"),
        "idle",
        transparent=("idle", "pressed"),
        toggled={"idle": "pressed", "pressed": "idle"},
        active=("pressed",),
    ),
    "lever": ObjectType(
        14,
        ("down", "up", "spent"),
        "down",
        "red",
        (),
        ("down", "up", "spent"),
        {"down": "up"},
        active=("up",),
        expired={"up": "spent"},
    ),
    "box": ObjectType(
        7,
        ("shut", "opened", "locked"),
        "shut",
        transparent=("shut", "opened", "locked"),
        toggled={"shut": "opened"},
    ),
    "apple": ObjectType(13, ("whole", "eaten"), "whole", "red", (), ("whole", "eaten"), {"whole": "eaten"}),
    "generator": ObjectType(
        15,
        ("idle", "pressed"),
        "idle",
        transparent=("idle", "pressed"),
        pushed={"idle": "pressed"},
        active=("pressed",),
    ),
    "marble": ObjectType(
        16,
        ("still", "rolling"),
        "still",
        transparent=("still", "rolling"),
        pushed={"still": "rolling"},
        rolls=("rolling",),
    ),
}


class Nothing:
    """What a register holds that holds nothing yet: unlike anything, and not there where it is needed."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Nothing:
        return self


NOTHING = Nothing()

NO_CELL = -1, -1
"""The cell of what is not in the room: a value like others, which nothing is on; it empties what may be empty."""


@dataclass
class Kept:
    """Registers that there are for each of a group, by key."""

    values: dict[Any, Any]


@dataclass
class Heard:
    """One utterance as it reached somebody."""

    speaker: Entity
    text: str
    filled: dict[str, Any]  # what stands in its slots, where that was chosen
    to: Entity | None = None  # who is addressed


@dataclass(eq=False)
class Entity:
    """An object, an NPC or the agent. Without a cell it is gone (or not placed yet)."""

    key: str
    sort: str  # object, npc, agent
    index: int = 0
    cell: Cell | None = None
    left_from: Cell | None = None  # where it was when it vanished
    color: str | None = None
    # objects
    type: str = ""
    status: str = ""
    initial: str = ""
    single: bool = False  # not one of a group
    toggled_by: list[Entity] = field(default_factory=list)  # in this step
    one_way: bool = False
    dark: bool = False
    unlocks: list[Entity] = field(default_factory=list)
    opens: list[Entity] = field(default_factory=list)
    carryable: bool = False
    carrier: Entity | None = None  # who carries it; it has no cell then
    inside: Entity | None = None  # the container it lies in, or came out of
    timer: int | None = None  # steps until an active status expires
    counted: int = 0  # steps since its status became active
    only_rolled: bool = False  # pushed by what rolls, by nobody else
    exclusive: bool = False
    blocked: bool = False  # another of its exclusive group was used: it reacts to no toggle and no push
    at_reset: tuple[Any, ...] = ()  # what `reset` brings back
    looks: dict[str, str] = field(default_factory=dict)  # those that it has
    # the cast
    facing: str = "right"
    name: str | None = None
    drawn_from: str | None = None  # which of several npc files it is
    kind: str = "peer"
    kind_code: int = 0
    view: int = 7
    frame: str | None = None
    state: str | int | None = None
    clock: int = 0
    rounds: dict[str, int] = field(default_factory=dict)  # of nested steps: how many are over
    slots: dict[str, Any] = field(default_factory=dict)
    registers: dict[str, Any] = field(default_factory=dict)
    ranges: dict[str, tuple[int, int]] = field(default_factory=dict)  # of registers that saturate
    may_be_nothing: set[str] = field(default_factory=set)  # registers that start with nothing
    fired_once: set[str] = field(default_factory=set)
    inbox: list[Heard] = field(default_factory=list)
    utterance: str | None = None  # in this step
    filled: dict[str, Any] = field(
        default_factory=dict
    )  # what stands in the slots of what it said in this step
    pair: int = 0  # the number of the agent's utterance in this step, 0 for silence
    action: str = "none"  # in this step
    last_act: str = "none"  # of its last turn, as it is seen
    bumped: bool = False  # it went forward in this step and did not get there
    pointing: str | Cell | None = None  # a direction, or a cell
    believes: dict[str, Any] = field(default_factory=dict)
    ages: dict[str, int] = field(default_factory=dict)  # of beliefs: turns without a source
    poked: bool = False
    was_poked: bool = False
    accepts: bool = True  # in this step
    seat: bool = False  # whether somebody outside of the file may play it
    taken: bool = False  # whether somebody does, in this step
    lines: list[Heard] = field(default_factory=list)  # what its seat hears in this step
    tone: str | None = None  # in which its player speaks in this step
    bonus: int = 0  # per cent that rules pay its seat in this step
    pushed_aside: bool = False  # whoever walks into it moves it

    @property
    def gone(self) -> bool:
        """Whether it is not in the room."""
        return self.cell is None

    def __repr__(self) -> str:
        return f"<{self.key}{[self.index]} at {self.cell}>"


@dataclass(frozen=True)
class Performance:
    """A sequence that was drawn: body actions, each with the number of an utterance (0: none)."""

    elements: tuple[tuple[str, int], ...]


@dataclass
class Recall:
    """A memory: what the agent did in the last steps in which it was open."""

    size: int
    of: str
    entries: list[tuple[str, int]] = field(default_factory=list)
    open: bool = False  # at the start of this step

    def equals(self, other: Performance | Recall) -> bool:
        """Element by element; false until both are full, or where the lengths differ."""
        elements = other.entries if isinstance(other, Recall) else other.elements
        if len(self.entries) < self.size or self.size != len(elements):
            return False
        return all(self.seen(a) == self.seen(b) for a, b in zip(self.entries, elements, strict=True))

    def seen(self, element: tuple[str, int]) -> Any:
        """What it keeps of an element."""
        return {"agent.acts": element, "agent.actions": element[0], "agent.utterances": element[1]}[self.of]


@dataclass
class World:
    """The whole state of an episode."""

    key: int
    session_key: int = 0  # of what stays the same in a session
    kept: frozenset[str] = frozenset()  # the places of those draws
    t: int = 0
    width: int = 0
    height: int = 0
    terrain: dict[Cell, str] = field(default_factory=dict)
    objects: dict[str, Entity | list[Entity]] = field(default_factory=dict)
    cast: dict[str, Entity] = field(default_factory=dict)
    groups: dict[str, list[Entity]] = field(default_factory=dict)  # of the cast
    roles: dict[str, str] = field(default_factory=dict)  # role -> who plays it
    lets: dict[str, Any] = field(default_factory=dict)
    registers: dict[str, Any] = field(default_factory=dict)  # the world's `state`
    ranges: dict[str, tuple[int, int]] = field(default_factory=dict)  # of registers that saturate
    may_be_nothing: set[str] = field(default_factory=set)  # registers that start with nothing
    tables: dict[str, dict[str, Any]] = field(default_factory=dict)  # by the text of the key
    memories: dict[str, Recall] = field(default_factory=dict)
    fired_once: set[str] = field(default_factory=set)  # of the world's rules
    before: World | None = None  # as the last step left it, for `prev`
    nouns: tuple[str | int, ...] = ()
    fillers: dict[str, list[Any]] = field(default_factory=dict)  # of each slot of the grammar
    step_names: dict[str, list[str | None]] = field(default_factory=dict)  # per frame with `steps`
    earshot: dict[str, str | int] = field(default_factory=dict)  # how far each voice carries
    always_audible: frozenset[str] = frozenset()
    npcs_hidden: bool = False
    own_voice: bool = False
    seats_hidden: bool = False  # whether the picture does not tell which seat it is
    overheard: bool = True  # whether others hear what is said to somebody
    egocentric: bool = False
    occlusion: bool = False
    gestures: int = 0  # how many channels of the picture show them
    hands: bool = False  # whether it shows what NPCs carry
    tone: str | None = None  # the look whose word is heard before what NPCs say
    look_names: dict[str, tuple[str, ...]] = field(default_factory=dict)
    shown_looks: dict[str, tuple[str, ...]] = field(default_factory=dict)  # words of those that it shows
    canvas: tuple[int, int] = (0, 0)

    def key_at(self, path: str) -> int:
        """The key of a draw at a place of the scenario."""
        return self.session_key if path.partition("[")[0] in self.kept else self.key

    @property
    def agent(self) -> Entity:
        """The agent."""
        return self.cast["agent"]

    @property
    def npcs(self) -> list[Entity]:
        """All NPCs, in the order they act."""
        return [member for member in self.cast.values() if member.sort == "npc"]

    @property
    def members(self) -> list[Entity]:
        """The whole cast, the agent before NPCs."""
        return [self.agent, *self.npcs]

    @property
    def seats(self) -> list[Entity]:
        """All members with a seat, in the order in which they move and speak."""
        return [member for member in self.members if member.seat]

    def things(self) -> list[Entity]:
        """All objects, in file order."""
        return [thing for group in self.objects.values() for thing in as_list(group)]

    def carried_by(self, member: Entity) -> Entity | None:
        """What a member of the cast carries."""
        return next((thing for thing in self.things() if thing.carrier is member), None)

    def entities(self) -> list[Entity]:
        """Everything that can be somewhere."""
        return self.things() + list(self.cast.values())

    def inside(self, cell: Cell) -> bool:
        """Whether the cell belongs to the room, walls included."""
        return 0 <= cell[0] < self.width and 0 <= cell[1] < self.height

    def on_border(self, cell: Cell) -> bool:
        """Whether the cell is one of the room's wall cells."""
        return self.inside(cell) and (cell[0] in (0, self.width - 1) or cell[1] in (0, self.height - 1))

    def interior(self) -> list[Cell]:
        """The cells within the walls, row by row."""
        return [(x, y) for y in range(1, self.height - 1) for x in range(1, self.width - 1)]

    def objects_at(self, cell: Cell) -> list[Entity]:
        """All objects in a cell, those that were written first at the bottom."""
        groups = self.objects.values()
        return [thing for group in groups for thing in as_list(group) if thing.cell == cell]

    def object_at(self, cell: Cell) -> Entity | None:
        """The object in a cell; of several, the one on top."""
        return next(reversed(self.objects_at(cell)), None)

    def _holds(self, cell: Cell, quality: str) -> bool:
        if not self.inside(cell):
            return False
        things = self.objects_at(cell)
        if things:
            return all(thing.status in getattr(TYPES[thing.type], quality) for thing in things)
        ground = self.terrain.get(cell)
        if ground is not None:
            return TYPES[ground].initial in getattr(TYPES[ground], quality)
        return not self.on_border(cell)

    def walkable(self, cell: Cell) -> bool:
        """Whether a body can enter the cell, other bodies aside."""
        return self._holds(cell, "walkable")

    def transparent(self, cell: Cell) -> bool:
        """Whether one can look through the cell."""
        return self._holds(cell, "transparent")

    def deadly(self, cell: Cell) -> bool:
        """Whether the cell kills who is played: what is seen there decides."""
        thing = self.object_at(cell)
        seen = self.terrain.get(cell) if thing is None else thing.type
        return seen is not None and TYPES[seen].deadly


def default_name(key: str) -> str:
    """What a member is called that has no name: its key; those of a group are counted from 1."""
    word, _, number = key.rstrip("]").partition("[")
    return f"{word.capitalize()} {int(number) + 1}" if number else word.capitalize()


def as_list(value: Any) -> list[Any]:
    """A group as it is, a single thing as a group of one."""
    return value if isinstance(value, list) else [value]


def where(thing: Any) -> Cell | None:
    """The cell of an entity, or a cell itself."""
    cell = thing.cell if isinstance(thing, Entity) else thing
    return None if cell == NO_CELL else cell


def step_from(cell: Cell, direction: str) -> Cell:
    """The next cell in a direction."""
    dx, dy = AHEAD[direction]
    return cell[0] + dx, cell[1] + dy


def turned(direction: str, quarter_turns: int) -> str:
    """A direction after turns to the right (negative: to the left)."""
    return DIRECTIONS[(DIRECTIONS.index(direction) + quarter_turns) % 4]


def distance(a: Cell, b: Cell) -> int:
    """Manhattan distance."""
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def quadrant(start: Cell, goal: Cell) -> str:
    """The direction from one cell to another; on the diagonals (+,+) right, (+,-) up, (-,-) left, (-,+) down."""
    dx, dy = goal[0] - start[0], goal[1] - start[1]
    if dx == dy == 0 or (dy > 0 and -dy <= dx < dy):
        return "down"
    if dx > 0 and -dx < dy <= dx:
        return "right"
    if dy < 0 and dy < dx <= -dy:
        return "up"
    return "left"


def between(a: Cell, b: Cell) -> list[Cell]:
    """The cells strictly between two cells of one row or column."""
    dx, dy = (b[0] > a[0]) - (b[0] < a[0]), (b[1] > a[1]) - (b[1] < a[1])
    return [(a[0] + k * dx, a[1] + k * dy) for k in range(1, distance(a, b))]


def inward(world: World, thing: Entity) -> Cell | None:
    """The cell in front of something: from the wall into the room, or the one an NPC or the agent faces."""
    if thing.cell is None:
        return None
    if thing.sort != "object":
        return step_from(thing.cell, thing.facing)
    x, y = thing.cell
    if not world.on_border(thing.cell):
        return None
    if y == 0:
        return x, 1
    if y == world.height - 1:
        return x, y - 1
    return (1, y) if x == 0 else (x - 1, y)
