"""The files of a run as models of exactly what a report reads."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator

from socialai_dsl.errors import first_mistake
from socialai_dsl.experiments.record import Record

Share = Annotated[float, Field(ge=0, le=1)]


class EndingRecord(Record):
    """How test episodes ended, with the line of the scenario's file that says so."""

    outcome: str
    success: bool
    text: str
    file: str | None = None
    line: int | None = None
    share: float


class ProbeFigures(Record):
    """How a language model answered a probe: how often it was asked, and right; the share that guessing gets right."""

    asked: int = Field(ge=0)
    right: int = Field(ge=0)
    chance: float | None = Field(None, ge=0, le=1)


class PartFigures(Record):
    """What came of some of the episodes: of the same trial of their sessions, or with one value of a draw."""

    episodes: int = Field(ge=1)
    success_rate: float = Field(ge=0, le=1)


class Figures(Record):
    """What came of the test episodes: the object `eval` of a result.

    Attributes:
        rooms: `test` of the test set, or which others, such as `seed:7`.
        actions: how they came about, in a phrase.
        session: how many episodes in a row may be alike; None where an older version wrote it.
        trials: in order, where players remembered several episodes in a row.
        results_by: draw -> value -> what came of the episodes with it.
        seats: of several seats, each but the player's own -> what came of the episodes for it.
        replies, invalid_replies, prompt_tokens, completion_tokens, tokens_estimated, cost: of language models alone;
            `cost` in US dollars, None where prices are not known.
    """

    episodes: int = Field(ge=1)
    rooms: str = "test"
    success_rate: float = Field(ge=0, le=1)
    mean_length: float
    mean_return: float
    actions: str = ""
    outcomes: dict[str, float] = Field(default_factory=dict)
    endings: list[EndingRecord] = Field(default_factory=list)
    rules: dict[str, float] = Field(default_factory=dict)
    replies: int = Field(0, ge=0)
    invalid_replies: int = Field(0, ge=0)
    prompt_tokens: int = Field(0, ge=0)
    completion_tokens: int = Field(0, ge=0)
    tokens_estimated: bool = False
    cost: float | None = Field(None, ge=0)
    probes: dict[str, ProbeFigures] = Field(default_factory=dict)
    session: int | None = Field(None, ge=1)
    trials: list[PartFigures] = Field(default_factory=list)
    results_by: dict[str, dict[str, PartFigures]] = Field(default_factory=dict)
    seats: dict[str, PartFigures] = Field(default_factory=dict)


class ResultRecord(Record):
    """`result.json`, in one form for all players.

    Attributes:
        kind: of mind: network, script, chance, model, person or policy; empty where an older version wrote it.
        network_sha256: of the network that played; empty where none did, or an older version wrote it.
        greedy: whether a network took its most probable actions.
        tell, told: what the player was told of the task, by member of a suite if they differ. language: of that, where
            the file says it. view: what the player saw.
        form: of a person on a page, whether that was the `picture`, `words` or `both`.
        feedback: whether it was told the `outcome` of an episode before the next one, or `none`; empty where an older
            version wrote it.
        history: how many observations a request to a language model had; None: all of them.
        trials: how many episodes in a row it remembered.
        seat: the one that it had.
    """

    kind: str = ""
    network_sha256: str = ""
    greedy: bool = False
    tell: str = "nothing"
    told: str | dict[str, str] = ""
    language: str = ""
    view: str = "seat"
    form: str = ""
    feedback: str = ""
    history: int | None = None
    trials: int = Field(1, ge=1)
    seat: str = "agent"
    frames: int = 0
    train_seconds: float = 0.0
    frames_per_second: float | None = None
    eval: Figures
    program_sha256: str = ""
    versions: dict[str, str] = Field(default_factory=dict)

    @property
    def session(self) -> int:
        """How many episodes in a row may be alike, since draws stay the same or the player remembers them."""
        remembers = self.kind in ("network", "model", "policy", "")
        return self.eval.session or (self.trials if remembers else 1)

    @property
    def by_seat(self) -> dict[str, PartFigures]:
        """What came of the episodes for each seat, the player's own first; nothing where there is one."""
        own = PartFigures(episodes=self.eval.episodes, success_rate=self.eval.success_rate)
        return {self.seat: own, **self.eval.seats} if self.eval.seats else {}


class StatusRecord(Record):
    """`status.json`; a run without it is judged by the files it has."""

    state: Literal["waiting", "running", "done", "failed", "cancelled"]
    message: str | None = None


class StartRecord(Record):
    """A line of `starts.jsonl`."""

    cpu: str = ""
    device: str = ""
    threads: int = 0
    processes: int = 1


class UpdateRecord(Record):
    """A line of `metrics.jsonl`.

    Attributes:
        frames: made so far. episodes: that ended in this update. success: share of them; None if none ended.
        outcomes: name -> share of them. rules: name -> firings per episode.
    """

    frames: int = Field(ge=0)
    episodes: int = Field(ge=0)
    success: float | None
    outcomes: dict[str, float | None]
    rules: dict[str, float | None]


class Rate(Record):
    """A success rate with its 95 % interval."""

    success: Share
    interval: tuple[Share, Share]


class Cell(Rate):
    """The success of a seat in the episodes of a pair: who played the agent, and who played the others."""

    agent: str
    others: str
    episodes: int = Field(ge=1)


class SeatRecord(Record):
    """The success of a seat: means over the players with themselves and with each other, and that of each pair that
    played.
    """

    with_themselves: Rate | None
    with_others: Rate | None
    cells: list[Cell] = Field(min_length=1)


