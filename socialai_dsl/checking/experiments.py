"""Checks an experiment's file: from its data to its conditions. `frontend` checks their scenarios."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.diagnostics import DiagnosticBag, advice_on, did_you_mean
from socialai_dsl.errors import OptionError
from socialai_dsl.loader.prices import is_table, prices_of
from socialai_dsl.loader.reader import SUFFIXES, display_name, shipped_folder
from socialai_dsl.loader.resolved import ResolvedFile, looks_like_path, shipped_names, taken_apart
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.schema.experiment import AGENTS, BONUSES, NETS, Experiment
from socialai_dsl.schema.shape import model_of
from socialai_dsl.semantics.experiment import Cell, cells_of
from socialai_dsl.source import DataPath
from socialai_dsl.trainer.config import MODEL_PREFIX, RIVAL_PREFIX, RunConfig
from socialai_dsl.trainer.shipped import PREFIX, shipped_agents


@dataclass(frozen=True)
class LoadedExperiment:
    """An experiment with its conditions.

    Attributes:
        experiment: the models. resolved: the data with its positions.
        cells: profile -> its conditions; None is the file without a profile.
        played: the scenarios, by their names in the file, once they are loaded.
    """

    experiment: Experiment
    resolved: ResolvedFile
    cells: Mapping[str | None, tuple[Cell, ...]]
    played: Mapping[str, Loaded] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<LoadedExperiment {self.experiment.experiment}: {len(self.cells[None])} conditions>"

    @property
    def folder(self) -> Path:
        """Where relative paths of the file start."""
        return self.resolved.path.parent

    def named(self) -> Iterator[tuple[str, str, DataPath]]:
        """Each scenario that is played: its name from anywhere, its name in the file, and where that stands."""
        seen = set()
        for cell in (cell for cells in self.cells.values() for cell in cells):
            for written, key in ((cell.scenario, "scenario"), *((test, "tests") for test in cell.tests)):
                if written not in seen:
                    seen.add(written)
                    yield from_anywhere(written, self.folder), written, self._place(cell, written, key)

    def curricula(self) -> Iterator[tuple[str, DataPath]]:
        """Each file of phases that is played by: its path from anywhere, and where it is named."""
        named = {
            cell.options["curriculum"]: cell.places["curriculum"]
            for cells in self.cells.values()
            for cell in cells
            if is_phases(cell.options.get("curriculum"))
        }
        for name, place in named.items():
            yield from_anywhere(name, self.folder), place

    def scripted(self) -> dict[str, list[DataPath]]:
        """Each scenario whose own script is to play or to guide, by its name in the file: where that is asked for."""
        asked: dict[str, list[DataPath]] = {}
        for cell in (cell for cells in self.cells.values() for cell in cells):
            key = _asks_for_script(cell)
            if key is not None:
                for name in (cell.scenario, *(cell.tests if key == "agent" else ())):
                    asked.setdefault(name, []).append(cell.places[key])
        return asked

    def rivals(self) -> Iterator[tuple[str, str, DataPath]]:
        """Each scenario of which a rival plays, by its name in the file, the rival, and where it is named."""
        for cell in (cell for cells in self.cells.values() for cell in cells):
            if cell.agent.startswith(RIVAL_PREFIX):
                yield cell.scenario, cell.agent.removeprefix(RIVAL_PREFIX), cell.places["agent"]

    def _place(self, cell: Cell, written: str, key: str) -> DataPath:
        place = cell.places[key]
        if key == "scenario":
            return place
        tests = self.resolved.tree.at(place).data
        assert isinstance(tests, list), "internal: the shape of tests was checked"
        return (*place, list(cell.tests).index(written)) if len(tests) == len(cell.tests) else place


def _asks_for_script(cell: Cell) -> str | None:
    """The setting by which a condition needs a script of its scenario, if it does."""
    if cell.agent == "oracle":
        return "agent"
    key = "guide" if "guide" in cell.options else "recipe"
    asks = cell.options.get(key) == ("script" if key == "guide" else "guided")
    return key if cell.trains and asks else None


def is_phases(curriculum: str | None) -> bool:
    """Whether a curriculum is a file of phases, and not a shipped one or a class."""
    return curriculum is not None and curriculum.endswith(SUFFIXES)


def from_anywhere(name: str, folder: Path) -> str:
    """A name of a scenario or of another file in a file in `folder`, as it is called from any working directory.

    What is neither a path nor the name of something that ships, such as `school/boxes`, means a file beside the one
    that names it.
    """
    called = taken_apart(name, folder)[0]
    ships = not looks_like_path(called) or _is_in(shipped_folder(), called)
    if called in shipped_names() or (ships and not _is_in(folder, called)):
        return name
    return os.path.abspath(folder / called) + name[len(called) :]


def prices_from_anywhere(given: str, folder: Path) -> str:
    """Prices of models as a file gives them, a table of them as it is called from any working directory."""
    return os.path.abspath(folder / given) if is_table(given) else given


def _is_in(folder: Path, name: str) -> bool:
    """Whether a folder has a file of this name, with or without the suffix."""
    return any((folder / f"{name}{end}").is_file() for end in ("", ".yaml"))


def check_experiment(resolved: ResolvedFile, bag: DiagnosticBag) -> LoadedExperiment | None:
    """An experiment with those of its conditions that can be understood; None if there are none.

    `bag` takes the findings, after which the experiment serves only to check the rest of it.
    """
    shaped = model_of(Experiment, resolved.tree, bag, parameters=False)
    if shaped.model is None:
        return None
    experiment, resolved = shaped.model, resolved.mended(shaped.tree)
    if experiment.profile is not None and experiment.profile not in experiment.profiles:
        hint = "the file's profiles are " + (", ".join(experiment.profiles) or "none")
        advice = advice_on(experiment.profile, experiment.profiles, hint)
        message = f"there is no profile `{experiment.profile}`"
        bag.error("S201", message, resolved.tree.value_span(("profile",)), **advice)
    cells = {
        profile: cells_of(experiment, profile, shaped.tree, bag, whole=not shaped.lost)
        for profile in (None, *experiment.profiles)
    }
    for own in cells.values():
        _check_agents(own, resolved, bag)
        _check_names(own, resolved, bag)
    return LoadedExperiment(experiment, resolved, cells)


def _check_agents(cells: Sequence[Cell], resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    shipped = [PREFIX + name for name in shipped_agents()]
    for cell in cells:
        _check_playing(cell, resolved, bag)
        named = cell.agent.startswith((MODEL_PREFIX, RIVAL_PREFIX)) and not cell.agent.endswith(":")
        if named or cell.agent in (*AGENTS, *shipped) or (resolved.path.parent / cell.agent).exists():
            continue
        near = did_you_mean(cell.agent, (*AGENTS, *shipped))
        hint = (
            None
            if near
            else f"an agent is {', '.join(AGENTS)}, {PREFIX}NAME, {RIVAL_PREFIX}NAME, {MODEL_PREFIX}MODEL, or the path "
            "of a checkpoint or of a run's folder"
        )
        folder = display_name(resolved.path.parent)
        message = f"there is no checkpoint `{cell.agent}` in {folder}"
        bag.error("S703", message, resolved.tree.value_span(cell.places["agent"]), suggestion=near, hint=hint)


def _check_playing(cell: Cell, resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    """Check what settings say together of an agent that is not trained."""
    episodes = cell.options.get("eval_episodes", RunConfig.model_fields["eval_episodes"].default)
    if cell.trials > 1 and (cell.trains or episodes % cell.trials):
        span = resolved.tree.value_span(cell.places["trials"])
        hint = (
            "give it to conditions with another agent"
            if cell.trains
            else "set `eval_episodes` to a multiple of it"
        )
        said = (
            "an agent that is trained has no trials"
            if cell.trains
            else f"{episodes} episodes are no whole sessions"
        )
        bag.error("S104", f"{said} of {cell.trials}" if not cell.trains else said, span, hint=hint)
    if cell.tests and (cell.trials > 1 or cell.agent.startswith((MODEL_PREFIX, RIVAL_PREFIX))):
        span = resolved.tree.value_span(cell.places["tests"])
        hint = "give the further scenarios conditions of their own"
        bag.error("S104", f"`{cell.agent}` plays one scenario, without `tests`", span, hint=hint)
    try:
        ModelOptions(**cell.model)
        if cell.agent.startswith(MODEL_PREFIX) and "prices" in cell.model:
            prices = prices_from_anywhere(str(cell.model["prices"]), resolved.path.parent)
            prices_of(cell.agent.removeprefix(MODEL_PREFIX), prices)
    except OptionError as error:
        bag.error("S104", str(error), resolved.tree.value_span((*cell.places["model"], error.name)))


_NAMES: Final = {"net": NETS, "bonus": BONUSES, "guide": ("none", "script")}
"""Options that name something shipped, or a class of the user's as `mine:Class`."""


def _check_names(cells: Sequence[Cell], resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    for cell in cells:
        for option, shipped in _NAMES.items():
            name = cell.options.get(option, shipped[0])
            if name in shipped or ":" in name:
                continue
            advice = advice_on(name, shipped, f"one of {', '.join(shipped)}, or mine:{option.title()}")
            span = resolved.tree.value_span(cell.places[option])
            bag.error("S103", f"`{name}` is not a word for `{option}`", span, **advice)
