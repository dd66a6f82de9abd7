"""A resolved scenario as plain records: only the shape of the language, and no key that is not understood."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, Final

from socialai_dsl.loader.resolved import ResolvedFile, resolve
from tests.reference.conditions import CONDITIONS
from tests.reference.world import COLORS, default_name

PRIMITIVES: Final = ("left", "right", "forward", "pickup", "drop", "toggle", "done")
SHARED_GRAMMARS: Final = {
    "body": {"templates": ["Move your <noun>", "Shake your <noun>"], "nouns": ["body", "head"]},
    "school": {
        "templates": ["Where is <noun>", "Help <noun>", "Close <noun>", "How are <noun>"],
        "nouns": [
            *(
                "please",
                "the exit",
                "the wall",
                "you",
                "the ceiling",
                "the window",
                "the entrance",
                "the closet",
            ),
            *("the drawer", "the fridge", "the floor", "the lamp", "the trash can", "the chair", "the bed"),
            "the sofa",
        ],
    },
}


@dataclass(frozen=True)
class Rule:
    """Conditions, all of which must hold, and effects; `goto` and `do` where the place allows them."""

    id: str | None = None
    hears: tuple[str, ...] = ()
    addressed: bool | None = None
    when: Any = None
    asked: Mapping[str, Any] = field(default_factory=dict)  # key of `CONDITIONS` -> a number
    chance: float | None = None
    once: bool = False
    do: str | None = None
    set: dict[str, Any] = field(default_factory=dict)
    cause: tuple[str, ...] = ()
    say: str | None = None
    to: Any = None
    goto: str | None = None
    goto_now: str | None = None
    reward: Any = 0  # of the world's rules: per cent, for all seats or for each member


@dataclass(frozen=True)
class Step:
    """An entry of `steps`."""

    state: str | None = None
    do: str | None = None
    until: Any = None
    for_: Any = None
    set: dict[str, Any] = field(default_factory=dict)
    cause: tuple[str, ...] = ()
    say: str | None = None
    to: Any = None
    when: Any = None
    steps: tuple[Step, ...] | None = None  # nested, in place of an activity
    repeat: Any = None
    while_: Any = None


@dataclass(frozen=True)
class Entry:
    """An entry of `steps`: where it is written, and the nested steps that it is in, outermost first."""

    step: Step
    address: str
    inside: tuple[tuple[str, Step], ...] = ()


def entries_of(
    steps: tuple[Step, ...], before: str = "", inside: tuple[tuple[str, Step], ...] = ()
) -> Iterator[Entry]:
    """The entries of `steps` in the order in which they are written."""
    for number, step in enumerate(steps):
        here = f"{before}steps[{number}]"
        if step.steps is None:
            yield Entry(step, f"{before}steps[{step.state or number}]", inside)
        else:
            yield from entries_of(step.steps, f"{here}.", (*inside, (here, step)))


@dataclass(frozen=True)
class State:
    """An entry of `states`."""

    first: tuple[Rule, ...] = ()
    do: str | None = None
    then: tuple[Rule, ...] = ()


@dataclass(frozen=True)
class Frame:
    """A protocol; either `states` or `steps` is None."""

    slots: dict[str, str] = field(default_factory=dict)
    let: dict[str, Any] = field(default_factory=dict)
    define: dict[str, Any] = field(default_factory=dict)
    start: str | None = None
    states: dict[str, State] | None = None
    steps: tuple[Step, ...] | None = None

    @property
    def entries(self) -> list[Entry]:
        """The entries of `steps`, nested ones in their place."""
        return list(entries_of(self.steps or ()))


@dataclass(frozen=True)
class Source:
    """One way to come to believe something."""

    of: Any
    when: Any = None
    hears: tuple[str, ...] = ()


@dataclass(frozen=True)
class Belief:
    """What a member takes for true: what the first of its sources says that holds."""

    of: Any = None
    when: Any = None
    start: Any = None
    from_: tuple[Source, ...] = ()
    forget: Any = None

    @property
    def may_be_nothing(self) -> bool:
        """Whether a member may have none; the cell of what is not in the room is none then."""
        return str(self.start) == "none" or self.forget is not None

    def sources(self, site: str) -> list[tuple[str, Source]]:
        """Each with the place where it is written."""
        if not self.from_:
            return [(site, Source(self.of, self.when))]
        return [(f"{site}.from[{number}]", source) for number, source in enumerate(self.from_)]


@dataclass(frozen=True)
class Member:
    """A member of the cast, or what an npc file says of one."""

    role: str | None = None
    kind: str | None = None
    name: Any = None
    color: Any = None
    place: Any = None
    at: Any = None
    facing: Any = None
    view: int | None = None
    earshot: Any = None
    frame: str | None = None
    with_: dict[str, Any] = field(default_factory=dict)
    beliefs: dict[str, Belief] = field(default_factory=dict)
    audible: str | None = None
    pushed_by: str | None = None
    accepts: Any = None
    kind_code: int | None = None
    seat: str | None = None

    def over(self, base: Member) -> Member:
        """This with what it leaves out taken from `base`: a position replaces a place and the other way round."""
        kept = {name: value for name, value in vars(self).items() if value is not None}
        if self.place is not None or self.at is not None:
            base = replace(base, place=None, at=None)
        kept["beliefs"] = self.beliefs or base.beliefs
        return replace(base, **{**kept, "with_": {**base.with_, **self.with_}})


@dataclass(frozen=True)
class Group:
    """An object, or a group of them."""

    type: str
    count: int | None = None
    place: Any = None
    at: Any = None
    color: Any = None
    state: Any = None
    pressed: Any = None
    opened: Any = None
    locked: Any = None
    tagged: Any = None
    unlocks: Any = None
    one_way: bool = False
    dark: bool = False
    inside: Any = None
    carryable: bool = False
    exclusive: bool = False
    overlap: bool = False
    timer: int | None = None
    opens: Any = None
    pushed_by: str | None = None


@dataclass(frozen=True)
class Sequence:
    """A `let` that draws a row of body actions, each with an utterance at some chance."""

    length: int
    moves: tuple[str, ...]
    chance: float | None = None


@dataclass(frozen=True)
class Memory:
    """What the agent did last."""

    last: int
    of: str = "agent.acts"
    while_: Any = None


@dataclass(frozen=True)
class Look:
    """An attribute of each of a group that is seen."""

    for_: Any
    words: tuple[str, ...]
    start: Any = "random"
    ordered: bool = False


@dataclass(frozen=True)
class Outcome:
    """One way the episode ends."""

    success: Any = None
    failure: Any = None
    reward: Any = 100  # per cent, for all seats or for each member
    for_: tuple[str, ...] = ()  # whose success it is; of all if nobody is named
    id: str | None = None


@dataclass(frozen=True)
class Pay:
    """What is earned: 1 - slope t / horizon at success, and something in every step."""

    success: str = "linear(0.9)"
    each_step: float = 0.0

    @property
    def slope(self) -> float:
        """The part of the success reward that is lost by the horizon."""
        return float(self.success.removeprefix("linear(").removesuffix(")"))


@dataclass(frozen=True)
class Observe:
    """What the agent perceives."""

    npcs: str = "shown"
    image: str = "end"
    names: str = "shown"
    lines: str = "plain"
    directions: str = "absolute"
    own_voice: bool = False
    seats: str = "shown"
    channels: tuple[str, ...] | None = None
    tone: str | None = None


@dataclass(frozen=True)
class Room:
    """The size of the room and what is built into it."""

    size: Any = None
    width: Any = None
    height: Any = None
    build: tuple[dict[str, str], ...] = ()
    canvas: tuple[int, int] | None = None
    occlusion: bool = False


@dataclass(frozen=True)
class Filler:
    """A word of a slot: the key of the thing or member of the cast that it stands for, if it stands for one."""

    word: str
    key: str | None = None


@dataclass(frozen=True)
class Grammar:
    """What the agent can say; `slots` as they are written, `fillers` each with its words and what these stand for."""

    templates: tuple[str, ...]
    nouns: tuple[str | int, ...] = ()
    slots: dict[str, Any] = field(default_factory=dict)
    to: str | None = None  # the slot of who is addressed, as it is written: `<whom>`
    fillers: dict[str, list[Filler]] = field(default_factory=dict)

    def utterance(self, template: int, *choices: int) -> str:
        """The text of a template with a word in each of its slots; a grammar without slots leaves one choice of one."""
        text = self.templates[template]
        for (slot, fillers), choice in zip(self.fillers.items(), choices[: len(self.fillers)], strict=True):
            text = text.replace(f"<{slot}>", fillers[choice].word)
        return text

    def pairs(self) -> list[tuple[int, ...]]:
        """Each template with all choices for its slots, 0 for others, in the order of numbers: 1 on, 0 is silence."""
        return [
            (number, *choices)
            for number, template in enumerate(self.templates)
            for choices in product(
                *(range(len(f) if f"<{slot}>" in template else 1) for slot, f in self.fillers.items())
            )
        ]

    def meant(self, template: int, *choices: int) -> tuple[int, ...]:
        """The same without choices for slots that the template lacks."""
        has = (f"<{slot}>" in self.templates[template] for slot in self.fillers)
        chosen = zip(choices[: len(self.fillers)], has, strict=True)
        return (template, *(choice if its else 0 for choice, its in chosen))


@dataclass(frozen=True)
class Probe:
    """A question to a language model."""

    ask: Any
    answer: Any
    when: Any = None
    answers: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Session:
    """Episodes in a row in which some draws stay the same."""

    episodes: int
    same: tuple[str, ...]


@dataclass(frozen=True)
class Script:
    """One scenario."""

    scenario: str
    grammar: Grammar
    room: Room
    horizon: int = 100
    earshot: Any = "next_to"
    overheard: bool = True
    actions: tuple[str, ...] = PRIMITIVES
    params: dict[str, Any] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    objects: dict[str, Group] = field(default_factory=dict)
    let: dict[str, Any] = field(default_factory=dict)
    session: Session | None = None
    define: dict[str, Any] = field(default_factory=dict)
    state: dict[str, Any] = field(default_factory=dict)
    looks: dict[str, Look] = field(default_factory=dict)
    tables: dict[str, Any] = field(default_factory=dict)
    memory: dict[str, Memory] = field(default_factory=dict)
    frames: dict[str, Frame] = field(default_factory=dict)
    roles: dict[str, Member] = field(default_factory=dict)
    npc_defaults: Member = field(default_factory=Member)
    cast: dict[str, Member] = field(default_factory=dict)
    files: dict[str, dict[str, Member]] = field(
        default_factory=dict
    )  # of `one_of`: member -> npc -> what it says
    rules: tuple[Rule, ...] = ()
    require: tuple[Any, ...] = ()
    outcome: tuple[Outcome, ...] = ()
    reward: Pay = field(default_factory=Pay)
    observe: Observe = field(default_factory=Observe)
    probes: dict[str, Probe] = field(default_factory=dict)

    def versions(self, name: str) -> list[Member]:
        """All that a member can be, in the order of its files; one where nothing is drawn."""
        own = self.cast[name]
        bases = list(self.files[name].values()) if name in self.files else [Member()]
        return [self.complete(name, own.over(base)) for base in bases]

    def complete(self, name: str, member: Member) -> Member:
        """A member's own keys, then those of its role, then of `npc_defaults`. A role does not drive the agent."""
        if member.role is not None:
            role = self.roles[member.role]
            member = member.over(replace(role, frame=None) if name == "agent" else role)
        return member if name == "agent" else member.over(self.npc_defaults)

    def seats(self) -> list[str]:
        """The members that have a seat, the agent first."""
        others = [name for name in self.cast if name != "agent" and self.versions(name)[0].seat == "open"]
        return ["agent", *others]

    def named(self, member: str, names: Iterable[str]) -> str | None:
        """The one of these names that means a member: its own, that of its group, or of its role."""
        own = (member, member.partition("[")[0])
        return next((name for name in names if self.player_of(name) in own), None)

    def player_of(self, name: str) -> str:
        """The member of the cast that a name means; a role means whoever plays it."""
        players = [member for member, own in self.cast.items() if own.role == name]
        return players[0] if name in self.roles and players else name