class CrossPlayRecord(Record):
    """`crossplay.json`.

    Attributes:
        scenario: what was played. episodes: of each pair that played for it; people have played before, some of them.
        players: their names, each once. seats: the agent's first.
    """

    scenario: str
    episodes: int = Field(ge=1)
    players: list[str] = Field(min_length=1)
    seats: dict[str, SeatRecord] = Field(min_length=1)

    @model_validator(mode="after")
    def _pairs_are_of_players(self) -> Self:
        played = [(cell.agent, cell.others) for cell in next(iter(self.seats.values())).cells]
        if len(set(played)) < len(played) or {name for pair in played for name in pair} != set(self.players):
            raise ValueError("expected cells of each of the players, one for a pair")
        for seat, found in self.seats.items():
            if [(cell.agent, cell.others) for cell in found.cells] != played:
                raise ValueError(f"expected a cell of {seat} for each pair that played")
        return self

    @property
    def agents(self) -> list[str]:
        """Who has played the agent: the rows of a matrix."""
        return self._on(0)

    @property
    def others(self) -> list[str]:
        """Who has played the others: the columns of a matrix."""
        return self._on(1)

    def _on(self, side: int) -> list[str]:
        cells = next(iter(self.seats.values())).cells
        played = {(cell.agent, cell.others)[side] for cell in cells}
        return [name for name in self.players if name in played]

    @property
    def alike(self) -> list[tuple[str, ...]]:
        """The seats, those together that have the same figures, as players have who share their success."""
        groups: list[list[str]] = []
        for seat, found in self.seats.items():
            same = [group for group in groups if self.seats[group[0]] == found]
            if same:
                same[0].append(seat)
            else:
                groups.append([seat])
        return [tuple(group) for group in groups]


class SchellingRecord(Record):
    """The figures of a claim `dilemma`, as `socialai check --json` prints them.

    Attributes:
        frames: of those who cooperate, and of those who defect.
        cooperators, defectors: mean of what they are paid in an episode, while 0, 1, ... of the others cooperate.
        cooperators_se, defectors_se: standard errors of these means over rooms.
        verdict: whether it is a dilemma, and why.
    """

    frames: tuple[str, str]
    cooperators: list[float] = Field(min_length=2)
    defectors: list[float]
    cooperators_se: list[float]
    defectors_se: list[float]
    verdict: str

    @model_validator(mode="after")
    def _as_many_of_each(self) -> Self:
        if (
            len(
                {
                    len(means)
                    for means in (self.cooperators, self.defectors, self.cooperators_se, self.defectors_se)
                }
            )
            > 1
        ):
            raise ValueError("expected as many figures of those who defect as of those who cooperate")
        return self


class DilemmaRecord(Record):
    """The figures of a claim `dilemma` of a scenario."""

    scenario: str
    schelling: SchellingRecord


class DilemmasRecord(Record):
    """`dilemmas.json`: the claims that `socialai check --pictures` has drawn."""

    dilemmas: list[DilemmaRecord] = Field(min_length=1)


class ToldRecord(Record):
    """How much messages tell of a situation, in bits; see `evaluation.information.Information`."""

    bits: float
    possible: float
    chance: float
    p: Share


class SituationRecord(Record):
    """What is said where something has each value: how often each message, in episodes."""

    name: str
    same: list[str]
    said: dict[str, dict[str, float]] = Field(min_length=1)
    told: ToldRecord | None
    more_than_chance: bool


class TopographicRecord(Record):
    """Topographic similarity."""

    similarity: Annotated[float, Field(ge=-1, le=1)]
    p: Share


class SeatWordsRecord(Record):
    """What a seat says; see `evaluation.words.SeatWords`."""

    player: str
    success: Share
    spoke: Share
    utterances: float = Field(ge=0)
    messages: dict[str, float] = Field(min_length=1)
    situations: list[SituationRecord]
    topographic: TopographicRecord | None


class WordsRecord(Record):
    """`words.json`: what was said on each seat of a scenario in test episodes.

    Attributes:
        scenario: what was played. seats: the agent's first. left_out: what has too many values.
    """

    scenario: str
    episodes: int = Field(ge=1)
    seats: dict[str, SeatWordsRecord] = Field(min_length=1)
    left_out: list[str]


class PublishedRecord(Record):
    """A figure of people that a scenario's file names as published: the share of `n` who `did` something."""

    who: str
    did: str
    share: Share
    n: int = Field(ge=1)
    source: str


class QuestionRecord(Record):
    """A question of a study.

    Attributes:
        block: the block behind which it was asked; empty at the end.
        name, ask: its name and its words. kind: `text`, `choice` or `scale`.
        options: of a choice. start, to: of a scale, its first and last number. ends: what those two mean.
        answers: by participant.
    """

    block: str
    name: str
    ask: str
    kind: Literal["text", "choice", "scale"]
    options: tuple[str, ...] = ()
    start: int | None = None
    to: int | None = None
    ends: tuple[str, ...] = ()
    answers: dict[str, str | int]


class StudyRecord(Record):
    """What a report says of a study besides the figures of its people.

    Attributes:
        name: by which the report tells it from others. simulated: whether those who took part are simulated.
        joined: who came. excluded: reason -> how many do not count. counted: how many do.
        unended: how many episodes had not ended. questions: with the answers of those who count.
    """

    name: str
    simulated: bool
    joined: int
    counted: int
    excluded: dict[str, int]
    unended: int
    questions: list[QuestionRecord]


def described(error: ValidationError) -> str:
    """Where the first mistake of a file is, and what."""
    return ": ".join(filter(None, first_mistake(error.errors())))
