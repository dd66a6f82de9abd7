"""The messages between a window, the server and the window's process, checked where they arrive.

A window asks with a number `id` and a word `do`. A question about its game goes to its process as it is, and the answer
comes back as it is: with the same number and word, or with the word `refused` and a sentence for the person at the
screen.
"""

from __future__ import annotations

import re
from reprlib import Repr
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from socialai_dsl.traces.document import Sight, Trace

LARGEST_MESSAGE: Final = 2 << 20
"""Characters of a message from a window; longer ones are refused."""

_Number = Annotated[int, Field(ge=0, le=(1 << 53) - 1)]
_Seed = Annotated[int, Field(ge=0, lt=1 << 63)]
_Word = Annotated[str, Field(max_length=2_000)]
WindowId = Annotated[str, Field(pattern="^[0-9a-f]{16}$")]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class _Message(_Part):
    id: _Number


class Room(_Part):
    """A room, as `socialai trace` takes it.

    Attributes:
        index: which room of the seed. test_episode: in place of both. layout: what is known of it.
    """

    seed: _Seed = 0
    index: _Number | None = None
    test_episode: _Number | None = None
    layout: dict[str, Any] | None = None


class Shown(_Part):
    """What can be seen in a room.

    Attributes:
        variant: variants and parameters behind the scenario's name.
        acts: what is done there, as typed; None: what the script does, if there is one.
    """

    room: Room
    variant: _Word = ""
    acts: list[_Word] | None = None


# -- what a window asks its process -----------------------------------------------------------------------------------


class Draw(_Message):
    """Check a text that is to stand in the file `path`, and draw its room."""

    do: Literal["draw"]
    path: _Word
    text: str
    room: Room = Room()


class Begin(_Message):
    """Begin an episode.

    Attributes:
        player: `me`, `script`, `random`, `shipped:NAME` or the folder of a run. variant: as that of `Shown`.
        seat: which one of several is the player's.
        others: who has the others, by member of the cast: as `player`, or `nobody`, but not `me`; whoever is left out
            follows the script, if there is one.
    """

    do: Literal["begin"]
    room: Room = Room()
    player: _Word = "me"
    variant: _Word = ""
    seat: _Word = "agent"
    others: dict[_Word, _Word] = {}


class Show(_Message):
    """Begin an episode, and play it as far as it is shown."""

    do: Literal["show"]
    shown: Shown


_Acts = dict[_Word, list[_Number]]


class Act(_Message):
    """Play a step: a movement, a sentence, both, or a line as `socialai play` takes it.

    Attributes:
        acts: what people on other seats do, as `Chosen` has it.
        stands_in: whether the script of the own seat plays instead, if there is one.
    """

    do: Literal["act"]
    movement: _Word | None = None
    sentence: _Word | None = None
    line: _Word | None = None
    acts: _Acts = {}
    stands_in: bool = False


class Auto(_Message):
    """Let the chosen player play a step; `acts` as of `Act`."""

    do: Literal["auto"]
    acts: _Acts = {}


class Choose(_Message):
    """Ask for the action that words mean, as those of `Act`."""

    do: Literal["choose"]
    movement: _Word | None = None
    sentence: _Word | None = None
    line: _Word | None = None


class Glance(_Message):
    """Ask what a person on another seat gets now."""

    do: Literal["glance"]
    seat: _Word


class Back(_Message):
    """Take steps back until `to` of them are left."""

    do: Literal["back"]
    to: _Number


class Place(_Message):
    """Begin again in the same room with one thing in another cell."""

    do: Literal["place"]
    who: _Word
    at: tuple[_Number, _Number]


class Layout(_Message):
    """Describe the room as it is now."""

    do: Literal["layout"]


class WriteLayout(_Message):
    """Write the room as it is now into the text, as the start of every episode."""

    do: Literal["write_layout"]
    text: str


class Replay(_Message):
    """Make a page of the episode so far."""

    do: Literal["replay"]


