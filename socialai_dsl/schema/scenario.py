"""A scenario file as models: they are the syntax tree of the YAML part; expressions inside stay text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal, TypeVar, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    JsonValue,
    StringConstraints,
    Tag,
    WithJsonSchema,
)
from pydantic.config import JsonDict

from socialai_dsl.schema.holds import Hides, Holds, Means
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import PRIMITIVES, Primitive


def as_written(form: Any) -> BeforeValidator:
    """What authors may write where the model holds what the loader makes of it; only the JSON Schema tells."""
    return BeforeValidator(_unchanged, json_schema_input_type=form)


def _unchanged(value: Any) -> Any:
    return value


Word = Annotated[
    str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=40), Holds("new name")
]
"""A name that an author declares: letters, digits and underscores, not starting with a digit."""

FrameName = Annotated[Word, Holds("name", ("frames",))]
RoleName = Annotated[Word, Holds("name", ("roles",))]
LetName = Annotated[Word, Holds("name", ("let",))]
LookName = Annotated[Word, Holds("name", ("looks",))]
TypeName = Annotated[Word, Holds("name", ("types",))]
ObjectName = Annotated[str, Holds("name", ("objects",))]
"""Names that are declared elsewhere; that of an object may have a number, `boxes[1]`."""

TEST_SET: Final = 500
"""The rooms in which everybody is tested unless told otherwise."""
LANGUAGE_TAG: Final = r"^[a-z]{2,3}(-[A-Z][a-z]{3})?(-([A-Z]{2}|[0-9]{3}))?$"
"""Language, perhaps script, perhaps country or region."""

WORD_SCHEMA: Final[JsonDict] = {"pattern": "^[A-Za-z_][A-Za-z0-9_]*$", "maxLength": 40}
"""The same for keys of a mapping whose known keys have fields; pydantic leaves their names out."""

Target = Annotated[
    str,
    StringConstraints(
        pattern=r"^\s*[A-Za-z_][A-Za-z0-9_]*\s*(\(.+\)\s*)?(\.\s*[A-Za-z_][A-Za-z0-9_]*\s*)?$", max_length=200
    ),
    Holds("name", ("let", "state", "looks")),
]
"""What `set` changes: a register, one of those for each of a group, `trust(speaker)`, or a look, `ann.mood`."""

Expression = Annotated[int | bool | str, Holds("expression")]
"""The source of an expression; a bare number or truth value may be written without quotes."""

Interval = Annotated[Expression, Holds("interval")]
"""The source of an expression `a..b`, or of a number."""

Activity = Annotated[str, Holds("activity")]
Place = Annotated[str, Holds("place")]

_Text = Annotated[str, StringConstraints(min_length=1, max_length=500)]

# The loader makes texts of plain numbers, `true` and `null` where a text is expected.
_Null = Annotated[None, WithJsonSchema({"enum": [None]})]
TextLine = Annotated[_Text, as_written(_Text | float | bool | _Null), Holds("text")]
"""A text that the agent or an NPC can say, possibly with <...> parts."""

Prose = Annotated[str, as_written(str | float | bool), Holds("prose")]
"""A text for people."""

LanguageTag = Annotated[str, StringConstraints(pattern=LANGUAGE_TAG)]
"""A language as a short BCP 47 tag: `en`, `zh-Hant`, `pt-BR`."""

NOT_BLANK: Final = r"\S"
_Told = Annotated[str, StringConstraints(pattern=NOT_BLANK, max_length=4000)]
_InLanguages = dict[LanguageTag, Annotated[_Told, as_written(_Told | float | bool | _Null), Holds("told")]]
Instructions = Annotated[
    Annotated[_Told, as_written(_Told | float | bool), Holds("told"), Tag("text")]
    | Annotated[Annotated[_InLanguages, Field(min_length=1)], Tag("mapping")],
    Discriminator(lambda value: "mapping" if isinstance(value, dict) else "text"),
    Holds("prose"),
]
"""A text for players, or one for each of several languages."""

StateName = Annotated[Word, as_written(Word | bool | _Null), Holds("state")]
"""The name of a state."""

ExpressionOrText = Annotated[
    Expression, as_written(Expression | float | _Null), Holds("text", beside=(bool, int))
]
"""The source of an expression, or a text."""

SpeakerName = Annotated[ExpressionOrText, Holds("text")]
"""The source of an expression, or the text of a name."""


def _one_or_many(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Item = TypeVar("Item")
ListOf = Annotated[tuple[Item, ...], BeforeValidator(_as_tuple)]
"""A list in the file, a tuple in the model."""

Expressions = Annotated[
    ListOf[Expression],
    BeforeValidator(_one_or_many, json_schema_input_type=Expression | tuple[Expression, ...]),
]
"""One expression, or a list of them."""

_Starts = Annotated[
    ListOf[Expression],
    Field(min_length=1),
    BeforeValidator(
        _one_or_many,
        json_schema_input_type=Expression | Annotated[tuple[Expression, ...], Field(min_length=1)],
    ),
]

Effect = Annotated[Expressions, Holds("effect")]
"""One effect, or a list of them."""

Places = Annotated[Expressions, Holds("place")]
"""One place, or a list of them."""

Texts = Annotated[
    ListOf[TextLine],
    BeforeValidator(_one_or_many, json_schema_input_type=TextLine | tuple[TextLine, ...]),
]
"""One text, or a list of them."""

_Filler = Annotated[TextLine | int, Holds("text", beside=(int,))]
_ManyFillers = Annotated[tuple[_Filler, ...], Field(min_length=1, max_length=256)]
Fillers = Annotated[
    _ManyFillers,
    BeforeValidator(_as_tuple),
    BeforeValidator(_one_or_many, json_schema_input_type=_Filler | _ManyFillers),
]
"""What can stand in a slot of a grammar, one or a list."""


class Model(BaseModel):
    """Base of all models: unknown keys are errors, nothing is coerced, nothing changes after loading."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        populate_by_name=True,  # for us, who make models of models; files are read by the alias alone
        protected_namespaces=(),
        # Only the root is ever validated; building every model by itself would triple the time to start.
        defer_build=True,
    )