# -- reading -----------------------------------------------------------------------------------------------


def script_of(source: Any) -> Script:
    """The records of a scenario: a resolved one, a name, its models, or its plain data."""
    if isinstance(source, Script):
        return source
    if isinstance(source, str):
        source = resolve(source)
    if not isinstance(source, ResolvedFile):
        data = source if isinstance(source, Mapping) else source.model_dump(by_alias=True, exclude_unset=True)
        return of_data(data)
    assert isinstance(source.data, dict)
    files = {
        name: {str(file.data["npc"]): file.data for file in source.include_all(("cast", name, "one_of"))}  # type: ignore[index,call-overload]
        for name, member in source.data["cast"].items()  # type: ignore[union-attr]
        if "one_of" in (member or {})  # type: ignore[operator]
    }
    return of_data(source.data, source.params, files)


def of_data(
    data: Mapping[str, Any],
    given: Mapping[str, str] | None = None,
    files: Mapping[str, Mapping[str, Any]] | None = None,
) -> Script:
    """The records of plain data; `files` holds the npc files of each member that is one of several."""
    params = {
        name: parameter(entry, (given or {}).get(name)) for name, entry in data.get("params", {}).items()
    }
    data = dict(substituted(tuples(data), params))
    data["cast"] = spread(data["cast"])
    frames: dict[str, Any] = dict(data.get("frames", {}))
    known: dict[str, dict[str, Member]] = {}
    for name, npcs in (files or written_out(data["cast"])).items():
        known[name] = {}
        for npc, entry in npcs.items():
            entry = dict(tuples(entry))
            frames = {**entry.pop("frames", {}), **frames}
            known[name][npc] = member_of(
                {key: entry[key] for key in entry if key not in ("npc", "abstract", "about", "notes")}
            )
    unplayed = (
        "about",
        "skills",
        "notes",
        "published",
        "results_by",
        "instructions",
        "training_frames",
        "abstract",
        "check",
    )
    for key in (*unplayed, "rivals"):
        data.pop(key, None)
    data |= {"frames": frames, "params": params, "files": known}
    script: Script = record(Script, data, READERS)
    return replace(script, grammar=replace(script.grammar, fillers=fillers_of(script)))


