"""The folder of a run: its name, and its small files."""

import contextlib
import json
import platform
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from socialai_dsl.atomic import write_json as write_json
from socialai_dsl.atomic import write_text as write_text
from socialai_dsl.errors import UsageError, first_mistake
from socialai_dsl.experiments.folder import EPISODES as EPISODES
from socialai_dsl.experiments.folder import REPLAY as REPLAY
from socialai_dsl.folder_lock import HeldError, hold
from trainer.config import RunConfig

RESULT: Final = "result.json"
SETTINGS: Final = "config.json"
_WRITER: Final = "run"
LOCK_FILES: Final = (f"{_WRITER}.lock", f"{_WRITER}.owner")
_SECONDS_TO_WAIT: Final = 5.0
"""A process whose parent was killed takes a moment to end."""
_REPORTED_PACKAGES: Final = ("socialai-dsl", "numpy", "numba", "gymnasium", "torch")


def scenario_folder_name(spec: str) -> str:
    """`scenarios/talkitout.yaml+unsocial?a=1&b=2` -> `talkitout+unsocial,a=1,b=2`."""
    path, mark, parameters = spec.partition("?")
    name, plus, variants = Path(path).name.partition("+")
    name = name.removesuffix(".yaml").removesuffix(".yml")
    return name + plus + variants + ("," if mark else "") + parameters.replace("&", ",").replace("/", "_")


@contextlib.contextmanager
def new_run_folder(out: Path | None, spec: str, seed: int) -> Iterator[Path]:
    """Make the folder of a new run, `out` or `runs/<scenario>/<time>-s<seed>`, and be its only writer.

    Raises:
        UsageError: `out` holds a run already, or another process writes there.
        OSError: it cannot be made.
    """
    folder = _fresh_folder(spec, seed) if out is None else out
    with only_writer(folder):
        if (folder / SETTINGS).exists():
            raise UsageError(
                f"--out: {out} holds a run already; go on with --resume, or choose another folder"
            )
        yield folder


def _fresh_folder(spec: str, seed: int) -> Path:
    """Make a folder that no other run has."""
    parent = Path("runs") / scenario_folder_name(spec)
    stamp = f"{time.strftime('%Y%m%d-%H%M%S')}-s{seed}"
    for attempt in range(100):
        folder = parent / (stamp if attempt == 0 else f"{stamp}-{attempt + 1}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        return folder
    raise UsageError(f"{parent}: a hundred runs were started in this second")


@contextlib.contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Be the one process that writes a folder, which is made; the system ends this when the process dies.

    Whoever looks at what the folder holds, to decide what to write, does so inside.

    Raises:
        UsageError: another process writes there; the message names it.
        OSError: the folder cannot be made or written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(hold(folder, _WRITER, _SECONDS_TO_WAIT))
        except HeldError as error:
            raise UsageError(f"{error}; wait until it ends, or choose another folder") from None
        yield


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises:
        OSError: the file cannot be read.
        UsageError: it holds something else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UsageError(f"{path}: expected JSON, {error}") from None
    if not isinstance(content, dict):
        raise UsageError(f"{path}: expected a JSON object, got {type(content).__name__}")
    return content


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that decide a run's results; those not installed are left out."""
    found = {"python": platform.python_version()}
    for package in _REPORTED_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def read_config(folder: Path) -> RunConfig:
    """The configuration of a run's folder, as of a run in this folder.

    Raises:
        UsageError: it is not a run's folder, or its configuration is damaged.
    """
    if not (folder / SETTINGS).is_file():
        raise UsageError(f"{folder} is not a run's folder, it has no {SETTINGS}")
    try:
        # As JSON, because strict validation takes no lists for tuples from Python.
        return RunConfig.model_validate_json(json.dumps(read_json(folder / SETTINGS))).within(folder)
    except ValidationError as error:
        place, said = first_mistake(error.errors())
        raise UsageError(f"{folder / SETTINGS}: {place}: {said}") from None
