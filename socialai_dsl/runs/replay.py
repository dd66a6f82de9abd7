"""Episodes to watch again: of a run, of a scenario, or from a file of traces."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

from socialai_dsl.atomic import write_text
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.partners import Named, partners_of
from socialai_dsl.episodes.players import Agent, Player, folder_of, named_agent
from socialai_dsl.episodes.room_sets import TEST_ROOMS, RoomSet
from socialai_dsl.episodes.scripts import script_of
from socialai_dsl.errors import OptionError, UsageError, first_mistake
from socialai_dsl.evaluation.language_model import TRANSCRIPTS
from socialai_dsl.evaluation.test_set import (
    Evaluation,
    evaluation_of_model,
    evaluation_of_person,
    play_test_set,
    rooms_of,
    trace_test_episodes,
)
from socialai_dsl.frontend import load
from socialai_dsl.runs.evaluate import made_player, own_scenario
from socialai_dsl.runs.folder import CONFIG, Run, agent_of
from socialai_dsl.traces import Trace
from socialai_dsl.traces.page import replay_page

REPLAYED: Final = 5
"""The number of successes, and of failures, that are kept."""
PLAYED: Final = 100
"""The number of test episodes of which these are."""
_ENDINGS: Final = (".html", ".json")


def replay(
    source: str | Path,
    out: str | Path | None = None,
    *,
    agent: Agent | None = None,
    episodes: int | None = None,
    record: int | None = None,
    test_episodes: Iterable[int] | None = None,
    greedy: bool = False,
) -> list[Trace]:
    """Trace test episodes step by step, with rules and reasons, as `socialai replay` does.

    Args:
        source: the folder of a run or of an evaluation, `shipped:NAME`, the path or name of a scenario, or a file of
            traces, which ends in `.json`.
        out: a file that ends in `.html` gets a page to watch them, one that ends in `.json` the traces; None: neither.
        agent: who plays a scenario, as for `evaluate` (default: its script if it has one, else `random`).
        episodes: how many test episodes are played (default: 100).
        record: up to how many successes, and how many failures, are kept (default: 5).
        test_episodes: numbers of test episodes, which are played and kept instead.
        greedy: whether a trained agent takes its most probable action.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: an option does not go with the source, or an agent does not fit (a ValueError).
        OSError: a file cannot be read or written.
    """
    place = None if out is None else Path(out)
    if place is not None and place.suffix not in _ENDINGS:
        raise OptionError("out", f"got {place}, expected a name that ends in {' or '.join(_ENDINGS)}")
    if str(source).endswith(".json"):
        given = {"agent": agent, "episodes": episodes, "record": record, "test_episode": test_episodes}
        for name in [*(name for name, value in given.items() if value is not None), *["greedy"] * greedy]:
            raise OptionError(name, f"{source} holds episodes that were played already")
        traces = _read(Path(source))
    else:
        numbers = None if test_episodes is None else list(dict.fromkeys(test_episodes))
        if numbers is not None and (episodes is not None or record is not None):
            name = "record" if episodes is None else "episodes"
            raise OptionError(name, "--test-episode says which episodes are played and kept")
        traces = _played(str(source), agent, greedy, episodes or PLAYED, record or REPLAYED, numbers)
    if place is not None:
        written = place.suffix == ".json"
        whole = (
            "[" + ",\n".join(trace.as_json() for trace in traces) + "]\n" if written else replay_page(traces)
        )
        write_text(place, whole)
    return traces


def _read(path: Path) -> list[Trace]:
    """Traces from a file.

    Raises:
        OSError: it cannot be read.
        UsageError: it holds something else.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        traces = TypeAdapter(list[Trace]).validate_python([found] if isinstance(found, dict) else found)
    except ValidationError as error:
        place, said = first_mistake(error.errors())
        raise UsageError(f"{path}: {place or 'the file'}: {said}") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path}: expected a JSON list of traces, {error}") from None
    if not all(trace.moments for trace in traces) or not traces:
        raise UsageError(f"{path}: expected at least one trace, each with a moment")
    return traces


