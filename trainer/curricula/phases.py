"""Curricula as files of phases, each with its members and its end."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from socialai_dsl.schema.curriculum import Curriculum, Group, Ramp
from socialai_dsl.trainer.curricula.base import Leaves
from socialai_dsl.trainer.curricula.even import Lengths

_ONE = 1 << 20


class Phases:
    """A curriculum of phases."""

    def __init__(self, plan: Curriculum, leaves: Leaves) -> None:
        """Look up who is in which group. Raises ValueError for a group without leaves."""
        self._plan = plan
        self._natural = leaves.weights
        self._groups = [
            [
                _found(group, leaves, f"curriculum: phases.{p}.play.{g}")
                for g, group in enumerate(phase.groups)
            ]
            for p, phase in enumerate(plan.phases)
        ]
        self._given = [[group.weight for group in phase.groups] for phase in plan.phases]
        # Without the default, which the plans of earlier checkpoints do not have.
        written = plan.model_dump_json(exclude={"share"} if plan.share == "episodes" else None)
        self._digest = hashlib.sha256(written.encode()).hexdigest()
        self._lengths = Lengths(len(leaves.names)) if plan.share == "frames" else None
        self.phase = 0
        self._episodes = 0
        self._last: list[int] = []

    def observe(self, member: int, success: bool, steps: int) -> None:
        """See `Curriculum.observe`; whichever member it was of, an episode counts for the phase it ends in."""
        if self._lengths is not None:
            self._lengths.observe(member, steps)
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
        shares = [
            one.after(self._episodes) if isinstance(one, Ramp) else one for one in self._given[self.phase]
        ]
        if sum(shares) <= 0:
            shares = [1.0] * len(shares)
        parts = [0.0] * len(self._natural)
        for share, members in zip(shares, self._groups[self.phase], strict=True):
            whole = sum(self._natural[member] for member in members)
            for member in members:
                parts[member] += share / sum(shares) * self._natural[member] / whole
        if self._lengths is not None:
            return self._lengths.episodes_for(parts)
        return [max(1, round(_ONE * part)) if part else 0 for part in parts]

    def state(self) -> dict[str, Any]:
        """See `Curriculum.state`."""
        return {
            "plan": self._digest,
            "phase": self.phase,
            "episodes": self._episodes,
            "last": "".join(map(str, self._last)),
            **({"lengths": self._lengths.state()} if self._lengths is not None else {}),
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """See `Curriculum.load_state`."""
        if state["plan"] != self._digest:
            raise ValueError("curriculum: its file has changed since this checkpoint")
        phase, episodes, last = state["phase"], state["episodes"], [int(digit) for digit in state["last"]]
        if not 0 <= phase < len(self._plan.phases) or episodes < 0 or set(last) - {0, 1}:
            raise ValueError("curriculum: the state is damaged")
        if self._lengths is not None:
            self._lengths.load_state(state["lengths"])
        self.phase, self._episodes, self._last = phase, episodes, last


def _found(group: Group, leaves: Leaves, place: str) -> list[int]:
    """Numbers of a group's leaves. Raises ValueError, with the place, if there is none, or one is not there."""
    for name in group.members or ():
        if name not in leaves.names:
            raise ValueError(f"{place}: the suite has no member {name!r}")
    only, without = _labels(group.only), _labels(group.without)
    for parameter, values in only.items():
        known = {labels[parameter] for labels in leaves.labels if parameter in labels}
        for value in values:
            if value not in known:
                listed = ", ".join(sorted(known)) or "no values: the suite has no such parameter"
                raise ValueError(f"{place}: got {parameter}: {value}; the suite has {listed}")
    found = [
        number
        for number, (name, labels) in enumerate(zip(leaves.names, leaves.labels, strict=True))
        if (group.members is None or name in group.members)
        and _has(labels, only)
        and not (without and _has(labels, without))
    ]
    if not found:
        raise ValueError(f"{place}: no member of the suite is in this group")
    return found


def _labels(wanted: Mapping[str, Any]) -> dict[str, list[str]]:
    """Parameter -> the labels of a tree that its value, or list of them, stands for."""
    listed = {key: value if isinstance(value, tuple) else (value,) for key, value in wanted.items()}
    return {
        key: [str(one).lower() if isinstance(one, bool) else str(one) for one in values]
        for key, values in listed.items()
    }


def _has(labels: Mapping[str, str], wanted: Mapping[str, list[str]]) -> bool:
    return all(labels.get(parameter) in values for parameter, values in wanted.items())
