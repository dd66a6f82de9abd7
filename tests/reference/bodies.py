"""Bodies: what a primitive action does, and which one an activity of a frame asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from socialai_dsl.grammar import ast
from tests.reference import chance, geometry, motion
from tests.reference.evaluate import Context, NothingFoundError, drawn, of, there, weighed
from tests.reference.source import Value
from tests.reference.world import (
    TYPES,
    Cell,
    Entity,
    Performance,
    World,
    as_list,
    quadrant,
    step_from,
    turned,
    where,
)

SEARCH_ORDER = ("down", "up", "right", "left")


def act(world: World, body: Entity, primitive: str) -> None:
    """Executes a primitive; what cannot be done is not done. `done` changes nothing in the room."""
    # A body action with a direction, `point up`, or with a cell, `point 3 4`.
    word, _, way = primitive.partition(" ")
    body.action = body.last_act = word
    if body.cell is None:
        return
    ahead = step_from(body.cell, body.facing)
    if primitive in ("left", "right"):
        body.facing = turned(body.facing, -1 if primitive == "left" else 1)
    elif primitive == "forward" and can_enter(world, body, ahead):
        body.cell = ahead
    elif primitive == "forward":
        body.bumped = True
        motion.push(world, ahead, body.facing)
        motion.push_aside(world, body, ahead)
    elif word == "point":
        body.pointing = way if way.isalpha() else tuple(map(int, way.split()))  # type: ignore[assignment]
    elif word == "stop_pointing":
        body.pointing = None
    elif primitive == "toggle":
        toggle(world, body, ahead)
    elif primitive == "pickup":
        pick_up(world, body, ahead)
    elif primitive == "drop":
        put_down(world, body, ahead)


def can_enter(world: World, body: Entity, cell: Cell) -> bool:
    """Bodies share no cell. Only who is played steps on what is deadly, and through others where NPCs are hidden."""
    if not body.taken:
        return geometry.free(world, cell, body)
    alone = all(other is body or other.cell != cell for other in world.members)
    return world.walkable(cell) and (world.npcs_hidden or alone)


def pick_up(world: World, body: Entity, cell: Cell) -> None:
    """What can be carried goes from the cell into empty hands; nothing is taken from where somebody stands."""
    things = [thing for thing in world.objects_at(cell) if thing.carryable and not thing.blocked]
    taken = any(member.cell == cell for member in world.cast.values())
    if things and not taken and world.carried_by(body) is None:
        things[-1].cell, things[-1].carrier = None, body


def put_down(world: World, body: Entity, cell: Cell) -> None:
    """Who stands there gets it, if he takes it and has nothing; else it lies in the cell, where things can roll."""
    thing = world.carried_by(body)
    if thing is None:
        return
    others = [member for member in world.members if member.cell == cell]
    if others:
        if others[0].accepts and world.carried_by(others[0]) is None:
            thing.carrier = others[0]
    elif motion.clear(world, cell):
        thing.cell, thing.carrier = cell, None


def toggle(world: World, user: Entity, cell: Cell) -> None:
    """Who is played pokes an NPC in the cell; else the object there changes as its type says."""
    npc = next((npc for npc in world.npcs if npc.cell == cell), None)
    if npc is not None and user.taken:
        npc.poked = npc.was_poked = True
        return
    thing = world.object_at(cell)
    if thing is not None:
        thing.poked = thing.poked or user.seat
        thing.toggled_by.append(user)
        changes = TYPES[thing.type].toggled
        if thing.one_way:
            # "`one_way: true` drops the second entry": there is no way back.
            changes = dict(list(changes.items())[:1])
        if not thing.blocked:
            thing.status = changes.get(thing.status, thing.status)


@dataclass
class Activity:
    """An activity with its argument computed: it lasts one turn of its member."""

    verb: str
    goal: Any = None
    way: Any = None  # of a push; how near to stay
    acting: bool = False  # this turn is that of the toggle, the push, the pickup or the drop itself
    done_before: bool = False  # of hands: what they were for was so before this turn
    sees: Callable[[], bool] = bool  # of a search: whether it sees what it looks for now
    away: Callable[[], bool] = bool  # of going away: whether that is far enough away now

    def primitive(self, world: World, me: Entity) -> str:
        """The body action it asks for now."""
        if self.verb in ("fetch", "give", "bring"):
            return self.hands(world, me)
        asked = self.asked(world, me)
        act = {"use": "toggle", "push": "forward"}.get(self.verb)
        self.acting = act == asked and geometry.faces(world, me, self.goal)
        return asked

    def hands(self, world: World, me: Entity) -> str:
        """What is to be fetched, and is it there yet? Else on with it."""
        self.acting = self.done_before = False
        if me.cell is None:
            return "none"
        thing, person = self.goal, isinstance(self.way, Entity) and self.way.sort != "object"
        if self.verb == "fetch":
            self.done_before = thing.carrier is me
        elif person:
            self.done_before = thing.carrier is self.way
        else:
            self.done_before = geometry.at(world, thing, self.way)
        if self.done_before:
            return "none"
        if self.verb != "fetch" and thing.carrier is me:
            goal, act = self.way, "drop"
        elif self.verb == "give" or world.carried_by(me) is not None:
            return "none"
        else:
            goal, act = thing, "pickup"
        self.acting = geometry.faces(world, me, goal)
        if self.acting:
            return act
        return face(world, me, goal) if geometry.next_to(world, me, goal) else go_next_to(world, me, goal)

    def asked(self, world: World, me: Entity) -> str:
        """The body action by itself."""
        if me.cell is None:
            return "none"
        if self.verb in ("left", "right", "forward", "toggle", "pickup", "drop", "stop_pointing"):
            return self.verb
        if self.verb == "turn":
            return str(self.goal)
        if self.verb == "turn_to":
            return turn_towards(world, me, self.goal)
        if self.verb == "stay":
            return "none"
        if self.verb == "perform":
            return self.element(me)[0]
        if self.verb == "search":
            return "none" if self.sees() else look_around(world, me)
        if all(where(goal) is None for goal in as_list(self.goal)):
            return "none"
        if self.verb == "stay_near" and geometry.distance(world, me, self.goal) <= self.way:
            return "none"
        if self.verb == "push":
            return push(world, me, self.goal, self.way)
        return {
            "face": face,
            "point": point,
            "point_at": point_at,
            "follow": go_next_to,
            "stay_near": go_next_to,
            "flee": flee,
            "go_away_from": flee,
            "go_to": go_to,
            "go_next_to": go_next_to,
            "use": use,
            "enter": enter,
        }[self.verb](world, me, self.goal)

    def element(self, me: Entity) -> tuple[str, int]:
        """The body action and utterance of a sequence in this turn of the state; after the last, nothing."""
        assert isinstance(self.goal, Performance)
        elements = self.goal.elements
        return elements[me.clock] if me.clock < len(elements) else ("none", 0)

    def utterance(self, me: Entity) -> int:
        """The number of the utterance that is performed in this turn, 0 if none."""
        return self.element(me)[1] if self.verb == "perform" else 0

    def fulfilled(self, world: World, me: Entity) -> bool:
        """Whether what it goes for is reached already."""
        if self.verb in ("go_to", "enter"):
            return geometry.at(world, me, self.goal)
        if self.verb in ("search", "go_away_from"):
            return self.sees() if self.verb == "search" else self.away()
        return self.verb == "go_next_to" and geometry.next_to(world, me, self.goal)

    def finished(self, world: World, me: Entity) -> bool:
        """Whether it ended with the turn that was just taken; single actions take one turn."""
        if self.verb in ("fetch", "give", "bring"):
            act = "pickup" if self.verb == "fetch" else "drop"
            full = world.carried_by(me) is not None
            return self.done_before or (self.acting and me.action == act and full == (act == "pickup"))
        if self.verb in ("use", "push"):
            return self.acting and me.action == ("toggle" if self.verb == "use" else "forward")
        if self.verb in ("go_to", "enter", "go_next_to", "search", "go_away_from"):
            return self.fulfilled(world, me)
        if self.verb == "perform":
            return me.clock >= len(self.goal.elements)
        return me.facing == self.goal if self.verb == "turn_to" else True


def plan(value: Value, context: Context) -> Activity:
    """The activity that a `do:` names; `choose` and `wander` are drawn anew each turn."""
    context = replace(context, value=value)
    node: Any = value.tree
    while isinstance(node, ast.Call) and node.name == "choose":
        options = [option for arg in node.args for option, weight in weighed(arg) for _ in range(weight)]
        node = options[drawn(context, node, len(options))]
    if isinstance(node, ast.Name):
        if node.id == "wander":
            return Activity(("forward", "left", "right")[drawn(context, node, 3)])
        return Activity(node.id)
    assert isinstance(node, ast.Call), "internal: no activity"
    if node.name == "search":
        return Activity("search", sees=partial(holds, replace(node, name="sees"), context))
    if node.name == "go_away_from":
        thing, far = node.args
        apart = ast.Compare(">=", ast.Call("distance", (thing,), at=node.at), far, at=node.at)
        return Activity("go_away_from", there(of(thing, context)), away=partial(holds, apart, context))
    return Activity(node.name, *(there(of(argument, context)) for argument in node.args))


def holds(condition: ast.Expr, context: Context) -> bool:
    """Whether something is so; of what is not found, nothing is."""
    try:
        return bool(there(of(condition, context)))
    except NothingFoundError:
        return False


def look_around(world: World, me: Entity) -> str:
    """Three turns left, then thirteen of walking: at first up to three cells before an obstacle, then up to it. Where
    it goes no further it turns left, every other time right, or to the side that is free if only one of them is."""
    assert me.cell is not None
    often, number = divmod(me.clock, 16)
    if number < 3:
        return "left"

    floor = [cell for cell in world.interior() if cell not in world.terrain]

    def free(quarter: int, cells: int) -> bool:
        cell, way = me.cell, turned(me.facing, quarter)
        for _ in range(cells):
            cell = step_from(cell, way)  # type: ignore[arg-type]
            if cell not in floor or not geometry.free(world, cell, me):
                return False
        return True

    if free(0, 1 if often else 3):
        return "forward"
    left, right = free(-1, 1), free(1, 1)
    if left != right:
        return "left" if left else "right"
    return "right" if often % 2 else "left"


def turn_towards(world: World, me: Entity, wanted: str) -> str:
    """One quarter turn; when it is behind the agent turns left, an NPC left or right at random."""
    if me.facing == wanted:
        return "none"
    for primitive, quarter in (("left", -1), ("right", 1)):
        if turned(me.facing, quarter) == wanted:
            return primitive
    if me is world.agent:
        return "left"
    return ("left", "right")[chance.choose(world.key, f"cast.{me.key}.turn", world.t, 0, 2)]


def face(world: World, me: Entity, goal: Any) -> str:
    """Turns towards the quadrant in which x lies."""
    return turn_towards(world, me, quadrant(where(me), where(goal)))  # type: ignore[arg-type]


def go_to(world: World, me: Entity, goal: Any) -> str:
    """Along a shortest path; x itself is admitted though something is in it."""
    if geometry.at(world, me, goal):
        return "none"
    goals = [cell for cell in map(where, as_list(goal)) if cell is not None]
    return along(world, me, goals)


def go_next_to(world: World, me: Entity, goal: Any) -> str:
    """Along a shortest path to a free cell beside x."""
    if geometry.next_to(world, me, goal):
        return "none"
    beside = [
        step_from(cell, d) for cell in map(where, as_list(goal)) if cell is not None for d in SEARCH_ORDER
    ]
    return along(world, me, [cell for cell in beside if geometry.free(world, cell, me)])


def along(world: World, me: Entity, goals: list[Cell]) -> str:
    """The next action on a shortest path to any of the goals, which need not be free themselves: breadth first, ties
    down, up, right, left; of the agent ahead, left, right, back."""
    steps = dict.fromkeys(goals, 0)
    queue = list(steps)
    for cell in queue:
        for direction in SEARCH_ORDER:
            neighbour = step_from(cell, direction)
            if neighbour not in steps and geometry.free(world, neighbour, me):
                steps[neighbour] = steps[cell] + 1
                queue.append(neighbour)
    assert me.cell is not None
    order = [turned(me.facing, k) for k in (0, -1, 1, 2)] if me is world.agent else SEARCH_ORDER
    options = [d for d in order if step_from(me.cell, d) in steps]
    if not options:
        return "none"
    here = me.cell
    best = min(options, key=lambda d: steps[step_from(here, d)])
    return "forward" if me.facing == best else turn_towards(world, me, best)


def use(world: World, me: Entity, goal: Any) -> str:
    """Goes next to x, faces it, toggles it."""
    if geometry.faces(world, me, goal):
        return "toggle"
    if not geometry.next_to(world, me, goal):
        return go_next_to(world, me, goal)
    near = next(one for one in as_list(goal) if geometry.next_to(world, me, one))
    return face(world, me, near)


def point(world: World, me: Entity, goal: Any) -> str:
    """Points in the direction of the quadrant in which x lies."""
    return f"point {quadrant(where(me), where(goal))}"  # type: ignore[arg-type]


def point_at(world: World, me: Entity, goal: Any) -> str:
    """Points at the cell of x."""
    return "point {} {}".format(*where(goal))  # type: ignore[misc]


def flee(world: World, me: Entity, goal: Any) -> str:
    """Turns its back on x, then walks."""
    away = turned(quadrant(where(me), where(goal)), 2)  # type: ignore[arg-type]
    return "forward" if me.facing == away else turn_towards(world, me, away)


def push(world: World, me: Entity, goal: Any, way: str) -> str:
    """Goes to the cell behind x, turns, and walks into x."""
    cell = where(goal)
    assert cell is not None
    behind = step_from(cell, turned(way, 2))
    if me.cell != behind:
        return go_to(world, me, behind)
    return "forward" if me.facing == way else turn_towards(world, me, way)


def enter(world: World, me: Entity, goal: Any) -> str:
    """Uses x while it is closed, goes through once it is open."""
    if geometry.at(world, me, goal):
        return "none"
    return go_to(world, me, goal) if goal.status in TYPES[goal.type].walkable else use(world, me, goal)
