"""A trained agent as a folder that can be given to others."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import socialai_dsl
from socialai_dsl.atomic import write_json, write_text
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite, about_of
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.model_card import model_card
from socialai_dsl.evaluation.scripts import script_of
from socialai_dsl.loader.reader import SUFFIXES, shipped_folder
from socialai_dsl.loader.resolved import name_source, parse_name
from socialai_dsl.runs.folder import CONFIG, RESULT, read_config
from trainer.config import SCENARIO_FOLDER, RunConfig, scenario_in
from trainer.shipped import WEIGHTS

if TYPE_CHECKING:
    from trainer.checkpoint import Checkpoint

CARD: Final = "README.md"
VOCABULARY: Final = "vocabulary.json"


def finished_agent(run: Path) -> "tuple[RunConfig, Loaded, Checkpoint]":
    """The configuration, the scenario and the network of a run's or an agent's folder.

    Raises:
        UsageError: it is not such a folder, it is not finished, or its agent was not trained.
    """
    from trainer import checkpoint as checkpoints
    from trainer.errors import CheckpointError

    config = read_config(run)
    if not config.trains:
        raise UsageError(f"{run}: the agent {config.agent!r} is not trained, there is nothing to export")
    if not (run / RESULT).is_file():
        raise UsageError(f"{run}: expected a finished run, it has no {RESULT}")
    loaded = socialai_dsl.load(config.played)
    try:
        whole = checkpoints.read_agent(run)
        weights = {name: value for name, value in whole.tensors.items() if name.startswith("net.")}
        return config, loaded, checkpoints.Checkpoint(whole.meta, weights)
    except CheckpointError as error:
        raise UsageError(str(error)) from error


def write_agent(
    out: Path,
    config: RunConfig,
    loaded: Loaded,
    checkpoint: "Checkpoint",
    result: Mapping[str, Any],
    agent: str = ".",
) -> None:
    """Write the folder of an agent: its weights, what they are for, its card, and the scenario unless that ships.

    Args:
        out: the folder, which is there.
        config: of the run.
        loaded: its scenario.
        checkpoint: its network.
        result: content of the run's `result.json`.
        agent: by which name `CheckpointPolicy.load` finds the agent, for its card.
    """
    from trainer import checkpoint as checkpoints

    moved = MovedScenario.of(loaded, config.played)
    moved.copy(out)
    # Paths of this machine stay here.
    kept = {"scenario": moved.scenario, "curriculum": _without_place(config.curriculum), "wandb": None}
    written = config.model_copy(update=kept).within(Path())
    code = config.own_files.get("net")
    if code is not None:
        there = out / written.code_folder / code.relative_to(config.code_folder.resolve())
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(code, there)
    meta = checkpoint.meta.model_copy(update={"config": written})
    checkpoints.write_file(out / WEIGHTS, checkpoints.Checkpoint(meta, checkpoint.tensors))
    words = {name: getattr(meta, name) for name in ("vocabulary", "actions", "templates", "nouns")}
    write_json(out / VOCABULARY, words)
    result = moved.told({**result, "scenario": moved.scenario})
    write_text(out / CARD, model_card(written, result, about_of(loaded), agent, WEIGHTS))
    write_json(out / CONFIG, written.model_dump())
    write_json(out / RESULT, result)  # last, so that its presence means a complete folder


def _without_place(text: str) -> str:
    """A file's name without its folders; anything else as it is."""
    return Path(text).name if text.endswith((".yaml", ".yml")) else text


def _members(loaded: Loaded) -> Sequence[LoadedScenario]:
    return loaded.members if isinstance(loaded, LoadedSuite) else ()


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
        same = socialai_dsl.compile(socialai_dsl.load(there)).sha256 == socialai_dsl.compile(loaded).sha256
    except ScenarioError:
        same = False
    if not same:
        raise UsageError(
            f"{spec}: its files cannot be copied to {folder}; replace links by the files themselves"
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
    kept = kept.within(folder)
    phases = Path(config.curriculum)
    beside = phases.parent.resolve() == config.code_folder.resolve()
    own = any(":" in name for name in (config.net, config.bonus, config.curriculum, config.guide))
    if phases.suffix in SUFFIXES and (beside or not own):
        copy = kept.code_folder / (phases.name if beside else f"{phases.stem}.curriculum.yaml")
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(phases, copy)
        kept = kept.model_copy(update={"curriculum": copy.name})
    if config.own_files:
        _copy_code(config.code_folder, kept.code_folder)
    return kept.within(folder, config.code_folder) if own else kept


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
    """

    scenario: str
    texts: Mapping[str, str]
    names: Mapping[str, str]

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
        every = [loaded, *more, *(member for one in (loaded, *more) for member in _members(one))]
        for name, file in (pair for one in every for pair in one.resolved.files.items()):
            there = Path(name).resolve()
            if not there.is_file() or there.is_relative_to(shipped):
                continue
            if not there.is_relative_to(path.parent):
                raise UsageError(f"{name}: lies outside the folder of {path.name}, so it cannot go along")
            new = f"{SCENARIO_FOLDER}/{there.relative_to(path.parent).as_posix()}"
            texts[new] = file.text
            names[name] = names[str(there)] = names[there.name] = new
        return cls(f"{SCENARIO_FOLDER}/{path.name}{rest}", texts, names)

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
