"""The trace format `socialai-trace/1`: one episode as JSON, with everything that a page shows.

A trace is small because it repeats nothing: cells, reasons and rules are numbered, and a moment says what differs
from the moment before it. `static/trace.js` is the reader.
"""

from __future__ import annotations

from html import escape
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from socialai_dsl.traces.endings import short_file, short_name
from socialai_dsl.traces.page import replay_page

FORMAT: Final = "socialai-trace/1"

_Number = Annotated[int, Field(ge=0)]
_Code = Annotated[int, Field(ge=0, le=255)]
Direction = Annotated[int, Field(ge=0, le=3)]
"""0 right, 1 down, 2 left, 3 up."""
Look = tuple[_Code, _Code, _Code, _Code]
"""Type, colour, status and orientation of a cell, as in the observation."""
Gesture = (
    tuple[_Number, Annotated[int, Field(ge=-1, le=3)], str]
    | tuple[_Number, Annotated[int, Field(ge=-1, le=3)], str, int, int]
)
"""Cell, direction in which the NPC there points (-1: none), and what it did last; where it is shown, how far to
the right and down the cell lies that it points at."""


Mark = tuple[str, str, _Number, _Number]
"""A look of something: its name, its word, the place of the word among those of the look, and that of the look."""


class _Part(BaseModel):
    """What is left out has its default."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Sight(_Part):
    """What somebody sees in 7 by 7 cells, row by row, and looks up.

    Attributes:
        cells: the look of each. gestures, held, marks: as `Moment` has them of the view, with looks in place of their
            numbers.
    """

    cells: list[Look]
    gestures: list[Gesture]
    held: list[tuple[_Number, Look]]
    marks: list[tuple[_Number, list[Mark]]]


class Line(_Part):
    """Something that the agent heard.

    Attributes:
        text: what was said. name: who said it, as the agent hears it; empty where the scenario hides names.
        who: the same as a member of the cast; None if that cannot be told.
    """

    text: str
    name: str = ""
    who: str | None = None


class Rule(_Part):
    """A rule of the scenario's file.

    Attributes:
        who: a member of the cast, `world` or `outcome`. kind: rule, step, world rule or outcome.
        state, list: of a rule in a frame, where it stands.
        name: what counts of rules call it. at: `file:line`. words: how it is written.
    """

    who: str
    kind: str
    state: str | None = None
    list: str | None = None
    name: str
    at: str
    words: str


class Member(_Part):
    """A member of the cast.

    Attributes:
        key: what the scenario's file calls it. name: what the agent hears it called. look: its face, looking down.
    """

    key: str
    name: str
    look: Look


class Outcome(_Part):
    """How an episode ended: the outcome's name, whether it is a success, and what the file says there."""

    name: str
    success: bool
    text: str


class Thought(_Part):
    """A trained agent's view of a moment.

    Attributes:
        probabilities: for each head (body action, speak or not, template, noun or slots), of each choice.
        value: the expected return from here on; None if the agent estimates none.
    """

    probabilities: list[list[float]]
    value: float | None = None


class Reply(_Part):
    """The end of what a language model answered.

    Attributes:
        text: the end of it. error: what was wrong with it; empty if it gives an action.
        seat: of the model, unless it is the player that the trace is about, and no other is one.
    """

    text: str
    error: str = ""
    seat: str | None = None


class SeatPart(_Part):
    """A moment for one of the seats behind the agent's; the attributes mean what they mean for a moment.

    Attributes:
        action, did, said: of its member. `action` and `said` are None where its script plays: then others hear what it
            says.
        heard: lines that it heard.
        reward: of the step, to this seat.
        success: whether the episode was a success of this seat; None until it has ended.
        view, view_gestures, view_held, view_marks: what it sees.
    """

    action: tuple[_Number, ...] | None = None
    did: str | None = None
    said: str | None = None
    heard: list[Line] = []
    reward: float = 0.0
    success: bool | None = None
    view: list[_Number] | None = None
    view_gestures: list[Gesture] = []
    view_held: list[tuple[_Number, _Number]] = []
    view_marks: list[tuple[_Number, _Number]] = []


