"""The probes of a scenario at each moment of an episode, with their right answers.

The episode is played beside its environment by programs that note what probes are about (`compiler.questions`). That
both see the same is checked at every step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.compilation import NotedText, ProbeNotes, compile_asking_loaded, scenarios_of
from socialai_dsl.engine.calls import Task
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.table import Start, Table
from socialai_dsl.envs.values import shown
from socialai_dsl.program import Program, Register, RegisterName
from socialai_dsl.semantics.terms import NOTED
from socialai_dsl.vocabulary import TRUTHS, is_number, normal


@dataclass(frozen=True)
class Question:
    """A probe at its moment.

    Attributes:
        probe: its name; in a suite the member's comes first, `dance: who_knows`.
        text: what is asked.
        answers: what can be answered, two or more, in an order that tells nothing of what is right.
        right: which of them is.
    """

    probe: str
    text: str
    answers: tuple[str, ...]
    right: str

    @property
    def chance(self) -> float:
        """How often a guess is right."""
        return 1 / len(self.answers)


def probe_names(loaded: Loaded) -> tuple[str, ...]:
    """The probes of a scenario, or of the members of a suite, as `Question.probe` calls them."""
    members = getattr(loaded, "member_names", (None,))
    return tuple(
        _called(member, probe.name)
        for member, checked in zip(members, scenarios_of(loaded), strict=True)
        for probe in checked.probes
    )


def _called(member: str | None, probe: str) -> str:
    return probe if member is None else f"{member}: {probe}"


class Companion(Copied):
    """Plays along with one environment, by programs that note the values its probes are about.

    Args:
        loaded: the scenario or suite that the environment plays.
        own: the number of the seat whose images are given, where all seats are played; by default the agent is alone.
    """

    def __init__(self, loaded: Loaded, own: int | None = None) -> None:
        self._playable, self._probes = compile_asking_loaded(loaded)
        self._table = Table([self._playable], 1, all_seats=own is not None)
        self._own = own or 0
        self._lookers = [
            Looker(program, own is not None) if probes else None
            for program, probes in zip(self._table.programs, self._probes, strict=True)
        ]

    def begin(self, seed: int | None, options: Mapping[str, Any] | None, image: NDArray[np.uint8]) -> None:
        """Begin the episode that the environment began, as it was asked to.

        Args:
            seed: as `ScenarioEnv.reset` takes it.
            options: likewise.
            image: of the environment's observation.
        """
        self._table.reset(seed, options)
        self._compare(image)

    def follow(self, actions: Sequence[ArrayLike | None], image: NDArray[np.uint8]) -> None:
        """Take the environment's step.

        Args:
            actions: of each seat integers (heads,); None where nobody sits.
            image: of the environment's observation after it.
        """
        nothing = np.zeros(len(self._table.merged.action_space().nvec), np.int64)
        self._table.set_taken(np.array([action is not None for action in actions]))
        played = [nothing if action is None else np.asarray(action, np.int64) for action in actions]
        self._table.step(Task.STEP_ONLY, np.stack(played))
        self._compare(image)

    def _compare(self, image: NDArray[np.uint8]) -> None:
        assert np.array_equal(self._table.image[self._own], image), (
            "internal: the programs that ask went another way"
        )

    def values(self, begins: bool = False) -> dict[str, str | None]:
        """What is right now, for each probe; None where something that it is about is not there.

        Args:
            begins: whether the episode has just begun.
        """
        number = self._table.number(0)
        looker = self._lookers[number]
        if looker is None:
            return {}
        looker.look(self._table.start(0), begins)
        return {
            probe.name: looker.right(probe) if looker.is_set(probe.asked) else None
            for probe in self._probes[number]
        }


class Asker(Companion):
    """Follows the episodes of one environment and says what probes ask.

    Attributes:
        sha256: digest of all that decides what is asked when, and what is right.

    Args:
        loaded: the scenario or suite that the environment plays.
        own: see `Companion`.
    """

    def __init__(self, loaded: Loaded, own: int | None = None) -> None:
        super().__init__(loaded, own)
        self.sha256 = sha256(f"{self._playable.sha256} {self._probes}".encode()).hexdigest()
        self._asked: set[str] = set()
        self._act = 0

    def reset(
        self, seed: int | None, options: Mapping[str, Any] | None, image: NDArray[np.uint8]
    ) -> list[Question]:
        """Begin the episode that the environment began (see `begin`); what is asked now."""
        self.begin(seed, options, image)
        self._asked, self._act = set(), self._table.state.keys.item(0, Key.ACT)
        return self._questions(begins=True)

    def step(
        self, actions: Sequence[ArrayLike | None], image: NDArray[np.uint8], ended: bool
    ) -> list[Question]:
        """Take the environment's step (see `follow`), after which the episode may have ended; what is asked now."""
        self.follow(actions, image)
        return self._questions(ended=ended)

    def _questions(self, begins: bool = False, ended: bool = False) -> list[Question]:
        table = self._table
        if table.state.keys.item(0, Key.ACT) != self._act:
            self._asked, self._act, begins = set(), table.state.keys.item(0, Key.ACT), True
        number = table.number(0)
        looker = self._lookers[number]
        if looker is None:
            return []
        waiting = [
            probe
            for probe in self._probes[number]
            if probe.name not in self._asked and (ended or not probe.at_end)
        ]
        if not waiting:
            return []
        looker.look(table.start(0), begins)
        questions = []
        for probe in waiting:
            if looker.is_set(probe.asked):
                self._asked.add(probe.name)
                question = looker.question(probe, _called(table.member(0), probe.name))
                questions += [question] if len(question.answers) > 1 else []
        return questions


