"""Copies of what a run plays and loads, in a folder that is about it, so that the folder can be moved."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from socialai_dsl.atomic import write_text
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError
from socialai_dsl.envs.seats import NOBODY, RANDOM, SCRIPT
from socialai_dsl.episodes.scripts import script_of
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import SUFFIXES, shipped_folder
from socialai_dsl.loader.resolved import name_source, parse_name
from socialai_dsl.runs.folder import SCENARIO
from socialai_dsl.trainer.config import MODEL_PREFIX, PARTNERS_FOLDER, RIVAL_PREFIX, RunConfig, scenario_in
from socialai_dsl.trainer.files import CHECKPOINTS, SUFFIX
from socialai_dsl.trainer.shipped import PREFIX


def keep_scenario(folder: Path, spec: str, loaded: Loaded) -> "MovedScenario":
    """Copy the files of a scenario into a folder that is about it, those of its script included.

    Args:
        folder: is there.
        spec: how the scenario was named.
        loaded: the same.

    Returns:
        How the files are called there. Scenarios that ship keep their names, and nothing is copied.

    Raises:
        UsageError: the copies are not the same scenario, as where a file is a link.
    """
    scripted = script_of(spec, loaded)
    moved = MovedScenario.of(loaded, spec, *([] if scripted is None else [scripted.loaded]))
    if not moved.texts:
        return moved
    moved.copy(folder)
    there = scenario_in(folder, moved.scenario)
    try:
        same = compile_loaded(load(there)).sha256 == compile_loaded(loaded).sha256
    except ScenarioError:
        same = False
    if not same:
        ships = f"name what ships without a path, such as {moved.ships[0]}, and " if moved.ships else ""
        raise UsageError(
            f"{spec}: its files cannot be copied to {folder}; {ships}replace links by the files themselves"
        )
    return moved


def keep_run(folder: Path, config: RunConfig, loaded: Loaded) -> RunConfig:
    """Copy into a run's folder what it plays and loads, so that the folder works wherever it is moved.

    Returns:
        The configuration that names the copies. Code of one's own still comes from where it is, so that its mistakes
        are shown there.

    Raises:
        UsageError, OSError: something cannot be copied.
    """
    kept = config.model_copy(update={"scenario": keep_scenario(folder, config.scenario, loaded).scenario})
    kept = kept.model_copy(update={"seats": keep_partners(folder, config.seats)}).within(folder)
    phases = Path(config.curriculum)
    beside = phases.parent.resolve() == config.code_folder.resolve()
    own = bool(config.own_classes)
    if phases.suffix in SUFFIXES and (beside or not own):
        copy = kept.code_folder / (phases.name if beside else f"{phases.stem}.curriculum.yaml")
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(phases, copy)
        kept = kept.model_copy(update={"curriculum": copy.name})
    if config.own_files:
        _copy_code(config.code_folder, kept.code_folder)
    return kept.within(folder, config.code_folder) if own else kept


def keep_partners(folder: Path, seats: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Copy the networks that play on other seats into a folder that is about them.

    Args:
        folder: is there.
        seats: who plays which, by name.

    Returns:
        How all players there are called in the folder.

    Raises:
        UsageError: an agent cannot be read.
    """

    def kept(seat: str, place: int, name: str) -> str:
        if name in (SCRIPT, RANDOM, NOBODY) or name.startswith((PREFIX, MODEL_PREFIX, RIVAL_PREFIX)):
            return name
        from socialai_dsl.trainer import checkpoint as checkpoints
        from socialai_dsl.trainer.errors import CheckpointError

        try:
            network = checkpoints.read_agent(name).network
        except CheckpointError as error:
            raise OptionError("seat", str(error)) from None
        file = Path(PARTNERS_FOLDER, f"{seat}-{place}-{_label(Path(name))}{SUFFIX}")
        (folder / file).parent.mkdir(exist_ok=True)
        checkpoints.write_file(folder / file, network)
        return file.as_posix()

    return {
        seat: [kept(seat, place, name) for place, name in enumerate(names)] for seat, names in seats.items()
    }


def _label(agent: Path) -> str:
    """What tells an agent from others: the name of its folder, of one checkpoint that of its run with the frames."""
    whole = agent.resolve()
    if whole.suffix != SUFFIX:
        return whole.name
    run = whole.parent.parent if whole.parent.name == CHECKPOINTS else whole.parent
    return f"{run.name}-{whole.stem.lstrip('0') or '0'}"


def _copy_code(folder: Path, there: Path) -> None:
    """Copy the modules of a folder, and its packages, which may import each other."""
    packages = [init.parent for init in folder.glob("*/__init__.py")]
    files = [*folder.glob("*.py"), *(file for package in packages for file in package.rglob("*.py"))]
    for file in files:
        copy = there / file.relative_to(folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)


@dataclass(frozen=True)
class MovedScenario:
    """The scenario's own files, which go along; those that ship stay where they are.

    Attributes:
        scenario: as it is named from the new folder.
        texts: file in the new folder -> its text.
        names: how the old folder's files were called -> how they are called now.
        ships: the names of those that ship.
    """

    scenario: str
    texts: Mapping[str, str]
    names: Mapping[str, str]
    ships: Sequence[str] = ()

    @classmethod
    def of(cls, loaded: Loaded, spec: str, *more: Loaded) -> "MovedScenario":
        """The files of a scenario that was named `spec`, and of `more` variants of it.

        Raises:
            UsageError: one lies outside the scenario's folder and what ships.
        """
        source = name_source(spec)
        start = source.span(0, 1)
        base = parse_name(spec, start, DiagnosticBag(), Path.cwd()).base.text
        rest = spec[len(base) :]
        path, shipped = loaded.resolved.path, shipped_folder().resolve()
        if path.is_relative_to(shipped):
            return cls(path.relative_to(shipped).with_suffix("").as_posix() + rest, {}, {})
        texts, names = {}, {}
        ships: dict[str, None] = {}
        every = [loaded, *more, *(member for one in (loaded, *more) for member in _members(one))]
        for name, file in (pair for one in every for pair in one.resolved.files.items()):
            there = Path(name).resolve()
            if there.is_relative_to(shipped):
                ships[there.relative_to(shipped).with_suffix("").as_posix()] = None
                continue
            if not there.is_file():
                continue
            if not there.is_relative_to(path.parent):
                raise UsageError(f"{name}: lies outside the folder of {path.name}, so it cannot go along")
            new = f"{SCENARIO}/{there.relative_to(path.parent).as_posix()}"
            texts[new] = file.text
            names[name] = names[str(there)] = names[there.name] = new
        return cls(f"{SCENARIO}/{path.name}{rest}", texts, names, tuple(ships))

    def copy(self, out: Path) -> None:
        """Write the files."""
        for name, text in self.texts.items():
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            write_text(out / name, text)

    def told(self, value: Any) -> Any:
        """A JSON value in which files are called as in the new folder, and no place of this machine is left."""
        if isinstance(value, dict):
            return {key: self.told(part) for key, part in value.items()}
        if isinstance(value, list):
            return [self.told(part) for part in value]
        if isinstance(value, str):
            return self.names.get(value, Path(value).name if Path(value).is_absolute() else value)
        return value


def _members(loaded: Loaded) -> Sequence[LoadedScenario]:
    return loaded.members if isinstance(loaded, LoadedSuite) else ()
