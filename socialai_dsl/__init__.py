"""Social grid-worlds that are declared in YAML, compiled to integer tables and stepped in batches.

The public surface, imported on first use so that checking a file loads neither Gymnasium nor Numba:

* `load(name)`: check a file, or a shipped scenario or suite by name, with variants: `talkitout+unsocial`.
* `compile(scenario)`: its `Program`, the integer tables with vocabulary and source map; of a suite a `ProgramSuite`.
* `load_curriculum(path)`: check a file of phases, which says what of a suite is played in training, and when.
* `make(name)` and `make_vec(name, num_envs=...)`: Gymnasium environments, single and vectorised;
  `make_parallel(name)`: one of PettingZoo, where several members of the cast have a seat.
* `train(scenario, frames=...)` and `resume(folder)`: train an agent, test it and write the folder of the run, a `Run`.
* `evaluate(agent, scenario)`, `record(evaluation, folder)`, `replay(run)`, `trace(scenario)` and `report(folders)` do
  what the commands do, with every kind of agent.

Importing this package makes the ids `SocialAI/...-v1` known to Gymnasium.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from socialai_dsl import _gymnasium_hook

if TYPE_CHECKING:
    from socialai_dsl.compilation import compile_loaded as compile
    from socialai_dsl.diagnostics import Diagnostic, ScenarioError
    from socialai_dsl.envs import ScenarioEnv, ScenarioVectorEnv, make, make_parallel, make_vec
    from socialai_dsl.episodes.traces import trace
    from socialai_dsl.frontend import LoadedScenario, LoadedSuite, load, load_curriculum
    from socialai_dsl.program import Program
    from socialai_dsl.program_suite import ProgramSuite
    from socialai_dsl.runs.evaluate import evaluate
    from socialai_dsl.runs.folder import Run
    from socialai_dsl.runs.recordings import record
    from socialai_dsl.runs.replay import replay
    from socialai_dsl.runs.report import report
    from socialai_dsl.runs.train import Progress, resume, train

__version__ = "0.1.0"

_HOME = {
    "load": ("socialai_dsl.frontend", "load"),
    "load_curriculum": ("socialai_dsl.frontend", "load_curriculum"),
    "LoadedScenario": ("socialai_dsl.frontend", "LoadedScenario"),
    "LoadedSuite": ("socialai_dsl.frontend", "LoadedSuite"),
    "compile": ("socialai_dsl.compilation", "compile_loaded"),
    "Program": ("socialai_dsl.program", "Program"),
    "ProgramSuite": ("socialai_dsl.program_suite", "ProgramSuite"),
    "make": ("socialai_dsl.envs", "make"),
    "make_parallel": ("socialai_dsl.envs", "make_parallel"),
    "make_vec": ("socialai_dsl.envs", "make_vec"),
    "train": ("socialai_dsl.runs.train", "train"),
    "resume": ("socialai_dsl.runs.train", "resume"),
    "Run": ("socialai_dsl.runs.folder", "Run"),
    "Progress": ("socialai_dsl.runs.train", "Progress"),
    "ScenarioEnv": ("socialai_dsl.envs", "ScenarioEnv"),
    "ScenarioVectorEnv": ("socialai_dsl.envs", "ScenarioVectorEnv"),
    "evaluate": ("socialai_dsl.runs.evaluate", "evaluate"),
    "record": ("socialai_dsl.runs.recordings", "record"),
    "replay": ("socialai_dsl.runs.replay", "replay"),
    "report": ("socialai_dsl.runs.report", "report"),
    "trace": ("socialai_dsl.episodes.traces", "trace"),
    "ScenarioError": ("socialai_dsl.diagnostics", "ScenarioError"),
    "Diagnostic": ("socialai_dsl.diagnostics", "Diagnostic"),
}

__all__ = [
    "Diagnostic",
    "LoadedScenario",
    "LoadedSuite",
    "Program",
    "ProgramSuite",
    "Progress",
    "Run",
    "ScenarioEnv",
    "ScenarioError",
    "ScenarioVectorEnv",
    "compile",
    "evaluate",
    "load",
    "load_curriculum",
    "make",
    "make_parallel",
    "make_vec",
    "record",
    "replay",
    "report",
    "resume",
    "trace",
    "train",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'socialai_dsl' has no attribute {name!r}")
    module, attribute = _HOME[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


_gymnasium_hook.install()
