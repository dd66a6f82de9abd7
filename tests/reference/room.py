"""Reset: draws the room, puts everything down, and computes what is fixed for the episode."""

from __future__ import annotations

import re
from typing import Any

from socialai_dsl.grammar import ast
from tests.reference import chance
from tests.reference.evaluate import Context, evaluate, key_of, of
from tests.reference.places import region
from tests.reference.script import Group, Member, Script, Sequence
from tests.reference.source import Sources, Value
from tests.reference.speech import noun_value
from tests.reference.world import (
    COLORS,
    DIRECTIONS,
    NO_CELL,
    NOTHING,
    TYPES,
    Cell,
    Entity,
    Kept,
    Performance,
    Recall,
    World,
    as_list,
    default_name,
    quadrant,
    where,
)


class Setup:
    """The drawing of one room. Attributes that others ask for are computed when first asked for."""

    def __init__(self, scenario: Script, sources: Sources, world: World, layout: dict[str, Any]) -> None:
        self.scenario, self.sources, self.world, self.layout = scenario, sources, world, layout
        self.pinned_lets: dict[str, Any] = layout.get("let") or {}
        self.members: dict[str, Member] = {}
        self.drawn_cells: set[str] = set()
        self.facing_known: set[str] = set()
        self.status_known: set[str] = set()
        self.building = False

    # -- the whole of it -----------------------------------------------------------------------------------

    def run(self) -> None:
        """Sizes, entities, fixed things, placements in their order, then all that is drawn or computed once."""
        self.draw_size()
        self.draw_members()
        self.make_entities()
        self.build()
        for name in self.scenario.tables:
            self.compute_table(name)
        self.pin()
        for name in self.order():
            self.place(name)
        for entity in self.world.entities():
            self.compute_colors(entity)
        for member in self.world.cast.values():
            self.compute_facing(member)
            self.compute_name(member)
        for name in self.scenario.looks:
            self.compute_look(name)
        for name in self.scenario.let:
            self.compute_let(name)
        for thing in self.world.things():
            self.compute_status(thing)
            self.compute_links(thing)
            self.compute_inside(thing)
        for name, source in self.scenario.state.items():
            self.compute_register(self.world, name, source, f"state.{name}", None)
        for member in self.world.cast.values():
            self.compute_slots(member)
            self.compute_earshot(member)
            self.compute_registers(member)
            self.compute_beliefs(member)

    def context(self, me: Entity | None = None, **variables: Any) -> Context:
        """Who asks during reset: outside any frame; a pick that finds nothing takes the first member."""
        return Context(self.world, me, variables=variables, take_first=True, setup=self)

    def draw(self, path: str, number: int, size: int) -> int:
        """A draw at reset."""
        return chance.choose(self.world.key_at(path), path, 0, number, size)

    # -- room ----------------------------------------------------------------------------------------------

    def draw_size(self) -> None:
        """Width and height are drawn independently."""
        pinned = self.layout.get("room") or {}
        for side in ("width", "height"):
            options = sizes(self.scenario, self.sources, side)
            chosen = options[self.draw(f"room.{side}", 0, len(options))]
            setattr(self.world, side, pinned.get(side) or chosen)

    def build(self) -> None:
        """Fixed things stand in place of floor, or of what was built there before."""
        self.building = True
        for number, entry in enumerate(self.scenario.room.build):
            for type_, place in entry.items():
                value = self.sources.expression(f"room.build[{number}].{type_}", place)
                for cell in region(value, self.context()):
                    self.world.terrain[cell] = type_
        self.building = False

    # -- entities ------------------------------------------------------------------------------------------

    def draw_members(self) -> None:
        """Who plays: of a member that is one of several files, one is drawn."""
        for name in self.scenario.cast:
            versions = self.scenario.versions(name)
            number = 0
            if name in self.scenario.files:
                number = self.draw(f"cast.{name}.one_of", 0, len(versions))
                given = self.pinned_lets.get(f"{name}.one_of")
                if given is not None:
                    number = list(self.scenario.files[name]).index(given) if isinstance(given, str) else given
            self.members[name] = versions[number]

    def kinds(self) -> list[str]:
        """The kinds of NPCs by first appearance in the cast, those of `one_of` in the order of its files."""
        return list(
            dict.fromkeys(
                version.kind or "peer"
                for name in self.scenario.cast
                if name != "agent"
                for version in self.scenario.versions(name)
            )
        )

    def make_entities(self) -> None:
        """Everything that will be put down, not placed yet."""
        for name, group in self.scenario.objects.items():
            size = group_size(group)
            initial = TYPES[group.type].initial
            things = [
                Entity(name, "object", index, type=group.type, status=initial, initial=initial)
                for index in range(size or 1)
            ]
            for thing in things:
                thing.one_way, thing.dark, thing.single = group.one_way, group.dark, size is None
                thing.exclusive, thing.timer = group.exclusive, group.timer
                thing.carryable = group.carryable
                thing.only_rolled = group.pushed_by is not None
            self.world.objects[name] = things[0] if size is None else things
        kinds, seats = self.kinds(), self.scenario.seats()
        for name, member in self.members.items():
            person = Entity(name, "agent" if name == "agent" else "npc", kind=member.kind or "peer")
            person.view = member.view or 7
            person.pushed_aside = member.pushed_by == "anybody"
            person.frame = member.frame
            person.state = self.start_of(member.frame)
            # "NPC status = index of its kind in order of first appearance in the cast"; the agent's comes last.
            known = list(dict.fromkeys([*kinds, person.kind]))
            person.kind_code = known.index(person.kind) if member.kind_code is None else member.kind_code
            person.seat, person.taken = name in seats, name == "agent"
            if name in self.scenario.files:
                drawn = self.scenario.versions(name).index(member)
                person.drawn_from = list(self.scenario.files[name])[drawn]
            group, _, number = name.rstrip("]").partition("[")
            if number:
                person.index = int(number)
                self.world.groups.setdefault(group, []).append(person)
            self.world.cast[name] = person
        self.world.roles = {role: self.scenario.player_of(role) for role in self.scenario.roles}
        for name, memory in self.scenario.memory.items():
            self.world.memories[name] = Recall(memory.last, memory.of)

    def start_of(self, name: str | None) -> str | int | None:
        """The first state of a frame, or the first entry of its steps."""
        frame = self.sources.frame_of(name)
        if frame is None:
            return None
        return 0 if frame.states is None else frame.start or next(iter(frame.states))

    # -- placement -----------------------------------------------------------------------------------------

    def order(self) -> list[str]:
        """`order:` first, then objects, NPCs, the agent; but what a placement needs comes before it."""
        cast = [*(name for name in self.members if name != "agent"), "agent"]
        done: dict[str, None] = {}

        def place(name: str, busy: frozenset[str]) -> None:
            for need in self.needs(name):
                if need not in busy and need not in done:
                    place(need, busy | {need})
            done[name] = None

        for name in (*self.scenario.order, *self.scenario.objects, *cast):
            if name not in done:
                place(name, frozenset({name}))
        return list(done)

    def needs(self, name: str) -> list[str]:
        """The entities that somebody's place or position speaks of, through lets and facings too, as mentioned."""
        found: dict[str, None] = {}
        for value in self.values_of(name, ("place", "at")):
            self.collect(value.tree, found, {name})
        for value in self.values_of(name, ("inside",)):
            holders: dict[str, None] = {}
            self.collect(value.tree, holders, {name})
            # What is carried does not need its carrier's place.
            found |= {holder: None for holder in holders if holder not in self.world.cast}
        return [need for need in found if need != name]

    def collect(self, tree: ast.Node, found: dict[str, None], seen: set[str]) -> None:
        """Adds the names of all entities that an expression speaks of."""
        for node in tree.walk():
            if not isinstance(node, ast.Name):
                continue
            name = self.world.roles.get(node.id, node.id)
            if name in seen:
                continue
            if name in self.scenario.let:
                seen.add(name)
                if not isinstance(self.scenario.let[name], Sequence):
                    self.collect(self.let_value(name).tree, found, seen)
            elif name in self.scenario.objects or name in self.members:
                seen.add(name)
                found[name] = None
                for value in self.values_of(name, ("facing",)):
                    self.collect(value.tree, found, seen)

    def values_of(self, name: str, keys: tuple[str, ...]) -> list[Value]:
        """What is written under some keys of an object or a member."""
        is_object = name in self.scenario.objects
        holders: list[Any] = [self.scenario.objects[name]] if is_object else self.scenario.versions(name)
        prefix = "objects" if is_object else "cast"
        return [
            self.sources.expression(path, source)
            for holder in holders
            for key in keys
            for path, source in leaves(f"{prefix}.{name}.{key}", getattr(holder, key, None))
        ]

    def pin(self) -> None:
        """What a layout pins is put down first."""
        for entity in self.world.entities():
            pinned = self.pinned(entity)
            if pinned.get("at") is not None:
                entity.cell = (pinned["at"][0], pinned["at"][1])
                self.drawn_cells.add(repr((entity.key, entity.index)))
            entity.color = pinned.get("color", entity.color)
            entity.name = pinned.get("name", entity.name)
            if pinned.get("state"):
                entity.status = pinned["state"]
                self.status_known.add(repr((entity.key, entity.index)))
            if pinned.get("facing"):
                entity.facing = pinned["facing"]
                self.facing_known.add(entity.key)
        for name, given in self.pinned_lets.items():
            if given is None or "[" in name or name.endswith(".one_of"):
                continue  # elements of sequences and who is drawn are looked up where they are drawn
            owner, _, register = name.partition(".")
            if register:
                self.world.cast[owner].registers[register] = self.decode(given)
            else:
                self.world.lets[name] = self.decode(given)

    def pinned(self, entity: Entity) -> dict[str, Any]:
        """What a layout says of an entity."""
        given = self.layout.get(entity.key.partition("[")[0])
        if isinstance(given, list):
            given = given[entity.index] if entity.index < len(given) else None
        return given or {}

    def decode(self, given: Any) -> Any:
        """A value of a layout: `doors[0]`, a name, a cell as a list, or the value itself."""
        if isinstance(given, list):
            return tuple(given)
        if not isinstance(given, str):
            return given
        member = re.fullmatch(r"(\w+)\[(\d+)\]", given)
        if member:
            return as_list(self.world.objects[member[1]])[int(member[2])]
        return self.world.objects.get(given) or self.world.cast.get(given) or given

    def place(self, name: str) -> None:
        """Draws the cell of each member of a group, or of a member of the cast."""
        if name in self.scenario.objects:
            group = self.scenario.objects[name]
            for thing in as_list(self.world.objects[name]):
                self.put_down(thing, f"objects.{name}", group)
        else:
            self.put_down(self.world.cast[name], f"cast.{name}", self.members[name])

    def put_down(self, entity: Entity, path: str, holder: Group | Member) -> None:
        """One uniform draw from the free cells that satisfy the place; if there is none it is not in the room."""
        if repr((entity.key, entity.index)) in self.drawn_cells:
            return
        if isinstance(holder, Group) and holder.inside is not None:
            return
        if holder.at is not None:
            cells = [self.exact_cell(path, holder.at, entity)]
            cells = [cell for cell in cells if self.world.inside(cell)]  # "`at` always may" share it
        else:
            written = leaves(f"{path}.place", holder.place) or [(f"{path}.place", "anywhere")]
            _, source = written[entity.index % len(written)]
            value = self.sources.expression(f"{site_of(entity)}.place", source)
            found = region(value, self.context(entity, it=entity))
            overlaps = isinstance(holder, Group) and holder.overlap
            taken = {entity.cell for entity in self.world.entities()}
            cells = [c for c in found if overlaps or (c not in self.world.terrain and c not in taken)]
        if cells:
            entity.cell = cells[self.draw(f"{path}.cell", number_of(entity), len(cells))]

    def exact_cell(self, path: str, at: Any, entity: Entity) -> Cell:
        """`at: [x, y]`, or one of a list of them."""
        path, pair = (
            (f"{path}.at[{entity.index}]", at[entity.index])
            if isinstance(at[0], tuple)
            else (f"{path}.at", at)
        )
        trees = [self.sources.expression(f"{path}[{axis}]", source).tree for axis, source in enumerate(pair)]
        context = self.context(entity)
        # One value with two parts: its draws are numbered through.
        context.value = Value(f"{site_of(entity)}.at", ast.Alternatives(tuple(trees)))
        x, y = (of(tree, context) for tree in trees)
        return x, y

    # -- what is drawn or computed once --------------------------------------------------------------------

    def compute_colors(self, entity: Entity) -> None:
        """The colour of an entity; for `distinct` those of its whole group."""
        if entity.color is not None:
            return
        if entity.sort == "object":
            path, written = f"objects.{entity.key}", self.scenario.objects[entity.key].color
        else:
            path, written = f"cast.{entity.key}", self.members[entity.key].color or "random"
        if written is None and TYPES[entity.type].color is not None:
            entity.color = TYPES[entity.type].color
            return
        written = "random" if written is None else written
        sources = leaves(f"{path}.color", written)
        _, source = sources[entity.index % len(sources)]
        if source == "random":
            entity.color = COLORS[self.draw(f"{path}.color", number_of(entity), len(COLORS))]
        elif source == "distinct":
            group, group_path = self.group_of(entity)
            self.distinct_colors(group_path, group)
        elif str(source).startswith("permuted("):
            self.permuted_colors(entity, source)
        else:
            value = self.sources.expression(f"{site_of(entity)}.color", source)
            found = evaluate(value, self.context(entity, it=entity))
            # "Group attributes (`doors.color`) give one each."
            entity.color = found[entity.index % len(found)] if isinstance(found, list) else found

    def group_of(self, entity: Entity) -> tuple[list[Entity], str]:
        """The group that an entity is one of, and where it is written."""
        if entity.sort == "object":
            return as_list(self.world.objects[entity.key]), f"objects.{entity.key}"
        name = entity.key.partition("[")[0]
        return self.world.groups.get(name, [entity]), f"cast.{name}"

    def permuted_colors(self, entity: Entity, source: Any) -> None:
        """The colours of another group in random order, one each."""
        group, path = self.group_of(entity)
        tree = self.sources.expression(f"{path}.color", source).tree
        assert isinstance(tree, ast.Call)
        given = as_list(evaluate(Value(f"{path}.color", tree.args[0]), self.context(entity, it=entity)))
        for thing, number in zip(group, self.permutation(f"{path}.order", len(given)), strict=True):
            thing.color = thing.color or given[number]

    def permutation(self, path: str, size: int) -> list[int]:
        """The numbers below `size` in random order: each one drawn from those that are left."""
        left = list(range(size))
        return [left.pop(self.draw(f"{path}[{k}]", 0, len(left))) for k in range(size)]

    def compute_table(self, name: str) -> None:
        """A table as it is written, or the values of another in random order."""
        tables, written = self.world.tables, self.scenario.tables[name]
        if name in tables:
            return
        if not isinstance(written, dict):
            value = self.sources.name(f"tables.{name}", written)
            assert isinstance(value.tree, ast.Call)
            (other,) = value.tree.args
            if isinstance(other, ast.Name) and other.id in self.scenario.tables:
                self.compute_table(other.id)
                keys, values = list(tables[other.id]), list(tables[other.id].values())
            else:
                values = as_list(evaluate(Value(f"tables.{name}", other), self.context()))
                keys = [str(1 + k) for k in range(len(values))]
            order = self.permutation(f"tables.{name}", len(values))
            tables[name] = {key: values[n] for key, n in zip(keys, order, strict=True)}
            return
        tables[name] = {
            str(key): evaluate(self.sources.name(f"tables.{name}.{key}", value), self.context())
            for key, value in written.items()
        }

    def compute_inside(self, thing: Entity) -> None:
        """What it lies in: it has no cell of its own until that is opened."""
        source = self.scenario.objects[thing.key].inside if thing.sort == "object" else None
        if source is None or thing.inside is not None or thing.carrier is not None:
            return
        found = evaluate(
            self.sources.expression(f"{site_of(thing)}.inside", source), self.context(thing, it=thing)
        )
        holder = found[thing.index] if isinstance(found, list) else found
        if holder.sort == "object":
            thing.inside = holder
        elif self.world.carried_by(holder) is None:
            thing.carrier = holder

    def compute_beliefs(self, member: Entity) -> None:
        """Beliefs start with what is the case."""
        for name, belief in self.sources.beliefs_of(member):
            if name not in member.believes:
                site = f"cast.{member.key}.beliefs.{name}"
                member.ages[name] = 0
                if str(belief.start) == "none":
                    member.believes[name] = NOTHING
                    continue
                first = next((s for s in belief.sources(site) if not s[1].hears), (f"{site}.start", None))
                place, source = first if belief.start is None else (f"{site}.start", None)
                written = belief.start if source is None else source.of
                frame = member.frame if belief.from_ else None
                value = self.sources.expression(place, written, frame)
                found = evaluate(value, self.context(member))
                is_none = belief.may_be_nothing and found == NO_CELL
                member.believes[name] = NOTHING if is_none else found

    def distinct_colors(self, path: str, group: list[Entity]) -> None:
        """One after another, each among the colours that are not taken yet."""
        left = [color for color in COLORS if color not in [thing.color for thing in group]]
        for thing in group:
            if thing.color is None:
                thing.color = left.pop(self.draw(f"{path}.color", thing.index, len(left)))

    def compute_name(self, member: Entity) -> None:
        """What precedes its lines: an expression, a text, or by default its key, capitalised."""
        if member.name is not None or member.sort == "object":
            return
        written = self.members[member.key].name
        if written is None:
            member.name = default_name(member.key)
            return
        value = self.sources.name(f"cast.{member.key}.name", written)
        found = evaluate(value, self.context(member))
        member.name = str(written) if isinstance(found, Entity | list) else str(found)

    def compute_facing(self, member: Entity) -> None:
        """A direction, `random` (the default), or `toward(x)`."""
        if member.sort == "object" or member.key in self.facing_known:
            return
        self.facing_known.add(member.key)
        written = self.members[member.key].facing
        if written is None or written == "random":
            member.facing = DIRECTIONS[self.draw(f"cast.{member.key}.facing", 0, 4)]
            return
        value = self.sources.expression(f"cast.{member.key}.facing", written)
        if isinstance(value.tree, ast.Call) and value.tree.name == "toward":
            context = self.context(member)
            context.value = value
            goal = where(of(value.tree.args[0], context))
            there = member.cell is not None and goal is not None
            member.facing = quadrant(member.cell, goal) if there else "down"
        else:
            member.facing = evaluate(value, self.context(member))

    def compute_status(self, thing: Entity) -> None:
        """The initial status: `state:`, or what `pressed:` and `opened:` say."""
        if repr((thing.key, thing.index)) in self.status_known:
            return
        self.status_known.add(repr((thing.key, thing.index)))
        group = self.scenario.objects[thing.key]
        if group.state is not None:
            thing.status = thing.initial = str(group.state)
        for word, source in (("pressed", group.pressed), ("opened", group.opened)):
            if source is not None and evaluate(
                self.sources.expression(f"{site_of(thing)}.{word}", source), self.context(thing, it=thing)
            ):
                thing.status = thing.initial = "open" if word not in TYPES[thing.type].states else word

    def compute_links(self, thing: Entity) -> None:
        """What it unlocks and opens: groups of one size pairwise, else each of them all."""
        group = self.scenario.objects[thing.key]
        if group.unlocks is not None:
            thing.unlocks = self.linked(thing, "unlocks", group.unlocks)
        if group.opens is not None:
            thing.opens = self.linked(thing, "opens", group.opens)

    def linked(self, thing: Entity, word: str, source: Any) -> list[Entity]:
        """The things that one is linked to."""
        value = self.sources.expression(f"objects.{thing.key}.{word}", source)
        others, group = evaluate(value, self.context(thing)), self.world.objects[thing.key]
        if isinstance(others, list) and isinstance(group, list):
            assert len(others) == len(group), "groups of different sizes cannot be linked one by one"
            others = others[thing.index]
        return as_list(others)

    def draw_sequence(self, name: str, sequence: Sequence) -> Performance:
        """Each element: one of the moves, and at a chance one of all utterances."""
        elements = []
        for k in range(sequence.length):
            move = sequence.moves[self.draw(f"let.{name}[{k}].move", 0, len(sequence.moves))]
            site, spoken, pairs = f"let.{name}[{k}].utterance", 0, self.scenario.grammar.pairs()
            if sequence.chance is not None and chance.happens(
                self.world.key_at(site), site, 0, sequence.chance
            ):
                spoken = 1 + self.draw(site, 1, len(pairs))
            pinned = self.pinned_lets
            elements.append(
                (
                    pinned.get(f"{name}[{k}].move") or move,
                    spoken
                    if pinned.get(f"{name}[{k}].utterance") is None
                    else pinned[f"{name}[{k}].utterance"],
                )
            )
        return Performance(tuple(elements))

    def let_value(self, name: str) -> Value:
        """The tree of a `let`."""
        return self.sources.expression(f"let.{name}", self.scenario.let[name])

    def compute_let(self, name: str) -> None:
        """Once per episode."""
        if name in self.world.lets:
            return
        written = self.scenario.let[name]
        if isinstance(written, Sequence):
            self.world.lets[name] = self.draw_sequence(name, written)
        else:
            self.world.lets[name] = evaluate(self.let_value(name), self.context())

    def compute_slots(self, member: Entity) -> None:
        """Texts, utterances and bools stay expressions, read at every use; all others are computed now."""
        frame = self.sources.frame_of(member.frame)
        if frame is None or member.slots:
            return
        for name, type_ in frame.slots.items():
            path, source = f"cast.{member.key}.with.{name}", self.members[member.key].with_[name]
            if type_ in ("text", "utterance"):
                member.slots[name] = self.sources.text(path, source)
            elif type_ == "bool":
                member.slots[name] = self.sources.expression(path, source)
            elif type_ == "noun" and str(source) in map(str, self.scenario.grammar.nouns):
                member.slots[name] = noun_value(source)
            else:
                member.slots[name] = evaluate(self.sources.expression(path, source), self.context(member))

    def compute_earshot(self, member: Entity) -> None:
        """How far its voice carries: its own earshot, else the scenario's."""
        own = self.members[member.key].earshot
        path, source = (
            ("earshot", self.scenario.earshot) if own is None else (f"cast.{member.key}.earshot", own)
        )
        if source in ("next_to", "room"):
            self.world.earshot[member.key] = str(source)
        else:
            self.world.earshot[member.key] = evaluate(self.sources.expression(path, source), self.context())

    def compute_registers(self, member: Entity) -> None:
        """The start values of a frame's `let`, one copy per member that follows it."""
        frame = self.sources.frame_of(member.frame)
        for name, source in (frame.let if frame else {}).items():
            path = f"{member.key}/frames.{member.frame}.let.{name}"
            self.compute_register(member, name, source, path, member.frame)

    def compute_look(self, name: str) -> None:
        """What each of those that have a look starts with."""
        written = self.scenario.looks[name]
        group = as_list(evaluate(self.sources.expression(f"looks.{name}.for", written.for_), self.context()))
        starts = written.start if isinstance(written.start, tuple) else (written.start,) * len(group)
        for number, (entity, start) in enumerate(zip(group, starts, strict=True)):
            if name in entity.looks:
                continue
            given = (self.pinned(entity).get("looks") or {}).get(name)
            source = f"pick({' | '.join(written.words)})" if start == "random" else start
            value = self.sources.expression(f"looks.{name}[{number}]", source)
            entity.looks[name] = given or evaluate(value, self.context(it=entity))

    def compute_register(
        self, holder: Entity | World, name: str, source: Any, path: str, frame: str | None
    ) -> None:
        """The start value of a register, and its range where one is given."""
        context = self.context(holder if isinstance(holder, Entity) else None)
        context.in_frame = isinstance(holder, Entity)
        group: list[Any] | None = None
        if isinstance(source, dict):
            if "range" in source:
                numbers = evaluate(self.sources.expression(f"{path}.range", source["range"], frame), context)
                holder.ranges[name] = (numbers[0], numbers[-1])
            if "for" in source:
                group = as_list(evaluate(self.sources.expression(f"{path}.for", source["for"]), context))
            source = source["start"]
            if str(source).strip() == "none":
                holder.may_be_nothing.add(name)
        if name in holder.registers:
            return
        values = []
        for number, key in enumerate([None] if group is None else group):
            asked = context if group is None else context.knowing(it=key)
            site = path if group is None else f"{path}[{number}]"
            nothing = name in holder.may_be_nothing
            values.append(
                NOTHING if nothing else evaluate(self.sources.expression(site, source, frame), asked)
            )
        keys = [] if group is None else map(key_of, group)
        holder.registers[name] = values[0] if group is None else Kept(dict(zip(keys, values, strict=True)))


