"""This module is `socialai evaluate`: play the test set with an agent that was trained before, perhaps elsewhere."""

import argparse
import json
from pathlib import Path
from typing import Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.run_folder import SETTINGS, read_json

SUMMARY: Final = "evaluate a trained agent on its own or another scenario's test set"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "run", metavar="RUN_DIR", help="a run's folder or a checkpoint; also random or oracle"
    )
    parser.add_argument(
        "--on", action="append", metavar="SCENARIO", help="what to play (default: the run's own); repeatable"
    )
    parser.add_argument(
        "--episodes", type=int, default=500, metavar="N", help="of the test set (default: 500)"
    )
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto", help="default: auto")
    parser.add_argument(
        "--json", action="store_true", help="print an array with one object for each scenario"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Evaluate on each scenario."""
    import socialai_dsl
    from socialai_dsl.cli.agents import evaluate_agent, require_trainer, resolve_device

    if arguments.episodes < 1:
        raise UsageError(f"--episodes: got {arguments.episodes}, expected at least 1")
    require_trainer()
    device = resolve_device(arguments.device)
    results = []
    for scenario in arguments.on or [_own_scenario(Path(arguments.run))]:
        program = socialai_dsl.compile(socialai_dsl.load(scenario))
        figures, _ = evaluate_agent(
            arguments.run, scenario, program, arguments.episodes, device, arguments.run
        )
        results.append({"scenario": scenario, "agent": arguments.run, "eval": figures})
        if not arguments.json:
            print(
                f"{scenario}: success {figures['success_rate']:.1%} ± {figures['success_rate_se']:.1%}, "
                f"mean length {figures['mean_length']:.1f}, mean return {figures['mean_return']:.3f}",
                flush=True,
            )
    if arguments.json:
        print(json.dumps(results, indent=2, ensure_ascii=False))
    return Exit.GOOD


def _own_scenario(run: Path) -> str:
    if not (run / SETTINGS).is_file():
        raise UsageError(f"--on: {run} does not say which scenario it was trained on; name one")
    scenario = read_json(run / SETTINGS).get("scenario")
    if not isinstance(scenario, str):
        raise UsageError(f"{run / SETTINGS}: scenario: expected a text, got {scenario!r}")
    return scenario
