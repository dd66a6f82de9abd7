"""An experiment as resolved conditions and runs with ids, as its folder records them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from socialai_dsl.checking.experiments import LoadedExperiment, from_anywhere, is_phases, prices_from_anywhere
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.runs.options import resolved_config, usual_options
from socialai_dsl.schema.experiment import AGENTS, Reference
from socialai_dsl.semantics.experiment import Cell
from socialai_dsl.trainer.config import BONUS_SCALES, MODEL_PREFIX, RIVAL_PREFIX, WITHOUT_EFFECT, RunConfig
from socialai_dsl.trainer.files import CHECKPOINTS, checkpoint_files
from socialai_dsl.trainer.shipped import PREFIX, located

FORMAT: Final = 1

OF_ANY_AGENT: Final = ("device", "eval_episodes")
"""Options that also matter to agents that are not trained."""

OF_OWN_CODE: Final = ("net", "algorithm")
"""Options that also matter to a checkpoint, where they name code of one's own."""

_PROGRAMS: Final = "test_programs"
"""The key of a condition's tests with the digests of their scenarios."""

_WITHOUT_EFFECT: Final = ("key_from", "concurrency", "timeout", "budget", "prices")
"""Options of language models on which no reply depends."""

_ID_LENGTH: Final = 12
# Options that earlier versions did not have: where they are as usual, runs of those versions keep their names.
_CAME_LATER: Final = ("returns",)


def document_of(loaded: LoadedExperiment, profile: str | None) -> dict[str, Any]:
    """The content of `experiment.json`.

    Args:
        loaded: the experiment.
        profile: one of its profiles, or None for the file without any.

    Raises:
        ScenarioError: a scenario cannot be compiled.
        OSError: a checkpoint cannot be read.
    """
    cells = [completed(cell, loaded.played[cell.scenario]) for cell in loaded.cells[profile]]
    names = {name for cell in cells for name in (cell.scenario, *cell.tests)}
    programs = {name: compile_loaded(loaded.played[name]).sha256 for name in names}
    weights = {
        cell.agent: _weights_digest(loaded.folder / located(cell.agent))
        for cell in cells
        if not _is_named(cell.agent)
    }
    return {
        "format": FORMAT,
        "name": loaded.experiment.experiment,
        "profile": profile,
        "about": loaded.experiment.about,
        "source_sha256": _source_digest(loaded),
        "conditions": [_condition(cell, loaded.folder, programs) for cell in cells],
        "runs": [
            {
                "id": run_id(
                    cell,
                    seed,
                    programs[cell.scenario],
                    weights.get(cell.agent, cell.agent),
                    _code_digests(cell, loaded.folder),
                ),
                "condition": cell.name,
                "seed": seed,
            }
            # A first seed of everything before the second of anything: half-way there is something to look at.
            for number in range(max((len(cell.seeds) for cell in cells), default=0))
            for cell in cells
            for seed in cell.seeds[number : number + 1]
        ],
    }


def completed(cell: Cell, played: Loaded) -> Cell:
    """The condition with what the recipe `guided` takes from its scenario."""
    if not cell.trains or cell.options.get("recipe") != "guided":
        return cell
    options = usual_options("guided", played)
    frames = options.pop("frames")
    return replace(cell, frames=cell.frames or frames, options=options | dict(cell.options))


def run_id(cell: Cell, seed: int, program: str, agent: str, code: Mapping[str, str]) -> str:
    """The name of a run's folder: a hash of all that decides what the run computes.

    Args:
        cell: its condition.
        seed: its own.
        program: digest of the compiled scenario.
        agent: its name, or the digest of its weights.
        code: option -> digest of the file of the user's own that it names.
    """
    config = config_of(cell, seed)
    usual = {name for name in _CAME_LATER if getattr(config, name) == RunConfig.model_fields[name].default}
    options = config.model_dump(
        exclude={"scenario", "agent", "recipe", *(WITHOUT_EFFECT - {"frames"}), *usual}
    )
    decisive = options | {"program": program, "agent": agent} | ({"code": dict(code)} if code else {})
    decisive |= {"trials": cell.trials} if cell.trials > 1 else {}
    asked = {name: value for name, value in cell.model.items() if name not in _WITHOUT_EFFECT}
    decisive |= {"model": asked} if asked else {}
    text = json.dumps(decisive, sort_keys=True, ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_ID_LENGTH]


