"""A window's scenario and game: drawn from the text in the editor, played with steps back."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite, about_of, unscripted
from socialai_dsl.compilation import compile_loaded, scenarios_of
from socialai_dsl.diagnostics import Diagnostic, ScenarioError, Severity
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.envs.typed import Phrases, split_line
from socialai_dsl.frontend import Loaded, check, load
from socialai_dsl.library import prelude
from socialai_dsl.loader.reader import display_name
from socialai_dsl.replay import Thought, Tracer
from socialai_dsl.replay.endings import endings_of
from socialai_dsl.replay.page import replay_page
from socialai_dsl.source import Source
from socialai_dsl.studio.files import PLAYERS
from socialai_dsl.studio.layouts import start_layout, suite_text, with_layout
from socialai_dsl.vocabulary import EMPTY, WALL, Sentences

Reply = dict[str, Any]

_CHECK_SECONDS: Final = 20.0
_ENDED: Final = "the episode has ended; take steps back, or begin another"
_FLOOR: Final = prelude().types["floor"].code


class RefusalError(ValueError):
    """Something cannot be done; the message is for the person at the screen."""


@dataclass
class _Before:
    """What is put back with a step: the environment, and the player's chance."""

    snapshot: bytes
    observation: Mapping[str, NDArray[Any]]
    chance: Mapping[str, Any]
    ended: bool


