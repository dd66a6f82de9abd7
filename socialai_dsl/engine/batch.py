"""A batch of environments in memory: programs one behind the other, state, ports, and the calls that step them."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.engine.calls import BAD_ACTION, RoomError, Task
from socialai_dsl.engine.jit import load
from socialai_dsl.engine.kernel import serve
from socialai_dsl.engine.pointers import make_book, replace_in
from socialai_dsl.engine.queries import identify, script
from socialai_dsl.engine.state import (
    ATTEMPTS,
    ArrayId,
    Key,
    Link,
    Ports,
    State,
    Tables,
    Trait,
    empty_ports,
    empty_state,
    no_pins,
)
from socialai_dsl.engine.views import view_table
from socialai_dsl.program import (
    VIEW,
    EntityColumn,
    Flag,
    FrameColumn,
    Header,
    Op,
    Outcome,
    Program,
    TypeColumn,
)
from socialai_dsl.widths import MOST_SEATS

_PLAIN_CHANNELS: Final = 4
_TWO_GESTURES: Final = 2

_Arrays = TypeVar("_Arrays", Tables, State, Ports)


@dataclass(frozen=True, eq=False)
class LinkedProgram:
    """A program and how it is linked into a batch.

    Attributes:
        program: the program.
        outcomes: the batch's number of each way to end, deadly and time-out included.
        actions: Body of each body action of the batch.
        templates: the program's own index of each of the batch's, -1 if it has no such.
        slots: for each slot of the batch the program's own index of each of its words, likewise.
        strides: for each template of the batch the filling that it has without its slots, and what a word of each slot
            of the batch counts in it, 0 if the template lacks the slot.
        tokens: the batch's id of each token id of the program.
        looks: for each look that the program's picture shows its channel of the batch, counted from the fifth.
    """

    program: Program
    outcomes: Sequence[int]
    actions: Sequence[int]
    templates: Sequence[int]
    slots: Sequence[Sequence[int]]
    strides: Sequence[Sequence[int]]
    tokens: Sequence[int]
    looks: Sequence[int] = ()


class Batch:
    """Environments that are stepped together.

    Attributes:
        state, ports: arrays, one row for each environment.
        tables: programs, views and pools.
        offsets, first_counters: where each program begins in the words, and where its counters.
        counters: int64 (counters of all programs,), how often what is counted was seen.
    """

    def __init__(
        self,
        parts: Sequence[LinkedProgram],
        pools: Sequence[Sequence[int]],
        pool_of_row: Sequence[int],
        length: int,
        sequences: Collection[int] = (),
        seats: int = 1,
    ) -> None:
        """Allocate everything; every row must be reset before its first step.

        Args:
            parts: the programs.
            pools: sets of programs, by number; an episode draws one of its pool.
            pool_of_row: for each environment the number of its pool.
            length: tokens in a history.
            sequences: numbers of the pools whose programs are the acts of one episode, played one after another. They
                have one horizon.
            seats: how many seats callers play: the agent's alone, or all that every program has.
        """
        _check_sequences(parts, [pools[number] for number in sequences])
        rows = self._rows = len(pool_of_row)
        programs = [part.program for part in parts]
        registers = max(program.header(Header.REGISTERS) for program in programs)
        board = max(_board_words(program) for program in programs)
        self.seats = seats
        words, views, self.offsets, self.first_counters = _link(parts, length, seats)
        starts = np.cumsum([0, *map(len, pools)])
        self.tables = Tables(
            words,
            views,
            np.array([self.offsets[i] for pool in pools for i in pool], np.int64),
            np.concatenate([np.arange(1, len(pool) + 1) for pool in pools]).astype(np.int64),
        )
        self.more = _more(parts)
        self.state: State = empty_state(rows, registers, board, length, VIEW, self.more, seats)
        counters = sum(program.header(Header.COUNTERS) for program in programs)
        self.ports: Ports = empty_ports(self.state, counters, len(parts[0].slots), self.more)
        self.counters = self.ports.counters
        for row, pool in enumerate(pool_of_row):
            in_sequence = int(pool in sequences)
            self.state.keys[row, Key.POOL] = int(starts[pool]) | len(pools[pool]) << 32 | in_sequence << 63
            self.state.keys[row, Key.PROGRAM] = self.offsets[pools[pool][0]]
        self._pool_starts = starts.tolist()
        self._names = [program.name for program in programs]
        self._note_addresses()

    def _note_addresses(self) -> None:
        """Tell the engine where the arrays are."""
        self._book = make_book((*self.tables, *self.state, *self.ports, self.ports.actions.reshape(-1)))

    def __getstate__(self) -> dict[str, Any]:
        """All but the addresses, which mean something in this process and to this batch alone."""
        return {name: value for name, value in vars(self).items() if name != "_book"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Be a copy with arrays of its own: those that come may be another batch's, or must not be written to."""
        vars(self).update(state)
        self.tables, self.state, self.ports = map(_own_arrays, (self.tables, self.state, self.ports))
        self.counters = self.ports.counters
        self._note_addresses()

    def program_numbers(self) -> NDArray[np.intp]:
        """Which program each row plays, (E,)."""
        return np.searchsorted(self.offsets, self.state.keys[:, Key.PROGRAM].astype(np.int64))

    def weights(self, pool: int) -> list[int]:
        """How much each program of a pool weighs when an episode draws one."""
        start, end = self._pool_starts[pool : pool + 2]
        return np.diff(self.tables.weights[start:end], prepend=0).tolist()

    def set_weights(self, pool: int, weights: Sequence[int]) -> None:
        """Let later episodes draw the programs of a pool as they weigh; all weigh 1 at first.

        Raises:
            ValueError: they are not one for each program, 0 or more, and 1 to 2**32 - 1 together.
        """
        start, end = self._pool_starts[pool : pool + 2]
        given = [int(weight) for weight in weights]
        if len(given) != end - start or min(given) < 0 or not 1 <= sum(given) < 1 << 32:
            raise ValueError(
                f"weights: got {given}; expected {end - start} integers from 0 on that add up to 1 to {(1 << 32) - 1}"
            )
        self.tables.weights[start:end] = np.cumsum(given)

    def step(self, task: Task, actions: NDArray[np.integer[Any]] | None = None) -> int:
        """Step all rows; how many episodes ended, or BAD_ACTION and nothing happened.

        Args:
            task: one of the steps.
            actions: integers (E S, 3 + slots); left out, `ports.actions`.

        Raises:
            RoomError: all rows were stepped, but one that was reset found no room as its scenario requires; it
                is in the last room that was drawn, and play may go on.
        """
        if actions is not None:
            self.ports.actions[:] = actions
        return self._serve(task)

    def stepper(self, task: Task) -> Callable[[], int]:
        """A call of `step(task)` with nothing between Python and the engine.

        Below BAD_ACTION means that a room was refused (`refused_room`).
        """
        return partial(load(serve), self._book, int(task), self._rows)

    def reset(self, pins: NDArray[np.int32] | None = None) -> None:
        """Start the episodes that the keys of the rows `ports.chosen` name, from their layouts (`ports.layout`).

        Raises:
            RoomError: as `step` does.
        """
        if pins is not None or len(self.ports.pins) > 1:
            registers = self.state.registers.shape[1]
            self.ports = self.ports._replace(pins=no_pins(registers) if pins is None else pins)
            replace_in(self._book, ArrayId.PINS, self.ports.pins)  # so that prepared calls stay valid
        self._serve(Task.RESET)

    def script(self) -> None:
        """Let `ports.actions` be what the agents' frames would do now."""
        load(script)(self._book, self._rows)

    def identify(self) -> NDArray[np.int64]:
        """A digest of each picture, int64 (E S,)."""
        load(identify)(self._book, self._rows * self.seats)
        return self.ports.image_ids.view(np.int64).copy()

    def _serve(self, task: Task) -> int:
        ended = load(serve)(self._book, int(task), self._rows)
        if ended < BAD_ACTION:
            raise self.refused_room()
        return ended

    def refused_room(self) -> RoomError:
        """Why a call returned less than BAD_ACTION; after it play may go on."""
        rows = np.flatnonzero(self.ports.refused).tolist()
        row = rows[0]
        self.ports.refused[:] = False
        key = self.state.keys[row]
        return RoomError(
            f"{self._names[int(self.program_numbers()[row])]}: none of {ATTEMPTS} rooms was as `require` asks, in row "
            f"{row} (seed {key[Key.SEED]}, index {key[Key.INDEX]}, episode {key[Key.EPISODE]})",
            rows,
        )


