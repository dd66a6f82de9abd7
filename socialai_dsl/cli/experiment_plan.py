"""`socialai experiment plan`: the runs, the time they need and their progress."""

import argparse
import sys

from socialai_dsl.cli.arguments import refuse
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.experiment_tables import plan_text
from socialai_dsl.cli.terminal import json_text
from socialai_dsl.experiments.estimate import Speeds
from socialai_dsl.experiments.figures import plan_figures
from socialai_dsl.experiments.folder import runs_of
from socialai_dsl.experiments.measure import measure_unknown
from socialai_dsl.experiments.request import requested, workers


def plan(arguments: argparse.Namespace) -> Exit:
    """Print the plan."""
    if arguments.json:
        refuse(arguments, ("each",), "the JSON object has every run")
    document, folder = requested(arguments.file, arguments.profile, arguments.out)
    runs = runs_of(folder, document)
    speeds = Speeds(runs)
    if arguments.measure:
        measure_unknown(runs, speeds, lambda line: print(line, file=sys.stderr, flush=True))
    figures = plan_figures(document, folder, runs, speeds, arguments.workers or workers(document))
    print(json_text(figures) if arguments.json else plan_text(figures, arguments.each))
    return Exit.GOOD