class Check(_Message):
    """Check the claims of a text that is to stand in the file `path`."""

    do: Literal["check"]
    path: _Word
    text: str


class Look(_Message):
    """Ask what a member of the cast sees now."""

    do: Literal["look"]
    who: _Word


class Test(_Message):
    """Play the tests of a text that is to stand in the file `path`, and those in the file beside it."""

    do: Literal["test"]
    path: _Word
    text: str


class WriteTest(_Message):
    """Make a test of what was played.

    Attributes:
        name: of the test. former: the text of the file that it is to stand in; None if there is none.
    """

    do: Literal["write_test"]
    name: _Word
    former: str | None = None


_GameQuestion = (
    Draw
    | Begin
    | Show
    | Act
    | Auto
    | Choose
    | Glance
    | Back
    | Place
    | Look
    | Layout
    | WriteLayout
    | Replay
    | Check
    | Test
    | WriteTest
)
Question = Annotated[_GameQuestion, Field(discriminator="do")]
QUESTIONS: Final[TypeAdapter[Question]] = TypeAdapter(Question)
"""What a process is asked."""


# -- what a window asks the server ------------------------------------------------------------------------------------


class Invite(_Message):
    """Ask for the code of a link to a seat of this window's game.

    Attributes:
        seconds: how long those who have chosen wait for the others before a step; None: for ever.
    """

    do: Literal["invite"]
    seat: _Word
    seconds: Annotated[float, Field(ge=1, le=3600)] | None = None


class Hello(_Message):
    """Say which window this was before the connection was lost; the answer says which it is now."""

    do: Literal["hello"]
    window: WindowId | None


class List(_Message):
    """List the files, players and templates."""

    do: Literal["list"]


class Read(_Message):
    """Read a file and its drafts.

    Attributes:
        adopt: go on with what was typed last in a window that is closed.
    """

    do: Literal["read"]
    name: _Word
    adopt: bool = True


class Save(_Message):
    """Save a file.

    Attributes:
        digest: of what the file held when this window read it; None for a new file.
        over: write over what another window or program has saved since, and keep that as a draft.
    """

    do: Literal["save"]
    name: _Word
    text: str
    digest: _Word | None
    over: bool = False


class KeepDraft(_Message):
    """Keep what was typed into a file, or with None forget it.

    Attributes:
        base: digest of the file that the typing began with; None for a new file.
    """

    do: Literal["draft"]
    name: _Word
    text: str | None
    base: _Word | None = None


class TakeDraft(_Message):
    """Go on with another draft of a file; this window's own is kept in its place."""

    do: Literal["take"]
    name: _Word
    draft: WindowId


class DiscardDraft(_Message):
    """Delete a draft of a window that is closed."""

    do: Literal["discard"]
    name: _Word
    draft: WindowId


class Copy(_Message):
    """Copy a shipped scenario with its script into the folder."""

    do: Literal["copy"]
    shipped: _Word


class Create(_Message):
    """Write the files of a template under a name."""

    do: Literal["create"]
    template: _Word
    called: _Word


class Add(_Message):
    """Add a file, under the next free name."""

    do: Literal["add"]
    name: _Word
    text: str


class Explain(_Message):
    """Show the page about a code of findings."""

    do: Literal["explain"]
    code: _Word


FileQuestion = (
    Hello | Invite | List | Read | Save | KeepDraft | TakeDraft | DiscardDraft | Copy | Create | Add | Explain
)
WINDOW_QUESTIONS: Final[TypeAdapter[Any]] = TypeAdapter(
    Annotated[_GameQuestion | FileQuestion, Field(discriminator="do")]
)
"""What a window may ask."""


# -- what nobody has asked for ----------------------------------------------------------------------------------------


class Guests(_Message):
    """Who has chosen what to do in the next step.

    Attributes:
        chosen: of each other seat that a person has. own: the one whose window the game is.
    """

    do: Literal["guests"]
    chosen: dict[str, bool]
    own: bool


# -- what a process answers -------------------------------------------------------------------------------------------


