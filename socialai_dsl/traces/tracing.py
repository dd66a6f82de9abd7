"""Traces an episode while it is played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.program import VIEW
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.render.gestures import Gesture
from socialai_dsl.render.marks import Marks
from socialai_dsl.semantics.terms import Const
from socialai_dsl.traces import document
from socialai_dsl.traces.document import Line, Member, Moment, Outcome, Reply, Rule, Thought, Trace
from socialai_dsl.traces.state import leaves
from socialai_dsl.traces.steps import describe_step, heard_line
from socialai_dsl.vocabulary import NOUN

Action = NDArray[np.int64]
Answers = Sequence[tuple[str, str]]
"""What a language model answered, each with what was wrong with it."""
_SHOWN: Final = 400
"""The most characters of an answer that are shown; a model's last words hold its action."""


@dataclass(frozen=True)
class _Seen:
    """What a moment was like, to which the next one is compared."""

    member: str | None
    cast: list[Member]
    room: tuple[int, int]
    cells: list[int]
    view: list[int]
    state: dict[str, Any]


class Tracer:
    """Traces an episode while it is played; steps can be taken back.

    Args:
        env: the environment that plays the episode.
        scenario: its name, for people.
        agent: the player, for people.
        endings: the text to show for each outcome.
        about: a sentence about the scenario.

    Attributes:
        moments: the moments so far.
    """

    def __init__(
        self, env: Any, scenario: str, agent: str, endings: Mapping[str, str], about: str = ""
    ) -> None:
        self._env, self._program = env.unwrapped, env.unwrapped.program
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
        return self._add(observation, info)

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
        step = describe_step(self._program, action, len(self.moments), info["utterance"])
        explained = self._env.explain()
        called = [member.name for member in self._seen[-1].cast]
        names = {m.name: m.key for m in self._seen[-1].cast if called.count(m.name) == 1}
        heard = [heard_line(step.t, line) for line in step.heard]
        return self._add(
            observation,
            info,
            action=tuple(int(part) for part in action),
            did=step.action,
            said=step.said,
            heard=[Line(text=line.text, name=line.speaker, who=names.get(line.speaker)) for line in heard],
            reward=round(float(reward), 6),
            fired=[self._rule(entry) for entry in explained["fired"]],
            others=[(self._rule(entry), _number(self._texts, entry["why"])) for entry in explained["others"]],
            thought=thought,
            replies=_replies(replies),
            ended=self._outcome(info) if terminated or truncated else None,
        )

    def cut_short(self, replies: Answers, ended: Outcome) -> Moment:
        """The moment in which a language model's answers without an action ended the episode."""
        last = self.moments[-1]
        kept = {
            name: getattr(last, name)
            for name in (
                "agent",
                "below",
                "gestures",
                "held",
                "marks",
                "view_gestures",
                "view_held",
                "view_marks",
            )
        }
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

    def counts(self) -> Counts:
        """How many looks, marks, texts, rules and moments there are."""
        looks, marks, texts = len(self._looks), len(self._marks), len(self._texts)
        return looks, marks, texts, len(self._rules), len(self.moments)

    def _add(self, observation: Mapping[str, NDArray[Any]], info: Mapping[str, Any], **more: Any) -> Moment:
        """Add a moment, with what differs from the one before it."""
        scene, described = self._env.scene(), self._env.describe()
        view = self._env.view(observation["image"])
        height, width = scene.codes.shape[:2]
        seen = _Seen(
            info.get("member"),
            self._cast(described),
            (width, height),
            self._numbers(scene.codes),
            self._numbers(view.codes),
            leaves(described),
        )
        before = self._seen[-1] if self._seen else None
        moment = Moment(
            t=len(self.moments),
            agent=scene.agent,
            below=[(y * width + x, self._look(code)) for (x, y), code in scene.below.items()],
            gestures=_gestures(scene.gestures, width),
            view_gestures=_gestures(view.gestures, view.codes.shape[1]),
            held=[(y * width + x, self._look(code)) for (x, y), code in scene.held.items()],
            view_held=[(y * VIEW + x, self._look(code)) for (x, y), code in view.held.items()],
            marks=self._marked(scene.marks, width),
            view_marks=self._marked(view.marks, VIEW),
            **_differences(before, seen),
            **more,
        )
        self._seen.append(seen)
        self.moments.append(moment)
        return moment

    def _cast(self, described: Mapping[str, Any]) -> list[Member]:
        """The NPCs, with the names by which they are heard."""
        names = {(entity.key, entity.index): entity.name for entity in self._env.scenario.entities}
        members = []
        for entity, look in self._env.looks_of_npcs().items():
            found = described[entity.key] if entity.index is None else described[entity.key][entity.index]
            term = names[entity.key, entity.index]
            fixed = term.type.words[term.value - term.type.low] if isinstance(term, Const) else str(entity)
            members.append(Member(key=str(entity), name=found.get("name", fixed), look=look))
        return members

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


Counts = tuple[int, int, int, int, int]


def _replies(answers: Answers) -> list[Reply]:
    return [
        Reply(text=text if len(text) <= _SHOWN else f"… {text[-_SHOWN:]}", error=error)
        for text, error in answers
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
            "view": now.view,
            "state": now.state,
        }
    cells = [(cell, look) for cell, look in enumerate(now.cells) if look != before.cells[cell]]
    gone: dict[str, Any] = {key: None for key in before.state if key not in now.state}
    changed = {key: value for key, value in now.state.items() if before.state.get(key, ...) != value}
    return {
        "cast": None if now.cast == before.cast else now.cast,
        "cells": cells,
        "view": None if now.view == before.view else now.view,
        "state": gone | changed,
    }
