"""A window's scenario and game: drawn from the text in the editor, played with steps back."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.briefing import NO_BRIEFING, brief
from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite, about_of, unscripted
from socialai_dsl.compilation import compile_loaded, scenarios_of
from socialai_dsl.diagnostics import Diagnostic, ScenarioError, Severity, printable
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.episodes.play import AGENT
from socialai_dsl.episodes.policies import Policy, RandomPolicy
from socialai_dsl.episodes.stage import Stage
from socialai_dsl.episodes.traces import Tracing, thought_of
from socialai_dsl.frontend import Loaded, check, load
from socialai_dsl.library import prelude
from socialai_dsl.llm.view import LastStep, TextView
from socialai_dsl.loader.reader import display_name
from socialai_dsl.semantics.typed import Phrases, split_line
from socialai_dsl.source import Source
from socialai_dsl.studio.layouts import start_layout, suite_text, with_layout
from socialai_dsl.traces import Thought, Tracer
from socialai_dsl.traces.endings import endings_of
from socialai_dsl.traces.page import replay_page
from socialai_dsl.vocabulary import EMPTY, WALL, Sentences

Reply = dict[str, Any]

_CHECK_SECONDS: Final = 20.0
_ENDED: Final = "the episode has ended; take steps back, or begin another"
_FLOOR: Final = prelude().types["floor"].code


class RefusalError(ValueError):
    """Something cannot be done; the message is for the person at the screen."""


class Session:
    """The content of a window. Each method that a window may call returns its next content."""

    def __init__(self) -> None:
        self._path = Path()
        self._texts: dict[Path, Source] = {}
        self._game: tuple[Stage, Tracing] | None = None
        self._phrases = Phrases((), Sentences((), (), ()))
        self._text_view: TextView | None = None
        self._briefing = NO_BRIEFING
        self._player, self._seed = "me", 0
        self._policy: Policy = RandomPolicy(())
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
            return {
                "findings": [*told, *(_finding(one, display_name(self._path)) for one in error.diagnostics)]
            }
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
        stage, tracing = self._playing()
        tracing.title = f"seed {seed}" if layout is None else "a layout"
        try:
            stage.begin({"seed": seed, "options": None if layout is None else {"layout": layout}})
        except (ValueError, RoomError) as error:
            raise RefusalError(str(error)) from None
        self._seed = seed
        self._begin_anew()
        return {
            "trace": tracing.tracer.trace().model_dump(mode="json", exclude_defaults=True)
            | {"format": "socialai-trace/1"},
            "phrases": {"sentences": self._phrases.sentences()[:2000]},
            "rules": list(stage.env.counters()["rules"]),
            "player": self._player,
            "seed": seed,
            "seat": self._seat(),
        }

    def act(self, movement: str | None = None, sentence: str | None = None, line: str | None = None) -> Reply:
        """Play a step: a movement, a sentence, both, or a line as `socialai play` takes it."""
        stage, _ = self._playing()
        if line is not None:
            movement, sentence = split_line(line.strip(), self._phrases.actions)
        try:
            action = stage.env.encode_action((movement, sentence))
        except ValueError:
            raise RefusalError(self._phrases.problem(line if line is not None else sentence or "")) from None
        return self._step(action[None], None)

    def prepare(self) -> None:
        """Take a step and take it back, if none was taken yet: the first one prepares all explanations.

        Raises:
            RefusalError: there is no room yet.
        """
        stage, _ = self._playing()
        if not self._prepared and stage.running.all() and stage.steps == 0:
            self._prepared = True
            stage.rehearse({AGENT: stage.env.encode_action((None, None))[None]}, stage.env.explain)

    def auto(self) -> Reply:
        """Let the chosen player play a step."""
        stage, _ = self._playing()
        if not stage.running.all():
            raise RefusalError(_ENDED)
        action = self._policy.act(stage.observations[AGENT])
        assert not isinstance(action, Awaitable), "internal: nobody answers later here"
        return self._step(action, thought_of(self._policy))

    def back(self, to: int) -> Reply:
        """Take steps back until `to` of them are left, chance included."""
        stage, _ = self._playing()
        if not 0 <= to <= stage.steps:
            raise RefusalError(f"there are {stage.steps} steps to take back")
        while stage.steps > to:
            stage.back()
        self._begin_anew()
        for moment in stage.moments[:-1]:  # it remembers what it has seen, and what it has drawn
            self._policy.act(moment.observations[AGENT])
        return {"length": to}

    def place(self, who: str, at: tuple[int, int]) -> Reply:
        """Begin again in the same room with one thing somewhere else; the layout is told, too."""
        stage, _ = self._playing()
        env: ScenarioEnv = stage.env
        described = env.describe()
        if stage.steps:
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
        stage, _ = self._playing()
        return {"layout": stage.env.describe()}

    def write_layout(self, text: str) -> Reply:
        """The text of the file, with the room as it is now as the start of every episode.

        Of a suite, the member that is played gets a `layout`. Of a scenario the reply has `suite`, the text of a new
        suite that begins so, and the `name` of its file.
        """
        stage, _ = self._playing()
        described = stage.env.describe()
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
        _, tracing = self._playing()
        return {"page": replay_page([tracing.tracer.trace().portable()])}

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
        self._text_view, self._briefing = TextView(program, "grid"), brief(loaded)
        endings = {ending.name: ending.text for ending in endings_of(loaded, program)}
        tracing = Tracing(Tracer(env, loaded.name, "me", endings, about_of(loaded)))
        self._game = Stage(env, [tracing]), tracing
        self._player, self._policy, self._prepared = "me", RandomPolicy(self._game[0].action_sizes), False

    def _begin_anew(self) -> None:
        """Let the player forget everything."""
        self._policy.reset(np.ones(1, np.bool_), np.array([self._seed]))

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
        stage, tracing = self._playing()
        if player != "me":
            self._policy = _policy("oracle" if player == "script" else player, stage.env)
        self._player = tracing.tracer.agent = player

    def _playing(self) -> tuple[Stage, Tracing]:
        if self._game is None:
            raise RefusalError("there is no room yet; the scenario has mistakes")
        return self._game

    def _step(self, action: NDArray[np.int64], thought: Thought | None) -> Reply:
        stage, tracing = self._playing()
        if not stage.running.all():
            raise RefusalError(_ENDED)
        before, tracing.thought = tracing.tracer.counts(), thought
        image = stage.observations[AGENT]["image"][0].copy()
        try:
            step = stage.step({AGENT: action})
        except (ValueError, RoomError) as error:
            who = "" if self._player == "me" else f"{self._player} chose what cannot be done: "
            raise RefusalError(f"{who}{error}") from None
        more = tracing.tracer.trace(before).model_dump(mode="json", exclude_defaults=True)
        movement = (*stage.env.program.actions, None)[action[0, 0]]
        success = bool(step.success[0]) if step.ended[0] else None
        return {"more": more, "seat": self._seat(LastStep(movement, image, success))}

    def _seat(self, last: LastStep | None = None) -> Reply:
        """What whoever plays is told, sees and hears, as a language model reads it."""
        stage, _ = self._playing()
        assert self._text_view is not None, "internal: what is played has a view"
        observation = {name: value[0] for name, value in stage.observations[AGENT].items()}
        return {
            "told": self._text_view.task(self._briefing.text(stage.info.get("member"))),
            "seen": self._text_view.observe(observation, stage.info, last),
            "compass": self._text_view.by_compass(stage.info),
        }


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


def _policy(run: str, env: Any) -> Policy:
    from socialai_dsl.episodes.players import Player, make_policy, require_trainer
    from socialai_dsl.errors import UsageError

    try:
        player = Player(run)
        if player.is_trained:
            require_trainer()
        return make_policy(player, env)[0]
    except (UsageError, ValueError, OSError) as error:
        raise RefusalError(f"{run}: {error}") from None


def _finding(found: Diagnostic, own: str) -> Reply:
    return {
        "file": None if found.span.file == own else found.span.file,
        "line": found.span.line,
        "column": found.span.column,
        "message": found.text,
        "help": None if found.hint is None else printable(found.hint),
        "notes": [printable(note) for note in found.notes],
        "code": found.code,
        "error": found.severity is Severity.ERROR,
    }
