"""`explain()` on shipped scenarios: what it says has fired is what fired in the reference interpreter."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.frontend import LoadedScenario, load
from tests.quick import one_in
from tests.reference import frames, rules
from tests.reference.interpreter import Reference
from tests.scenarios.playing import BEYOND

ROOT = Path(__file__).parents[2]
NAMES = [
    *("talkitout", "talkitout+oracle", "talkitout+as_coded", "dance", "dance+oracle", "cointhief", "cointhief+oracle"),
    *("diverse_exit", "diverse_exit+oracle", "showme+oracle", "help", "help+oracle", "help_as_helper+oracle"),
    *(f"{name}+oracle" for name in BEYOND),
    *("school/apple_stealing+oracle", "school/levers+oracle", "school/marble_pass+oracle"),
    *("school/color_match_switches+oracle", "school/boxes+oracle"),
]  # fmt: skip


@contextmanager
def noting(fired: list[str]) -> Iterator[None]:
    """Meanwhile the reference interpreter notes the address of every rule and step that fires."""
    plain = frames.FrameRunner.fires, frames.FrameRunner.end_step, rules.apply, rules.assign

    def fires(self: frames.FrameRunner, rule: Any, path: str) -> Any:
        found = plain[0](self, rule, path)
        if found is not None:
            fired.append(path)
        return found

    def end_step(self: frames.FrameRunner, frame: Any, turn: Any) -> None:
        before, rounds = self.me.state, dict(self.me.rounds)
        plain[1](self, frame, turn)
        if (self.me.state, self.me.rounds) != (
            before,
            rounds,
        ):  # a step that is repeated alone changes the rounds
            fired.append(f"{self.me.key} steps {before}")

    def apply(rule: Any, path: str, *rest: Any) -> None:
        assigned: list[bool] = []

        def assign(*given: Any) -> None:
            assigned.append(True)
            plain[3](*given)

        rules.assign = assign  # type: ignore[assignment]
        try:
            plain[2](rule, path, *rest)
        finally:
            rules.assign = plain[3]
        if assigned:
            fired.append(path)

    frames.FrameRunner.fires, frames.FrameRunner.end_step = fires, end_step  # type: ignore[method-assign]
    rules.apply = apply
    try:
        yield
    finally:
        frames.FrameRunner.fires, frames.FrameRunner.end_step = plain[:2]  # type: ignore[method-assign]
        rules.apply = plain[2]


def addresses(loaded: LoadedScenario) -> dict[tuple[str, str, str], str]:
    """What the reference calls each rule and step, by who, name and place in `explain()`."""
    known = {}
    for frame in loaded.checked.frames:
        for state in frame.states:
            for rule in (*state.first, *state.then):
                known[frame.member, rule.name, f"{rule.span.file}:{rule.span.line}"] = rule.site
        for number, step in enumerate(frame.steps):
            place = f"{step.span.file}:{step.span.line}"
            known[frame.member, step.name, place] = f"{frame.member} steps {number}"
    for rule in loaded.checked.rules:
        known["world", rule.name, f"{rule.span.file}:{rule.span.line}"] = rule.site
    return known


@pytest.mark.parametrize("name", one_in(4, NAMES, "plays every scenario on the slow interpreter"))
def test_what_fired_is_what_fired_in_the_reference(name: str) -> None:
    loaded = load(
        str(ROOT / "scenarios" / f"{name.partition('+')[0]}.yaml") + "".join(name.partition("+")[1:])
    )
    assert isinstance(loaded, LoadedScenario)
    env, reference, known = (
        ScenarioEnv(compile_scenario(loaded.checked), scenarios=[loaded.checked]),
        Reference(loaded.resolved),
        addresses(loaded),
    )
    scripted = any(frame.entity == 0 for frame in loaded.checked.frames)
    rng = np.random.default_rng(4)
    seen = 0
    for episode in range(3):
        env.reset(seed=2) if episode == 0 else env.reset()
        reference.reset(seed=2, episode=episode)
        ended = False
        while not ended:
            follow = scripted and rng.random() < 0.85
            action = env.scripted_action() if follow else rng.integers(0, env.action_space.nvec)
            fired: list[str] = []
            with noting(fired):
                result = reference.step(tuple(int(part) for part in action))
            *_, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
            explained = env.explain()
            told = [known[e["who"], e["name"], e["at"]] for e in explained["fired"] if e["who"] != "outcome"]
            assert sorted(told) == sorted(fired), (name, episode, explained["t"])
            outcomes = [entry["name"] for entry in explained["fired"] if entry["who"] == "outcome"]
            assert bool(outcomes) == (result.outcome not in (None, "deadly", "timeout"))
            assert all(entry["why"] and entry["words"] for entry in explained["others"])
            seen += len(fired)
    assert seen > 0 or not scripted
