"""How often everything in scenarios came about while agents played them, and what never did."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.analysis.effort import EPISODES, Clock, why_no_more
from socialai_dsl.analysis.tally import Part, Tally, Watch, parts_of
from socialai_dsl.compilation import scenarios_of
from socialai_dsl.diagnostics import printable
from socialai_dsl.envs.factory import make_vec
from socialai_dsl.episodes.play import AGENT, EachRoom, Observer, Rooms, Step, play
from socialai_dsl.episodes.players import Player, make_policy, named_agent, played_again, require_trainer
from socialai_dsl.episodes.room_sets import RoomSet
from socialai_dsl.episodes.scripts import script_of, with_frame_of
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import load

_TOGETHER: Final = 250
_KINDS: Final = ("rule", "state", "step", "outcome")


def coverage(
    scenarios: Sequence[str],
    agents: Sequence[str] = (),
    episodes: int = EPISODES,
    seed: int = 0,
    clock: Clock | None = None,
) -> Coverage:
    """Let agents play scenarios, and count how often each rule, state, step and outcome occurred.

    Args:
        scenarios: paths or names; of a suite every member counts.
        agents: `oracle`, `random`, `shipped`, a checkpoint or a run's folder (default: random, and oracle where a
            scenario has a script).
        episodes: of each agent in each scenario: rooms 0 to episodes - 1 of the seed.
        seed: of the rooms, and of what agents draw.
        clock: when to stop early; agents and scenarios share its time. With a clock, Ctrl-C ends with what is known.

    Raises:
        ScenarioError: a scenario has mistakes.
        UsageError: an agent cannot play a scenario.
    """
    whole, found = Clock() if clock is None else clock, Coverage()
    with whole.until_interrupted():
        plays = []
        for scenario in scenarios:
            found.parts.update(dict.fromkeys(_parts(scenario)))
            found.scenarios.append(scenario)
            plays += list(_plays(scenario, agents))
        found.planned = len(plays) * episodes
        for number, (agent, played) in enumerate(plays):
            found.add(agent, _played(played, agent, episodes, seed, whole.part(len(plays) - number)))
            if whole.is_over:
                break
    found.interrupted = whole.interrupted
    if clock is None and whole.interrupted:
        raise KeyboardInterrupt
    return found


def _plays(scenario: str, agents: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Which agents play, and under which name each finds the scenario."""
    for agent in agents or ("random", "oracle"):
        player = Player(played_again(agent))
        if not player.follows_frame:
            yield agent, scenario
        elif agents:
            yield agent, with_frame_of(player, scenario).name
        elif (scripted := script_of(scenario)) is not None:
            yield agent, scripted.name


def _parts(scenario: str) -> list[Part]:
    """Everything in a scenario that can occur."""
    return [part for checked in scenarios_of(load(scenario)) for part in parts_of(checked)]


def _played(scenario: str, agent: str, episodes: int, seed: int, clock: Clock) -> Tally:
    """Let an agent play. What happens in episodes that the clock breaks off counts."""
    envs: Any = make_vec(scenario, num_envs=min(episodes, _TOGETHER), copy=False, autoreset_mode="Disabled")
    try:
        player = Player(named_agent(agent, scenario), seed=seed)
        if player.is_trained:
            require_trainer()
        policy, told = make_policy(player, envs)
        for warning in told:
            warnings.warn(warning, stacklevel=2)
        counting = Counting(Watch(envs, scenarios_of(load(scenario))))

        def over() -> bool:
            clock.progress(f"{counting.ended} of {episodes} episodes played")
            return clock.is_over

        with clock.until_interrupted():
            agenda = EachRoom(episodes, rooms=RoomSet.of_seed(seed))
            play(Rooms(envs, [counting]), {AGENT: policy}, agenda, over)
        return counting.watch.tally(counting.ended)
    except ValueError as error:
        raise UsageError(str(error)) from error
    finally:
        envs.close()


class Counting(Observer):
    """Counts what comes about, and the episodes that are over."""

    def __init__(self, watch: Watch) -> None:
        self.watch, self.ended = watch, 0

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        self.watch.began(begun)

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        self.watch.stepped(step.running)
        self.ended += int(np.count_nonzero(step.ended))


