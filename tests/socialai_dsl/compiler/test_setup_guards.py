"""The reset: guarded placements, colours and directions, drawn statuses and kinds, rooms as required."""

from __future__ import annotations

from dataclasses import replace

import pytest

from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.program import EntityColumn, Header, TypeColumn
from socialai_dsl.semantics.plans import CheckedScenario, Coloring, Drawn, Effect, Facing, Placing, RulePlan
from socialai_dsl.semantics.terms import COLOR, DIRECTION, Compare, Const, Read, Select, Type
from socialai_dsl.vocabulary import NPC
from tests.socialai_dsl.compiler.workbench import (
    DIE,
    DOOR,
    GUIDE,
    NUMBER,
    OTHER_SWITCH,
    SPAN,
    STATUE,
    SWITCH,
    compiled,
    entity,
    listed,
    number,
    sited,
    start,
    step,
    workbench,
)

SMALL, LARGE = Compare("<", DIE, number(2)), Compare("<=", number(2), DIE)
STATUS = Type("status", 0, 1, ("idle", "pressed"))


def with_statue(*items: Placing | Coloring | Facing) -> CheckedScenario:
    """The statue set up in another way, once the die has been cast."""
    setup = [
        item
        for item in workbench().setup
        if isinstance(item, Drawn) or item.entity != STATUE or type(item) not in {type(new) for new in items}
    ]
    return replace(workbench(), setup=(*setup, *items))


def statue(checked: CheckedScenario, die: int) -> dict:
    return start(checked, {"let": {"die": die}}).describe()["statue"]


def test_one_of_several_placements_is_done() -> None:
    one = Placing(STATUE, "cast.statue.cell", 0, SPAN, at=(number(1), number(1)), when=SMALL)
    other = Placing(STATUE, "cast.statue.cell", 0, SPAN, at=(number(5), number(1)), when=LARGE)
    checked = with_statue(one, other)
    assert [statue(checked, die)["at"] for die in range(4)] == [[1, 1], [1, 1], [5, 1], [5, 1]]


def test_one_of_several_colours_and_directions() -> None:
    checked = with_statue(
        Coloring(STATUE, "cast.statue.color", 0, SPAN, sited(Const(COLOR, 1)), when=SMALL),
        Coloring(STATUE, "cast.statue.color", 0, SPAN, sited(Const(COLOR, 3)), when=LARGE),
        Facing(STATUE, "cast.statue.facing", SPAN, sited(Const(DIRECTION, 1)), when=SMALL),
        Facing(STATUE, "cast.statue.facing", SPAN, toward=entity(GUIDE), when=LARGE),
    )
    seen = [(state["color"], state["facing"]) for state in (statue(checked, die) for die in range(4))]
    assert seen == [("green", "down")] * 2 + [("purple", "up")] * 2


def with_initial(*drawn: int) -> CheckedScenario:
    """Switches whose initial statuses are registers."""
    paths = {SWITCH: "switches[0].initial", OTHER_SWITCH: "switches[1].initial"}
    base = workbench()
    items = tuple(
        Drawn(path, STATUS, sited(Const(STATUS, value), path))
        for path, value in zip(paths.values(), drawn, strict=True)
    )
    entities = tuple(
        replace(e, initial=Read(STATUS, paths[e.number])) if e.number in paths else e for e in base.entities
    )
    return replace(base, setup=(*base.setup, *items), entities=entities)


def switches(checked: CheckedScenario, layout: dict | None = None) -> list[str]:
    return [thing["state"] for thing in start(checked, layout).describe()["switches"]]


def test_drawn_initial_statuses() -> None:
    assert switches(with_initial(0, 1)) == ["idle", "pressed"]
    assert switches(with_initial(1, 0)) == ["pressed", "idle"]
    assert switches(with_initial(0, 1), {"switches": [{"state": "pressed"}, {"state": "idle"}]}) == [
        "pressed",
        "idle",
    ]


