"""Random expressions of each type, made of what is declared where they stand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from random import Random

from tests.scenario_fuzzer.declared import STATUSES, Declared, Frame, Look, Row, Thing

COLORS = ("red", "green", "blue", "purple", "yellow", "grey")
DIRECTIONS = ("right", "down", "left", "up")
LONGEST = 450
"""Characters of a condition; an expression may have 500."""

SEARCHING = ("sees", "looks_at", "faces_toward", "joint_attention", "points_at", "would_see", "eye_contact")


@dataclass(frozen=True)
class Where:
    """Where an expression stands.

    Attributes:
        frame: whose it is, if it stands in a frame. reset: whether it is computed at reset. heard, noun: whether
        something was heard, and whether with a noun. variables: bound ones, with the group they run through.
        still: whether it may neither draw nor look back. searching: whether it stands in a search.
        acts: body actions of the agent. slots: of a grammar without nouns, those in which something was heard.
    """

    frame: Frame | None = None
    reset: bool = False
    heard: bool = False
    noun: bool = False
    slots: tuple[str, ...] = ()
    variables: tuple[tuple[str, Thing], ...] = ()
    still: bool = False
    searching: bool = False
    acts: tuple[str, ...] = ("left", "right", "forward", "toggle", "done")

    @property
    def is_npcs(self) -> bool:
        """Whether it stands in a frame that NPCs follow."""
        return self.frame is not None and not self.frame.of_agent


class Phrases:
    """Makes expressions; every choice is drawn from `rng`."""

    def __init__(self, rng: Random, declared: Declared) -> None:
        self.rng, self.declared = rng, declared
        self.choices = 0

    def one_of(self, *options: str | Callable[[], str] | None) -> str:
        """One of these, made only then."""
        chosen = self.rng.choice([option for option in options if option is not None])
        return chosen if isinstance(chosen, str) else chosen()

    def often(self, probability: float) -> bool:
        """Whether something happens."""
        return self.rng.random() < probability

    def chosen(self, value: Callable[[], str], where: Where) -> str:
        """A value, now and then one of two by a condition; seldom within another, for lines have an end."""
        if not self.often(0.08 / 4**self.choices):
            return value()
        self.choices += 1
        asked = self.plain_condition(where) if self.often(0.3) else self.short_condition(where)
        one = value()
        made = f"({one} if {asked} else {value()})"
        self.choices -= 1
        return made if len(made) < 120 else one

    def short_condition(self, where: Where) -> str:
        """A condition of few words."""
        return self.one_of(
            f"agent.next_to({self.anchor(where)})",
            f"{self.anchor(where)}.color == {self.rng.choice(COLORS)}",
            f"agent.x > {self.rng.randint(1, 4)}",
            None if where.reset else f"t % {self.rng.randint(2, 3)} == 0",
        )

    # -- things, members, places -----------------------------------------------------------------------------

    def member(self, where: Where) -> str:
        """Somebody: the agent, an NPC, one of a group of them, oneself, who spoke."""
        known = self.declared
        options: list[str | Callable[[], str]] = ["agent", "agent", *known.members]
        options += ["self"] * 2 if where.frame else []
        options += ["speaker"] * 2 if where.heard else []
        for group, count in known.groups.items():
            options += [lambda group=group, count=count: self.numbered(group, count, where)]
            options += [f"nearest(n in {group} to {self.anchor(where)})"] if not where.variables else []
        return self.chosen(lambda: self.one_of(*options), where)

    def numbered(self, group: str, count: int, where: Where) -> str:
        """One of a group by its number, which may be computed."""
        index = self.rng.randrange(count)
        number = str(index) if where.searching or self.often(0.7) else f"({self.number(where, 0)}) % {count}"
        return f"first(k in {group} where k.index == {number})"

    def anchor(self, where: Where) -> str:
        """Somebody or something that is always known."""
        names = ["agent", *self.declared.members, *(thing.name for thing in self.declared.single)]
        return self.rng.choice([*names, "self"] if where.frame else names)

    def one(self, thing: Thing, where: Where) -> str:
        """One of an object's group, or the object itself."""
        for variable, group in where.variables:
            if group == thing and self.often(0.7):
                return variable
        if thing.count is None:
            return thing.name
        name = thing.name
        held = [let for let, group in self.declared.lets.items() if group == name]
        if where.frame is not None and not where.reset:
            held += [register for register, group in where.frame.things.items() if group == name]
        options: list[str | Callable[[], str]] = [*held, *held]
        count = thing.count
        options += [lambda: self.numbered(name, count, where)]
        if not where.variables:
            inner = self.bound("o", thing, where)
            options += [
                lambda: f"first(o in {name} where {self.plain_condition(inner)})",
                lambda: f"nearest(o in {name} to {self.anchor(where)})",
            ]
            if not where.still:
                options += [f"pick({name})", lambda: f"pick(o in {name} where {self.plain_condition(inner)})"]
        return self.chosen(lambda: self.one_of(*options), where)

    # -- registers for each of a group -----------------------------------------------------------------------

    def kept(self, holds: str, where: Where) -> list[Callable[[], str]]:
        """Registers for each of a group, or single ones that may be empty, that hold a sort of value."""
        if where.reset:
            return []
        rows = [*self.declared.rows, *(where.frame.rows if where.frame else [])]
        return [lambda row=row: self.of_row(row, where) for row in rows if row.holds == holds]  # type: ignore[misc]

    def of_row(self, row: Row, where: Where) -> str:
        """One of a row, whose key may be none of the group."""
        return row.name if row.keys is None else f"{row.name}({self.key(row, where)})"

    def key(self, row: Row, where: Where) -> str:
        """Whose register is meant."""
        match row.keys:
            case "colors":
                held = [*self.declared.colors, f"{self.anchor(where)}.color"]
                return self.rng.choice([*held, self.rng.choice(COLORS)])
            case "nouns":
                return "noun" if where.noun and self.often(0.7) else self.noun()
            case "cast":
                return self.rng.choice(["speaker"] * 2 * where.heard + ["agent", *self.declared.members])
            case "crowd":
                return "speaker" if where.heard and self.often(0.6) else "nearest(k in crowd to agent)"
            case "1..4":
                return f"t % {self.rng.randint(3, 6)}"
        thing = self.declared.group(str(row.keys))
        held = [variable for variable, group in where.variables if group == thing]
        if held and self.often(0.7):
            return held[0]
        return f"first(k in {thing.name} where k.index == t % {thing.count})"

    def value_of(self, row: Row, where: Where) -> str:
        """Something to put into a row."""
        if row.holds == "number":
            return self.number(where) if row.keys else f"min(max({self.number(where)}, -9), 9)"
        if row.holds == "color":
            return self.color(where)
        plain = [noun for noun in self.declared.nouns if isinstance(noun, str) and noun not in (*COLORS, "3")]
        return "noun" if where.noun and self.often(0.7) else self.rng.choice(plain or ["first(nouns)"])

    def of_rows(self, where: Where) -> str:
        """A condition on what a row holds."""
        rows = [*self.declared.rows, *(where.frame.rows if where.frame else [])]
        if not rows or where.reset:
            return self.relation(where)
        row = self.rng.choice(rows)
        what, op = self.of_row(row, where), self.rng.choice(("==", "!="))
        options: list[str | Callable[[], str]] = [f"{what} {op} none"] if row.empty else []
        others = [other for other in rows if other.holds == row.holds]
        options.append(lambda: f"{what} {op} {self.of_row(self.rng.choice(others), where)}")
        if row.holds == "noun":
            options += [lambda: f"{what} {op} {self.noun()}", f"{what} {op} agent.noun"]
            options += [f"{what} {op} noun"] * 2 if where.noun else []
        elif row.holds == "color":
            options += [lambda: f"{what} in red | {self.rng.choice(COLORS)} | grey | green"]
            options += [lambda: f"{what} {op} {self.entity(where)}.color"]
        else:
            options += [f"{what} > {self.rng.randint(0, 3)}", f"{what} in 1..3"]
        return self.one_of(*options)

    def bound(self, variable: str, thing: Thing, where: Where) -> Where:
        """Inside a quantifier over a group."""
        return replace(where, variables=(*where.variables, (variable, thing)), still=True, searching=True)

    def thing(self, where: Where, *types: str) -> tuple[str, Thing] | None:
        """An object of one of these types, as an expression, and what it is."""
        known = [thing for thing in self.declared.things if not types or thing.type in types]
        if not known:
            return None
        chosen = self.rng.choice(known)
        return self.one(chosen, where), chosen

    def entity(self, where: Where) -> str:
        """Somebody or something."""
        return self.chosen(lambda: self.somebody_or_something(where), where)

    def somebody_or_something(self, where: Where) -> str:
        """An object or somebody in the room."""
        named = [slot for slot in ("whom", "which") if slot in where.slots]
        if named and self.often(0.4):
            return self.rng.choice(named)
        found = self.thing(where) if self.often(0.6) else None
        return found[0] if found else self.member(where)

    def spot(self, where: Where) -> str:
        """Something with a place: somebody, something, or a cell."""
        options: list[str | Callable[[], str]] = [lambda: self.entity(where)] * 4
        options += self.declared.cells
        options += where.frame.cells if where.frame else []
        options.append(lambda: f"{self.entity(where)}.cell")
        if not (where.searching or where.reset or where.variables):
            options.append(lambda: f"nearest(c in cells where {self.of_cell(where)} to {self.anchor(where)})")
        return self.one_of(*options)

    def of_cell(self, where: Where) -> str:
        """A condition on the cell `c`."""
        who = self.anchor(where)
        return self.one_of(
            f"c.distance({who}) {self.rng.choice(('>', '==', '<='))} {self.rng.randint(1, 3)}",
            f"not c.next_to({who})",
            f"c.x {self.rng.choice(('<', '>'))} W // 2",
            f"c.in_line({who}) or c.y == {self.rng.randint(1, 4)}",
            "not agent.sees(c)",
        )

    def reachable(self, where: Where) -> str:
        """A goal: one thing, or somebody."""
        return self.spot(replace(where, searching=True)) if self.often(0.5) else self.entity(where)

    # -- values ------------------------------------------------------------------------------------------------

    def number(self, where: Where, depth: int = 2) -> str:
        """A whole number, small as a rule."""
        rng, known = self.rng, self.declared
        options: list[str | Callable[[], str]] = [str(rng.randint(0, 6)), *known.numbers]
        if where.frame is not None:
            options += [] if where.reset else [*where.frame.numbers, *where.frame.numbers]
            options += ["self.index"] if where.frame.of_group else []
            options += [] if where.reset else ["turns_in_state"]
        options += [
            lambda: f"{self.entity(where)}.{rng.choice('xy')}",
            lambda: f"{self.entity(where)}.distance({self.entity(where)})",
        ]
        for variable, thing in where.variables:
            options += [f"{variable}.index"] if thing.count else []
        if not where.reset:
            options.append("t")
        if known.ranks:
            options.append(lambda: f"{rng.choice(known.ranks)}({self.color(where)})")
        if known.several and not where.searching:
            options.append(lambda: self.counted(where))
        if not where.reset and not where.still and depth > 0 and self.often(0.5):
            options.append(
                lambda: (
                    f"prev({self.number(replace(where, still=True, heard=False, noun=False, slots=()), 0)})"
                )
            )
        if depth > 0:
            options += [
                lambda: (
                    f"{rng.choice(('min', 'max'))}({self.number(where, depth - 1)}, {self.number(where, 0)})"
                ),
                lambda: f"abs({self.number(where, depth - 1)} - {self.number(where, 0)})",
                lambda: f"({self.number(where, depth - 1)} {rng.choice('+-*')} {self.number(where, 0)})",
                lambda: f"({self.number(where, depth - 1)} {rng.choice(('//', '%'))} {rng.randint(1, 4)})",
            ]
        options += self.kept("number", where)
        if known.wide:
            options += [lambda: f"({self.wide(where)} {rng.choice(('% 3', f'// {known.edge}'))})"]
        if known.nouns_are_numbers:
            options += ["noun", "noun"] if where.noun else []
            options += ["agent.noun"] if not where.reset else []
        options += self.in_slots(where, "num")
        return self.chosen(lambda: self.one_of(*options), where)

    def wide(self, where: Where) -> str:
        """A number that may be large."""
        rng, known = self.rng, self.declared
        low, high = known.vault
        options: list[str | Callable[[], str]] = [str(known.edge), *known.wide, *known.wide]
        if not where.reset and known.vault != (0, 0):
            options += [f"vault({rng.randint(low, high)})", "vault(code)"]
        if where.reset:
            options = [str(known.edge), *(name for name in known.wide if name != "hoard")]
        return self.one_of(*options)

    def counted(self, where: Where) -> str:
        """How many of a group."""
        thing = self.rng.choice(self.declared.several)
        return f"count(o in {thing.name} where {self.plain_condition(self.bound('o', thing, where))})"

    def color(self, where: Where) -> str:
        """A colour."""
        options: list[str | Callable[[], str]] = [self.rng.choice(COLORS), *self.declared.colors]
        if where.frame is not None and not where.reset:
            options += where.frame.colors
        options += self.kept("color", where)
        options += [lambda: f"{self.entity(where)}.color"] * 3
        options += self.in_slots(where, "paint")
        return self.chosen(lambda: self.one_of(*options), where)

    def in_slots(self, where: Where, *slots: str) -> list[str]:
        """What was heard or said in some slots."""
        heard = [slot for slot in slots if slot in where.slots]
        said = [f"agent.{slot}" for slot in slots if slot in self.declared.slots and not where.reset]
        return [*heard, *heard, *said]

    def direction(self, where: Where) -> str:
        """A direction."""
        return self.chosen(lambda: self.some_direction(where), where)

    def some_direction(self, where: Where) -> str:
        """A direction that is not chosen by a condition."""
        return self.one_of(
            *(where.frame.directions if where.frame else []),
            self.rng.choice(("right", "down", "left", "up")),
            lambda: f"{self.member(where)}.facing",
            lambda: f"opposite({self.member(where)}.facing)",
            lambda: f"({self.member(where)}.facing + {self.rng.choice(('left', 'right'))})",
            lambda: f"{self.member(where)}.dir_to({self.spot(where)})",
        )

    # -- conditions --------------------------------------------------------------------------------------------

    def condition(self, where: Where, depth: int = 2) -> str:
        """Something true or false, short enough for an expression."""
        while True:
            made = self.any_condition(where, depth)
            if len(made) < LONGEST:
                return made

    def any_condition(self, where: Where, depth: int) -> str:
        """Something true or false."""
        if depth > 0 and self.often(0.35):
            return self.one_of(
                lambda: f"{self.part(where, depth)} and {self.part(where, depth)}",
                lambda: f"{self.part(where, depth)} or {self.part(where, depth)}",
                lambda: f"not ({self.condition(where, depth - 1)})",
            )
        simple = [self.plain_condition] * 6
        simple += (
            [self.of_this_step, self.of_speech, self.of_this_step, self.of_frames] if not where.reset else []
        )
        simple += [self.of_rows, self.of_rows] if not where.reset else []
        simple += [self.of_looks, self.of_looks] if self.declared.looks else []
        simple += [self.of_turns, self.of_turns] if self.declared.turns and not where.reset else []
        simple += [self.quantified, self.quantified] if not where.searching else []
        simple += (
            [self.defined]
            if self.declared.truths and not (where.reset or where.searching or where.still)
            else []
        )
        if not (where.reset or where.still):
            simple.append(self.looking_back)
        return self.rng.choice(simple)(where)

    def part(self, where: Where, depth: int) -> str:
        """Part of a longer condition."""
        inner = self.condition(where, depth - 1)
        return f"({inner})" if " " in inner else inner

    def plain_condition(self, where: Where) -> str:
        """A condition on places, looks, statuses and values."""
        made = (self.relation, self.relation, self.status, self.comparison, self.of_kind)
        return self.chosen(lambda: self.rng.choice(made)(where), where)

    def of_kind(self, where: Where) -> str:
        """What sort of thing, or who, something is."""
        kinds = dict.fromkeys(["peer", *(thing.type for thing in self.declared.things)])
        return f"{self.entity(where)}.kind == {self.rng.choice([*kinds])}"

    def sought(self, where: Where) -> str:
        """What can be seen: one thing, a group, or a cell."""
        groups = [*(thing.name for thing in self.declared.several), *self.declared.groups]
        return self.one_of(*groups, *[lambda: self.spot(where)] * 2)

    def relation(self, where: Where) -> str:
        """A condition between two things, or of somebody and a place."""
        verbs = ("at", "next_to", "in_line", "unobstructed", "in_front_of", "faces", "can_reach", *SEARCHING)
        verb = self.rng.choice(verbs)
        who = self.member(where)
        others: list[str | Callable[[], str]] = [lambda: self.entity(where)] * 3
        others += [thing.name for thing in self.declared.several] + list(self.declared.groups)
        if verb == "points_at":
            npcs = [*self.declared.members, *(["self"] if where.is_npcs else [])]
            if not npcs:
                return f"agent.next_to({self.entity(where)})"
            who = self.rng.choice(npcs)
        if verb == "joint_attention":
            other = self.rng.choice(["agent", *self.declared.members])
            return f"{who}.joint_attention({other})"
        if verb == "would_see":
            return f"{who}.would_see({self.one_of(*others)}, {self.direction(where)})"
        if verb not in ("in_front_of", "eye_contact"):
            others.append(lambda: self.spot(where))
        if verb == "eye_contact":
            others = [lambda: self.member(where)]
        if verb in ("at", "next_to", "in_line", "unobstructed") and self.often(0.4):
            who = self.entity(where)
        return f"{who}.{verb}({self.one_of(*others)})"

    def status(self, where: Where) -> str:
        """What an object is like, or where it is."""
        found = self.thing(where)
        if found is None:
            return f"agent.x > {self.rng.randint(1, 4)}"
        what, thing = found
        words = STATUSES[thing.type]
        options: list[str | Callable[[], str]] = [f"{what}.{self.rng.choice(words)}"] * 2
        options += [f"{what}.gone"] if not where.reset else []
        if thing.name in self.declared.contents:
            box = self.declared.group(self.declared.contents[thing.name])
            options += [lambda: f"{what}.inside == {self.one(box, where)}"] * 3
        return self.one_of(*options)

    def comparison(self, where: Where) -> str:
        """Two values compared."""
        return self.one_of(
            lambda: (
                f"{self.number(where)} {self.rng.choice(('<', '<=', '==', '!=', '>', '>='))} {self.number(where, 0)}"
            ),
            lambda: f"{self.color(where)} {self.rng.choice(('==', '!='))} {self.entity(where)}.color",
            lambda: f"{self.member(where)}.facing == {self.direction(where)}",
            lambda: f"{self.entity(where)}.color in red | {self.rng.choice(COLORS[1:])}",
            lambda: f"{self.number(where, 0)} in {self.rng.randint(0, 3)}..{self.rng.randint(3, 7)}",
            *([lambda: f"{self.wide(where)} {self.rng.choice(('<', '==', '>='))} {self.wide(where)}"] * 2)
            if self.declared.wide
            else (),
        )

    def defined(self, where: Where) -> str:
        """What has a name of its own."""
        own = where.frame.truths if where.frame else []
        relations = [f"{name}({self.entity(where)})" for name in self.declared.relations]
        return self.rng.choice([*self.declared.truths, *own, *relations])

    def quantified(self, where: Where) -> str:
        """Of one or each of a group, or of cells."""
        known = self.declared
        options: list[str | Callable[[], str]] = []
        for thing in known.several:
            inner = self.bound("o", thing, where)
            options.append(
                lambda thing=thing, inner=inner: (
                    f"{self.rng.choice(('any', 'all'))}(o in {thing.name} where {self.condition(inner, 1)})"
                )
            )
        for group in known.groups:
            options.append(
                lambda group=group: (
                    f"any(n in {group} where n.next_to({self.anchor(where)}) or n.color == red)"
                )
            )
        if not (where.reset or where.variables):
            options.append(
                lambda: f"any(c in cells where c.next_to({self.anchor(where)}) and {self.of_cell(where)})"
            )
        return self.one_of(*options) if options else self.relation(where)

    def bearer(self, look: Look, where: Where) -> str:
        """Somebody or something that has a look, or perhaps one that has not."""
        if look.of == "cast":
            return self.rng.choice(["speaker"] * where.heard + [self.member(where)])
        return self.one(self.declared.group(look.of), where)

    def look(self, look: Look, where: Where) -> str:
        """The look of something, or in a frame one's own."""
        if look.of == "cast" and where.frame is not None and self.often(0.3):
            return look.name
        return f"{self.bearer(look, where)}.{look.name}"

    def of_turns(self, where: Where) -> str:
        """Whose turn it is."""
        number = self.rng.choice((1, 2, f"t % {self.declared.turns} + 1"))
        return f"turns({number}) == {self.rng.choice(['agent', *self.declared.members])}"

    def of_looks(self, where: Where) -> str:
        """What something looks like."""
        look = self.rng.choice(self.declared.looks)
        one, other = self.rng.choice(look.words), self.rng.choice(look.words)
        options: list[str | Callable[[], str]] = [
            lambda: f"{self.look(look, where)} == {one}",
            lambda: f"{self.look(look, where)} != {self.look(look, where)}",
            lambda: f"{self.look(look, where)} in {one} | {other}",
        ]
        if look.ordered:
            than = self.rng.choice(("<", "<=", ">", ">="))
            options += [lambda: f"{self.look(look, where)} {than} {self.look(look, where)}"]
            options += [
                lambda: f"{self.look(look, where)} {than} {one}",
                lambda: f"{one} {than} {self.look(look, where)}",
            ]
        if not (where.reset or where.still or where.variables):
            options.append(lambda: f"prev(agent.{look.name} == {one})" if look.of == "cast" else "t > 3")
        return self.one_of(*options)

    def of_this_step(self, where: Where) -> str:
        """What the agent did, and what was used."""
        acts = where.acts
        options: list[str | Callable[[], str]] = [
            f"agent.did({self.rng.choice(acts)})",
            f"agent.action in {self.rng.choice(acts)} | {self.rng.choice(acts)}",
            f"t % {self.rng.randint(2, 4)} == 0",
        ]
        found = self.thing(where)
        if found is not None:
            what = found[0]
            options += [
                f"{what}.poked",
                f"{what}.toggled",
                lambda: f"{what}.toggled_by({self.member(where)})",
            ]
        if self.declared.members:
            npc = self.rng.choice(self.declared.members)
            options += [f"{npc}.was_poked", f"{npc}.poked", f"{npc}.gone", f"{npc}.pointing"]
        options += ["poked", "was_poked", "pointing"] if where.is_npcs else []
        for thing in self.declared.carried:
            options += [
                lambda thing=thing: f"{self.member(where)}.carries({self.one(thing, where)})",
                lambda thing=thing: f"{self.member(where)}.carries({thing.name})",
                lambda: f"{self.member(where)}.empty_handed",
                lambda: f"{self.member(where)}.carried.color == {self.color(where)}",
            ]
        for memory, sequence in self.declared.memories.items():
            options.append(f"{memory} == {sequence}")
        return self.one_of(*options)

    def of_speech(self, where: Where) -> str:
        """What was said."""
        known = self.declared
        options: list[str | Callable[[], str]] = [
            "agent.spoke",
            lambda: f'agent.said("{self.utterance()}")',
            lambda: f'agent.said("{self.utterance()}")',
            lambda: f"agent.noun == {self.noun()}" if known.nouns else self.of_slot(where),
        ]
        options += [lambda: self.of_slot(where)] * (2 * len(where.slots))
        options += [f"{npc}.spoke" for npc in known.members if npc in known.follows]
        if where.frame is not None and not (where.searching or where.still):
            options += [lambda: f'heard("{self.heard()}")', "heard(any)"]
            options += [f"agent.noun == {name}" for name in where.frame.nouns]
        if where.noun:
            options += [lambda: f"noun == {self.noun()}", lambda: f"noun != {self.entity(where)}.color"]
        if known.nouns_are_numbers:
            options.append(
                lambda: f"agent.noun {self.rng.choice(('<', '==', '!=', '>='))} {self.number(where, 0)}"
            )
        if where.heard:
            options += [
                "speaker == agent",
                f"speaker.color == {self.rng.choice(COLORS)}",
                "speaker.next_to(self)",
            ]
        return self.one_of(*options)

    def of_frames(self, where: Where) -> str:
        """In which state somebody is, and what he holds or believes."""
        options: list[str | Callable[[], str]] = []
        for npc, frame in self.declared.follows.items():
            made = (
                f"X.is({self.rng.choice(frame.states)})",
                *(f"X.{n} > {self.rng.randint(0, 3)}" for n in frame.numbers),
            )
            made += tuple(
                f"X.{row.name}{'' if row.keys is None else f'({self.key(row, where)})'} {how}"
                for row in frame.rows
                for how in (f"!= X.{row.name}" if row.keys is None else "> 1",)
                if (row.holds == "number") == (row.keys is not None)
            )
            options += [self.asked_of(npc, condition) for condition in made]
        for npc, beliefs in self.declared.beliefs.items():
            for belief, sort in beliefs.items():
                condition = {
                    "truth": f"X.believes.{belief}",
                    "color": f"X.believes.{belief} == {self.rng.choice(COLORS)}",
                    "thing": f"agent.next_to(X.believes.{belief})",
                    "cell": f"agent.distance(X.believes.{belief}) < 3",
                    "number": f"X.believes.{belief} > {self.rng.randint(0, 3)}",
                }[sort]
                options.append(self.asked_of(npc, condition))
        return self.one_of(*options) if options else self.of_this_step(where)

    def asked_of(self, npc: str, condition: str) -> str:
        """A condition on somebody, X, or on any of a group of them."""
        if npc not in self.declared.groups:
            return condition.replace("X", npc)
        return f"any(n in {npc} where {condition.replace('X', 'n')})"

    def looking_back(self, where: Where) -> str:
        """How something was when the step began."""
        earlier = replace(where, still=True, heard=False, noun=False, slots=())
        return self.one_of(
            lambda: f"prev(({self.condition(earlier, 1)}))",
            lambda: f"prev({self.number(earlier, 1)}) {self.rng.choice(('<', '!='))} {self.number(where, 0)}",
            lambda: f"prev({self.color(earlier)}) != {self.color(where)}",
        )

    # -- what is said ------------------------------------------------------------------------------------------

    def of_slot(self, where: Where) -> str:
        """What was heard or said in a slot, compared."""
        slot = self.rng.choice([*self.declared.slots, *where.slots, *where.slots])
        value = slot if slot in where.slots and self.often(0.7) else f"agent.{slot}"
        is_ = self.rng.choice(("==", "!="))
        word = self.rng.choice(self.declared.slots[slot])
        return {
            "what": lambda: f'{value} {is_} "{word}"',
            "num": lambda: f"{value} {self.rng.choice(('<', '==', '!=', '>='))} {self.number(where, 0)}",
            "paint": lambda: f"{value} {is_} {self.color(where)}",
            "whom": lambda: f"{value} {is_} {self.member(replace(where, still=True))}",
            "which": lambda: f"{value} {is_} {self.thing(where)[0]}",  # type: ignore[index] - then there are things
        }[slot]()

    def filled(self, template: str, probability: float = 1) -> str:
        """A template with words in its slots, or in some of them."""
        for slot, words in self.declared.slots.items():
            if f"<{slot}>" in template and self.often(probability):
                template = template.replace(f"<{slot}>", str(self.rng.choice(words)))
        if self.declared.nouns:
            template = template.replace("<noun>", str(self.rng.choice(self.declared.nouns)))
        return template

    def noun(self) -> str:
        """A noun as it is written in an expression."""
        noun = self.rng.choice(self.declared.nouns)
        return str(noun) if isinstance(noun, int) else f'"{noun}"'

    def utterance(self) -> str:
        """Something the agent can say, or with any noun."""
        template = self.rng.choice(self.declared.templates)
        return template if self.often(0.4) else self.filled(template, 0.7)

    def heard(self) -> str:
        """Something that can be heard: of the agent or of an NPC."""
        if self.declared.says and self.often(0.35):
            return self.rng.choice(self.declared.says)
        return self.utterance()

    def heard_of_now(self) -> str:
        """As `heard`, perhaps with a value in it that has to be the one that is said."""
        template = self.rng.choice(self.declared.templates)
        if self.declared.nouns_are_colors and self.often(0.4):
            return template.replace("<noun>", f"<{self.rng.choice(('agent', *self.declared.members))}.color>")
        return self.heard()

    def words(self, where: Where) -> str:
        """A text of few possible values to say."""
        known = self.declared
        if where.frame is not None and where.frame.of_agent:
            return self.filled(self.rng.choice(known.templates))
        options: list[str | Callable[[], str]] = [*known.says, *known.says]
        options += [
            lambda: f"It is <{self.in_text(self.color, where)}>",
            lambda: f"I see <{self.in_text(self.counted, where)}>" if known.several else "I see nothing",
            lambda: f"Look <{self.in_text(self.direction, where)}>",
            lambda: f'It is <{self.in_text(self.color, where)} if {self.short_condition(where)} else "gone">',
            lambda: f'Well <"yes" if {self.short_condition(where)} else "no">',
        ]
        if where.frame is not None and not where.reset:
            options += [f"I have <{name}>" for name in where.frame.numbers]
            options += [f"<{name}>" for name, type_ in where.frame.slots.items() if type_ == "text"]
        if where.heard:
            options += ["Hello <speaker.name>"] * 2
        if where.noun:
            options += ["You said <noun>"] * 3
        options += [f"You said <{slot}>" for slot in where.slots] * 3
        if not where.reset:
            slots = [f"agent.{slot}" for slot in self.declared.slots] or ["agent.noun"]
            options += [lambda: f"Was it <{self.rng.choice(slots)}>"]
        for look in known.looks:
            options.append(lambda look=look: f"It is <{self.in_text(partial(self.look, look), where)}>")
        if known.tables:
            options += [
                lambda: f"They say <{self.rng.choice(known.tables)}({self.in_text(self.color, where)})>"
            ]
        return self.one_of(*options)

    def in_text(self, value: Callable[[Where], str], where: Where) -> str:
        """A value without the signs that end a slot of a text."""
        while True:
            made = value(where)
            if not set(made) & set("<>"):
                return made