def _own_arrays(arrays: _Arrays) -> _Arrays:
    """Copies of arrays, as the engine takes them."""
    return arrays._make(np.array(array, order="C") for array in arrays)


def _board_words(program: Program) -> int:
    """Words of a program's board."""
    width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
    return width * height + 1 + 2 * height + width


def _check_sequences(parts: Sequence[LinkedProgram], sequences: Sequence[Sequence[int]]) -> None:
    """The clock of an episode in acts is one, so its end must be."""
    for sequence in sequences:
        acts = [parts[number] for number in sequence]
        horizons = {part.program.header(Header.HORIZON) for part in acts}
        assert len(horizons) == 1, f"internal: acts of one episode have the horizons {sorted(horizons)}"


def _link(
    parts: Sequence[LinkedProgram], length: int, seats: int
) -> tuple[NDArray[np.int32], NDArray[np.uint16], list[int], list[int]]:
    """Lay programs and their links one behind the other: words, views, offset and first counter of each program."""
    shown, more = _shown(parts), _more(parts)
    words: list[NDArray[np.int32]] = []
    views: dict[tuple[int, int], int] = {}
    offsets, first_counters = [], []
    offset, counter, poses = 0, 0, 0
    for part in parts:
        program, h = part.program, part.program.header
        canvas = h(Header.CANVAS_WIDTH), h(Header.CANVAS_HEIGHT)
        if canvas not in views:
            views[canvas] = poses
            poses += canvas[0] * canvas[1] * 4
        link = np.zeros(Link.END, np.int32)
        link[Link.COUNTERS] = counter
        link[Link.RULES] = len(program.rules)
        link[Link.OUTCOMES] = len(part.outcomes)
        link[Link.VIEWS] = views[canvas]
        link[Link.ACTIONS], link[Link.TEMPLATES] = len(part.actions), len(part.templates)
        link[Link.SLOTS] = len(part.slots)
        tables = [*part.actions]
        for place, table in (
            (Link.TEMPLATE_AT, part.templates),
            (Link.STRIDE_AT, [*chain(*part.strides)]),
            (Link.SIZE_AT, [*map(len, part.slots)]),
            (Link.WORD_AT, [*chain(*part.slots)]),
            (Link.ENDING_AT, part.outcomes),
            (Link.SUCCESS_AT, [_successful(outcome) for outcome in program.outcome_table]),
            (Link.LOOK_AT, part.looks),
        ):
            link[place] = h(Header.SIZE) + len(link) + len(tables)
            tables += table
        link[Link.MORE], link[Link.LOOKS] = more, len(part.looks)
        link[Link.SEATS], link[Link.TOKENS] = seats, length
        link[Link.LOOK_REGISTER_AT] = h(Header.SIZE) - h(Header.ENTITIES) * len(part.looks)
        link[Link.FIRST_ROLLING], link[Link.LAST_ROLLING] = _rolling(program)
        own = _with_tokens(part)
        own[Header.FLAGS] |= _traits(program) | shown
        words += [own, link, np.array(tables, np.int32)]
        offsets.append(offset)
        first_counters.append(counter)
        offset += len(own) + len(link) + len(tables)
        counter += h(Header.COUNTERS)
    return np.concatenate(words), np.concatenate([view_table(*c) for c in views]), offsets, first_counters