Earshot = Annotated[Expression | Literal["next_to", "room"], Holds("word")]
"""The reach of a voice: a word, or a number of cells."""


# -- who acts and how ----------------------------------------------------------------------------------------


SlotType = Literal[
    "text", "utterance", "object", "npc", "direction", "color", "int", "bool", "noun", "cell", "sequence"
]

Probability = Annotated[
    float, Field(ge=0, le=1), BeforeValidator(lambda v: float(v) if type(v) is int else v)
]


DOES: Final = ("do", "set", "reward", "cause", "say", "to", "goto", "goto_now")
"""Keys of a rule or a step that say what it does, in this order whatever the order in the file."""


class Effects(Model):
    """What a rule or a step does, in the order of `DOES`."""

    set: dict[Target, Expression] = Field(
        default_factory=dict,
        description="registers of the frame or the world, or looks: their new values",
        examples=[{"trust(speaker)": 5}],
    )
    cause: Effect = Field((), description="an effect, or several in this order")
    say: TextLine | None = Field(
        None, description="the text that is said; <...> is a value", examples=["The <exit.color> door"]
    )
    to: Expression | None = Field(
        None, description="the member of the cast whom `say` addresses", examples=["speaker"]
    )


MemberName = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*(\[[0-9]+\])?$", max_length=40),
    Holds("name", ("cast",)),
]
"""A member of the cast; those of a group are numbered from 0: `peers[0]`."""

Names = Annotated[
    ListOf[MemberName],
    Field(min_length=1),
    BeforeValidator(
        _one_or_many,
        json_schema_input_type=MemberName | Annotated[tuple[MemberName, ...], Field(min_length=1)],
    ),
]
"""One member or group of the cast, or a list of them."""


class Rule(Effects):
    """Conditions, all of which must hold, and effects."""

    id: Word | None = Field(None, description="names the rule in coverage, traces and patches")
    hears: Annotated[Texts, Holds("utterance")] = Field(
        (), description="an utterance, or a list of alternatives; `<noun>` is any noun, `any` any utterance"
    )
    addressed: bool | None = Field(
        None, description="of `hears`: `true`: only what is said to this member; `false`: only the rest"
    )
    when: Expression | None = Field(None, description="a condition", examples=["eye_contact(agent)"])
    after: Annotated[Expression | None, Hides(False), Means("turns_in_state >= after")] = Field(
        None, description="at least so many activities of this state have run"
    )
    before: Annotated[Expression | None, Hides(False), Means("turns_in_state < before")] = Field(
        None, description="fewer activities of this state than that have run"
    )
    chance: Probability | None = Field(
        None, description="a probability, drawn in each turn in which all other conditions hold"
    )
    once: bool = Field(False, description="fires once per episode and member")


_PerCent = Annotated[int, Field(ge=-100, le=100)]


class WorldRule(Model):
    """A rule of the world, read once per step after all turns; each that holds takes effect."""

    id: Word | None = Field(None, description="names the rule in coverage, traces and patches")
    when: Expression | None = Field(None, description="a condition", examples=["eye_contact(agent)"])
    chance: Probability | None = Field(
        None, description="a probability, drawn in each step in which `when` holds"
    )
    once: bool = Field(False, description="takes effect once per episode")
    set: dict[Target, Expression] = Field(
        default_factory=dict, description="registers of the world, or looks: their new values"
    )
    cause: Effect = Field((), description="an effect, or several in this order")
    reward: _PerCent | dict[MemberName, _PerCent] = Field(
        0,
        description="per cent of the success reward, added to the reward of the step; or for each "
        "seat, by member",
        examples=[{"agent": 5, "helper": -5}],
    )


class ThenRule(Rule):
    """A rule read after the body action."""

    goto: StateName | None = Field(
        None,
        description="the state to enter: in `first` at once, in `then` or beside `do` from the next turn on",
    )
    goto_now: StateName | None = Field(
        None, description="the state to enter at once: its `then` is still read in this turn"
    )


class FirstRule(ThenRule):
    """A rule read before the body action, which it may choose itself."""

    do: Activity | None = Field(
        None, description="an activity, in place of the state's", examples=["go_next_to(agent)"]
    )


class State(Model):
    """A state of a frame: in each turn, rules before the body action, the body action, rules after it."""

    first: ListOf[FirstRule] = Field(
        (), description="rules read before the body action; the first that holds fires"
    )
    do: Activity | None = Field(None, description="an activity; default `stay`", examples=["face(agent)"])
    then: ListOf[ThenRule] = Field(
        (), description="rules read after the body action; the first that holds fires"
    )

    @property
    def rules(self) -> tuple[ThenRule, ...]:
        """All of them, in the order written."""
        return (*self.first, *self.then)


