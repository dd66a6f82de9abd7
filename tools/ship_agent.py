"""Turn a finished run into the agent that ships for its scenario: weights in half precision, card and figures.

    python tools/ship_agent.py runs/talkitout/20260101-120000-s0

Plays the 500 test episodes twice, with the same rooms and the same random numbers for sampling: with the run's weights
as they are (float32) and rounded to half precision (float16). Then it writes `agents/NAME/`, which
`--agent shipped`, `shipped:NAME` and `CheckpointPolicy.load("shipped:NAME")` find, and the list in `agents/README.md`.

It refuses, with exit code 1, where

* the run's weights no longer do what the run's own result says: the scenario has changed since. Success may differ by
  one percentage point, which leaves room for another machine's rounding;
* half precision plays differently. Only episodes that one of the two wins and the other loses tell them apart; if
  neither is better, each of these falls to either with probability 1/2. The exact two-sided test of that (McNemar's)
  must not reject it at the level 0.05;
* the folder would be larger than 1 MiB, the scenario does not ship, it has parameters, or the run has code of
  one's own.

The agent of a variant ships beside that of its scenario: that of `talkitout+marked` as `shipped:talkitout_marked`.

An agent that ships can be shipped again, from its own folder: `python tools/ship_agent.py agents/talkitout`. This is
for a compiler that gives the same scenario another program, so that the agent's digest is renewed; the agent must
still do what its card says.

An agent that was trained on many forms of a scenario ships for the scenario, with its success in other forms:

    python tools/ship_agent.py RUN --plays dance --trained-on dance_family.yaml --form dance+as_coded
"""

from __future__ import annotations

import argparse
import math
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch

import socialai_dsl
from socialai_dsl.atomic import read_json, write_text
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.episodes.players import Player
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.test_set import Evaluation
from socialai_dsl.runs.copies import MovedScenario
from socialai_dsl.runs.evaluate import evaluate
from socialai_dsl.runs.export import finished_agent, write_agent
from socialai_dsl.runs.folder import CONFIG, RESULT
from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.checkpoint import Checkpoint
from socialai_dsl.trainer.shipped import PREFIX, WEIGHTS, agent_name, agents_folder

EPISODES = 500
ROUNDING = 0.01
"""By how much a success rate may differ on the same rooms and random numbers, where only the machine differs."""
LEVEL = 0.05
LARGEST = 1 << 20
INDEX = "README.md"
_OF_ONE_MACHINE = ("train_seconds", "frames_per_second")


class Refused(Exception):  # noqa: N818 - it says what happened
    """The agent is not fit to ship; the message says why."""


def halved(checkpoint: Checkpoint) -> Checkpoint:
    """The checkpoint with its float32 weights rounded to float16."""
    rounded = {
        name: value.half() if value.dtype == torch.float32 else value
        for name, value in checkpoint.tensors.items()
    }
    return Checkpoint(checkpoint.meta, rounded)


def chance_of_difference(only_single: int, only_half: int) -> float:
    """The two-sided p-value of McNemar's exact test.

    Args:
        only_single: episodes that succeed in single precision alone.
        only_half: episodes that succeed in half precision alone.
    """
    total = only_single + only_half
    tail: float = sum(math.comb(total, k) for k in range(min(only_single, only_half) + 1)) / 2**total
    return min(1.0, 2 * tail)


def compare(single: np.ndarray, half: np.ndarray) -> dict[str, Any]:
    """How success, bool (E,) each, differs between both precisions.

    Raises:
        Refused: by more than chance.
    """
    only_single, only_half = int((single & ~half).sum()), int((half & ~single).sum())
    chance = chance_of_difference(only_single, only_half)
    if chance < LEVEL:
        raise Refused(
            f"half precision plays differently: it loses {only_single} and wins {only_half} of {len(single)} episodes "
            f"(McNemar's exact test: p = {chance:.3g}, expected at least {LEVEL})"
        )
    return {
        "episodes": len(single),
        "only_single": only_single,
        "only_half": only_half,
        "p": round(chance, 4),
    }


def identical(one: Evaluation, other: Evaluation) -> int:
    """How many episodes have the same actions in both."""
    return sum(np.array_equal(one.actions[number], other.actions[number]) for number in one.actions)


def shipped_scenario(loaded: Any, scenario: str) -> str:
    """The scenario for which an agent ships, by its name.

    Raises:
        Refused: it does not ship, or has parameters.
    """
    moved = MovedScenario.of(loaded, scenario)
    if moved.texts or "?" in moved.scenario:
        raise Refused(f"{scenario}: expected a scenario that ships, without parameters")
    return moved.scenario


def require_same(evaluation: Evaluation, recorded: Mapping[str, Any]) -> None:
    """Compare what was played now with what was recorded.

    Raises:
        Refused: they differ.
    """
    count = min(recorded["episodes"], EPISODES)
    now, then = float(evaluation.result.success[:count].mean()), recorded["success_rate"]
    if abs(now - then) > ROUNDING:
        raise Refused(
            f"the agent succeeds in {now:.1%} of {count} episodes, its run says {then:.1%}: the scenario has changed"
        )


def provenance(run: Path, commit: str | None) -> dict[str, str]:
    """When the run ended, and with which commit of this repository it began: by default the newest before it."""
    began, ended = ((run / name).stat().st_mtime for name in (CONFIG, RESULT))
    if commit is None:
        command = ["git", "log", "-1", "--first-parent", f"--before=@{int(began)}", "--format=%H"]
        found = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True, timeout=60
        )
        commit = found.stdout.strip()
    return {"date": datetime.fromtimestamp(ended, UTC).date().isoformat(), "commit": commit}


