"""What all scenarios of the paper have in common: spaces, rooms, pictures, rewards, time, silence, hidden NPCs."""

from __future__ import annotations

import random
from itertools import product
from typing import Any

import pytest

from tests.scenarios.playing import (
    BALL,
    COLORS,
    DOOR,
    EMPTY,
    FORWARD,
    GREY_WALL,
    LAVA,
    NPC,
    SWITCH,
    Code,
    Episode,
    beside,
    check_shares,
    evenly,
    made,
    rooms,
)

HORIZONS = {
    "talkitout": 100,
    "talkitout_no_liar": 100,
    "dance": 20,
    "cointhief": 20,
    "diverse_exit": 50,
    "showme": 100,
    "showme_no_social": 100,
    "help": 20,
    "help_as_helper": 20,
}
DEFAULT = [*HORIZONS, "cointhief+tags"]
NAMES = [name + coded for name in DEFAULT for coded in ("", "+as_coded")]
CAST = ("wizard", "honest", "liar", "dancer", "thief", "teacher", "jim", "jill")
WAYS = tuple(FORWARD)
STATES = {"open": 0, "closed": 1, "locked": 2, "idle": 0, "pressed": 1, "plain": 0, "tagged": 1}


def status_of(member: str, name: str, room: dict[str, Any]) -> int:
    """The status channel of an NPC: what it is."""
    if member == "teacher":
        code = [8, 7, 6, 2, 1, 0, 11, 10, 9, 5, 4, 3]
        paper = int(room["one_of"]["teacher"][-2:])
        return code[paper] if "as_coded" in name else paper
    return int(member in ("honest", "liar"))


def things(name: str, room: dict[str, Any]) -> dict[tuple[int, int], Code]:
    """What lies in the room, by cell, as it is to be shown."""
    shown = {}
    for door in [*room.get("doors", []), *([room["door"]] if "door" in room else [])]:
        shown[tuple(door["at"])] = (DOOR, COLORS.index(door["color"]), STATES[door["state"]], 0)
    for switch in room.get("switches", []):
        lit = STATES[switch["state"]] if "no_social" in name else 0
        shown[tuple(switch["at"])] = (SWITCH, COLORS.index(switch["color"]), lit, 0)
    for coin in room.get("coins", []):
        shown[tuple(coin["at"])] = (BALL, COLORS.index("yellow"), *([STATES[coin["state"]]] * 2))
    return shown


def world(name: str, room: dict[str, Any]) -> dict[tuple[int, int], Code]:
    """All 8x8 cells as they are to be shown."""
    width, height = room["room"]["width"], room["room"]["height"]
    cells: dict[tuple[int, int], Code] = {}
    for x, y in product(range(8), repeat=2):
        edge = x in (0, width - 1) or y in (0, height - 1)
        inside = x < width and y < height
        lava = name.startswith("help") and x == width // 2 and inside and not edge
        cells[x, y] = LAVA if lava else GREY_WALL if inside and edge else EMPTY
    cells |= things(name, room)
    if "unsocial" not in name:
        for member in CAST:
            npc = room.get(member)
            if npc and not npc.get("gone"):
                color, way = COLORS.index(npc["color"]), WAYS.index(npc["facing"])
                cells[tuple(npc["at"])] = (NPC, color, status_of(member, name, room), way)
    cells[tuple(room["agent"]["at"])] = EMPTY
    return cells


def picture(name: str, room: dict[str, Any]) -> list[list[Code]]:
    """The 7x7 picture: column i from left to right, row j from far to near, the agent in the middle of the last."""
    cells, agent = world(name, room), room["agent"]
    right = WAYS[(WAYS.index(agent["facing"]) + 1) % 4]
    return [
        [
            cells.get(beside(beside(agent["at"], agent["facing"], 6 - j), right, i - 3), GREY_WALL)
            for j in range(7)
        ]
        for i in range(7)
    ]


def drawn_action(rng: random.Random, episode: Episode) -> tuple[str | None, str | None]:
    """Anything, done last of all."""
    program = episode.env.program
    body = rng.choice(
        [*[action for action in program.actions if action != "done"], "forward", "toggle", None]
    )
    sentence = rng.choice(program.templates).replace("<noun>", rng.choice(program.nouns))
    return (body if body in program.actions else None), (sentence if rng.random() < 0.3 else None)


@pytest.mark.parametrize("name", [*NAMES, *(f"{name}+unsocial" for name in NAMES)])
def test_the_first_picture(name: str) -> None:
    for seed in range(150):
        episode = Episode(name, seed=seed)
        assert [[tuple(cell) for cell in column] for column in episode.image.tolist()] == picture(
            name, episode.now()
        )


@pytest.mark.parametrize("name", [*DEFAULT, *(f"{name}+unsocial" for name in DEFAULT)])
def test_the_picture_after_each_step(name: str) -> None:
    rng = random.Random(name)
    for seed in range(60):
        episode = Episode(name, seed=seed)
        for _ in range(15):
            ended = episode.act(*drawn_action(rng, episode)).ended
            room = episode.now()
            assert [[tuple(cell) for cell in column] for column in episode.image.tolist()] == picture(
                name, room
            )
            if ended:
                break