class Step(Effects):
    """One entry of `steps`: an activity until it is finished, then its effects."""

    state: StateName | None = Field(
        None, description="the entry's name, for `npc.is(name)`; default `step0`, `step1`, ..."
    )
    do: Activity | None = Field(
        None, description="an activity, until it is finished; default `stay`", examples=["go_to(exit)"]
    )
    until: Expression | None = Field(None, description="a condition that ends the entry")
    for_: Expression | None = Field(
        None, alias="for", description="the number of turns after which the entry ends, or `ever`"
    )
    when: Expression | None = Field(
        None,
        description="a condition; if it is false at the start of the entry's first turn, the entry is "
        "left out",
    )
    steps: ListOf[Step] | None = Field(None, description="nested entries, in place of an activity")
    repeat: Expression | None = Field(
        None,
        description="the number of rounds of the nested `steps`, with `while` or `until` at most",
        examples=[3],
    )
    while_: Expression | None = Field(
        None, alias="while", description="a condition for one more round of the nested `steps`"
    )


def _entries(steps: tuple[Step, ...], path: DataPath) -> Iterator[tuple[DataPath, Step]]:
    for i, step in enumerate(steps):
        if step.steps is None:
            yield (*path, i), step
        else:
            yield from _entries(step.steps, (*path, i, "steps"))


class Register(Model):
    """A register with a range to which its values are clipped, or a register for each member of a group."""

    start: Expression = Field(description="the initial value; `none`: empty")
    range: Interval | None = Field(
        None, description="a..b, to which its values are clipped", examples=["0..10"]
    )
    for_: Expression | None = Field(
        None, alias="for", description="a group: a register for each of its members", examples=["peers"]
    )


class Look(Model):
    """An attribute of each of a group that is seen, and may change."""

    for_: Expression = Field(
        alias="for", description="a group: objects, or members of the cast", examples=["balls"]
    )
    words: Annotated[ListOf[Word], Hides(True)] = Field(
        min_length=2, max_length=8, description="the words, two to eight", examples=[["small", "large"]]
    )
    start: _Starts = Field(
        ("random",),
        description="the initial word: an expression in which `it` is each of the group, or a list "
        "with one each; default `random`",
    )
    ordered: Annotated[bool, Hides(True)] = Field(
        False, description="the words go from the least to the greatest: `a.size < b.size` compares them"
    )


class Frame(Model):
    """A pragmatic frame: a protocol of interaction with slots for what varies."""

    slots: dict[Word, SlotType] = Field(
        default_factory=dict,
        description="name: type of a value that members of the cast give by `with`",
        examples=[{"lesson": "object"}],
    )
    let: dict[Word, Expression | Register] = Field(
        default_factory=dict,
        description="name: the initial value of a register, one for each member that follows the frame",
    )
    define: dict[str, Expression] = Field(default_factory=dict, description="recomputed at every use")
    start: StateName | None = Field(None, description="the first state; default: the first in the file")
    states: dict[Word, State] | None = Field(None, description="name: a state of the interaction")
    steps: ListOf[Step] | None = Field(
        None, description="in place of states: activities in a row, each until it is finished"
    )

    def all_effects(self) -> Iterator[Effects]:
        """Every rule and entry."""
        yield from (step for _, step in self.entries())
        yield from (rule for state in (self.states or {}).values() for rule in state.rules)

    def entries(self) -> Iterator[tuple[DataPath, Step]]:
        """The entries of `steps`, nested ones in their place, each with where it is written in the frame."""
        return _entries(self.steps or (), ("steps",))


class Role(Model):
    """A part that a member of the cast plays: where it is put, and what drives it if it is an NPC."""

    place: Place | None = Field(None, description="default anywhere")
    at: ListOf[Expression] | None = Field(
        None, description="[x, y] in place of `place`", examples=[[1, "H - 2"]]
    )
    facing: Annotated[Expression | None, Hides(False)] = Field(
        None, description="a direction, random, or toward(x); default random"
    )
    frame: FrameName | None = Field(None, description="the frame an NPC in this role follows")


class Source(Model):
    """A source of a belief: something that the member sees, or hears."""

    of: Expression = Field(description="the value that the belief takes")
    when: Expression | None = Field(None, description="a condition", examples=["sees(toy)"])
    hears: Annotated[Texts, Holds("utterance")] = Field(
        (), description="an utterance, or a list of alternatives; `<noun>` is any noun, `any` any utterance"
    )


class Belief(Model):
    """A belief of a member of the cast: its latest observation of a value."""

    of: Expression | None = Field(None, description="the value that it is about")
    when: Expression | None = Field(
        None, description="a condition: the belief takes the value while it holds; default: always"
    )
    start: Expression | None = Field(
        None, description="the initial value; default: the true one; `none`: empty"
    )
    from_: ListOf[Source] = Field(
        (),
        alias="from",
        description="in place of `of` and `when`: sources, read in this order each turn; the first "
        "that holds counts",
    )
    forget: Expression | None = Field(
        None,
        description="the number of turns without a source after which the belief is empty, or a "
        "condition that empties it; default: never",
    )


