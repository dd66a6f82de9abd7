"""A window's scenario and game: drawn from the text in the editor, played with steps back."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.authoring.test_text import NameTakenError
from socialai_dsl.checking.briefing import NO_BRIEFING, brief
from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite, about_of, unscripted
from socialai_dsl.compilation import compile_loaded, scenarios_of
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.envs.factory import compiled, make_loaded
from socialai_dsl.envs.gaze import Gaze
from socialai_dsl.envs.options import reset_arguments
from socialai_dsl.envs.seats import NOBODY, RANDOM, SCRIPT
from socialai_dsl.episodes.partners import partners_of, seating, sitting
from socialai_dsl.episodes.play import AGENT, OneEpisode, Rooms, Seat, play
from socialai_dsl.episodes.policies import Policy, RandomPolicy, ReplayedPolicy
from socialai_dsl.episodes.stage import Stage, remembering
from socialai_dsl.episodes.traces import Tracing, thought_of
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.frontend import Loaded, check, closest_script, load
from socialai_dsl.library import prelude
from socialai_dsl.llm.view import LastStep, TextView
from socialai_dsl.loader.reader import display_name
from socialai_dsl.program_suite import Playable, has_script, seats_of
from socialai_dsl.semantics.typed import Phrases
from socialai_dsl.source import Source
from socialai_dsl.studio.judging import finding, texts_of
from socialai_dsl.studio.layouts import start_layout, suite_text, with_layout
from socialai_dsl.studio.messages import RefusalError, Room, Shown
from socialai_dsl.traces import Thought, Tracer
from socialai_dsl.traces.endings import endings_of
from socialai_dsl.traces.page import replay_page
from socialai_dsl.traces.state import names_of
from socialai_dsl.traces.tracing import sight_of
from socialai_dsl.vocabulary import EMPTY, WALL, Sentences

Reply = dict[str, Any]
Acts = Mapping[Seat, Sequence[int]]
"""Actions of people on other seats than the own one, (heads,) each."""

_FIRST: Final = Room()
_NOBODY_ELSE: Final[Mapping[Seat, str]] = MappingProxyType({})
_NO_ACTS: Final[Acts] = MappingProxyType({})
_PERSON: Final = "a person"
_MOST_PHRASES: Final = 2000
_ENDED_FOR_GUESTS: Final = "the episode has ended; another one begins when whoever invited you begins it"
_ENDED: Final = "the episode has ended; take steps back, or begin another"
_FLOOR: Final = prelude().types["floor"].code


@dataclass(frozen=True)
class Casting:
    """What is played, and who plays it.

    Attributes:
        player: on the own seat: `me`, `script`, `random`, `shipped:NAME`, or the folder of a run.
        variant: variants and parameters behind the scenario's name.
        seat: the own one.
        others: on other seats, by member of the cast: as `player`, or `nobody`, but not `me`; whoever is left out
            follows the script, if there is one.
    """

    player: str = "me"
    variant: str = ""
    seat: Seat = AGENT
    others: Mapping[Seat, str] = field(default_factory=dict)


class _InPlaceOf:
    """A person's action for one step. Who stands in for the person looks on, and so can go on later.

    Args:
        stand_in: who does. action: integers (heads,).
    """

    def __init__(self, stand_in: str | Policy, action: Sequence[int]) -> None:
        self._stand_in, self._action = stand_in, np.array(action, np.int64)

    def reset(self, mask: NDArray[np.bool_], episodes: NDArray[np.int64] | None = None) -> None:
        """See `Policy.reset`."""
        if not isinstance(self._stand_in, str):
            self._stand_in.reset(mask, episodes)

    def act(self, observation: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
        """See `Policy.act`."""
        if not isinstance(self._stand_in, str):
            self._stand_in.act(observation)
        return self._action[None]


class Session:
    """The content of a window. Each method that a window may call returns its next content."""

    def __init__(self) -> None:
        self._file = self._scenario = Path()
        self._texts: dict[Path, Source] = {}
        self._game: tuple[Stage, Tracing] | None = None
        self._words: Mapping[Seat, str] = {}
        self._phrases = Phrases((), Sentences((), (), ()))
        self._text_view: TextView | None = None
        self._briefing = NO_BRIEFING
        self._casting, self._room = Casting(), Room()
        self._loaded: Loaded | None = None
        self._gaze: tuple[int, int, Gaze] | None = None
        self._policy: Policy = RandomPolicy(())
        self._others: Mapping[Seat, str] = {}
        self._filled: Mapping[Seat, Any] | None = None
        self._before: Mapping[Seat, NDArray[np.uint8]] = {}
        self._prepared = False

    def draw(self, path: str, text: str, room: Room = _FIRST) -> Reply:
        """Check a text that is to stand in a file, and draw its room if it is sound; of tests their scenario's."""
        if self._file != Path(path):  # the game of another file is over
            self._file = self._scenario = Path(path)
            self._game, self._casting = None, Casting()
        kept, self._texts = self._kept(), texts_of(path, text)
        found = check(path, self._texts)
        own = display_name(self._file)
        told = [finding(one, own) for one in found.diagnostics]
        if found.has_errors:
            return {"findings": told}
        whole = found.whole
        self._scenario = self._file if whole is None else whole.path
        try:
            loaded = load(str(self._scenario), self._texts)
            plays = self._plays(loaded)
            try:
                self._use(loaded, kept)
            except RefusalError:  # somebody has no seat any more
                self._use(loaded, Casting())
        except ScenarioError as error:  # it is sound, and nothing that can be played
            return {"findings": [*told, *(finding(one, own) for one in error.diagnostics)]}
        try:
            return {"findings": told, "plays": plays, **self._begin(room, self._casting)}
        except RefusalError as refusal:
            return {"findings": told, "refused": str(refusal)}

    def _kept(self) -> Casting:
        """Who sits where after a change of the text: a person on the same seat, and others who need not be loaded."""
        others = {seat: who for seat, who in self._casting.others.items() if who in (SCRIPT, RANDOM, NOBODY)}
        return Casting(seat=self._casting.seat, others=others)

    def _plays(self, loaded: Loaded) -> Reply:
        """Who can play it."""
        program = compiled(loaded)
        seats = [{"seat": seat, "script": self._has_script(seat, program, "")} for seat in seats_of(program)]
        rivals = list(loaded.scenario.rivals) if isinstance(loaded, LoadedScenario) else []
        declared = loaded.resolved.tree.entry(loaded.resolved.kind)
        names = {self._scenario.stem, loaded.name, *([] if declared is None else [str(declared.value)])}
        return {"names": sorted(names), "rivals": rivals, "seats": seats}

    def begin(
        self,
        room: Room = _FIRST,
        player: str = "me",
        variant: str = "",
        seat: Seat = AGENT,
        others: Mapping[Seat, str] = _NOBODY_ELSE,
    ) -> Reply:
        """Begin an episode in a room; for the other arguments see `Casting`."""
        return self._begin(room, Casting(player, variant, seat, dict(others)))

    def _begin(self, room: Room, casting: Casting) -> Reply:
        if not self._texts:
            raise RefusalError("there is no scenario yet")
        if casting != self._casting:
            self._use(load(f"{self._scenario}{casting.variant}", self._texts), casting)
        stage, tracing = self._made()
        self._let_sit(_NO_ACTS)
        tracing.title, tracing.tracer.players = _title(room), dict(self._words)
        try:
            stage.begin(reset_arguments(**room.model_dump()))
        except (ValueError, RoomError) as error:
            raise RefusalError(str(error)) from None
        self._room, self._before = room, {}
        self._begin_anew()
        return self._episode([self._seat()])

    def show(self, shown: Shown) -> Reply:
        """Begin an episode, and play it as far as it is shown; without acts a script plays, if there is one."""
        player = "me"
        if shown.acts is None:
            player = "script" if self._scripts_agent(shown.variant) else "me"
        self.begin(shown.room, player, shown.variant)
        stage, _ = self._playing()
        seats = [self._seat()]
        if player == "script":
            while stage.running.all():
                seats.append(self.auto()["seat"])
        for line in shown.acts or ():
            seats.append(self.act(line=line)["seat"])
        return self._episode(seats)

    def _episode(self, seats: list[Reply]) -> Reply:
        """The episode as far as it was played, with what was seen and heard from the seat in each moment."""
        stage, tracing = self._playing()
        return {
            "episode": {
                "trace": tracing.tracer.trace().model_dump(mode="json", exclude_defaults=True)
                | {"format": "socialai-trace/1"},
                "phrases": self._phrases.sentences()[:_MOST_PHRASES],
                "rules": list(stage.env.counters()["rules"]),
                "player": self._casting.player,
                "variant": self._casting.variant,
                "others": dict(self._others),
                "room": self._room.model_dump(exclude_none=True),
                "seats": seats,
            }
        }

    def act(
        self,
        movement: str | None = None,
        sentence: str | None = None,
        line: str | None = None,
        acts: Acts = _NO_ACTS,
        stands_in: bool = False,
    ) -> Reply:
        """Play a step: a movement, a sentence, both, or a line as `socialai play` takes it.

        Args:
            movement: a word of the scenario's actions.
            sentence: what is said.
            line: both as typed, in place of the two.
            acts: what people on other seats do.
            stands_in: whether the script of the own seat plays instead, if there is one.
        """
        stage, _ = self._playing()
        if stands_in and stage.running.all() and has_script(stage.env.program, stage.own):
            return self._step(stage.env.scripted_action()[None], None, acts)
        return self._step(self._encoded(movement, sentence, line)[None], None, acts)

    def choose(
        self, movement: str | None = None, sentence: str | None = None, line: str | None = None
    ) -> Reply:
        """The action that words mean, which see `act`; nothing is played."""
        stage, _ = self._playing()
        if not stage.running.all():
            raise RefusalError(_ENDED_FOR_GUESTS)
        return {"action": self._encoded(movement, sentence, line).tolist()}

    def glance(self, seat: Seat) -> Reply:
        """What a person on another seat gets now, and can say."""
        stage, _ = self._playing()
        env, program = stage.env, stage.env.program
        if seat == stage.own or seat not in env.seats:
            raise RefusalError(f"nobody else can have the seat of {seat} in what is played now")
        moment, before = env.seat_moment(seat), self._before.get(seat)
        movement = None if moment.action is None else (*program.actions, None)[moment.action[0]]
        last = None if before is None else LastStep(movement, before, moment.success)
        view = env.view(moment.observation["image"], seat)
        described = env.describe()
        return {
            **self._read(moment.observation, moment.info, last),
            "seat": seat,
            "t": stage.steps,
            "name": names_of(env.scenario, described)[seat],
            "facing": view.facing,
            "view": sight_of(view),
            "heard": [line for line in moment.info["history"].split("\n") if line],
            "success": moment.success,
            "actions": list(program.actions),
            "phrases": self._phrases.sentences()[:_MOST_PHRASES],
        }

    def prepare(self) -> None:
        """Take a step and take it back, if none was taken yet: the first one prepares all explanations.

        Raises:
            RefusalError: there is no room yet.
        """
        stage, _ = self._playing()
        if not self._prepared and stage.running.all() and stage.steps == 0:
            self._prepared = True
            stage.rehearse({stage.own: stage.env.encode_action((None, None))[None]}, stage.env.explain)

    def auto(self, acts: Acts = _NO_ACTS) -> Reply:
        """Let the chosen player play a step; `acts` is what people on other seats do."""
        stage, _ = self._playing()
        if not stage.running.all():
            raise RefusalError(_ENDED)
        action = self._policy.act(stage.observations[stage.own])
        assert not isinstance(action, Awaitable), "internal: nobody answers later here"
        return self._step(action, thought_of(self._policy), acts)

    def back(self, to: int) -> Reply:
        """Take steps back until `to` of them are left, chance included."""
        stage, _ = self._playing()
        if not 0 <= to <= stage.steps:
            raise RefusalError(f"there are {stage.steps} steps to take back")
        while stage.steps > to:
            stage.back()
        self._before = {}
        self._begin_anew()
        for moment in stage.moments[:-1]:  # it remembers what it has seen, and what it has drawn
            self._policy.act(moment.observations[stage.own])
        return {"length": to}

    def place(self, who: str, at: tuple[int, int]) -> Reply:
        """Begin again in the same room with one thing somewhere else."""
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
        known = self._room.model_copy(update={"layout": layout})
        return self._begin(known, self._casting)

    def look(self, who: str) -> Reply:
        """The cells that a member of the cast sees now."""
        stage, tracing = self._playing()
        env, checked = stage.env, stage.env.scenario
        names = [str(name) for name in env.playing.entities]
        number = names.index(who) if who in names else 0
        if checked.entities[number].role != "npc":
            raise RefusalError(f"there is nobody called {who!r} in the cast")
        if self._gaze is None or self._gaze[:2] != (id(checked), number):
            assert self._loaded is not None, "internal: what is played was loaded"
            seats = seats_of(stage.env.program)
            own = seats.index(stage.own) if len(seats) > 1 else None
            self._gaze = id(checked), number, Gaze(self._loaded, checked, number, own)
        *_, gaze = self._gaze
        reset = reset_arguments(**self._room.model_dump())
        images = [moment.observations[stage.own]["image"][0] for moment in stage.moments]
        gaze.begin(reset.get("seed"), reset["options"], images[0])
        for moment, image in zip(tracing.tracer.moments[1:], images[1:], strict=True):
            gaze.follow([moment.action, *(seat.action for seat in moment.seats)], image)
        width = env.describe()["room"]["width"]
        cells = sorted(y * width + x for x, y in gaze.cells(begins=stage.steps == 0) if x < width)
        return {"who": who, "step": stage.steps, "side": checked.entities[number].view, "cells": cells}

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
        layout, stem = start_layout(described), self._scenario.stem
        loaded = load(str(self._scenario), texts_of(self._file, text))
        if not isinstance(loaded, LoadedSuite):
            name = f"{re.sub(r'[^a-zA-Z0-9_]', '_', stem)}_known"
            return {"suite": suite_text(name, self._scenario.name, layout), "name": f"{name}.yaml"}
        if loaded.suite.members is None or loaded.suite.sweep is not None or loaded.in_sequence:
            raise RefusalError("members that are acts or made by a tree or sweep get their layouts by hand")
        if described.get("member") not in loaded.member_names:
            raise RefusalError("what is played is no member of this suite; begin the episode again first")
        suite = loaded.resolved.tree
        entry = suite.at(("members", loaded.member_names.index(described["member"])))
        if any(part.file != suite.file for _, part in entry.walk()):
            raise RefusalError("the members are not written in this file")
        return {"text": with_layout(entry, layout)}

    def replay(self) -> Reply:
        """The episode so far as a page of its own."""
        _, tracing = self._playing()
        return {"page": replay_page([tracing.tracer.trace().portable()])}

    def write_test(self, name: str, former: str | None = None) -> Reply:
        """What was played as a test, and the file beside the scenario with it."""
        from socialai_dsl.evaluation.saved_tests import TakenDialogue, written_test

        stage, tracing = self._playing()
        if not stage.steps:
            raise RefusalError("nothing was played yet; a test is made of what was played")
        if stage.own != AGENT or self._others != self._usual(stage.env.program, self._casting):
            raise RefusalError("a test plays the agent beside scripts; begin the episode again so")
        called, reset = f"{self._scenario}{self._casting.variant}", reset_arguments(**self._room.model_dump())
        taken = TakenDialogue()
        loaded = load(called, self._texts)
        rooms = Rooms(ScenarioEnv(compile_loaded(loaded), scenarios=scenarios_of(loaded)), [taken])
        actions = [np.array(moment.action, np.int64) for moment in tracing.tracer.moments[1:]]
        play(rooms, {AGENT: ReplayedPolicy(actions)}, OneEpisode(reset))

        def read(beside: Path) -> Source | None:
            return None if former is None else Source(display_name(beside), former, beside)

        try:
            written = written_test(taken, called, reset, name, read, texts=self._texts)
        except NameTakenError as taken_name:
            raise RefusalError(f"{taken_name}; choose another name") from None
        except OptionError as error:
            raise RefusalError(error.said) from None
        except UsageError as error:
            raise RefusalError(str(error)) from None
        beside = None if written.beside is None else written.beside.name
        return {"entry": written.entry, "text": written.text, "beside": beside}

    # -- within ----------------------------------------------------------------------------------------------

    def _use(self, loaded: Loaded, casting: Casting) -> None:
        """Play this from now on, and so.

        Raises:
            RefusalError: somebody who is to play cannot.
        """
        if casting.player == SCRIPT and casting.seat == AGENT:
            loaded = closest_script(f"{self._scenario}{casting.variant}", loaded, self._texts).loaded
        program = compiled(loaded)
        _require_seat(casting, program)
        others = self._usual(program, casting) | dict(casting.others)
        filled: dict[Seat, Any] | None = None
        words: dict[Seat, str] = {}
        if others:
            loaded, filled, words = self._seated(loaded, program, casting, others)
            program = compiled(loaded)
        company, partners = remembering(filled)
        env = make_loaded(loaded, seats=company)
        endings = {ending.name: ending.text for ending in endings_of(loaded, program)}
        tracing = Tracing(Tracer(env, loaded.name, casting.player, endings, about_of(loaded), words))
        stage = Stage(env, [tracing], partners)
        policy: Policy = RandomPolicy(stage.action_sizes)
        if casting.player != "me":
            policy = _policy("oracle" if casting.player == SCRIPT else casting.player, env)
        self._loaded, self._gaze, self._game, self._casting = loaded, None, (stage, tracing), casting
        self._words = words
        self._others, self._filled, self._policy, self._prepared = others, company, policy, False
        self._phrases = Phrases(program.actions, program.sentences)
        self._text_view, self._briefing = TextView(program, "grid", seat=stage.own), brief(loaded)

    def _usual(self, program: Playable, casting: Casting) -> dict[Seat, str]:
        """Who plays other seats than the own one unless something else is said."""
        return {
            seat: SCRIPT if self._has_script(seat, program, casting.variant) else NOBODY
            for seat in seats_of(program)
            if seat != casting.seat
        }

    def _seated(
        self, loaded: Loaded, program: Playable, casting: Casting, others: Mapping[Seat, str]
    ) -> tuple[Loaded, dict[Seat, Any] | None, dict[Seat, str]]:
        """What is made for one who plays beside others, what fills their seats there, and who they are in words."""
        name = f"{self._scenario}{casting.variant}"
        if casting.seat in others:
            raise RefusalError(f"got another player for {casting.seat}, whom {casting.player} plays already")
        try:
            partners = partners_of(list(others.items()), name, program)
            loaded, filled = seating(partners, name, loaded, self._texts)
        except OptionError as error:
            raise RefusalError(error.said) from None
        except (UsageError, ValueError, OSError) as error:
            raise RefusalError(str(error)) from None
        return loaded, filled, sitting(program, partners, casting.seat)

    def _begin_anew(self) -> None:
        """Let the player forget everything."""
        self._policy.reset(np.ones(1, np.bool_), np.array([self._room.seed]))

    def _has_script(self, seat: Seat, program: Playable, variant: str) -> bool:
        """Whether a seat of a variant has a script."""
        return self._scripts_agent(variant) if seat == AGENT else has_script(program, seat)

    def _scripts_agent(self, variant: str) -> bool:
        """Whether the agent of a variant has a script, perhaps in the variant `oracle` of that."""
        try:
            return not unscripted(closest_script(f"{self._scenario}{variant}", texts=self._texts).loaded)
        except ScenarioError:  # the variant with it has mistakes, which are told where it is opened
            return False

    def _made(self) -> tuple[Stage, Tracing]:
        """What episodes are played in."""
        if self._game is None:
            raise RefusalError("there is no room yet; the scenario has mistakes")
        return self._game

    def _playing(self) -> tuple[Stage, Tracing]:
        """The same, in which an episode has begun."""
        stage, tracing = self._made()
        if not stage.moments:
            raise RefusalError("there is no room yet; the one that was asked for cannot be")
        return stage, tracing

    def _encoded(self, movement: str | None, sentence: str | None, line: str | None) -> NDArray[np.int64]:
        """The action that words mean, int64 (heads,). Raises RefusalError, which says what was probably meant."""
        stage, _ = self._playing()
        if line is not None:
            movement, sentence = self._phrases.act(line.strip())
        try:
            action: NDArray[np.int64] = stage.env.encode_action((movement, sentence))
        except ValueError:
            said = line if line is not None else sentence or movement or ""
            raise RefusalError(self._phrases.problem(said)) from None
        return action

    def _let_sit(self, acts: Acts) -> None:
        """Let those on other seats do this in the next step, and where nothing is said whoever stands in do it."""
        stage, tracing = self._made()
        for seat, stand_in in (self._filled or {}).items():
            if seat in acts:
                stage.env.fill_seat(seat, _InPlaceOf(stand_in, acts[seat]))
                tracing.tracer.players[seat] = _PERSON
            elif tracing.tracer.players[seat] == _PERSON:
                stage.env.fill_seat(seat, stand_in)

    def _step(self, action: NDArray[np.int64], thought: Thought | None, acts: Acts) -> Reply:
        stage, tracing = self._playing()
        if not stage.running.all():
            raise RefusalError(_ENDED)
        seats = [seat for seat in stage.env.seats if seat != stage.own]
        images = {seat: stage.env.seat_moment(seat).observation["image"] for seat in seats}
        self._let_sit(acts)
        before, tracing.thought = tracing.tracer.counts(), thought
        image = stage.observations[stage.own]["image"][0].copy()
        try:
            step = stage.step({stage.own: action})
        except (ValueError, RoomError) as error:
            player = self._casting.player
            who = "" if player == "me" else f"{player} chose what cannot be done: "
            raise RefusalError(f"{who}{error}") from None
        self._before = images
        more = tracing.tracer.trace(before).model_dump(mode="json", exclude_defaults=True)
        movement = (*stage.env.program.actions, None)[action[0, 0]]
        success = bool(step.success[0]) if step.ended[0] else None
        return {"more": more, "seat": self._seat(LastStep(movement, image, success))}

    def _seat(self, last: LastStep | None = None) -> Reply:
        """What whoever plays is told, sees and hears, as a language model reads it."""
        stage, _ = self._playing()
        observation = {name: value[0] for name, value in stage.observations[stage.own].items()}
        return self._read(observation, stage.info, last)

    def _read(
        self, observation: Mapping[str, NDArray[Any]], info: Mapping[str, Any], last: LastStep | None
    ) -> Reply:
        stage, _ = self._playing()
        assert self._text_view is not None, "internal: what is played has a view"
        member = {"member": stage.info.get("member")}
        return {
            "told": self._text_view.task(self._briefing.text(member["member"])),
            "seen": self._text_view.observe(observation, info, last),
            "compass": self._text_view.by_compass(member),
        }


