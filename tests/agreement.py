"""Plays the engine and the reference interpreter side by side and says where they first differ."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.envs import ScenarioEnv, make_vec
from socialai_dsl.envs.asking import Asker
from socialai_dsl.frontend import LoadedScenario, load
from socialai_dsl.program import Program
from socialai_dsl.vocabulary import normal
from tests.reference.interpreter import Action, Reference, Result, plain
from tests.reference.speech import words
from tests.reference.vocabulary import LONGEST, Vocabulary, Words

BOOKKEEPING = ("pending", "kept", "aim", "reset.")
"""Registers of the compiler's own: what a turn keeps until its end."""


class Disagreement(AssertionError):  # noqa: N818 - reads better in a failing test
    """The two differ; the message says in what, when and after which actions."""


@dataclass
class Pair:
    """One environment and one reference interpreter in the same episode."""

    env: ScenarioEnv
    reference: Reference
    scripted: bool
    trail: list[Action] = field(default_factory=list)
    where: str = ""

    @classmethod
    def of(cls, loaded: LoadedScenario, program: Program | None = None, number_words: bool = True) -> Pair:
        """A pair for a loaded scenario; `program` replaces what the compiler makes of it.

        With `number_words` the reference numbers the words by itself, which it can if the values in texts are simple.
        """
        program = program or compile_scenario(loaded.checked)
        env = ScenarioEnv(program)
        (kept,) = env.observation_space["tokens"].shape
        return cls(env, _reference(loaded, program, kept, number_words), "agent" in _frames(loaded))

    def play(self, seed: int, episode: int, rng: np.random.Generator) -> int:
        """One episode with actions drawn from `rng`; the number of steps. Raises Disagreement."""
        self.reset(seed, episode)
        while True:
            action = self._action(rng)
            if self.step(action):
                return len(self.trail)

    def reset(self, seed: int, episode: int = 0) -> None:
        """Begin an episode; those after the first come one after the other. Raises Disagreement."""
        observation, info = self.env.reset(seed=seed) if episode == 0 else self.env.reset()
        expected = self.reference.reset(seed=seed, episode=episode)
        self.trail = []
        self.where = f"{self.env.program.name}, seed {seed}, episode {episode}"
        self._compare(observation, info, 0.0, False, False, expected)

    def step(self, action: Action) -> bool:
        """One step; whether the episode has ended. Raises Disagreement."""
        self.trail.append(action)
        observation, reward, terminated, truncated, info = self.env.step(np.array(action))
        self._compare(observation, info, reward, terminated, truncated, self.reference.step(action))
        return terminated or truncated

    def _action(self, rng: np.random.Generator) -> Action:
        """Usually what the agent's frame would do, where it has one; else anything, moving more often than not."""
        scripted = self._scripted() if self.scripted else None
        if scripted is not None and rng.random() < 0.85:
            return scripted
        return _drawn(rng, self.env.action_space.nvec, self.reference)

    def _scripted(self) -> Action:
        expected = self.reference.scripted_action()
        action = tuple(int(part) for part in self.env.scripted_action())
        # Template and noun mean nothing in silence.
        got = action if action[1] else (*action[:2], *(0 for _ in action[2:]))
        if got != expected:
            raise Disagreement(
                f"{self.where}: scripted action {got}, expected {expected}, after {self.trail}"
            )
        return expected

    def _compare(
        self,
        observation: dict[str, Any],
        info: dict[str, Any],
        reward: float,
        terminated: bool,
        truncated: bool,
        expected: Result,
    ) -> None:
        program, tokens = self.env.program, observation["tokens"]
        got_state, wanted_state = _state(program, self.env.describe()), _expected(program, self.reference)
        differences = [
            name
            for name, got, wanted in (
                ("image", observation["image"].tolist(), expected.image.tolist()),
                ("tokens", _words(program, tokens), _padded(expected.words, len(tokens))),
                ("heard", info["utterance"], "\n".join(expected.heard) or "NA"),
                ("reward", round(reward, 9), round(expected.reward, 9)),
                ("terminated", terminated, expected.terminated),
                ("truncated", truncated, expected.truncated),
                ("outcome", _outcome(program, info.get("outcome")), expected.outcome),
                ("state", got_state, wanted_state),
            )
            if got != wanted
        ]
        if differences:
            raise Disagreement(
                f"{self.where}, step {len(self.trail)}: {', '.join(differences)} differ.\n"
                f"{_difference(got_state, wanted_state)}\n"
                f"heard {info['utterance']!r}, expected {expected.heard}; outcome {info.get('outcome')}, "
                f"expected {expected.outcome}; reward {reward}, expected {expected.reward}\nactions {self.trail}"
            )


