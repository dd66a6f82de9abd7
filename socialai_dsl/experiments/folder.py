"""The folder of an experiment: what is run, and its runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from socialai_dsl.atomic import read_json
from socialai_dsl.errors import UnreadableError, first_mistake
from socialai_dsl.experiments.record import ExperimentRecord
from socialai_dsl.runs.folder import Run
from socialai_dsl.trainer.config import MODEL_PREFIX, RIVAL_PREFIX, UNTRAINED

EXPERIMENT: Final = "experiment.json"
RUNS: Final = "runs"
_OF_PLAYERS: Final = ("hyper", "trials", "model")
"""Options that are not those of `socialai run`."""


@dataclass(frozen=True)
class PlannedRun(Run):
    """A run as an experiment wants it.

    Attributes:
        condition: of the first condition that it belongs to, as `experiment.json` has it. seed: the run's.
        tests: scenarios that any of its conditions wants the agent to play besides.
        programs: digests of these, as far as they are known.
    """

    condition: Mapping[str, Any]
    seed: int
    tests: tuple[str, ...]
    programs: Mapping[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """What people call the run."""
        return f"{self.condition['name']}, seed {self.seed}"

    @property
    def options(self) -> dict[str, Any]:
        """Its options by name, scenario, agent and seed among them, as `socialai run --config` takes them."""
        condition = self.condition
        options = {name: value for name, value in condition["options"].items() if name not in _OF_PLAYERS}
        if condition["agent"] in UNTRAINED:
            options.pop("device", None)
        if condition["frames"] is not None:
            options["frames"] = condition["frames"]
        named = {"scenario": condition["scenario"], "agent": condition["agent"], "seed": self.seed}
        return {**named, **options, **condition["options"].get("hyper", {})}

    @property
    def is_played(self) -> bool:
        """Whether `socialai evaluate` does it: nothing is trained, and `socialai run` has no such players."""
        named = self.condition["agent"].startswith((MODEL_PREFIX, RIVAL_PREFIX))
        return bool(named or "trials" in self.condition["options"])

    @property
    def missing_tests(self) -> list[str]:
        """What the agent has not played yet, as it is now."""
        if not self.tests:
            return []
        tested = self.tested
        return [name for name in self.tests if name not in tested or self._has_changed(name, tested[name])]

    def _has_changed(self, name: str, figures: Mapping[str, Any]) -> bool:
        """Whether a test that was played is another one now, as far as that is known."""
        played, asked = figures.get("program_sha256"), self.programs.get(name)
        return None not in (played, asked) and played != asked


def runs_of(folder: Path, document: Mapping[str, Any]) -> list[PlannedRun]:
    """The runs of an experiment, each once, in its order."""
    conditions = {condition["name"]: condition for condition in document["conditions"]}
    wanted: dict[str, list[tuple[Mapping[str, Any], int]]] = {}
    for run in document["runs"]:
        wanted.setdefault(run["id"], []).append((conditions[run["condition"]], run["seed"]))
    runs = []
    for identity, uses in wanted.items():
        tests = dict.fromkeys(test for condition, _ in uses for test in condition["tests"])
        programs = {
            test: program
            for condition, _ in uses
            for test, program in condition.get("test_programs", {}).items()
        }
        runs.append(PlannedRun(folder / RUNS / identity, *uses[0], tuple(tests), programs))
    return runs


def read_experiment(folder: Path) -> dict[str, Any]:
    """The content of a folder's `experiment.json`, which `ExperimentRecord` describes.

    Raises:
        UnreadableError: the folder has none, or it is damaged or of another format.
        OSError: it cannot be read.
    """
    path = folder / EXPERIMENT
    if not path.exists():
        raise UnreadableError(f"{folder} is no experiment's folder, it has no {EXPERIMENT}")
    content = read_json(path)
    try:
        ExperimentRecord.model_validate(content)
    except ValidationError as error:
        raise UnreadableError(f"{path}: {': '.join(filter(None, first_mistake(error.errors())))}") from None
    return content
