"""Plays the test set with an agent, and leaves a folder of results if one is named."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from socialai_dsl.atomic import read_json, write_json
from socialai_dsl.envs.factory import compiled
from socialai_dsl.envs.options import refuse_unknown
from socialai_dsl.episodes.partners import called, partners_of
from socialai_dsl.episodes.players import (
    HUMAN_FOLDER,
    Agent,
    Player,
    existing_folder,
    folder_of,
    is_name,
    named_agent,
    played_again,
    player_of,
    require_trainer,
    session_folder,
)
from socialai_dsl.episodes.room_sets import TEST_ROOMS, RoomSet
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.evaluation.language_model import TRANSCRIPTS
from socialai_dsl.evaluation.test_set import Evaluation, play_test_set, rooms_of
from socialai_dsl.frontend import load
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.runs.copies import keep_partners, keep_scenario
from socialai_dsl.runs.folder import (
    CONFIG,
    EVALUATIONS,
    LOCK_FILES,
    RESULT,
    ROOMS,
    Run,
    new_folders,
    only_writer,
    scenario_folder_name,
    scenario_of,
)
from socialai_dsl.runs.options import resolved_device
from socialai_dsl.runs.recordings import write_recordings
from socialai_dsl.runs.versions import versions
from socialai_dsl.schema.scenario import TEST_SET
from socialai_dsl.traces.endings import short_name
from socialai_dsl.trainer.config import MODEL_PREFIX, RunConfig

_PLAYER: Final = ("greedy", "seed", "device", "net", "algorithm")
_MODEL: Final = tuple(field.name for field in fields(ModelOptions))
_TOLD: Final = ("tell", "goal", "language")
_OF_KINDS: Final[dict[str, tuple[str, ...]]] = {
    "network": _PLAYER,
    "script": (),
    "rival": (),
    "chance": ("seed",),
    "model": (*_MODEL, *_TOLD),
    "person": ("view", "participant", *_TOLD),
}
RECORDED: Final = 3
"""The number of successes, and of failures, that an evaluation films."""


def evaluate(
    agent: Agent,
    scenario: str | Path | None = None,
    episodes: int | None = None,
    *,
    rooms: str | Path | RoomSet = TEST_ROOMS,
    out: str | Path | None = None,
    record: int = RECORDED,
    trials: int | None = None,
    seats: Mapping[str, str | Player] = MappingProxyType({}),
    **options: Any,
) -> Evaluation:
    """Play rooms 0 to `episodes - 1` of the test set of a scenario, or of other rooms, as `socialai evaluate` does.

    Args:
        agent: `random`, `oracle` (the scenario's own script), `rival:NAME` (one of its rivals), `human`, `llm:MODEL`,
            `shipped`, `shipped:NAME`, or the path of a checkpoint or of a run, which stands for whoever played there; a
            `Player`; or a policy of your own, see `Policy`, a model of Stable-Baselines3, or a function from
            observations to actions.
        scenario: a path or a name, with `+variants` and `?parameters`; None: that of the run.
        episodes: how many; by default 500, or all of a file. Rooms are the same for every agent, on every machine.
        rooms: `test` for the test set; `seed:N` for those of a seed, as `check` and `trace` number them; or a
            JSON or YAML file with a list of layouts, a room each.
        out: a folder that gets a folder of the scenario with `result.json`, films, transcripts, a page that replays
            episodes and a list of all; reports take it. A language model and a person have one in any case.
        record: the most successes, and the most failures, that are filmed there.
        trials: how many episodes in a row, a session, the player remembers; a divisor of `episodes`. By default as
            many as the scenario says (`session`), or 1. Results are reported for each trial of a session, so they show
            what the player learns within one. A person remembers a session in any case.
        seats: who plays members of the cast with seats, `{"helper": "runs/help"}`: `script`, `random`, a trained agent,
            `llm:MODEL`, or a `Player`; the agent also `rival:NAME`. The one that is tested plays on the seats that are
            left, a language model or a rival on the first of them alone, and results are those of the first.
        options: of a trained agent `greedy`, `seed`, `device`, `net` and `algorithm`, of `random` the `seed`; of a
            language model those of `ModelOptions`; of a language model and of a person `tell`, `goal` and `language`,
            see `Player`; of a person `view`, and `participant`, with which the name of the session's folder begins.
            Those of a language model also hold for the ones among `seats`, each with a budget of its own.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: the checkpoint or the script does not fit it, or a language model does not answer.
        RunFailed: a language model has spent its budget.
        ValueError: an argument is not what is expected.
        OSError: a file cannot be written.
    """
    named = [] if scenario is None else [str(scenario)]
    place = None if out is None else Path(out)
    player, partners = made_players(agent, list(seats.items()), named, options, place)
    chosen = rooms if isinstance(rooms, RoomSet) else RoomSet.named(rooms)
    asked = episodes, record, place, trials, partners, chosen
    with contextlib.closing(evaluate_each(player, named, *asked)) as evaluations:
        return next(evaluations)


def evaluate_each(
    player: Player,
    scenarios: Sequence[str],
    episodes: int | None,
    record: int = RECORDED,
    out: Path | None = None,
    trials: int | None = None,
    seats: Sequence[tuple[str, str | Player]] = (),
    rooms: RoomSet = TEST_ROOMS,
) -> Generator[Evaluation, None, None]:
    """`evaluate` on several scenarios, one after the other; none: that of the run. `out` gets a list of all results."""
    episodes = min(TEST_SET, rooms.count) if episodes is None else episodes
    if not isinstance(episodes, int) or not 1 <= episodes <= rooms.count:
        raise OptionError("episodes", f"got {episodes!r}, expected a whole number from 1 to {rooms.count}")
    if trials is not None and (not isinstance(trials, int) or trials < 1 or episodes % trials):
        raise OptionError("trials", f"got {trials!r}, expected a divisor of the {episodes} episodes")
    if player.is_person and (trials or 1) > 1:
        raise OptionError("trials", f"got {trials}, but a person remembers all episodes of a session")
    partners = [partner for _, partner in seats if isinstance(partner, Player)]
    keeping = (one.kept_in for one in (player, *partners) if one.is_model or one.is_person)
    folder = next(keeping, out)
    results = []
    with contextlib.nullcontext() if folder is None else _writing(folder):
        for scenario in scenarios or [own_scenario(str(player.run or player.agent))]:
            evaluation = _evaluated(player, scenario, episodes, trials, record, folder, seats, rooms)
            results.append(result_of(evaluation))
            if folder is not None:
                # After each scenario, so that nothing is lost should the agent not fit the next one.
                write_json(folder / EVALUATIONS, results)
            yield evaluation


@contextlib.contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Be the only writer of a folder, which goes again if nothing could be played."""
    with new_folders(folder) as made, only_writer(folder):
        made.update(folder / name for name in LOCK_FILES)
        yield


def _evaluated(
    player: Player,
    scenario: str,
    episodes: int,
    trials: int | None,
    record: int,
    out: Path | None,
    seats: Sequence[tuple[str, str | Player]],
    rooms: RoomSet,
) -> Evaluation:
    playing = replace(player, agent=named_agent(player.agent, scenario)) if player.policy is None else player
    loaded = load(scenario)
    program = compiled(loaded)
    partners = partners_of(seats, scenario, program)
    rooms.check(program)
    play = partial(
        play_test_set, playing, scenario, loaded, program, episodes, trials, partners, room_set=rooms
    )
    if out is None:
        return play()
    place = out / scenario_folder_name(scenario)
    before = rooms_of(place)
    if before.name != rooms.name and any((place / TRANSCRIPTS).rglob("*.jsonl")):
        raise OptionError(
            "rooms", f"got {rooms.name}, but {place} holds episodes of {before.name}; choose another folder"
        )
    with new_folders(place) as made:
        kept = keep_scenario(place, scenario, loaded).scenario
        # As a run that trained nothing, so that reports take it as one.
        settings = {"scenario": kept, "agent": short_name(playing.agent), "seed": playing.seed}
        if partners:
            # A policy of one's own is not kept, so what it played is not played again.
            networks = {seat: [called(one)] for seat, one in partners.items() if one.policy is None}
            own = {seat: [one.agent] for seat, one in partners.items() if one.policy is not None}
            settings |= {"seats": keep_partners(place, networks) | own}
        write_json(place / CONFIG, settings)
        if rooms.is_test_set:
            (place / ROOMS).unlink(missing_ok=True)
        else:
            write_json(place / ROOMS, rooms.record())
        made.update(place.iterdir())
        played = play()
    evaluation = replace(played, folder=place, kept=kept)
    write_recordings(evaluation, out, record, f"agent {short_name(player.agent)}")
    write_json(place / RESULT, result_of(evaluation))
    return evaluation


def made_players(
    agent: Agent,
    seats: Sequence[tuple[str, str | Player]],
    scenarios: Sequence[str],
    options: Mapping[str, Any],
    out: Path | None,
) -> tuple[Player, list[tuple[str, str | Player]]]:
    """Who plays, and who has other seats; options of language models hold for all of them.

    Args:
        agent: see `evaluate`.
        seats: pairs of a seat and who has it.
        scenarios: what is played.
        options: see `evaluate`.
        out: where what a language model or a person plays is kept.

    Raises:
        OptionError: this agent, or who has the seats, has no use for an option.
        ValueError: an option that no agent has; or see `evaluate`.
    """
    of_models = {name: value for name, value in options.items() if name in (*_MODEL, *_TOLD)}
    partners = [
        (
            seat,
            made_player(named, scenarios, of_models if isinstance(named, str) else {}, out)
            if isinstance(named, Player) or named.startswith(MODEL_PREFIX)
            else named,
        )
        for seat, named in seats
    ]
    asked = any(isinstance(named, Player) and named.is_model for _, named in partners)
    reads = isinstance(agent, str) and Player(agent).kind in ("model", "person")
    own = {name: value for name, value in options.items() if reads or not asked or name not in of_models}
    return made_player(agent, scenarios, own, out), partners


def made_player(
    agent: Agent,
    scenarios: Sequence[str],
    options: Mapping[str, Any],
    out: Path | None,
) -> Player:
    """Who plays, and how.

    Args:
        agent: see `evaluate`.
        scenarios: what is played; of none, that of the agent's run.
        options: see `evaluate`.
        out: where what a language model or a person plays is kept.

    Raises:
        OptionError: this agent has no use for an option.
        ValueError: an option that no agent has; or see `evaluate`.
    """
    if isinstance(agent, Player):
        refuse_unknown("evaluate", options, (), "; a Player has them itself")
        if out is None or agent.out is not None:
            return agent
        return replace(agent, out=session_folder(out) if agent.is_person else out)
    if not isinstance(agent, str | Path):
        refuse_unknown("evaluate", options, (), "; what you hand over plays as it is")
        return player_of(agent, scenarios[0] if scenarios else "")
    player = Player(played_again(str(agent)), out=out)
    known, every = _OF_KINDS[player.kind], {name for names in _OF_KINDS.values() for name in names}
    refuse_unknown("evaluate", {k: v for k, v in options.items() if k not in every}, known)
    for name in sorted(options.keys() - set(known)):
        raise OptionError(name, f"the agent {player.agent!r} has no use for it")
    if player.agent != str(agent):
        player = replace(player, run=folder_of(str(agent)))
        options = {**{k: v for k, v in _recorded(player).items() if k in known}, **options}
    if player.is_model:
        told = {name: value for name, value in options.items() if name in _TOLD}
        asked = {name: value for name, value in options.items() if name not in _TOLD}
        return replace(player, options=ModelOptions(**asked), **told)
    if player.is_person:
        seen = {name: value for name, value in options.items() if name != "participant"}
        return replace(player, out=session_folder(out or HUMAN_FOLDER, options.get("participant")), **seen)
    if not player.is_trained:
        return replace(player, **options)
    require_trainer()
    has_own = not scenarios or (folder_of(player.agent) / CONFIG).is_file()
    own = RunConfig(scenario=own_scenario(player.agent) if has_own else scenarios[0])
    folder = own.within(folder_of(player.agent) if has_own else Path()).code_folder
    device = resolved_device(options.get("device", "auto"))
    return replace(player, folder=folder, **{**options, "device": device})


def _recorded(player: Player) -> dict[str, Any]:
    """The seed of what was drawn in the folder that said who plays, and whether actions were the most probable ones."""
    assert player.run is not None, "internal: there is a folder"
    run = Run(player.run)
    return {
        "seed": read_json(run.folder / CONFIG).get("seed", 0),
        "greedy": (run.result or {}).get("greedy", False),
    }


def result_of(evaluation: Evaluation, **more: Any) -> dict[str, Any]:
    """What stands in `result.json`, in one form for all players.

    Args:
        evaluation: what was played.
        more: further keys, such as the figures of training.
    """
    player = evaluation.player
    return {
        "scenario": evaluation.kept or evaluation.scenario,
        "agent": short_name(player.agent),
        "kind": player.kind,
        "network_sha256": _network(player),
        "greedy": player.greedy,
        "seed": player.seed,
        "trials": evaluation.trials,
        **_seats(evaluation),
        **evaluation.granted,
        **more,
        "warnings": list(evaluation.warnings),
        "eval": evaluation.figures(),
        "program_sha256": evaluation.program.sha256,
        "versions": versions(),
    }


def _network(player: Player) -> str:
    """Digest of the network that played, if one did: agents of one name may be several, of other folders or days."""
    if not player.is_trained:
        return ""
    from socialai_dsl.trainer.checkpoint import network_digest

    return network_digest(player.agent)


def _seats(evaluation: Evaluation) -> dict[str, Any]:
    """On which seat the player sat, and with whom, if anybody was named."""
    if not evaluation.partners:
        return {}
    partners = {seat: short_name(called(player)) for seat, player in evaluation.partners.items()}
    return {"seat": evaluation.seat, "partners": partners}


def own_scenario(agent: str) -> str:
    """The scenario on which the agent of a run's folder, or one that ships, was trained.

    Raises:
        UsageError: it is neither.
    """
    if is_name(agent):
        raise UsageError(f"{agent} plays any scenario; name one by --on, such as --on talkitout")
    run = existing_folder(agent)
    if not (run / CONFIG).is_file():
        raise UsageError(f"{run} does not say which scenario it was trained on; name one by --on")
    return scenario_of(run)
