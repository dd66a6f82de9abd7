"""Episodes as tests: what was done, heard and reached becomes an entry of `tests` that passes."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.atomic import write_text
from socialai_dsl.authoring.test_text import NameTakenError, file_with, test_text
from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.envs.scenario_env import SILENCE
from socialai_dsl.episodes.play import Observer, Rooms, Step
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.evaluation.scenario_tests import passes
from socialai_dsl.frontend import load
from socialai_dsl.loader.reader import display_name, read_source, shipped_folder
from socialai_dsl.loader.resolved import TESTS, taken_apart
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.semantics.typed import typed
from socialai_dsl.source import Source
from socialai_dsl.traces.state import found

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")


class TakenDialogue(Observer):
    """Takes down an episode, as the steps of a test."""

    def __init__(self) -> None:
        self._steps: list[dict[str, Any]] = []
        self._waiting: list[str] = []
        self._states: dict[str, str] = {}
        self._earned = 0.0
        self._ends = "open"

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        self._states = _states(rooms.env)

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        last = rooms.env.describe()["last"]
        act = typed(last["action"], last["said"])
        heard = [] if step.info["utterance"] == SILENCE else step.info["utterance"].split("\n")
        states = _states(rooms.env)
        changed = {name: state for name, state in states.items() if self._states.get(name) != state}
        self._states = states
        self._earned += float(step.reward[0])
        if step.ended[0]:
            name = outcome_name(step.info)
            self._ends = name.partition("@")[0]
        if not heard and not changed and last["said"] is None:
            self._waiting.append(act)
            return
        self._flush()
        self._steps.append({"do": act} | ({"hears": _one_or_all(heard)} if heard else {}))
        self._steps[-1] |= {"state": changed} if changed else {}

    def _flush(self) -> None:
        """Let acts of which nothing comes be one step."""
        if self._waiting:
            self._steps.append({"do": _one_or_all(self._waiting)})
            self._waiting = []

    def test(self, suffix: str, reset: Mapping[str, Any]) -> dict[str, Any]:
        """The entry of `tests`.

        Args:
            suffix: variants and parameters of what was played.
            reset: the arguments of `env.reset`.
        """
        self._flush()
        room = {**reset, **(reset["options"] or {})}
        del room["options"]
        return {
            **({"of": suffix} if suffix else {}),
            "room": room,
            "play": self._steps,
            "ends": self._ends,
            **({"reward": round(self._earned, 3)} if self._earned else {}),
        }


def _one_or_all(texts: list[str]) -> str | list[str]:
    return texts[0] if len(texts) == 1 else texts


def _states(env: Any) -> dict[str, str]:
    """Member -> the state of its frame, as far as states have names; not the agent's, who may have no frame."""
    described, states = env.describe(), {}
    for frame in env.scenario.frames:
        known = [state.name for state in frame.states] + [step.state for step in frame.steps if step.state]
        state = (found(described, frame.member) or {}).get("state")
        if frame.entity != 0 and state in known:
            states[frame.member] = str(state)
    return states


@dataclass(frozen=True)
class WrittenTest:
    """A test as text.

    Attributes:
        entry: the test. text: the file beside the scenario with it, in which it passes.
        beside: that file; None for a scenario that ships, beside which nothing is written.
    """

    entry: str
    text: str
    beside: Path | None


def written_test(
    taken: TakenDialogue,
    scenario: str,
    reset: Mapping[str, Any],
    name: str,
    read: Callable[[Path], Source | None],
    force: bool = False,
    texts: Mapping[Path, Source] | None = None,
) -> WrittenTest:
    """An episode as a test in the file beside its scenario; nothing is written to the disk.

    Args:
        taken: the episode.
        scenario: as it was asked for, with variants and parameters.
        reset: the arguments of `env.reset`.
        name: of the test.
        read: the file beside the scenario; None if there is none yet.
        force: whether a test of this name may be replaced.
        texts: contents that stand for those of files, as `load` takes them.

    Raises:
        OptionError: that is no name.
        NameTakenError: there is a test of this name.
        UsageError: it is a suite.
        ScenarioError: the file beside the scenario has mistakes, or the test would not pass.
    """
    if not _NAME.fullmatch(name):
        raise OptionError("save_test", f"got {name!r}, expected letters, digits and underscores (at most 40)")
    loaded = load(scenario, texts)
    if isinstance(loaded, LoadedSuite):
        raise UsageError(f"{scenario} is a suite; tests are of a scenario, so play one of its members")
    path = loaded.resolved.path
    beside = path.with_name(path.stem + TESTS)
    test = taken.test(taken_apart(scenario)[1], reset)
    entry = test_text(name, test)
    if path.is_relative_to(shipped_folder().resolve()):
        return WrittenTest(entry, entry, None)
    text = file_with(read(beside), path.name, name, test, force)
    passes(Source(display_name(beside), text, beside), name, texts)
    return WrittenTest(entry, text, beside)


def save_test(
    taken: TakenDialogue, scenario: str, reset: Mapping[str, Any], name: str, force: bool = False
) -> WrittenTest:
    """Write an episode as a test into the file beside its scenario; see `written_test`.

    Raises:
        OSError: it cannot be written.
    """

    def read(beside: Path) -> Source | None:
        return read_source(beside) if beside.exists() else None

    try:
        written = written_test(taken, scenario, reset, name, read, force)
    except NameTakenError as taken_name:
        raise UsageError(f"{taken_name}; --force replaces it") from None
    if written.beside is not None:
        write_text(written.beside, written.text)
    return written
