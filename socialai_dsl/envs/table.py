"""The batch of environments behind single and vector environments."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.draws import GOLDEN, MASK, MAX_SEED, TEST_DOMAIN, below, draw, episode_key, mix, site
from socialai_dsl.engine.batch import Batch
from socialai_dsl.engine.calls import BAD_ACTION, Task
from socialai_dsl.engine.state import PIN_NONE, Key
from socialai_dsl.envs import snapshot
from socialai_dsl.envs.audit import first_unsound
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.describe import describe, history
from socialai_dsl.envs.layout import pins_of
from socialai_dsl.envs.merge import CommonSpace
from socialai_dsl.envs.starts import Starts
from socialai_dsl.envs.values import word
from socialai_dsl.program import FIRST_ENTITY, LOOKS, VIEW, Field, Flag, Header, Program, Register
from socialai_dsl.program_suite import Playable, ProgramSuite, prefixed

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
OPTIONS = ("index", "layout", "reset_mask", "test_episode")


def check_options(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options of a reset. Raises ValueError for one that does not exist."""
    options = dict(options or {})
    for name in options:
        if name not in OPTIONS:
            raise ValueError(f"options: got {name!r}; expected some of {', '.join(OPTIONS)}")
    return options


def choose_episodes(
    keys: NDArray[np.uint64], chosen: NDArray[np.bool_], seed: Any, options: Mapping[str, Any], fresh: bool
) -> None:
    """Set seed, index and episode in the rows, uint64 (E, Key.WORDS), that are chosen, bool (E,).

    `test_episode` names episodes of a domain of keys that no seed reaches; 0 to 499 are the fixed test set.
    One seed gives environment i (seed, i); a list gives it (seeds[i], 0); both start at episode 0. Without a seed the
    next episode follows, or, in a fresh batch, a seed is drawn from the operating system.
    """
    rows = np.flatnonzero(chosen)
    if options.get("test_episode") is not None:
        episodes = _each("options['test_episode']", options["test_episode"], len(keys), LAST_EPISODE)
        keys[rows, Key.SEED], keys[rows, Key.INDEX] = TEST_DOMAIN, 0
        keys[rows, Key.EPISODE] = episodes[rows]
        return
    if seed is None and not fresh:
        keys[rows, Key.EPISODE] += np.uint64(1)
        return
    keys[rows, Key.EPISODE] = 0
    if seed is None:
        seed = secrets.randbelow(MAX_SEED + 1)
    keys[rows, Key.SEED] = _each("seed", seed, len(keys), MAX_SEED)[rows]
    one_for_all = isinstance(seed, int | np.integer)
    keys[rows, Key.INDEX] = rows if one_for_all else 0
    if options.get("index") is not None:
        keys[rows, Key.INDEX] = _each("options['index']", options["index"], len(keys), MAX_SEED)[rows]


def _each(what: str, given: Any, count: int, highest: int) -> NDArray[np.uint64]:
    """One number for each environment, from one for all or a list."""
    numbers = [given] * count if isinstance(given, int | np.integer) else given
    if not isinstance(numbers, Sequence | np.ndarray) or len(numbers) != count:
        raise ValueError(f"{what}: got {given!r}; expected a whole number or a list of {count}")
    for number in numbers:
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number <= highest:
            raise ValueError(f"{what}: got {number!r}; expected a whole number from 0 to {highest}")
    return np.array([int(number) for number in numbers], np.uint64)


# -- the batch -----------------------------------------------------------------------------------------------


_PROGRAM = int(Key.PROGRAM)  # members of an enumeration are slow indices

# Odd multipliers, one for each line heard at once.
_MULTIPLIERS = np.array([mix(k * GOLDEN) | 1 for k in range(1, 65)], np.uint64)


def _numbers_of_texts(lines: Sequence[str]) -> NDArray[np.uint64]:
    """A number for the text of each line, uint64 (lines,): several lines may say the same."""
    first = {text: number for number, text in reversed(list(enumerate(lines)))}
    return np.array([first[text] for text in lines], np.uint64)


