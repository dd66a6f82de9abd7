"""Seats for a random scenario: its choices are drawn apart, so that the scenario of a seed is otherwise the same."""

from __future__ import annotations

import re
from random import Random
from typing import Any

MOST = 4
"""Seats of a scenario, the agent's included."""

OF_PLAYERS = re.compile(r"\bagent\.(?=(said|did)\(|(spoke|action)\b)")
"""What can be asked of the agent and of every other member with a seat."""


def give_seats(made: dict[str, Any], rng: Random) -> dict[str, Any]:
    """The same scenario with seats for some of its cast, which its rules and outcomes speak of."""
    made = of_players(made, seated(made["cast"], rng), rng)
    # Whom a player addresses is known with one seat only.
    made.pop("overheard", None)
    made["grammar"].pop("to", None)
    rules = entries(made.get("frames", {}))
    if not any("to" in rule for rule in rules):
        for rule in rules:
            rule.pop("addressed", None)
    names = ["agent", *(name for name, member in made["cast"].items() if "seat" in member)]
    if rng.random() < 0.2:
        made["observe"] = {**made.get("observe", {}), "seats": "hidden"}
    for entry in made["outcome"]:
        if "success" in entry:
            share_success(entry, names, rng)
    for rule in made.get("rules", ()):
        if rng.random() < 0.4:
            rule["reward"] = shares(names, rng, -20)
    return made


def seated(cast: dict[str, Any], rng: Random) -> list[str]:
    """Gives some of the cast seats; the single members that have one."""
    others, left = [name for name in cast if name != "agent"], MOST - 1
    rng.shuffle(others)
    for number, name in enumerate(others):
        count = cast[name].get("count", 1)
        if count <= left and (number == 0 or rng.random() < 0.6):
            cast[name]["seat"] = "open"
            left -= count
    return [name for name in others if "seat" in cast[name] and "count" not in cast[name]]


def of_players(part: Any, names: list[str], rng: Random) -> Any:
    """What is written, with others in place of the agent here and there."""
    if isinstance(part, dict):
        return {key: of_players(value, names, rng) for key, value in part.items()}
    if isinstance(part, list):
        return [of_players(value, names, rng) for value in part]
    if isinstance(part, str) and names:
        return OF_PLAYERS.sub(lambda _: f"{rng.choice([*names, 'agent'])}.", part)
    return part


def entries(part: Any) -> list[dict[str, Any]]:
    """All mappings in something that is written."""
    inner = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    found = [one for each in inner for one in entries(each)]
    return [part, *found] if isinstance(part, dict) else found


def share_success(entry: dict[str, Any], names: list[str], rng: Random) -> None:
    """Whose success it is, and what it is worth to each."""
    if rng.random() < 0.5:
        chosen = rng.sample(names, rng.randint(1, len(names)))
        entry["for"] = chosen if len(chosen) > 1 or rng.random() < 0.5 else chosen[0]
        names = chosen
    if rng.random() < 0.5:
        entry["reward"] = shares(names, rng, 0)
        if rng.random() < 0.4:
            entry["reward"][rng.choice(list(entry["reward"]))] = f"110 - {rng.randint(2, 9)} * t"


def shares(names: list[str], rng: Random, least: int) -> dict[str, Any]:
    """Per cent for some members."""
    return {name: rng.randint(least, 100) for name in rng.sample(names, rng.randint(1, len(names)))}
