"""The instruction set: every word that does something, in one table.

Adding an instruction starts here: its name, what it stands on, what it takes and gives, where it may be used. The
table feeds the resolver, the suggestions in messages and the language reference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from socialai_dsl.vocabulary import ACTIONS, COLORS, DIRECTIONS, FINISHED, PRIMITIVES, SIDES, Primitive

Argument = Literal[
    "entity",
    "entities",
    "int",
    "direction",
    "turn",
    "utterance",
    "state",
    "status",
    "action",
    "side",
    "group",
    "any",
    "actions",
    "sequence",
]
Subject = Literal["entity", "member", "agent", "object", "cell", "none"]
Use = Literal["value", "place", "activity", "effect"]


@dataclass(frozen=True, slots=True)
class Signature:
    """One instruction.

    Attributes:
        name: the word.
        subject: what stands before the dot; in a frame it may be left out and is then the NPC itself.
        takes: its arguments; `entities` is one or a group, of which any one suffices.
        gives: what it is, in words.
        doc: one line for the reference.
        use: where it may stand.
        momentary: it speaks of the current step, so it means nothing before the first.
        cell: `here` may be its subject as well.
        optional: how many of the last arguments may be left out.
        moves: of an activity, what becomes of the member that does it.
        endless: an activity that never ends by itself, so that a step of it says how long it lasts.
        handles: of an activity, the body actions that it takes besides walking and turning.
    """

    name: str
    subject: Subject
    takes: tuple[Argument, ...]
    gives: str
    doc: str
    use: Use = "value"
    momentary: bool = False
    cell: bool = False
    optional: int = 0
    moves: Literal["walks", "turns", "stays"] = "walks"
    endless: bool = False
    handles: tuple[Primitive, ...] = ()

    @property
    def actions(self) -> tuple[str, ...]:
        """The body actions that an activity may take, whatever stands in its brackets."""
        if self.name in PRIMITIVES:
            return (self.name,)
        return (*_MOVES[self.moves], *self.handles)


_MOVES: Final = {"walks": ("left", "right", "forward"), "turns": ("left", "right"), "stays": ()}


def _activity(
    name: str,
    takes: tuple[Argument, ...],
    doc: str,
    *,
    moves: Literal["walks", "turns", "stays"] = "walks",
    endless: bool = False,
    handles: tuple[Primitive, ...] = (),
) -> Signature:
    return Signature(
        name, "none", takes, "activity", doc, "activity", moves=moves, endless=endless, handles=handles
    )


SIGNATURES: Final[tuple[Signature, ...]] = (
    # conditions between two things
    Signature("at", "entity", ("entities",), "condition", "on the same cell", cell=True),
    Signature("next_to", "entity", ("entities",), "condition", "one cell away, whatever the facing", cell=True),
    Signature("in_front_of", "entity", ("entities",), "condition", "on the cell before x", cell=True),
    Signature("faces", "entity", ("entities",), "condition", "x is on the cell ahead"),
    Signature("faces_toward", "entity", ("entities",), "condition", "turned to where face(x) would end"),
    Signature("joint_attention", "member", ("entity", "entities"), "condition", "both look at x, or at the same object",
              optional=1),
    Signature("points_at", "member", ("entities",), "condition",
              "it points at the cell of x, or the way x lies straight"),
    Signature("toggled_by", "object", ("entity",), "condition", "this one toggled at it in this step", momentary=True),
    Signature("eye_contact", "entity", ("entities",), "condition", "same row or column, each turned to the other"),
    Signature("in_line", "entity", ("entities",), "condition", "same row or same column"),
    Signature("can_reach", "entity", ("entities",), "condition", "a free path to x, or next to x, exists now"),
    Signature("unobstructed", "entity", ("entities",), "condition", "in line with x and nothing opaque between"),
    Signature("looks_at", "member", ("entities",), "condition",
              "x is straight ahead in its view, nothing opaque between"),
    Signature("sees", "member", ("entities",), "condition", "x is in its view square"),
    Signature("would_see", "member", ("entities", "direction"), "condition", "x would be, if it faced this direction"),
    Signature("carries", "member", ("entities",), "condition", "x is in its hands", momentary=True),
    Signature("empty_handed", "member", (), "condition", "it carries nothing", momentary=True),
    # what was said and done
    Signature("said", "agent", ("utterance",), "condition", "said in this step, however far away", momentary=True),
    Signature("spoke", "agent", (), "condition", "the agent said something in this step", momentary=True),
    Signature("noun", "agent", (), "noun", "the noun of what it said in this step", momentary=True),
    Signature("did", "agent", ("action",), "condition", "the agent's body action in this step", momentary=True),
    Signature("action", "agent", (), "action", "its body action in this step, or `none`", momentary=True),
    Signature("heard", "member", ("utterance",), "condition", "this NPC heard it since its last turn", momentary=True),
    Signature("poked", "entity", (), "condition", "the agent toggled at it in this step", momentary=True),
    Signature("was_poked", "entity", (), "condition", "the agent has toggled at it in this episode", momentary=True),
    Signature("is", "member", ("state",), "condition", "its frame is in this state", momentary=True),
    Signature("turns_in_state", "member", (), "number",
              "how many turns its frame has been in its state", momentary=True),
    Signature("gone", "entity", (), "condition", "it has vanished", momentary=True),
    # attributes
    Signature("color", "entity", (), "color", "its colour"),
    Signature("facing", "entity", (), "direction", "the direction it is turned to"),
    Signature("x", "entity", (), "number", "its column, 0 at the left", cell=True),
    Signature("y", "entity", (), "number", "its row, 0 at the top", cell=True),
    Signature("name", "member", (), "text", "its name"),
    Signature("kind", "entity", (), "text", "its kind, or the object's type"),
    Signature("index", "entity", (), "number", "its place in its group, from 0"),
    Signature("cell", "entity", (), "cell", "the cell it is on"),
    Signature("inside", "object", (), "object", "what it lies in, or lay in last"),
    Signature("carried", "member", (), "object", "what it carries", momentary=True),
    Signature("pointing", "member", (), "condition", "it points somewhere", momentary=True),
    Signature("toggled", "object", (), "condition", "a member of the cast toggled at it in this step", momentary=True),
    Signature("unlocked_by", "object", (), "object", "what unlocks it"),
    # measures
    Signature("distance", "entity", ("entity",), "number", "Manhattan distance"),
    Signature("dir_to", "entity", ("entity",), "direction", "the quadrant in which x lies"),
    # functions
    Signature("min", "none", ("int", "int"), "number", "the smaller"),
    Signature("max", "none", ("int", "int"), "number", "the larger"),
    Signature("abs", "none", ("int",), "number", "without its sign"),
    Signature("opposite", "none", ("direction",), "direction", "the direction turned round"),
    Signature("prev", "none", ("any",), "the same", "prev(e): e as it was when the step began", momentary=True),
    Signature("any", "none", ("group",), "condition", "any(d in group where ...): one of them does"),
    Signature("all", "none", ("group",), "condition", "all(d in group where ...): each of them does"),
    Signature("count", "none", ("group",), "number", "count(d in group where ...): how many do"),
    Signature("first", "none", ("group",), "one of them", "first(d in group where ...): the first that does"),
    Signature("pick", "none", ("group",), "one of them", "pick(group), pick(d in group where ...): drawn at random"),
    Signature("nearest", "none", ("group",), "one of them", "nearest(d in group to y): the nearest to y"),
    Signature("those", "none", ("group",), "of them", "those(d in group where ...): in `cause` and `set`, all that do"),
    # places
    Signature("anywhere", "none", (), "place", "all free cells of the room", "place"),
    Signature("nowhere", "none", (), "place", "not in the room", "place"),
    Signature("left_half", "none", (), "place", "x < W // 2", "place"),
    Signature("right_half", "none", (), "place", "x > W // 2", "place"),
    Signature("top_half", "none", (), "place", "y < H // 2", "place"),
    Signature("bottom_half", "none", (), "place", "y > H // 2", "place"),
    Signature("column", "none", ("int",), "place", "the column x, without the walls", "place"),
    Signature("row", "none", ("int",), "place", "the row y, without the walls", "place"),
    Signature("rect", "none", ("int", "int", "int", "int"), "place", "from (x0, y0) to (x1, y1)", "place"),
    Signature("wall", "none", ("side",), "place", "in this wall, not in its corners", "place"),
    Signature("each_wall", "none", ("int",), "place", "one in each wall, n off the corners", "place", optional=1),
    # activities
    _activity("stay", (), "do nothing", moves="stays", endless=True),
    _activity("left", (), "a quarter turn left", moves="turns"),
    _activity("right", (), "a quarter turn right", moves="turns"),
    _activity("forward", (), "one cell ahead"),
    _activity("toggle", (), "use what is ahead", moves="stays"),
    _activity("pickup", (), "take what is ahead into its hands", moves="stays"),
    _activity("drop", (), "lay down ahead what it carries, or give it to the member that stands there", moves="stays"),
    _activity("face", ("entity",), "turn towards x, a quarter turn a step", moves="turns", endless=True),
    _activity("turn_to", ("direction",), "turn to a direction, a quarter turn a step", moves="turns"),
    _activity("turn", ("turn",), "a quarter turn left or right", moves="turns"),
    _activity("go_to", ("entity",), "walk to the cell of x"),
    _activity("go_next_to", ("entity",), "walk to a cell next to x"),
    _activity("use", ("entity",), "go next to x, face it, toggle it", handles=("toggle",)),
    _activity("fetch", ("entity",), "go next to x, face it, pick it up", handles=("pickup",)),
    _activity("give", ("entity", "entity"), "go next to y and hand over x, if it carries x", handles=("drop",)),
    _activity("bring", ("entity", "entity"), "fetch x, then give it to y, or lay it down on the cell of y",
              handles=("pickup", "drop")),
    _activity("search", ("entities",), "look around, then walk about, until it sees x"),
    _activity("enter", ("entity",), "open x if it is closed, then go in", handles=("toggle",)),
    _activity("push", ("entity", "direction"), "go behind x and push it that way"),
    _activity("point", ("entity",), "point the way x lies", moves="stays"),
    _activity("point_at", ("entity",), "point at the cell of x, in any direction", moves="stays"),
    _activity("stop_pointing", (), "take the arm down", moves="stays"),
    _activity("follow", ("entity",), "walk next to x, again and again", endless=True),
    _activity("stay_near", ("entity", "int"), "walk towards x while it is more than n cells away", endless=True),
    _activity("flee", ("entity",), "turn away from x and walk", endless=True),
    _activity("perform", ("sequence",), "one act of a sequence a turn, words included"),
    _activity("choose", ("actions",), "one at random: choose(a | b | 2 * c)", endless=True),
    _activity("wander", (), "choose(forward | left | right)", endless=True),
    # effects
    Signature("open", "object", (), "effect", "becomes open", "effect"),
    Signature("close", "object", (), "effect", "becomes closed", "effect"),
    Signature("lock", "object", (), "effect", "becomes locked", "effect"),
    Signature("unlock", "object", (), "effect", "closed, if it was locked", "effect"),
    Signature("reset", "entity", (), "effect", "status, place and content as when the episode began", "effect"),
    Signature("vanish", "entity", (), "effect", "leaves the room; it is `gone`", "effect"),
    Signature("reveal", "object", (), "effect", "becomes opened", "effect"),
    Signature("put", "entity", ("entity",), "effect", "put(x): comes to the cell of x", "effect"),
    Signature("move_into", "object", ("entity",), "effect", "move_into(x): lies in x, or is carried by x", "effect"),
    Signature("become", "object", ("status",), "effect", "takes this status", "effect"),
)  # fmt: skip

VALUES: Final = {s.name: s for s in SIGNATURES if s.use == "value"}
PLACES: Final = {s.name: s for s in SIGNATURES if s.use == "place"}
ACTIVITIES: Final = {s.name: s for s in SIGNATURES if s.use == "activity"}
EFFECTS: Final = {s.name: s for s in SIGNATURES if s.use == "effect"}
QUANTIFIERS: Final = frozenset({"any", "all", "count", "first", "pick", "nearest", "those"})

SYNONYMS: Final = {
    "press": "use", "push_button": "use", "open": "use", "pick": "use", "activate": "use", "interact": "use",
    "walk": "go_to", "walk_to": "go_to", "go": "go_to", "move_to": "go_to", "move": "go_to", "goto": "go_to",
    "approach": "go_next_to", "come_to": "go_next_to", "look": "face", "look_at": "face", "watch": "face",
    "gaze": "face", "wait": "stay", "nothing": "stay", "none": "stay", "idle": "stay", "random": "wander",
    "take": "fetch", "grab": "fetch", "get": "fetch", "pick_up": "pickup", "carry": "bring", "deliver": "bring",
    "hand": "give", "hand_over": "give", "put_down": "drop", "lay_down": "drop", "go_through": "enter",
    "rotate": "turn", "look_for": "search", "find": "search", "explore": "search", "seek": "search",
    "look_around": "search", "exit": "enter", "dance": "perform", "repeat": "perform",
    "points_at": "point_at", "point_to": "point_at",
}  # fmt: skip
"""What authors write for an activity -> what it is called here."""

VALUE_SYNONYMS: Final = {
    "near": "next_to", "close_to": "next_to", "beside": "next_to", "adjacent": "next_to", "adjacent_to": "next_to",
    "by": "next_to", "reaches": "at", "on": "at", "in_cell": "at", "looking_at": "looks_at", "can_see": "sees",
    "see": "sees", "previous": "prev", "before": "prev", "pressed_by": "toggled_by", "used_by": "toggled_by",
    "eaten_by": "toggled_by", "opened_by": "toggled_by",
    "holds": "carries", "has": "carries", "holding": "carries", "carrying": "carried",
    "content": "inside", "contains": "inside", "in": "inside", "points_to": "points_at",
    "says": "said", "say": "said", "hears": "heard", "colour": "color", "direction": "facing", "dir": "facing",
    "type": "kind", "disappeared": "gone", "vanished": "gone", "does": "did", "in_state": "is", "state": "is",
    "number": "index", "dist": "distance", "distance_to": "distance", "toward": "dir_to",
}  # fmt: skip
"""What authors write for a condition or value -> what it is called here."""

WORDS: Final = frozenset(
    [s.name for s in SIGNATURES if s.name not in ("name", "kind", "index", "cell")]
    + ["speaker", "objects", "believes", "permuted"]
    + ["here", "it", "self", "t", "W", "H", "cells", "colors", "nouns", "toward", "random", "distinct", "ever"]
    + [FINISHED, *COLORS, *DIRECTIONS, *ACTIONS, *SIDES]
    + ["and", "or", "not", "in", "where", "to", "if", "else", "true", "false", "speaker", "room", "agent"]
)  # fmt: skip
"""Words that mean something already, so that nothing an author declares may be called so."""