class Character(Model):
    """An inhabitant of the room: its appearance, place and behaviour."""

    kind: Annotated[Word, Holds("spelt")] | None = Field(
        None, description="a word for its appearance; default `peer`"
    )
    name: SpeakerName | None = Field(
        None, description="the speaker's name before its lines; default: its key, capitalised"
    )
    color: Annotated[Expression | None, Hides(False)] = Field(None, description="default random")
    place: Place | None = Field(None, description="default anywhere")
    at: ListOf[Expression] | None = Field(
        None, description="[x, y] in place of `place`", examples=[[1, "H - 2"]]
    )
    facing: Annotated[Expression | None, Hides(False)] = Field(
        None, description="a direction, random, or toward(x); default random"
    )
    view: int | None = Field(
        None, ge=1, le=15, description="side of the square that it sees, in cells; default 7"
    )
    earshot: Earshot | None = Field(
        None, description="the reach of its own voice; it never limits what it hears; default: the scenario's"
    )
    frame: FrameName | None = Field(None, description="the frame that it follows; default: none, it stays")
    with_: dict[Annotated[Word, Holds("name", ("slots",))], ExpressionOrText] = Field(
        default_factory=dict, alias="with", description="slot of the frame: its value"
    )
    beliefs: dict[Word, Belief] = Field(
        default_factory=dict, description="name: a belief about a value, `npc.believes.name`"
    )
    accepts: Expression | None = Field(
        None,
        description="a condition: while it holds, the member takes what it is given; default: always",
        examples=["is(waiting)"],
    )
    audible: Literal["always"] | None = Field(None, description="heard even while NPCs are hidden")
    pushed_by: Literal["anybody"] | None = Field(
        None,
        description="whoever walks into it moves it one cell the same way, and stays; default: nobody can",
    )
    kind_code: int | None = Field(
        None,
        ge=0,
        le=255,
        description="its number in the status channel of the image; default: by the order in which kinds "
        "appear",
    )


class NpcDefaults(Character):
    """Keys of all NPCs; a member's own keys override them."""

    seat: Literal["open"] | None = Field(
        None, description="`open`: a player outside of the file can play it; the agent always has a seat"
    )


class Npc(Character):
    """A file of its own for one NPC: what it is, with its frames; `one_of` draws it."""

    npc: Word = Field(description="the name of this file's NPC")
    abstract: bool = Field(False, description="a base for `extends` only; no member can be it")
    about: Prose | None = Field(None, description="one sentence for readers of the file")
    notes: Prose | None = Field(None, description="more for readers of the file")
    frames: dict[Word, Frame] = Field(default_factory=dict, description="the frames it brings along")


class CastMember(NpcDefaults):
    """The agent or an NPC. Keys left out come from the file that `one_of` draws, from its role, from `npc_defaults`,
    then from the defaults of the language.
    """

    role: RoleName | None = Field(None, description="the role that it plays")
    one_of: Annotated[
        tuple[Npc, ...] | None,
        BeforeValidator(_as_tuple),
        as_written(str | list[str]),
        Holds("file"),
    ] = Field(
        None, description="npc files, one of which is drawn for each episode: a list, or a pattern with `*`"
    )


class CastGroup(CastMember):
    """A group in the cast as authors write it: several alike members; a list gives one value to each.

    The loader makes members `name[0]`, `name[1]`, ... of it, so that no scenario holds one.
    """

    count: int = Field(
        ge=1,
        le=16,
        description="makes a group of this size; `name`, `color`, `place`, `facing`, `at` may then be lists",
    )
    name: Annotated[SpeakerName | None, as_written(ExpressionOrText | None | list[ExpressionOrText])] = Field(
        None, description="what precedes its lines; a list gives one each"
    )
    color: Annotated[Expression | None, as_written(Expression | list[Expression])] = Field(
        None, description="default random; a list gives one each"
    )
    place: Annotated[Place | None, as_written(str | list[str])] = Field(
        None, description="default anywhere; a list gives one each"
    )
    facing: Annotated[Expression | None, as_written(Expression | list[Expression])] = Field(
        None, description="a direction, random, or toward(x); a list gives one each"
    )
    at: Annotated[
        tuple[Expression, ...] | None,
        BeforeValidator(_as_tuple),
        as_written(list[Expression] | list[list[Expression]]),
    ] = Field(None, description="[x, y], or a list of them: one each")


class WrittenCast(Model):
    """The cast as authors write it: the agent, and anybody else, alone or in a group."""

    model_config = ConfigDict(extra="allow", json_schema_extra={"propertyNames": WORD_SCHEMA})
    __pydantic_extra__: dict[Word, CastMember | CastGroup]

    agent: CastMember | None = Field(None, description="whom a policy plays")


# -- room, objects, and what the agent perceives -------------------------------------------------------------


class Room(Model):
    """A walled rectangle: `size`, or `width` and `height`."""

    size: Interval | None = Field(
        None,
        description="n, or a..b: width and height in cells, walls included, 3 to 30; each is drawn by itself",
        examples=["5..8", 8],
    )
    width: Interval | None = Field(None, description="width in cells, walls included")
    height: Interval | None = Field(None, description="height in cells, walls included")
    build: ListOf[dict[TypeName, Place]] = Field(
        (),
        description="list of {type: place}: fixed things on all cells of the place, in place of "
        "floor; the size of the room alone decides them",
        examples=[[{"lava": "column(W // 2)"}]],
    )
    occlusion: bool = Field(False, description="opaque things hide the cells behind them")
    canvas: Annotated[ListOf[int], Field(min_length=2, max_length=2)] | None = Field(
        None, description="[width, height] of the grid on which the room lies; default: the largest room"
    )


