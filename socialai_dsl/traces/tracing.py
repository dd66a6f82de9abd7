"""Traces an episode while it is played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.envs.seats import SeatMoment
from socialai_dsl.envs.view import View
from socialai_dsl.program import VIEW
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.render.gestures import Gesture
from socialai_dsl.render.marks import Marks
from socialai_dsl.traces import document
from socialai_dsl.traces.document import (
    Line,
    Member,
    Moment,
    Outcome,
    Reply,
    Rule,
    SeatPart,
    Thought,
    Trace,
)
from socialai_dsl.traces.state import leaves, names_of
from socialai_dsl.traces.steps import describe_step, heard_line
from socialai_dsl.vocabulary import NOUN

Action = NDArray[np.int64]
Answers = Sequence[tuple[str, str, str | None]]
"""What language models answered, each with what was wrong with it, and the seat of the model where several play."""
_AGENT: Final = "agent"
_SHOWN: Final = 400
"""The most characters of an answer that are shown; a model's last words hold its action."""


@dataclass(frozen=True)
class _Seen:
    """What a moment was like, to which the next one is compared."""

    member: str | None
    cast: list[Member]
    room: tuple[int, int]
    cells: list[int]
    views: list[list[int]]
    names: dict[str, str]
    state: dict[str, Any]


