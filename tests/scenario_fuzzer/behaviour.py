"""Random frames and rules: what members of the cast do, and what the world does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import Any

from tests.scenario_fuzzer.declared import STATUSES, Declared, Frame, Row, Thing
from tests.scenario_fuzzer.phrases import Phrases, Where

ALWAYS_OPEN = ("face", "follow", "stay_near", "flee", "wander", "choose")
"""Activities that never end by themselves."""

LONGEST_TARGET = 200
"""Characters of a key of `set`; the language takes no longer ones."""


class Behaviour:
    """Makes frames and rules of what is declared."""

    def __init__(self, rng: Random, declared: Declared, phrases: Phrases, acts: tuple[str, ...]) -> None:
        self.rng, self.declared, self.phrases, self.acts = rng, declared, phrases, acts

    def often(self, probability: float) -> bool:
        """Whether something happens."""
        return self.rng.random() < probability

    # -- frames ------------------------------------------------------------------------------------------------

    def by_states(self, frame: Frame) -> dict[str, Any]:
        """A frame with states."""
        where = Where(frame, acts=self.acts)
        states = {name: self.state(number, frame, where) for number, name in enumerate(frame.states)}
        first = states[frame.states[0]]
        if filled := self.filled(frame.rows, where):
            first["then"] = [*first.get("then", ()), {"when": "t % 3 == 2", "set": filled}]
        return {"states": states}

    def filled(self, rows: list[Row], where: Where) -> dict[str, str]:
        """Something in each row that begins with nothing, so that it is known what it holds."""
        values = {"number": "2", "color": "green", "noun": "first(nouns)"}
        return {self.phrases.of_row(row, where): values[row.holds] for row in rows if row.empty}

    def state(self, number: int, frame: Frame, where: Where) -> dict[str, Any]:
        """One state: what comes later can be entered at once."""
        later = frame.states[number + 1 :]
        made: dict[str, Any] = {}
        if self.often(0.6):
            first = replace(where)
            made["first"] = [self.rule(first, frame.states, [], True) for _ in range(self.rng.randint(1, 2))]
        if self.often(0.85):
            made["do"] = self.activity(where)
        if self.often(0.9) or not made:
            made["then"] = [
                self.rule(where, frame.states, later, False) for _ in range(self.rng.randint(1, 3))
            ]
        return made

    def by_steps(self, frame: Frame) -> dict[str, Any]:
        """A frame with steps, of which some have names."""
        where = Where(frame, acts=self.acts)
        entries = [self.step(name, where) for name in frame.states if name != "finished"]
        if filled := self.filled(frame.rows, where):
            entries[0]["set"] = filled
        return {"steps": self.nested(entries, where, 2)}

    def nested(self, entries: list[dict[str, Any]], where: Where, depth: int) -> list[dict[str, Any]]:
        """The same entries, some of them in nested steps."""
        if depth == 0 or not self.often(0.4):
            return entries
        first = self.rng.randrange(len(entries))
        last = self.rng.randint(first, len(entries) - 1)
        made: dict[str, Any] = {"steps": self.nested(entries[first : last + 1], where, depth - 1)}
        if self.often(0.7):
            made["repeat"] = self.rng.choice((0, 1, 2, 2, 3, 4))
            bounds = self.rng.choice(((), (), ("while",), ("until",), ("while", "until")))
            made |= {key: self.phrases.condition(where) for key in bounds}
        if self.often(0.3):
            made["when"] = self.phrases.condition(where)
        return [*entries[:first], made, *entries[last + 1 :]]

    def step(self, name: str, where: Where) -> dict[str, Any]:
        """One entry."""
        made: dict[str, Any] = {"state": name}
        if self.often(0.85):
            made["do"] = self.activity(where)
        endless = str(made.get("do", "")).partition("(")[0] in (*ALWAYS_OPEN, "stay")
        if endless or self.often(0.3):
            made["for"] = self.rng.randint(0 if not endless else 1, 3)
        if self.often(0.3):
            made["until"] = self.phrases.condition(where)
        if self.often(0.2):
            made["when"] = self.phrases.condition(where)
        return made | self.effects(where, 0.4)

    def rule(self, where: Where, states: list[str], later: list[str], first: bool) -> dict[str, Any]:
        """One rule of a frame."""
        made: dict[str, Any] = {}
        if self.often(0.45):
            made["hears"], where = self.hearing(where)
            if self.often(0.2):
                made["addressed"] = self.often(0.6)
        if self.often(0.6) or not made:
            made["when"] = self.phrases.condition(where)
        if self.often(0.2):
            made["after"] = self.rng.randint(1, 4)
        if self.often(0.15):
            made["before"] = self.rng.randint(2, 9)
        if self.often(0.12):
            made["once"] = True
        if self.often(0.15):
            made["chance"] = self.rng.choice((0.25, 0.5, 0.75))
        if first and self.often(0.35):
            made["do"] = self.activity(where)
        made |= self.effects(where, 0.5)
        if self.often(0.5) or not made.keys() & {"do", "set", "cause", "say"}:
            made["goto"] = self.rng.choice(states)
            if later and self.often(0.3):
                made["goto_now"] = self.rng.choice(later)
                del made["goto"]
        return made

    def hearing(self, where: Where) -> tuple[Any, Where]:
        """What a rule hears, and what is known in it."""
        kind = self.rng.choice(("any", "noun", "text", "text", "several"))
        if self.declared.slots and kind in ("any", "noun"):
            template = self.rng.choice(self.declared.templates)
            caught = tuple(slot for slot in self.declared.slots if f"<{slot}>" in template)
            return "any" if kind == "any" else template, replace(where, heard=True, slots=caught)
        if kind == "any":
            return "any", replace(where, heard=True, noun=True)
        if kind == "noun":
            template = next((t for t in self.declared.templates if "<noun>" in t), None)
            if template is not None:
                return template, replace(where, heard=True, noun=True)
        if kind == "several":
            return [self.phrases.heard_of_now(), self.phrases.heard_of_now()], replace(where, heard=True)
        return self.phrases.heard_of_now(), replace(where, heard=True)

    def effects(self, where: Where, probability: float) -> dict[str, Any]:
        """Some of: what is set, caused and said."""
        made: dict[str, Any] = {}
        registers = self.registers(where)
        if registers and self.often(probability * 0.7):
            chosen = self.rng.sample(sorted(registers), min(len(registers), self.rng.randint(1, 2)))
            made["set"] = {name: registers[name]() for name in chosen if len(name) <= LONGEST_TARGET}
        if self.often(probability):
            made["cause"] = [self.effect(where) for _ in range(self.rng.randint(1, 3))]
        if where.frame is not None and self.often(probability):
            made["say"] = self.phrases.words(where)
            if where.is_npcs and self.often(0.2):
                made["to"] = self.phrases.member(where)
        return made

    def registers(self, where: Where) -> dict[str, Callable[[], str]]:
        """What can be set here, each with how a value for it is made."""
        found: dict[str, Callable[[], str]] = {
            name: lambda: self.phrases.number(where) for name in self.declared.registers
        }
        if self.declared.edge:
            found["hoard"] = lambda: self.large(where)
            found[f"vault({self.rng.choice(self.declared.keyed)})"] = lambda: self.large(where)
        for row in [*self.declared.rows, *(where.frame.rows if where.frame else [])]:
            if row.keys is not None and self.often(0.25):
                found |= self.of_those(row, where)
                continue
            found[self.target(row, where)] = lambda row=row: (  # type: ignore[misc]
                "none" if row.empty and self.often(0.2) else self.phrases.value_of(row, where)
            )
        for look in self.declared.looks:
            target = self.phrases.look(look, where)
            if target.startswith("(") or self.often(0.15):
                target = f"{look.of}.{look.name}"  # of the whole group
            found[target] = lambda look=look: (  # type: ignore[misc]
                self.rng.choice(look.words) if self.often(0.6) else self.phrases.look(look, where)
            )
        if where.frame is not None:
            frame = where.frame
            found |= {name: lambda: self.phrases.number(where) for name in frame.numbers}
            found |= {name: lambda: self.phrases.color(where) for name in frame.colors}
            found |= {
                name: lambda group=group: self.phrases.one(self.declared.group(group), where)  # type: ignore[misc]
                for name, group in frame.things.items()
                if name not in frame.slots
            }
        return found

    def large(self, where: Where) -> str:
        """A value that a register may have no room for, unless that is cut."""
        rng, wide = self.rng, self.phrases.wide
        step = rng.choice((1, 3, abs(self.declared.edge)))
        grown = rng.choice(
            (f"hoard + {step}", f"hoard - {step}", f"{wide(where)} - hoard", f"{wide(where)} * 2")
        )
        most = abs(self.declared.edge)
        return f"max(min({grown}, {most}), {-most})"

    def target(self, row: Row, where: Where) -> str:
        """Which of a row is set, or all of it."""
        if row.keys is not None and self.often(0.15):
            return f"{row.name}({row.keys})"
        return self.phrases.of_row(row, where)

    def of_those(self, row: Row, where: Where) -> dict[str, Callable[[], str]]:
        """Some of a row, with a value that may be about each."""
        keys, number = str(row.keys), self.rng.randint(1, 3)
        conditions = {
            "colors": "g != red",
            "nouns": "g != first(nouns)",
            "1..4": f"g % 2 == t % 2 or g < {number}",
        }
        thing = next((thing for thing in self.declared.things if thing.name == keys), None)
        inner = where if thing is None else self.phrases.bound("g", thing, where)
        condition = conditions.get(keys, f"g.distance({self.phrases.anchor(where)}) > {number}")
        if thing is not None:
            condition = self.phrases.plain_condition(inner)
        own = [f"{row.name}(g) + {number}"] if row.holds == "number" else [f"{row.name}(g)"]
        own += ["g"] if (keys, row.holds) in (("colors", "color"), ("nouns", "noun")) else []
        value = self.rng.choice(own) if self.often(0.5) else self.phrases.value_of(row, where)
        return {f"{row.name}(those(g in {keys} where {condition}))": lambda: value}

    # -- activities --------------------------------------------------------------------------------------------

    def _near_or_away(self, where: Where) -> str:
        """Up to some distance of something; what somebody goes away from is not drawn anew in each turn."""
        of, far = self.phrases.entity(where), self.rng.randint(1, 4)
        verb = "stay_near" if "pick(" in of else self.rng.choice(("stay_near", "go_away_from"))
        return f"{verb}({of}, {far})"

    def activity(self, where: Where) -> str:
        """What to do in a turn."""
        rng, phrases = self.rng, self.phrases
        plain = ["left", "right", "forward", "forward", "toggle", "wander", "stay"]
        points = where.is_npcs
        plain += ["stop_pointing"] if points else []
        options: list[Callable[[], str]] = [
            lambda: rng.choice(plain),
            lambda: rng.choice(
                ("choose(left | 2 * forward | stay)", "choose(toggle | forward)", "turn(left)")
            ),
            lambda: self._near_or_away(where),
            lambda: f"turn_to({phrases.direction(where)})",
            lambda: f"{rng.choice(('face', *(['point_at'] if points else [])))}({phrases.spot(where)})",
            lambda: f"go_to({phrases.reachable(where)})",
            lambda: f"go_next_to({phrases.reachable(where)})",
            lambda: f"search({phrases.sought(where)})",
            lambda: (
                f"{rng.choice(('follow', 'flee', *(['point'] if points else [])))}({phrases.entity(where)})"
            ),
        ]
        usable = phrases.thing(where, "door", "switch", "lever", "box", "apple")
        if usable is not None:
            options += [lambda: f"use({usable[0]})"] * 3
            if usable[1].type == "door":
                options.append(lambda: f"enter({usable[0]})")
        pushable = phrases.thing(where, "marble", "generator")
        if pushable is not None:
            options += [lambda: f"push({pushable[0]}, {phrases.direction(where)})"] * 3
        pushed = [
            name
            for name in self.declared.pushed
            if name not in self.declared.groups and self.declared.follows.get(name) is not where.frame
        ]
        if pushed:
            options.append(lambda: f"push({rng.choice(pushed)}, {phrases.direction(where)})")
        if self.declared.carried:
            held = phrases.one(rng.choice(self.declared.carried), where)
            options += [lambda: rng.choice(("pickup", "drop", "choose(pickup | drop | forward)"))] * 2
            options += [lambda: f"fetch({held})"] * 2
            options += [lambda: f"give({held}, {phrases.member(where)})"]
            options += [lambda: f"bring({held}, {phrases.member(where)})"] * 2
            options += [lambda: f"bring({held}, {phrases.entity(where)}.cell)"]
            floors = [thing for thing in self.declared.single if thing.type == "floor"]
            options += [lambda: f"bring({held}, {floors[0].name})"] if floors else []
        if self.declared.sequences:
            options.append(lambda: f"perform({rng.choice(self.declared.sequences)})")
        return rng.choice(options)()

    # -- effects -----------------------------------------------------------------------------------------------

    def effect(self, where: Where) -> str:
        """One effect on something or somebody."""
        if self.often(0.25):
            return self.effect_on_somebody(where)
        thing = self.rng.choice(self.declared.things) if self.declared.things else None
        if thing is None:
            return self.effect_on_somebody(where)
        if self.often(0.05):
            return "objects.reset"
        if thing.count is not None and self.often(0.35):
            return self.effect_on_those(thing, where)
        what = thing.name if self.often(0.25) else self.phrases.one(thing, where)
        return f"{what}.{self.rng.choice(self.verbs(thing, where))()}"

    def effect_on_those(self, thing: Thing, where: Where) -> str:
        """An effect on some of a group; what it takes may be about each of them."""
        inner = self.phrases.bound("g", thing, where)
        condition = self.phrases.plain_condition(inner)
        verb = self.rng.choice(self.verbs(thing, inner if self.often(0.5) else where))()
        return f"those(g in {thing.name} where {condition}).{verb}"

    def verbs(self, thing: Thing, where: Where) -> list[Callable[[], str]]:
        """What can be done to a thing."""
        verbs = ["reset", "reset", "vanish"]
        if thing.type == "door":
            verbs += ["open", "close", "lock", "unlock"]
        if thing.type == "remote_door":
            verbs += ["open", "close"]
        if thing.type == "box":
            verbs += ["reveal", "lock", "unlock"]
        found: list[Callable[[], str]] = [lambda: self.rng.choice(verbs)] * 2
        found += [lambda: f"become({self.rng.choice(STATUSES[thing.type])})"] * 3
        found.append(lambda: f"put({self.phrases.spot(where)})")
        if thing in self.declared.carried:
            found += [lambda: f"move_into({self.phrases.member(where)})"] * 2
        if thing.name in self.declared.contents:
            box = self.declared.group(self.declared.contents[thing.name])
            found += [lambda: f"move_into({self.phrases.one(box, where)})"] * 4
        return found

    def effect_on_somebody(self, where: Where) -> str:
        """An effect on the agent or an NPC."""
        who = self.rng.choice([*self.declared.members, *(["self"] * 2 if where.is_npcs else []), "agent"])
        if who == "agent" or self.often(0.5):
            return f"{who}.put({self.phrases.spot(where)})"
        return f"{who}.{self.rng.choice(('reset', 'reset', 'vanish'))}"

    # -- the world ---------------------------------------------------------------------------------------------

    def world_rule(self) -> dict[str, Any]:
        """A rule of the world."""
        where = Where(acts=self.acts)
        made: dict[str, Any] = {"when": self.phrases.condition(where)}
        if self.often(0.25):
            made["once"] = True
        if self.often(0.2):
            made["chance"] = 0.5
        made |= self.effects(where, 0.6)
        if self.often(0.3) or not made.keys() & {"set", "cause"}:
            made["reward"] = self.rng.randint(-5, 9)
        return made
