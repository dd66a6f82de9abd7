"""How the world settles: links and computed statuses, which follow from everything else."""

from __future__ import annotations

from socialai_dsl.grammar import ast
from tests.reference.effects import unlock, vanish
from tests.reference.evaluate import Context, NothingFoundError, holds
from tests.reference.script import Group, Script
from tests.reference.source import Sources
from tests.reference.world import TYPES, Entity, World, as_list


class Settling:
    """Applies the links and computed statuses of one scenario."""

    def __init__(self, scenario: Script, sources: Sources, world: World) -> None:
        self.scenario, self.sources, self.world = scenario, sources, world
        self.order = self.ordered()

    def ordered(self) -> list[tuple[str, str]]:
        """The computed statuses as (object, status), each after those of the objects that it speaks of."""
        computed = {
            (name, on): self.sources.expression(f"objects.{name}.{on}", getattr(group, on))
            for name, group in self.scenario.objects.items()
            for on in ("locked", "tagged")
            if getattr(group, on) is not None
        }
        found: list[tuple[str, str]] = []

        def add(status: tuple[str, str], busy: frozenset[tuple[str, str]]) -> None:
            named = {node.id for node in computed[status].tree.walk() if isinstance(node, ast.Name)}
            for other in computed:
                if other[0] in named and other not in busy | set(found):
                    add(other, busy | {other})
            if status not in found:
                found.append(status)

        for status in computed:
            add(status, frozenset({status}))
        return found

    def all(self) -> None:
        """Links, then computed statuses."""
        self.links()
        self.statuses()

    def links(self) -> None:
        """What follows from statuses directly. All are levels, none an event."""
        self.release_contents()
        self.unlock()
        self.open()
        self.block()

    def release_contents(self) -> None:
        """All that lies in a box that is opened takes its place."""
        for box in self.world.things():
            contents = [
                one for one in self.world.things() if one.gone and one.inside is box and one.carrier is None
            ]
            if not box.gone and box.status == "opened" and contents:
                for content in contents:
                    content.cell = box.cell
                vanish(box)

    def open(self) -> None:
        """A remote door is open while something that opens it is active, and closed otherwise."""
        opened_by: dict[int, list[Entity]] = {}
        for thing in self.world.things():
            for door in thing.opens:
                opened_by.setdefault(id(door), []).append(thing)
        for door in self.world.things():
            openers = opened_by.get(id(door))
            if openers:
                door.status = "open" if any(map(active, openers)) else "closed"

    def block(self) -> None:
        """Of an exclusive group nothing reacts once another one of it was used."""
        for group in self.world.objects.values():
            used = [thing for thing in as_list(group) if thing.status != thing.initial]
            for thing in as_list(group):
                thing.blocked = thing.exclusive and any(other is not thing for other in used)

    def unlock(self) -> None:
        """While something is active, what it unlocks and is locked becomes closed."""
        for thing in self.world.things():
            if active(thing):
                for other in thing.unlocks:
                    unlock(other)

    def statuses(self) -> None:
        """`locked:` and `tagged:`: on while they hold; what is found on while they do not becomes off."""
        for name, on in self.order:
            for thing in as_list(self.world.objects[name]):
                self.settle(thing, self.scenario.objects[name], on)

    def settle(self, thing: Entity, group: Group, on: str) -> None:
        """One computed status of one object, `it`."""
        value = self.sources.expression(f"objects.{thing.key}.{on}", getattr(group, on))
        try:
            is_on = holds(value, Context(self.world, variables={"it": thing}))
        except NothingFoundError:
            is_on = False
        if is_on:
            thing.status = on
        elif thing.status == on:
            thing.status = {"locked": "shut" if thing.type == "box" else "closed", "tagged": "plain"}[on]


def active(thing: Entity) -> bool:
    """Whether it works on what it is linked to."""
    return not thing.gone and thing.status in TYPES[thing.type].active
