"""The trained agents that ship: their names, and the folder behind `shipped:NAME`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

PREFIX: Final = "shipped:"
"""What the name of a shipped agent begins with wherever a path of an agent can stand."""

WEIGHTS: Final = "model.safetensors"
"""The file of weights in the folder of an agent that is given away."""


def agents_folder() -> Path:
    """The folder of the agents that come with the product, in a checkout as well as installed."""
    package = Path(__file__).resolve().parent
    installed = package / "agents"
    return installed if installed.is_dir() else package.parent / "agents"


def agent_name(scenario: str, *variants: str) -> str:
    """The name under which the agent of a scenario ships, or of a variant of it: `scenario_variant`."""
    return "_".join([scenario, *variants])


def shipped_agents() -> list[str]:
    """The names of the agents that ship, see `agent_name`."""
    folder = agents_folder()
    return sorted(file.parent.relative_to(folder).as_posix() for file in folder.rglob(WEIGHTS))


def located(agent: str | Path) -> Path:
    """Where an agent is kept: for `shipped:NAME` the folder of that agent, for a path the path itself.

    Raises:
        ValueError: no agent of that name ships.
    """
    text = str(agent)
    if not text.startswith(PREFIX):
        return Path(agent)
    name, known = text.removeprefix(PREFIX), shipped_agents()
    if name not in known:
        raise ValueError(f"{text}: no agent of this name ships; these do: {', '.join(known)}")
    return agents_folder() / name