def fillers_of(script: Script) -> dict[str, list[Filler]]:
    """What each slot of the grammar can be."""
    written = script.grammar.slots or ({"noun": script.grammar.nouns} if script.grammar.nouns else {})
    return {
        slot: [f for entry in many(entries) for f in fillers_of_entry(script, entry)]
        for slot, entries in written.items()
    }


def fillers_of_entry(script: Script, entry: Any) -> list[Filler]:
    """What one entry of a slot stands for."""
    text = str(entry)
    if script.grammar.slots:
        if ".." in text:
            low, high = map(int, text.split(".."))
            return [Filler(str(number)) for number in range(low, high + 1)]
        if text == "colors":
            return [Filler(color) for color in COLORS]
        if text in script.objects:
            group = script.objects[text]
            count = group.count if group.count is not None else None
            if count is None and isinstance(group.at, tuple) and isinstance(group.at[0], tuple):
                count = len(group.at)
            word = text.replace("_", " ")
            if count is None:
                return [Filler(word, text)]
            return [Filler(f"{word} {k + 1}", f"{text}[{k}]") for k in range(count)]
        members = [name for name in script.cast if name.partition("[")[0] == script.player_of(text)]
        if members:
            return [
                Filler(str(script.versions(name)[0].name or default_name(name)), name) for name in members
            ]
    return [Filler(text)]


