"""What people have played with partners, as cells of cross-play."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.atomic import read_json
from socialai_dsl.envs.factory import compiled
from socialai_dsl.envs.seats import SCRIPT
from socialai_dsl.episodes.partners import sitting
from socialai_dsl.episodes.play import AGENT
from socialai_dsl.episodes.players import Agent, Player
from socialai_dsl.episodes.results import EvalResult
from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.crossplay import Recording
from socialai_dsl.evaluation.test_set import evaluation_of_person
from socialai_dsl.frontend import load
from socialai_dsl.play.journal import FILE
from socialai_dsl.program_suite import Playable, seats_of
from socialai_dsl.runs.folder import CONFIG, agent_of, scenario_folder_name


def who_has_played(agent: Agent, scenario: str) -> Player | None:
    """The person whose session a folder holds, or the folder of a scenario in there; None of anything else.

    Raises:
        UsageError: it is a session without test episodes.
        OSError: what the folder says cannot be read.
    """
    if not isinstance(agent, str | Path):
        return None
    session, name = Path(agent), scenario_folder_name(scenario)
    if session.name == name and (session / FILE).is_file():
        session = session.parent
    played = session / name
    if not (played / FILE).is_file():
        return None
    if not (played / CONFIG).is_file() or not Player(agent_of(played)).is_person:
        raise UsageError(
            f"{session}: holds what `socialai play` keeps, which is no test; expected a session of "
            "`socialai evaluate human`"
        )
    return Player("human", run=session)


def recordings_of(players: Sequence[Player], scenario: str, most: int) -> dict[int, Recording]:
    """What the people among players have played with one of the others, by their index.

    Args:
        players: those who are to play, and people who have.
        scenario: a path or a name.
        most: up to how many test episodes count.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: a person has played another version of it, or not with one of these players on all other seats.
        OSError: what a folder says cannot be read.
    """
    program = compiled(load(scenario))
    return {
        number: _recording(player, players, scenario, program, most)
        for number, player in enumerate(players)
        if player.is_person
    }


def _recording(
    person: Player, players: Sequence[Player], scenario: str, program: Playable, most: int
) -> Recording:
    assert person.run is not None, "internal: a person has played before"
    folder = person.run / scenario_folder_name(scenario)
    evaluation = evaluation_of_person(folder, scenario, most)
    if not evaluation.rooms.is_test_set:
        raise UsageError(
            f"{person.run}: played rooms of {evaluation.rooms.name}, expected those of the test set"
        )
    own, beside = evaluation.seat, _beside(folder, program, evaluation.seat)
    sat = (all(_sat(player, name, folder) for name in beside.values()) for player in players)
    partner = next((number for number, so in enumerate(sat) if so), None)
    if partner is None:
        who = " and ".join(f"{name} as {seat}" for seat, name in beside.items())
        raise UsageError(f"{person.run}: played with {who}, expected one of the players named here")
    if own != AGENT and len(beside) > 1:
        raise UsageError(
            f"{person.run}: played {own}, one of {len(beside)} seats beside {AGENT}; expected {AGENT}"
        )
    return Recording(partner, own == AGENT, _of_all_seats(evaluation.result, own, program))


def _beside(folder: Path, program: Playable, own: str) -> dict[str, str]:
    """Who sat on each other seat, as the configuration of the evaluation names them."""
    named: Mapping[str, Sequence[str]] = read_json(folder / CONFIG).get("seats", {})
    return {seat: named.get(seat, [word])[0] for seat, word in sitting(program, {}, own).items()}


def _sat(player: Player, name: str, folder: Path) -> bool:
    """Whether a player is the one whom the configuration in a folder names."""
    if player.is_script:
        return name == SCRIPT
    if player.is_person or player.policy is not None:
        return False
    return player.agent == name or (player.is_trained and _is_copy_of(folder / name, player.agent))


def _is_copy_of(file: Path, agent: str) -> bool:
    """Whether a file that the folder of an evaluation keeps holds the network of an agent."""
    from socialai_dsl.trainer.checkpoint import read_agent
    from socialai_dsl.trainer.errors import CheckpointError

    if not file.is_file():
        return False
    try:
        return read_agent(file).has_network_of(read_agent(agent))
    except CheckpointError as error:
        raise UsageError(str(error)) from None


def _of_all_seats(result: EvalResult, own: str, program: Playable) -> EvalResult:
    """The result of one seat as that of the agent, with those of the others."""
    seats, table = seats_of(program), program.outcome_table

    def won(number: int) -> NDArray[np.bool_]:
        ends = [one.success and (one.seats is None or number in one.seats) for one in table]
        return np.array(ends, np.bool_)[result.outcome]

    nothing = np.full(result.episodes, np.nan)  # what the others were paid is not known
    returns = {seat: result.returns if seat == own else nothing for seat in seats}
    others = {seat: (won(number), returns[seat]) for number, seat in enumerate(seats) if number}
    return replace(result, success=won(0), returns=returns[AGENT], others=others)