class ObjectGroup(Model):
    """An object, or with `count` (or a list in `at`) a group of them."""

    type: TypeName = Field(description="an object type", examples=["door"])
    count: Annotated[int | None, Hides(True)] = Field(
        None, ge=1, le=16, description="makes a group of this size"
    )
    place: Places | None = Field(
        None, description="where it is put; a list has a place for each of the group; default `anywhere`"
    )
    at: (
        Annotated[
            tuple[Expression, ...] | tuple[tuple[Expression, ...], ...],
            BeforeValidator(lambda v: tuple(_as_tuple(item) for item in v) if isinstance(v, list) else v),
        ]
        | None
    ) = Field(None, description="[x, y] in place of `place`; a list of them makes a group")
    color: Annotated[Expressions | None, Hides(False)] = Field(
        None,
        description="a colour, `random`, `distinct` (no two of the group alike), a list with one "
        "each, `others.color` (of each its counterpart) or `permuted(others.color)` (the "
        "same in a drawn order); default: the type's",
    )
    state: StateName | None = Field(None, description="the initial status; default: the type's")
    pressed: Expression | None = Field(
        None, description="a condition at reset: if it holds, the initial status is `pressed`"
    )
    opened: Expression | None = Field(
        None, description="a condition at reset: if it holds, the initial status is `opened`"
    )
    locked: Expression | None = Field(None, description="a condition: the object is `locked` while it holds")
    tagged: Expression | None = Field(None, description="a condition: the object is `tagged` while it holds")
    one_way: bool = Field(False, description="a toggle only leads away from the initial status, never back")
    dark: bool = Field(False, description="the agent sees every status as the type's initial one")
    carryable: Annotated[bool, Hides(True)] = Field(
        False, description="members of the cast can pick it up, carry and give it"
    )
    inside: Annotated[str, Holds("name", ("objects", "cast"))] | None = Field(
        None,
        description="the object that it lies in until that is opened, or the member that carries it, "
        "initially",
    )
    exclusive: bool = Field(
        False,
        description="of a group: while one of them is not in its initial status, the others react to "
        "no toggle and no push",
    )
    overlap: bool = Field(
        False,
        description="`place` may draw a cell that is taken, in a column, row or rect also one that the "
        "room builds on; `at` always may",
    )
    timer: int | None = Field(
        None,
        ge=1,
        le=10_000,
        description="the number of steps after which its active status expires; default: never",
    )
    opens: ObjectName | None = Field(
        None,
        description="the objects that are open exactly while this is active: a name, a group or `a | "
        "b`; of two groups the first opens the first, and so on",
    )
    pushed_by: TypeName | None = Field(
        None, description="the type of object that alone can push it; default: bodies, and objects that roll"
    )
    unlocks: ObjectName | None = Field(
        None, description="the objects that this unlocks for good when it is pressed, written like `opens`"
    )


_Aim = Literal["pointing_right", "pointing_ahead"]
Channel = Literal["type", "color", "status", "orientation", "pointing", "last_act", _Aim, "carrying"]
CHANNELS: tuple[Channel, ...] = get_args(Channel)
"""Channels that need no declaration; each of `looks` is one as well."""


class Observe(Model):
    """The agent's perception."""

    npcs: Literal["shown", "hidden"] = Field(
        "shown",
        description="`hidden`: the agent neither sees nor hears NPCs, and walks through them; they go "
        "on acting, and can be poked",
    )
    image: Literal["end", "before_npcs"] = Field(
        "end", description="the moment of the image: the `end` of the step, or `before_npcs`"
    )
    names: Literal["shown", "hidden"] = Field(
        "shown", description="`hidden`: the agent hears lines without the speaker's name"
    )
    lines: Literal["plain", "marked"] = Field(
        "plain",
        description="`marked`: each line in `tokens` begins with a token of its own for the speaker, `<Ann>`",
    )
    own_voice: bool = Field(False, description="whether the agent hears itself")
    seats: Literal["shown", "hidden"] = Field(
        "shown",
        description="of several seats: `hidden`: neither the own cell in the image nor the text for "
        "language models tells a player its seat",
    )
    channels: ListOf[Channel | LookName] | None = Field(
        None,
        description="the channels of the image: the first 4, 6 or 8 of these, then `carrying`, then "
        "looks in the order of the file; default: the first 4, `carrying` where NPCs can "
        "carry something, all looks",
        examples=[["type", "color", "status", "orientation", "carrying"]],
    )
    tone: LookName | None = Field(
        None, description="a look of NPCs: its word is heard before what they say: `Ann: (angry) No`"
    )
    directions: Literal["absolute", "egocentric"] = Field(
        "absolute",
        description="the directions of NPCs in the image: `absolute`, or `egocentric`, as seen from "
        "the agent",
    )


SlotMark = Annotated[
    str,
    StringConstraints(pattern=r"^<[A-Za-z_][A-Za-z0-9_]*>$", max_length=42),
    Holds("spelt"),
]
"""A slot of the grammar as templates write it."""