class Start(NamedTuple):
    """A moment of an environment: registers, int16 (R,), board, uint32 (C,), key, uint64 (Key.WORDS,)."""

    registers: NDArray[np.int16]
    board: NDArray[np.uint32]
    key: NDArray[np.uint64]


class Table(Copied):
    """Rows of environments: row i plays `playables[i modulo their number]`, of a suite one member each episode.

    Attributes:
        image: uint8 (E, 7, 7, channels), tokens: int16 (E, L): buffers that every call writes to.
    """

    def __init__(self, playables: Sequence[Playable], rows: int) -> None:
        different = list({id(playable): playable for playable in playables}.values())
        self.merged = CommonSpace.of(different)
        self.programs = self.merged.programs
        number = {id(playable): i for i, playable in enumerate(different)}
        self.pool_of = np.array([number[id(playables[row % len(playables)])] for row in range(rows)])
        self._plays_acts = [isinstance(p, ProgramSuite) and p.in_sequence for p in different]
        self.batch = Batch(
            self.merged.parts,
            self.merged.pools,
            self.pool_of.tolist(),
            self.merged.length,
            [number for number, in_acts in enumerate(self._plays_acts) if in_acts],
        )
        self.rows = rows
        self.channels = len(self.merged.channels)
        self._find_buffers()
        self.fresh = True
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
        self.image, self.tokens = in_bytes(picture, self.channels), self.state.tokens

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
        given = check_options(options)
        chosen = self._mask(given.get("reset_mask"))
        keys = self.state.keys.copy()
        choose_episodes(keys, chosen, seed, given, self.fresh)
        layout: Any = given.get("layout")
        pins, rows = self._pins(layout, keys, chosen)
        # Nothing has changed so far, should something be wrong with what was given.
        self.state.keys[:] = keys
        self.fresh = False
        ports = self.batch.ports
        ports.chosen[:] = chosen
        ports.layout[:] = rows
        self.batch.reset(pins)
        for row in np.flatnonzero(chosen & (rows != 0)).tolist():
            own = layout if isinstance(layout, Mapping) else layout[row]
            # Whether the layout is of an act after one that was no success.
            self.state.keys[row, Key.SPOILED] = self._plays_acts[self.pool_of[row]] and bool(
                own.get("spoiled")
            )
        if self._starts:
            self._begin(chosen & (rows == 0))

    def step(self, task: Task, actions: Any) -> int:
        """Step all rows, int64 (E, 3 + slots); how many episodes ended. Raises ValueError for a bad action."""
        if self.fresh:
            raise ValueError("step: got a call before the first reset(); expected reset() first")
        given = np.asarray(actions)
        expected = self.batch.ports.actions.shape
        if given.shape != expected or given.dtype.kind not in "iu":
            raise ValueError(
                f"step: got actions of shape {given.shape} and type {given.dtype}; expected integers {expected}"
            )
        ended = self.play(task, given)
        if ended == BAD_ACTION:
            space = self.merged.action_space()
            row = next(i for i, action in enumerate(given) if not space.contains(action.astype(space.dtype)))
            raise ValueError(
                f"step: got the action {given[row].tolist()} in row {row}; expected one of {space}"
            )
        return ended

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
    ) -> tuple[NDArray[np.int16] | None, NDArray[np.int32]]:
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
        pins = [np.full(width, PIN_NONE, np.int16)]
        known: dict[tuple[int, int, int], int] = {}
        for i in np.flatnonzero(chosen).tolist():
            if layouts[i] is None:
                continue
            pool = int(self.pool_of[i])
            place = self._place_in_pool(layouts[i], pool, keys[i])
            key = id(layouts[i]), pool, place
            if key not in known:
                known[key] = len(pins)
                row = np.full(width, PIN_NONE, np.int16)
                program = self.programs[self.merged.pools[pool][place]]
                given = pins_of(program, layouts[i], in_suite=self._called[pool] is not None)
                row[: len(given)] = given
                row[-1] = place
                pins.append(row)
            rows[i] = known[key]
        return np.stack(pins), rows

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
        self.batch.set_weights(0, weights)

    def scripted_actions(self) -> NDArray[np.int64]:
        """The actions of the agents' scripts, int64 (E, 3 + slots); nothing changes."""
        free = [p.name for p in self.programs if not p.header(Header.FLAGS) & Flag.AGENT_FRAME]
        if free:
            names = ", ".join(dict.fromkeys(free))
            raise ValueError(
                f"the agent of {names} follows no frame; play the variant +oracle, if there is one"
            )
        self.batch.script()
        return self.batch.ports.actions.copy()

    # --- looking ---

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

    def heard(self, row: int) -> list[str]:
        """Lines heard in the last step."""
        program, registers = self.program(row), self.state.registers[row]
        first = program.header(Header.HEARD)
        return [program.lines[line] for line in registers[first : first + int(registers[Register.HEARD])]]

    def history(self, row: int) -> list[str]:
        """Lines heard since the reset, as far as they are kept."""
        return history(self.program(row), self.state.registers[row])

    def describe(self, row: int) -> dict[str, Any]:
        """The state of a row in the scenario's own names; a superset of a layout."""
        member = self.member(row)
        described = describe(self.program(row), self.state.registers[row])
        if member is None:
            return described
        spoiled = {"spoiled": True} if self.state.keys[row, Key.SPOILED] else {}
        return {"member": member, **spoiled, **described}

    def cells(self, row: int) -> tuple[NDArray[np.uint8], tuple[int, int, int]]:
        """The canvas as it looks, uint8 (H, W, 4), and the agent's x, y, direction."""
        program, registers = self.program(row), self.state.registers[row]
        width, height = program.header(Header.CANVAS_WIDTH), program.header(Header.CANVAS_HEIGHT)
        codes = self.state.boards[row, : width * height].copy().view(np.uint8).reshape(height, width, 4)
        pose = (int(registers[FIRST_ENTITY + field]) for field in (Field.X, Field.Y, Field.DIR))
        return codes, tuple(pose)  # type: ignore[return-value]

    def room(self, row: int) -> tuple[int, int]:
        """Width and height of the room."""
        registers = self.state.registers[row]
        return int(registers[Register.WIDTH]), int(registers[Register.HEIGHT])

    # --- numbers for a learner ---

    def utterance_ids(self) -> NDArray[np.int64]:
        """A number for what was heard in the last step, int64 (E,); 0 for silence."""
        registers, played = self.state.registers, self.batch.program_numbers()
        ids = np.zeros(self.rows, np.uint64)
        for number, program in enumerate(self.programs):
            first = program.header(Header.HEARD)
            heard = registers[:, Register.HEARD]
            for k in range(program.header(Header.HEARD_SIZE)):
                rows = np.flatnonzero((played == number) & (heard > k))
                lines = self._texts[number][registers[rows, first + k]] + np.uint64(1)
                ids[rows] = (ids[rows] + lines + np.uint64(number << 32)) * np.uint64(_MULTIPLIERS[k])
        return ids.view(np.int64)

    def history_ids(self) -> NDArray[np.int64]:
        """A number for all that was heard since the reset, int64 (E,); 0 for nothing."""
        ids = self.state.keys[:, Key.DIGEST].copy()
        if len(self.programs) > 1:
            # Lines are numbered by program, so equal numbers of two programs may be different texts.
            marks = np.array([mix(number * GOLDEN) & MASK for number in range(len(self.programs))], np.uint64)
            ids[ids != 0] ^= marks[self.batch.program_numbers()][ids != 0]
        return ids.view(np.int64)

    def image_ids(self) -> NDArray[np.int64]:
        """A number for the picture, int64 (E,)."""
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
        return snapshot.pack(self._arrays(), self._identity())

    def restore(self, data: bytes) -> None:
        """Put a snapshot of the same programs and number of rows back. Raises ValueError, and changes nothing, else."""
        arrays = self._arrays()
        read = {name: np.empty_like(array) for name, array in arrays.items()}
        snapshot.unpack(data, read, self._identity())
        self._check(read)
        for name, array in read.items():
            arrays[name][...] = array
        self.fresh = False
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
