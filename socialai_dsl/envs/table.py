"""The batch of environments behind single and vector environments."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.draws import GOLDEN, MASK, MAX_SEED, TEST_DOMAIN, below, draw, episode_key, mix, site
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import BAD_ACTION, Task
from socialai_dsl.engine.state import Key
from socialai_dsl.envs import snapshot
from socialai_dsl.envs.audit import first_unsound
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.describe import describe, history
from socialai_dsl.envs.layout import pins_of
from socialai_dsl.envs.merge import CommonSpace
from socialai_dsl.envs.options import each, reset_options
from socialai_dsl.envs.starts import Starts
from socialai_dsl.envs.values import whole_number, word
from socialai_dsl.program import (
    LOOKS,
    VIEW,
    Flag,
    FrameColumn,
    Header,
    Program,
    Register,
    SeatColumn,
    SeatRegister,
)
from socialai_dsl.program_suite import Playable, ProgramSuite, prefixed
from socialai_dsl.vocabulary import TURN_WORDS
from socialai_dsl.widths import REGISTER, UNPINNED

Image = NDArray[np.uint8]


def in_bytes(words: NDArray[Any], channels: int) -> Image:
    """The same memory, uint8 (E, 7, 7, channels): the bytes of a row hold the channels of its 49 cells."""
    held = words.view(np.uint8)[:, : VIEW * VIEW * channels]
    return held.reshape(len(words), VIEW, VIEW, channels)


def joined(image: NDArray[np.uint32], extra: NDArray[np.uint16], channels: int) -> Image:
    """The pictures of all rows, uint8 (E, 7, 7, channels).

    Args:
        image: packed cells, (E, 49): the first four channels.
        extra: those behind the fourth, see `State.extra`.
        channels: how many there are of both.
    """
    looks = in_bytes(image, len(LOOKS))
    if channels == len(LOOKS):
        return looks
    return np.concatenate([looks, in_bytes(extra, channels - len(LOOKS))], axis=-1)


# -- who plays which episode: seeds, indices and episode numbers of the rows ---------------------------------


LAST_EPISODE = (1 << 32) - 1


def choose_episodes(
    keys: NDArray[np.uint64],
    chosen: NDArray[np.bool_],
    seed: Any,
    options: Mapping[str, Any],
    fresh: NDArray[np.bool_],
) -> None:
    """Set seed, index and episode in the rows, uint64 (E, Key.WORDS), that are chosen, bool (E,).

    `test_episode` names episodes of a domain of keys that no seed reaches; 0 to 499 are the fixed test set.
    One seed gives environment i (seed, i); a list gives it (seeds[i], 0); both start at episode 0. Without a seed, or
    where the list has None, the next episode follows, or, in a `fresh` row, bool (E,), which has had none, a seed is
    drawn from the operating system.

    Raises:
        ValueError: an option is not what was expected, or says nothing beside another.
    """
    rows = np.flatnonzero(chosen)
    test, index = options.get("test_episode"), options.get("index")
    if test is not None:
        for name, given in (("seed", seed), ("options['index']", index)):
            if given is not None:
                raise ValueError(
                    f"{name}: got {given!r} beside options['test_episode'], which names an episode by itself; "
                    "expected one of the two"
                )
        episodes = each("options['test_episode']", test, len(keys), LAST_EPISODE)
        keys[rows, Key.SEED], keys[rows, Key.INDEX] = TEST_DOMAIN, 0
        keys[rows, Key.EPISODE] = np.array(episodes, np.uint64)[rows]
        return
    if index is not None and (seed is None or (_is_list(seed) and None in list(seed))):
        raise ValueError(
            f"options['index']: got {index!r} without a seed; expected a seed of which it is the index"
        )
    if seed is None and fresh.all():
        seed = secrets.randbelow(MAX_SEED + 1)
    given_seeds = [None] * len(keys) if seed is None else seed
    seeds = each("seed", given_seeds, len(keys), MAX_SEED, or_none=True)
    for row in np.flatnonzero(fresh):
        seeds[row] = secrets.randbelow(MAX_SEED + 1) if seeds[row] is None else seeds[row]
    has_seed = np.array([number is not None for number in seeds])
    keys[chosen & ~has_seed, Key.EPISODE] += np.uint64(1)
    begun = np.flatnonzero(chosen & has_seed)
    keys[begun, Key.EPISODE] = 0
    keys[begun, Key.SEED] = np.array([number or 0 for number in seeds], np.uint64)[begun]
    keys[begun, Key.INDEX] = 0 if _is_list(seed) else begun
    if index is not None:
        indices = each("options['index']", index, len(keys), MAX_SEED)
        keys[begun, Key.INDEX] = np.array(indices, np.uint64)[begun]


def _is_list(seed: Any) -> bool:
    """Whether each environment gets a seed of its own."""
    return seed is not None and not isinstance(seed, int | np.integer)


# -- the batch -----------------------------------------------------------------------------------------------


_PROGRAM = int(Key.PROGRAM)  # members of an enumeration are slow indices

# Odd multipliers, one for each line heard at once.
_MULTIPLIERS = np.array([mix(k * GOLDEN) | 1 for k in range(1, 65)], np.uint64)


def _numbers_of_texts(lines: Sequence[str]) -> NDArray[np.uint64]:
    """A number for the text of each line, uint64 (lines,): several lines may say the same."""
    first = {text: number for number, text in reversed(list(enumerate(lines)))}
    return np.array([first[text] for text in lines], np.uint64)


def too_early(call: str, fresh: NDArray[np.bool_]) -> ValueError:
    """What is raised where a call needs an episode in every row, and some are `fresh`, bool (E,)."""
    if fresh.all():
        return ValueError(f"{call}: got a call before the first reset(); expected reset() first")
    rows = np.flatnonzero(fresh).tolist()
    return ValueError(
        f"{call}: got environments that were never reset, {rows[:10]}; expected reset() of all first"
    )


def heard_at(program: Program, seat: int) -> tuple[int, int]:
    """Of what a seat heard in the last step the registers of the number of lines and of the first one."""
    if seat == 0:
        return int(Register.HEARD), program.header(Header.HEARD)
    row = program.seat_table[seat - 1].tolist()
    return row[SeatColumn.FIRST] + SeatRegister.HEARD, row[SeatColumn.HEARD]


def _common_seats(programs: Sequence[Program], in_acts: Sequence[bool]) -> int:
    """How many seats all programs have.

    Raises:
        ValueError: they do not have as many, or an episode is played in acts.
    """
    counts = {program.name: len(program.seats) for program in programs}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise ValueError(
            f"seats: got scenarios with different numbers of them, {listed}; expected equal ones"
        )
    if any(in_acts) and max(counts.values()) > 1:
        raise ValueError(
            "seats: got a suite whose episodes are played in acts; expected a scenario, or one seat"
        )
    return max(counts.values())


class HeardLines(NamedTuple):
    """The lines that the agents of E environments heard in a step, at most K each, in the order spoken.

    Attributes:
        speakers: int64 (E, K), who said each: 0 the agent, 1 the first of the others in the order of the cast; -1 none.
        lines: int64 (E, K), the text of each as an index into `lines` of the vector environment; -1 none.
    """

    speakers: NDArray[np.int64]
    lines: NDArray[np.int64]


class Start(NamedTuple):
    """A moment of an environment: registers, int32 (R,), board, uint32 (C,), key, uint64 (Key.WORDS,)."""

    registers: NDArray[np.int32]
    board: NDArray[np.uint32]
    key: NDArray[np.uint64]


class Table(Copied):
    """Rows of environments: row i plays `playables[i modulo their number]`, of a suite one member each episode.

    Each row has `seats` players: player number e * S + s sits on seat s of row e.

    Attributes:
        rows: E. seats: S. players: E S.
        sessions: uint64 (E,), how many episodes in a row share some of what is drawn.
        image: uint8 (E S, 7, 7, channels), tokens: int16 (E S, L): buffers that every call writes to.
    """

    def __init__(self, playables: Sequence[Playable], rows: int, all_seats: bool = False) -> None:
        different = list({id(playable): playable for playable in playables}.values())
        self.merged = CommonSpace.of(different)
        self.programs = self.merged.programs
        number = {id(playable): i for i, playable in enumerate(different)}
        numbers = np.array([number[id(playable)] for playable in playables])
        self.pool_of = numbers[np.arange(rows) % len(numbers)]
        self.sessions = np.array([p.session for p in different], np.uint64)[self.pool_of]
        self._plays_acts = [isinstance(p, ProgramSuite) and p.in_sequence for p in different]
        self.seats = _common_seats(self.programs, self._plays_acts) if all_seats else 1
        self.batch = Batch(
            self.merged.parts,
            self.merged.pools,
            self.pool_of.tolist(),
            self.merged.length,
            [number for number, in_acts in enumerate(self._plays_acts) if in_acts],
            self.seats,
        )
        self.rows = rows
        self.players = rows * self.seats
        self.channels = len(self.merged.channels)
        self._find_buffers()
        self.fresh = np.ones(self.rows, np.bool_)
        self.all_begun = False
        self._number_at = {offset: i for i, offset in enumerate(self.batch.offsets)}
        self._texts = [_numbers_of_texts(program.lines) for program in self.programs]
        # Of each pool: what the suite calls its members; None if it is a scenario that plays alone.
        self._called = [p.members if isinstance(p, ProgramSuite) else None for p in different]
        self._starts = Starts(different, self.programs, self.state.registers.shape[1])
        for pool, playable in enumerate(different):
            if isinstance(playable, ProgramSuite) and playable.weights and not playable.in_sequence:
                self.batch.set_weights(pool, playable.weights)

    def _find_buffers(self) -> None:
        """Look up the arrays of the batch that callers see."""
        self.state = self.batch.state
        picture = self.batch.ports.picture if self.batch.more else self.state.image
        self.image = in_bytes(picture, self.channels)
        self.tokens = self.state.tokens.reshape(self.players, -1)

    def __getstate__(self) -> dict[str, Any]:
        """All but what looks into the memory of the batch."""
        return {name: value for name, value in vars(self).items() if name not in ("state", "image", "tokens")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Be a copy, which looks into its own batch."""
        vars(self).update(state)
        self._find_buffers()

    # --- playing ---

    def reset(self, seed: Any, options: Mapping[str, Any] | None) -> None:
        """Start episodes; see `choose_episodes` for the meaning of seeds, `layout.pins_of` for layouts."""
        given = reset_options(options)
        chosen = self._mask(given.get("reset_mask"))
        keys = self.state.keys.copy()
        choose_episodes(keys, chosen, seed, given, self.fresh)
        layout: Any = given.get("layout")
        pins, rows = self._pins(layout, keys, chosen)
        # Nothing has changed so far, should something be wrong with what was given.
        self.state.keys[:] = keys
        self.fresh = self.fresh & ~chosen
        self.all_begun = not self.fresh.any()
        ports = self.batch.ports
        ports.chosen[:] = chosen
        ports.layout[:] = rows
        self.batch.reset(pins)
        for row in np.flatnonzero(chosen & (rows != 0)).tolist():
            own = layout if isinstance(layout, Mapping) else layout[row]
            # Whether the layout is of an act after one that was no success.
            self.state.keys[row, Key.SPOILED] = bool(own.get("spoiled"))
        if self._starts:
            self._begin(chosen & (rows == 0))

    def step(self, task: Task, actions: Any) -> int:
        """Step all rows, int64 (E S, 3 + slots); how many episodes ended. Raises ValueError for a bad action."""
        self.look("step")
        given = self.own_actions(actions, self.players)
        ended = self.play(task, given)
        if ended == BAD_ACTION:
            raise self.refusal(given)
        return ended

    def own_actions(self, actions: Any, count: int) -> NDArray[np.integer[Any]]:
        """Actions of a number of players, integers (count, 3 + slots). Raises ValueError for anything else."""
        try:
            given = np.asarray(actions)
        except ValueError:  # rows of different lengths
            given = np.array(None)
        expected = count, self.batch.ports.actions.shape[1]
        if given.shape != expected or given.dtype.kind not in "iu":
            raise ValueError(
                f"step: got actions of shape {given.shape} and type {given.dtype}; expected integers {expected}"
            )
        return given

    def refusal(self, actions: NDArray[np.integer[Any]]) -> ValueError:
        """Why a step did nothing: one of the actions is outside of the space."""
        space = self.merged.action_space()
        row = next(i for i, action in enumerate(actions) if not space.contains(action.astype(space.dtype)))
        return ValueError(
            f"step: got the action {actions[row].tolist()} in row {row}; expected one of {space}"
        )

    def stepper(self, task: Task) -> Callable[[], int]:
        """A call that steps all rows with the actions in the ports: see `Batch.stepper`."""
        return partial(self.play, task) if self._starts else self.batch.stepper(task)

    def play(self, task: Task, actions: NDArray[np.integer[Any]] | None = None) -> int:
        """`Batch.step`, after which episodes that begin are where their members begin."""
        if not self._starts:
            return self.batch.step(task, actions)
        episodes = self.state.keys[:, Key.EPISODE].copy()
        ended = self.batch.step(task, actions)
        self._begin(self.state.keys[:, Key.EPISODE] != episodes)
        return ended

    def _begin(self, fresh: NDArray[np.bool_]) -> None:
        """Let those rows whose episode was just drawn start as their members do."""
        layouts = self._starts.rows[self.batch.program_numbers()]
        fresh = fresh & (layouts != 0)
        if fresh.any():
            self.batch.ports.chosen[:] = fresh
            self.batch.ports.layout[:] = layouts
            self.batch.reset(self._starts.pins)

    def _mask(self, mask: Any) -> NDArray[np.bool_]:
        if mask is None:
            return np.ones(self.rows, np.bool_)
        given = np.asarray(mask)
        if given.shape != (self.rows,) or given.dtype != np.bool_:
            raise ValueError(f"options['reset_mask']: got {mask!r}; expected {self.rows} booleans")
        return given

    def _pins(
        self, layout: Any, keys: NDArray[np.uint64], chosen: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int32] | None, NDArray[np.int32]]:
        """The table of pins (row 0 pins nothing) and which of its rows each environment uses."""
        rows = np.zeros(self.rows, np.int32)
        if layout is None:
            return None, rows
        layouts = [layout] * self.rows if isinstance(layout, Mapping) else layout
        if not isinstance(layouts, Sequence) or isinstance(layouts, str) or len(layouts) != self.rows:
            raise ValueError(
                f"options['layout']: got {layout!r}; expected a mapping, or a list of {self.rows}"
            )
        width = self.state.registers.shape[1] + 1
        pins = [np.full(width, UNPINNED, REGISTER)]
        known: dict[tuple[int, int, int], int] = {}
        for i in np.flatnonzero(chosen).tolist():
            if layouts[i] is None:
                continue
            pool = int(self.pool_of[i])
            place = self._place_in_pool(layouts[i], pool, keys[i])
            key = id(layouts[i]), pool, place
            if key not in known:
                known[key] = len(pins)
                row = np.full(width, UNPINNED, REGISTER)
                program = self.programs[self.merged.pools[pool][place]]
                given = pins_of(program, layouts[i], self._other_keys(pool))
                row[: len(given)] = given
                row[-1] = place
                pins.append(row)
            rows[i] = known[key]
        return np.stack(pins), rows

    def _other_keys(self, pool: int) -> tuple[str, ...]:
        """Keys of a layout that say something of a suite."""
        if self._called[pool] is None:
            return ()
        return ("member", "spoiled") if self._plays_acts[pool] else ("member",)

    def _place_in_pool(self, layout: Any, pool: int, key: NDArray[np.uint64]) -> int:
        """Which program of its pool a row with a layout will play: the one that is named, else the one it draws."""
        members = self._called[pool]
        if members is None:
            return 0
        named = layout.get("member") if isinstance(layout, Mapping) else None
        if named is not None:
            return word("member", named, members)
        if self._plays_acts[pool]:
            return 0
        seed, index, episode = (int(key[word]) for word in (Key.SEED, Key.INDEX, Key.EPISODE))
        summed = np.cumsum(self.batch.weights(pool))
        drawn = below(draw(episode_key(seed, index, episode), site("member"), 0, 0), int(summed[-1]))
        return int(np.searchsorted(summed, drawn, side="right"))

    def set_member_weights(self, weights: Sequence[int]) -> None:
        """Let later episodes draw the suite's members as they weigh.

        Raises:
            ValueError: no suite is played whose members are drawn, or the weights are not right.
        """
        if len(self._called) != 1 or self._called[0] is None or self._plays_acts[0]:
            raise ValueError(
                "set_member_weights: got weights, but these environments play no suite that draws members"
            )
        whole = isinstance(weights, Sequence | np.ndarray) and all(
            isinstance(weight, int | np.integer) and not isinstance(weight, bool) for weight in weights
        )
        if not whole:
            raise ValueError(f"weights: got {weights!r}; expected a list of whole numbers")
        self.batch.set_weights(0, weights)

    def scripted_actions(self) -> NDArray[np.int64]:
        """The actions of the agents' scripts, int64 (E, 3 + slots); nothing changes in the rooms."""
        free = [p.name for p in self.programs if not p.header(Header.FLAGS) & Flag.AGENT_FRAME]
        if free:
            names = ", ".join(dict.fromkeys(free))
            raise ValueError(
                f"the agent of {names} follows no frame; play the variant +oracle, if there is one"
            )
        self.look("the script")
        self.batch.script()
        actions = self.batch.ports.actions[:: self.seats].copy()
        lacking = np.flatnonzero(actions[:, 0] < 0)
        if len(lacking):
            program = self.programs[self.number(int(lacking[0]))]
            raise ValueError(
                f"the script of {program.name} does what its agent cannot do; expected one of its actions, "
                f"{', '.join(program.actions)}"
            )
        return actions

    def scripts_of(self, seat: int) -> NDArray[np.int64]:
        """The actions of the script on one seat, int64 (E, 3 + slots); nothing changes in the rooms."""
        if seat == 0:
            return self.scripted_actions()
        found = np.zeros((self.rows, self.batch.ports.actions.shape[1]), np.int64)
        played = self.batch.program_numbers()
        for number, program in enumerate(self.programs):
            framed = set(program.table(Header.FRAME_AT)[:, FrameColumn.ENTITY].tolist())
            if program.entities.index(program.seats[seat]) not in framed:
                raise ValueError(
                    f"{program.seats[seat]} of {program.name} follows no frame, so it has no script"
                )
            rows = np.flatnonzero(played == number)
            wish = program.seat_table[seat - 1, SeatColumn.FIRST] + SeatRegister.WISH
            found[rows] = self._encoded(number, self.state.registers[rows, wish : wish + 2])
        return found

    def _encoded(self, number: int, wishes: NDArray[np.int32]) -> NDArray[np.int64]:
        """Bodies and 1 + lines of a program, (N, 2), as actions; what cannot be done or said is left out."""
        part, program = self.merged.parts[number], self.programs[number]
        bodies = np.full(len(TURN_WORDS), len(part.actions) - 1)
        bodies[np.array(part.actions)[::-1]] = np.arange(len(part.actions))[::-1]
        pairs = np.concatenate([[0], program.pairs_said])[wishes[:, 1]]
        return np.concatenate([bodies[wishes[:, :1]], self._spoken_pairs[number][pairs]], axis=1)

    @cached_property
    def _spoken_pairs(self) -> list[NDArray[np.int64]]:
        """For each program the heads behind the first that say a pair, by 1 + its number; silence is 0."""
        sentences = self.merged.playable.sentences
        found = []
        for program, part in zip(self.programs, self.merged.parts, strict=True):
            fillings = program.header(Header.NOUNS)
            table = np.zeros(
                (1 + program.header(Header.TEMPLATES) * fillings, 2 + len(sentences.slots)), np.int64
            )
            for template, choices in sentences.each():
                base, *strides = part.strides[template]
                words = [own[choice] for own, choice in zip(part.slots, choices, strict=True)]
                if part.templates[template] >= 0 and all(
                    word >= 0 for word, stride in zip(words, strides, strict=True) if stride
                ):
                    filling = base + sum(s * w for s, w in zip(strides, words, strict=True) if s)
                    table[1 + part.templates[template] * fillings + filling] = 1, template, *choices
            found.append(table)
        return found

    # --- looking ---

    def look(self, what: str) -> None:
        """Raise ValueError if there is nothing to be seen yet."""
        if not self.all_begun:
            raise too_early(what, self.fresh)

    def start(self, row: int) -> Start:
        """The moment at which a row is, copied."""
        state = self.state
        return Start(state.registers[row].copy(), state.boards[row].copy(), state.keys[row].copy())

    def own_keys(self, keys: NDArray[np.uint64]) -> NDArray[np.uint64]:
        """Keys of another batch that plays the first row's program, uint64 (..., Key.WORDS), as keys of this one.

        Each batch names programs by their place in it.
        """
        keys, named = keys.copy(), [Key.PROGRAM, Key.POOL]
        keys[..., named] = self.state.keys[0, named]
        return keys

    def number(self, row: int) -> int:
        """Which program a row plays in this episode."""
        return self.number_at(self.state.keys.item(row, _PROGRAM))

    def number_at(self, offset: int) -> int:
        """Which program begins at this word of the batch."""
        return self._number_at[offset]

    def program(self, row: int) -> Program:
        """The program that a row plays in this episode."""
        return self.programs[self.number(row)]

    def member(self, row: int) -> str | None:
        """The name of the suite's member that a row plays in this episode; None without a suite."""
        pool = self.pool_of.item(row)
        members = self._called[pool]
        return None if members is None else members[self.number(row) - self.merged.pools[pool][0]]

    def heard(self, player: int) -> list[str]:
        """Lines that a player heard in the last step."""
        row, seat = divmod(player, self.seats)
        program, registers = self.program(row), self.state.registers[row]
        count, first = heard_at(program, seat)
        return [program.lines[line] for line in registers[first : first + int(registers[count])]]

    def history(self, player: int) -> list[str]:
        """Lines that a player heard since the reset, as far as they are kept."""
        row, seat = divmod(player, self.seats)
        return history(self.program(row), self.state.registers[row], seat)

    def set_taken(self, taken: NDArray[np.bool_]) -> None:
        """Say on which seats players sit from the next step on, bool (E S,).

        Raises:
            ValueError: they are not that many truth values, or an agent's seat would be empty.
        """
        given = np.asarray(taken)
        if given.shape != (self.players,) or given.dtype != np.bool_:
            raise ValueError(
                f"taken: got {given.dtype} of shape {given.shape}; expected {self.players} booleans"
            )
        if not given[:: self.seats].all():
            raise ValueError("taken: got False for an agent's seat, which is always taken; expected True")
        self.batch.ports.taken[:] = given

    def describe(self, row: int) -> dict[str, Any]:
        """The state of a row in the scenario's own names; a superset of a layout."""
        self.look("describe")
        row = whole_number("index", row, 0, self.rows - 1)
        member = self.member(row)
        described = describe(self.program(row), self.state.registers[row])
        if member is None:
            return described
        spoiled = {"spoiled": True} if self.state.keys[row, Key.SPOILED] else {}
        return {"member": member, **spoiled, **described}

    def cells(self, row: int) -> NDArray[np.uint8]:
        """The canvas as it looks without the agent, uint8 (H, W, 4)."""
        program = self.program(row)
        width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
        return self.state.boards[row, : width * height].copy().view(np.uint8).reshape(height, width, 4)

    def member_at(self, row: int, seat: int) -> int:
        """The number of the member of the cast that has a seat, as an entity; the agent's is 0."""
        return int(self.program(row).seat_table[seat - 1, SeatColumn.ENTITY]) if seat else 0

    def room(self, row: int) -> tuple[int, int]:
        """Width and height of the room."""
        registers = self.state.registers[row]
        return int(registers[Register.WIDTH]), int(registers[Register.HEIGHT])

    # --- numbers for a learner ---

    def utterance_ids(self) -> NDArray[np.int64]:
        """A number for what each player heard in the last step, int64 (E S,); 0 for silence."""
        ids = np.zeros(self.players, np.uint64)
        for number, k, players, said in self._spoken():
            lines = self._texts[number][said] + np.uint64(1)
            ids[players] = (ids[players] + lines + np.uint64(number << 32)) * np.uint64(_MULTIPLIERS[k])
        return ids.view(np.int64)

    @cached_property
    def lines(self) -> tuple[str, ...]:
        """The texts of all lines that can be heard in any program, each once."""
        return tuple(dict.fromkeys(line for program in self.programs for line in program.lines))

    @cached_property
    def _line_parts(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Of each program the speaker of each line, and the index of its text in `lines`."""
        index = {line: number for number, line in enumerate(self.lines)}
        return [
            (
                np.array(program.line_speakers, np.int64),
                np.array([index[line] for line in program.lines], np.int64),
            )
            for program in self.programs
        ]

    def heard_lines(self) -> HeardLines:
        """Who said what in the last step, as far as each player heard it."""
        most = max(program.header(Header.HEARD_SIZE) for program in self.programs)
        speakers, lines = (np.full((self.players, most), -1, np.int64) for _ in range(2))
        for number, k, players, said in self._spoken():
            speaker_of, text_of = self._line_parts[number]
            speakers[players, k], lines[players, k] = speaker_of[said], text_of[said]
        return HeardLines(speakers, lines)

    def frame_states(self) -> NDArray[np.int64]:
        """The state, or the entry of `steps`, that each frame of each row is in, by number, int64 (E, F); -1 none."""
        most = max(program.header(Header.FRAMES) for program in self.programs)
        found = np.full((self.rows, most), -1, np.int64)
        played = self.batch.program_numbers()
        for number, program in enumerate(self.programs):
            rows = np.flatnonzero(played == number)
            registers = program.table(Header.FRAME_AT)[:, FrameColumn.STATE]
            found[rows, : len(registers)] = self.state.registers[rows[:, None], registers]
        return found

    def _spoken(self) -> Iterator[tuple[int, int, NDArray[np.int64], NDArray[np.int32]]]:
        """The lines heard in the last step: program, position, the players who heard one there, its number for each."""
        registers, played = self.state.registers, self.batch.program_numbers()
        for number, program in enumerate(self.programs):
            rows = np.flatnonzero(played == number)
            for seat in range(self.seats):
                count, first = heard_at(program, seat)
                for k in range(program.header(Header.HEARD_SIZE)):
                    those = rows[registers[rows, count] > k]
                    yield number, k, those * self.seats + seat, registers[those, first + k]

    def history_ids(self) -> NDArray[np.int64]:
        """A number for all that each player heard since the reset, int64 (E S,); 0 for nothing."""
        of_seats = [Key.DIGEST, *range(Key.WORDS, Key.WORDS + self.seats - 1)]
        ids = self.state.keys[:, of_seats]
        if len(self.programs) > 1:
            # Lines are numbered by program, so equal numbers of two programs may be different texts.
            marks = np.array([mix(number * GOLDEN) & MASK for number in range(len(self.programs))], np.uint64)
            ids = np.where(ids != 0, ids ^ marks[self.batch.program_numbers()][:, None], ids)
        return ids.reshape(-1).view(np.int64)

    def image_ids(self) -> NDArray[np.int64]:
        """A number for the picture of each player, int64 (E S,)."""
        return self.batch.identify()

    def counters(self) -> dict[str, Any]:
        """How often each outcome and each rule happened since the environments were made, and episodes ended.

        With several programs, names are preceded by the member's or scenario's: `dance: timeout`.
        """
        totals = self.batch.counters
        counted: dict[str, Any] = {"outcomes": {}, "rules": {}, "episodes": 0}
        alone = isinstance(self.merged.playable, Program)
        for member, program, first in zip(
            self.merged.members, self.programs, self.batch.first_counters, strict=True
        ):
            numbers = totals[first : first + program.header(Header.COUNTERS)].tolist()
            rules = len(program.rules)
            for kind, names, counts in (
                ("rules", program.rules, numbers),
                ("outcomes", program.outcomes, numbers[rules:]),
            ):
                for name, number in zip(names, counts, strict=False):
                    counted[kind][name if alone else prefixed(member, name)] = number
            counted["episodes"] += numbers[-1]
        return counted

    # --- saving ---

    def snapshot(self) -> bytes:
        """The exact state of all rows, randomness included."""
        self.look("snapshot")
        return snapshot.pack(self._arrays(), self._identity())

    def restore(self, data: bytes) -> None:
        """Put a snapshot of the same programs and number of rows back. Raises ValueError, and changes nothing, else."""
        arrays = self._arrays()
        read = {name: np.empty_like(array) for name, array in arrays.items()}
        snapshot.unpack(data, read, self._identity())
        self._check(read)
        for name, array in read.items():
            arrays[name][...] = array
        self.fresh = np.zeros(self.rows, np.bool_)
        self.all_begun = True
        if self.batch.more:
            self.image[...] = joined(self.state.image, self.state.extra, self.channels)

    def _check(self, read: Mapping[str, NDArray[Any]]) -> None:
        """The engine trusts its state, so what comes from outside must be a state that it can be in."""
        played = self._played(read["keys"])
        self._check_weights(read["weights"])
        if read["tokens"].min(initial=0) < 0 or read["tokens"].max(initial=0) >= len(self.merged.vocabulary):
            raise ValueError("the snapshot is damaged: a token is outside the vocabulary")
        for number, program in enumerate(self.programs):
            wrong = first_unsound(program, read["registers"][played == number])
            if wrong:
                raise ValueError(f"the snapshot is damaged: {wrong}")

    def _check_weights(self, summed: NDArray[np.int64]) -> None:
        """Whether the weights of every pool, added up, are ones that can be drawn by."""
        start = 0
        for pool in self.merged.pools:
            own = summed[start : start + len(pool)]
            if own[0] < 0 or (np.diff(own) < 0).any() or not 1 <= own[-1] < 1 << 32:
                raise ValueError("the snapshot is damaged: members cannot be drawn by its weights")
            start += len(pool)

    def _played(self, keys: NDArray[np.uint64]) -> NDArray[np.intp]:
        """Which program each row plays by keys from outside, (E,)."""
        numbers = [self._number_at.get(offset, -1) for offset in keys[:, Key.PROGRAM].tolist()]
        allowed = all(
            number in self.merged.pools[pool]
            for number, pool in zip(numbers, self.pool_of.tolist(), strict=True)
        )
        if not allowed or not np.array_equal(keys[:, Key.POOL], self.state.keys[:, Key.POOL]):
            raise ValueError("the snapshot is damaged: rows play other programs")
        return np.array(numbers)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        return {
            **self.state._asdict(),
            "counters": self.batch.counters,
            "weights": self.batch.tables.weights,
        }

    def _identity(self) -> dict[str, Any]:
        return {"programs": [program.sha256 for program in self.programs], "rows": self.rows}