class UtteranceGrammar(Model):
    """The agent's utterances: every template with all values of its slots."""

    templates: ListOf[TextLine] = Field(
        min_length=1,
        max_length=64,
        description="texts; `<noun>` stands for each noun, `<slot>` for each value of a slot",
        examples=[["Where is <noun>"]],
    )
    nouns: ListOf[_Filler] = Field(
        (),
        min_length=1,
        max_length=256,
        description="the values of `<noun>`, words or numbers",
        examples=[["the exit", "the wall"]],
    )
    slots: dict[Word, Fillers] = Field(
        default_factory=dict,
        max_length=8,
        description="in place of `nouns`; name: the values of `<name>`: words, objects, members of the "
        "cast, `colors`, 1..6",
        examples=[{"what": ["the ball", "the key"], "whom": "peers"}],
    )
    to: Annotated[SlotMark | None, Hides(True)] = Field(
        None,
        description="the slot, as `<whom>`, whose value the agent addresses",
        examples=["<whom>"],
    )


# -- claims and probes, which playing never reads ------------------------------------------------------------


LetNames = Annotated[
    ListOf[LetName],
    Field(min_length=1),
    BeforeValidator(
        _one_or_many,
        json_schema_input_type=LetName | Annotated[tuple[LetName, ...], Field(min_length=1)],
    ),
]
"""One `let`, or a list of them."""


class OnlyThrough(Model):
    """A draw that only these members reveal."""

    draw: LetName = Field(description="a `let` that nothing else may reveal")
    by: Names = Field(description="the members of the cast whose cues may reveal it")


class Dilemma(Model):
    """Two frames that every seat may follow, by which all together do better than each does for itself."""

    cooperate: FrameName = Field(description="the frame of those who cooperate")
    defect: FrameName = Field(description="the frame of those who do not")


class Property(Model):
    """A property: one of `reachable`, `never`, `within`, `oracle`, `script`, `rival`, `needs`, `only_through`,
    `knowable` and `dilemma`.
    """

    reachable: Expression | None = Field(
        None, description="a condition, or an outcome's name, that the agent can make true in some room"
    )
    never: Expression | None = Field(
        None, description="a condition, or an outcome's name, that no agent can make true in any room"
    )
    within: Annotated[int | None, Hides(True)] = Field(
        None, ge=1, le=10_000, description="the number of steps in which the agent can succeed in every room"
    )
    oracle: Annotated[Probability | None, Hides(True)] = Field(
        None, description="the least share of rooms that the scenario's script solves"
    )
    script: Annotated[Literal["perceives"] | None, Hides(True)] = Field(
        None, description="`perceives`: the scenario's script acts on its perceptions alone"
    )
    rival: Annotated[Word, Holds("name", ("rivals",))] | None = Field(
        None, description="a strategy of `rivals` that solves no more rooms than `at_most`"
    )
    at_most: Annotated[Probability | None, Hides(True)] = Field(
        None, description="for `rival`: the largest share of rooms that it may solve"
    )
    needs: Names | None = Field(None, description="members without which an agent can only guess")
    only_through: OnlyThrough | None = Field(None, description="members whose cues alone may reveal a draw")
    knowable: Annotated[bool | None, Hides(True)] = Field(
        None,
        description="whether an agent can perceive in time the draws that its success depends on "
        "(tried by default)",
    )
    dilemma: Dilemma | None = Field(
        None, description="of several seats: each gains by defecting whatever others do, and all lose by it"
    )
    share: Probability | None = Field(
        None, description="least share of rooms, for `reachable`, `within`, `script`, `needs` and `knowable`"
    )
    draw: LetName | None = Field(None, description="for `needs`: the `let` that has to be guessed")


class Probe(Model):
    """A question to a language model about the present moment, whose right answer the engine computes."""

    when: Expression | None = Field(
        None,
        description="a condition: the probe is asked once, when it first holds; default: when the "
        "episode has ended",
    )
    ask: TextLine = Field(description="the question; <...> is a value", examples=["Where will Sally look?"])
    answer: Expression = Field(
        description="the right answer at that moment: a value, or a condition, which means `yes` or `no`",
        examples=["sally.believes.toy_in.color"],
    )
    answers: Texts = Field(
        (), description="the possible answers; <...> is a value; default: all values of `answer`, up to 64"
    )


# -- tests, which playing never reads ------------------------------------------------------------------------


class DialogueRoom(Model):
    """The room of a test; what is left open is drawn."""

    seed: int | None = Field(
        None, ge=0, description="the seed of the room; default: one room of each of the seeds 0 to 4, in turn"
    )
    index: int | None = Field(None, ge=0, description="which room of the seed, from 0")
    test_episode: int | None = Field(
        None, ge=0, description="an episode of the fixed test set, in place of a seed"
    )
    layout: Annotated[str | dict[str, JsonValue], Holds("layout")] | None = Field(
        None,
        description="a known room, in the words of layouts, or the JSON or YAML file with one",
        examples=[{"agent": {"at": [2, 3], "facing": "up"}, "let": {"exit": "doors[1]"}}],
    )


