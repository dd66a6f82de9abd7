"""Curricula as files of phases, each with its members and its end."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from trainer.curricula.base import Leaves

_ONE = 1 << 20


def _labels(value: Any) -> Any:
    """A value, or a list of them, as the labels of a tree."""
    listed = value if isinstance(value, list | tuple) else [value]
    return tuple(str(one).lower() if isinstance(one, bool) else str(one) for one in listed)


Values = dict[str, Annotated[tuple[str, ...], BeforeValidator(_labels)]]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Ramp(_Model):
    """A weight that changes evenly with the episodes of the phase, and then stays."""

    start: float = Field(alias="from", ge=0, le=1e6)
    to: float = Field(ge=0, le=1e6)
    over: int = Field(ge=1, description="episodes")

    def after(self, episodes: int) -> float:
        """The weight after this number of episodes of the phase."""
        return self.start + (self.to - self.start) * min(episodes / self.over, 1.0)


class Group(_Model):
    """Some leaves of a suite, and how likely one of them is played.

    Attributes:
        only: parameter -> value or values; leaves that have one of them for each. Default: all leaves.
        without: the same; leaves that do not have one of them for each.
        members: names, instead of leaves.
        weight: of all these leaves together, in proportion to the other groups of the phase; among them the suite's
            own weights count.
    """

    only: Values = Field(default_factory=dict)
    without: Values = Field(default_factory=dict)
    members: tuple[str, ...] | None = None
    weight: float | Ramp = Field(1.0)

    def find(self, leaves: Leaves, place: str) -> list[int]:
        """Numbers of its leaves. Raises ValueError, with the place, if there is none, or it names what is not there."""
        for name in self.members or ():
            if name not in leaves.names:
                raise ValueError(f"{place}: the suite has no member {name!r}")
        for parameter, values in self.only.items():
            known = {labels[parameter] for labels in leaves.labels if parameter in labels}
            for value in values:
                if value not in known:
                    listed = ", ".join(sorted(known)) or "no values: the suite has no such parameter"
                    raise ValueError(f"{place}: got {parameter}: {value}; the suite has {listed}")
        found = [
            number
            for number, (name, labels) in enumerate(zip(leaves.names, leaves.labels, strict=True))
            if (self.members is None or name in self.members)
            and _has(labels, self.only)
            and not (self.without and _has(labels, self.without))
        ]
        if not found:
            raise ValueError(f"{place}: no member of the suite is in this group")
        return found


class Until(_Model):
    """The end of a phase: more than a number of episodes, and enough recent success."""

    episodes: int = Field(0, ge=0)
    success: float = Field(0.0, ge=0, le=1)
    over: int = Field(500, ge=1, le=100_000, description="the last episodes, whose mean success counts")


class Phase(_Model):
    """The members of a phase, and its end; the last phase never ends."""

    name: str | None = None
    play: tuple[Group, ...] = Field(default=(Group(),), min_length=1)
    until: Until | None = None


class Plan(_Model):
    """A file of phases."""

    curriculum: str
    about: str | None = None
    phases: tuple[Phase, ...] = Field(min_length=1)


def read_phases(path: Path) -> Plan:
    """The phases in a YAML file.

    Raises:
        ValueError: it cannot be read, or is not of this form; the message says where.
    """
    try:
        plan = Plan.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise ValueError(f"curriculum: {path} cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"curriculum: {path} is not YAML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ValueError(f"curriculum: {path}: {place}: {first['msg']}") from error
    for number, phase in enumerate(plan.phases[:-1]):
        if phase.until is None:
            raise ValueError(
                f"curriculum: {path}: phases.{number}: only the last phase may be without `until`"
            )
    return plan


class Phases:
    """A curriculum of phases."""

    def __init__(self, plan: Plan, leaves: Leaves) -> None:
        """Look up who is in which group. Raises ValueError for a group without leaves."""
        self._plan = plan
        self._natural = leaves.weights
        self._groups = [
            [group.find(leaves, f"curriculum: phases.{p}.play.{g}") for g, group in enumerate(phase.play)]
            for p, phase in enumerate(plan.phases)
        ]
        self._digest = hashlib.sha256(plan.model_dump_json().encode()).hexdigest()
        self.phase = 0
        self._episodes = 0
        self._last: list[int] = []

    def observe(self, member: int, success: bool, steps: int) -> None:
        """See `Curriculum.observe`; whichever member it was of, an episode counts for the phase it ends in."""
        del member, steps
        until = self._plan.phases[self.phase].until
        self._episodes += 1
        if until is None:
            return
        self._last.append(int(success))
        del self._last[: -until.over]
        enough = len(self._last) == until.over and sum(self._last) >= until.success * until.over
        over = self._episodes > until.episodes and (enough or until.success == 0)
        if over and self.phase + 1 < len(self._plan.phases):
            self.phase, self._episodes, self._last = self.phase + 1, 0, []

    def weights(self) -> list[int]:
        """See `Curriculum.weights`."""
        phase = self._plan.phases[self.phase]
        given = [group.weight for group in phase.play]
        shares = [one.after(self._episodes) if isinstance(one, Ramp) else one for one in given]
        if sum(shares) <= 0:
            shares = [1.0] * len(shares)
        weights = [0] * len(self._natural)
        for share, members in zip(shares, self._groups[self.phase], strict=True):
            whole = sum(self._natural[member] for member in members)
            for member in members:
                part = share / sum(shares) * self._natural[member] / whole
                weights[member] += max(1, round(_ONE * part)) if share > 0 else 0
        return weights

    def state(self) -> dict[str, Any]:
        """See `Curriculum.state`."""
        return {
            "plan": self._digest,
            "phase": self.phase,
            "episodes": self._episodes,
            "last": "".join(map(str, self._last)),
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """See `Curriculum.load_state`."""
        if state["plan"] != self._digest:
            raise ValueError("curriculum: its file has changed since this checkpoint")
        phase, episodes, last = state["phase"], state["episodes"], [int(digit) for digit in state["last"]]
        if not 0 <= phase < len(self._plan.phases) or episodes < 0 or set(last) - {0, 1}:
            raise ValueError("curriculum: the state is damaged")
        self.phase, self._episodes, self._last = phase, episodes, last


def _has(labels: Mapping[str, str], wanted: Values) -> bool:
    return all(labels.get(parameter) in values for parameter, values in wanted.items())
