"""What each seat says in which situation, and how much that tells of it: words that players have found."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.envs.factory import compiled
from socialai_dsl.envs.seats import SCRIPT
from socialai_dsl.envs.table import HeardLines
from socialai_dsl.episodes.partners import Partners, own_seat
from socialai_dsl.episodes.play import Observer, Rooms, Seat, Step
from socialai_dsl.episodes.players import Player
from socialai_dsl.episodes.results import EvalResult
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.information import Information, Messages, information, topographic_similarity
from socialai_dsl.evaluation.test_set import play_test_set
from socialai_dsl.frontend import Loaded
from socialai_dsl.program import Program
from socialai_dsl.program_suite import seats_of
from socialai_dsl.traces.endings import short_name
from socialai_dsl.traces.state import cast_of, leaves
from socialai_dsl.traces.steps import heard_line
from socialai_dsl.vocabulary import spelt

SILENCE: Final = "(nothing)"
_DRAWN: Final = ("let", "one_of", "state")
"""Where `describe` has what is drawn, and what the scenario itself remembers."""
_LEVEL: Final = 0.05
MOST_VALUES: Final = 32
"""Values of something that has more are not told apart."""

Value = str
Name = str


@dataclass(frozen=True)
class Situation:
    """Something that differs between rooms or steps, such as a draw.

    Attributes:
        name: as the file has it, `meant`; further names of what is always told apart in the same way stand in `same`.
        values: in order. said: how often each message goes with each value, in episodes, by value and message.
        told: how much the messages tell of it; None of a seat that says the same in all episodes.
        more_than_chance: whether that is at most 5 % likely by chance, for all situations of the seat together.
    """

    name: Name
    same: tuple[Name, ...]
    values: tuple[Value, ...]
    said: Mapping[Value, Mapping[str, float]]
    told: Information | None
    more_than_chance: bool = False


@dataclass(frozen=True)
class SeatWords:
    """What a seat says.

    Attributes:
        player: who plays there. success: of the seat.
        spoke: the share of episodes in which it says something. utterances: how many in an episode, on average.
        messages: the share of the episodes' messages, the most frequent first; those of an episode count for 1
            together, and `(nothing)` is one where it is silent.
        situations: those that are told most of, first.
        topographic: topographic similarity and its p; None where a message or a situation has one part.
    """

    player: str
    success: float
    spoke: float
    utterances: float
    messages: Mapping[str, float]
    situations: tuple[Situation, ...]
    topographic: tuple[float, float] | None


@dataclass(frozen=True)
class Words:
    """What all seats of a scenario say.

    Attributes:
        scenario: what was played. episodes: test episodes. seats: each with what it says, the agent first.
        left_out: what has too many values to be told apart.
    """

    scenario: str
    episodes: int
    seats: Mapping[Seat, SeatWords]
    left_out: tuple[Name, ...] = field(default=())

    def figures(self) -> dict[str, Any]:
        """As a JSON-able object."""
        return {
            "scenario": self.scenario,
            "episodes": self.episodes,
            "seats": {seat: _seat_figures(found) for seat, found in self.seats.items()},
            "left_out": list(self.left_out),
        }


def _seat_figures(found: SeatWords) -> dict[str, Any]:
    return {
        "player": found.player,
        "success": found.success,
        "spoke": found.spoke,
        "utterances": found.utterances,
        "messages": dict(found.messages),
        "situations": [
            {
                "name": one.name,
                "same": list(one.same),
                "said": {value: dict(said) for value, said in one.said.items()},
                "told": None if one.told is None else one.told.figures(),
                "more_than_chance": one.more_than_chance,
            }
            for one in found.situations
        ],
        "topographic": None
        if found.topographic is None
        else dict(zip(("similarity", "p"), found.topographic, strict=True)),
    }


def words_of(player: Player, partners: Partners, scenario: str, loaded: Loaded, episodes: int = 500) -> Words:
    """Play test episodes, and find what each seat says in which situation.

    Args:
        player: who plays on the seats that are left: the script, `random`, or a network.
        partners: who plays on others.
        scenario: as it was asked for.
        loaded: the same.
        episodes: how many.

    Raises:
        UsageError: it is a suite, or a player does not fit, or is a person or a language model.
    """
    if not isinstance(loaded, LoadedScenario):
        raise UsageError(f"{scenario} is a suite, whose members have draws of their own; name one of them")
    for one in (player, *partners.values()):
        if one.is_person or one.is_model:
            raise UsageError(f"got {one.agent!r}, expected random, oracle (the script) or a trained agent")
    program = compiled(loaded)
    assert isinstance(program, Program), "internal: it is no suite"
    listening, own = _Listening(program, episodes), own_seat(partners, program)
    watched = [listening]
    played = play_test_set(player, scenario, loaded, program, episodes, partners=partners, observers=watched)
    called = {seat: _called(played.partners.get(seat, player)) for seat in seats_of(program)}
    return _found(scenario, listening, played.result, own, called)


def _called(player: Player) -> str:
    return SCRIPT if player.is_script else short_name(player.agent)


class _Listening(Observer):
    """Notes what every seat says, and what everything is like before each step.

    Attributes:
        said: of each seat the utterances of each episode: step, text, and parts of the message.
        like: of each episode what everything was like before each step, by name. draws: the names of draws.
    """

    def __init__(self, program: Program, episodes: int) -> None:
        self._program = program
        self._entities = [str(entity) for entity in program.entities]
        self.said: dict[Seat, list[list[tuple[int, str, tuple[str, ...]]]]] = {
            seat: [[] for _ in range(episodes)] for seat in seats_of(program)
        }
        self.like: list[list[dict[Name, Value]]] = [[] for _ in range(episodes)]
        self.draws: set[Name] = set()

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        for room in np.flatnonzero(begun).tolist():
            described = rooms.env.describe(room * len(rooms.names))
            number = int(rooms.numbers[room])
            self.like[number].append(self._situation(described))

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        heard = rooms.env.heard_lines() if len(rooms.seats) < len(rooms.names) else None
        for room in np.flatnonzero(step.running).tolist():
            number = int(step.numbers[room])
            now = len(self.like[number]) - 1
            for seat, actions in step.actions.items():
                if actions[room, 1]:
                    self.said[seat][number].append((now, *self._spoken(actions[room])))
            for seat, text in self._overheard(rooms, room, heard):
                self.said[seat][number].append((now, text, (text,)))
            if not step.ended[room]:
                self.like[number].append(self._situation(rooms.env.describe(room * len(rooms.names))))

    def _spoken(self, action: NDArray[np.int64]) -> tuple[str, tuple[str, ...]]:
        """A sentence, and its parts: the template, and the words that stand in it."""
        _, _, template, *choices = action.tolist()
        sentences = self._program.sentences
        frame = sentences.templates[template]
        parts = [
            slot.words[choice] if slot.place in frame else ""
            for slot, choice in zip(sentences.slots, choices, strict=True)
        ]
        return sentences.text(template, choices), (frame, *parts)

    def _overheard(self, rooms: Rooms, room: int, heard: HeardLines | None) -> Iterator[tuple[Seat, str]]:
        """What those say who follow their scripts by themselves, as others hear it."""
        if heard is None:
            return
        rows = slice(room * len(rooms.names), (room + 1) * len(rooms.names))
        for seat in rooms.names:
            if seat not in rooms.seats:
                own = heard.lines[rows][heard.speakers[rows] == self._entities.index(seat)]
                texts = {heard_line(0, rooms.env.lines[line]).text for line in own.tolist()}
                yield from ((seat, text) for text in sorted(texts))

    def _situation(self, described: dict[str, Any]) -> dict[Name, Value]:
        """Draws, and the looks and states of things, by name; of draws that are things also their colours."""
        cast, found = cast_of(self._program), leaves(described)
        draws, looks = {}, {}
        for address, value in found.items():
            group, _, rest = address.partition(".")
            who, _, key = address.rpartition(".")
            if group in _DRAWN and rest.partition(".")[0] not in cast:
                draws[rest] = spelt(value)
                if f"{value}.color" in found:
                    draws[f"{rest}.color"] = spelt(found[f"{value}.color"])
            elif key == "color" or (key == "state" and who not in cast):
                looks[address] = spelt(value)
        self.draws |= draws.keys()
        return draws | looks


def _found(
    scenario: str, listening: _Listening, result: EvalResult, own: Seat, called: Mapping[Seat, str]
) -> Words:
    table, left_out = _values(listening.like, listening.draws)
    seats = {}
    for seat, said in listening.said.items():
        success = result.success if seat == own else result.others[seat][0]
        seats[seat] = replace(_seat_words(said, table), player=called[seat], success=float(success.mean()))
    return Words(scenario, len(listening.like), seats, left_out)


@dataclass(frozen=True, eq=False)
class _Column:
    """The values of something: names, the values in order, and the number of the value, int64 (N, T).

    Whether it is drawn, and stays as it is in an episode, says `is_drawn`.
    """

    names: tuple[Name, ...]
    values: tuple[Value, ...]
    numbers: NDArray[np.int64]
    is_drawn: bool

    def joined(self, name: Name, values: Sequence[Value], numbers: NDArray[np.int64]) -> _Column:
        """With something else that is told apart in the same way; where that is its colour, values have theirs."""
        shown = self.values
        if name == f"{self.names[0]}.color":
            colours = dict(zip(self.numbers.ravel().tolist(), numbers.ravel().tolist(), strict=True))
            shown = tuple(f"{value}, {values[colours[k]]}" for k, value in enumerate(self.values))
        return replace(self, names=(*self.names, name), values=shown)


def _values(
    like: Sequence[Sequence[Mapping[Name, Value]]], draws: Collection[Name]
) -> tuple[list[_Column], tuple[Name, ...]]:
    """What differs between steps or episodes, what is always told apart alike once; and what has too many values."""
    longest = max(map(len, like))
    columns: list[_Column] = []
    left_out: list[Name] = []
    for name in dict.fromkeys(name for steps in like for moment in steps for name in moment):
        texts = [[moment.get(name, "") for moment in steps] for steps in like]
        # After the end of an episode the last value stays, for comparison with messages of longer ones.
        whole = np.array([row + row[-1:] * (longest - len(row)) for row in texts])
        values, numbers = np.unique(whole, return_inverse=True)
        numbers = numbers.reshape(whole.shape).astype(np.int64)
        if len(values) > MOST_VALUES:
            left_out.append(name)
        elif len(values) > 1:
            same = next((k for k, one in enumerate(columns) if _alike(one.numbers, numbers)), None)
            if same is None:
                is_drawn = name in draws and bool((numbers == numbers[:, :1]).all())
                columns.append(_Column((name,), tuple(values.tolist()), numbers, is_drawn))
            else:
                columns[same] = columns[same].joined(name, values.tolist(), numbers)
    together = _together([one for one in columns if one.is_drawn])
    return [*columns, *([together] if together is not None else [])], tuple(left_out)


def _together(drawn: Sequence[_Column]) -> _Column | None:
    """All draws at once, as what is said may depend on several of them; None without several, and of too many."""
    if len(drawn) < 2 or np.prod([len(one.values) for one in drawn]) > MOST_VALUES:
        return None
    rows = np.stack([one.numbers for one in drawn], axis=-1)
    kinds, numbers = np.unique(rows.reshape(-1, len(drawn)), axis=0, return_inverse=True)
    texts = tuple(
        "; ".join(one.values[k] for one, k in zip(drawn, kind, strict=True)) for kind in kinds.tolist()
    )
    name = " and ".join(one.names[0] for one in drawn)
    return _Column((name,), texts, numbers.reshape(rows.shape[:2]).astype(np.int64), is_drawn=False)


def _alike(one: NDArray[np.int64], other: NDArray[np.int64]) -> bool:
    """Whether two tell everything apart in the same way."""
    count = len(np.unique(one))
    return count == len(np.unique(other)) == len(np.unique(one * (int(other.max()) + 1) + other))


def _seat_words(
    said: Sequence[Sequence[tuple[int, str, tuple[str, ...]]]],
    table: Sequence[_Column],
) -> SeatWords:
    spoken = [list(lines) or [(0, SILENCE, ())] for lines in said]
    shares: defaultdict[str, float] = defaultdict(float)
    for lines in spoken:
        for _, text, _ in lines:
            shares[text] += 1 / len(lines) / len(spoken)
    order = {text: number for number, (text, _) in enumerate(sorted(shares.items(), key=lambda one: -one[1]))}
    flat = [
        (order[text], episode, step, 1 / len(lines))
        for episode, lines in enumerate(spoken)
        for step, text, _ in lines
    ]
    what, episodes, steps, weights = (np.array(part) for part in zip(*flat, strict=True))
    messages = Messages(what, episodes, steps, weights)
    found = [_situation(column, messages, list(order)) for column in table]
    # So many are looked at that one in twenty would be told of by chance (Bonferroni).
    situations = [
        replace(one, more_than_chance=one.told is not None and one.told.p * len(found) <= _LEVEL)
        for one in found
    ]
    return SeatWords(
        player="",
        success=0.0,
        spoke=float(np.mean([bool(lines) for lines in said])),
        utterances=float(np.mean([len(lines) for lines in said])),
        messages={text: round(shares[text], 6) for text in order},
        situations=tuple(sorted(situations, key=lambda one: -(one.told.bits if one.told else 0))),
        topographic=_topographic(said, table),
    )


def _situation(column: _Column, messages: Messages, texts: Sequence[str]) -> Situation:
    joint = messages.joint(column.numbers)
    name, *same = column.names
    said = {
        value: {text: round(float(count), 6) for text, count in zip(texts, row, strict=True) if count}
        for value, row in zip(column.values, joint, strict=False)
    }
    told = information(messages, column.numbers) if len(texts) > 1 else None
    return Situation(name, tuple(same), column.values, said, told)


def _topographic(
    said: Sequence[Sequence[tuple[int, str, tuple[str, ...]]]], table: Sequence[_Column]
) -> tuple[float, float] | None:
    """Of the draws that stay as they are in an episode, with the message that each combination has most often."""
    fixed = [one.numbers[:, 0] for one in table if one.is_drawn]
    if len(fixed) < 2:
        return None
    called: dict[tuple[int, ...], Counter[tuple[str, ...]]] = defaultdict(Counter)
    for episode, lines in enumerate(said):
        meaning = tuple(int(column[episode]) for column in fixed)
        called[meaning].update(parts for _, _, parts in lines)
    named = {meaning: counts.most_common(1)[0][0] for meaning, counts in called.items() if counts}
    if not named or len({len(parts) for parts in named.values()}) > 1:
        return None
    varying = sum(len(set(part)) > 1 for part in zip(*named.values(), strict=True))
    return topographic_similarity(list(named), list(named.values())) if varying > 1 else None
