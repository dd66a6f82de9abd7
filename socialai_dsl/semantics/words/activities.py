"""Words for what a member of the cast does: one body action a turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import parse_expression
from socialai_dsl.semantics import groups, hands
from socialai_dsl.semantics.groups import performed
from socialai_dsl.semantics.plans import Activity
from socialai_dsl.semantics.resolver import ENTITY, INT, Resolver
from socialai_dsl.semantics.scope import Macro, ReportedError, Scope, quoted, with_article
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import (
    ACTION,
    BOOL,
    CELL,
    DIRECTION,
    TURN,
    CellOf,
    Const,
    Measure,
    Term,
    Type,
    draws,
    entity,
)
from socialai_dsl.semantics.words.statuses import status_of
from socialai_dsl.source import DataPath
from socialai_dsl.vocabulary import PRIMITIVES, Primitive

Moves = Literal["walks", "turns", "stays"]


@dataclass(frozen=True, slots=True)
class Doing:
    """An activity's word where it is written.

    Attributes:
        word: its row of the table. node: all of it, for messages. args: what is written in brackets.
        path: where the value stands that it is.
    """

    resolver: Resolver
    word: Deed
    node: ast.Expr
    args: tuple[ast.Expr, ...]
    path: DataPath
    scope: Scope

    def activity(self, *args: Term, name: str | None = None) -> Activity:
        """The activity with these arguments; `name`: another one that it comes to."""
        span = self.resolver.findings.at(self.path)
        return Activity(name or self.word.name, args, self.scope.draws.site, span)

    def one(self, place: int) -> Term:
        """Somebody or something that it is about; not a group, of which it is not said which one is meant."""
        self.say_which(place)
        return self.resolver.value(self.args[place], ENTITY, self.scope)

    def somewhere(self, place: int) -> Term:
        """The same, or a cell."""
        self.say_which(place)
        return self.resolver.somewhere(self.args[place], self.scope)

    def say_which(self, place: int) -> None:
        """Report a group where one of it is meant."""
        node = self.args[place]
        if groups.is_group(self.resolver, node, self.scope):
            group, more = quoted(node), ", ..." if len(self.word.takes) > 1 else ""
            hint = f"`{self.word.name}(nearest(d in {group} to self){more})`, or draw one in `let` with `pick({group})`"
            raise self.fail("S204", f"`{group}` is a group: say which of them", node, hint=hint)

    def fail(
        self, code: str, message: str, node: ast.Expr | None = None, **more: str | None
    ) -> ReportedError:
        """Report what is wrong with it, or with a part of it; raising the result gives it up."""
        return self.resolver.fail(code, message, node or self.node, self.scope, **more)


_TYPES: Final[Mapping[str, Type]] = {"direction": DIRECTION, "turn": TURN, "int": INT}
"""What is expected of an argument, by what the word takes."""


def _plain(doing: Doing) -> Activity:
    """An activity of the arguments that it takes."""
    terms = [
        doing.one(place)
        if takes == "entity"
        else doing.resolver.value(doing.args[place], _TYPES[takes], doing.scope)
        for place, takes in enumerate(doing.word.takes)
    ]
    return doing.activity(*terms)


@dataclass(frozen=True, slots=True, kw_only=True)
class Deed(Signature):
    """A word for an activity.

    Attributes:
        meaning: the activity that a use of it stands for.
        moves: what becomes of the member that does it.
        endless: it never ends by itself, so that a step of it says how long it lasts.
        handles: the body actions that it takes besides walking and turning.
        goes: where it leads: to the cell of what it is about, or to one beside it.
        act: the body action with which it is over, which may move or replace what it is done to.
        lapses: it takes no step where it is fulfilled before it begins.
        arm: what becomes of an arm that points, which the agent lacks: it points, or it is taken down.
    """

    meaning: Callable[[Doing], Activity] = _plain
    moves: Moves = "walks"
    endless: bool = False
    handles: tuple[Primitive, ...] = ()
    goes: Literal["there", "beside"] | None = None
    act: Primitive | None = None
    lapses: bool = False
    arm: Literal["points", "rests"] | None = None

    @property
    def actions(self) -> tuple[str, ...]:
        """The body actions that it may take, whatever stands in its brackets."""
        if self.name in PRIMITIVES:
            return (self.name,)
        return (*_MOVES[self.moves], *self.handles)

    @property
    def of_hands(self) -> bool:
        """Whether it is about a thing that is carried."""
        return len(self.takes) > 0 and self.act in ("pickup", "drop")


_MOVES: Final = {"walks": ("left", "right", "forward"), "turns": ("left", "right"), "stays": ()}


def _to_a_place(doing: Doing) -> Activity:
    """One for which a cell will do."""
    return doing.activity(doing.somewhere(0))


def _follow(doing: Doing) -> Activity:
    return doing.activity(doing.one(0), name="go_next_to")


def _of_hands(doing: Doing) -> Activity:
    bring = doing.word.name == "bring"
    terms = tuple(doing.somewhere(place) if bring else doing.one(place) for place in range(len(doing.args)))
    hands.check_arguments(doing.resolver, doing.word.name, terms, doing.args, doing.scope)
    return doing.activity(*terms)


def _search(doing: Doing) -> Activity:
    """It is over when the searcher sees what it looks for."""
    assert isinstance(doing.node, ast.Call), "internal: it has an argument"
    sees = replace(doing.node, name="sees")
    return doing.activity(doing.resolver.value(sees, BOOL, doing.scope))


def _enter(doing: Doing) -> Activity:
    """Only objects of one type that can be walked on can be entered."""
    what = doing.one(0)
    if what.type.low < len(doing.resolver.symbols.numbers):
        message = f"`{quoted(doing.args[0])}` is no object; only objects can be entered"
        raise doing.fail("S204", message, doing.args[0])
    status_of(doing.resolver, what, doing.args[0], doing.scope)
    objects = doing.resolver.symbols.object_of(what.type.low)
    assert objects is not None, "internal: what has a status is an object"
    if not objects.type.walkable:
        message = f"{with_article(objects.type.name)} can never be entered"
        raise doing.fail("S204", message, doing.args[0])
    return doing.activity(what)


def _push(doing: Doing) -> Activity:
    what = doing.one(0)
    symbols = doing.resolver.symbols
    if isinstance(what, Const) and symbols.member_of(what.value) == doing.scope.member:
        raise doing.fail("S204", "nobody walks into itself, so nobody pushes itself", doing.args[0])
    for number in what.type.values:
        objects, member = symbols.object_of(number), symbols.member_of(number)
        if member is not None and symbols.cast[member].value("pushed_by") is None:
            message = f"nobody can push `{quoted(doing.args[0])}`"
            hint = f"with `pushed_by: anybody` in the cast `{member}` goes out of the way"
            raise doing.fail("S204", message, doing.args[0], hint=hint)
        if member is None and (objects is None or not objects.type.pushed):
            message = f"`{quoted(doing.args[0])}` cannot be pushed"
            able = [key for key, type_ in symbols.types.items() if type_.pushed]
            raise doing.fail("S204", message, doing.args[0], hint="what can be: " + ", ".join(able))
    return doing.activity(what, doing.resolver.value(doing.args[1], DIRECTION, doing.scope))


def _point(doing: Doing) -> Activity:
    """The way x lies."""
    assert doing.scope.member is not None, "internal: an activity is somebody's"
    own = entity(doing.resolver.symbols.numbers[doing.scope.member])
    there = doing.resolver.somewhere(doing.args[0], doing.scope)
    return doing.activity(Measure(DIRECTION, "dir_to", (own, there)))


def _point_at(doing: Doing) -> Activity:
    """The cell of x."""
    there = doing.resolver.somewhere(doing.args[0], doing.scope)
    return doing.activity(CellOf(CELL, there), name="point")


def _perform(doing: Doing) -> Activity:
    return doing.activity(*performed(doing.resolver, doing.args[0], doing.scope))


def _choose(doing: Doing) -> Activity:
    (node,) = doing.args
    ordinal = doing.scope.draws.number()
    members = groups.group(doing.resolver, _with_stay(node), ACTION, doing.scope)
    if members.type != ACTION:
        message = f"`{quoted(node)}` are not actions; write choose(forward | left)"
        raise doing.fail("S204", message, node)
    weights = {item: members.items.count(item) for item in members.items}
    chosen = doing.activity(*weights)
    return replace(chosen, weights=tuple(weights.values()), ordinal=ordinal)


def _with_stay(node: ast.Expr) -> ast.Expr:
    """`stay` among the options is the action `none`: the word that stands alone in a `do:` may stand here too."""
    if isinstance(node, ast.Alternatives):
        return replace(node, options=tuple(map(_with_stay, node.options)))
    return replace(node, id="none") if isinstance(node, ast.Name) and node.id == "stay" else node


def _composed(parameters: str, does: str, until: str | None = None) -> Callable[[Doing], Activity]:
    """An activity that is another one, until a condition holds if there is one, both written in the language."""
    named, deed = parameters.split(), parse_expression(does)
    ends = parse_expression(until) if until is not None else None
    assert isinstance(deed, ast.Call), "internal: an activity with arguments"

    def meaning(doing: Doing) -> Activity:
        for place, takes in enumerate(doing.word.takes):
            if takes == "entity":
                doing.say_which(place)
        variables = {name: Macro(arg, doing.scope) for name, arg in zip(named, doing.args, strict=True)}
        inner = replace(doing.scope, variables=variables)
        word = next(word for word in ACTIVITIES if word.name == deed.name)
        done = word.meaning(replace(doing, word=word, args=deed.args, scope=inner))
        if any(map(draws, done.args)):
            message = (
                f"`{doing.word.name}` asks in every turn what it is about, so nothing can be drawn in it"
            )
            raise doing.fail("S204", message, hint="draw it in `let`, and use that")
        return done if ends is None else replace(done, until=doing.resolver.value(ends, BOOL, inner))

    return meaning


ACTIVITIES: Final = (
    Deed("stay", doc="do nothing", moves="stays", endless=True, also=("wait", "nothing", "none", "idle")),
    Deed("left", doc="a quarter turn left", moves="turns"),
    Deed("right", doc="a quarter turn right", moves="turns"),
    Deed("forward", doc="one cell ahead, or push what stands there"),
    Deed("toggle", doc="use the object ahead, or poke the NPC ahead", moves="stays"),
    Deed("pickup", doc="take the carryable object ahead into empty hands", moves="stays", also=("pick_up",)),
    Deed("drop", doc="lay down what it carries in the cell ahead, or give it to the member there", moves="stays",
         also=("put_down", "lay_down")),
    Deed("face", takes=("entity",),
         doc="a quarter turn per step towards x; x behind it: left or right at random, a scripted agent left",
         moves="turns", endless=True, also=("look", "look_at", "watch", "gaze"), meaning=_to_a_place),
    Deed("turn_to", takes=("direction",),
         doc="a quarter turn per step towards a direction; one behind it as for face(x)", moves="turns"),
    Deed("turn", takes=("turn",), doc="a quarter turn left or right", moves="turns", also=("rotate",)),
    Deed("go_to", takes=("entity",), doc="one cell per step on a shortest path to x", goes="there", lapses=True,
         also=("walk", "walk_to", "go", "move_to", "move", "goto"), meaning=_to_a_place),
    Deed("go_next_to", takes=("entity",), doc="one cell per step on a shortest path to a cell next to x",
         goes="beside", lapses=True, also=("approach", "come_to"), meaning=_to_a_place),
    Deed("use", takes=("entity",), doc="go next to x, face it, toggle it; finished with the toggle",
         handles=("toggle",), goes="beside", act="toggle",
         also=("press", "push_button", "open", "pick", "activate", "interact")),
    Deed("fetch", takes=("entity",),
         doc="go next to x, face it, pick it up; it waits while x is out of the room, or its hands are full "
             "of something else", handles=("pickup",), act="pickup", also=("take", "grab", "get"),
         meaning=_of_hands),
    Deed("give", takes=("entity", "entity"),
         doc="go next to y, a member, and hand over x; without x it stays", handles=("drop",), act="drop",
         also=("hand", "hand_over"), meaning=_of_hands),
    Deed("bring", takes=("entity", "entity"),
         doc="fetch x, then give it to y; if y is a cell or a walkable thing, lay x down there. x and y are "
             "computed in each step", handles=("pickup", "drop"), act="drop", also=("carry", "deliver"),
         meaning=_of_hands),
    Deed("search", takes=("entities",), doc="turn, then walk about, until it sees x; of a group, any of it",
         lapses=True, also=("look_for", "find", "explore", "seek", "look_around"), meaning=_search),
    Deed("enter", takes=("entity",), doc="open x if it is shut, then go onto it, and stay there",
         handles=("toggle",), goes="there", lapses=True, also=("go_through", "exit"), meaning=_enter),
    Deed("push", takes=("entity", "direction"),
         doc="go behind x, face the direction, walk into x; finished with that", act="forward",
         meaning=_push),
    Deed("point", takes=("entity",),
         doc="point in the direction in which x lies, as for face(x), without turning", moves="stays",
         arm="points", meaning=_point),
    Deed("point_at", takes=("entity",), doc="point at the cell that x is on, in any direction", moves="stays",
         arm="points", also=("points_at", "point_to"), meaning=_point_at),
    Deed("stop_pointing", doc="point no longer", moves="stays", arm="rests"),
    Deed("follow", takes=("entity",), doc="go next to x, again and again", endless=True, meaning=_follow),
    Deed("stay_near", takes=("entity", "int"),
         doc="one cell per step towards x while `distance(x)` is more than n", endless=True),
    Deed("flee", takes=("entity",), doc="turn away from x and walk", endless=True),
    Deed("go_away_from", takes=("entity", "int"),
         doc="turn away from x and walk, until `distance(x)` is at least n; in a corner it stays",
         lapses=True, also=("go_away", "leave", "avoid", "keep_away_from", "get_away_from", "walk_away_from"),
         meaning=_composed("x n", does="flee(x)", until="distance(x) >= n")),
    Deed("perform", takes=("sequence",), doc="one element of a sequence per step: its move and its utterance",
         also=("dance", "repeat"), meaning=_perform),
    Deed("choose", takes=("actions",),
         doc="one of these actions at random, with weights: choose(left | 2 * forward)", endless=True,
         meaning=_choose),
    Deed("wander", doc="choose(forward | left | right)", endless=True, also=("random",),
         meaning=_composed("", does="choose(forward | left | right)")),
)  # fmt: skip