@dataclass
class Game:
    """One game of several seats as the reference plays it.

    Attributes:
        episode: its number. results: of all seats, of the reset or of the last step. taken: the members that are
        played in the next step. trail: what these did in each step.
    """

    reference: Reference
    number: int
    seed: int
    episode: int = -1
    results: list[Result] = field(default_factory=list)
    taken: tuple[str, ...] = ()
    trail: list[dict[str, Action]] = field(default_factory=list)

    @property
    def seats(self) -> list[str]:
        """The members with a seat."""
        return self.reference.scenario.seats()

    @property
    def ended(self) -> bool:
        """Whether its episode has ended; the next step begins another."""
        return self.results[0].terminated or self.results[0].truncated

    def reset(self) -> None:
        """Begin the next episode, in which all seats are taken until somebody leaves."""
        self.episode += 1
        self.results = self.reference.reset_all(self.seed, self.number, self.episode)
        self.taken, self.trail = tuple(self.seats), []

    def step(self, actions: Sequence[Action]) -> None:
        """One step with an action for each seat, of which those count that are taken; after an episode the next one."""
        if self.ended:
            self.reset()
            return
        played = {
            seat: action for seat, action in zip(self.seats, actions, strict=True) if seat in self.taken
        }
        self.trail.append(played)
        self.results = self.reference.play(played)


class Seats:
    """A batch of games in which all seats are played, and a reference beside each."""

    def __init__(
        self,
        loaded: LoadedScenario,
        seed: int,
        games: int = 2,
        program: Program | None = None,
        number_words: bool = True,
        judge: type[Reference] = Reference,
    ) -> None:
        self.program = program or compile_scenario(loaded.checked)
        self.envs = make_vec(self.program, games, seats="all")
        kept = self.envs.single_observation_space["tokens"].shape[0]
        self.games = [
            Game(_reference(loaded, self.program, kept, number_words, judge), number, seed)
            for number in range(games)
        ]
        observation, _ = self.envs.reset(seed=seed)
        for game in self.games:
            game.reset()
        rows = len(observation["image"])
        self._compare(observation, np.zeros(rows), np.zeros(rows, bool), np.zeros(rows, bool), {})

    def step(self, rng: np.random.Generator, changing: float = 0.15) -> None:
        """One step with random actions, before which players come and go now and then. Raises Disagreement."""
        for game in self.games:
            if not game.ended and rng.random() < changing:
                game.taken = ("agent", *(seat for seat in game.seats[1:] if rng.random() < 0.5))
        self.envs.set_taken(np.array([seat in game.taken for game in self.games for seat in game.seats]))
        sizes = self.envs.single_action_space.nvec
        actions = [[_drawn(rng, sizes, game.reference) for _ in game.seats] for game in self.games]
        found = self.envs.step(np.array([action for of_game in actions for action in of_game]))
        for game, of_game in zip(self.games, actions, strict=True):
            game.step(of_game)
        self._compare(*found)

    def _compare(
        self,
        observation: Mapping[str, np.ndarray],
        rewards: np.ndarray,
        terminated: np.ndarray,
        truncated: np.ndarray,
        infos: Mapping[str, Any],
    ) -> None:
        """All rows with the results of all seats, and the state of each game with that of the reference."""
        row, heard = 0, self.envs.utterances()
        for game in self.games:
            expected = _expected(self.program, game.reference)
            for seat, result in zip(game.seats, game.results, strict=True):
                tokens = observation["tokens"][row]
                over = terminated[row] or truncated[row]
                outcome = self.envs.outcomes[infos["outcome"][row]] if over else None
                state = _state(self.program, self.envs.describe(row))
                parts = {
                    "image": (observation["image"][row].tolist(), result.image.tolist()),
                    "tokens": (_words(self.program, tokens), _padded(result.words, len(tokens))),
                    "heard": (heard[row], "\n".join(result.heard) or "NA"),
                    "reward": (round(float(rewards[row]), 9), round(result.reward, 9)),
                    "terminated": (bool(terminated[row]), result.terminated),
                    "truncated": (bool(truncated[row]), result.truncated),
                    "outcome": (_outcome(self.program, outcome), result.outcome),
                    "success": (bool(over and infos["success"][row]), result.success),
                    "state": (state, expected),
                }
                if differences := {part: both for part, both in parts.items() if both[0] != both[1]}:
                    raise Disagreement(self._message(game, seat, differences, _difference(state, expected)))
                row += 1

    def _message(self, game: Game, seat: str, differences: Mapping[str, Any], details: str) -> str:
        """What differs for a seat, and what had been played."""
        short = {part: both for part, both in differences.items() if part not in ("image", "tokens", "state")}
        return (
            f"{self.program.name}, seed {game.seed}, game {game.number}, episode {game.episode}, step "
            f"{len(game.trail)}, {seat}: {', '.join(differences)} differ.\n{details}\n{short}\nplayed {game.trail}"
        )


