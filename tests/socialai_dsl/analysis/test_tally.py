"""Counting what came about: it agrees with what `explain()` tells of the same episodes."""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.analysis.coverage import coverage
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.tally import Tally, Watch, parts_of
from socialai_dsl.compilation import scenarios_of
from socialai_dsl.episodes import AGENT, EachRoom, FunctionPolicy, Rooms, RoomSet, ScriptedPolicy, play
from socialai_dsl.evaluation.coverage_report import Counting
from tests.tiny import Folder

ROOT = Path(__file__).parents[3]
EPISODES = 7


def choose(row: int, step: int, sizes: Any) -> Any:
    """What the agent does in an episode, whoever plays it beside."""
    return np.random.default_rng([row, step]).integers(0, sizes)


class Chosen:
    """Plays what `choose` says of each episode."""

    def __init__(self, sizes: Any) -> None:
        self._sizes = sizes

    def reset(self, mask: Any, episodes: Any = None) -> None:
        self._episodes = episodes
        self._steps = np.where(mask, 0, getattr(self, "_steps", 0))

    def act(self, observation: Any) -> Any:
        self._steps += 1
        pairs = zip(self._episodes.tolist(), self._steps.tolist(), strict=True)
        return np.stack([choose(number, step, self._sizes) for number, step in pairs])


def counted(envs: Any, name: str, policy: Any, episodes: int, seed: int) -> Tally:
    counting = Counting(Watch(envs, scenarios_of(sd.load(name))))
    play(Rooms(envs, [counting]), {AGENT: policy}, EachRoom(episodes, rooms=RoomSet.of_seed(seed)))
    return counting.watch.tally(counting.ended)


def standing_still(path: Path) -> Tally:
    """Four episodes, two at once, in which the agent does nothing."""
    envs: Any = sd.make_vec(str(path), num_envs=2, autoreset_mode="Disabled")
    still = [int(envs.single_action_space.nvec[0]) - 1, 0, 0, 0]
    return counted(envs, str(path), FunctionPolicy(lambda seen: np.tile(still, (2, 1))), 4, seed=0)


def played(name: str, together: int, scripted: bool) -> Tally:
    """Episodes 0 to 6, so many at once."""
    envs: Any = sd.make_vec(name, num_envs=together, autoreset_mode="Disabled")
    policy = ScriptedPolicy(envs) if scripted else Chosen(envs.single_action_space.nvec)
    return counted(envs, name, policy, EPISODES, seed=3)


@cache
def explained(name: str, scripted: bool) -> tuple[Counter[tuple[str, str]], Counter[str]]:
    """(kind, file:line) of all that fired, and the outcomes, in the same episodes one by one."""
    env: Any = sd.make(name).unwrapped
    fired: Counter[tuple[str, str]] = Counter()
    endings: Counter[str] = Counter()
    for index in range(EPISODES):
        env.reset(seed=3, options={"index": index})
        ended, step = False, 0
        while not ended:
            step += 1
            action = env.scripted_action() if scripted else choose(index, step, env.action_space.nvec)
            *_, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
            for entry in env.explain()["fired"]:
                kind = {"world rule": "rule"}.get(entry["kind"], entry["kind"])
                fired[kind, entry["at"]] += 1
        endings[info["outcome"]] += 1
    return fired, endings


@pytest.mark.parametrize(
    ("name", "scripted"),
    [
        ("talkitout", False),
        ("talkitout+oracle", True),
        ("help+oracle", True),
        ("cointhief", False),
        (str(ROOT / "scenarios/novel/shop.yaml+oracle"), True),
        (str(ROOT / "scenarios/school/apple_stealing.yaml+oracle"), True),
    ],
    ids=str,
)
@pytest.mark.parametrize("together", [1, 3, 7])
@pytest.mark.thorough("plays every scenario step by step")
def test_it_counts_what_happened(name: str, scripted: bool, together: int) -> None:
    found = played(name, together, scripted)
    fired, endings = explained(name, scripted)
    rules: Counter[tuple[str, str]] = Counter()
    for part, times in found.times.items():
        if part.kind in ("rule", "outcome") and times:
            rules[part.kind, f"{part.span.file}:{part.span.line}"] += times
    assert rules == Counter({key: times for key, times in fired.items() if key[0] != "step"})
    assert found.endings == endings
    assert found.episodes == EPISODES


def test_states_and_steps_are_counted_when_they_are_entered(tmp_path: Path) -> None:
    """Also a state that is passed within a step, and the same state entered again."""
    folder = Folder(tmp_path)
    path = folder.write(
        "tiny",
        """
        horizon: 10
        frames:
          hop:
            start: a
            states:
              a: {then: [{when: t == 2 or t == 4, goto: b}]}
              b: {then: [{goto_now: c}]}
              c: {then: [{when: t > 50, goto: d}, {goto: a}]}
              d: {}
          walk: {steps: [{do: stay, for: 3}, {do: stay, until: t > 50}, {do: forward}]}
        cast:
          one: {at: [3, 3], frame: hop}
          two: {at: [4, 4], frame: hop}
          three: {at: [5, 5], frame: walk}
          agent: {at: [1, 1]}
        """,
    )
    found = standing_still(path)
    times = {part.name: number for part, number in found.times.items()}
    # Two members in four episodes: at the start, and back from c twice.
    assert (times["hop.a"], times["hop.b"], times["hop.c"], times["hop.d"]) == (24, 16, 16, 0)
    assert (times["walk.steps[0]"], times["walk.steps[1]"], times["walk.steps[2]"]) == (4, 4, 0)
    assert found.endings == {"timeout": 4}


def test_parts_are_named_where_they_are_written() -> None:
    loaded = sd.load("diverse_exit")
    assert isinstance(loaded, sd.LoadedScenario)
    files = {Path(part.span.file).name for part in parts_of(loaded.checked)}
    assert files == {"diverse_exit.yaml", "teacher.yaml"}


def test_entries_that_begin_and_end_in_one_turn_have_come_about(tmp_path: Path) -> None:
    """A way that is fulfilled already is skipped, and what follows it may end in the same turn."""
    file = Folder(tmp_path).write(
        "skipping",
        """\
        objects: {ball: {type: ball, at: [3, 3]}}
        frames:
          work:
            steps:
              - {do: go_next_to(ball)}
              - {do: left}
              - {do: go_next_to(ball)}
              - {do: go_next_to(ball)}
              - {do: right}
              - {do: stay, for: 0}
              - {do: stay, for: ever}
        cast:
          ann: {frame: work, at: [4, 3]}
          agent: {}
        """,
    )
    found = played(str(file), EPISODES, False)
    steps = {part.name: times for part, times in found.times.items() if part.kind == "step"}
    assert steps == {f"work.steps[{k}]": EPISODES for k in range(7)}
    loaded = sd.load(file)
    assert isinstance(loaded, sd.LoadedScenario)
    assert [part for part in coverage(loaded, Effort(2)).missing if part.kind == "step"] == []
