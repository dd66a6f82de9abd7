"""Which script a scenario has for its agent."""

from collections.abc import Mapping
from pathlib import Path

from socialai_dsl.checking.loaded import Loaded, unscripted
from socialai_dsl.errors import UsageError
from socialai_dsl.frontend import Scripted, closest_script
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
