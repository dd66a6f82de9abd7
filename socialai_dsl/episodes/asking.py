"""Whom players ask: what is said on a seat, and who answers, found in one way for every kind of mind."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.episodes.play import Observer, Rooms, Seat, Step
from socialai_dsl.grammar.ast import every
from socialai_dsl.program import Program
from socialai_dsl.program_suite import Playable, ProgramSuite
from socialai_dsl.semantics.plans import CheckedScenario, RulePlan, StatePlan, StepPlan
from socialai_dsl.semantics.terms import Heard, HeardNoun, Pattern, Said, Speaker
from socialai_dsl.traces.steps import heard_line


class Answer(NamedTuple):
    """What somebody answered.

    Attributes:
        step: in which it was asked, from 1. said: the words. by: the member of the cast who answered.
        answer: its words.
    """

    step: int
    said: str
    by: str
    answer: str


@dataclass
class _Waiting:
    """An utterance that may still be answered: its step, its words, who took notice, and who has answered."""

    step: int
    said: str
    noticed: frozenset[int]
    answered: set[int] = field(default_factory=set)


class Asking(Observer):
    """Notes what is said on each seat, and who answers.

    Somebody who follows a frame has taken notice of an utterance if the frame was then in a state, or an entry of
    `steps`, in which something waits for it; whoever sits on a seat always has. Of each of them the first line that the
    seat hears before it speaks again is an answer: in the same step or later, of who sits on a seat in a later one. So
    what somebody would have said anyway is no answer.

    Args:
        loaded: what is played.
        program: the same, compiled.

    Attributes:
        answers: number of an episode -> seat -> its answers in order.
        utterances: number of an episode -> how many utterances each seat made.
    """

    def __init__(self, loaded: Loaded, program: Playable) -> None:
        programs = program.programs if isinstance(program, ProgramSuite) else (program,)
        members = loaded.members if isinstance(loaded, LoadedSuite) else (loaded,)
        self._listening = [_Listening(one, m.checked) for one, m in zip(programs, members, strict=True)]
        self._waiting: dict[tuple[int, Seat], _Waiting] = {}
        self._t = np.zeros(0, np.int64)
        self._states = np.zeros((0, 0), np.int64)
        self.answers: defaultdict[int, defaultdict[Seat, list[Answer]]] = defaultdict(
            lambda: defaultdict(list)
        )
        self.utterances: defaultdict[int, Counter[Seat]] = defaultdict(Counter)

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        if len(self._t) != rooms.count:
            self._t = np.zeros(rooms.count, np.int64)
        self._t[begun] = 0
        self._states = rooms.env.frame_states()
        self._waiting = {place: one for place, one in self._waiting.items() if not begun[place[0]]}

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self._t += 1
        before, self._states = self._states, rooms.env.frame_states()
        spoken = {seat: step.running & (actions[:, 1] == 1) for seat, actions in step.actions.items()}
        if not self._waiting and not any(those.any() for those in spoken.values()):
            return
        heard, played = rooms.env.heard_lines(), self._played(rooms)
        # Who sits on a seat speaks at the same time as the others, so it can only answer what was said before.
        self._answered(rooms, step, heard, played, by_seats=True)
        for seat, those in spoken.items():
            for room in np.flatnonzero(those).tolist():
                _, _, template, *choices = step.actions[seat][room].tolist()
                said = rooms.env.program.sentences.text(template, choices)
                noticed = self._listening[played[room]].noticed(said, before[room], self._states[room])
                self._waiting[room, seat] = _Waiting(int(self._t[room]), said, noticed)
                self.utterances[int(step.numbers[room])][seat] += 1
        self._answered(rooms, step, heard, played, by_seats=False)

    def _answered(
        self,
        rooms: Rooms,
        step: Step,
        heard: tuple[NDArray[np.int64], NDArray[np.int64]],
        played: Sequence[int],
        by_seats: bool,
    ) -> None:
        """Note the answers that are heard in this step: of those on seats, or of those who follow frames."""
        for (room, seat), waiting in self._waiting.items():
            if not step.running[room]:
                continue
            names = self._listening[played[room]].names
            row = room * len(rooms.names) + rooms.names.index(seat)
            for speaker, line in zip(*(part[row].tolist() for part in heard), strict=True):
                if speaker < 0 or speaker in waiting.answered or names[speaker] == seat:
                    continue
                sits = names[speaker] in rooms.seats
                if sits == by_seats and (sits or speaker in waiting.noticed):
                    waiting.answered.add(speaker)
                    text = heard_line(0, rooms.env.lines[line]).text
                    found = Answer(waiting.step, waiting.said, names[speaker], text)
                    self.answers[int(step.numbers[room])][seat].append(found)

    def _played(self, rooms: Rooms) -> list[int]:
        """Of each room the number of the program that is played."""
        if len(self._listening) == 1:
            return [0] * rooms.count
        found: list[int] = rooms.env.member_ids()[:: len(rooms.names)].tolist()
        return found


class _Listening:
    """What the members of a scenario's cast wait for.

    Attributes:
        names: of everybody and everything, by number.
    """

    def __init__(self, program: Program, checked: CheckedScenario) -> None:
        self.names = [str(entity) for entity in program.entities]
        sentences = program.sentences
        texts = {
            pair: sentences.text(template, choices)
            for (template, choices), pair in zip(sentences.each(), sentences.pairs(), strict=True)
        }
        self._waits: defaultdict[str, list[tuple[int, int, int]]] = defaultdict(list)
        """Utterance -> where something waits for it: number of the frame, of the state or entry, and of the member."""
        for frame, plan in enumerate(checked.frames):
            parts: Sequence[StatePlan | StepPlan] = plan.steps or plan.states
            for state, part in enumerate(parts):
                pairs = frozenset().union(*(pattern.pairs for pattern in _patterns(part)))
                for pair in pairs & texts.keys():
                    self._waits[texts[pair]].append((frame, state, plan.entity))

    def noticed(self, said: str, before: NDArray[np.int64], after: NDArray[np.int64]) -> frozenset[int]:
        """Who has taken notice of what was said, by the states of all frames before and after the step, int64 (F,)."""
        waits = self._waits.get(said, ())
        return frozenset(member for frame, state, member in waits if state in (before[frame], after[frame]))


def _patterns(part: StatePlan | StepPlan) -> list[Pattern]:
    """What is waited for: by rules that hear it, and by conditions about what was heard or the agent has said."""
    heard = [pattern for rule in every(RulePlan, part) for pattern in rule.hears]
    heard += [pattern for term in every(Heard, part) for pattern in term.patterns]
    heard += [pattern for term in every(Speaker, part) for pattern in term.patterns]
    heard += [pattern for term in every(HeardNoun, part) for pattern in term.patterns]
    return heard + [term.pattern for term in every(Said, part)]