ASKED: Final[Mapping[str, Callable[..., Reply]]] = {
    "draw": Session.draw,
    "begin": Session.begin,
    "show": Session.show,
    "act": Session.act,
    "choose": Session.choose,
    "glance": Session.glance,
    "auto": Session.auto,
    "back": Session.back,
    "place": Session.place,
    "look": Session.look,
    "layout": Session.layout,
    "write_layout": Session.write_layout,
    "replay": Session.replay,
    "write_test": Session.write_test,
}
"""What a window may ask a session for, by name."""


def _require_seat(casting: Casting, program: Playable) -> None:
    """See that the player's seat exists, and has a script if that plays. Raises RefusalError."""
    seats = seats_of(program)
    if casting.seat not in seats:
        raise RefusalError(f"there is no seat {casting.seat!r}, only {', '.join(seats)}")
    if casting.player == SCRIPT and not has_script(program, casting.seat):
        oracle = ", and there is no variant `oracle`" if casting.seat == AGENT else ""
        raise RefusalError(f"the {casting.seat} has no script: it follows no frame{oracle}")


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


def _title(room: Room) -> str:
    """Which room it is, in words."""
    if room.layout is not None:
        return "a layout"
    if room.test_episode is not None:
        return f"test episode {room.test_episode}"
    return f"seed {room.seed}" + ("" if room.index is None else f", room {room.index}")
