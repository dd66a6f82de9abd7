"""An experiment's models to its conditions: grids written out, variants applied, overrides and a profile put on top."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import prod
from typing import Any, Final

from socialai_dsl.diagnostics import DiagnosticBag, advice_on
from socialai_dsl.schema.annotations import annotation_at, literals
from socialai_dsl.schema.experiment import OPTIONS as KEYS
from socialai_dsl.schema.experiment import (
    Asked,
    Condition,
    Experiment,
    Grid,
    Hyper,
    Override,
    Profile,
    Reference,
    Settings,
    Transfer,
    one_setting,
)
from socialai_dsl.source import DataPath, Node
from socialai_dsl.trainer.config import MODEL_PREFIX, RIVAL_PREFIX

MAX_RUNS: Final = 10_000
"""How many runs an experiment may have."""

OPTIONS: Final = (*KEYS, "recipe", "hyper")
"""Settings that are options of `socialai-run`, under its names with `_` for `-`."""


@dataclass(frozen=True)
class Cell:
    """One condition of an experiment as a profile has it.

    Attributes:
        name: its own. group: of conditions shown together, if any. row, column: its place in the group's table.
        scenario: with all variants, as it is written in the file, so a path is relative to that.
        agent: `ppo`, `random`, `oracle`, `rival:NAME`, `llm:MODEL`, or a path relative to the file.
        frames: to train for; None where nothing is trained, or where the recipe `guided` takes it from the scenario.
        seeds: one run for each.
        options: those of `OPTIONS` that are given.
        tests: scenarios played besides, with all variants -> what was found elsewhere.
        reference: what was found elsewhere on the scenario itself.
        trials: how many test episodes in a row the agent remembers. model: how a language model is asked.
        places: setting -> where its value stands.
    """

    name: str
    group: str | None
    row: str
    column: str
    scenario: str
    agent: str
    frames: int | None
    seeds: tuple[int, ...]
    options: Mapping[str, Any]
    tests: Mapping[str, Reference | None]
    reference: Reference | None
    trials: int
    model: Mapping[str, Any]
    places: Mapping[str, DataPath]

    @property
    def trains(self) -> bool:
        """Whether its agents are trained."""
        return self.agent == "ppo"


def cells_of(
    experiment: Experiment,
    profile: str | None,
    places: Node,
    bag: DiagnosticBag,
    whole: bool = True,
) -> tuple[Cell, ...]:
    """The conditions of an experiment; `bag` says what is wrong with them.

    Args:
        experiment: its models.
        profile: one of its profiles; None: the file without any.
        places: where the parts of the file stand.
        bag: takes the findings.
        whole: whether the models hold everything that the file does; else what is missing is not reported.
    """
    return _Expansion(experiment, places, bag, whole).cells(profile)


def with_variants(scenario: str, variants: Sequence[str]) -> str:
    """`dance?length=2` and `unsocial` -> `dance+unsocial?length=2`."""
    name, mark, parameters = scenario.partition("?")
    return "".join((name, *(f"+{variant}" for variant in variants), mark, parameters))


@dataclass(frozen=True)
class _Layer:
    """Settings and where they stand; a plain value of an axis stands for one setting, at its own place."""

    settings: Settings
    place: DataPath
    plain: bool = False

    def given(self) -> Iterator[tuple[str, Any, DataPath]]:
        for name in Settings.model_fields:
            value = getattr(self.settings, name)
            if value is not None:
                yield name, value, self.place if self.plain else (*self.place, name)


@dataclass(frozen=True)
class _Draft:
    """A condition before its settings are put together; `labels` are what `where` can ask about."""

    name: str
    group: str | None
    row: str
    column: str | None
    place: DataPath
    layers: tuple[_Layer, ...]
    labels: Mapping[str, str] = field(default_factory=dict)

    def known_as(self) -> dict[str, str | None]:
        column = self.column if self.column is not None else str(self._merged().get("agent", "ppo"))
        return {"name": self.name, "row": self.row, "column": column, "group": self.group} | dict(self.labels)

    def _merged(self) -> dict[str, Any]:
        return {name: value for layer in self.layers for name, value, _ in layer.given()}


class _Expansion:
    """Writes out one experiment."""

    def __init__(self, experiment: Experiment, places: Node, bag: DiagnosticBag, whole: bool) -> None:
        self._experiment = experiment
        self._places = places
        self._bag = bag
        self._lost = not whole

    def cells(self, name: str | None) -> tuple[Cell, ...]:
        """The conditions with a profile put on top."""
        whole, profile = self._experiment, self._experiment.profiles.get(name or "", Profile())
        at: DataPath = ("profiles", name) if name in whole.profiles and name is not None else ()
        first = self._layer(whole.set, ("set",))
        own = list(self._drafts(whole.conditions, ("conditions",)))
        last = self._layer(profile.set, (*at, "set"))
        overrides = [(o, ("overrides", i)) for i, o in enumerate(whole.overrides)]
        profiled = [(o, (*at, "overrides", i)) for i, o in enumerate(profile.overrides)]
        drafts = []
        for draft in own:
            above = (*self._matching(overrides, draft), *last, *self._matching(profiled, draft))
            drafts.append(replace(draft, layers=(*first, *draft.layers, *above)))
        self._report_idle([*overrides, *profiled], own)
        extra = self._drafts(profile.conditions, (*at, "conditions")) if at else ()
        drafts += [replace(draft, layers=(*first, *last, *draft.layers)) for draft in extra]
        found = [cell for draft in drafts if (cell := self._cell(draft)) is not None]
        self._check_names(drafts)
        self._check_size(found)
        return tuple(found)

    # -- grids -----------------------------------------------------------------------------------------------

    @staticmethod
    def _layer(settings: Settings | None, place: DataPath) -> tuple[_Layer, ...]:
        return () if settings is None else (_Layer(settings, place),)

    def _drafts(self, items: Sequence[Condition | Grid], at: DataPath) -> Iterator[_Draft]:
        for number, item in enumerate(items):
            place = (*at, number)
            if isinstance(item, Grid):
                yield from self._written_out(item, place)
            else:
                yield _Draft(
                    item.name, item.group, item.row or item.name, item.column, place, (_Layer(item, place),)
                )

    def _written_out(self, grid: Grid, place: DataPath) -> Iterator[_Draft]:
        if prod(map(len, grid.grid.values())) > MAX_RUNS:
            message = f"an experiment has at most {MAX_RUNS} runs, this grid has more conditions"
            self._bag.error("S004", message, self._places.key_span((*place, "grid")))
            self._lost = True
            return
        common = self._layer(grid.set, (*place, "set"))
        axes = [list(self._axis(name, grid, (*place, "grid", name))) for name in grid.grid]
        for chosen in product(*axes):
            labels = dict(zip(grid.grid, (label for label, _ in chosen), strict=True))
            words = list(labels.values())
            layers = tuple(layer for _, layer in chosen)
            column = " ".join(words[1:]) or None
            yield _Draft(
                " / ".join(words), grid.group, words[0], column, layers[-1].place, (*common, *layers), labels
            )

    def _axis(self, name: str, grid: Grid, place: DataPath) -> Iterator[tuple[str, _Layer]]:
        values = grid.grid[name]
        items: Iterator[tuple[str, Any, str | int]] = (
            ((label, value, label) for label, value in values.items())
            if isinstance(values, dict)
            else ((str(value), value, i) for i, value in enumerate(values))
        )
        for label, value, key in items:
            if isinstance(value, Settings):
                yield label, _Layer(value, (*place, key))
                continue
            if name not in Settings.model_fields:
                hint = "or give each label its settings: `{label: {net: fast, envs: 64}}`"
                advice = advice_on(name, Settings.model_fields, hint)
                message = f"an axis with plain values is named after a setting, and `{name}` is none"
                self._bag.error("S101", message, self._places.key_span(place), **advice)
                self._lost = True
                return
            made = self._plain(name, value, (*place, key))
            if made is not None:
                yield label, made
            else:
                self._lost = True

    def _plain(self, name: str, value: str | int, place: DataPath) -> _Layer | None:
        made = one_setting(name, value)
        if isinstance(made, Settings):
            return _Layer(made, place, plain=True)
        words = [str(word) for word in literals(annotation_at(Settings, (name,)))]
        span = self._places.value_span(place)
        if words and isinstance(value, str):
            advice = advice_on(value, words, "one of " + ", ".join(words))
            self._bag.error("S103", f"`{value}` is not a word for `{name}`", span, **advice)
        else:
            self._bag.error("S104", f"`{value}` is no value of `{name}`: {made}", span)
        return None

    # -- overrides -------------------------------------------------------------------------------------------

    @staticmethod
    def _matching(overrides: Sequence[tuple[Override, DataPath]], draft: _Draft) -> Iterator[_Layer]:
        known = draft.known_as()
        for override, place in overrides:
            if all(known.get(key) in values for key, values in override.where.items()):
                yield _Layer(override.set, (*place, "set"))

    def _report_idle(self, overrides: Sequence[tuple[Override, DataPath]], drafts: Sequence[_Draft]) -> None:
        """Overrides that are for nothing: a slip in them would otherwise go unseen."""
        if self._lost:
            return
        known = [draft.known_as() for draft in drafts]
        for override, place in overrides:
            if any(all(k.get(key) in values for key, values in override.where.items()) for k in known):
                continue
            if not self._report_unknown(override, place, known):
                span = self._places.key_span((*place, "where"))
                self._bag.error("S701", "no condition is all of this", span)

    def _report_unknown(
        self, override: Override, place: DataPath, known: Sequence[Mapping[str, str | None]]
    ) -> bool:
        """Report what of `where` no condition has; whether there was such a thing."""
        reported = False
        for key, values in override.where.items():
            there = [k[key] for k in known if key in k]
            path = (*place, "where", key)
            if not there:
                keys = list(dict.fromkeys(word for k in known for word in k))
                advice = advice_on(key, keys, "one of " + ", ".join(keys))
                message = f"no condition has a `{key}`"
                self._bag.error("S701", message, self._places.key_span(path), **advice)
                reported = True
                continue
            for number, value in enumerate(values):
                if value in there:
                    continue
                words = list(dict.fromkeys(word for word in there if word is not None))
                advice = advice_on(value, words, "one of " + ", ".join(words[:12]))
                span = self._places.value_span((*path, number))
                self._bag.error("S701", f"no condition has the {key} `{value}`", span, **advice)
                reported = True
        return reported

    # -- conditions ------------------------------------------------------------------------------------------

    def _cell(self, draft: _Draft) -> Cell | None:
        given: dict[str, Any] = {}
        places: dict[str, DataPath] = {}
        for layer in draft.layers:
            for name, value, place in layer.given():
                if isinstance(value, Hyper | Asked):  # of two layers each may give some
                    value = given.get(name, {}) | value.model_dump(exclude_none=True)
                given[name], places[name] = value, place
        if "scenario" not in given:
            message = f"the condition `{draft.name}` needs a key `scenario`"
            if not self._lost:
                self._bag.error("S105", message, self._places.key_span(draft.place))
            return None
        variants = given.get("variants", ())
        agent = given.get("agent", "ppo")
        guided = given.get("recipe") == "guided"  # its scenario says how many frames, where the file does not
        if agent == "ppo" and "frames" not in given and not guided and not self._lost:
            message = (
                f"the condition `{draft.name}` needs a key `frames`: for how long its agents are trained"
            )
            self._bag.error("S105", message, self._places.key_span(draft.place))
        seeds = self._seeds(given.get("seeds", 1), places.get("seeds", ()))
        self._check_reference(given.get("reference"), places.get("reference", ()))
        for number, (_, reference) in enumerate(map(_tested, given.get("tests", ()))):
            self._check_reference(reference, (*places["tests"], number, "reference"))
        return Cell(
            draft.name,
            draft.group,
            draft.row,
            draft.column if draft.column is not None else agent,
            with_variants(given["scenario"], variants),
            agent,
            given.get("frames"),
            # Scripts and rivals play the test set in one way only; of models nobody knows what a seed is.
            seeds[:1] if agent == "oracle" or agent.startswith((MODEL_PREFIX, RIVAL_PREFIX)) else seeds,
            {name: given[name] for name in OPTIONS if name in given},
            {
                with_variants(name, variants): reference
                for name, reference in map(_tested, given.get("tests", ()))
            },
            given.get("reference"),
            given.get("trials", 1),
            given.get("model", {}) if agent.startswith(MODEL_PREFIX) else {},
            places,
        )

    def _seeds(self, seeds: int | tuple[int, ...], place: DataPath) -> tuple[int, ...]:
        if isinstance(seeds, int):
            return tuple(range(seeds))
        for number, seed in enumerate(seeds):
            if seed in seeds[:number]:
                span = self._places.value_span((*place, number))
                self._bag.error("S702", f"the seed {seed} is given twice", span)
        return tuple(dict.fromkeys(seeds))

    def _check_reference(self, reference: Reference | None, place: DataPath) -> None:
        if reference is not None and reference.std is not None and reference.n is None:
            message = "a `reference` with `std` needs a key `n`: over how many seeds it was measured"
            self._bag.error("S105", message, self._places.key_span((*place, "std")))

    def _check_names(self, drafts: Sequence[_Draft]) -> None:
        seen: dict[str, DataPath] = {}
        for draft in drafts:
            if draft.name in seen:
                span = self._places.key_span(draft.place)
                first = self._places.key_span(seen[draft.name])
                hint = f"the other is in line {first.line}; results are found by these names"
                self._bag.error("S213", f"two conditions are called `{draft.name}`", span, hint=hint)
            seen.setdefault(draft.name, draft.place)

    def _check_size(self, cells: Sequence[Cell]) -> None:
        runs = sum(len(cell.seeds) for cell in cells)
        if runs > MAX_RUNS:
            message = f"an experiment has at most {MAX_RUNS} runs, this one has {runs}"
            self._bag.error("S004", message, self._places.key_span(("conditions",)))


def _tested(test: str | Transfer) -> tuple[str, Reference | None]:
    return (test, None) if isinstance(test, str) else (test.scenario, test.reference)