@pytest.mark.parametrize("name", [name for name in NAMES if "cointhief" not in name])
@pytest.mark.thorough("draws many rooms of every scenario")
def test_rooms_are_of_sixteen_sizes(name: str) -> None:
    sizes = ((room["room"]["width"], room["room"]["height"]) for room in rooms(name, 2000))
    check_shares(sizes, evenly(product(range(5, 9), repeat=2)))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.thorough("draws many rooms of every scenario")
def test_poses_and_colours_at_first(name: str) -> None:
    drawn = list(rooms(name, 1500))
    if not name.startswith("cointhief"):
        assert all(room[member]["facing"] == "down" for room in drawn for member in CAST if member in room)
    check_shares((room["agent"]["facing"] for room in drawn), evenly(WAYS))
    for member in set(CAST) & set(drawn[0]):
        check_shares((room[member]["color"] for room in drawn), evenly(COLORS))


@pytest.mark.parametrize("name", NAMES)
def test_spaces(name: str) -> None:
    body, exits = ([8, 2, 2, 2], [8, 2, 4, 16])
    sizes = {"talkitout": exits, "dance": [4, 2, 2, 2], "cointhief": [4, 2, 1, 7], "diverse": exits}
    env = made(name)
    assert env.action_space.nvec.tolist() == sizes.get(name.partition("_")[0].partition("+")[0], body)
    assert env.observation_space["image"].shape == (7, 7, 4)


def test_what_can_be_said() -> None:
    def grammar(name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        return made(name).program.templates, made(name).program.nouns

    for name in ("dance", "showme", "showme_no_social", "help", "help_as_helper"):
        for variant in (name, f"{name}+as_coded"):
            assert grammar(variant) == (("Move your <noun>", "Shake your <noun>"), ("body", "head"))
    for name in ("cointhief", "cointhief+as_coded"):
        assert grammar(name) == (("Here is <noun>",), tuple("0123456"))
    for name in ("talkitout", "talkitout_no_liar", "diverse_exit"):
        paper, coded = grammar(name), grammar(f"{name}+as_coded")
        assert paper[0] == ("Where is <noun>", "Open <noun>", "Which is <noun>", "How are <noun>")
        assert coded[0][2] == ("Which is <noun>" if name == "diverse_exit" else "Close <noun>")
        assert (paper[1][10], coded[1][10]) == ("oven", "the floor")
        assert paper[1][2] == coded[1][2] == ("the correct door" if name == "diverse_exit" else "the wall")
        assert [k for k in range(16) if paper[1][k] != coded[1][k]] == [10]


@pytest.mark.parametrize("name", NAMES)
def test_time_runs_out_unpaid(name: str) -> None:
    episode, horizon = Episode(name), HORIZONS[name.partition("+")[0]]
    assert all(episode.act().ended is None for _ in range(horizon - 1))
    last = episode.act()
    assert (last.ended, last.reward) == ("timeout", 0)


@pytest.mark.parametrize("name", NAMES)
def test_the_agent_does_not_hear_itself(name: str) -> None:
    silent = f"{name}+unsocial" if "no_liar+as_coded" not in name else "talkitout_no_liar+unsocial"
    rng = random.Random(1)
    for seed in range(20):
        episode = Episode(silent, seed=seed)
        step = episode.act(*drawn_action(rng, episode))
        while step.ended is None:
            assert step.heard == ""
            step = episode.act(*drawn_action(rng, episode))


@pytest.mark.parametrize(
    "name", [name for name in NAMES if name.startswith(("talk", "diverse", "show", "help"))]
)
def test_pickup_and_drop_do_nothing(name: str) -> None:
    def course(body: str | None) -> list[dict[str, Any]]:
        episode, states = Episode(name, seed=3), []
        for _ in range(12):
            assert episode.act(body).ended is None
            states.append({key: value for key, value in episode.now().items() if key != "last"})
        return states

    assert course("pickup") == course("drop") == course(None)


@pytest.mark.parametrize("name", [name for name in NAMES if not name.startswith("showme_no_social")])
def test_hidden_npcs_can_be_walked_through(name: str) -> None:
    member = next(member for member in CAST if member in rooms(name, 1)[0])
    size = {} if name.startswith("cointhief") else {"room": {"width": 7, "height": 7}}
    layout = {**size, member: {"at": [2, 2]}, "agent": {"at": [1, 2], "facing": "right"}}
    for variant, reached in ((name, [1, 2]), (f"{name}+unsocial", [2, 2])):
        for seed in range(5):
            episode = Episode(variant, layout, seed)
            episode.act("forward")
            assert episode.now()["agent"]["at"] == reached


@pytest.mark.parametrize("name", NAMES)
def test_the_unsocial_room_is_the_same_room(name: str) -> None:
    for social, unsocial in zip(rooms(name, 100), rooms(f"{name}+unsocial", 100), strict=True):
        assert social == unsocial


@pytest.mark.parametrize("name", [*NAMES, *(f"{name}+unsocial" for name in NAMES)])
def test_a_state_can_be_put_back_as_a_layout(name: str) -> None:
    rng = random.Random(name)
    for seed in range(30):
        episode = Episode(name, seed=seed)
        for _ in range(rng.randrange(8)):
            if episode.act(*drawn_action(rng, episode)).ended:
                break
        else:
            state = episode.now()
            assert Episode(name, state, seed + 1000).now() == state