class Looker:
    """Reads what a program notes of a moment, in one step that is then forgotten."""

    def __init__(self, program: Program, all_seats: bool = False) -> None:
        self._program = program
        self._table = Table([program], 1, all_seats)
        self._table.batch.ports.actions[:] = 0
        self._table.batch.ports.actions[:, 0] = len(program.actions)
        self._remembered = [name.register for name in program.registers if name.path.startswith(NOTED)]

    @property
    def _registers(self) -> NDArray[np.int32]:
        """Those of the moment looked at, int32 (R,)."""
        registers: NDArray[np.int32] = self._table.state.registers[0]
        return registers

    def look(self, moment: Start, begins: bool) -> None:
        """Let the program note what it asks about at a moment; before the first step `prev(e)` is what e is now."""
        self._note(moment)
        if begins and self._remembered:
            self._note(moment, self._registers[self._remembered].copy())

    def _note(self, start: Start, before: NDArray[np.int32] | None = None) -> None:
        state = self._table.state
        state.keys[0] = self._table.own_keys(start.key)
        self._registers[:] = start.registers[: len(self._registers)]
        state.boards[0] = start.board[: state.boards.shape[1]]
        self._registers[Register.ENDED], self._registers[Register.OUTCOME] = 0, -1
        if before is not None:
            self._registers[self._remembered] = before
        self._table.batch.step(Task.STEP_ONLY)

    def is_set(self, name: RegisterName) -> bool:
        """Whether a register holds something else than 0."""
        return bool(self._registers[name.register])

    def right(self, probe: ProbeNotes) -> str:
        """The right answer of a probe at the present moment."""
        return self._text(probe.right)

    def question(self, probe: ProbeNotes, called: str) -> Question:
        """The question of a probe at the present moment."""
        answers = {normal(text): text for text in map(self._text, reversed(probe.answers))}
        right = self.right(probe)
        right = answers.setdefault(normal(right), right)
        # Sorted, since in the order written what is right could always stand at the same place.
        in_order = sorted(answers.values(), key=_by_number)
        return Question(called, self._text(probe.question), tuple(in_order), right)

    def _text(self, pieces: NotedText) -> str:
        return "".join(piece if isinstance(piece, str) else self._spoken(piece) for piece in pieces)

    def _spoken(self, name: RegisterName) -> str:
        value = shown(self._program, name, int(self._registers[name.register]))
        return TRUTHS[value] if isinstance(value, bool) else str(value)


def _by_number(text: str) -> tuple[float, str]:
    """Numbers by their value, before words."""
    return (int(text), text) if is_number(text) else (inf, text)