@pytest.mark.parametrize("drawn", [(0, 1), (1, 0), (1, 1)])
def test_reset_goes_back_to_the_initial_status(drawn: tuple[int, int]) -> None:
    """Also of a switch that is only known while the game runs."""
    which = Read(Type("entity", SWITCH, OTHER_SWITCH), "let.which")
    base = with_initial(*drawn)
    base = replace(base, setup=(*base.setup, Drawn("let.which", which.type, sited(entity(OTHER_SWITCH)))))
    flip = tuple(
        Effect("become", (entity(SWITCH + i),), SPAN, Const(STATUS, 1 - value))
        for i, value in enumerate(drawn)
    )
    back = Effect("reset", (which,), SPAN)
    env = start(replace(base, rules=(RulePlan("law", "rules[0]", SPAN, causes=(*flip, back)),)))
    step(env)
    words = [("idle", "pressed")[value] for value in (1 - drawn[0], drawn[1])]
    assert [thing["state"] for thing in env.describe()["switches"]] == words


def test_the_kind_of_an_npc_is_its_status() -> None:
    kind = Select(NUMBER, (SMALL,), (number(3),), number(5))
    base = workbench()
    entities = tuple(
        replace(e, kind_code=5, kind_drawn=kind) if e.number == STATUE else e for e in base.entities
    )
    checked = replace(base, entities=entities)
    program = compiled(checked)
    at = program.header(Header.ENTITY_AT) + STATUE * EntityColumn.COLUMNS
    assert program.words[at + EntityColumn.KIND] == 5
    assert [pictured_kind(checked, die) for die in range(4)] == [3, 3, 5, 5]


def pictured_kind(checked: CheckedScenario, die: int) -> int:
    """The status code in the picture of the only NPC that the agent sees: the statue."""
    layout = {"let": {"die": die}, "agent": {"at": [4, 4], "facing": "down"}}
    env = ScenarioEnv(compiled(checked))
    image = env.reset(seed=0, options={"layout": layout})[0]["image"]
    (code,) = {int(cell[2]) for row in image for cell in row if cell[0] == NPC}
    return code


def test_a_constant_kind_is_loaded_too() -> None:
    base = workbench()
    entities = tuple(replace(e, kind_code=4) if e.number == STATUE else e for e in base.entities)
    program = compiled(replace(base, entities=entities))
    assert any("LOAD" in line and "statue.status, #4" in line for line in listed(program, "reset"))


def test_derived_types_have_rows_of_their_own() -> None:
    base = workbench()
    kind = base.entities[SWITCH].type
    assert kind is not None
    dark = replace(kind, toggled={**kind.toggled, 1: 1}, shown={0: (0, 0), 1: (0, 0)})
    entities = tuple(replace(e, type=dark) if e.number == OTHER_SWITCH else e for e in base.entities)
    program = compiled(replace(base, entities=entities))
    entity_at, type_at = program.header(Header.ENTITY_AT), program.header(Header.TYPE_AT)
    first = {
        number: int(program.words[entity_at + EntityColumn.COLUMNS * number + EntityColumn.TYPE])
        for number in (DOOR, SWITCH, OTHER_SWITCH)
    }
    assert len(set(first.values())) == 3
    columns = (TypeColumn.CODE, TypeColumn.STATUS, TypeColumn.TOGGLED)
    pressed = {
        number: [int(program.words[type_at + TypeColumn.COLUMNS * (row + 1) + column]) for column in columns]
        for number, row in first.items()
    }
    assert pressed[SWITCH] == [kind.code, kind.shown.get(1, (1, 0))[0], kind.toggled.get(1, 1)]
    assert pressed[OTHER_SWITCH] == [kind.code, 0, 1]


def test_rooms_that_are_not_as_required_are_drawn_again() -> None:
    base = workbench()
    checked = replace(
        base, require=(sited(LARGE, "require[0]"), sited(Compare("!=", DIE, number(3)), "require[1]"))
    )
    assert {start(checked, seed=seed).describe()["let"]["die"] for seed in range(20)} == {2}
    assert compiled(base).header(Header.REQUIRE_PC) == 0
    assert [line.split()[1] for line in listed(compiled(checked), "require")] == [
        "IF_LE",
        "IF_NE",
        "LOAD",
        "HALT",
    ]
