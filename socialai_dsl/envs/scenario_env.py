"""The single Gymnasium environment, and the encoding of actions that are written in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from socialai_dsl.diagnostics import suggested
from socialai_dsl.draws import MAX_SEED
from socialai_dsl.engine.calls import BAD_ACTION, TRUNCATED, Task
from socialai_dsl.engine.state import Key
from socialai_dsl.envs.copying import Copied
from socialai_dsl.envs.explain import Explainer, Recording
from socialai_dsl.envs.options import check_render_mode
from socialai_dsl.envs.picture import Scene, cast_of, coloured_text, frame, looks_of_npcs, plain_text, scene
from socialai_dsl.envs.seats import Company, SeatMoment, Seats, require_seat
from socialai_dsl.envs.table import Table, heard_at
from socialai_dsl.envs.values import whole_number
from socialai_dsl.envs.view import View
from socialai_dsl.program import (
    ENTITY_FIELDS,
    FIRST_ENTITY,
    LOOKS,
    VIEW,
    EntityName,
    Field,
    Flag,
    Header,
    Register,
)
from socialai_dsl.program_suite import Playable, ProgramSuite, words_of_looks
from socialai_dsl.render.panel import Face
from socialai_dsl.render.tiles import Code
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.vocabulary import TURN_WORDS, Sentences, Slot

Live = tuple[frozenset[int], ...]
"""Indices of templates, and of the words of each slot, that are meant where a word stands for several."""


def encode_action(
    action: Sequence[Any], actions: Sequence[str], sentences: Sentences, live: Live | None = None
) -> NDArray[np.int64]:
    """The action of the space, int64 (3 + slots,), for the paper's notation or words.

    `(1, None, None)` turns right, `(None, 1, 5)` says template 1 with noun 5 and stays, `("forward", "Open sesame")`
    does both. Of a grammar with several slots there is a part for each: `(None, "Give <what> to <whom>", 0, "Ann")`.

    Args:
        action: what is meant.
        actions: words for body actions.
        sentences: what can be said.
        live: which of equal templates and words are meant; None: the first.

    Raises:
        ValueError: what was given is none of these; the message says what was got and what was expected.
    """
    parts = ", ".join(["body action", "template", *(slot.name for slot in sentences.slots)])
    axes = getattr(action, "ndim", 1)  # of an array
    if (
        isinstance(action, str)
        or not isinstance(action, Sequence | np.ndarray)
        or axes != 1
        or len(action) not in (2, 2 + len(sentences.slots))
    ):
        forms = f"({parts}) or (body action, sentence), each part a word, a number or None"
        raise ValueError(f"got the action {action!r}; expected {forms}")
    meant = live or (frozenset(),) * (1 + len(sentences.slots))
    primitive = len(actions) if action[0] is None else _index(action[0], actions, "body action")
    if action[1] is None and all(word is None for word in action[2:]):
        return np.array([primitive, 0, 0, *(0 for _ in sentences.slots)], np.int64)
    if len(action) == 2 and (sentences.slots or isinstance(action[1], str)):
        return np.array([primitive, 1, *_sentence(action[1], sentences, meant)], np.int64)
    if action[1] is None:
        words = " and ".join(
            f"{slot.name} {word!r}" for slot, word in zip(sentences.slots, action[2:], strict=True)
        )
        raise ValueError(f"got template None and {words}; expected both or neither")
    template = _index(action[1], sentences.templates, "template", meant[0])
    spoken = [
        _word(word, slot, is_used, words, action[1])
        for word, slot, is_used, words in zip(
            action[2:], sentences.slots, sentences.used[template], meant[1:], strict=True
        )
    ]
    return np.array([primitive, 1, template, *spoken], np.int64)


def _word(given: Any, slot: Slot, is_used: bool, live: frozenset[int], template: Any) -> int:
    """What stands in a slot; a template that lacks the slot takes no notice of it."""
    if given is not None:
        return _index(given, slot.words, slot.name, live)
    if not is_used:
        return 0
    raise ValueError(f"got template {template!r} and {slot.name} None; expected both or neither")


def _index(given: Any, words: Sequence[str], what: str, live: frozenset[int] = frozenset()) -> int:
    if isinstance(given, str):
        if given in words:
            return min((i for i in live if words[i] == given), default=words.index(given))
        hint = suggested(given, words, quoted=repr)
        raise ValueError(f"got the {what} {given!r}; expected one of {', '.join(map(repr, words))}{hint}")
    if isinstance(given, int | np.integer) and not isinstance(given, bool) and 0 <= given < len(words):
        return int(given)
    raise ValueError(
        f"got the {what} {given!r}; expected a number from 0 to {len(words) - 1}, a word, or None"
    )


def _sentence(given: Any, sentences: Sentences, live: Live) -> tuple[int, ...]:
    def order(spoken: tuple[int, ...]) -> tuple[bool, tuple[int, ...]]:
        used = (True, *sentences.used[spoken[0]])
        is_live = all(k in among or not counts for k, among, counts in zip(spoken, live, used, strict=True))
        return is_live, tuple(-k for k in spoken)

    # Of equal sentences the last is kept: a live one if there is one, else the first.
    ordered = sorted(((template, *choices) for template, choices in sentences.each()), key=order)
    texts = {sentences.text(template, choices): (template, *choices) for template, *choices in ordered}
    if isinstance(given, str):
        if given in texts:
            return texts[given]
        hint = suggested(given, texts, quoted=repr) or f"; expected a text such as {next(iter(texts))!r}"
        raise ValueError(f"got the sentence {given!r}, which the grammar cannot say{hint}")
    raise ValueError(f"got the sentence {given!r}; expected a text such as {next(iter(texts))!r}")


Observation = dict[str, NDArray[Any]]

SILENCE = "NA"
_INT64 = np.dtype(np.int64)


_LOOK_INTO_MEMORY = frozenset(
    "_copy_image _copy_tokens _registers _numbers _key _action _reward _success _play".split()
)
"""What `ScenarioEnv._find_row` finds."""


class ScenarioEnv(Copied, gymnasium.Env[Observation, NDArray[np.int64]]):
    """One environment of a scenario or suite.

    **Observation.** `image`, uint8 (7, 7, C): `image[i, j]` counts i from the agent's left to its right and j from far
    to near, the agent itself is at `[3, 6]`, and `channels` names the channels: type, colour, status, orientation, and
    where the scenario shows gestures or hands more. `tokens`, int16 (L,): the words heard since the reset,
    oldest first, as indices into `program.vocabulary`; 0 pads, 1 is an unknown word.

    **Action.** int64 (3 + slots,): body action (the last one is no movement), speak (1) or not (0), template, then a
    word for each slot of the grammar; in most grammars the noun is the one slot. Template and slots count only if the
    agent speaks, a slot only if the template has it. `encode_action` makes one from words.

    **Reward.** A success in step t pays 1 - 0.9 t / horizon, everything else 0, unless the scenario's `reward` and
    `rules` say otherwise.

    **Info.** `utterance`, the lines heard in this step, "NA" in silence; `history`, all lines since the reset; of a
    suite `member`, the name of the scenario that is played; in the last step `success` (bool) and `outcome`, its name
    in `outcomes` of the program that is played.

    `socialai_dsl.make` makes one from a name.

    Attributes:
        program: the scenario or suite. playing: the program of this episode: of a suite the member's.

    Args:
        program: what `socialai_dsl.compile` returns, for a scenario or a suite.
        render_mode: `rgb_array`, `ansi`, or `human`, which prints the room after every step.
        scenarios: what the program, or each of a suite's, was compiled from; `scenario` and `explain` need it.
        seats: who fills the seats of other members of the cast; see `ScenarioVectorEnv`. By default the caller is the
            agent, and all others follow their frames.

    Raises:
        ValueError: there is no such render mode, or no such seat or player.
    """

    metadata = {"render_modes": ["rgb_array", "ansi", "human"], "render_fps": 4}  # noqa: RUF012 - Gymnasium's protocol

    def __init__(
        self,
        program: Playable,
        render_mode: str | None = None,
        scenarios: Sequence[CheckedScenario] = (),
        seats: Mapping[str, Any] | None = None,
    ) -> None:
        if not isinstance(program, Playable):
            raise ValueError(f"program: got {program!r}; expected what `compile` returns")
        self.program = program
        self.render_mode = check_render_mode(render_mode, self.metadata["render_modes"])
        self._table = Table([program], 1, all_seats=seats is not None)
        seated = Seats.of("agent" if seats is None else seats, self._table.programs)
        if len(seated.own) > 1:
            several = ", ".join(seated.names[number] for number in seated.own)
            raise ValueError(
                f"seats: got {several} for the caller; expected one: a single environment takes one action"
            )
        self._player = seated.own[0]
        self._company = Company(seated, self._table) if seats is not None else None
        self.observation_space = self._table.merged.observation_space()  # type: ignore[assignment]
        self.action_space = self._table.merged.action_space()
        self._shape = self.action_space.nvec.shape
        self._suite = isinstance(program, ProgramSuite)
        self._acts = isinstance(program, ProgramSuite) and program.in_sequence
        self._find_row()
        self._history = ""
        self._ended = True
        self._act = 0
        self.playing = self._table.program(0)
        self._heard = heard_at(self.playing, self._player)[0]
        self._always: dict[str, Any] = {}
        self._recording = Recording(self._table.start(0))
        self._last_act: Recording | None = None
        self._explainers: dict[str, Explainer] = {}
        self._scenarios = tuple(scenarios)

    def _find_row(self) -> None:
        """Look up what a step needs of the one row: asking an array takes longer than the engine takes for a step."""
        ports, own = self._table.batch.ports, self._player
        self._copy_image, self._copy_tokens = self._table.image[own].copy, self._table.tokens[own].copy
        self._registers = self._table.state.registers[0]
        self._numbers = self._registers.data
        self._key = self._table.state.keys[0].data
        self._action = ports.actions[own].data.cast("B")
        self._reward, self._success = ports.reward.data[own:], ports.success.data[own:]
        self._play = self._table.stepper(Task.STEP_ONLY)

    def __getstate__(self) -> dict[str, Any]:
        """All but what looks into memory, and what is made anew when it is needed."""
        kept = {name: value for name, value in vars(self).items() if name not in _LOOK_INTO_MEMORY}
        return kept | {"_explainers": {}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Be a copy, which looks into its own memory."""
        vars(self).update(state)
        self._find_row()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Options:

        * `layout`, a mapping: starts from a known room; what the layout leaves out is drawn.
        * `test_episode`, an int, without a seed: plays this episode of a domain that no seed reaches; 0 to 499 are the
          fixed test set.
        * `index`, an int, with a seed: plays as environment `index` of a vector environment with this seed.
        * `reset_mask`, one boolean: False leaves the episode as it is.

        Args:
            seed: starts episode 0 of this seed. Without it the next episode follows; the first reset then draws a seed
                from the operating system.
            options: any of those above.

        Returns:
            The observation and the info.

        Raises:
            ValueError: the seed, an option or the layout is not what was expected, or says nothing beside another.
            RuntimeError: 64 drawn rooms in a row violate the scenario's `require`.
        """
        seed = None if seed is None else whole_number("seed", seed, 0, MAX_SEED)
        before = None if self._company is None else self._company.playing.copy()
        self._table.reset(seed, options)
        super().reset(seed=seed)
        # Still so where `reset_mask` is False.
        self._ended = not self._table.all_begun or bool(self._registers[Register.ENDED])
        self._history = "\n".join(self._table.history(self._player))
        if self.render_mode == "human":
            self.render()
        self._look_up()
        self._record()
        if self._company is not None and before is not None:
            self._company.begin(self._table.batch.ports.chosen.copy(), before)
        return self._observation(), {"utterance": SILENCE, "history": self._history, **self._always}

    def step(
        self, action: NDArray[np.int64] | Sequence[int]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take one step.

        Args:
            action: integers (3 + slots,).

        Returns:
            Observation, reward (float), terminated (an outcome ended the episode), truncated (the horizon did), info.

        Raises:
            ValueError: the action is outside the space, or the episode has ended.
        """
        if self._ended:
            raise ValueError("step: got a call outside of an episode; expected reset() first")
        try:
            given = action if isinstance(action, np.ndarray) else np.asarray(action)
        except ValueError:  # lists of different lengths
            raise self._refusal(action) from None
        if given.shape != self._shape or given.dtype is not _INT64:
            given = self._converted(action, given)
        self._action[:] = words = given.tobytes()
        if self._company is not None:
            words = self._with_partners(given)
        ended = self._play()
        if ended < 0:
            raise self._table.batch.refused_room() if ended != BAD_ACTION else self._refusal(action)
        self._recording.actions.append(words)
        if self._company is not None:
            self._recording.taken.append(self._table.batch.ports.taken.copy())
        if self._acts:
            self._turn_over()
        info: dict[str, Any] = {"utterance": SILENCE, "history": self._history}
        if self._always:
            info |= self._always
        if self._numbers[self._heard]:
            self._history = "\n".join(self._table.history(self._player))
            info |= {"utterance": "\n".join(self._table.heard(self._player)), "history": self._history}
        terminated = truncated = False
        if ended:
            self._ended = True
            truncated = self._numbers[Register.ENDED] == TRUNCATED
            terminated = not truncated
            outcome = self._numbers[Register.OUTCOME]
            info |= {
                "success": self._success[0],
                "outcome": self.playing.outcomes[outcome],
            }
        if self.render_mode == "human":
            self.render()
        return self._observation(), self._reward[0], terminated, truncated, info

    def _with_partners(self, own: NDArray[np.int64]) -> bytes:
        """Let the other seats act as well; the actions of all seats."""
        assert self._company is not None, "internal: there are no partners"
        actions = self._table.batch.ports.actions
        actions[:] = self._company.act(own[None])
        return actions.tobytes()

    def _record(self) -> None:
        """Remember from here on what is done."""
        self._recording, self._last_act = Recording(self._table.start(0)), None

    def _turn_over(self) -> None:
        """Begin anew where another act has begun."""
        if self._key[Key.ACT] == self._act:
            self._last_act = None
        else:
            self._last_act, self._recording = self._recording, Recording(self._table.start(0))
            self._look_up()
            self._history = "\n".join(self._table.history(self._player))

    def _look_up(self) -> None:
        """Look up which program this episode plays."""
        self._act = self._key[Key.ACT]
        self.playing = self._table.program(0)
        self._heard = heard_at(self.playing, self._player)[0]
        self._always = {"member": self._table.member(0)} if self._suite else {}

    def _converted(self, action: Any, given: NDArray[Any]) -> NDArray[np.int64]:
        """Whole numbers of another type. Raises ValueError for anything else."""
        if given.shape != self._shape or given.dtype.kind not in "iu":
            raise self._refusal(action)
        return given.astype(np.int64)

    def _refusal(self, action: Any) -> ValueError:
        return ValueError(f"step: got the action {action!r}; expected one of {self.action_space}")

    def _observation(self) -> Observation:
        return {"image": self._copy_image(), "tokens": self._copy_tokens()}

    def encode_action(self, action: Sequence[Any]) -> NDArray[np.int64]:
        """The action that words or the paper's notation mean, int64 (heads,).

        `("forward", "Open sesame")` moves and speaks, `(None, "Open sesame")` only speaks, `("left", None)` only moves.
        The paper's notation has indices: `(1, None, None)` is body action 1, `(None, 1, 5)` template 1 with noun 5.

        Args:
            action: a pair of body action and sentence, or a triple of body action, template and noun, each part a word,
                an index or None.

        Raises:
            ValueError: the action is none of these; the message says what was expected.
        """
        live = self.program.live(self._table.number(0)) if isinstance(self.program, ProgramSuite) else None
        return encode_action(action, self.program.actions, self.program.sentences, live)

    def scripted_action(self) -> NDArray[np.int64]:
        """The action of the scenario's own script for the seat that is played, int64 (3 + slots,); nothing changes.

        Raises:
            ValueError: who sits there follows no frame.
        """
        scripted: NDArray[np.int64] = self._table.scripts_of(self._player)[0]
        return scripted

    @property
    def seats(self) -> tuple[str, ...]:
        """The members of the cast whose seats are played here, the agent first: the agent alone without `seats`."""
        return tuple(map(str, self.playing.seats))[: self._table.seats]

    def seat_moment(self, seat: str) -> SeatMoment:
        """What a seat got in the last step, and what was done there.

        Raises:
            ValueError: there was no reset yet, or there is no such seat.
        """
        self._table.look("seat_moment")
        number, table, ports = self._seat_number(seat), self._table, self._table.batch.ports
        began = not self._recording.actions
        # A script plays by itself, so what it did is known from its body alone.
        sat = not began and bool(ports.taken[number])
        action = ports.actions[number].copy() if sat else None
        last = self._registers[FIRST_ENTITY + ENTITY_FIELDS * table.member_at(0, number) + Field.LAST]
        did = TURN_WORDS[last] if action is None else (*self.program.actions, "none")[action[0]]
        return SeatMoment(
            {"image": table.image[number].copy(), "tokens": table.tokens[number].copy()},
            {
                "utterance": "\n".join(table.heard(number)) or SILENCE,
                "history": "\n".join(table.history(number)),
            },
            action,
            None if began else did,
            0.0 if began else float(ports.reward[number]),
            bool(ports.success[number]) if self._ended and not began else None,
        )

    def fill_seat(self, seat: str, partner: Any) -> None:
        """Let somebody else than before fill a seat from the next step on, also over resets.

        Args:
            seat: of another member than the caller's.
            partner: as in `seats`.

        Raises:
            ValueError: there is no such seat or player, or the caller has it; or the environment was made without
                `seats`.
        """
        if self._company is None:
            raise ValueError(
                "fill_seat: got an environment of the agent alone; expected one made with `seats`"
            )
        self._company.seat(seat, partner)

    def _seat_number(self, seat: str | None) -> int:
        if seat is None:
            return self._player
        require_seat(seat, self.seats)
        return self.seats.index(seat)

    def describe(self) -> dict[str, Any]:
        """The state in the scenario's own names, as a layout that `reset` accepts."""
        return self._table.describe(0)

    @property
    def scenario(self) -> CheckedScenario:
        """The checked scenario that this episode's program was compiled from.

        Raises:
            ValueError: the environment was made from a program alone.
        """
        return self._scenario(self._table.number(0))

    def _scenario(self, number: int) -> CheckedScenario:
        if not self._scenarios:
            raise ValueError(f"got an environment of a program; expected make({self.program.name!r})")
        return self._scenarios[number]

    def explain(self) -> dict[str, Any]:
        """Which rules fired in the last step, and why the others that were asked did not.

        Nothing changes. The steps since the last call, or since the episode began, are played again, so this is for
        looking, not for every step of training.

        Returns:
            `t`, `fired` and `others`, two lists in the order in which the rules were asked. An entry has `who` (a
            member of the cast, `world` or `outcome`), `kind` (rule, step, world rule or outcome), `name`, `at`
            (file:line) and `words` (the rule as written); a rule in a frame also `state` and `list` (first or then); an
            entry of `others` also `why`, and, where a part of its condition was false, that `part` as written and the
            `values` it compared. Rules of states that a frame was not in are left out.

        Raises:
            ValueError: no step was taken since `reset` or `restore`, or the environment was made from a program alone.
        """
        recording = self._last_act or self._recording
        if not recording.actions:
            raise ValueError("explain: got a call before the first step; expected step() first")
        number = self._table.number_at(int(recording.start.key[Key.PROGRAM]))
        program = self._table.programs[number]
        scenario = self._scenario(number)
        if program.sha256 not in self._explainers:
            suite = self.program if isinstance(self.program, ProgramSuite) else None
            self._explainers[program.sha256] = Explainer(program, scenario, suite, number, self._table.seats)
        # Where another act has begun, the registers are that one's.
        reached = self._registers if self._last_act is None else None
        return self._explainers[program.sha256].explain(recording, reached)

    def snapshot(self) -> bytes:
        """The exact state as bytes, randomness included.

        What policies on other seats remember is not part of it; a copy of the environment has that, too.
        """
        return self._table.snapshot()

    def restore(self, data: bytes) -> None:
        """Return to a snapshot.

        Raises:
            ValueError: it is damaged, or of another scenario.
        """
        self._table.restore(data)
        self._look_up()
        self._record()
        self._ended = bool(self._registers[Register.ENDED])
        self._history = "\n".join(self._table.history(self._player))

    def counters(self) -> dict[str, Any]:
        """Counts since the environment was made.

        Returns:
            The keys are `outcomes` and `rules`, which map names to counts, and `episodes`, the number that have ended.
        """
        return self._table.counters()

    def render(self) -> Any:
        """The room, by `render_mode`: uint8 (H, W, 3), text, or printed; without a mode, None.

        Raises:
            ValueError: there was no reset yet.
        """
        if self.render_mode is None:
            return None
        self._table.look("render")
        if self.render_mode == "rgb_array":
            return frame(self._table, 0, "rgb_array", seat=self._player)
        text = frame(self._table, 0, "ansi", seat=self._player)
        if self.render_mode == "ansi":
            return text
        heard = "\n".join(self._table.heard(self._player))
        print(f"{text}\n{heard}\n")
        return None

    @property
    def seat_names(self) -> tuple[str, ...]:
        """The one member of the cast that the caller plays, as `ScenarioVectorEnv.seat_names` has several."""
        return (str(self.playing.seats[self._player]),)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels of the image."""
        return self._table.merged.channels

    @property
    def looks(self) -> dict[str, tuple[str, ...]]:
        """The looks that the image shows, each with its words."""
        return words_of_looks(self._table.programs)

    def plain_text(self) -> str:
        """The room as text, two characters for each cell, without colours."""
        self._table.look("plain_text")
        return plain_text(self._table, 0)

    def coloured_text(self) -> str:
        """The room as text with escape codes for colours; what the caller's member has in view has a lighter ground."""
        self._table.look("coloured_text")
        return coloured_text(self._table, 0, self._player)

    def view(self, image: NDArray[np.uint8], seat: str | None = None) -> View:
        """The image of the present observation as a player sees it, by default from the caller's seat."""
        number = self._seat_number(seat)
        own = self._table.member_at(0, number)
        if number:  # the number of the seat stands there, see `one_step.md`
            image = image.copy()
            image[VIEW // 2, VIEW - 1, LOOKS.index("orientation")] = 0
        facing = int(self._registers[FIRST_ENTITY + ENTITY_FIELDS * own + Field.DIR])
        egocentric = bool(self.playing.header(Header.FLAGS) & Flag.EGOCENTRIC)
        return View(image, facing, egocentric, self.channels, self.looks)

    def scene(self, seat: str | None = None) -> Scene:
        """The content of a picture of the room now, by default from the caller's seat."""
        self._table.look("scene")
        return scene(self._table, 0, self._seat_number(seat))

    def looks_of_npcs(self) -> dict[EntityName, Code]:
        """The look of each NPC, as if it looked down; also of those that have left or are hidden."""
        self._table.look("looks_of_npcs")
        return looks_of_npcs(self._table, 0)

    def cast(self) -> list[Face]:
        """The NPCs of this episode that the agent can see, each with a label and a picture of its face."""
        self._table.look("cast")
        return cast_of(self._table, 0)

    def close(self) -> None:
        """Nothing is held open but memory: the environment can be closed again, and used on."""
