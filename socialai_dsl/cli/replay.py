"""`socialai replay`: writes a page that shows episodes step by step."""

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.atomic import read_json, write_text
from socialai_dsl.cli.arguments import episode, episodes, positive, refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import counted
from socialai_dsl.errors import UsageError, first_mistake
from socialai_dsl.runs.folder import CONFIG, REPLAY

if TYPE_CHECKING:
    from socialai_dsl.evaluation.test_set import Evaluation
    from socialai_dsl.replay import Trace

SUMMARY: Final = "write a web page to watch episodes step by step, with rules and reasons"
_RECORDED: Final = 5
_PLAYED: Final = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "source",
        metavar="RUN|SCENARIO|TRACES",
        help="the folder of a run, shipped:NAME, the path or name of a scenario, or traces written by `--out "
        "episodes.json` or `socialai trace --json`",
    )
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        default=Path(REPLAY),
        metavar="FILE",
        help=f"file of the page (default: {REPLAY}); a name that ends in .json gets the traces instead",
    )
    parser.add_argument(
        "--agent",
        metavar="AGENT",
        help="the agent that plays a scenario: oracle, random, shipped, or a run's folder (default: oracle if "
        "there is one, else random)",
    )
    parser.add_argument(
        "--episodes",
        type=episodes,
        metavar="N",
        help=f"number of test episodes to play (default: {_PLAYED})",
    )
    parser.add_argument(
        "--record",
        type=positive,
        metavar="N",
        help=f"keep up to N successes and N failures (default: {_RECORDED})",
    )
    parser.add_argument(
        "--test-episode",
        type=episode,
        action="append",
        metavar="N",
        help="keep only test episode N (repeatable)",
    )
    parser.add_argument(
        "--greedy",
        action="store_true",
        help="take the most probable action of a trained agent (default: sample)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play, trace, write."""
    from socialai_dsl.replay.page import replay_page

    if arguments.out.suffix not in (".html", ".json"):
        raise UsageError(f"--out: got {arguments.out}, expected a name that ends in .html or .json")
    if arguments.source.endswith(".json"):
        idle = ("agent", "episodes", "record", "test_episode", "greedy")
        refuse(arguments, idle, f"{arguments.source} holds episodes that were played already")
        traces = _read(Path(arguments.source))
    else:
        traces = _played(arguments)
    if arguments.out.suffix == ".json":
        write_text(arguments.out, "[" + ",\n".join(trace.as_json() for trace in traces) + "]\n")
    else:
        write_text(arguments.out, replay_page(traces))
    print(f"{counted(len(traces), 'episode')} written to {arguments.out}")
    return Exit.GOOD


def _read(path: Path) -> "list[Trace]":
    """Traces from a file.

    Raises:
        OSError: it cannot be read.
        UsageError: it holds something else.
    """
    from pydantic import TypeAdapter, ValidationError

    from socialai_dsl.replay import Trace

    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        traces = TypeAdapter(list[Trace]).validate_python([found] if isinstance(found, dict) else found)
    except ValidationError as error:
        place, said = first_mistake(error.errors())
        raise UsageError(f"{path}: {place or 'the file'}: {said}") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path}: expected a JSON list of traces, {error}") from None
    if not all(trace.moments for trace in traces) or not traces:
        raise UsageError(f"{path}: expected at least one trace, each with a moment")
    return traces


def _played(arguments: argparse.Namespace) -> "list[Trace]":
    """Test episodes of a run or a scenario: those that were asked for, or successes and failures.

    Raises:
        UsageError: a language model has not played one that was asked for.
    """
    numbers = arguments.test_episode
    if numbers is not None:
        refuse(arguments, ("episodes", "record"), "--test-episode says which episodes are played and kept")
    played = arguments.episodes or _PLAYED
    evaluation = _evaluation(arguments, played if numbers is None else max(numbers) + 1)
    for warning in evaluation.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    if numbers is None:
        return evaluation.traces(evaluation.to_replay(arguments.record or _RECORDED))
    for number in numbers:
        if number not in evaluation.actions:
            raise UsageError(
                f"--test-episode: got {number}, expected less than {len(evaluation.actions)}, as many as were played"
            )
    return evaluation.traces(dict.fromkeys(numbers))


def _evaluation(arguments: argparse.Namespace, episodes: int) -> "Evaluation":
    from socialai_dsl.episodes.players import MODEL_PREFIX, Player, folder_of, named_agent
    from socialai_dsl.episodes.scripts import script_of
    from socialai_dsl.evaluation.test_set import (
        evaluate,
        evaluation_of_model,
        evaluation_of_person,
        own_scenario,
    )
    from trainer.config import UNTRAINED

    source = arguments.source
    folder = folder_of(source)
    if (folder / CONFIG).is_file():
        if arguments.agent is not None:
            raise UsageError(
                "--agent: a run is replayed by its own agent; name a scenario to let another play"
            )
        agent, scenario = source, own_scenario(source)
        played_by = str(read_json(folder / CONFIG).get("agent"))
        if played_by == "human" or played_by.startswith(MODEL_PREFIX):
            refuse(arguments, ("greedy",), f"the agent {played_by!r} has played already")
        if played_by == "human":
            return evaluation_of_person(folder, scenario, episodes)
        if played_by.startswith(MODEL_PREFIX):
            return evaluation_of_model(folder, played_by, scenario, episodes)
    else:
        scenario = source
        usual = "oracle" if script_of(scenario) is not None else "random"
        agent = named_agent(arguments.agent or usual, scenario)
        if agent == "human" or agent.startswith(MODEL_PREFIX):
            raise UsageError(
                f"--agent: got {agent!r}, who plays for `socialai evaluate`; what that writes is replayed by its folder"
            )
        if agent in UNTRAINED:
            refuse(arguments, ("greedy",), f"the agent {agent!r} has no use for it")
    return evaluate(Player(agent, greedy=arguments.greedy), scenario, episodes)
