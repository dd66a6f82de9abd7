"""People play at the terminal: the rooms of a seed for as long as they like, or the test set."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from socialai_dsl.checking.briefing import Briefing, brief
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.envs.factory import compiled
from socialai_dsl.episodes.partners import Partners, own_seat, partners_of, seating, sitting
from socialai_dsl.episodes.players import HUMAN_FOLDER, Player, session_folder
from socialai_dsl.episodes.room_sets import RoomSet
from socialai_dsl.frontend import load
from socialai_dsl.program_suite import Playable
from socialai_dsl.runs.folder import scenario_folder_name

if TYPE_CHECKING:  # it needs Textual
    from socialai_dsl.play.game import FinishedEpisode, Sight


def play_seed(
    scenario: str,
    seed: int = 0,
    out: Path = HUMAN_FOLDER,
    participant: str | None = None,
    view: "Sight" = "room",
    seats: Sequence[tuple[str, str]] = (),
    **told: Any,
) -> "tuple[list[FinishedEpisode], Path]":
    """Let a person play until they quit, as `socialai play` does.

    Args:
        scenario: a path or a name, with `+variants` and `?parameters`.
        seed: of the first episode; later episodes have the next seeds.
        out: gets a folder of the session.
        participant: begins the name of that folder.
        view: whether the person sees what its seat sees, or the whole room.
        seats: who plays other members of the cast, see `partners_of`; the person has the first seat that is left.
        told: what they are told of the task, see `brief`.

    Returns:
        The episodes that were played to their end, and the folder with every step.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: there is no terminal, or nobody can sit there so.
        OSError: the folder cannot be written.
    """
    from socialai_dsl.play import play

    loaded = load(scenario)
    briefing, name = brief(loaded, **told), scenario_folder_name(scenario)
    partners = partners_of(seats, scenario, compiled(loaded)) if seats else {}
    loaded, filled = seating(partners, scenario, loaded)
    session = session_folder(out, participant)

    def episode(number: int) -> tuple[str, dict[str, Any]]:
        own = seed + number
        return f"{name}, seed {own}", {"seed": own}

    about = {"session": session.name, "scenario": name, **({"seats": dict(seats)} if seats else {})}
    found = play(scenario, episode, session / name, about, briefing, view, seats=filled, loaded=loaded)
    return found, session / name


def play_test_episodes(
    player: Player,
    partners: Partners,
    scenario: str,
    loaded: Loaded,
    program: Playable,
    episodes: int,
    briefing: Briefing,
    rooms: RoomSet,
) -> "list[FinishedEpisode]":
    """Let a person play test episodes until they quit, and keep everything in the session's folder.

    Args:
        player: the person.
        partners: who has other seats.
        scenario: as it was asked for.
        loaded: the same.
        program: the same, compiled.
        episodes: how many there are.
        briefing: what they are told of the task.
        rooms: which are played.

    Raises:
        UsageError: there is no terminal, or a partner cannot sit there.
    """
    from socialai_dsl.play import play

    loaded, filled = seating(partners, scenario, loaded)
    session, name = player.kept_in, scenario_folder_name(scenario)
    about: dict[str, Any] = {"session": session.name, "scenario": name, "program_sha256": program.sha256}
    if partners:
        about["seats"] = sitting(program, partners, own_seat(partners, program))

    def episode(number: int) -> tuple[str, dict[str, Any]] | None:
        if number >= episodes:
            return None
        title = rooms.title(number)
        return title if player.view == "seat" else f"{name}, {title}", rooms.reset(number)

    folder = session / name
    return play(scenario, episode, folder, about, briefing, player.view, False, seats=filled, loaded=loaded)
