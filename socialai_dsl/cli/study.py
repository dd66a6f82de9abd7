"""`socialai study`: a study with people in the browser, from its file to its data."""

import argparse
import json
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Final

from socialai_dsl.cli.arguments import at_once, number_between, port, positive, seed
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.terminal import ProgressLine
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import LoadedStudy, load_study
from socialai_dsl.loader.reader import shipped_studies
from socialai_dsl.loader.shipped import file_named
from socialai_dsl.study import FIRST_PORT, FOLDER

SUMMARY: Final = "let people take part in a study in the browser, and make tables of what they did"

SIMULATED: Final = "; all of them simulated, in a rehearsal"

EXAMPLES: Final = (
    ("socialai study rehearse asking.yaml", "tries the study with simulated participants, in a minute"),
    ("socialai study rehearse asking.yaml --also rival:first_answer", "adds a rival to them"),
    ("socialai study run asking.yaml --links 2", "serves the study, with links for two people"),
    ("socialai study data asking.yaml", "writes the tables"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command's commands."""
    commands = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    run = commands.add_parser("run", help="serve the study; repeat the command to go on")
    run.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="address to listen on (default: this machine only)",
    )
    run.add_argument(
        "--port", type=port, default=FIRST_PORT, metavar="N", help=f"port (default: {FIRST_PORT})"
    )
    run.add_argument(
        "--public", metavar="URL", help="the address that a proxy serves, such as https://study.example.org"
    )
    run.add_argument(
        "--embed",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="let pages of this origin, such as https://lab.example.org, show the study; may be repeated",
    )
    run.add_argument("--links", type=at_once, metavar="N", help="print links for N new participants")
    rehearse = commands.add_parser(
        "rehearse", help="let simulated participants take part, and say what came of it"
    )
    rehearse.add_argument(
        "--participants", type=positive, metavar="N", help="how many (default: two of each kind, 12)"
    )
    rehearse.add_argument(
        "--also",
        action="append",
        default=[],
        metavar="AGENT",
        help="a further kind of participant: shipped:NAME, the path of a checkpoint or a run's folder, rival:NAME or "
        "llm:MODEL; may be repeated",
    )
    rehearse.add_argument(
        "--pace",
        type=number_between(0.01, 3600),
        default=2.0,
        metavar="SECONDS",
        help="that they take for an act (default: 2)",
    )
    rehearse.add_argument(
        "--speed",
        type=number_between(0.1, 1000),
        metavar="X",
        help="times faster than real time (default: 50, or 1 where a language model plays)",
    )
    rehearse.add_argument(
        "--seed", type=seed, default=0, metavar="S", help="of what they choose by chance (default: 0)"
    )
    status = commands.add_parser("status", help="show how far the study is, also while it runs")
    status.add_argument("--json", action="store_true", help="print a JSON object")
    data = commands.add_parser("data", help="play every episode again, and write the tables")
    data.add_argument(
        "--to", type=Path, metavar="DIR", help="folder for the tables (default: `data` in the study's folder)"
    )
    data.add_argument("--parquet", action="store_true", help="also write Parquet files; needs pyarrow")
    for name, command, act in (
        ("run", run, _run),
        ("rehearse", rehearse, _rehearse),
        ("status", status, _status),
        ("data", data, _data),
    ):
        command.add_argument(
            "file", metavar="FILE", help="the file of a study, or the name of one that ships"
        )
        usual = "default: none is kept" if command is rehearse else f"default: {FOLDER}/NAME"
        command.add_argument(
            "--out", type=Path, metavar="DIR", help=f"folder of all that is stored ({usual})"
        )
        command.set_defaults(action=name, act=act)


def execute(arguments: argparse.Namespace) -> Exit:
    """Do what the command's command says."""
    result: Exit = arguments.act(
        arguments, load_study(file_named(arguments.file, "study", shipped_studies()))
    )
    return result


def _folder(arguments: argparse.Namespace, loaded: LoadedStudy) -> Path:
    folder: Path = arguments.out or Path(FOLDER) / loaded.study.study
    return folder


def _begun(arguments: argparse.Namespace, loaded: LoadedStudy) -> Path:
    """The folder of a study. Raises UsageError where the study has not begun."""
    from socialai_dsl.study.log import FILE

    folder = _folder(arguments, loaded)
    if not (folder / FILE).exists():
        raise UsageError(f"there is no study in {folder}: `socialai study run {arguments.file}` begins one")
    return folder


def _run(arguments: argparse.Namespace, loaded: LoadedStudy) -> Exit:
    """Serve until Ctrl-C."""
    require_server()
    from socialai_dsl.study.serving import serve

    serve(
        loaded,
        _folder(arguments, loaded),
        host=arguments.host,
        port=arguments.port,
        public=arguments.public,
        embed=arguments.embed,
        links=arguments.links or 0,
        say=lambda line: print(line, flush=True),
    )
    return Exit.GOOD


def _rehearse(arguments: argparse.Namespace, loaded: LoadedStudy) -> Exit:
    require_server()
    from socialai_dsl.study.rehearsal import KINDS, rehearse

    kinds = (*KINDS, *arguments.also)
    progress = ProgressLine(sys.stderr)
    with tempfile.TemporaryDirectory() as made:
        folder = arguments.out or Path(made)
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise UsageError(f"{folder}: is not empty; a rehearsal is kept apart from what people have done")
        try:
            found = rehearse(
                loaded,
                folder,
                arguments.participants or 2 * len(kinds),
                arguments.pace,
                arguments.speed,
                kinds,
                seed=arguments.seed,
                say=progress.show,
            )
        finally:
            progress.clear()
    print("\n".join(found.lines(loaded)))
    return Exit.GOOD


def _status(arguments: argparse.Namespace, loaded: LoadedStudy) -> Exit:
    from socialai_dsl.study.status import status_of

    status = status_of(loaded, _begun(arguments, loaded))
    if arguments.json:
        print(json.dumps(asdict(status), indent=2))
        return Exit.GOOD
    came = (
        f"{status.joined} came, {status.declined} declined, {status.began} began, {status.finished} finished"
    )
    print(f"{loaded.study.study}: {came}{SIMULATED if status.simulated else ''}")
    for number, (began, finished) in enumerate(status.groups, start=1):
        order = " ".join(str(block + 1) for block in loaded.design.orders[number - 1])
        print(f"  group {number} (blocks {order}): {began} began, {finished} finished")
    for stage, count in sorted(status.stages.items()):
        print(f"  {count} at {stage}")
    if status.pay is not None and loaded.study.pay is not None:
        print(f"  {status.won} successful episodes; to be paid: {status.pay:.2f} {loaded.study.pay.currency}")
    print(f"  last event: {status.latest}")
    return Exit.GOOD


def _data(arguments: argparse.Namespace, loaded: LoadedStudy) -> Exit:
    require_server()  # it plays the study again
    from socialai_dsl.study.data import write_data
    from socialai_dsl.study.replay import study_data

    folder = _begun(arguments, loaded)
    data = study_data(loaded, folder)
    written = write_data(data, loaded, arguments.to or folder / "data", arguments.parquet)
    unended = f", {data.unended} more have not ended" if data.unended else ""
    simulated = SIMULATED if data.simulated else ""
    print(f"{data.replayed} episodes played again, each came out as it did{unended}{simulated}")
    for file in written:
        print(f"  {file}")
    return Exit.GOOD


def require_server() -> None:
    """See that what the server needs is installed. Raises UsageError."""
    try:
        import markdown_it  # noqa: F401
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
        import websockets  # noqa: F401
    except ImportError as error:
        raise UsageError(f"a study needs {error.name}: pip install 'socialai-dsl[studio]'") from None
