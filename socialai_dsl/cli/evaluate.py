"""`socialai evaluate`: plays the test set with a trained agent, a script, chance or a language model."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from socialai_dsl.cli.arguments import natural, positive
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.model_options import add_options, model_options
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.players import (
    MODEL_PREFIX,
    Player,
    default_folder,
    folder_of,
    named_agent,
    require_trainer,
    resolve_device,
)
from socialai_dsl.evaluation.recordings import record
from socialai_dsl.evaluation.summary import aligned, ending_lines, probe_lines, rule_lines, summary_rows
from socialai_dsl.evaluation.testing import Evaluation, evaluate_agent, own_scenario
from socialai_dsl.run_folder import REPLAY, RESULT, SETTINGS, versions, write_json, write_text
from trainer.config import RunConfig

SUMMARY: Final = "test a trained agent, a script, chance or a language model on a fixed set of episodes"
FIGURES: Final = "evaluation.json"
_RECORDED: Final = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "run",
        metavar="RUN_DIR",
        help="the agent: the folder of a run, a checkpoint, shipped:NAME, shipped (the agent of each scenario), "
        "random, oracle or llm:MODEL",
    )
    parser.add_argument(
        "--on",
        action="append",
        metavar="SCENARIO",
        help="the scenario to play (repeatable; default: that of the run)",
    )
    parser.add_argument(
        "--episodes", type=positive, default=500, metavar="N", help="number of test episodes (default: 500)"
    )
    parser.add_argument(
        "--greedy",
        action="store_true",
        help="take the most probable action (default: sample)",
    )
    parser.add_argument(
        "--seed",
        type=natural,
        default=0,
        metavar="N",
        help="seed of the sampling (default: 0); the rooms are always the same",
    )
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="where the network runs (default: auto)",
    )
    parser.add_argument("--net", metavar="mine:Net", help="import this code, for a network of your own")
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
        help=f"with --out: record up to N successes and N failures (default: {_RECORDED})",
    )
    parser.add_argument(
        "--json", action="store_true", help="print a JSON array with one object for each scenario"
    )
    add_options(parser)


def execute(arguments: argparse.Namespace) -> Exit:
    """Evaluate on each scenario."""
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
            place = record(evaluation, out, count, f"agent {arguments.run}")
            # As a run that trained nothing, so that reports take it as one.
            write_json(place / SETTINGS, {key: results[-1][key] for key in ("scenario", "agent", "seed")})
            write_json(place / RESULT, results[-1])
            if not arguments.json:
                replay = f", to look at in {place / REPLAY}" if (place / REPLAY).is_file() else ""
                print(f"\nepisodes written to {place}{replay}\n", flush=True)
            # After each scenario, so that nothing is lost should the agent not fit the next one.
            write_text(out / FIGURES, json_text(results) + "\n")
    if arguments.json:
        print(json_text(results))
    return Exit.GOOD


def _player(arguments: argparse.Namespace) -> Player:
    """Who plays, and how."""
    agent = arguments.run
    if agent.startswith(MODEL_PREFIX):
        return Player(agent, out=arguments.out or default_folder(agent), options=model_options(arguments))
    if agent in ("random", "oracle", "human"):
        return Player(agent, seed=arguments.seed)
    require_trainer()
    has_own = arguments.on is None or (folder_of(agent) / SETTINGS).is_file()
    scenario = own_scenario(agent) if has_own else arguments.on[0]
    return Player(
        agent,
        resolve_device(arguments.device),
        arguments.greedy,
        arguments.seed,
        arguments.net,
        RunConfig(scenario=scenario).code_folder,
    )


def _result(evaluation: Evaluation) -> dict[str, Any]:
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


def _table(evaluation: Evaluation, figures: dict[str, Any]) -> str:
    parts = [
        [f"{evaluation.scenario}, agent {evaluation.player.agent}"],
        aligned(summary_rows(figures)),
        probe_lines(figures),
        ending_lines(figures),
        rule_lines(figures),
    ]
    return "\n\n".join("\n".join(lines) for lines in parts if lines)