def seats_agree(
    loaded: LoadedScenario,
    steps: int,
    seed: int = 0,
    program: Program | None = None,
    number_words: bool = True,
    judge: type[Reference] = Reference,
) -> int:
    """Play so many steps of two games with all seats on both; the number of episodes. Raises Disagreement."""
    seats = Seats(loaded, seed, program=program, number_words=number_words, judge=judge)
    rng = np.random.default_rng(seed)
    try:
        for _ in range(steps):
            seats.step(rng)
    finally:
        seats.envs.close()
    return sum(game.episode + 1 for game in seats.games)


def _reference(
    loaded: LoadedScenario,
    program: Program,
    kept: int,
    number_words: bool,
    judge: type[Reference] = Reference,
) -> Reference:
    """A reference that numbers its words by itself and as the program does, or has them from there."""
    if not number_words:
        known = Words({word: number for number, word in enumerate(program.vocabulary)}, LONGEST)
        return judge(loaded.resolved, known)
    reference = judge(loaded.resolved)
    yours = reference.vocabulary
    assert isinstance(yours, Vocabulary)
    # 0 pads and 1 is unknown. Which numbers can be said is the compiler's to work out: those heard are compared.
    if ("-" in yours.telling) != ("-" in program.vocabulary):
        yours.telling ^= {"-"}
        yours.length = yours.longest_history()
    got, wanted = (
        [word for word in found if word != "-" and not word.isdigit()]
        for found in (program.vocabulary[2:], yours.ids)
    )
    in_order = ([word for word in found if words(word) == [word]] for found in (got, wanted))
    if next(in_order) != next(in_order) or {*got} != {*wanted}:
        raise Disagreement(f"{program.name}: the vocabulary is {got}, expected {wanted}")
    if kept != yours.length:
        raise Disagreement(f"{program.name}: {kept} tokens are kept, expected {yours.length}")
    return reference


def _drawn(rng: np.random.Generator, sizes: Sequence[int], reference: Reference) -> Action:
    """Any action, a move more often than not."""
    primitives, _, *spoken = map(int, sizes)
    moves = [i for i, word in enumerate(reference.scenario.actions) if word in ("left", "right", "forward")]
    move = int(rng.choice(moves)) if moves and rng.random() < 0.85 else int(rng.integers(primitives))
    return move, int(rng.integers(2)), *(int(rng.integers(size)) for size in spoken)


def _words(program: Program, tokens: np.ndarray) -> list[str]:
    """Tokens as words, padding as nothing."""
    return ["" if token == 0 else program.vocabulary[token] for token in tokens.tolist()]


def _padded(heard: list[str], length: int) -> list[str]:
    """Words as so many tokens show them."""
    return heard + [""] * (length - len(heard))


def _outcome(program: Program, name: str | None) -> int | str | None:
    """The outcome as the reference names it: an id, a place in the list, or deadly, timeout."""
    return program.outcomes.index(name) if name is not None and "@" in name else name


def _frames(loaded: LoadedScenario) -> set[str]:
    return {frame.member for frame in loaded.checked.frames}


def _state(program: Program, state: dict[str, Any]) -> dict[str, Any]:
    """Everything that both sides can name, from what the environment describes."""
    common: dict[str, Any] = {"t": state["t"], "room": state["room"], "cast": {}, "objects": {}, "let": {}}
    common |= {"memory": state.get("memory", {}), "one_of": state.get("one_of", {})}
    for entity in program.entities:
        if entity.role == "object":
            group = state[entity.key] if entity.index is not None else [state[entity.key]]
            common["objects"][entity.key] = [_object(o) for o in group]
        else:
            member = state[entity.key] if entity.index is None else state[entity.key][entity.index]
            common["cast"][str(entity)] = _member(member)
            for name, value in member.get("believes", {}).items():
                common["cast"][str(entity)].setdefault("registers", {})[f"believes.{name}"] = value
    common |= {"state": state.get("state", {})}
    for name, value in state["let"].items():
        owner, dot, register = name.partition(".")
        if not dot:
            common["let"][name] = value
        elif owner in common["cast"] and not register.startswith(("fired.", *BOOKKEEPING)):
            common["cast"][owner].setdefault("registers", {})[register] = value
    # A cell that is none has a word in a layout; the reference has no value then.
    return {path: None if value == "nowhere" else value for path, value in _flatten(common)}


def _object(described: dict[str, Any]) -> dict[str, Any]:
    """An object; the status of one that is gone means nothing."""
    gone = described.get("gone", False)
    kept = ("at", "color") if gone else ("at", "color", "state")
    return {key: described[key] for key in kept} | {"gone": gone, "looks": described.get("looks", {})}