def config_of(cell: Cell, seed: int = 0) -> RunConfig:
    """The configuration of a condition's runs, with every value resolved.

    Raises:
        OptionError: its options contradict each other.
    """
    given: dict[str, Any] = {"scenario": cell.scenario, "agent": cell.agent, "seed": seed}
    options = {name: value for name, value in cell.options.items() if name != "hyper"}
    options |= cell.options.get("hyper", {})
    if not cell.trains:
        kept = {name: options[name] for name in (*OF_ANY_AGENT, *_own_code(cell)) if name in options}
        return resolved_config(given | kept | {"frames": 0})
    if cell.frames is not None:
        given["frames"] = cell.frames
    return resolved_config(given | options)


def _own_code(cell: Cell) -> list[str]:
    """The options that name code of one's own by which a checkpoint plays."""
    if _is_named(cell.agent) or cell.agent.startswith(PREFIX):
        return []
    return [name for name in OF_OWN_CODE if ":" in cell.options.get(name, "")]


def options_of(cell: Cell) -> dict[str, Any]:
    """The options that `socialai-run` is given for a condition's runs, the automatic ones among them by value.

    One thread unless the condition says more: what a run computes must not depend on the machine.
    """
    config = config_of(cell).model_dump()
    if not cell.trains:
        played = {name: config[name] for name in (*OF_ANY_AGENT, *_own_code(cell))}
        played |= {"trials": cell.trials} if cell.trials > 1 else {}
        return played | ({"model": dict(cell.model)} if cell.model else {})
    asked = [name for name in cell.options if name not in ("hyper", "recipe")]
    names = dict.fromkeys(
        ("net", "envs", "bonus", "device", "threads", "checkpoint_every", "eval_episodes", *asked)
    )
    hyper = dict(cell.options.get("hyper", {}))
    if config["bonus"] in BONUS_SCALES:
        hyper["bonus_c"] = config["bonus_c"]
    return {
        "recipe": config["recipe"],
        **{name: config[name] for name in names},
        **({"hyper": hyper} if hyper else {}),
    }