class Tracer:
    """Traces an episode while it is played; steps can be taken back.

    Args:
        env: the environment that plays the episode; of one made with `seats`, all seats are traced.
        scenario: its name, for people.
        agent: the player, for people.
        endings: the text to show for each outcome.
        about: a sentence about the scenario.
        players: who has other seats than the player, for people.

    Attributes:
        moments: the moments so far.
        players: see above.
    """

    def __init__(
        self,
        env: Any,
        scenario: str,
        agent: str,
        endings: Mapping[str, str],
        about: str = "",
        players: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._env, self._program, self.players = env.unwrapped, env.unwrapped.program, dict(players)
        self._scenario, self.agent, self._endings, self._about = scenario, agent, endings, about
        self._looks: dict[tuple[int, int, int, int], int] = {}
        self._marks: dict[Marks, int] = {}
        self._texts: dict[str, int] = {}
        self._rules: dict[Rule, int] = {}
        self._seen: list[_Seen] = []
        self.moments: list[Moment] = []
        self._episode = ""

    def begin(self, episode: str, observation: Mapping[str, NDArray[Any]], info: Mapping[str, Any]) -> Moment:
        """Add the moment after `env.reset`, which returned these; `episode` says in words which one it is."""
        self._episode, self._seen, self.moments = episode, [], []
        views = self._views(observation)
        return self._add(views, info, seats=[SeatPart(**self._seen_from(view)) for view in views[1:]])

    def step(
        self,
        action: Sequence[int] | Action,
        observation: Mapping[str, NDArray[Any]],
        reward: float,
        terminated: bool,
        truncated: bool,
        info: Mapping[str, Any],
        *,
        thought: Thought | None = None,
        replies: Answers = (),
    ) -> Moment:
        """Add the moment after `env.step`, which returned these."""
        explained, views = self._env.explain(), self._views(observation)
        over = self._outcome(info) if terminated or truncated else None
        own = SeatMoment(
            {}, dict(info), np.asarray(action), None, reward, None if over is None else over.success
        )
        moments = [own] if len(views) == 1 else list(map(self._env.seat_moment, self._env.seats))
        if over is not None and over.success != moments[0].success:
            over = over.model_copy(update={"success": bool(moments[0].success)})
        agent, *others = map(self._part, moments)
        return self._add(
            views,
            info,
            **agent,
            seats=[
                SeatPart(**part, **self._seen_from(view), success=moment.success)
                for part, view, moment in zip(others, views[1:], moments[1:], strict=True)
            ],
            fired=[self._rule(entry) for entry in explained["fired"]],
            others=[(self._rule(entry), _number(self._texts, entry["why"])) for entry in explained["others"]],
            thought=thought,
            replies=_replies(replies),
            ended=over,
        )

    def _part(self, moment: SeatMoment) -> dict[str, Any]:
        """What was done on a seat, and what was heard and earned there."""
        t, utterance = len(self.moments), moment.info["utterance"]
        nothing = np.zeros(len(self._env.action_space.nvec), np.int64)
        step = describe_step(self._program, nothing if moment.action is None else moment.action, t, utterance)
        called = list(self._seen[-1].names.values())
        who = {name: key for key, name in self._seen[-1].names.items() if called.count(name) == 1}
        heard = [heard_line(t, line) for line in step.heard]
        return {
            "action": None if moment.action is None else tuple(map(int, moment.action)),
            "did": moment.did if moment.action is None else step.action,
            "said": step.said,
            "heard": [Line(text=line.text, name=line.speaker, who=who.get(line.speaker)) for line in heard],
            "reward": round(float(moment.reward), 6),
        }

    def _views(self, observation: Mapping[str, NDArray[Any]]) -> list[View]:
        """What is seen from each seat, the agent's first."""
        seats, env = self._env.seats, self._env
        if len(seats) == 1:
            return [env.view(observation["image"])]
        return [env.view(env.seat_moment(seat).observation["image"], seat) for seat in seats]

    def _seen_from(self, view: View) -> dict[str, Any]:
        """What somebody sees beside the cells of the view."""
        return {
            "view_gestures": _gestures(view.gestures, VIEW),
            "view_held": [(y * VIEW + x, self._look(code)) for (x, y), code in view.held.items()],
            "view_marks": self._marked(view.marks, VIEW),
        }

    def cut_short(self, replies: Answers, ended: Outcome) -> Moment:
        """The moment in which a language model's answers without an action ended the episode."""
        last = self.moments[-1]
        same = ("agent", "below", "gestures", "held", "marks", "view_gestures", "view_held", "view_marks")
        kept = {name: getattr(last, name) for name in same}
        seen = ("view_gestures", "view_held", "view_marks")
        kept["seats"] = [SeatPart(**{name: getattr(seat, name) for name in seen}) for seat in last.seats]
        self.moments.append(Moment(t=len(self.moments), replies=_replies(replies), ended=ended, **kept))
        self._seen.append(self._seen[-1])
        return self.moments[-1]

    def back(self) -> None:
        """Take the last step back."""
        self.moments.pop()
        self._seen.pop()

    def trace(self, since: Counts | None = None) -> Trace:
        """The trace so far.

        Args:
            since: counts from `counts`; looks, marks, texts, rules and moments up to these counts are left out.
        """
        looks, marks, texts, rules, moments = since or (0, 0, 0, 0, 0)
        program = self._program
        return Trace(
            scenario=self._scenario,
            about=self._about,
            agent=self.agent,
            **self._seats(),
            episode=self._episode,
            actions=list(program.actions),
            templates=list(program.templates),
            nouns=list(program.sentences.nouns),
            slots={slot.name: list(slot.words) for slot in program.sentences.slots if slot.name != NOUN},
            looks=list(self._looks)[looks:],
            marks=[list(one) for one in self._marks][marks:],
            texts=list(self._texts)[texts:],
            rules=list(self._rules)[rules:],
            moments=self.moments[moments:],
        )

    def _seats(self) -> dict[str, Any]:
        """Who has which seat, where there are several."""
        seats = self._env.seats
        if len(seats) == 1:
            return {}
        names = [self._seen[0].names[seat] for seat in seats] if self._seen else []
        own = self._env.seat_names[0]
        return {"seats": list(seats), "names": names, "own": own, "players": self.players}

    def counts(self) -> Counts:
        """How many looks, marks, texts, rules and moments there are."""
        looks, marks, texts = len(self._looks), len(self._marks), len(self._texts)
        return looks, marks, texts, len(self._rules), len(self.moments)

    def _add(
        self,
        views: Sequence[View],
        info: Mapping[str, Any],
        seats: Sequence[SeatPart],
        **more: Any,
    ) -> Moment:
        """Add a moment, with what differs from the one before it."""
        scene, described = self._env.scene(_AGENT), self._env.describe()
        height, width = scene.codes.shape[:2]
        names = names_of(self._env.scenario, described)
        cast = [
            Member(key=str(entity), name=names[str(entity)], look=look)
            for entity, look in self._env.looks_of_npcs().items()
        ]
        if len(views) == 1:
            del names[_AGENT]
        seen = _Seen(
            info.get("member"),
            cast,
            (width, height),
            self._numbers(scene.codes),
            [self._numbers(view.codes) for view in views],
            names,
            leaves(described),
        )
        before = self._seen[-1] if self._seen else None
        seen_before = [None] * len(views) if before is None else before.views
        of_seats = [
            seat if now == then else seat.model_copy(update={"view": now})
            for seat, now, then in zip(seats, seen.views[1:], seen_before[1:], strict=True)
        ]
        moment = Moment(
            t=len(self.moments),
            agent=scene.agent,
            below=[(y * width + x, self._look(code)) for (x, y), code in scene.below.items()],
            gestures=_gestures(scene.gestures, width),
            held=[(y * width + x, self._look(code)) for (x, y), code in scene.held.items()],
            marks=self._marked(scene.marks, width),
            seats=of_seats,
            **self._seen_from(views[0]),
            **_differences(before, seen),
            **more,
        )
        self._seen.append(seen)
        self.moments.append(moment)
        return moment

    def _numbers(self, codes: NDArray[np.uint8]) -> list[int]:
        return [self._look(tuple(code)) for row in codes.tolist() for code in row]

    def _look(self, code: tuple[int, int, int, int]) -> int:
        return _number(self._looks, code)

    def _marked(self, marks: Mapping[tuple[int, int], Marks], width: int) -> list[tuple[int, int]]:
        return [(y * width + x, _number(self._marks, one)) for (x, y), one in marks.items()]

    def _rule(self, entry: Mapping[str, Any]) -> int:
        return _number(self._rules, Rule(**{key: entry[key] for key in Rule.model_fields if key in entry}))

    def _outcome(self, info: Mapping[str, Any]) -> Outcome:
        name = outcome_name(info)
        return Outcome(name=name, success=bool(info["success"]), text=self._endings.get(name, name))


def sight_of(view: View) -> dict[str, Any]:
    """What somebody sees, without numbered looks, as `document.Sight` has it."""
    return {
        "cells": view.codes.reshape(-1, 4).tolist(),
        "gestures": _gestures(view.gestures, VIEW),
        "held": [(y * VIEW + x, code) for (x, y), code in view.held.items()],
        "marks": [(y * VIEW + x, list(marks)) for (x, y), marks in view.marks.items()],
    }


Counts = tuple[int, int, int, int, int]


def _replies(answers: Answers) -> list[Reply]:
    return [
        Reply(text=text if len(text) <= _SHOWN else f"… {text[-_SHOWN:]}", error=error, seat=seat)
        for text, error, seat in answers
    ]


def _number(known: dict[Any, int], one: Any) -> int:
    return known.setdefault(one, len(known))


def _gestures(found: Mapping[tuple[int, int], Gesture], width: int) -> list[document.Gesture]:
    return [
        (
            y * width + x,
            -1 if gesture.pointing is None else gesture.pointing,
            gesture.act,
            *(gesture.cell or ()),
        )
        for (x, y), gesture in found.items()
        if gesture.words
    ]


def _differences(before: _Seen | None, now: _Seen) -> dict[str, Any]:
    """What a moment says of what it is like, since the one before it."""
    if before is None or (before.room, before.member) != (now.room, now.member):
        return {
            "member": now.member,
            "cast": now.cast,
            "room": now.room,
            "cells": list(enumerate(now.cells)),
            "view": now.views[0],
            "state": now.state,
        }
    cells = [(cell, look) for cell, look in enumerate(now.cells) if look != before.cells[cell]]
    gone: dict[str, Any] = {key: None for key in before.state if key not in now.state}
    changed = {key: value for key, value in now.state.items() if before.state.get(key, ...) != value}
    return {
        "cast": None if now.cast == before.cast else now.cast,
        "cells": cells,
        "view": None if now.views[0] == before.views[0] else now.views[0],
        "state": gone | changed,
    }