def _member(described: dict[str, Any]) -> dict[str, Any]:
    """A cast member; what does not vary (a fixed name) the engine does not hold."""
    kept = ("at", "color", "facing", "clock", "name", "state")
    gone = described.get("gone", False)
    return {key: described[key] for key in kept if key in described and not (gone and key == "clock")} | {
        "gone": gone,
        "looks": described.get("looks", {}),
    }


def _flatten(node: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _flatten(value, f"{path}.{key}" if path else str(key))
    else:
        yield path, node


def _expected(program: Program, reference: Reference) -> dict[str, Any]:
    """The same from the reference, of what the engine holds."""
    held = {name.path.partition("(")[0] for name in program.registers}
    # The engine calls 3 "3".
    nouns = {name.path.partition("(")[0] for name in program.registers if name.kind == "noun"}
    state = reference.describe()
    for name, member in state["cast"].items():
        del member["kind_code"], member["was_poked"], member["once"]
        for key, path in (("name", "name"), ("clock", "clock"), ("state", "frame")):
            if f"{name}.{path}" not in held or (key == "clock" and member["gone"]):
                del member[key]
        if member.get("state", "") is None:
            member.pop("state"), member.pop("clock", None)
        slots = {k: plain(v) for k, v in reference.world.cast[name].slots.items()}
        member["registers"] = {
            k: _as_nouns(v) if f"{name}.{k}" in nouns else v
            for k, v in {**slots, **member["registers"]}.items()
            if f"{name}.{k}" in held
        }
        believed = member.pop("believes")
        member["registers"] |= {
            f"believes.{k}": v for k, v in believed.items() if f"{name}.believes.{k}" in held
        }
        if not member["registers"]:
            del member["registers"]
    state["state"] = {
        k: _as_nouns(v) if f"state.{k}" in nouns else v
        for k, v in state["state"].items()
        if f"state.{k}" in held
    }
    sequences = {path.removeprefix("let.").partition("[")[0] for path in held if "[0].move" in path}
    state["objects"] = {name: [_object(o) for o in group] for name, group in state["objects"].items()}
    state["let"] = {k: v for k, v in state["let"].items() if f"let.{k}" in held or k in sequences}
    return dict(_flatten(state))


def _as_nouns(value: Any) -> Any:
    return {key: str(one) for key, one in value.items()} if isinstance(value, dict) else str(value)


def _difference(got: dict[str, Any], wanted: dict[str, Any]) -> str:
    keys = sorted(got.keys() | wanted.keys())
    return "\n".join(
        f"  {key}: {got.get(key, '-')}, expected {wanted.get(key, '-')}"
        for key in keys
        if got.get(key) != wanted.get(key)
    )


def agree(name: str, episodes: int, seed: int = 0, program: Program | None = None) -> int:
    """Play this many episodes of a scenario on both; the number of steps. Raises Disagreement."""
    pair = Pair.of(load(name), program)
    rng = np.random.default_rng(seed)
    return sum(pair.play(seed, episode, rng) for episode in range(episodes))


def questions_agree(
    env: ScenarioEnv, asker: Asker, reference: Reference, seed: int, choose: Callable[[], Any]
) -> int:
    """Play one episode, and find that both ask the same at the same moments; the number of questions.

    Raises Disagreement.
    """
    observation, _ = env.reset(seed=seed)
    reference.reset(seed=seed)
    now, asked, ended, count, t = asker.reset(seed, None, observation["image"]), set[str](), False, 0, 0
    while True:
        expected = {name: found for name, found in reference.probed(ended).items() if name not in asked}
        where = f"{env.program.name}, seed {seed}, step {t}"
        for question in now:
            text, _, right = expected.get(question.probe, ("nothing", [], ""))
            right = "no" if right is None else right
            if (question.text, normal(question.right)) != (text, normal(right)):
                raise Disagreement(f"{where}: asked {question}, expected {text}, {right}")
        for name in expected.keys() - {question.probe for question in now}:
            _, answers, right = expected[name]
            if right is not None and answers and len({*map(normal, answers), normal(right)}) > 1:
                raise Disagreement(f"{where}: {name} was not asked")
        asked |= {name for name, (_, _, right) in expected.items() if right is not None} | {
            q.probe for q in now
        }
        count += len(now)
        if ended:
            return count
        action = np.asarray(choose())
        observation, _, terminated, truncated, _ = env.step(action)
        t, ended = t + 1, terminated or truncated
        now = asker.step([action], observation["image"], ended)
        reference.step(plain_action(action))


def plain_action(action: Any) -> Action:
    """An action as plain numbers."""
    return tuple(map(int, action))