def _played(
    source: str, agent: Agent | None, greedy: bool, episodes: int, record: int, numbers: Sequence[int] | None
) -> list[Trace]:
    """Those episodes that were asked for, or successes and failures, of a run or a scenario."""
    evaluation: Evaluation | None = None
    remembered: int | None = None
    named, rooms = list[tuple[str, str]](), TEST_ROOMS
    if (folder_of(source) / CONFIG).is_file():
        if agent is not None:
            raise OptionError(
                "agent", "a run is replayed by its own agent; name a scenario to let another play"
            )
        folder, scenario = folder_of(source), own_scenario(source)
        evaluation = _kept(folder, scenario, episodes if numbers is None else max(numbers) + 1, greedy)
        player = made_player(source, [], _greedy(greedy), None) if evaluation is None else evaluation.player
        run, rooms = Run(folder), rooms_of(folder)
        remembered = (run.result or {}).get("trials")
        named = [(seat, names[0]) for seat, names in run.config.partners.items()]
    else:
        scenario, player = source, _player_of_scenario(source, agent, greedy)
    if evaluation is None:
        # What a policy of one's own does may depend on all that it played before.
        if numbers is not None and player.policy is None:
            return _alone(player, scenario, numbers, remembered, named, rooms)
        loaded, count = load(scenario), episodes if numbers is None else max(numbers) + 1
        program = compiled(loaded)
        trials = remembered or program.session
        whole = min(-(-count // trials) * trials, rooms.count // trials * trials)
        partners = partners_of(named, scenario, program)
        evaluation = play_test_set(player, scenario, loaded, program, whole, trials, partners, room_set=rooms)
    _warn(evaluation.warnings)
    if numbers is None:
        return evaluation.traces(evaluation.to_replay(record))
    for number in numbers:
        if number not in evaluation.actions:
            raise OptionError(
                "test_episode",
                f"got {number}, expected less than {len(evaluation.actions)}, as many as were played",
            )
    return evaluation.traces(numbers)


def _alone(
    player: Player,
    scenario: str,
    numbers: Sequence[int],
    remembered: int | None,
    named: Named,
    rooms: RoomSet,
) -> list[Trace]:
    """These episodes, without playing others than those of their sessions."""
    for number in numbers:
        if not 0 <= number < rooms.count:
            raise OptionError("test_episode", f"got {number}, expected 0 to {rooms.count - 1}")
    loaded = load(scenario)
    program = compiled(loaded)
    partners, trials = partners_of(named, scenario, program), remembered or program.session
    traces, told = trace_test_episodes(player, scenario, loaded, program, numbers, trials, partners, rooms)
    _warn(told, callers=5)
    return traces


def _kept(folder: Path, scenario: str, most: int, greedy: bool) -> Evaluation | None:
    """What a person, or anybody with a language model, has played in a folder; None of others, who play again."""
    player = Player(agent_of(folder))
    if not (player.is_person or (folder / TRANSCRIPTS).is_dir()):
        return None
    if greedy:
        raise OptionError("greedy", f"the agent {player.agent!r} has played already")
    if player.is_person:
        return evaluation_of_person(folder, scenario, most)
    return evaluation_of_model(folder, player.agent, scenario, most)


def _player_of_scenario(scenario: str, agent: Agent | None, greedy: bool) -> Player:
    """Who plays a scenario, by default its script if it has one."""
    if agent is None:
        agent = "random" if script_of(scenario) is None else "oracle"
    named = named_agent(str(agent), scenario) if isinstance(agent, str | Path) else agent
    player = made_player(named, [scenario], _greedy(greedy), None)
    if player.is_person or player.is_model:
        raise OptionError(
            "agent",
            f"got {player.agent!r}, who plays for `socialai evaluate`; what that writes is replayed by its folder",
        )
    return player


def _greedy(greedy: bool) -> dict[str, Any]:
    """What was typed; nothing else, because not every agent has a use for it."""
    return {"greedy": True} if greedy else {}


def _warn(told: Iterable[str], callers: int = 4) -> None:
    """Warn whoever called `replay`, so many calls above."""
    for warning in told:
        warnings.warn(warning, stacklevel=callers)