class DialogueStep(Model):
    """What the agent does, and what must be so then."""

    do: Annotated[Texts, Holds("act")] = Field(
        (),
        description="an act or several, as typed in `socialai play`; default: nothing is done yet",
        examples=["Where is the exit", ["forward", "forward How are you"]],
    )
    hears: Annotated[Texts, Holds("heard")] = Field(
        (),
        description="all that is heard meanwhile, in order; <...> is a value; `any`: whatever it is; "
        "default: nothing",
        examples=["Gandalf: I am fine."],
    )
    state: dict[MemberName, StateName] = Field(
        default_factory=dict,
        description="member of the cast: the state of its frame after the acts",
        examples=[{"wizard": "acquainted"}],
    )
    true_: Expressions = Field(
        (), alias="true", description="a condition that holds after the acts, or a list of them"
    )
    not_: Expressions = Field(
        (), alias="not", description="a condition that does not hold after the acts, or a list of them"
    )


class DialogueTest(Model):
    """A dialogue that must go as written; `socialai test` plays it."""

    about: Prose | None = Field(None, description="one sentence for readers of the file")
    of: Annotated[str, Holds("spelt")] | None = Field(
        None, description="variants and parameters of the scenario that is played", examples=["+unsocial?n=2"]
    )
    room: DialogueRoom = Field(DialogueRoom(), description="the room; default: drawn")
    play: ListOf[DialogueStep] = Field(
        min_length=1, max_length=1000, description="what is done, step by step"
    )
    ends: Annotated[str, Holds("ending")] | None = Field(
        None,
        description="how the last act ends the episode: success, failure, deadly, timeout, an "
        "outcome's id, or `open`",
    )
    reward: float | None = Field(
        None, description="what the acts earn together, to three decimals", examples=[0.91]
    )


# -- the file ------------------------------------------------------------------------------------------------


class Outcome(Model):
    """One way the episode ends: exactly one of `success` and `failure`."""

    success: Expression | None = Field(
        None, description="a condition that ends the episode well", examples=["agent.at(exit)"]
    )
    failure: Expression | None = Field(None, description="a condition that ends the episode badly")
    reward: Annotated[Expression | dict[MemberName, Expression], Hides(False)] = Field(
        100,
        description="per cent of the success reward, computed when it ends; or for each seat, by member",
        examples=[{"agent": 100, "helper": 40}],
    )
    for_: Names = Field(
        (),
        alias="for",
        description="whose success it is, of several seats; default: that of all",
        examples=["helper"],
    )
    id: Word | None = Field(None, description="names the outcome in figures, `check` and patches")


class Reward(Model):
    """The reward of the agent."""

    success: Annotated[str, Holds("spelt")] = Field(
        "linear(0.9)", description="linear(s): a success at step t pays 1 - s t / horizon"
    )
    each_step: Annotated[
        float, Field(ge=-1, le=1), BeforeValidator(lambda v: float(v) if type(v) is int else v)
    ] = Field(0.0, description="a number, -1 to 1, that is added to the reward of every step")


class SungWith(Model):
    """The utterances of a sequence."""

    chance: Probability = Field(
        description="the probability that an element has an utterance, drawn uniformly from the grammar"
    )


class Sequence(Model):
    """A sequence of acts, drawn at reset: each element has a move and perhaps an utterance."""

    sequence: int = Field(ge=1, le=16, description="the number of elements")
    moves: ListOf[Primitive] = Field(min_length=1, description="the moves that are drawn from, all alike")
    utterance: SungWith | None = Field(
        None, description="whether elements have an utterance; default: they have none"
    )


class Memory(Model):
    """The agent's last acts, to be compared with a sequence."""

    last: int = Field(ge=1, le=16, description="the number of acts that it holds")
    of: Literal["agent.acts"] = Field(
        "agent.acts", description="the acts: the agent's body actions and utterances"
    )
    while_: Expression | None = Field(
        None, alias="while", description="a condition: only steps at whose start it holds count; default: all"
    )


PlainValue = Annotated[int | bool | float | str, Holds("value")]


class Parameter(Model):
    """A parameter of the file, used as $name."""

    default: PlainValue = Field(description="its value unless `?name=value` gives another")
    values: list[PlainValue] | dict[str, PlainValue] | None = Field(
        None, description="its possible values: a list, or label: value"
    )


class Published(Model):
    """A figure that a study reports: the share of those it tested who did something."""

    who: Prose = Field(
        description="who was tested, and under which condition", examples=["children of 4 years"]
    )
    did: Prose = Field(description="what was counted", examples=["right about where Sally looks"])
    share: Probability = Field(description="the share of them that did it")
    n: int = Field(description="how many were tested", ge=1)
    source: Prose = Field(description="where the figure is published")


class Session(Model):
    """Several episodes in a row in which some draws stay the same, so that a player can learn them."""

    episodes: int = Field(ge=2, le=1000, description="the number of episodes in a session")
    same: LetNames = Field(
        description="one or several `let`: each keeps its value from the first episode of a session to its last"
    )