class Moment(_Part):
    """The room after a step, before the first one, or where a language model ended the episode without a step.

    Cells are numbered row by row. `member`, `cast`, `room`, `view` and what is not in `cells` and `state` are as in the
    moment before it where they are left out.

    Attributes:
        t: number of the step, 0 before the first one.
        member: of a suite, what is played from here on. cast: the NPCs, where they are others.
        room: width and height, where it is another room; then `cells` has every cell.
        cells: pairs of a cell and the number of its look.
        agent: x, y and direction; x and y are -1 once it has left the room.
        below: pairs of a cell where an NPC stands and the number of the look of the object there.
        gestures: what NPCs show. held: pairs of a cell and the number of the look of what is carried there.
        view: the agent's own view, 7 rows of 7 numbers of looks; the agent stands in the middle of the last row and
            looks up.
        view_gestures, view_held: what NPCs in it show, and what they and the agent carry.
        marks, view_marks: pairs of a cell and the number of the looks of what is seen there; where the agent stands, of
            what it carries.
        state: values that differ, by address: `wizard.state`, `doors[1].color`, `let.exit`.
        action: body action, speak, template, then the noun or a number for each slot, if there are any; None without a
            step.
        did: the body action's word.
        said: the agent's utterance, None in silence. heard: lines.
        reward: of the step.
        seats: the same for the other seats of the trace, in their order.
        fired: numbers of rules. others: pairs of a rule that was asked and did not fire, and the number of its reason.
        thought: what the player made of the moment before, from which its action was chosen.
        replies: what language models answered to the moment before, until they gave an action or their turn passed.
        ended: how the episode ended in this step, for the agent.
    """

    t: _Number
    member: str | None = None
    cast: list[Member] | None = None
    room: tuple[_Number, _Number] | None = None
    cells: list[tuple[_Number, _Number]] = []
    agent: tuple[int, int, Direction]
    below: list[tuple[_Number, _Number]] = []
    gestures: list[Gesture] = []
    held: list[tuple[_Number, _Number]] = []
    view: list[_Number] | None = None
    view_gestures: list[Gesture] = []
    view_held: list[tuple[_Number, _Number]] = []
    marks: list[tuple[_Number, _Number]] = []
    view_marks: list[tuple[_Number, _Number]] = []
    state: dict[str, Any] = {}
    action: Annotated[tuple[_Number, ...], Field(min_length=3)] | None = None
    did: str | None = None
    said: str | None = None
    heard: list[Line] = []
    reward: float = 0.0
    seats: list[SeatPart] = []
    fired: list[_Number] = []
    others: list[tuple[_Number, _Number]] = []
    thought: Thought | None = None
    replies: list[Reply] = []
    ended: Outcome | None = None


class Trace(_Part):
    """One episode, in the format `socialai-trace/1`. A notebook displays it as a page.

    Attributes:
        format: the version of this format.
        scenario: its name, as it was asked for.
        about: the scenario's own sentence about itself.
        agent: the player, in words.
        seats: the members of the cast with a seat, the agent first, where there are several; moments are the agent's,
            whoever plays. names: by which they are heard.
        own: the seat of the player. players: who has the others, in words.
        episode: which episode it was, in words.
        actions: words of the body actions; one more index is no movement.
        templates: words of the templates.
        nouns: words of the nouns.
        slots: in place of nouns, the words of each slot.
        looks: the looks of cells that moments refer to by number.
        marks: the looks of things and NPCs that moments refer to by number, each a list.
        texts: the texts that moments refer to by number.
        rules: the rules that moments refer to by number.
        moments: the room before the first step and after each step.
    """

    format: Literal["socialai-trace/1"] = FORMAT
    scenario: str
    about: str = ""
    agent: str
    seats: list[str] = []
    names: list[str] = []
    own: str = "agent"
    players: dict[str, str] = {}
    episode: str
    actions: list[str]
    templates: list[str]
    nouns: list[str]
    slots: dict[str, list[str]] = {}
    looks: list[Look] = []
    marks: list[list[Mark]] = []
    texts: list[str] = []
    rules: list[Rule] = []
    moments: list[Moment] = []

    @property
    def succeeded(self) -> bool:
        """Whether the episode ended in success of the player."""
        last = self.moments[-1]
        if self.own != "agent":
            return bool(last.seats[self.seats.index(self.own) - 1].success)
        return last.ended is not None and last.ended.success

    def fired(self, moment: Moment) -> list[Rule]:
        """The rules that fired in the step before a moment."""
        return [self.rules[number] for number in moment.fired]

    def reasons(self, moment: Moment) -> list[tuple[Rule, str]]:
        """The rules that were asked in the step before a moment and did not fire, each with the reason."""
        return [(self.rules[number], self.texts[why]) for number, why in moment.others]

    def portable(self) -> Trace:
        """The same without the folders of this machine: files are called as `short_file` calls them."""
        rules = [rule.model_copy(update={"at": _short_place(rule.at)}) for rule in self.rules]
        names: dict[str, Any] = {"scenario": short_name(self.scenario), "agent": short_name(self.agent)}
        names["players"] = {seat: short_name(player) for seat, player in self.players.items()}
        return self.model_copy(update={**names, "rules": rules})

    def as_json(self) -> str:
        """The trace as one line of JSON, which leaves out values that are defaults."""
        return self.model_dump_json(exclude_defaults=True)[:-1] + f',"format":"{FORMAT}"}}'

    def _repr_html_(self) -> str:
        """The episode as a notebook shows it: a frame that holds the page of a replay."""
        page = escape(replay_page([self]))
        return f'<iframe title="an episode" style="width: 100%; height: 760px; border: 0" srcdoc="{page}"></iframe>'


def _short_place(place: str) -> str:
    file, colon, line = place.rpartition(":")
    return short_file(file) + colon + line


def trace_schema() -> dict[str, Any]:
    """The JSON Schema of the format."""
    schema = Trace.model_json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "required": [*schema.pop("required"), "format"],
        **schema,
    }
