"""Plays the tests of a scenario: the acts of each, what must be heard, and what must be so."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.checking.tests import Tested
from socialai_dsl.compilation import compile_scenario
from socialai_dsl.diagnostics import Diagnostic, ScenarioError
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs.asking import Companion
from socialai_dsl.envs.options import reset_arguments
from socialai_dsl.envs.scenario_env import SILENCE, ScenarioEnv
from socialai_dsl.envs.starts import misfit_of
from socialai_dsl.loader.layouts import read_layout
from socialai_dsl.loader.reader import display_name, read_source
from socialai_dsl.semantics.dialogues import OPEN
from socialai_dsl.semantics.plans import ClaimPlan, DialoguePlan, DialogueStepPlan, LinePlan, RulePlan
from socialai_dsl.semantics.terms import Const
from socialai_dsl.semantics.typed import trace_command
from socialai_dsl.source import Node, Span
from socialai_dsl.vocabulary import TRUTHS


@dataclass(frozen=True)
class Performed:
    """A test as it was played in one room.

    Attributes:
        findings: what is wrong there.
        reset: the arguments of `env.reset`; empty if there is no such room.
        done: the acts, as typed.
    """

    findings: tuple[Diagnostic, ...]
    reset: Mapping[str, Any]
    done: tuple[str, ...]


SEEDS: Final = 5
"""In how many rooms a test is played that does not say in which."""
_MOST_REASONS: Final = 6
"""How many rules a finding tells of."""


def seeds_of(plan: DialoguePlan) -> Sequence[int]:
    """The seeds of the rooms in which a test is played."""
    room = plan.room
    if room.test_episode is not None:
        return (0,)
    return range(SEEDS) if room.seed is None else (room.seed,)


class Rehearsal:
    """Plays tests of one scenario.

    Args:
        tested: the scenario with its tests.
    """

    def __init__(self, tested: Tested) -> None:
        self._tested = tested
        checked = tested.loaded.checked
        self._env = ScenarioEnv(compile_scenario(checked), scenarios=(checked,))

    def play(self, plan: DialoguePlan, judged: bool = True) -> Performed:
        """Play a test in its rooms, up to the first in which something is wrong; as it went in the last one played.

        Args:
            plan: one of the tests.
            judged: whether what is heard and what is so then is looked at, or only that the acts can be done.
        """
        companion = None
        if judged and plan.values:
            loaded = self._tested.loaded
            asking = replace(loaded, checked=replace(loaded.checked, probes=plan.values))
            companion = Companion(asking)
        performed = Performed((), {}, ())
        for seed in seeds_of(plan):
            performance = _Performance(self._env, self._tested, plan, seed, companion)
            found = tuple(performance.findings(judged))
            performed = Performed(found, performance.reset, tuple(performance.done))
            if found:
                break
        return performed


@dataclass(frozen=True)
class _End:
    """How an episode ended: the outcome's name, and whether it is a success."""

    name: str
    success: bool

    def is_called(self, word: str) -> bool:
        """Whether a test means this by `ends`."""
        if word in ("success", "failure"):
            return self.success is (word == "success") and self.name != "timeout"
        return self.name == word