def sizes(scenario: Script, sources: Sources, side: str) -> list[int]:
    """The possible widths or heights of the room."""
    source = getattr(scenario.room, side)
    source = scenario.room.size if source is None else source
    return as_list(evaluate(sources.expression(f"room.{side}", source), Context(World(0))))


def group_size(group: Group) -> int | None:
    """How many; None for a single object."""
    if group.count is not None:
        return group.count
    return len(group.at) if group.at and isinstance(group.at[0], tuple) else None


def number_of(entity: Entity) -> int:
    """The number of its draws: objects of a group share a place, members of the cast have one each."""
    return entity.index if entity.sort == "object" else 0


def site_of(entity: Entity) -> str:
    """Where what is written of an entity is drawn: each member of a group draws for itself."""
    if entity.sort != "object":
        return f"cast.{entity.key}"
    return f"objects.{entity.key}" if entity.single else f"objects.{entity.key}[{entity.index}]"


def leaves(path: str, source: Any) -> list[tuple[str, Any]]:
    """The scalars of a value with their paths; a list of one is written without its number."""
    if source is None:
        return []
    if not isinstance(source, tuple):
        return [(path, source)]
    if len(source) == 1 and not isinstance(source[0], tuple):
        return [(path, source[0])]
    return [leaf for number, item in enumerate(source) for leaf in leaves(f"{path}[{number}]", item)]
