"""Batches of environments as a Gymnasium vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from socialai_dsl.diagnostics import suggested
from socialai_dsl.engine.calls import Task
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.options import check_render_mode
from socialai_dsl.envs.picture import frame
from socialai_dsl.envs.seats import Company, Partner, Seating, Seats
from socialai_dsl.envs.table import HeardLines, Table, joined
from socialai_dsl.envs.values import whole_number
from socialai_dsl.program import Program
from socialai_dsl.program_suite import Playable


def _is_agents(seating: Seating) -> bool:
    return isinstance(seating, str) and seating == "agent"


_TASKS = {
    AutoresetMode.NEXT_STEP: Task.STEP_NEXT,
    AutoresetMode.SAME_STEP: Task.STEP_SAME,
    AutoresetMode.DISABLED: Task.STEP_ONLY,
}
_MODES = {mode.value.lower(): mode for mode in AutoresetMode}

Observation = dict[str, NDArray[Any]]
AGENT: Final = "agent"


class ScenarioVectorEnv(Copied, VectorEnv[Observation, NDArray[np.int64], NDArray[Any]]):
    """A batch of E environments of one scenario or suite, or of several in turn.

    **Observation.** `image`, uint8 (E, 7, 7, C): `image[e, i, j]` counts i from the agent's left to its right and j
    from far to near, the agent itself is at `[e, 3, 6]`, and the channels are type, colour, status, orientation, and
    where a scenario shows gestures or hands more. `tokens`, int16 (E, L): the words heard since the reset, oldest
    first, as indices into `vocabulary`; 0 pads, 1 is an unknown word.

    **Action.** int64 (E, 3 + slots): body action (the last one is no movement), speak (1) or not (0), template,
    then a word for each slot of the grammar; in most grammars the noun is the one slot. Template and slots count only
    where the agent speaks, a slot only where the template has it.

    **Infos.** Empty, except in a step that ends an episode: `success` bool (E,), `outcome` int (E,), an index into
    `outcomes`, and the masks `_success` and `_outcome`, bool (E,), of the episodes that ended. In same-step mode also
    `final_obs`, arrays as in an observation, and `final_info`, with their masks.

    `socialai_dsl.make_vec` makes one from names.

    Args:
        playables: at least one program or suite of programs; environment i plays number i modulo their number. Every
            episode of a suite plays one member, drawn anew.
        num_envs: E, at least 1.
        num_threads: 1; to use more cores run more processes.
        autoreset_mode: `NextStep`, `SameStep` or `Disabled`, as in Gymnasium. With `Disabled` the caller restarts
            environments by `reset(options={"reset_mask": ...})`.
        copy: False returns the engine's own buffers, also in infos. They are valid until the next call, which writes
            only what changed.
        render_mode: `rgb_array` or `ansi`; `render()` then returns one picture for each environment.
        seats: `agent`: actions are those of the agents, and other members of the cast with a seat follow their frames.
            `all`: each of the `num_envs` games has a row for each of its S seats, one behind the other, so that there
            are E = `num_envs` S rows with an observation, an action, a reward and a success each; `seat` says which.
            An episode begins and ends in all rows of a game at once; seeds and options of `reset` are those of games.
            A mapping, `{"helper": "script"}`: who fills the seats of members of the cast: `script`, its frame (a
            member without one stays); `random`; a policy with `reset(mask)` and `act(observation)`; or a list of K of
            these, of which number g modulo K sits there in game g. Actions are those of the seats that it gives to
            `caller`, or if there is none, of the first one that it does not name; all others follow their frames.

    Attributes:
        seat: int64 (E,), the number of the seat that a row plays, 0 the agent's.
        num_games: how many games are played.

    Raises:
        ValueError: an argument is not what was expected.
    """

    def __init__(
        self,
        playables: Sequence[Playable],
        num_envs: int,
        num_threads: int = 1,
        autoreset_mode: str | AutoresetMode = "NextStep",
        copy: bool = True,
        render_mode: str | None = None,
        seats: Seating = "agent",
    ) -> None:
        if not playables:
            raise ValueError("scenarios: got none; expected at least one")
        for what, number in (("num_envs", num_envs), ("num_threads", num_threads)):
            if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
                raise ValueError(f"{what}: got {number!r}; expected a whole number, at least 1")
        if num_threads != 1:
            raise ValueError(
                f"num_threads: got {num_threads}; expected 1: to use more cores run more processes"
            )
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else str(autoreset_mode)
        if mode.lower() not in _MODES:
            near = suggested(mode, [known.value for known in AutoresetMode], quoted=repr)
            raise ValueError(
                f"autoreset_mode: got {autoreset_mode!r}; expected NextStep, SameStep or Disabled{near}"
            )
        if not isinstance(copy, bool):
            raise ValueError(f"copy: got {copy!r}; expected True or False")
        for playable in playables:
            if not isinstance(playable, Playable):
                raise ValueError(f"playables: got {playable!r}; expected what `compile` returns")
        self.autoreset_mode = _MODES[mode.lower()]
        self.metadata = {
            "render_modes": ["rgb_array", "ansi"],
            "autoreset_mode": self.autoreset_mode,
            "render_fps": 4,
        }
        self._task = _TASKS[self.autoreset_mode]
        self._table = Table(playables, int(num_envs), all_seats=not _is_agents(seats))
        self._seats = Seats.of(seats, self._table.programs)
        self._own = self._seats.rows(self._table.rows)
        self._company = Company(self._seats, self._table) if self._seats.partners else None
        self._copy = copy
        self.num_games = int(num_envs)
        self._players = np.arange(self._table.players)[self._own].tolist()
        self.seat = np.array(self._players) % self._table.seats
        self.num_envs = len(self.seat)
        self.render_mode = check_render_mode(render_mode, self.metadata["render_modes"])
        self.single_observation_space = self._table.merged.observation_space()
        self.single_action_space = self._table.merged.action_space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def programs(self) -> tuple[Program, ...]:
        """The programs that are played; of a suite, those of its members."""
        return self._table.programs

    @property
    def program(self) -> Playable:
        """The program or suite that is played; for several scenarios, a suite of them."""
        return self._table.merged.playable

    @property
    def outcomes(self) -> list[str]:
        """The names that `infos["outcome"]` indexes, equal to `program.outcomes`."""
        return self.program.outcomes

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The words that `tokens` indexes, equal to `program.vocabulary`."""
        return self._table.merged.vocabulary

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes.

        Options:

        * `reset_mask`, bool (E,): the environments that restart; without it all of them.
        * `test_episode`, an int or a list of E, without a seed: plays these episodes of a domain that no seed reaches;
          0 to 499 are the fixed test set.
        * `layout`, a mapping or a list of E with None for a drawn room: starts from a known room.
        * `index`, an int or a list of E, with a seed: plays as environment `index` of a batch with this seed.

        Args:
            seed: one number s gives environment i the stream (s, i); a list of E gives it (seeds[i], 0). Both begin
                with episode 0. Without a seed every environment plays its next episode, as do those for which the list
                has None; the first reset then draws seeds from the operating system.
            options: any of those above.

        Returns:
            The observation and empty infos.

        Raises:
            ValueError: a seed, an option or a layout is not what was expected, or says nothing beside another.
            RuntimeError: 64 drawn rooms in a row violate the scenario's `require`.
        """
        before = None if self._company is None else self._company.playing.copy()
        self._table.reset(seed, options)
        if isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
        if self._company is not None and before is not None:
            self._company.begin(self._table.batch.ports.chosen.copy(), before)
        return self._observation(), {}

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step every environment once.

        Args:
            actions: integers (E, heads).

        Returns:
            Observation, rewards float64 (E,), terminations bool (E,), truncations bool (E,), infos. An outcome
            terminates an episode; the scenario's horizon truncates it.

        Raises:
            ValueError: there was no reset yet, or an action is outside the space.
        """
        ended = self._step(actions)
        ports = self._table.batch.ports
        infos = self._infos() if ended else {}
        reward = self._given(ports.reward)
        terminated, truncated = self._for_players(ports.terminated), self._for_players(ports.truncated)
        return self._observation(), reward, terminated, truncated, infos

    def _step(self, actions: NDArray[np.int64]) -> int:
        """Step all games; how many episodes ended."""
        if self._company is None:
            return self._table.step(self._task, actions)
        self._table.look("step")
        own = self._table.own_actions(actions, self.num_envs)
        before = self._company.playing.copy()
        ended = self._table.step(self._task, self._company.act(own))
        self._company.begin((self._company.playing != before).any(1), before)
        return ended

    def _observation(self) -> Observation:
        return {"image": self._given(self._table.image), "tokens": self._given(self._table.tokens)}

    def _given(self, of_players: NDArray[Any]) -> NDArray[Any]:
        """What belongs to the caller of what each player has."""
        own = of_players if self._seats.all_own else of_players[self._own]
        return own.copy() if self._copy else own

    def _for_players(self, of_games: NDArray[Any]) -> NDArray[Any]:
        """What is so in each game, for each row."""
        if len(self._seats.own) > 1:
            return np.repeat(of_games, len(self._seats.own))
        return of_games.copy() if self._copy else of_games

    def _infos(self) -> dict[str, Any]:
        ports = self._table.batch.ports
        ended, outcome = self._for_players(ports.ended), self._for_players(ports.outcome)
        success = self._given(ports.success)
        infos: dict[str, Any] = {
            "success": success,
            "_success": ended,
            "outcome": outcome,
            "_outcome": ended,
        }
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            image = joined(ports.final_image, ports.final_extra, self._table.channels)
            tokens = ports.final_tokens.reshape(self._table.players, -1)
            final: Observation = {"image": image[self._own], "tokens": tokens[self._own]}
            infos["final_info"], infos["_final_info"] = dict(infos), ended
            infos["final_obs"] = {k: v.copy() for k, v in final.items()} if self._copy else final
            infos["_final_obs"] = ended
        return infos

    # --- strings, made only when asked for ---

    def utterances(self) -> list[str]:
        """What each environment's agent heard in the last step: one line for each speaker, "NA" in silence."""
        return ["\n".join(self._table.heard(player)) or "NA" for player in self._players]

    def histories(self) -> list[str]:
        """What each environment's agent heard since the reset: the lines that the token buffer still holds."""
        return ["\n".join(self._table.history(player)) for player in self._players]

    def members(self) -> list[str | None]:
        """The name of the suite's member that each environment plays in this episode; None without a suite."""
        return [self._table.member(player // self._table.seats) for player in self._players]

    def member_ids(self) -> NDArray[np.int64]:
        """The index into `program.members` of what each environment plays now, int64 (E,); 0 without a suite."""
        return self._for_players(self._table.batch.program_numbers().astype(np.int64))

    def set_member_weights(self, weights: Sequence[int]) -> None:
        """Draw the members of the suite, or the leaves of its tree, in proportion to these weights in later episodes.

        Args:
            weights: a whole number of at least 0 for each of `program.members`, not all 0.

        Raises:
            ValueError: the weights are not right, or the environments play no suite that draws members.
        """
        self._table.set_member_weights(weights)

    def describe(self, index: int) -> dict[str, Any]:
        """The state of environment `index` in the scenario's own names, as a layout that `reset` accepts."""
        player = whole_number("index", index, 0, self.num_envs - 1)
        return self._table.describe(self._players[player] // self._table.seats)

    def set_taken(self, taken: NDArray[np.bool_]) -> None:
        """Say on which seats players sit from the next step on, also after resets; initially on all. For `seats="all"`.

        While nobody sits on a seat its member follows its frame, or stays, and its actions count for nothing.

        Args:
            taken: bool (E,); an agent's seat is always taken.

        Raises:
            ValueError: it is something else, or not all seats are the caller's.
        """
        if self._company is not None or len(self._seats.names) == 1:
            raise ValueError(
                f"set_taken: got a call for {', '.join(self.seat_names)} alone; expected seats='all'"
            )
        self._table.set_taken(taken)

    # --- numbers for a learner ---

    def utterance_ids(self) -> NDArray[np.int64]:
        """An id of what was heard in the last step, int64 (E,): equal for equal texts, 0 for silence."""
        return self._table.utterance_ids()[self._own]

    @property
    def lines(self) -> tuple[str, ...]:
        """The texts of all lines that can be heard, each once, which `heard_lines` indexes."""
        return self._table.lines

    def heard_lines(self) -> HeardLines:
        """Who said what in the last step, as far as the agents heard it.

        Returns:
            `speakers`, int64 (E, K): 0 the agent itself, 1 the first of the others in the order of the cast, and so on.
            `lines`, int64 (E, K): indices into `lines`. Both in the order spoken, -1 behind the last; K is the most
            that can be heard in one step. In same-step mode, a step that ends an episode leaves nothing heard.
        """
        heard = self._table.heard_lines()
        return HeardLines(heard.speakers[self._own], heard.lines[self._own])

    def frame_states(self) -> NDArray[np.int64]:
        """The state, or the entry of `steps`, that each frame of a game is in now.

        Returns:
            Their numbers in the order of the file, int64 (G, F): a row for each game, which has a frame for each member
            of the cast that follows one, in the order of the cast; -1 behind the last.
        """
        return self._table.frame_states()

    def history_ids(self) -> NDArray[np.int64]:
        """An id of all that was heard since the reset, int64 (E,): equal for equal histories, 0 for none."""
        return self._table.history_ids()[self._own]

    def image_ids(self) -> NDArray[np.int64]:
        """An id of the image, int64 (E,): equal for equal images."""
        return self._table.image_ids()[self._own]

    @property
    def seat_names(self) -> tuple[str, ...]:
        """The members of the cast that the caller plays, in the order of the rows of a game."""
        return tuple(self._seats.names[number] for number in self._seats.own)

    @property
    def partners(self) -> dict[str, Partner]:
        """The policies on other seats than the caller's, as `helper.0`: the seat, and their place in its list."""
        return {} if self._company is None else self._company.policies

    def scripted_actions(self, seat: str | None = None) -> NDArray[np.int64]:
        """The actions of the scenario's own scripts for the members that are played, int64 (E, 3 + slots).

        The agent's is what its frame would do now; that of another member what its frame chose in its last turn, while
        a player had its body and voice. Nothing changes.

        Args:
            seat: `agent`, with all seats: the agent's alone, int64 (games, 3 + slots).

        Raises:
            ValueError: one of the members follows no frame.
        """
        if seat not in (AGENT, None):
            raise ValueError(f"seat: got {seat!r}; expected {AGENT!r} or none")
        played = (0,) if seat == AGENT else self._seats.own
        found = [self._table.scripts_of(number) for number in played]
        return np.stack(found, axis=1).reshape(-1, found[0].shape[-1])

    def counters(self) -> dict[str, Any]:
        """Counts since the environments were made.

        Returns:
            The keys are `outcomes` and `rules`, which map names to counts, and `episodes`, the number that have ended.
        """
        return self._table.counters()

    def bytes_per_env(self) -> dict[str, int]:
        """Bytes that one environment takes, under the keys `state`, `observation` and `call` (in and out of a step)."""
        state, ports = self._table.batch.state, self._table.batch.ports
        arrays = {
            "state": (state.registers, state.boards, state.keys),
            "observation": (self._table.image, self._table.tokens),
            "call": (
                *(ports.actions, ports.reward, ports.terminated, ports.truncated),
                *(ports.ended, ports.outcome, ports.success),
            ),
        }
        return {name: sum(a.nbytes for a in parts) // self.num_envs for name, parts in arrays.items()}

    def snapshot(self) -> bytes:
        """The exact state of all environments as bytes, randomness included.

        What policies on other seats remember is not part of it; a copy of the environments has that, too.
        """
        return self._table.snapshot()

    def restore(self, data: bytes) -> None:
        """Return to a snapshot.

        Raises:
            ValueError: it is damaged, or of other scenarios or another number of environments.
        """
        self._table.restore(data)

    def render(self) -> tuple[Any, ...] | None:
        """One picture for each environment: uint8 (H, W, 3) or text, by `render_mode`; None without one.

        Raises:
            ValueError: there was no reset yet.
        """
        if self.render_mode is None:
            return None
        self._table.look("render")
        return tuple(
            frame(self._table, player // self._table.seats, self.render_mode) for player in self._players
        )

    def set_attr(self, name: str, values: Mapping[str, Any] | Any) -> None:
        """Environments of a batch have no attributes of their own."""
        raise ValueError(f"set_attr: got {name!r}; environments of a batch have no attributes of their own")
