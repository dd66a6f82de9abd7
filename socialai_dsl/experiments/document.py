"""What an experiment's folder says is to be run: conditions with every setting resolved, and runs with their ids."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.checking.experiments import LoadedExperiment, from_anywhere
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.experiments.folder import CHECKPOINTS
from socialai_dsl.schema.experiment import AGENTS, Reference
from socialai_dsl.semantics.experiment import Cell

FORMAT: Final = 1

DEFAULTS: Final[Mapping[str, str | int]] = {
    "net": "fast",
    "explo": "none",
    "curriculum": "none",
    "precision": "auto",
    "device": "cpu",
    "threads": 1,
    "checkpoint_every": 50,
    "eval_episodes": 500,
}
"""Options of a run where its condition does not say. One thread: what a run computes must not depend on the machine."""

OF_ANY_AGENT: Final = ("device", "eval_episodes")
"""Options that also matter to agents that are not trained."""

_WITHOUT_EFFECT: Final = ("checkpoint_every",)
"""Options that change nothing about the result, and so nothing about which run it is."""

_ID_LENGTH: Final = 12


def document_of(loaded: LoadedExperiment, profile: str | None) -> dict[str, Any]:
    """The content of `experiment.json`.

    Args:
        loaded: the experiment.
        profile: one of its profiles, or None for the file without any.

    Raises:
        ScenarioError: a scenario cannot be compiled.
        OSError: a checkpoint cannot be read.
    """
    cells = loaded.cells[profile]
    programs = {
        name: compile_loaded(loaded.played[name]).sha256 for name in {cell.scenario for cell in cells}
    }
    weights = {
        cell.agent: _weights_digest(loaded.folder / cell.agent) for cell in cells if cell.agent not in AGENTS
    }
    return {
        "format": FORMAT,
        "name": loaded.experiment.experiment,
        "profile": profile,
        "about": loaded.experiment.about,
        "source_sha256": _source_digest(loaded),
        "conditions": [_condition(cell, loaded.folder) for cell in cells],
        "runs": [
            {
                "id": run_id(cell, seed, programs[cell.scenario], weights.get(cell.agent, cell.agent)),
                "condition": cell.name,
                "seed": seed,
            }
            # A first seed of everything before the second of anything: half-way there is something to look at.
            for number in range(max((len(cell.seeds) for cell in cells), default=0))
            for cell in cells
            for seed in cell.seeds[number : number + 1]
        ],
    }


def run_id(cell: Cell, seed: int, program: str, agent: str) -> str:
    """The name of a run's folder: a hash of all that decides what the run computes.

    Args:
        cell: its condition.
        seed: its own.
        program: digest of the compiled scenario.
        agent: its name, or the digest of its weights.
    """
    options = {key: value for key, value in options_of(cell).items() if key not in _WITHOUT_EFFECT}
    identity = {
        "scenario": cell.scenario,
        "program": program,
        "agent": agent,
        "frames": cell.frames if cell.trains else 0,
        "options": options,
        "seed": seed,
    }
    text = json.dumps(identity, sort_keys=True, ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_ID_LENGTH]


def options_of(cell: Cell) -> dict[str, Any]:
    """The options of a condition's runs, without those that its agent has no use for."""
    options: dict[str, Any] = dict(DEFAULTS) | dict(cell.options)
    if cell.trains:
        return options
    return {key: value for key, value in options.items() if key in OF_ANY_AGENT}


def differences(kept: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """What an experiment's folder says differently from what is asked for, in words; nothing if they agree."""
    found = [
        f"{key}: {kept.get(key)!r} there, {asked.get(key)!r} here"
        for key in ("name", "profile")
        if kept.get(key) != asked.get(key)
    ]
    before = {condition["name"]: condition for condition in kept.get("conditions", ())}
    now = {condition["name"]: condition for condition in asked["conditions"]}
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
        f"`{name}`: its scenario or its checkpoint has changed since"
        for name in runs_now
        if name in before
        and before[name] == now[name]
        and any(runs_before[name].get(seed, run) != run for seed, run in runs_now[name].items())
    ]
    return found


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


def _condition(cell: Cell, folder: Path) -> dict[str, Any]:
    return {
        "name": cell.name,
        "row": cell.row,
        "column": cell.column,
        "group": cell.group,
        "scenario": from_anywhere(cell.scenario, folder),
        "agent": cell.agent if cell.agent in AGENTS else str((folder / cell.agent).resolve()),
        "frames": cell.frames if cell.trains else None,
        "options": options_of(cell),
        "tests": [from_anywhere(name, folder) for name in cell.tests],
        "reference": _reference(cell.reference),
        "test_references": {
            from_anywhere(name, folder): _reference(reference)
            for name, reference in cell.tests.items()
            if reference is not None
        },
    }


def _reference(reference: Reference | None) -> dict[str, Any] | None:
    return None if reference is None else reference.model_dump()


def _source_digest(loaded: LoadedExperiment) -> str:
    """Of the texts of the experiment's own files."""
    texts = [source.text for _, source in sorted(loaded.resolved.files.items())]
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


def _weights_digest(path: Path) -> str:
    """Of a checkpoint's file: the newest of a run's folder or of a folder of checkpoints."""
    file = path
    if path.is_dir():
        files = sorted(path.glob("*.safetensors")) or sorted((path / CHECKPOINTS).glob("*.safetensors"))
        if not files:
            raise FileNotFoundError(2, "there is no checkpoint in this folder", str(path))
        file = files[-1]
    with open(file, "rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()