class Scenario(Model):
    """One environment: a room with objects, a cast that follows frames, and an outcome."""

    scenario: Word = Field(description="the name of the scenario")
    abstract: bool = Field(False, description="a base for `extends` only; it cannot be run itself")
    about: Prose | None = Field(None, description="its purpose in one sentence; no player is told it")
    notes: Prose | None = Field(None, description="more for readers of the file; no player is told it")
    skills: ListOf[Prose] = Field((), description="the skills that it needs; no player is told them")
    instructions: Instructions | None = Field(
        None,
        description="what players are told before the first observation: a text, or a mapping from "
        "languages to texts",
        examples=["Reach the exit."],
    )
    training_frames: int | None = Field(
        None,
        ge=1,
        description="the number of frames for which the recipe `guided` trains an agent; default 500000",
    )
    horizon: int = Field(100, ge=1, le=10_000, description="the episode ends at t == horizon")
    earshot: Earshot = Field(
        "next_to", description="the reach of voices: `next_to`, `room`, or a Manhattan distance in cells"
    )
    overheard: bool = Field(
        True, description="whether others within earshot hear an utterance that addresses one member"
    )
    actions: ListOf[Primitive] = Field(PRIMITIVES, min_length=1, description="the agent's body actions")
    params: dict[Word, PlainValue | Parameter] = Field(
        default_factory=dict,
        description="name: a default, or `default` and `values`; `$name` stands for its value, "
        "`?name=value` sets it",
    )
    grammar: Annotated[
        UtteranceGrammar, as_written(UtteranceGrammar | Word), Holds("name", ("grammars",))
    ] = Field(description="the agent's utterances: written out, or the name of a shared grammar")
    room: Annotated[Room, Hides(False)] = Field(description="the walled room", examples=[{"size": "5..8"}])
    order: ListOf[Annotated[Word, Holds("name", ("objects", "cast"))]] = Field(
        (), description="names of objects and members that are placed first, in this order"
    )
    objects: dict[Word, ObjectGroup] = Field(
        default_factory=dict,
        description="name: an object in the room",
        examples=[{"exit": {"type": "door", "place": "wall(top)"}}],
    )
    looks: dict[Word, Look] = Field(
        default_factory=dict,
        max_length=6,
        description="name: an attribute of objects or members of the cast that is seen, and may change",
        examples=[{"size": {"for": "balls", "words": ["small", "large"]}}],
    )
    let: dict[Word, Expression | Sequence] = Field(
        default_factory=dict, description="name: a value that is drawn or computed once, at reset"
    )
    session: Annotated[Session | None, Hides(False)] = Field(
        None,
        description="how many episodes in a row share draws, and which",
        examples=[{"episodes": 3, "same": ["secret"]}],
    )
    define: dict[str, Expression] = Field(default_factory=dict, description="recomputed at every use")
    state: dict[Word, Expression | Register] = Field(
        default_factory=dict,
        description="name: the initial value of a register of the world, which rules and all frames can set",
    )
    tables: dict[Word, dict[str, ExpressionOrText] | str] = Field(
        default_factory=dict,
        description="name: {key: value}, or `permuted(table)`; `name(key)` looks a value up",
    )
    memory: dict[Word, Memory] = Field(
        default_factory=dict, description="name: a memory of the agent's last acts"
    )
    frames: dict[Word, Frame] = Field(
        default_factory=dict, description="name: a protocol of interaction, which members of the cast follow"
    )
    roles: dict[Word, Role] = Field(
        default_factory=dict, description="name: a part that a member of the cast plays"
    )
    npc_defaults: NpcDefaults = Field(
        NpcDefaults(), description="keys of all NPCs, which each may override; `with` is merged"
    )
    cast: Annotated[dict[MemberName, CastMember], as_written(WrittenCast)] = Field(
        description="who is in the room: the `agent` and the NPCs by name",
        examples=[{"guide": {"frame": "show_the_way"}, "agent": {"place": "anywhere"}}],
    )
    rules: ListOf[WorldRule] = Field(
        (), description="rules of the world, read once per step; each that holds takes effect"
    )
    outcome: Annotated[ListOf[Outcome], Hides(False)] = Field(
        min_length=1,
        description="conditions that end the episode, read after every step; the first that holds counts",
    )
    reward: Annotated[Reward, Hides(False)] = Field(
        Reward(), description="the reward of a success and of each step"
    )
    observe: Observe = Field(Observe(), description="the agent's perception; it changes nothing else")
    require: ListOf[Expression] = Field(
        (), description="conditions on the drawn room, which is drawn again while one of them is false"
    )
    check: ListOf[Property] = Field(
        (), description="claims that `socialai check` tries; play never reads them"
    )
    rivals: dict[Word, Frame] = Field(
        default_factory=dict,
        max_length=16,
        description="name: a strategy that lacks the skill, as a frame for the agent; `SCENARIO+name` "
        "plays it",
    )
    results_by: LetNames = Field(
        (),
        description="one or several `let`: results are also told for each of their values; play never "
        "reads it",
        examples=["condition"],
    )
    published: Annotated[ListOf[Published], Hides(False)] = Field(
        (),
        description="figures of studies with people, which the data sheet and reports show; play "
        "never reads them",
    )
    probes: dict[Word, Probe] = Field(
        default_factory=dict,
        max_length=64,
        description="name: a question to language models; play never reads them",
    )
    tests: dict[Word, DialogueTest] = Field(
        default_factory=dict,
        description="name: a dialogue that must go as written, which `socialai test` plays; play "
        "never reads them",
    )

    def __repr__(self) -> str:
        npcs = len(self.cast.keys() - {"agent"})
        return f"<Scenario {self.scenario}: {npcs} NPCs, {len(self.frames)} frames, horizon {self.horizon}>"
