"""What a random scenario has declared so far: expressions are made of it."""

from __future__ import annotations

from dataclasses import dataclass, field

STATUSES = {
    "door": ("closed", "open", "locked"),
    "remote_door": ("closed", "open"),
    "switch": ("idle", "pressed"),
    "lever": ("down", "up", "spent"),
    "generator": ("idle", "pressed"),
    "marble": ("still", "rolling"),
    "box": ("shut", "opened", "locked"),
    "apple": ("whole", "eaten"),
    "ball": ("plain", "tagged"),
    "fence": ("solid",),
    "floor": ("plain",),
    "lava": ("hot",),
    "platform": ("empty",),
    "wall": ("solid",),
}


@dataclass(frozen=True)
class Thing:
    """An object, or a group of so many."""

    name: str
    type: str
    count: int | None = None


@dataclass(frozen=True)
class Row:
    """A register for each of a group (`keys`; None: a single one), and what it holds; it may begin with nothing."""

    name: str
    keys: str | None
    holds: str
    empty: bool = False


@dataclass(frozen=True)
class Look:
    """A look: of whom or what (the objects of a name, or `cast`), and its words."""

    name: str
    of: str
    words: tuple[str, ...]
    ordered: bool = False


@dataclass
class Frame:
    """A frame as others speak of it: what it can be asked for."""

    name: str
    states: list[str]
    numbers: list[str] = field(default_factory=list)  # registers with a range
    colors: list[str] = field(default_factory=list)  # registers that hold a colour
    things: dict[str, str] = field(default_factory=dict)  # registers and slots: one of this group
    slots: dict[str, str] = field(default_factory=dict)  # name: type
    directions: list[str] = field(default_factory=list)  # slots that hold a direction
    cells: list[str] = field(default_factory=list)  # slots that hold a cell
    nouns: list[str] = field(default_factory=list)  # slots that hold a noun
    truths: list[str] = field(default_factory=list)  # slots that hold a condition
    rows: list[Row] = field(default_factory=list)
    of_group: bool = False  # whether it is followed by the members of a group, which have an index
    of_agent: bool = False  # whether the agent follows it, who says what its grammar has and never points


@dataclass
class Declared:
    """Names, by what they can be used for."""

    things: list[Thing] = field(default_factory=list)
    members: list[str] = field(default_factory=list)  # NPCs that are no group
    groups: dict[str, int] = field(default_factory=dict)  # groups of NPCs
    follows: dict[str, Frame] = field(default_factory=dict)  # NPC, group or agent: its frame
    beliefs: dict[str, dict[str, str]] = field(default_factory=dict)  # member: belief: sort
    numbers: list[str] = field(default_factory=list)  # registers of the world and lets
    edge: int = 0  # a number at the edge of something's width; 0 where all numbers are small
    vault: tuple[int, int] = (
        0,
        0,
    )  # the least and greatest key of a register for each number around the edge
    keyed: list[str] = field(default_factory=list)  # those of the next that may be such a key
    wide: list[str] = field(default_factory=list)  # registers of the world and lets that may come to it
    registers: list[str] = field(default_factory=list)  # those of them that rules can set
    rows: list[Row] = field(default_factory=list)  # registers of the world for each of a group
    colors: list[str] = field(default_factory=list)  # lets that hold a colour
    lets: dict[str, str] = field(default_factory=dict)  # lets that hold one of a group
    cells: list[str] = field(default_factory=list)  # lets that hold a cell
    sequences: list[str] = field(default_factory=list)
    memories: dict[str, str] = field(default_factory=dict)  # memory: a sequence of its length
    tables: list[str] = field(default_factory=list)  # colour -> word
    ranks: list[str] = field(default_factory=list)  # colour -> number
    turns: int = 0  # for how many numbers the table `turns` has a member of the cast
    contents: dict[str, str] = field(default_factory=dict)  # what lies in things: the containers
    carried: list[Thing] = field(default_factory=list)  # what can be carried
    pushed: list[str] = field(default_factory=list)  # members and groups of the cast who can be pushed
    looks: list[Look] = field(default_factory=list)
    templates: list[str] = field(default_factory=list)
    nouns: list[str | int] = field(default_factory=list)
    slots: dict[str, list[str | int]] = field(
        default_factory=dict
    )  # of a grammar without nouns: the words of each
    truths: list[str] = field(default_factory=list)  # definitions without arguments
    relations: list[str] = field(
        default_factory=list
    )  # definitions with somebody or something as their argument
    says: list[str] = field(default_factory=list)  # what NPCs say without values

    def group(self, name: str) -> Thing:
        """The objects of this name."""
        return next(thing for thing in self.things if thing.name == name)

    @property
    def single(self) -> list[Thing]:
        """Objects that are one."""
        return [thing for thing in self.things if thing.count is None]

    @property
    def several(self) -> list[Thing]:
        """Groups of objects."""
        return [thing for thing in self.things if thing.count is not None]

    @property
    def nouns_are_numbers(self) -> bool:
        """Whether nouns can be counted with."""
        return bool(self.nouns) and all(isinstance(noun, int) for noun in self.nouns)

    @property
    def nouns_are_colors(self) -> bool:
        """Whether any colour can be said."""
        return "purple" in self.nouns
