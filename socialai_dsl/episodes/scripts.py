"""Which frame of a scenario its agent follows: its script, or one of its rivals."""

from collections.abc import Mapping
from pathlib import Path

from socialai_dsl.checking.loaded import Loaded, LoadedSuite, unscripted
from socialai_dsl.diagnostics import suggested
from socialai_dsl.episodes.players import Player
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import Scripted, closest_script, load, variant_of
from socialai_dsl.source import Source


def script_of(
    scenario: str, loaded: Loaded | None = None, texts: Mapping[Path, Source] | None = None
) -> Scripted | None:
    """The scenario itself if it scripts the agent, else its variant `oracle`; None if there is no script.

    Args:
        scenario: a path or a name.
        loaded: the same, where it is loaded already.
        texts: those that it is loaded with, see `check`.

    Raises:
        ScenarioError: the scenario, or its variant, has mistakes.
    """
    closest = closest_script(scenario, loaded, texts)
    return None if unscripted(closest.loaded) else closest


def with_script(
    scenario: str, loaded: Loaded | None = None, texts: Mapping[Path, Source] | None = None
) -> Scripted:
    """`script_of`, which there must be.

    Raises:
        UsageError: there is no script.
    """
    closest = closest_script(scenario, loaded, texts)
    if lacking := unscripted(closest.loaded):
        raise UsageError(
            f"{scenario}: the agent of {lacking[0]} has no frame, and there is no variant `oracle`"
        )
    return closest


def with_frame_of(
    player: Player, scenario: str, loaded: Loaded | None = None, texts: Mapping[Path, Source] | None = None
) -> Scripted:
    """The scenario whose agent follows the frame of a player: `with_script`, or the variant with a rival.

    Args:
        player: the script, or a rival.
        scenario: a path or a name.
        loaded: the same, where it is loaded already.
        texts: those that it is loaded with, see `check`.

    Raises:
        UsageError: there is no script, or no rival of this name.
    """
    if player.rival is None:
        return with_script(scenario, loaded, texts)
    found = loaded or load(scenario, texts)
    for one in found.members if isinstance(found, LoadedSuite) else (found,):
        rivals = list(one.scenario.rivals)
        if player.rival not in rivals:
            has = f"; it has {', '.join(rivals)}" if rivals else "; it has none"
            raise UsageError(
                f"{one.name} has no rival {player.rival!r}{suggested(player.rival, rivals, has, repr)}"
            )
    name = variant_of(scenario, player.rival)
    return Scripted(name, load(name, texts))
