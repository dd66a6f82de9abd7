"""Write or check the data sheets of the shipped scenarios, docs/scenarios/: `make sheets`."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.atomic import read_json, write_json, write_text
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone
from socialai_dsl.errors import UsageError
from socialai_dsl.loader.shipped import catalogue, shipped_scenarios

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from socialai_dsl.checking.loaded import Loaded

SUMMARY: Final = "write the data sheets of the shipped scenarios, or check that they are up to date"

_IN_FOLDERS: Final = ("classics/", "together/")
MEASURED: Final = "measured.json"
INDEX: Final = "README.md"
_FOLDER: Final = Path("docs/scenarios")
_EPISODES: Final = 20_000
_ROOMS: Final = 5_000
_STATES: Final = 300_000
_LIKENESS: Final = 2.0
"""How far pictures may differ on average, of 255: libraries draw edges a little differently."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenarios", nargs="*", metavar="SCENARIO", help="names of shipped scenarios (default: all)"
    )
    for option, text in (
        (
            "--measure",
            f"play {_EPISODES} random episodes and {_ROOMS} rooms of the script and note the figures",
        ),
        ("--out", "write the sheets"),
        ("--check", "say which sheets are missing or out of date"),
    ):
        parser.add_argument(
            option,
            nargs="?",
            type=Path,
            const=_FOLDER,
            metavar="FOLDER",
            help=f"{text} (default folder: {_FOLDER})",
        )


def execute(arguments: argparse.Namespace) -> Exit:
    """Measure, then write, then check; without any of the three print the sheets."""
    names = arguments.scenarios or sheeted()
    if unknown := [name for name in names if name not in sheeted()]:
        raise UsageError(f"{unknown[0]}: no scenario with a sheet; there are {', '.join(sheeted())}")
    if arguments.measure is not None:
        _measure(names, arguments.measure)
    if arguments.out is not None:
        _write(names, arguments.out)
    if arguments.check is not None:
        stale = stale_files(names, arguments.check)
        for file in stale:
            print(f"{file}: missing or out of date; run `make sheets`", file=sys.stderr)
        return Exit.FINDINGS if stale else Exit.GOOD
    if arguments.measure is None and arguments.out is None:
        for text in _pages(names, _FOLDER).values():
            print(text)
    return Exit.GOOD


def sheeted() -> list[str]:
    """The scenarios that have a sheet."""
    return [*shipped_scenarios(), *(one.name for one in catalogue() if one.name.startswith(_IN_FOLDERS))]


def stale_files(names: list[str], folder: Path) -> list[Path]:
    """The sheets, pictures and the list in a folder that are missing or would be written otherwise now."""
    stale = [
        folder / file
        for file, text in _pages(names, folder).items()
        if not (folder / file).is_file() or (folder / file).read_text(encoding="utf-8") != text
    ]
    return stale + [file for file, drawn in _pictures(names, folder).items() if not alike(file, drawn)]


def _pages(names: list[str], folder: Path) -> dict[str, str]:
    """Text of each sheet, and of the list of all sheets that are there, by the name of the file."""
    from socialai_dsl.analysis.data_sheet import index, page

    measured = _measurements(folder)
    texts = {f"{name}.md": page(name, _load(name), measured.get(name)) for name in names}
    listed = [name for name in sheeted() if name in names or (folder / f"{name}.md").is_file()]
    texts[INDEX] = index({name: (_load(name), measured.get(name)) for name in listed})
    return texts


def _write(names: list[str], folder: Path) -> None:
    from PIL import Image

    for file, text in _pages(names, folder).items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        write_text(folder / file, text)
    for place, drawn in _pictures(names, folder).items():
        if not alike(place, drawn):
            Image.fromarray(drawn).save(place, optimize=True)


def _pictures(names: list[str], folder: Path) -> "dict[Path, NDArray[np.uint8]]":
    """The pictures of the sheets: a room of each scenario, and the diagrams of its dilemmas."""
    from socialai_dsl.analysis.data_sheet import dilemma_pictures
    from tools.sheets_picture import diagram, picture

    measured, drawn = _measurements(folder), {}
    for name in names:
        drawn[folder / f"{name}.png"] = picture(_load(name))
        dilemmas = (measured.get(name) or {}).get("dilemmas", ())
        for file, figures in zip(dilemma_pictures(name, measured.get(name)), dilemmas, strict=True):
            drawn[(folder / name).parent / file] = diagram(name, figures)
    return drawn


