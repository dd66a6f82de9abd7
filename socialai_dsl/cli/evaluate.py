"""`socialai evaluate`: plays the test set with a trained agent, a script, chance or a language model."""

import argparse
import contextlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import socialai_dsl
from socialai_dsl.atomic import write_json, write_text
from socialai_dsl.cli.arguments import episodes, identifier, natural, refuse, seed
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.model_options import MODEL_OPTIONS, add_options, model_options
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.players import (
    HUMAN_FOLDER,
    MODEL_PREFIX,
    Player,
    folder_of,
    named_agent,
    require_trainer,
    session_folder,
)
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.recordings import write_recordings
from socialai_dsl.evaluation.summary import aligned, ending_lines, probe_lines, rule_lines, summary_rows
from socialai_dsl.evaluation.test_set import Evaluation, own_scenario, play_test_set
from socialai_dsl.replay.endings import short_name
from socialai_dsl.runs.copies import keep_scenario
from socialai_dsl.runs.folder import CONFIG, REPLAY, RESULT, only_writer, scenario_folder_name
from socialai_dsl.runs.options import resolved_device
from socialai_dsl.runs.versions import versions
from trainer.config import UNTRAINED, RunConfig

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
        "--episodes", type=episodes, default=500, metavar="N", help="number of test episodes (default: 500)"
    )
    parser.add_argument(
        "--greedy",
        action="store_true",
        default=None,
        help="take the most probable action (default: sample)",
    )
    parser.add_argument(
        "--seed",
        type=seed,
        metavar="N",
        help="seed of the sampling (default: 0); the rooms are always the same",
    )
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
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
        "--participant",
        type=identifier,
        metavar="ID",
        help="for the agent human: begins the name of the session's folder (default: the time alone)",
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
    _refuse_what_does_not_apply(arguments)
    player = _player(arguments)
    if player.agent == "human":  # every session has a folder of its own
        return _evaluate(arguments, player, player.out)
    out = player.kept_in if player.is_model else arguments.out
    with only_writer(out) if out is not None else contextlib.nullcontext():
        return _evaluate(arguments, player, out)


def _evaluate(arguments: argparse.Namespace, player: Player, out: Path | None) -> Exit:
    """Evaluate on each scenario; the caller is the only writer of the folder `out`."""
    results = []
    for scenario in arguments.on or [own_scenario(arguments.run)]:
        playing = replace(player, agent=named_agent(player.agent, scenario))
        loaded = socialai_dsl.load(scenario)
        kept = None
        if out is not None:
            place = out / scenario_folder_name(scenario)
            place.mkdir(parents=True, exist_ok=True)
            kept = keep_scenario(place, scenario, loaded).scenario
            # As a run that trained nothing, so that reports take it as one.
            settings = {"scenario": kept, "agent": short_name(playing.agent), "seed": playing.seed}
            write_json(place / CONFIG, settings)
        evaluation = play_test_set(playing, scenario, loaded, compiled(loaded), arguments.episodes)
        for warning in evaluation.warnings:
            print(f"warning: {warning}", file=sys.stderr)
        results.append(_result(evaluation, kept or scenario))
        if not arguments.json:
            print(_table(evaluation, results[-1]["eval"]), flush=True)
        if out is not None:
            count = _RECORDED if arguments.record is None else arguments.record
            place = write_recordings(evaluation, out, count, f"agent {short_name(arguments.run)}")
            write_json(place / RESULT, results[-1])
            if not arguments.json:
                replay = f", to look at in {place / REPLAY}" if (place / REPLAY).is_file() else ""
                print(f"\nepisodes written to {place}{replay}\n", flush=True)
            # After each scenario, so that nothing is lost should the agent not fit the next one.
            write_text(out / FIGURES, json_text(results) + "\n")
    if arguments.json:
        print(json_text(results))
    return Exit.GOOD


def _refuse_what_does_not_apply(arguments: argparse.Namespace) -> None:
    """Refuse, by name, what the agent would ignore."""
    agent = arguments.run
    names = {"greedy", "seed", "device", "net", "participant", *MODEL_OPTIONS}
    if agent.startswith(MODEL_PREFIX):
        names -= set(MODEL_OPTIONS)
    elif agent in UNTRAINED:
        names -= {"random": {"seed"}, "human": {"participant"}}.get(agent, set())
    else:
        names -= {"greedy", "seed", "device", "net"}
    refuse(arguments, names, f"the agent {agent!r} has no use for it")


def _player(arguments: argparse.Namespace) -> Player:
    """Who plays, and how."""
    agent = arguments.run
    if agent.startswith(MODEL_PREFIX):
        return Player(agent, out=arguments.out, options=model_options(arguments))
    if agent == "human":
        return Player(agent, out=session_folder(arguments.out or HUMAN_FOLDER, arguments.participant))
    drawn = arguments.seed or 0
    if agent in UNTRAINED:
        return Player(agent, seed=drawn)
    require_trainer()
    has_own = arguments.on is None or (folder_of(agent) / CONFIG).is_file()
    scenario = own_scenario(agent) if has_own else arguments.on[0]
    return Player(
        agent,
        resolved_device(arguments.device or "auto"),
        bool(arguments.greedy),
        drawn,
        arguments.net,
        RunConfig(scenario=scenario).within(folder_of(agent) if has_own else Path()).code_folder,
    )


def _result(evaluation: Evaluation, scenario: str) -> dict[str, Any]:
    """The figures, of a scenario that is called so in the folder that they are written to."""
    return {
        "scenario": scenario,
        "agent": short_name(evaluation.player.agent),
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
