"""`socialai evaluate`: plays the test set with a trained agent, a script, chance or a language model."""

import argparse
import sys
from pathlib import Path
from typing import Any, Final

from socialai_dsl.cli.arguments import (
    TELL_OPTIONS,
    add_participant,
    add_seats,
    add_tell,
    episodes,
    natural,
    positive,
    seed,
    typed_options,
)
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.model_options import MODEL_OPTIONS, add_options
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.episodes.partners import called
from socialai_dsl.episodes.room_sets import RoomSet
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.summary import aligned, ending_lines, probe_lines, rule_lines, summary_rows
from socialai_dsl.evaluation.test_set import Evaluation
from socialai_dsl.runs.evaluate import RECORDED, evaluate_each, made_players, result_of
from socialai_dsl.runs.folder import EVALUATIONS, REPLAY, RESULT

SUMMARY: Final = "test a trained agent, a script, chance or a language model on a fixed set of episodes"

EXAMPLES: Final = (
    ("socialai evaluate runs/gate --episodes 20", "tests the agent of a run"),
    ("socialai evaluate oracle --on talkitout --episodes 20", "tests the script"),
    (
        "socialai evaluate shipped:talkitout --rooms seed:1 --episodes 100",
        "tests a trained agent in rooms beside the test set",
    ),
    (
        "socialai evaluate llm:MODEL --on talkitout --base-url http://localhost:8080/v1",
        "tests a language model",
    ),
)

_OPTIONS: Final = (
    "greedy",
    "seed",
    "device",
    "net",
    "algorithm",
    "participant",
    "view",
    *TELL_OPTIONS,
    *MODEL_OPTIONS,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "run",
        metavar="AGENT",
        help="the folder of a run, a checkpoint, shipped:NAME, shipped (the agent of each scenario), random, "
        "oracle (the script), rival:NAME, llm:MODEL or human",
    )
    parser.add_argument(
        "--on",
        action="append",
        metavar="SCENARIO",
        help="the scenario to play (repeatable; default: that of the run)",
    )
    parser.add_argument(
        "--episodes",
        type=episodes,
        metavar="N",
        help="number of episodes (default: 500, or all rooms of a file)",
    )
    parser.add_argument(
        "--rooms",
        default="test",
        metavar="test|seed:N|FILE",
        help="the rooms: the test set (default), those of a seed, or a JSON or YAML file with a list of layouts, "
        "a room each",
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
        help="seed of the sampling (default: 0); it does not change the rooms, see --rooms",
    )
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        help="where the network runs (default: auto)",
    )
    parser.add_argument("--net", metavar="mine:Net", help="import this code, for a network of your own")
    parser.add_argument(
        "--algorithm", metavar="mine:Algorithm", help="import this code, for an algorithm of your own"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"write {EVALUATIONS}, and for each scenario a folder with {RESULT}, films, transcripts, a page that "
        "replays them and a list of all episodes; `socialai report` takes these folders",
    )
    parser.add_argument(
        "--record",
        type=natural,
        metavar="N",
        help=f"with --out: record up to N successes and N failures (default: {RECORDED})",
    )
    parser.add_argument(
        "--trials",
        type=positive,
        metavar="K",
        help="number of episodes in a row that the agent remembers, with results by trial (default: those of a session "
        "of the scenario, or 1)",
    )
    add_seats(parser, models=True)
    add_participant(parser, "for the agent human: ")
    parser.add_argument(
        "--view",
        choices=("seat", "room"),
        help="for the agent human: show what the agent sees (default), or the whole room",
    )
    parser.add_argument(
        "--json", action="store_true", help="print a JSON array with one object for each scenario"
    )
    add_tell(parser)
    add_options(parser)


def execute(arguments: argparse.Namespace) -> Exit:
    """Evaluate on each scenario."""
    agent, scenarios, out = arguments.run, arguments.on or [], arguments.out
    if arguments.record is not None and out is None:
        raise UsageError("--record: expected --out DIR as well, where the recordings go")
    if agent == "human" and arguments.json:
        raise UsageError("--json: the agent 'human' plays on standard output")
    player, seats = made_players(agent, arguments.seat, scenarios, typed_options(arguments, _OPTIONS), out)
    recorded = RECORDED if arguments.record is None else arguments.record
    results = []
    asked = arguments.episodes, recorded, out, arguments.trials, seats, RoomSet.named(arguments.rooms)
    for evaluation in evaluate_each(player, scenarios, *asked):
        results.append(result_of(evaluation))
        for warning in evaluation.warnings:
            print(f"warning: {warning}", file=sys.stderr)
        if not arguments.json:
            print(_table(evaluation, results[-1]["eval"]), flush=True)
            if (place := evaluation.folder) is not None:
                replay = f", to look at in {place / REPLAY}" if (place / REPLAY).is_file() else ""
                print(f"\nepisodes written to {place}{replay}\n", flush=True)
    if arguments.json:
        print(json_text(results))
    return Exit.GOOD


def _table(evaluation: Evaluation, figures: dict[str, Any]) -> str:
    parts = [
        [", ".join((evaluation.scenario, f"agent {evaluation.player.agent}", *_company(evaluation)))],
        aligned(summary_rows(figures)),
        probe_lines(figures),
        ending_lines(figures),
        rule_lines(figures),
    ]
    return "\n\n".join("\n".join(lines) for lines in parts if lines)


def _company(evaluation: Evaluation) -> list[str]:
    """Who sat where, if anybody was named."""
    if not evaluation.partners:
        return []
    partners = [f"{seat} by {called(player)}" for seat, player in evaluation.partners.items()]
    return [f"on the seat of {evaluation.seat}", *partners]