def ship(
    run: Path,
    folder: Path,
    commit: str | None = None,
    plays: str | None = None,
    trained_on: str | None = None,
    forms: Sequence[str] = (),
) -> str:
    """Make `folder/NAME` of a run, and return what is to be said of it.

    Args:
        run: a finished run's folder, or that of an agent that ships.
        folder: where the agents are that ship.
        commit: the commit whose code trained the agent; None: see `provenance`.
        plays: the scenario for which it ships; None: that of its training.
        trained_on: the file of its training where that is another one, as its run has a copy under another name.
        forms: other scenarios whose test it plays as well, for its card.

    Raises:
        Refused: the agent is not fit to ship.
        UsageError: this is no finished run.
    """
    config, loaded, checkpoint = finished_agent(run)
    result = read_json(run / RESULT)
    trained_on = trained_on or result.get("trained_on")
    if plays is not None:
        trained_on, loaded = trained_on or config.scenario, socialai_dsl.load(plays)
        config = config.model_copy(update={"scenario": plays})
    scenario = shipped_scenario(loaded, config.scenario)
    name = agent_name(*scenario.split("+"))
    if config.own_files or ":" in config.net:
        raise Refused(f"{run}: was trained with code of one's own, which does not ship")
    # Its digest is that of the present program: the comparison with the run's figures says that it means the same.
    meta = checkpoint.meta.model_copy(
        update={"program_sha256": socialai_dsl.compile(loaded).sha256, "scenario": loaded.resolved.name}
    )
    small = halved(replace(checkpoint, meta=meta))
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        place = Path(temporary) / "agent"
        place.mkdir()
        checkpoints.write_file(place / WEIGHTS, small)
        single = evaluate(Player(str(run)), scenario, EPISODES)
        if plays is None:
            require_same(single, result["eval"])
        half = evaluate(Player(str(place)), scenario, EPISODES)
        compared = result.get("half_precision") or {
            **compare(single.result.success, half.result.success),
            "identical": identical(single, half),
        }
        kept = {key: value for key, value in result.items() if key not in _OF_ONE_MACHINE}
        told = kept | {
            "eval": half.figures(),
            "program_sha256": meta.program_sha256,
            "trained": result.get("trained") or provenance(run, commit),
            "half_precision": compared,
        }
        told |= {} if trained_on is None else {"trained_on": trained_on}
        told |= {"forms": _forms(place, forms)} if forms else {}
        write_agent(place, config, loaded, small, told, PREFIX + name)
        size = sum(file.stat().st_size for file in place.rglob("*") if file.is_file())
        if size > LARGEST:
            raise Refused(f"{name}: {size:,} bytes, expected at most {LARGEST:,}")
        target = folder / name
        shutil.rmtree(target, ignore_errors=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        place.rename(target)
    write_text(folder / INDEX, index(folder))
    now, before = half.result.success_rate, single.result.success_rate
    return (
        f"{target}: {now:.1%} of {EPISODES} test episodes, {before:.1%} before rounding "
        f"({compared['identical']} played alike, {compared['only_single']} lost, {compared['only_half']} won, "
        f"p = {compared['p']}); {size:,} bytes"
    )


def _forms(agent: Path, forms: Sequence[str]) -> dict[str, Any]:
    """The success of an agent in the test of other scenarios, with its interval."""
    figures = {form: evaluate(Player(str(agent)), form, EPISODES).figures() for form in forms}
    return {
        form: {key: one[key] for key in ("success_rate", "success_interval")} for form, one in figures.items()
    }


def index(folder: Path) -> str:
    """The list of the agents in a folder, as Markdown."""
    rows = []
    for file in sorted(folder.rglob(RESULT)):
        name, result = file.parent.relative_to(folder).as_posix(), read_json(file)
        low, high = result["eval"]["success_interval"]
        rows.append(
            f"| [`{name}`]({name}/README.md) | `{result['scenario']}` "
            f"| {result['eval']['success_rate']:.1%} | {low:.1%} to {high:.1%} "
            f"| {result['frames']:,} | {result['recipe']} |"
        )
    return "\n".join(
        [
            "# Trained agents",
            "",
            "`--agent shipped` and `shipped:NAME` find them ([Using a trained agent](../docs/trained_agents.md)). The "
            "figures are those of",
            "the 500 test episodes with the scenario's own rooms, actions sampled; each card has the command that made "
            "its agent.",
            "`tools/ship_agent.py` makes this page and the folders.",
            "",
            "| agent | scenario | success | 95 % interval | frames | recipe |",
            "| --- | --- | --- | --- | --- | --- |",
            *rows,
            "",
        ]
    )


def main() -> int:
    """Ship an agent; 1 if it is not fit, 2 if this is no finished run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "run", type=Path, metavar="RUN", help="folder of a finished run, or of a shipped agent"
    )
    parser.add_argument(
        "--commit",
        help="whose code trained the agent (default: the newest on this branch when the run began)",
    )
    parser.add_argument(
        "--plays", metavar="SCENARIO", help="for which it ships (default: that of its training)"
    )
    parser.add_argument("--trained-on", metavar="FILE", help="the suite of its training, for its card")
    parser.add_argument(
        "--form",
        action="append",
        default=[],
        dest="forms",
        metavar="SCENARIO",
        help="another one whose test it plays, for its card (repeatable)",
    )
    arguments = parser.parse_args()
    folder = agents_folder()
    folder.mkdir(exist_ok=True)
    try:
        print(
            ship(
                arguments.run,
                folder,
                arguments.commit,
                arguments.plays,
                arguments.trained_on,
                arguments.forms,
            )
        )
    except Refused as refusal:
        print(f"refused: {refusal}", file=sys.stderr)
        return 1
    except (UsageError, ScenarioError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