def spread(cast: Mapping[str, Any]) -> dict[str, Any]:
    """The cast with its groups written out as `peers[0]`, `peers[1]`; a list has one value for each."""
    written: dict[str, Any] = {}
    for name, member in cast.items():
        if not member or "count" not in member:
            written[name] = member
            continue
        for number in range(member["count"]):
            written[f"{name}[{number}]"] = {
                key: value[number] if listed(key, value) else value
                for key, value in member.items()
                if key != "count"
            }
    return written


def listed(key: str, value: Any) -> bool:
    """Whether a value of a group is a list with one for each member."""
    if key == "at":
        return any(isinstance(cell, tuple) for cell in value)
    return key in ("name", "color", "place", "facing") and isinstance(value, tuple)


def written_out(cast: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The npc files of members whose `one_of` holds what is in the files, not their names."""
    return {
        name: {npc["npc"]: npc for npc in member["one_of"]}
        for name, member in cast.items()
        if member and isinstance(member.get("one_of"), tuple)
    }


def parameter(entry: Any, given: str | None) -> Any:
    """The value of a parameter: what was given behind `?`, read as YAML reads it, else the default."""
    values = entry.get("values") if isinstance(entry, dict) else None
    value = entry["default"] if isinstance(entry, dict) else entry
    if isinstance(values, Mapping):
        # The default is a label, or a value of its own.
        return values.get(str(value), value) if given is None else values[given]
    return value if given is None else scalar(given)


def scalar(text: str) -> Any:
    """A plain YAML scalar."""
    if text in ("true", "false"):
        return text == "true"
    if re.fullmatch(r"-?\d+", text):
        return int(text)
    return float(text) if re.fullmatch(r"-?\d*\.\d+", text) else text


def tuples(data: Any) -> Any:
    """The data with tuples for lists."""
    if isinstance(data, Mapping):
        return {key: tuples(value) for key, value in data.items()}
    return tuple(map(tuples, data)) if isinstance(data, list | tuple) else data


def substituted(data: Any, params: Mapping[str, Any]) -> Any:
    """The data with the value of a parameter wherever a whole scalar is `$name`."""
    if isinstance(data, Mapping):
        return {key: value if key == "params" else substituted(value, params) for key, value in data.items()}
    if isinstance(data, tuple):
        return tuple(substituted(item, params) for item in data)
    whole = re.fullmatch(r"\$(\w+)", data) if isinstance(data, str) else None
    return params[whole[1]] if whole else data


def record(kind: type, data: Any, readers: Mapping[str, Callable[[Any], Any]]) -> Any:
    """A record of this kind; words that Python reserves get an underscore; unknown keys are refused."""
    reserved = {"for": "for_", "while": "while_", "with": "with_", "from": "from_"}
    values = {reserved.get(key, key): value for key, value in (data or {}).items()}
    known = {**kind.__dataclass_fields__}  # type: ignore[attr-defined]
    unknown = values.keys() - known.keys()
    assert not unknown, f"the reference does not know {unknown} in a {kind.__name__}"
    return kind(**{k: readers[k](v) if k in readers else v for k, v in values.items() if v is not None})


def many(value: Any) -> tuple[Any, ...]:
    """One or several."""
    return value if isinstance(value, tuple) else (value,)


def rules(entries: Any) -> tuple[Rule, ...]:
    """A list of rules."""
    return tuple(record(Rule, _with_conditions(entry), {"hears": many, "cause": many}) for entry in entries)


def _with_conditions(entry: Any) -> dict[str, Any]:
    """The keys of a rule, those of `CONDITIONS` together."""
    others = {key: value for key, value in entry.items() if key not in CONDITIONS}
    return others | {"asked": {key: entry[key] for key in CONDITIONS if entry.get(key) is not None}}


def steps_of(steps: Any) -> tuple[Step, ...]:
    """Entries, with those that are nested."""
    return tuple(record(Step, step, {"cause": many, "steps": steps_of}) for step in steps)


def frame_of(entry: Any) -> Frame:
    """A frame."""
    return record(
        Frame,
        entry,
        {
            "states": lambda states: {
                name: record(State, state, {"first": rules, "then": rules}) for name, state in states.items()
            },
            "steps": steps_of,
        },
    )


def member_of(entry: Any) -> Member:
    """A member of the cast; where several files can be it, they are read apart from it."""
    kept = {key: value for key, value in (entry or {}).items() if key != "one_of"}
    return record(
        Member, kept, {"beliefs": each(lambda belief: record(Belief, belief, {"from_": sources_of}))}
    )


def sources_of(entries: Any) -> tuple[Source, ...]:
    """The sources of a belief."""
    return tuple(record(Source, entry, {"hears": many}) for entry in entries)


def let_of(entry: Any) -> Any:
    """A `let`: an expression, or a sequence."""
    if not isinstance(entry, Mapping):
        return entry
    moves = entry["moves"]
    moves = moves if isinstance(moves, tuple) else tuple(word.strip() for word in str(moves).split("|"))
    said = entry.get("utterance")
    return Sequence(int(entry["sequence"]), moves, None if said is None else float(said["chance"]))


def each(reader: Callable[[Any], Any]) -> Callable[[Any], dict[str, Any]]:
    """Reads the values of a mapping."""
    return lambda entries: {name: reader(entry) for name, entry in entries.items()}


READERS: Final[dict[str, Callable[[Any], Any]]] = {
    "grammar": lambda entry: record(Grammar, tuples(SHARED_GRAMMARS.get(str(entry), entry)), {}),
    "room": lambda entry: record(Room, entry, {}),
    "actions": many,
    "order": many,
    "objects": each(lambda entry: record(Group, entry, {})),
    "let": each(let_of),
    "looks": each(lambda entry: record(Look, entry, {})),
    "memory": each(lambda entry: record(Memory, entry, {})),
    "frames": each(frame_of),
    "roles": each(member_of),
    "npc_defaults": member_of,
    "cast": each(member_of),
    "rules": rules,
    "require": many,
    "reward": lambda entry: record(Pay, entry, {}),
    "outcome": lambda entries: tuple(record(Outcome, entry, {"for_": many}) for entry in entries),
    "session": lambda entry: record(Session, entry, {"same": many}),
    "observe": lambda entry: record(Observe, entry, {"channels": many}),
    "probes": each(lambda entry: record(Probe, entry, {"answers": many})),
}