def _measure(names: list[str], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        print(f"measuring {name}", file=sys.stderr, flush=True)
        write_json(folder / MEASURED, dict(sorted({**_measurements(folder), name: measure(name)}.items())))


def measure(name: str, episodes: int = _EPISODES, rooms: int = _ROOMS, seed: int = 0) -> dict[str, Any]:
    """Figures of the random policy and, where there is one, of the scenario's own script."""
    from socialai_dsl.episodes.scripts import script_of
    from socialai_dsl.evaluation.chance import play_at_random
    from socialai_dsl.evaluation.scripts import play_script

    sample = play_at_random(name, episodes, seed)
    figures: dict[str, Any] = {
        "random": {
            "episodes": sample.episodes,
            "seed": seed,
            "success_rate": sample.success_rate,
            "success_rate_se": sample.success_se,
            "mean_length": sample.mean_length,
            "mean_reward": sample.mean_reward,
        }
    }
    if script_of(name) is not None:
        report = play_script(name, rooms, seed, _STATES)
        unsolved = {room.index for room in report.unsolved}
        figures["oracle"] = {
            "rooms": report.rooms,
            "seed": seed,
            "success_rate": report.success_rate,
            "success_rate_se": report.success_se,
            "mean_length": report.mean_length,
            "ceiling": report.ceiling,
            "unsolved": {
                verdict: len(report.found(verdict)) for verdict in ("unsolvable", "solvable", "undecided")
            },
            **_by_draw(_load(name), [room not in unsolved for room in range(rooms)], seed),
        }
    if shares := rival_shares(name, rooms, seed):
        figures["rivals"] = shares
    if diagrams := _dilemmas(name, rooms, seed):
        figures["dilemmas"] = diagrams
    return figures


def _dilemmas(name: str, rooms: int, seed: int) -> list[dict[str, Any]]:
    """What is paid by the number of cooperators, for each claim `dilemma`."""
    from socialai_dsl.analysis.dilemma import schelling
    from socialai_dsl.checking.loaded import LoadedScenario

    loaded = _load(name)
    if not isinstance(loaded, LoadedScenario):
        return []
    claims = [plan for plan in loaded.checked.properties if plan.kind == "dilemma"]
    return [schelling(loaded, plan.frames, rooms, seed).figures() for plan in claims]


def rival_shares(name: str, rooms: int = _ROOMS, seed: int = 0) -> dict[str, Any]:
    """The success of each of a scenario's rivals."""
    from socialai_dsl.analysis.effort import Effort
    from socialai_dsl.analysis.properties import solved_by_script
    from socialai_dsl.checking.loaded import LoadedScenario
    from socialai_dsl.compilation import compile_loaded
    from socialai_dsl.frontend import rival_of

    loaded, found = _load(name), dict[str, Any]()
    if not isinstance(loaded, LoadedScenario):
        return found
    for rival in loaded.scenario.rivals:
        won = solved_by_script(compile_loaded(rival_of(loaded, rival)), Effort(rooms, seed))
        error = float((won.mean() * (1 - won.mean()) / rooms) ** 0.5)
        found[rival] = {
            "rooms": rooms,
            "success_rate": float(won.mean()),
            "success_rate_se": error,
            **_by_draw(loaded, won, seed),
        }
    return found


def _by_draw(loaded: "Loaded", won: "Sequence[bool] | NDArray[np.bool_]", seed: int) -> dict[str, Any]:
    """Success for each value of the draws by which a scenario has its results told apart, if it has any."""
    import numpy as np

    from socialai_dsl.analysis.rooms import rooms_by_draw
    from socialai_dsl.checking.loaded import LoadedScenario

    if not isinstance(loaded, LoadedScenario):
        return {}
    found: dict[str, dict[str, Any]] = {}
    for (draw, value), rooms in rooms_by_draw(loaded, len(won), seed).items():
        own = np.asarray(won)[rooms]
        error = float((own.mean() * (1 - own.mean()) / len(own)) ** 0.5)
        figures = {"rooms": len(own), "success_rate": float(own.mean()), "success_rate_se": error}
        found.setdefault(draw, {})[value] = figures
    return {"results_by": found} if found else {}


def _measurements(folder: Path) -> Mapping[str, Any]:
    return read_json(folder / MEASURED) if (folder / MEASURED).is_file() else {}


def _load(name: str) -> "Loaded":
    import socialai_dsl

    return socialai_dsl.load(name)


def alike(path: Path, drawn: "NDArray[np.uint8]") -> bool:
    """Whether a file shows this picture."""
    import numpy as np
    from PIL import Image

    if not path.is_file():
        return False
    with Image.open(path) as image:
        shown = np.asarray(image.convert("RGB"))
    return shown.shape == drawn.shape and float(np.abs(shown.astype(int) - drawn).mean()) < _LIKENESS


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m tools.sheets", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
