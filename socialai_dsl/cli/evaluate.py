"""`socialai evaluate`: plays the test set with a trained agent, a script, chance or a language model."""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.arguments import natural, positive
from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.cli.language_model import PREFIX, add_options, default_folder
from socialai_dsl.cli.run_folder import REPLAY, RESULT, SETTINGS, read_json, versions, write_json, write_text
from trainer.config import code_folder

if TYPE_CHECKING:
    from socialai_dsl.cli.evaluation import Evaluation
    from socialai_dsl.cli.player import Player

SUMMARY: Final = "evaluate a trained agent, a script, chance or a language model on a scenario's test set"
FIGURES: Final = "evaluation.json"
_RECORDED: Final = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "run",
        metavar="RUN_DIR",
        help="a run's folder or a checkpoint; also shipped:NAME, shipped (the agent of each scenario), random, oracle "
        "or llm:MODEL",
    )
    parser.add_argument(
        "--on", action="append", metavar="SCENARIO", help="what to play (default: the run's own); repeatable"
    )
    parser.add_argument(
        "--episodes", type=positive, default=500, metavar="N", help="of the test set (default: 500)"
    )
    parser.add_argument(
        "--greedy",
        action="store_true",
        help="take the most probable action (default: sample, as the paper does)",
    )
    parser.add_argument(
        "--seed",
        type=natural,
        default=0,
        metavar="N",
        help="of the sampling (default: 0); rooms never change",
    )
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto", help="default: auto")
    parser.add_argument(
        "--net", metavar="mine:Net", help="import this code, for an agent with a network of your own"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"write {FIGURES}, and for each scenario a folder with {RESULT}, films, transcripts, a page that replays "
        "them and a list of all episodes; `socialai report` takes these folders",
    )
    parser.add_argument(
        "--record",
        type=natural,
        metavar="N",
        help=f"with --out: how many failures and how many successes are recorded (default: {_RECORDED})",
    )
    parser.add_argument(
        "--json", action="store_true", help="print an array with one object for each scenario"
    )
    add_options(parser)


def execute(arguments: argparse.Namespace) -> Exit:
    """Evaluate on each scenario."""
    from socialai_dsl.cli.agents import named_agent
    from socialai_dsl.cli.evaluation import evaluate_agent
    from socialai_dsl.cli.evaluation_report import write_episodes

    if arguments.record is not None and arguments.out is None:
        raise UsageError("--record: expected --out DIR as well, where the recordings go")
    if arguments.run == "human" and arguments.json:
        raise UsageError("--json: the agent 'human' plays on standard output")
    player = _player(arguments)
    out = player.out if player.options is not None else arguments.out
    results = []
    for scenario in arguments.on or [own_scenario(arguments.run)]:
        playing = replace(player, agent=named_agent(player.agent, scenario))
        evaluation = evaluate_agent(playing, scenario, arguments.episodes)
        for warning in evaluation.warnings:
            print(f"warning: {warning}", file=sys.stderr)
        results.append(_result(evaluation))
        if not arguments.json:
            print(_table(evaluation, results[-1]["eval"]), flush=True)
        if out is not None:
            count = _RECORDED if arguments.record is None else arguments.record
            place = write_episodes(evaluation, out, count, f"agent {arguments.run}")
            # As a run that trained nothing, so that reports take it as one.
            write_json(place / SETTINGS, {key: results[-1][key] for key in ("scenario", "agent", "seed")})
            write_json(place / RESULT, results[-1])
            if not arguments.json:
                replay = f", to look at in {place / REPLAY}" if (place / REPLAY).is_file() else ""
                print(f"\nepisodes written to {place}{replay}\n", flush=True)
            # After each scenario, so that nothing is lost should the agent not fit the next one.
            write_text(out / FIGURES, _text(results) + "\n")
    if arguments.json:
        print(_text(results))
    return Exit.GOOD


def _player(arguments: argparse.Namespace) -> "Player":
    """Who plays; a trained agent needs PyTorch, the others do not."""
    from socialai_dsl.cli.player import Player

    agent = arguments.run
    if agent.startswith(PREFIX):
        return Player(agent, out=arguments.out or default_folder(agent), options=arguments)
    if agent in ("random", "oracle", "human"):
        return Player(agent, seed=arguments.seed)
    from socialai_dsl.cli.agents import folder_of, require_trainer, resolve_device

    require_trainer()
    has_own = arguments.on is None or (folder_of(agent) / SETTINGS).is_file()
    return Player(
        agent,
        resolve_device(arguments.device),
        arguments.greedy,
        arguments.seed,
        arguments.net,
        code_folder(own_scenario(agent) if has_own else arguments.on[0]),
    )


def _text(results: list[dict[str, Any]]) -> str:
    return json.dumps(results, indent=2, ensure_ascii=False)


def _result(evaluation: "Evaluation") -> dict[str, Any]:
    return {
        "scenario": evaluation.scenario,
        "agent": evaluation.player.agent,
        "greedy": evaluation.player.greedy,
        "seed": evaluation.player.seed,
        "warnings": list(evaluation.warnings),
        "eval": evaluation.figures(),
        "program_sha256": evaluation.program.sha256,
        "versions": versions(),
    }


def _table(evaluation: "Evaluation", figures: dict[str, Any]) -> str:
    from socialai_dsl.cli.evaluation_report import (
        aligned,
        ending_lines,
        probe_lines,
        rule_lines,
        summary_rows,
    )

    parts = [
        [f"{evaluation.scenario}, agent {evaluation.player.agent}"],
        aligned(summary_rows(figures)),
        probe_lines(figures),
        ending_lines(figures),
        rule_lines(figures),
    ]
    return "\n\n".join("\n".join(lines) for lines in parts if lines)


def own_scenario(agent: str) -> str:
    """The scenario on which the agent of a run's folder, or one that ships, was trained.

    Raises:
        UsageError: it is neither.
    """
    from socialai_dsl.cli.agents import folder_of

    run = folder_of(agent)
    if not (run / SETTINGS).is_file():
        raise UsageError(f"--on: {run} does not say which scenario it was trained on; name one")
    scenario = read_json(run / SETTINGS).get("scenario")
    if not isinstance(scenario, str):
        raise UsageError(f"{run / SETTINGS}: scenario: expected a text, got {scenario!r}")
    return str(run / scenario) if _comes_along(run, scenario) else scenario


def _comes_along(run: Path, scenario: str) -> bool:
    """Whether the scenario's file lies in the folder itself, as in an exported one."""
    from socialai_dsl.cli.export import SCENARIO

    return scenario.startswith(f"{SCENARIO}/") and (run / SCENARIO).is_dir()