def _successful(outcome: Outcome) -> int:
    """The seats that an outcome is a success of, as bits."""
    if not outcome.success:
        return 0
    return sum(1 << seat for seat in (range(MOST_SEATS) if outcome.seats is None else outcome.seats))


def _shown(parts: Sequence[LinkedProgram]) -> int:
    """What the channels behind the fourth show if one of the programs has them, as bits of `Trait`."""
    shown = 0
    for part in parts:
        carrying = part.program.header(Header.FLAGS) & Flag.SHOWS_CARRYING != 0
        shown |= (Trait.HANDS | Trait.MORE) * carrying
        gestures = part.program.header(Header.CHANNELS) - carrying - _PLAIN_CHANNELS
        shown |= Trait.GESTURES * (gestures > 0)
        shown |= (Trait.CELLS | Trait.MORE) * (gestures > _TWO_GESTURES)
        shown |= Trait.MORE * bool(part.looks)
    return shown


def _more(parts: Sequence[LinkedProgram]) -> int:
    """How many channels pictures have behind the fourth; those of looks are the last."""
    shown = _shown(parts)
    others = 2 * bool(shown & Trait.GESTURES) + 2 * bool(shown & Trait.CELLS) + bool(shown & Trait.HANDS)
    return max((others, *(1 + place for part in parts for place in part.looks)))


