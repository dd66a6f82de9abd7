"""Keys of larger files for a random scenario: parameters, roles, defaults, files of members, and given places.

The choices are drawn apart, so that the scenario of a seed is otherwise the same.
"""

from __future__ import annotations

import copy
import re
from random import Random
from typing import Any

from tests.scenario_fuzzer.seats import entries

DRAWN = ("name", "color", "facing", "place", "kind", "with")
"""Keys that may differ between the files of a member."""

PLACES = ("top_half", "bottom_half", "anywhere | nowhere", "top_half | column(2)", "nowhere | row(1)")
NAMES = ("Ann Lee", "Old Sam", "Zoë", "pick(Kim | Lee)", "Nr. 5", "van der Berg")


def furnish(made: dict[str, Any], rng: Random) -> dict[str, dict[str, Any]]:
    """The same scenario with such keys, and the files of its members, by name; `""` is the scenario."""
    made = copy.deepcopy(made)
    made.pop("require", None)  # places that are given may not be as it wants
    files: dict[str, dict[str, Any]] = {"": made}
    _measure(made, rng)
    _place(made, rng)
    named = not _says_names(made)
    for name, member in made["cast"].items():
        if name != "agent" and "count" not in member and "frame" in member and rng.random() < 0.4:
            files |= _of_files(name, member, made, rng, named)
    _name(made, rng, named)
    for frame in (frame for file in files.values() for frame in file.get("frames", {}).values()):
        last = frame.get("steps", [{}])[-1]
        if "for" in last and "finished" not in str(files) and rng.random() < 0.5:
            last["for"] = "ever"
    _share(made, rng)
    _link(made, rng)
    _give_parameters(made, rng)
    return files


def _measure(made: dict[str, Any], rng: Random) -> None:
    """Width and height apart."""
    size = made["room"].pop("size")
    if rng.random() < 0.5:
        made["room"] |= {"width": size, "height": rng.choice((7, "6..8", "7..9"))}
    else:
        made["room"]["size"] = size


def _place(made: dict[str, Any], rng: Random) -> None:
    """Other places of members and things, some of them given as cells."""
    free = [[x, y] for x in range(1, 5) for y in range(1, 5)]
    rng.shuffle(free)
    built = "build" in made["room"]
    for section in ("objects", "cast"):
        for one in made.get(section, {}).values():
            if section == "objects" and one.get("place") not in ("anywhere", "left_half", "right_half"):
                continue
            if rng.random() < 0.3:
                one["place"] = rng.choice(PLACES)
            elif rng.random() < 0.3 and not built:
                one.pop("place", None)
                count = one.get("count")
                one["at"] = free.pop() if count is None else [free.pop() for _ in range(count)]
    objects = made.get("objects", {})
    for one in objects.values():
        if one["type"] == "switch" and rng.random() < 0.3:
            one["pressed"] = rng.choice(("W > 6", "agent.color == red", "H % 2 == 1"))
        elif one["type"] == "box" and one.get("state") is None and rng.random() < 0.3:
            one["opened"] = rng.choice(("W > 6", "ann.color == red", "H % 2 == 1"))


def _of_files(
    name: str, member: dict[str, Any], made: dict[str, Any], rng: Random, named: bool
) -> dict[str, dict[str, Any]]:
    """Files of which a member is one in each episode; what is the same in all stays in the cast."""
    files = {}
    frame = member.pop("frame")
    whole = made["frames"].pop(frame) if rng.random() < 0.5 else None
    given = {key: member.pop(key) for key in DRAWN if key in member and rng.random() < 0.7}
    for number in range(rng.randint(2, 3)):
        one: dict[str, Any] = {"npc": f"{name}_{number}", "frame": frame, **copy.deepcopy(given)}
        if whole is not None:
            one["frames"] = {frame: whole}
        one["color"] = ("red", "pick(red | green)", "random")[number]  # so that no two files are the same
        if rng.random() < 0.5:
            one["facing"] = rng.choice(("up", "down", "toward(agent)", "pick(left | up)"))
        if rng.random() < 0.4 and named:
            one["name"] = rng.choice(("Kim", "Lee", "Old Sam"))
        if rng.random() < 0.4:
            one["place"] = rng.choice(("left_half", "anywhere", "row(2)", "top_half"))
        if rng.random() < 0.3:
            one["kind"] = rng.choice(("guide", "child", "elder"))
        slots = (whole or made["frames"].get(frame, {})).get("slots", {})
        for slot, type_ in slots.items():
            if type_ == "bool" and slot in one.get("with", {}):
                one["with"][slot] = rng.choice(("true", "false", "t > 3", one["with"][slot]))
            elif type_ == "direction" and slot in one.get("with", {}):
                one["with"][slot] = rng.choice(("left", "up", one["with"][slot]))
        files[f"{made['scenario']}_{one['npc']}.yaml"] = one
    member["one_of"] = list(files)
    return files