class _Performance:
    """A test while it is played in one room.

    Attributes:
        reset, done: see `Performed`.
    """

    def __init__(
        self, env: ScenarioEnv, tested: Tested, plan: DialoguePlan, seed: int, companion: Companion | None
    ) -> None:
        self._env, self._tested, self._plan, self._seed = env, tested, plan, seed
        self._companion = companion
        self.reset: dict[str, Any] = {}
        self._actions: list[NDArray[np.int64]] = []
        self.done: list[str] = []
        self._earned = 0.0
        self._end: _End | None = None
        self._step = 0

    def findings(self, judged: bool) -> Iterator[Diagnostic]:
        """What is wrong with the first step with which something is, or with the end."""
        try:
            self._begin()
        except ValueError as error:
            yield self._unfit(error)
            return
        except ScenarioError as error:
            place = self._room.value_span(("layout",))
            for finding in error.diagnostics:
                there = "" if finding.code == "S007" else f"{finding.span}: "
                yield Diagnostic(finding.code, there + finding.message, place, hint=finding.help)
            return
        except RoomError as error:
            yield self._finding("S803", f"there is no such room: {error}", self._room.key_span(), ())
            return
        for step in self._plan.steps:
            self._step += 1
            heard: list[str] = []
            for number, act in enumerate(step.acts):
                if self._end is not None:
                    yield self._too_late(number)
                    return
                heard += self._act(act, step.typed[number])
            found = list(self._wrong(step, heard)) if judged else []
            yield from found
            if found:
                return
        if judged:
            yield from self._wrong_end()

    # -- the room ------------------------------------------------------------------------------------------------

    @property
    def _test(self) -> Node:
        return self._tested.written.at((self._plan.name,))

    @property
    def _room(self) -> Node:
        return self._test.nearest(("room",))

    def _file(self, name: str) -> Path:
        """The file with a layout, which is named as seen from the file of the test."""
        source = self._test.source
        return (source.path.parent if source.path is not None else Path()) / name

    def _layout(self) -> Any:
        """The layout. Raises ValueError or ScenarioError where the file with it is none."""
        layout = self._plan.room.layout
        if not isinstance(layout, str):
            return layout
        file = self._file(layout)
        if not file.resolve().is_relative_to(self._file("").resolve()):
            raise ValueError(f"layout: {layout} lies outside of the folder of the test")
        return read_layout(replace(read_source(file), name=layout))

    def _begin(self) -> None:
        room = self._plan.room
        self.reset = reset = reset_arguments(self._seed, room.index, room.test_episode, self._layout())
        observation, _ = self._env.reset(**reset)
        if self._companion is not None:
            self._companion.begin(reset.get("seed"), reset["options"], observation["image"])

    def _unfit(self, error: ValueError) -> Diagnostic:
        """The finding for a room that cannot be."""
        layout = self._plan.room.layout
        if isinstance(layout, dict):
            return misfit_of(error, layout, self._room.nearest(("layout",)))
        return Diagnostic("S204", str(error), self._room.value_span(("layout",)))

    def _act(self, act: tuple[int, ...], typed: str) -> list[str]:
        """Do something; what is heard."""
        action = np.array(act, np.int64)
        observation, reward, terminated, truncated, info = self._env.step(action)
        self.done.append(typed)
        self._actions.append(action)
        self._earned += reward
        if terminated or truncated:
            self._end = _End(info["outcome"], bool(info["success"]))
        if self._companion is not None:
            self._companion.follow([action], observation["image"])
        return [] if info["utterance"] == SILENCE else info["utterance"].split("\n")

    # -- what must be so -----------------------------------------------------------------------------------------

    def _wrong(self, step: DialogueStepPlan, heard: list[str]) -> Iterator[Diagnostic]:
        values = self._companion.values(begins=not self.done) if self._companion is not None else {}
        if step.hears is not None:
            expected = [_text(line, values) for line in step.hears]
            if expected != heard:
                yield self._misheard(step, expected, heard)
        for claim in step.claims:
            holds = values[claim.value.name] == TRUTHS[True]
            if holds is not claim.expected:
                yield self._untrue(claim, holds)

    def _misheard(self, step: DialogueStepPlan, expected: list[str], heard: list[str]) -> Diagnostic:
        missing = [line for line in expected if line not in heard]
        lines = zip(step.hears or (), expected, strict=True)
        span = next((plan.span for plan, line in lines if line in missing), step.span)
        said = f"expected {_listed(expected)}, heard {_listed(heard)}"
        unexpected = self._speakers([line for line in heard if line not in expected])
        reasons = [
            *self._rules("fired", unexpected, "say:"),
            *self._rules("others", self._speakers(missing), "say:"),
        ]
        return self._finding("S803", said, span, reasons)

    def _untrue(self, claim: ClaimPlan, holds: bool) -> Diagnostic:
        said = f"`{claim.words}` is {'true' if holds else 'false'}, expected {'false' if holds else 'true'}"
        part: list[str] = []
        if claim.state:
            (member,) = claim.members
            now = self._described(member).get("state")
            said = f"`{member}` is {'elsewhere' if now is None else f'in `{now}`'}, expected `{claim.state}`"
        elif claim.expected and self.done:
            why = self._false_part(claim)
            part = [f"-> {why}"] if why != f"{claim.words} is false" else []
        rules = [*part, *self._rules("others", claim.members, ""), *self._rules("fired", claim.members, "")]
        return self._finding("S803", said, claim.span, rules)

    def _false_part(self, claim: ClaimPlan) -> str:
        """The part of a condition that is false, with its values, as they are told of a rule that did not fire.

        The episode is played again with a rule of the world that has this condition, and does nothing.
        """
        checked, asked = self._tested.loaded.checked, claim.value.answer.value
        rule = RulePlan(claim.value.name, asked.site, claim.span, when=asked)
        known = {item.path: item for item in (*claim.value.remembered, *checked.remembered)}
        ruled = replace(checked, rules=(*checked.rules, rule), remembered=tuple(known.values()))
        env = ScenarioEnv(compile_scenario(ruled), scenarios=(ruled,))
        env.reset(**self.reset)
        for action in self._actions:
            env.step(action)
        others = (entry for entry in env.explain()["others"] if entry["name"] == rule.name)
        return next((str(entry["why"]) for entry in others), "it was not asked")

    def _wrong_end(self) -> Iterator[Diagnostic]:
        if self._plan.ends is not None:
            word, span = self._plan.ends
            if self._end is None and word != OPEN:
                said = f"the episode goes on, expected `{word}`"
                yield self._finding("S803", said, span, self._rules("others", ("outcome",), ""))
            elif self._end is not None and not self._end.is_called(word):
                said = f"the episode ended with `{self._end.name}`, expected `{word}`"
                yield self._finding("S803", said, span, self._rules("fired", ("outcome",), ""))
        if self._plan.reward is not None:
            reward, span = self._plan.reward
            if abs(reward - self._earned) >= 0.0005:
                yield self._finding("S803", f"earned {self._earned:.3f}, expected {reward:g}", span, ())

    def _too_late(self, number: int) -> Diagnostic:
        """The finding for an act after the end."""
        written = self._test.at(("play", self._step - 1, "do"))
        span = written.value_span((number,)) if written.children is not None else written.value_span()
        name = self._end.name if self._end is not None else ""
        said = f"the episode ended with `{name}` before, after {len(self.done)} acts"
        return self._finding("S804", said, span, self._rules("fired", ("outcome",), ""))

    # -- why -----------------------------------------------------------------------------------------------------

    def _finding(self, code: str, said: str, span: Span, reasons: Iterable[str]) -> Diagnostic:
        step = f"step {self._step}: " if self._step else ""
        hint = f"to see it: {self._command()}"
        return Diagnostic(code, f"`{self._plan.name}`, {step}{said}", span, hint=hint, notes=tuple(reasons))

    def _speakers(self, lines: Iterable[str]) -> list[str]:
        """Who says lines, as far as their names are heard."""
        names: dict[str, list[str]] = {}
        for entity in self._env.scenario.entities:
            key = str(entity.key) if entity.index is None else f"{entity.key}[{entity.index}]"
            own, term = self._described(key), entity.name
            fixed = term.type.words[term.value - term.type.low] if isinstance(term, Const) else key
            names.setdefault(str(own.get("name", fixed)), []).append(key)
        spoken = [line.partition(": ")[0] for line in lines]
        return list(dict.fromkeys(member for name in spoken for member in names.get(name, self._npcs())))

    def _described(self, called: str) -> dict[str, Any]:
        """What is known of a member of the cast or a thing now."""
        key, _, index = called.partition("[")
        described = self._env.describe().get(key, {})
        return dict(described[int(index[:-1])] if index else described)

    def _npcs(self) -> list[str]:
        return [frame.member for frame in self._env.scenario.frames if frame.entity != 0]

    def _rules(self, which: str, who: Collection[str], key: str) -> list[str]:
        """Rules of the last step that `fired`, or the `others` with their reasons.

        Args:
            which: one of the two.
            who: the members of the cast, or `outcome`.
            key: those of their rules that have it, if any has.
        """
        if not self.done or not who:
            return []
        found = [rule for rule in self._env.explain()[which] if rule["who"] in who]
        found = [rule for rule in found if key in rule["words"]] or ([] if which == "fired" else found)
        return [line for rule in found[:_MOST_REASONS] for line in _told(rule)]

    def _command(self) -> str:
        """What shows the same in a terminal."""
        room, words = self._plan.room, list[str]()
        if room.test_episode is not None:
            words += ["--test-episode", str(room.test_episode)]
        else:
            words += ["--seed", str(self._seed)]
        if room.index is not None:
            words += ["--index", str(room.index)]
        if isinstance(room.layout, str):
            words += ["--layout", display_name(self._file(room.layout))]
        elif room.layout is not None:
            words += ["--layout", json.dumps(room.layout, ensure_ascii=False)]
        return trace_command(self._tested.called, words, self.done)


def _text(line: LinePlan, values: dict[str, str | None]) -> str:
    """A line with its values, `<?>` where something is not there."""
    pieces = (piece if isinstance(piece, str) else values[piece.name] for piece in line.pieces)
    return "".join("<?>" if piece is None else piece for piece in pieces)


def _listed(lines: Sequence[str]) -> str:
    return ", ".join(f'"{line}"' for line in lines) or "nothing"


def _told(rule: dict[str, Any]) -> Iterator[str]:
    """A rule in the words of `socialai trace`."""
    state = f" in {rule['state']}" if "state" in rule else ""
    mark = "fired" if rule["fired"] else "not  "
    yield f"{mark}  {rule['who']}{state}  {rule['at']}  {rule['words']}"
    if "why" in rule:
        yield f"       -> {rule['why']}"