def _traits(program: Program) -> int:
    """What may happen in a program, as bits of `Trait`."""
    traits, h = 0, program.header
    if h(Header.TICK_PC) or h(Header.FLAGS) & Flag.ROLLS:
        traits |= Trait.GOES_BY_ITSELF
    types, starts = program.table(Header.TYPE_AT), _types(program)
    # What has one status only cannot change it.
    status = np.arange(len(types)) - starts[np.searchsorted(starts, np.arange(len(types)), "right") - 1]
    pushed_members = program.table(Header.ENTITY_AT)[:, EntityColumn.MANNERS] & 2
    if (types[:, TypeColumn.PUSHED] != status).any() or pushed_members.any():
        traits |= Trait.PUSHED
    if program.table(Header.FRAME_AT)[:, [FrameColumn.PERCEIVE, FrameColumn.DEFERRED]].any():
        traits |= Trait.APART
    if h(Header.EACH_STEP) or (program.code[:, 0] == Op.REWARD).any():
        traits |= Trait.REWARDS
    return traits


def _types(program: Program) -> NDArray[np.int32]:
    """Where each type begins in the type table: it has as many rows as it is far to the next."""
    return np.unique(program.table(Header.ENTITY_AT)[:, EntityColumn.TYPE])


def _rolling(program: Program) -> tuple[int, int]:
    """The first and the last entity that may ever roll; 0 and -1 if none may."""
    types, starts = program.table(Header.TYPE_AT), _types(program)
    ends = [*starts[1:], len(types)]
    rolling = [
        first for first, end in zip(starts, ends, strict=True) if types[first:end, TypeColumn.ROLLS].any()
    ]
    found = np.flatnonzero(np.isin(program.table(Header.ENTITY_AT)[:, EntityColumn.TYPE], rolling))
    return (int(found[0]), int(found[-1])) if len(found) else (0, -1)


def _with_tokens(part: LinkedProgram) -> NDArray[np.int32]:
    """The program's words with the batch's token ids."""
    words = part.program.words.copy()
    start, end = part.program.header(Header.TOKEN_AT), part.program.header(Header.SITE_AT)
    words[start:end] = np.asarray(part.tokens, np.int32)[words[start:end]]
    return words