class Refused(_Message):
    """Something cannot be done.

    Attributes:
        id: None where the question had no number that could be read.
        refused: why, for the person at the screen.
        conflict: the file was changed elsewhere. lost: the game is gone, and its room is to be drawn again.
    """

    id: _Number | None  # type: ignore[assignment]
    do: Literal["refused"] = "refused"
    refused: str
    conflict: bool = False
    lost: bool = False


class _Placed(_Part):
    """Something that stands at a line and column from 1; `file` is None where it is in the text itself."""

    file: str | None
    line: int
    column: int


class RefusalError(ValueError):
    """Something cannot be done; the message is for the person at the screen, see `Refused`."""


class Finding(_Placed):
    """A finding.

    Attributes:
        help: what to do about it. notes: lines that say more.
    """

    message: str
    help: str | None
    notes: list[str]
    code: str
    error: bool


class Claim(_Placed):
    """What was found of a claim.

    Attributes:
        claim: as written. said: what was found, in words.
        shown: a room that speaks against it, and what is done there.
    """

    claim: str
    verdict: Literal["holds", "fails", "undecided", "not asked"]
    said: str
    shown: Shown | None


class TestResult(_Placed):
    """What was found of a test.

    Attributes:
        test: its name. scenario: what was played. rooms: in how many. passes: in all of them.
        findings: what is wrong. shown: the room in which it is, and what was done there up to that step.
    """

    test: str
    scenario: str
    rooms: int
    passes: bool
    findings: list[Finding]
    shown: Shown | None


class Seat(_Part):
    """What whoever plays gets, and nothing else.

    Attributes:
        told: of the task. seen: what is seen and heard, as a language model reads it.
        compass: whether directions of others are those of a compass.
    """

    told: str
    seen: str
    compass: bool


class Episode(_Part):
    """An episode as far as it was played.

    Attributes:
        phrases: what can be said. rules: names of all rules, whether they were asked or not.
        others: who has other seats than the player, by member of the cast.
        seats: of each moment.
    """

    trace: Trace
    phrases: list[str]
    rules: list[str]
    player: str
    variant: str
    others: dict[str, str]
    room: Room
    seats: list[Seat]


class Playable(_Part):
    """A member of the cast that can be played.

    Attributes:
        seat: its name in the file. script: whether it has one.
    """

    seat: str
    script: bool


class Plays(_Part):
    """Who can play a scenario, besides a person and chance.

    Attributes:
        names: by which agents know it that were trained on it.
        rivals: strategies of the agent that lack the skill. seats: those that can be played, the agent's first.
    """

    names: list[str]
    rivals: list[str]
    seats: list[Playable]


class Drawn(_Message):
    """Findings, and the beginning of an episode unless there are errors or it is refused."""

    do: Literal["draw"]
    findings: list[Finding]
    refused: str | None = None
    plays: Plays | None = None
    episode: Episode | None = None


class Begun(_Message):
    """An episode, at its beginning or, of `show`, as far as it is shown."""

    do: Literal["begin", "show", "place"]
    episode: Episode


class Stepped(_Message):
    """What a step adds to the trace, and what is seen after it."""

    do: Literal["act", "auto"]
    more: Trace
    seat: Seat


class Chosen(_Message):
    """The action that words mean."""

    do: Literal["choose"]
    action: list[int]


class Glanced(_Message):
    """What a person on another seat than the window's gets, and nothing else.

    Attributes:
        told, seen, compass: as those of `Seat`. seat: whose. name: how others call the person.
        t: how many steps were played. facing: where it looks, by the compass. view: what it sees.
        heard: all lines since the beginning.
        success: whether the episode was the seat's success; None until it has ended.
        actions, phrases: what can be done and said.
    """

    do: Literal["glance"]
    told: str
    seen: str
    compass: bool
    seat: str
    t: int
    name: str
    facing: int
    view: Sight
    heard: list[str]
    success: bool | None
    actions: list[str]
    phrases: list[str]


