"""`socialai coverage`: counts how often every rule, state and outcome of a scenario happened in play."""

import argparse
import json
import sys
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.diagnostics import printable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from socialai_dsl.analysis.tally import Part, Tally
    from socialai_dsl.checking.loaded import Loaded

SUMMARY: Final = "count how often each rule, state and outcome came about, and say what never did"

_TOGETHER: Final = 250
_KINDS: Final = ("rule", "state", "step", "outcome")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios", nargs="+", metavar="SCENARIO", help="a path or a name; several make one report"
    )
    parser.add_argument(
        "--agent",
        action="append",
        metavar="AGENT",
        help="oracle, random, shipped, or a checkpoint or run folder; may be given several times "
        "(default: random, and oracle where there is one)",
    )
    parser.add_argument(
        "--episodes", type=int, default=200, metavar="N", help="of each agent in each scenario (default: 200)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    parser.add_argument(
        "--fail-under", type=float, metavar="PERCENT", help="exit code 1 if less than this came about"
    )
    parser.add_argument("--json", action="store_true", help="print the report as one JSON object")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, count, report."""
    if arguments.episodes < 1:
        raise UsageError(f"--episodes: got {arguments.episodes}, expected at least 1")
    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    least = arguments.fail_under
    if least is not None and not 0 <= least <= 100:
        raise UsageError(f"--fail-under: got {least:g}, expected a per cent from 0 to 100")
    report = Report()
    for name in arguments.scenarios:
        _add(report, name, arguments)
    if arguments.json:
        print(json.dumps(report.as_object(), indent=2, ensure_ascii=False))
    else:
        print("\n".join(report.lines()))
    return Exit.FINDINGS if least is not None and report.percent < least else Exit.GOOD


def _add(report: "Report", name: str, arguments: argparse.Namespace) -> None:
    """Let the agents play one scenario."""
    from socialai_dsl.analysis.tally import parts_of
    from socialai_dsl.checking.loaded import LoadedSuite
    from socialai_dsl.frontend import load

    loaded = load(name)
    members = loaded.members if isinstance(loaded, LoadedSuite) else (loaded,)
    report.parts.update(dict.fromkeys(part for member in members for part in parts_of(member.checked)))
    report.scenarios.append(name)
    for agent in arguments.agent or ("random", "oracle"):
        played = _scripted(name, loaded, required=bool(arguments.agent)) if agent == "oracle" else name
        if played is not None:
            report.add(agent, _played(played, agent, arguments.episodes, arguments.seed))


def _scripted(name: str, loaded: "Loaded", required: bool) -> str | None:
    """The name under which the script plays a scenario; None if there is none.

    Raises:
        UsageError: there is none, and it is required.
    """
    from socialai_dsl.cli.agents import with_script

    try:
        return with_script(name)
    except UsageError:
        if required:
            raise
        return None


def _played(scenario: str, agent: str, episodes: int, seed: int) -> "Tally":
    import numpy as np

    import socialai_dsl
    from socialai_dsl.analysis.tally import tally
    from socialai_dsl.cli.agents import named_agent, require_trainer
    from socialai_dsl.cli.player import Player, make_policy
    from socialai_dsl.compilation import scenarios_of
    from socialai_dsl.frontend import load

    played = scenarios_of(load(scenario))
    envs: Any = socialai_dsl.make_vec(
        scenario, num_envs=min(episodes, _TOGETHER), copy=False, autoreset_mode="Disabled"
    )
    try:
        if agent == "oracle":
            return tally(
                envs, played, lambda seen: envs.scripted_actions(), _nothing_to_forget, episodes, seed
            )
        if agent == "random":
            generator, sizes = np.random.default_rng(seed), envs.single_action_space.nvec
            shape = (envs.num_envs, len(sizes))
            return tally(
                envs,
                played,
                lambda seen: generator.integers(0, sizes, shape),
                _nothing_to_forget,
                episodes,
                seed,
            )
        require_trainer()
        policy, told = make_policy(Player(named_agent(agent, scenario), seed=seed), envs)
        for warning in told:
            print(f"socialai: {printable(warning)}", file=sys.stderr)
        return tally(envs, played, policy.act, policy.reset, episodes, seed)
    except ValueError as error:
        raise UsageError(str(error)) from error
    finally:
        envs.close()


def _nothing_to_forget(rows: "NDArray[np.bool_]", episodes: "NDArray[np.int64]") -> None:
    """An agent without a memory."""


@dataclass
class _Row:
    """A part and how often it came about with each agent."""

    part: "Part"
    times: dict[str, int]

    @property
    def total(self) -> int:
        return sum(self.times.values())


class Report:
    """The parts of scenarios that happened, by agent.

    Attributes:
        scenarios: what was played. parts: what could come about.
        tallies: agent -> what did, and how many episodes it played.
    """

    def __init__(self) -> None:
        self.scenarios: list[str] = []
        self.parts: dict[Part, None] = {}
        self.tallies: dict[str, Tally] = {}

    def add(self, agent: str, played: "Tally") -> None:
        """Add what came about with an agent."""
        known = self.tallies.setdefault(agent, played)
        if known is not played:
            known.times.update(played.times)
            known.endings.update(played.endings)
            known.episodes += played.episodes

    @property
    def rows(self) -> list[_Row]:
        """One for each part, in the order of files and lines; what members share counts once."""
        return [
            _Row(part, {agent: played.times[part] for agent, played in self.tallies.items()})
            for part in sorted(self.parts)
        ]

    @property
    def percent(self) -> float:
        """How much of everything came about; 100 of nothing."""
        rows = self.rows
        return 100 * sum(row.total > 0 for row in rows) / len(rows) if rows else 100.0

    def summary(self) -> dict[str, tuple[int, int]]:
        """Kind -> how many came about, of how many."""
        rows = self.rows
        found = {kind: [row.total > 0 for row in rows if row.part.kind == kind] for kind in _KINDS}
        return {kind: (sum(came), len(came)) for kind, came in found.items() if came}

    def lines(self) -> list[str]:
        """The report as text, what never came about last."""
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
        return [*lines, "", f"{counted}: {self.percent:.1f} %"]

    def as_object(self) -> dict[str, Any]:
        """The report for JSON."""
        endings: Counter[str] = Counter()
        for played in self.tallies.values():
            endings.update(played.endings)
        return {
            "scenarios": self.scenarios,
            "episodes": {agent: played.episodes for agent, played in self.tallies.items()},
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


def _place(part: "Part") -> str:
    return printable(f"{part.span.file}:{part.span.line}")


def _short(agent: str) -> str:
    """The end of a path is what tells agents apart."""
    return printable(agent)[-11:]