def differences(kept: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """What an experiment's folder says differently from what is asked for, in words; nothing if they agree."""
    found = [
        f"{key}: {kept.get(key)!r} there, {asked.get(key)!r} here"
        for key in ("name", "profile")
        if kept.get(key) != asked.get(key)
    ]
    before, programs_before = _without_programs(kept.get("conditions", ()))
    now, programs = _without_programs(asked["conditions"])
    found += [f"the condition `{name}` is there, and not here" for name in before if name not in now]
    found += [f"the condition `{name}` is here, and not there" for name in now if name not in before]
    for name in now:
        if name in before:
            found += [f"`{name}`, {said}" for said in _changes(before[name], now[name])]
    runs_before, runs_now = _seeds(kept.get("runs", ())), _seeds(asked["runs"])
    found += [
        f"`{name}`, seeds: {_listed(runs_before[name])} there, {_listed(runs_now[name])} here"
        for name in runs_now
        if name in runs_before and runs_before[name].keys() != runs_now[name].keys()
    ]
    found += [
        f"`{name}`: its scenario, its checkpoint or its code has changed since"
        for name in runs_now
        if name in before
        and before[name] == now[name]
        and any(runs_before[name].get(seed, run) != run for seed, run in runs_now[name].items())
    ]
    found += [
        f"`{name}`: {test}, one of its tests, has changed since"
        for name in now
        for test, program in programs[name].items()
        if programs_before.get(name, {}).get(test, program) != program
    ]
    return found


def _without_programs(
    conditions: Sequence[Mapping[str, Any]],
) -> tuple[dict[str, dict[str, Any]], dict[str, Mapping[str, str]]]:
    """Conditions by name, and apart the digests of their tests, which folders of earlier versions lack."""
    rest = {one["name"]: {k: v for k, v in one.items() if k != _PROGRAMS} for one in conditions}
    return rest, {one["name"]: one.get(_PROGRAMS, {}) for one in conditions}


def _changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    flat = [{**{k: v for k, v in c.items() if k != "options"}, **c["options"]} for c in (before, now)]
    keys = dict.fromkeys([*flat[0], *flat[1]])
    return [
        f"{key}: {flat[0].get(key)!r} there, {flat[1].get(key)!r} here"
        for key in keys
        if flat[0].get(key) != flat[1].get(key)
    ]


def _seeds(runs: Sequence[Mapping[str, Any]]) -> dict[str, dict[int, str]]:
    found: dict[str, dict[int, str]] = {}
    for run in runs:
        found.setdefault(run["condition"], {})[run["seed"]] = run["id"]
    return found


def _listed(seeds: Mapping[int, str]) -> str:
    return ", ".join(map(str, seeds))


def _condition(cell: Cell, folder: Path, programs: Mapping[str, str]) -> dict[str, Any]:
    return {
        "name": cell.name,
        "row": cell.row,
        "column": cell.column,
        "group": cell.group,
        "scenario": from_anywhere(cell.scenario, folder),
        "agent": _agent(cell.agent, folder),
        "frames": cell.frames if cell.trains else None,
        "options": _options(cell, folder),
        "tests": [from_anywhere(name, folder) for name in cell.tests],
        _PROGRAMS: {from_anywhere(name, folder): programs[name] for name in cell.tests},
        "reference": _reference(cell.reference),
        "test_references": {
            from_anywhere(name, folder): _reference(reference)
            for name, reference in cell.tests.items()
            if reference is not None
        },
    }


def _options(cell: Cell, folder: Path) -> dict[str, Any]:
    """`options_of`, as `socialai run` takes them from any folder."""
    options = options_of(cell)
    if is_phases(options.get("curriculum")):
        options["curriculum"] = from_anywhere(options["curriculum"], folder)
    if "prices" in options.get("model", {}):
        options["model"]["prices"] = prices_from_anywhere(str(cell.model["prices"]), folder)
    return options


def _agent(agent: str, folder: Path) -> str:
    """The agent of a condition as `socialai run` takes it from any folder."""
    return agent if _is_named(agent) or agent.startswith(PREFIX) else str((folder / agent).resolve())


def _is_named(agent: str) -> bool:
    """Whether an agent has no weights: whoever plays by a name."""
    return agent in AGENTS or agent.startswith((MODEL_PREFIX, RIVAL_PREFIX))


def _reference(reference: Reference | None) -> dict[str, Any] | None:
    return None if reference is None else reference.model_dump()


def _source_digest(loaded: LoadedExperiment) -> str:
    """Of the texts of the experiment's own files."""
    texts = [source.text for _, source in sorted(loaded.resolved.files.items())]
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


def _code_digests(cell: Cell, folder: Path) -> dict[str, str]:
    """Of the files of the user's own classes, and of a curriculum's phases, by option."""
    config = config_of(cell).model_copy(update={"scenario": from_anywhere(cell.scenario, folder)})
    files = dict(config.own_files)
    if is_phases(config.curriculum):
        files["curriculum"] = Path(from_anywhere(config.curriculum, folder))
    return {name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in files.items()}


def _weights_digest(path: Path) -> str:
    """Of a checkpoint's file: the newest of a run's folder or of a folder of checkpoints."""
    file = path
    if path.is_dir():
        files = checkpoint_files(path) or checkpoint_files(path / CHECKPOINTS)
        if not files:
            raise FileNotFoundError(2, "there is no checkpoint in this folder", str(path))
        file = files[-1]
    with open(file, "rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()