class WentBack(_Message):
    """How many steps are left."""

    do: Literal["back"]
    length: int


class Looked(_Message):
    """What a member of the cast sees.

    Attributes:
        step: of the moment. side: of its view square. cells: those it sees, numbered row by row as in the trace.
    """

    do: Literal["look"]
    who: str
    step: int
    side: int
    cells: list[int]


class LayoutOf(_Message):
    """The room as a layout."""

    do: Literal["layout"]
    layout: dict[str, Any]


class WrittenLayout(_Message):
    """The text of the suite, or of a new suite with its file's name."""

    do: Literal["write_layout"]
    text: str | None = None
    suite: str | None = None
    name: str | None = None


class Page(_Message):
    """A page of an episode."""

    do: Literal["replay"]
    page: str


class Checked(_Message):
    """What `socialai check` finds: claims, other findings, and in lines what was tried."""

    do: Literal["check"]
    claims: list[Claim]
    findings: list[Finding]
    lines: list[str]


class Tested(_Message):
    """What `socialai test` finds; findings alone if the text has mistakes."""

    do: Literal["test"]
    tests: list[TestResult]
    findings: list[Finding]


class WrittenTest(_Message):
    """A test as text.

    Attributes:
        entry: the test. text: the file with it. beside: that file's name, without folders; None where it has no place.
    """

    do: Literal["write_test"]
    entry: str
    text: str
    beside: str | None


Answer = Annotated[
    Refused
    | Drawn
    | Begun
    | Stepped
    | Chosen
    | Glanced
    | WentBack
    | Looked
    | LayoutOf
    | WrittenLayout
    | Page
    | Checked
    | Tested
    | WrittenTest,
    Field(discriminator="do"),
]
ANSWERS: Final[TypeAdapter[Answer]] = TypeAdapter(Answer)
"""What a process answers."""


# -- what is no message -----------------------------------------------------------------------------------------------


class _Numbered(BaseModel):
    model_config = ConfigDict(strict=True)

    id: _Number


_short: Final = Repr()
_short.maxstring, _short.maxother = 60, 60
_BEGINS_WITH: Final = re.compile(r'\s*\{\s*"id"\s*:\s*([0-9]{1,15})\s*[,}]')


def parsed(adapter: TypeAdapter[Any], text: str) -> Any:
    """The message of a union that a text is, or `Refused`."""
    if len(text) > LARGEST_MESSAGE:
        why = f"got a message of {len(text)} characters, expected at most {LARGEST_MESSAGE}"
        return Refused(id=_first_number(text), refused=why)
    try:
        return adapter.validate_json(text)
    except ValidationError as error:
        return Refused(id=_number(text), refused=problem(error))


def _number(text: str) -> int | None:
    """The number of a question that is to be refused; None where it has none."""
    try:
        return _Numbered.model_validate_json(text).id
    except ValidationError:
        return _first_number(text)


def _first_number(text: str) -> int | None:
    """The number that a text begins with, which is not to be read further."""
    found = _BEGINS_WITH.match(text)
    return int(found[1]) if found else None


def problem(error: ValidationError) -> str:
    """The first thing that is wrong with a message, in one sentence."""
    first = error.errors(include_url=False, include_context=False)[0]
    # The first part of a place is the word of the message, which the union has told it by.
    place = ".".join(str(part) for part in first["loc"][1:])
    said = first["msg"][:1].lower() + first["msg"][1:]
    if first["type"] == "union_tag_not_found":
        return "got a message without the word `do`"
    if first["type"] == "union_tag_invalid":
        return f"got {_short.repr(first['input'].get('do'))} as `do`, which nobody can be asked for"
    if first["type"] == "missing":
        return f"got a message without `{place}`"
    if first["type"] == "extra_forbidden":
        return f"got a message with the key {_short.repr(place)}, which it does not have"
    if not place:
        return f"got a message that cannot be read: {said[:300]}"
    return f"`{place[:60]}`: got {_short.repr(first['input'])}; {said[:300]}"
