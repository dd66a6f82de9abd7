"""`socialai-run`: checks a scenario, trains an agent on it, evaluates it, leaves a folder of results."""

import argparse
import sys
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import read_json
from socialai_dsl.cli.arguments import add_scenario
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.run_options import add_options, given_options
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.folder import REPLAY, Run

SUMMARY: Final = "train an agent on a scenario, test it, and write pictures and figures"

EXAMPLES: Final = (
    ("socialai-run talkitout", "trains an agent to mastery, first by imitating the script"),
    ("socialai-run gate.yaml --frames 8192 --eval-episodes 20 --out runs/gate", "trains for a moment"),
    ("socialai-run talkitout --agent shipped --eval-episodes 20", "tests the agent that ships"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    add_scenario(parser, nargs="?")
    add_options(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of this run (default: runs/<scenario>/<time>-s<seed>)"
    )
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="a JSON file of options by name, instead of SCENARIO and options",
    )
    parser.add_argument("--resume", type=Path, metavar="RUN_DIR", help="continue a run that was stopped")
    parser.add_argument("--json", action="store_true", help="print only the result, as a JSON object")


def execute(arguments: argparse.Namespace) -> Exit:
    """Do the whole run."""
    run = _run(arguments)
    result = run.result
    assert result is not None, "internal: a run that has ended has a result"
    print(json_text(result) if arguments.json else _table(result, run))
    return Exit.GOOD


def _run(arguments: argparse.Namespace) -> Run:
    from socialai_dsl.cli.progress import RunProgress
    from socialai_dsl.runs.train import resume, train

    options, scenario = given_options(arguments), arguments.scenario
    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if arguments.json else sys.stdout
    if arguments.config is not None:
        if scenario is not None or options or arguments.resume is not None:
            raise UsageError("--config: the file says all options; give neither SCENARIO nor others")
        options = read_json(arguments.config)
        scenario = options.pop("scenario", None)
    with RunProgress(stream, scenario) as shown:
        if arguments.resume is not None:
            if scenario is not None or arguments.out is not None:
                raise UsageError(
                    "--resume: the run's folder says which scenario it is; give neither SCENARIO nor --out"
                )
            return resume(arguments.resume, progress=shown.update, **options)
        if not isinstance(scenario, str):
            raise UsageError("expected a scenario (a path or a name), or --resume RUN_DIR")
        if options.get("agent") == "human" and arguments.json:
            raise UsageError("--json: the agent 'human' plays on standard output")
        return train(scenario, out=arguments.out, progress=shown.update, **options)


def _table(result: dict[str, Any], run: Run) -> str:
    from socialai_dsl.evaluation.summary import aligned, ending_lines, summary_rows

    rows = summary_rows(result["eval"])
    if result["frames"]:
        seconds, speed = result["train_seconds"], result["frames_per_second"]
        rows.append(("training", f"{result['frames']:,} frames in {seconds:.0f} s, {speed:,.0f} frames/s"))
    rows.append(("written to", str(run.folder)))
    rows.append(("to look at", str(run.folder / REPLAY)))
    return "\n".join(["", *aligned(rows), "", *ending_lines(result["eval"])])
