"""Which rooms are played: those of the test set, those of a seed, or known ones from a file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.baselines import MOST_EPISODES
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.draws import MAX_SEED
from socialai_dsl.envs.options import origin
from socialai_dsl.envs.scenario_env import ScenarioEnv
from socialai_dsl.errors import OptionError
from socialai_dsl.loader.layouts import read_layout
from socialai_dsl.loader.reader import read_source
from socialai_dsl.program_suite import Playable

_TEST: Final = "test"
_SEED: Final = "seed:"
_EXPECTED: Final = (
    f"expected {_TEST}, {_SEED}N such as {_SEED}7, or a JSON or YAML file with a list of layouts"
)


@dataclass(frozen=True)
class RoomSet:
    """Rooms that are numbered from 0, and are the same for everybody who plays them.

    Attributes:
        name: `test`, `seed:7`, or a file's name with a digest of what it holds.
        seed: None: the rooms are those of the test set.
        layouts: where they come from a file, what it says of each room; the rest is drawn from seed 0.
    """

    name: str = _TEST
    seed: int | None = None
    layouts: Sequence[Mapping[str, Any]] | None = None

    @classmethod
    def named(cls, name: str | Path) -> Self:
        """The rooms that a user names.

        Args:
            name: `test`, `seed:N`, or the path of a JSON or YAML file with a list of layouts, a room each.

        Raises:
            OptionError: it is none of these.
            ScenarioError: the file is no YAML.
            OSError: it cannot be read.
        """
        text = str(name)
        if text == _TEST:
            return cls()
        if text.startswith(_SEED):
            return cls.of_seed(_number(text))
        path = Path(text)
        if not path.exists() or path.is_dir():
            raise OptionError("rooms", f"got {text!r}, {_EXPECTED}")
        try:
            found = read_layout(read_source(path))
        except ValueError as error:
            raise OptionError("rooms", str(error)) from None
        layouts = found if isinstance(found, list) else [found]
        if not layouts or not all(isinstance(one, dict) for one in layouts):
            raise OptionError(
                "rooms", f"{text}: expected a list of layouts, each a mapping such as `describe()` returns"
            )
        digest = hashlib.sha256(json.dumps(layouts, sort_keys=True).encode()).hexdigest()
        return cls(f"{path.name} ({digest[:8]})", 0, layouts)

    @classmethod
    def of_seed(cls, seed: int) -> Self:
        """The rooms of a seed, in the order of their index."""
        return cls(f"{_SEED}{seed}", seed)

    def record(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"name": self.name, "seed": self.seed, "layouts": self.layouts}

    @property
    def is_test_set(self) -> bool:
        """Whether these are the rooms of the test set."""
        return self.seed is None

    @property
    def count(self) -> int:
        """How many there are."""
        return MOST_EPISODES if self.layouts is None else len(self.layouts)

    def title(self, number: int) -> str:
        """What a room is called for people, such as `test episode 3`."""
        return f"room {number} of {self.name}" if self.layouts is not None else origin(self.reset(number))

    def reset(self, number: int) -> dict[str, Any]:
        """The arguments of a single environment's `reset` that begin the episode in room `number`."""
        if self.seed is None:
            return {"options": {"test_episode": number}}
        known = {} if self.layouts is None else {"layout": self.layouts[number]}
        return {"seed": self.seed, "options": {"index": number, **known}}

    def reset_many(self, begun: NDArray[np.bool_], numbers: NDArray[np.int64]) -> dict[str, Any]:
        """The arguments of a vector environment's `reset` that begin episodes in these rooms.

        Args:
            begun: bool (E,), the environments where one begins.
            numbers: int64 (E,), of the rooms.
        """
        chosen: dict[str, Any] = {"reset_mask": begun}
        if self.seed is None:
            return {"options": {**chosen, "test_episode": numbers.tolist()}}
        if self.layouts is not None:
            chosen["layout"] = [self.layouts[number] for number in numbers.tolist()]
        return {"seed": self.seed, "options": {**chosen, "index": numbers.tolist()}}

    def check(self, program: Playable) -> None:
        """Raise OptionError where a layout is none of this scenario's, or what is shared in a session would differ."""
        if self.seed is not None and program.session > 1:
            said = f"got {self.name}, but {program.name} has sessions, which the test set alone has"
            raise OptionError("rooms", said)
        if self.layouts is None:
            return
        env = ScenarioEnv(program)
        try:
            for number in range(self.count):
                try:
                    env.reset(**self.reset(number))
                except (ValueError, RuntimeError, ScenarioError) as error:
                    raise OptionError("rooms", f"{self.title(number)}: {error}") from None
        finally:
            env.close()


def _number(text: str) -> int:
    digits = text.removeprefix(_SEED)
    if not (digits.isascii() and digits.isdecimal()) or int(digits) > MAX_SEED:
        raise OptionError(
            "rooms", f"got {text!r}, expected {_SEED}N with a whole number N from 0 to {MAX_SEED}"
        )
    return int(digits)


TEST_ROOMS: Final = RoomSet()
"""The test set."""