@dataclass
class Row:
    """A part and how often it came about with each agent."""

    part: Part
    times: dict[str, int]

    @property
    def total(self) -> int:
        """The sum over all agents."""
        return sum(self.times.values())


class Coverage:
    """What occurred with each agent, of everything that could.

    Attributes:
        scenarios: what was played. parts: what could occur.
        tallies: agent -> what occurred, and how many episodes it played.
        planned: how many episodes there should be. interrupted: whether Ctrl-C ended the play.
    """

    def __init__(self) -> None:
        self.scenarios: list[str] = []
        self.parts: dict[Part, None] = {}
        self.tallies: dict[str, Tally] = {}
        self.planned, self.interrupted = 0, False

    def add(self, agent: str, played: Tally) -> None:
        """Add what occurred with an agent."""
        known = self.tallies.setdefault(agent, played)
        if known is not played:
            known.times.update(played.times)
            known.endings.update(played.endings)
            known.episodes += played.episodes

    @property
    def rows(self) -> list[Row]:
        """One for each part, in the order of files and lines; what members share counts once."""
        return [
            Row(part, {agent: played.times[part] for agent, played in self.tallies.items()})
            for part in sorted(self.parts)
        ]

    @property
    def percent(self) -> float:
        """The percentage of parts that occurred; 100 if there are none."""
        rows = self.rows
        return 100 * sum(row.total > 0 for row in rows) / len(rows) if rows else 100.0

    def summary(self) -> dict[str, tuple[int, int]]:
        """Kind -> the number that occurred, and the number of all."""
        rows = self.rows
        found = {kind: [row.total > 0 for row in rows if row.part.kind == kind] for kind in _KINDS}
        return {kind: (sum(came), len(came)) for kind, came in found.items() if came}

    def lines(self) -> list[str]:
        """The report as text; parts that never occurred come last."""
        rows = self.rows
        agents = list(self.tallies)
        width = max((len(_place(row.part)) for row in rows), default=0)
        named = max((len(row.part.name) for row in rows), default=0)
        played = ", ".join(f"{agent} {played.episodes}" for agent, played in self.tallies.items())
        lines = [printable(f"{', '.join(self.scenarios)}: episodes of {played}"), ""]
        heads = "".join(f"{_short(agent):>12}" for agent in agents)
        lines.append(f"{'':<{width}}  {'':<8}{'':<{named}}{heads}".rstrip())
        for row in rows:
            if row.total:
                counts = "".join(f"{times:>12,}" for times in row.times.values())
                lines.append(
                    f"{_place(row.part):<{width}}  {row.part.kind:<8}{printable(row.part.name):<{named}}{counts}"
                )
        never = [row.part for row in rows if not row.total]
        if never:
            lines += ["", "never:"]
            lines += [f"{_place(part):<{width}}  {part.kind:<8}{printable(part.name)}" for part in never]
        counted = ", ".join(
            f"{came} of {total} {kind}{'s' if total != 1 else ''}"
            for kind, (came, total) in self.summary().items()
        )
        return [*lines, "", f"{counted}: {self.percent:.1f} %", *self._shortage()]

    def _shortage(self) -> Iterator[str]:
        played = sum(tally.episodes for tally in self.tallies.values())
        if played < self.planned:
            why = why_no_more(self.interrupted)
            yield f"of {self.planned:,} episodes there was time for {played:,}; {why}"

    def as_object(self) -> dict[str, Any]:
        """The report for JSON."""
        endings: Counter[str] = Counter()
        for played in self.tallies.values():
            endings.update(played.endings)
        return {
            "scenarios": self.scenarios,
            "episodes": {agent: played.episodes for agent, played in self.tallies.items()},
            "planned": self.planned,
            "interrupted": self.interrupted,
            "parts": [
                {
                    "file": row.part.span.file,
                    "line": row.part.span.line,
                    "column": row.part.span.column,
                    "kind": row.part.kind,
                    "name": row.part.name,
                    "times": row.times,
                }
                for row in self.rows
            ],
            "endings": dict(endings),
            "summary": {
                kind: {"happened": came, "of": total} for kind, (came, total) in self.summary().items()
            },
            "percent": round(self.percent, 2),
        }


def _place(part: Part) -> str:
    return printable(f"{part.span.file}:{part.span.line}")


def _short(agent: str) -> str:
    """The end of a path is what tells agents apart."""
    return printable(agent)[-11:]