class Session:
    """The content of a window. Each method that a window may call returns its next content."""

    def __init__(self) -> None:
        self._path = Path()
        self._texts: dict[Path, Source] = {}
        self._game: tuple[ScenarioEnv, Tracer] | None = None
        self._phrases = Phrases((), Sentences((), (), ()))
        self._moments: list[_Before] = []
        self._player, self._seed = "me", 0
        self._policy: Any = None
        self._chance = np.random.default_rng(0)
        self._prepared = False

    def draw(self, path: str, text: str, seed: int = 0) -> Reply:
        """Check a text that is to stand in a file, and draw its room if it is sound."""
        self._path = Path(path)
        self._texts = {self._path: Source(display_name(self._path), text)}
        found = check(path, self._texts)
        told = [_finding(one, display_name(self._path)) for one in found.diagnostics]
        if found.has_errors:
            return {"findings": told}
        try:
            self._use(load(path, self._texts))
        except ScenarioError as error:  # it is sound, and nothing that can be played
            return {"findings": [*told, *(_finding(one, "") for one in error.diagnostics)]}
        try:
            return {"findings": told, **self.begin(seed)}
        except RefusalError as refusal:
            return {"findings": told, "refused": str(refusal)}

    def begin(self, seed: int = 0, player: str = "me", layout: Any = None) -> Reply:
        """Begin an episode.

        Args:
            seed: of the room.
            player: `me`, `script`, `random`, `shipped:NAME`, or the folder of a run.
            layout: a known room.
        """
        if not self._texts:
            raise RefusalError("there is no scenario yet")
        if player != self._player:
            self._choose(player)
        env, tracer = self._playing()
        try:
            observation, info = env.reset(seed=seed, options=None if layout is None else {"layout": layout})
        except (ValueError, RoomError) as error:
            raise RefusalError(str(error)) from None
        self._seed, self._chance = seed, np.random.default_rng(seed)
        if self._policy is not None:
            self._policy.reset(np.ones(1, np.bool_))
        tracer.begin(f"seed {seed}" if layout is None else "a layout", observation, info)
        self._moments = [_Before(env.snapshot(), observation, self._chance.bit_generator.state, False)]
        return {
            "trace": tracer.trace().model_dump(mode="json", exclude_defaults=True)
            | {"format": "socialai-trace/1"},
            "phrases": {"sentences": self._phrases.sentences()[:2000]},
            "rules": list(env.counters()["rules"]),
            "player": self._player,
            "seed": seed,
        }

    def act(self, movement: str | None = None, sentence: str | None = None, line: str | None = None) -> Reply:
        """Play a step: a movement, a sentence, both, or a line as `socialai play` takes it."""
        env, _ = self._playing()
        if line is not None:
            movement, sentence = split_line(line.strip(), self._phrases.actions)
        try:
            action = env.encode_action((movement, sentence))
        except ValueError:
            raise RefusalError(self._phrases.problem(line if line is not None else sentence or "")) from None
        return self._step(action, None)

    def prepare(self) -> None:
        """Take a step and take it back, if none was taken yet: the first one prepares all explanations.

        Raises:
            RefusalError: there is no room yet.
        """
        env, _ = self._playing()
        if not self._prepared and len(self._moments) == 1:
            self._prepared = True
            env.step(env.encode_action((None, None)))
            env.explain()
            env.restore(self._moments[0].snapshot)

    def auto(self) -> Reply:
        """Let the chosen player play a step."""
        env, _ = self._playing()
        if not self._moments or self._moments[-1].ended:
            raise RefusalError(_ENDED)
        if self._player == "script":
            return self._step(env.scripted_action(), None)
        sizes = env.action_space.nvec  # type: ignore[attr-defined]
        if self._policy is None:
            return self._step(self._chance.integers(0, sizes, dtype=np.int64), None)
        probabilities, value = self._policy.think(self._moments[-1].observation)
        shares = [np.asarray(head) / sum(head) for head in probabilities]
        action = np.array([self._chance.choice(len(head), p=head) for head in shares])
        rounded = [[round(share, 4) for share in head] for head in probabilities]
        return self._step(action, Thought(probabilities=rounded, value=round(value, 4)))

    def back(self, to: int) -> Reply:
        """Take steps back until `to` of them are left, chance included."""
        env, tracer = self._playing()
        if not 0 <= to < len(self._moments):
            raise RefusalError(f"there are {len(self._moments) - 1} steps to take back")
        while len(self._moments) > to + 1:
            self._moments.pop()
            tracer.back()
        now = self._moments[-1]
        env.restore(now.snapshot)
        self._chance.bit_generator.state = dict(now.chance)
        if self._policy is not None:  # it remembers what it has seen
            self._policy.reset(np.ones(1, np.bool_))
            for before in self._moments[:-1]:
                self._policy.think(before.observation)
        return {"length": to}

    def place(self, who: str, at: tuple[int, int]) -> Reply:
        """Begin again in the same room with one thing somewhere else; the layout is told, too."""
        env, _ = self._playing()
        described = env.describe()
        if len(self._moments) != 1:
            raise RefusalError("things are moved before the first step; begin the episode again first")
        key, _, index = who.rstrip("]").partition("[")
        found = described.get(key)
        one = (
            found[int(index)]
            if isinstance(found, list) and index.isdecimal() and int(index) < len(found)
            else found
        )
        if not isinstance(one, dict) or "at" not in one:
            raise RefusalError(f"there is nothing called {who!r} in the room")
        one["at"] = list(at)
        layout = start_layout(described) | ({"member": described["member"]} if "member" in described else {})
        room = described["room"]
        inside = 0 <= at[0] < room["width"] and 0 <= at[1] < room["height"]
        cell = env.scene().codes[at[1], at[0]] if inside else None
        if cell is None or cell[0] not in (EMPTY, _FLOOR, WALL):
            raise RefusalError(f"{who} cannot be put there")
        return self.begin(self._seed, self._player, layout) | {"layout": layout}

    def layout(self) -> Reply:
        """The room as it is now, as a layout that the commands take."""
        env, _ = self._playing()
        return {"layout": env.describe()}

    def write_layout(self, text: str) -> Reply:
        """The text of the file, with the room as it is now as the start of every episode.

        Of a suite, the member that is played gets a `layout`. Of a scenario the reply has `suite`, the text of a new
        suite that begins so, and the `name` of its file.
        """
        env, _ = self._playing()
        described = env.describe()
        layout, stem = start_layout(described), self._path.stem
        loaded = load(str(self._path), {self._path: Source(display_name(self._path), text)})
        if not isinstance(loaded, LoadedSuite):
            name = f"{re.sub(r'[^a-zA-Z0-9_]', '_', stem)}_known"
            return {"suite": suite_text(name, self._path.name, layout), "name": f"{name}.yaml"}
        if loaded.suite.members is None or loaded.suite.sweep is not None or loaded.in_sequence:
            raise RefusalError("members that are acts or made by a tree or sweep get their layouts by hand")
        suite = loaded.resolved.tree
        entry = suite.at(("members", loaded.member_names.index(described["member"])))
        if any(part.file != suite.file for _, part in entry.walk()):
            raise RefusalError("the members are not written in this file")
        return {"text": with_layout(entry, layout)}

    def replay(self) -> Reply:
        """The episode so far as a page of its own."""
        _, tracer = self._playing()
        return {"page": replay_page([tracer.trace().portable()])}

    def check(self, path: str, text: str) -> Reply:
        """What `socialai check` says of a text."""
        from socialai_dsl.analysis.check import check_scenario
        from socialai_dsl.analysis.effort import Clock, Effort

        try:
            loaded = load(path, {Path(path): Source(display_name(Path(path)), text)})
        except ScenarioError as error:
            return {"lines": [f"{one.span}: {one.text}" for one in error.diagnostics]}
        if not isinstance(loaded, LoadedScenario):
            raise RefusalError("a suite is checked by `socialai check`; here its members are, one by one")
        effort = Effort(100, 0, clock=Clock(_CHECK_SECONDS, lambda said: None))
        return {"lines": list(check_scenario(loaded, display_name(Path(path)), effort).lines())}

    # -- within ----------------------------------------------------------------------------------------------

    def _use(self, loaded: Loaded) -> None:
        """Play this from now on."""
        program = compile_loaded(loaded)
        env = ScenarioEnv(program, scenarios=scenarios_of(loaded))
        self._phrases = Phrases(program.actions, program.sentences)
        endings = {ending.name: ending.text for ending in endings_of(loaded, program)}
        self._game = env, Tracer(env, loaded.name, "me", endings, about_of(loaded))
        self._player, self._policy, self._moments = "me", None, []
        self._prepared = False

    def _choose(self, player: str) -> None:
        """Change the player."""
        path = str(self._path)
        loaded = load(path, self._texts)
        if player == "script" and unscripted(loaded):
            try:
                loaded = load(f"{path}+oracle", self._texts)
            except ScenarioError as error:
                known = all(one.code == "S503" for one in error.diagnostics)
                said = "" if known else f": {error.diagnostics[0].text}"
                raise RefusalError(f"the agent has no script: there is no variant `oracle`{said}") from None
            if unscripted(loaded):
                raise RefusalError("the variant `oracle` gives the agent no frame")
        self._use(loaded)
        env, tracer = self._playing()
        if player not in PLAYERS:
            self._policy = _policy(player, env)
        self._player = tracer.agent = player

    def _playing(self) -> tuple[ScenarioEnv, Tracer]:
        if self._game is None:
            raise RefusalError("there is no room yet; the scenario has mistakes")
        return self._game

    def _step(self, action: NDArray[np.int64], thought: Thought | None) -> Reply:
        env, tracer = self._playing()
        if not self._moments or self._moments[-1].ended:
            raise RefusalError(_ENDED)
        before = tracer.counts()
        try:
            observation, reward, terminated, truncated, info = env.step(action)
        except (ValueError, RoomError) as error:
            env.restore(self._moments[-1].snapshot)
            who = "" if self._player == "me" else f"{self._player} chose what cannot be done: "
            raise RefusalError(f"{who}{error}") from None
        tracer.step(action, observation, reward, terminated, truncated, info, thought=thought)
        self._moments.append(
            _Before(env.snapshot(), observation, self._chance.bit_generator.state, terminated or truncated)
        )
        return {"more": tracer.trace(before).model_dump(mode="json", exclude_defaults=True)}


ASKED: Final[Mapping[str, Callable[..., Reply]]] = {
    "draw": Session.draw,
    "begin": Session.begin,
    "act": Session.act,
    "auto": Session.auto,
    "back": Session.back,
    "place": Session.place,
    "layout": Session.layout,
    "write_layout": Session.write_layout,
    "replay": Session.replay,
    "check": Session.check,
}
"""What a window may ask a session for, by name."""


def _policy(run: str, env: Any) -> Any:
    from socialai_dsl.errors import UsageError
    from socialai_dsl.evaluation.players import Player, make_policy, require_trainer

    try:
        require_trainer()
        return make_policy(Player(run), env)[0]
    except (UsageError, ValueError, OSError) as error:
        raise RefusalError(f"{run}: {error}") from None


def _finding(found: Diagnostic, own: str) -> Reply:
    message = found.text if found.hint is None else f"{found.text} ({found.hint})"
    place = "" if found.span.file == own else f"{found.span}: "
    return {
        "line": found.span.line if not place else 1,
        "column": found.span.column if not place else 1,
        "message": place + message,
        "code": found.code,
        "error": found.severity is Severity.ERROR,
    }