def _says_names(made: dict[str, Any]) -> bool:
    """Whether an utterance may name somebody: then names stay as they are."""
    return "whom" in made["grammar"].get("slots", {}) or any("to" in entry for entry in entries(made))


def _name(made: dict[str, Any], rng: Random, named: bool) -> None:
    """Names, and numbers of kinds in the picture."""
    for name, member in made["cast"].items():
        if name == "agent":
            continue
        if rng.random() < 0.3 and named:
            count = member.get("count")
            member["name"] = (
                rng.choice(NAMES) if count is None else [f"{name} {word}" for word in "xyz"[:count]]
            )
        if "kind" in member and rng.random() < 0.3:
            member["kind_code"] = rng.choice((7, 8, 200))


def _share(made: dict[str, Any], rng: Random) -> None:
    """Defaults of all NPCs, and roles."""
    if rng.random() < 0.5:
        made["npc_defaults"] = {
            "view": rng.choice((3, 5)),
            "facing": rng.choice(("down", "random", "toward(agent)")),
            "earshot": rng.choice(("room", 3)),
            "place": rng.choice(("anywhere", "bottom_half")),
        }
        for key in list(made["npc_defaults"]):
            if rng.random() < 0.5:
                del made["npc_defaults"][key]
        if not made["npc_defaults"]:
            del made["npc_defaults"]
    for name, member in made["cast"].items():
        if "count" in member or rng.random() > 0.3:
            continue
        role = {key: member.pop(key) for key in ("facing", "place", "at", "frame") if key in member}
        if "frame" in role and ("with" in member or name == "agent"):
            member["frame"] = role.pop("frame")
        member["role"] = f"role_{name}"
        made.setdefault("roles", {})[f"role_{name}"] = role or {"facing": "left"}
        if rng.random() < 0.3:
            member["facing"] = "right"
    written = str({key: value for key, value in made.items() if key != "cast"})
    for name in made["cast"]:
        if f"role_{name}" in made.get("roles", {}) and rng.random() < 0.5 and name in written:
            made["outcome"] = _called(made["outcome"], name, f"role_{name}")


def _called(part: Any, name: str, other: str) -> Any:
    """The same text with another name for a member in front of its attributes."""
    if isinstance(part, dict):
        return {key: _called(value, name, other) for key, value in part.items()}
    if isinstance(part, list):
        return [_called(value, name, other) for value in part]
    return re.sub(rf"\b{name}\.(?=color|facing|cell)", f"{other}.", part) if isinstance(part, str) else part


def _link(made: dict[str, Any], rng: Random) -> None:
    """Questions about what unlocks what."""
    objects = made.get("objects", {})
    unlocking = [one for one in objects.values() if "unlocks" in one]
    for one in unlocking:
        target = one["unlocks"]
        single = "count" not in objects[target]
        alone = [other["unlocks"] for other in unlocking].count(target) == 1 and (
            not single or "count" not in one
        )
        if not alone or rng.random() < 0.3:
            continue
        thing = target if single else f"pick({target})"
        made.setdefault("let", {})["unlocker"] = f"{thing}.unlocked_by" if single else thing
        asked = "unlocker.color" if single else "unlocker.unlocked_by.color"
        made["outcome"].insert(0, {"failure": f"t > 9 and {asked} == {rng.choice(('red', 'blue'))}"})
        return


def _give_parameters(made: dict[str, Any], rng: Random) -> None:
    """Parameters in place of some values and numbers."""
    params: dict[str, Any] = {}
    if rng.random() < 0.5:
        params["steps"] = made["horizon"]
        made["horizon"] = "$steps"
    for entry in made["outcome"]:
        for kind in ("success", "failure"):
            found = re.match(r"t > (\d+) and", entry.get(kind, ""))
            if found and rng.random() < 0.4:
                params["late"] = {"default": int(found[1]), "values": [int(found[1]), 3, 9]}
                entry[kind] = "t > $late and" + entry[kind][found.end() :]
    if "place" in made["cast"]["agent"] and rng.random() < 0.4:
        params["there"] = {
            "default": "usual",
            "values": {"usual": made["cast"]["agent"]["place"], "top": "row(1)"},
        }
        made["cast"]["agent"]["place"] = "$there"
    for one in made.get("objects", {}).values():
        if "timer" in one and rng.random() < 0.5:
            params["timer_of"] = one["timer"]
            one["timer"] = "$timer_of"
    if params:
        made["params"] = params
