"""`socialai export`: a trained agent as a folder that can be given to others."""

import argparse
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from socialai_dsl.atomic import read_json
from socialai_dsl.cli.errors import Exit
from socialai_dsl.errors import UsageError
from socialai_dsl.runs.folder import FILM, LOCK_FILES, RESULT, only_writer, scenario_folder_name

if TYPE_CHECKING:
    from trainer.config import RunConfig

SUMMARY: Final = "make a folder of a trained agent to give to others"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument("run", metavar="RUN_DIR", help="the folder of a finished run, or shipped:NAME")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder to write (default: exports/<scenario>-<network>-s<seed>)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the folder."""
    import socialai_dsl
    from socialai_dsl.evaluation.export import finished_agent, write_agent
    from socialai_dsl.evaluation.players import folder_of, require_trainer

    require_trainer()
    run = folder_of(arguments.run)
    config, loaded, checkpoint = finished_agent(run)
    if socialai_dsl.compile(loaded).sha256 != checkpoint.meta.program_sha256:
        print("warning: the scenario has changed since the agent was trained on it", file=sys.stderr)
    out: Path = arguments.out or Path("exports") / _name(config)
    if out.exists() and not out.is_dir():
        raise UsageError(f"--out: {out} is a file; choose another folder")
    with only_writer(out):
        if any(file.name not in LOCK_FILES for file in out.iterdir()):
            raise UsageError(f"--out: {out} is there already; choose another folder")
        if (run / FILM).is_file():
            shutil.copyfile(run / FILM, out / FILM)
        write_agent(out, config, loaded, checkpoint, read_json(run / RESULT))
    print(f"written to {out}; try it: socialai evaluate {out}")
    return Exit.GOOD


def _name(config: "RunConfig") -> str:
    net = config.net.replace(":", ".")
    return f"{scenario_folder_name(config.scenario)}-{net}-s{config.seed}"
