"""The writer of random scenarios: what exists first, then who is there, then what they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import Any

import yaml

from tests.scenario_fuzzer.behaviour import Behaviour
from tests.scenario_fuzzer.declared import STATUSES, Declared, Frame, Look, Row, Thing
from tests.scenario_fuzzer.furnish import furnish
from tests.scenario_fuzzer.phrases import COLORS, Phrases, Where
from tests.scenario_fuzzer.seats import entries, give_seats

NOUNS: tuple[tuple[str | int, ...], ...] = (
    (1, 2, 3, 4),
    COLORS,
    ("sesame", "the exit", "red", "3"),
    ("toy", "you", "ana", "bel"),
)
SLOTTED = (
    "Give <what> to <whom>",
    "Take <num>",
    "Paint it <paint>",
    "Find <which>",
    "<num> times <what>",
    "<whom> and <which>",
)
TEMPLATES = ("Say <noun>", "Where is <noun>", "It is <noun>", "Give me <noun>", "Look <noun>")
SAYINGS = ("Good day", "Look at me!", "Stop it.")
"""What some NPC says in every scenario that has a frame."""
WORDS = ("ana", "bel", "cor", "dol", "ers", "fit")
EDGES = (*(1 << n for n in (7, 8, 15, 16, 19, 20, 24)), 1_000_000_000)
"""Where a number might no longer fit; the last is the greatest that is kept."""
LOOKS = {
    "size": ("small", "large"),
    "pattern": ("plain_one", "striped", "spotted"),
    "mood": ("calm", "angry", "sad"),
}
GROUPED = ("door", "box", "switch", "ball", "marble", "generator", "apple", "lever")
CARRIED = ("ball", "apple", "box", "marble", "generator", "floor", "switch")
SINGLE = (*GROUPED, "remote_door", "platform", "fence", "floor", "wall", "lava")


def write(seed: int) -> str:
    """The text of the scenario of this seed."""
    author = _Author(Random(seed))
    return yaml.safe_dump(author.scenario(f"random_{seed}"), sort_keys=False, width=110, allow_unicode=True)


def write_asking(seed: int) -> str:
    """The same scenario with probes."""
    author = _Author(Random(seed))
    made = author.scenario(f"random_{seed}")
    made["probes"] = {f"probe_{number}": author.probe() for number in range(4)}
    return yaml.safe_dump(made, sort_keys=False, width=110, allow_unicode=True)


def write_seated(seed: int) -> str:
    """The same scenario with seats for some of its cast."""
    made = give_seats(_Author(Random(seed)).scenario(f"random_{seed}"), Random(f"seats of {seed}"))
    return yaml.safe_dump(made, sort_keys=False, width=110, allow_unicode=True)


def write_furnished(seed: int) -> dict[str, str]:
    """The same scenario with more keys of the language, and files of its members: name of a file -> text."""
    made = _Author(Random(seed)).scenario(f"random_{seed}")
    files = furnish(made, Random(f"furniture of {seed}"))
    return {
        name or f"random_{seed}.yaml": yaml.safe_dump(file, sort_keys=False, width=110, allow_unicode=True)
        for name, file in files.items()
    }


class _Author:
    """Makes one scenario; all choices are drawn from `rng`."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng
        self.declared = Declared()
        self.phrases = Phrases(rng, self.declared)
        self.taken: set[str] = set()  # places with room for one, where somebody is put already

    def often(self, probability: float) -> bool:
        """Whether something happens."""
        return self.rng.random() < probability

    def scenario(self, name: str) -> dict[str, Any]:
        """The whole file, in an order in which what is spoken of is known."""
        self.acts, self.slotted = self.actions(), self.often(0.4)
        if self.often(0.4):
            self.declared.edge = self.rng.choice(EDGES) * self.rng.choice((1, 1, -1))
        behaviour = Behaviour(self.rng, self.declared, self.phrases, self.acts)
        made: dict[str, Any] = {
            "scenario": name,
            "horizon": self.rng.randint(12, 26),
            "earshot": self.rng.choice(("next_to", "room", "room", 2, 4)),
            "actions": list(self.acts),
            "grammar": {} if self.slotted else self.grammar(),
            "room": self.room(),
        }
        objects = self.objects()
        frames = self.plan_cast()
        made["grammar"] = made["grammar"] or self.grammar_with_slots()
        looks = self.looks()
        tables, lets, state = self.tables(), self.lets(), self.state()
        for beliefs in self.declared.beliefs.values() if self.single_numbers() else ():
            beliefs["amount"] = "number"
        made |= {"objects": objects} if objects else {}
        made |= {"looks": looks} if looks else {}
        made |= {"tables": tables} if tables else {}
        made |= {"let": lets} if lets else {}
        made |= {"state": state} if state else {}
        defines = self.definitions()
        made |= {"define": defines} if defines else {}
        self.finish_objects(objects)
        memory = self.memory(lets)
        made |= {"memory": memory} if memory else {}
        played = {frame.name: self.frame(frame, behaviour) for frame in frames}
        if self.often(0.2):
            made["overheard"] = False
        if not ("to" in made["grammar"] or any("to" in entry for entry in entries(played))):
            for entry in entries(played):
                entry.pop("addressed", None)
        say_somewhere([played[frame.name] for frame in frames if not frame.of_agent], SAYINGS)
        tell_numbers(name, made["grammar"], [played[frame.name] for frame in frames if not frame.of_agent])
        made |= {"frames": played} if played else {}
        made["cast"] = self.cast()
        if self.often(0.25):
            names = [*objects, *self.declared.members, "agent"]
            made["order"] = self.rng.sample(names, self.rng.randint(1, len(names)))
        if self.often(0.15):
            made["require"] = ["agent.distance(ann) > 1"]
        if self.often(0.6):
            made["rules"] = [behaviour.world_rule() for _ in range(self.rng.randint(1, 3))]
        if filled := behaviour.filled(self.declared.rows, Where(acts=self.acts)):
            made["rules"] = [*made.get("rules", ()), {"when": "t % 4 == 1", "set": filled}]
        made["outcome"] = self.outcome()
        if self.often(0.3):
            made["reward"] = {"success": "linear(0.5)", "each_step": self.rng.choice((-0.001, 0.002))}
        made["observe"] = self.observe()
        shared = [
            name for name, value in lets.items() if not isinstance(value, str) or value.startswith("pick(")
        ]
        if shared and self.often(0.2):
            same = self.rng.sample(shared, self.rng.randint(1, len(shared)))
            made["session"] = {"episodes": self.rng.randint(2, 3), "same": same}
        return made

    # -- what there is -----------------------------------------------------------------------------------------

    def actions(self) -> tuple[str, ...]:
        """The agent's body actions."""
        hands = ["pickup", "drop"] if self.often(0.4) else []
        return ("left", "right", "forward", *hands, "toggle", *(["done"] if self.often(0.7) else []))

    def grammar(self) -> dict[str, Any]:
        """What can be said; some of it NPCs say as well."""
        self.declared.nouns = list(self.rng.choice(NOUNS))
        self.declared.templates = self.rng.sample(TEMPLATES, self.rng.randint(1, 2))
        said = [
            t.replace("<noun>", str(self.rng.choice(self.declared.nouns))) for t in self.declared.templates
        ]
        self.declared.templates += ["Hello"] if self.often(0.3) else []
        self.declared.says = [*SAYINGS, *said]
        return {"templates": list(self.declared.templates), "nouns": list(self.declared.nouns)}

    def grammar_with_slots(self) -> dict[str, Any]:
        """Templates with several slots: words, numbers, colours, things and members of the cast."""
        rng, known = self.rng, self.declared
        people = [*known.members, *known.groups, *(["agent"] if self.often(0.3) else [])]
        names: dict[str, list[str | int]] = {name: [name.capitalize()] for name in people}
        names |= {
            name: [f"{name.capitalize()} {k + 1}" for k in range(count)]
            for name, count in known.groups.items()
        }
        written: dict[str, Any] = {
            "what": ["the ball", "sesame", *(["red"] if self.often(0.3) else [])],
            "whom": rng.sample(people, rng.randint(1, len(people))),
            "num": "1..3",
            "paint": rng.choice(("colors", ["red", "blue"])),
            "which": [thing.name for thing in rng.sample(known.things, min(2, len(known.things)))],
        }
        words = dict(written)
        words["num"] = [1, 2, 3]
        words["paint"] = list(COLORS) if written["paint"] == "colors" else written["paint"]
        words["whom"] = [word for name in written["whom"] for word in names[name]]
        words["which"] = [
            f"{thing.name.replace('_', ' ')} {k + 1}" if thing.count else thing.name.replace("_", " ")
            for name in written["which"]
            for thing in [known.group(name)]
            for k in range(thing.count or 1)
        ]
        sayable = [t for t in SLOTTED if known.things or "<which>" not in t]
        known.templates = [*rng.sample(sayable, rng.randint(1, 3)), *(["Hello"] if self.often(0.3) else [])]
        known.slots = {slot: words[slot] for slot in words if any(f"<{slot}>" in t for t in known.templates)}
        if not known.slots:
            known.templates, known.slots = ["Take <num>"], {"num": words["num"]}
        known.says = (
            [*known.says, *SAYINGS, *(self.phrases.filled(t) for t in known.templates)]
            if known.follows.keys() - {"agent"}
            else []
        )
        made = {"templates": list(known.templates), "slots": {slot: written[slot] for slot in known.slots}}
        return made | ({"to": "<whom>"} if "whom" in known.slots and self.often(0.5) else {})

    def room(self) -> dict[str, Any]:
        """Its size, what is built, whether things cast shadows."""
        made: dict[str, Any] = {"size": self.rng.choice(("6..7", 7, "7..8", 8))}
        if self.often(0.3):
            kind = self.rng.choice(("wall", "fence", "lava"))
            place = self.rng.choice(("rect(3, 3, 3, 4)", "row(H // 2) where here.x > 3", "column(2)"))
            where = f" where here.x % {self.rng.randint(2, 3)} == 0 and not here.y == H // 2"
            made["build"] = [{kind: place.partition(" where ")[0] + where * self.often(0.4)}]
        if self.often(0.2):
            made["occlusion"] = True
        return made

    def objects(self) -> dict[str, dict[str, Any]]:
        """Objects and groups of them, where they are and how they begin."""
        made: dict[str, dict[str, Any]] = {}
        for number in range(self.rng.randint(1, 4)):
            group = self.often(0.45)
            type_ = self.rng.choice(GROUPED if group else SINGLE)
            thing = Thing(f"{type_}_{'abcdefgh'[number]}", type_, self.rng.randint(2, 3) if group else None)
            self.declared.things.append(thing)
            made[thing.name] = self.new_object(thing)
        self.link(made)
        return made

    def new_object(self, thing: Thing) -> dict[str, Any]:
        """One of them, without what speaks of others."""
        made: dict[str, Any] = {"type": thing.type}
        if thing.count is not None:
            made["count"] = thing.count
        in_wall = thing.type in ("door", "remote_door") or (
            thing.type in ("switch", "lever") and self.often(0.4)
        )
        made["place"] = self.place(thing, in_wall)
        if self.often(0.6):
            several = ("distinct", "random") if thing.count else ("random",)
            made["color"] = self.rng.choice((*several, *COLORS))
        if thing.type in ("door", "box") and self.often(0.3):
            made["state"] = "locked"
        if not in_wall and self.often(0.2):
            made["overlap"] = True
        if thing.type == "switch" and self.often(0.2):
            made["one_way"] = True
        if thing.type in ("switch", "box", "door") and self.often(0.15):
            made["dark"] = True
        if thing.count and thing.type in ("switch", "box", "lever", "generator") and self.often(0.35):
            made["exclusive"] = True
        if thing.type in CARRIED and "pickup" in self.acts and self.often(0.8):
            made["carryable"] = True
            self.declared.carried.append(thing)
        if thing.type == "lever" and self.often(0.6):
            made["timer"] = self.rng.randint(1, 5)
        return made

    def place(self, thing: Thing, in_wall: bool) -> str:
        """Where it is drawn."""
        if in_wall:
            return "each_wall(2)" if thing.count else f"wall({self.rng.choice(('top', 'left', 'right'))})"
        return self.rng.choice(
            (
                "anywhere",
                "anywhere",
                "left_half",
                "right_half",
                "anywhere where here.x > 1",
                "rect(2, 2, 4, 4)",
                "column(2) | row(3)",
            )
        )

    def link(self, made: dict[str, dict[str, Any]]) -> None:
        """What unlocks, opens, holds and pushes what."""
        known = self.declared.things
        switches = [thing for thing in known if thing.type in ("switch", "lever", "generator")]
        for switch in switches:
            locked = [thing for thing in known if thing.type in ("door", "box") and fits(switch, thing)]
            opened = [thing for thing in known if thing.type == "remote_door" and fits(switch, thing)]
            if locked and self.often(0.5):
                made[switch.name]["unlocks"] = self.rng.choice(locked).name
            if opened and self.often(0.8):
                made[switch.name]["opens"] = self.rng.choice(opened).name
        boxes = [thing for thing in known if thing.type == "box"]
        for thing in known:
            if thing.type in ("apple", "ball", "marble") and boxes and self.often(0.7):
                box = self.rng.choice(boxes)
                self.declared.contents[thing.name] = box.name
                made[thing.name]["inside"] = f"pick({box.name})" if box.count else box.name
                del made[thing.name]["place"]
        in_hands = [
            thing for thing in self.declared.carried if thing.count is None and "place" in made[thing.name]
        ]
        if in_hands and self.often(0.3):
            held = made[self.rng.choice(in_hands).name]
            held["inside"] = self.rng.choice(("agent", "ann"))
            del held["place"]
        marbles = [thing for thing in known if thing.type == "marble"]
        for thing in known:
            if thing.type == "generator" and marbles and self.often(0.5):
                made[thing.name]["pushed_by"] = "marble"

    def finish_objects(self, made: dict[str, dict[str, Any]]) -> None:
        """Computed statuses, which may speak of anything."""
        for thing in self.declared.things:
            where = Where(variables=(("it", thing),), still=True, searching=True, acts=self.acts)
            linked = any(thing.name in (other.get("unlocks"), other.get("opens")) for other in made.values())
            on = {"ball": "tagged", "door": "locked"}.get(thing.type)
            if on is None or linked or not self.often(0.35):
                continue
            condition = self.phrases.plain_condition(where)
            others = [other.name for other in self.declared.things if other.type in ("ball", "door")]
            circular = (*others, *(f"it.{status}" for status in STATUSES[thing.type]))
            if not any(name in condition for name in circular):
                made[thing.name][on] = condition

    def tables(self) -> dict[str, Any]:
        """Words and numbers for colours."""
        if not self.often(0.35):
            return {}
        self.declared.tables, self.declared.ranks = ["words", "other"], ["rank"]
        return {
            "words": dict(zip(COLORS, self.rng.sample(WORDS, len(WORDS)), strict=True)),
            "other": "permuted(words)",
            "rank": {color: self.rng.randint(0, 5) for color in COLORS},
        } | self._turns()

    def _turns(self) -> dict[str, str]:
        """Members of the cast in an order that is drawn."""
        several = ["agent", *self.declared.members]
        if len(several) < 2:
            return {}
        self.declared.turns = len(several)
        return {"turns": f"permuted({' | '.join(several)})"}

    def lets(self) -> dict[str, Any]:
        """What is drawn once."""
        made: dict[str, Any] = {}
        where = Where(reset=True, still=True)
        if self.often(0.5):
            made["limit"] = "pick(1..4)"
            self.declared.numbers.append("limit")
        if self.often(0.5):
            made["tint"] = self.rng.choice(("pick(colors)", "pick(red | 2 * blue)"))
            self.declared.colors.append("tint")
        if self.declared.edge:
            low, high = self.around_the_edge()
            made["code"] = self.rng.choice((f"pick({low}..{high})", f"pick({low} | {high})"))
            self.declared.wide.append("code")
            self.declared.keyed.append("code")
        for thing in self.declared.several:
            if self.often(0.6):
                name = f"the_{thing.name}"
                nearest = f"nearest(o in {thing.name} to agent)"
                made[name] = nearest if self.often(0.3) else f"pick({thing.name})"
                self.declared.lets[name] = thing.name
        if self.often(0.4):
            made["spot"] = f"pick(c in cells where {self.phrases.of_cell(where)})"
            self.declared.cells.append("spot")
        if self.often(0.3):
            made["dance"] = {"sequence": self.rng.randint(1, 3), "moves": ["left", "right", "forward"]}
            if self.often(0.6):
                made["dance"]["utterance"] = {"chance": 0.5}
            self.declared.sequences.append("dance")
        return made

    def looks(self) -> dict[str, Any]:
        """What things and members of the cast look like."""
        made: dict[str, Any] = {}
        several = [thing.name for thing in self.declared.several]
        for name, words in LOOKS.items():
            if self.often(0.75):
                continue
            look = Look(name, self.rng.choice([*several, "cast", "cast"]), words, self.often(0.5))
            self.declared.looks.append(look)
            made[name] = {"for": look.of, "words": list(words)}
            made[name] |= {"ordered": True} if look.ordered else {}
            if self.often(0.5):
                drawn = f"pick({words[0]} | 2 * {words[1]})"
                starts = ("random", words[0], drawn, f"{words[1]} if W > 6 else {words[0]}")
                made[name]["start"] = self.rng.choice(starts)
            elif look.of != "cast":
                count = self.declared.group(look.of).count or 1
                made[name]["start"] = [self.rng.choice((*words, "random")) for _ in range(count)]
        return made

    def state(self) -> dict[str, Any]:
        """Registers of the world."""
        made: dict[str, Any] = {}
        for name in self.rng.sample(("price", "round"), self.rng.randint(0, 2)):
            made[name] = {
                "start": self.rng.choice((0, 1, "pick(0..2)")),
                "range": f"0..{self.rng.randint(3, 7)}",
            }
            self.declared.numbers.append(name)
            self.declared.registers.append(name)
        self.declared.rows = self.rows("score", "news")
        if self.declared.edge:
            low, high = self.around_the_edge()
            made["hoard"] = {"start": self.rng.choice((0, low, high, f"pick({low} | 0)"))}
            if self.often(0.5):
                made["hoard"]["range"] = f"{min(low, 0)}..{max(high, 0)}"
                self.declared.keyed.append("hoard")
            made["vault"] = {"start": 0, "for": f"{low}..{high}", "range": f"{min(low, -3)}..{max(high, 3)}"}
            self.declared.wide.append("hoard")
            self.declared.vault = (low, high)
        return made | self.starts(self.declared.rows)

    def around_the_edge(self) -> tuple[int, int]:
        """Numbers from just below to just above the edge, which are kept."""
        most = EDGES[-1]
        return max(-most, self.declared.edge - 2), min(most, self.declared.edge + 1)

    def rows(self, kept: str, single: str) -> list[Row]:
        """Registers for each of a group, and single ones that begin with nothing."""
        nouns = [] if self.slotted else ["noun"]
        groups = ["colors", *(["nouns"] if nouns else []), "cast", "1..4"]
        groups += [thing.name for thing in self.declared.several]
        groups += ["crowd"] if "crowd" in self.declared.groups else []
        made = []
        for number in range(self.rng.choice((0, 0, 1, 2))):
            holds = self.rng.choice(("number", "color", *nouns))
            made.append(Row(f"{kept}_{number}", self.rng.choice(groups), holds, self.often(0.5)))
        if self.often(0.3):
            made.append(Row(single, None, self.rng.choice(("number", "color", *nouns)), True))
        return made

    def starts(self, rows: list[Row]) -> dict[str, Any]:
        """How they are declared."""
        made: dict[str, Any] = {}
        for row in rows:
            if row.empty:
                start = "none"
            elif row.holds == "number":
                start = self.rng.choice(
                    ("2", "it.index", "pick(0..2)") if row.keys == "crowd" else ("1", "pick(0..2)")
                )
            elif row.holds == "color":
                start = self.rng.choice(
                    ("it", "pick(colors)") if row.keys == "colors" else ("red", "pick(colors)")
                )
            else:
                start = "first(k in nouns where k == k)" if row.keys == "nouns" else "pick(nouns)"
            made[row.name] = {"start": start}
            made[row.name] |= {"for": row.keys} if row.keys else {}
            ranged = row.holds == "number" and (row.keys is not None or self.often(0.5))
            made[row.name] |= {"range": f"0..{self.rng.randint(3, 6)}"} if ranged else {}
        return made

    def definitions(self) -> dict[str, str]:
        """Conditions with names, one of them with an argument."""
        if not self.often(0.4):
            return {}
        where = Where(acts=self.acts)
        found = {
            "odd_one": self.phrases.condition(replace(where, still=True), 1),
            "near_by(x)": "agent.distance(x) < 3",
        }
        self.declared.truths, self.declared.relations = ["odd_one"], ["near_by"]
        return found

    def memory(self, lets: dict[str, Any]) -> dict[str, Any]:
        """What the agent did last."""
        if not self.declared.sequences or not self.often(0.7):
            return {}
        self.declared.memories["attempt"] = "dance"
        made: dict[str, Any] = {"last": lets["dance"]["sequence"], "of": "agent.acts"}
        if self.often(0.5):
            made["while"] = self.phrases.plain_condition(Where(still=True))
        return {"attempt": made}

    # -- who is there ------------------------------------------------------------------------------------------

    def plan_cast(self) -> list[Frame]:
        """Names of NPCs and of their frames, so that everything can speak of them."""
        frames = []
        for number in range(self.rng.randint(1, 3)):
            name = ("ann", "bob", "crowd")[number]
            if name == "crowd":
                self.declared.groups[name] = self.rng.randint(2, 3)
            else:
                self.declared.members.append(name)
            if self.often(0.85):
                frame = self.new_frame(f"frame_{number}", name == "crowd")
                self.declared.follows[name] = frame
                frames.append(frame)
            if self.often(0.35):
                self.declared.beliefs[name] = self.sorts_of_beliefs()
        if not frames:
            self.declared.says = []
        if self.often(0.15):
            frames.append(self.new_frame("frame_9", False))
            frames[-1].of_agent = True
            self.declared.follows["agent"] = frames[-1]
        everybody = (*self.declared.members, *self.declared.groups, "agent")
        self.declared.pushed = [name for name in everybody if self.often(0.2)]
        return frames

    def new_frame(self, name: str, of_group: bool) -> Frame:
        """A frame without its content."""
        in_steps = self.often(0.3)
        states = [
            f"{part}_{name[-1]}" for part in ("start", "middle", "end", "last")[: self.rng.randint(2, 4)]
        ]
        frame = Frame(name, [*states, "finished"] if in_steps else states, of_group=of_group)
        if self.often(0.6):
            frame.numbers.append("count_" + name[-1])
        if self.often(0.3):
            frame.colors.append("shade_" + name[-1])
        for thing in self.declared.several:
            if self.often(0.3):
                frame.things["thing_" + name[-1]] = thing.name
        if self.often(0.4):
            frame.slots["greeting"] = "text"
        for name, type_, known in (
            ("way", "direction", frame.directions),
            ("goal", "cell", frame.cells),
            ("wish", "noun", frame.nouns),
            ("ready", "bool", frame.truths),
        ):
            if self.often(0.15) and not (type_ == "noun" and self.slotted):
                frame.slots[f"{name}_{frame.name[-1]}"] = type_
                known.append(f"{name}_{frame.name[-1]}")
        frame.rows = self.rows(f"note_{name[-1]}", f"last_{name[-1]}")
        return frame

    def sorts_of_beliefs(self) -> dict[str, str]:
        """Names of beliefs, each with what it is."""
        sorts = {"near": "truth", "shade": "color", "place": "cell"}
        if self.declared.contents:
            sorts["lies"] = "thing"
        chosen = self.rng.sample(sorted(sorts), self.rng.randint(1, 2))
        return {name: sorts[name] for name in chosen}

    def single_numbers(self) -> list[str]:
        """Registers of the world that begin with nothing and then hold a number."""
        return [row.name for row in self.declared.rows if row.keys is None and row.holds == "number"]

    def frame(self, frame: Frame, behaviour: Behaviour) -> dict[str, Any]:
        """What a frame holds and does."""
        made: dict[str, Any] = {}
        if frame.slots:
            made["slots"] = dict(frame.slots)
        lets: dict[str, Any] = {
            name: {"start": self.rng.choice((0, 2, "pick(0..2)")), "range": f"0..{self.rng.randint(3, 6)}"}
            for name in frame.numbers
        }
        lets |= dict.fromkeys(frame.colors, "pick(colors)")
        lets |= {name: f"pick({group})" for name, group in frame.things.items()}
        lets |= self.starts(frame.rows)
        if lets:
            made["let"] = lets
        return made | (
            behaviour.by_steps(frame) if "finished" in frame.states else behaviour.by_states(frame)
        )

    def cast(self) -> dict[str, Any]:
        """Everybody."""
        made: dict[str, Any] = {}
        for name in (*self.declared.members, *self.declared.groups):
            member: dict[str, Any] = {}
            if name in self.declared.groups:
                member["count"] = self.declared.groups[name]
            member |= self.look(alone=name not in self.declared.groups)
            frame = self.declared.follows.get(name)
            if frame is not None:
                member["frame"] = frame.name
                if frame.slots:
                    member["with"] = {slot: self.filling(type_) for slot, type_ in frame.slots.items()}
            if name in self.declared.beliefs:
                member["beliefs"] = {
                    key: self.belief(sort) for key, sort in self.declared.beliefs[name].items()
                }
            self.refuse(member)
            made[name] = member
        made["agent"] = {"place": "anywhere"}
        self.refuse(made["agent"])
        if "agent" in self.declared.follows:
            frame = self.declared.follows["agent"]
            made["agent"]["frame"] = frame.name
            if frame.slots:
                made["agent"]["with"] = {slot: self.filling(type_) for slot, type_ in frame.slots.items()}
        if self.often(0.3):
            made["agent"]["facing"] = self.rng.choice(("up", "random", "left"))
        for name in self.declared.pushed:
            made[name]["pushed_by"] = "anybody"
        return made

    def refuse(self, member: dict[str, Any]) -> None:
        """Whether somebody takes what he is given."""
        if self.declared.carried and self.often(0.3):
            member["accepts"] = self.phrases.plain_condition(Where(still=True))

    def filling(self, type_: str) -> str:
        """What fills a slot."""
        once, always = Where(reset=True), Where(acts=self.acts, still=True)
        fillings: dict[str, Callable[[], str]] = {
            "text": lambda: self.rng.choice(
                (*self.declared.says, f"I like <{self.phrases.in_text(self.phrases.color, once)}>")
            ),
            "direction": lambda: self.phrases.direction(once),
            "cell": lambda: self.rng.choice(("agent.cell", "ann.cell", *self.declared.cells)),
            "noun": lambda: str(self.rng.choice(self.declared.nouns)),
            "bool": lambda: self.phrases.condition(always, 1),
        }
        return fillings[type_]()

    def look(self, alone: bool) -> dict[str, Any]:
        """Where somebody is put and how he looks; beside one thing there is room for one."""
        made: dict[str, Any] = {}
        if self.often(0.3):
            made["kind"] = self.rng.choice(("guide", "child"))
        if self.often(0.4):
            beside = [f"next_to({name})" for name in self.declared.lets if alone]
            free = [place for place in beside if place not in self.taken]
            whole = ("left_half", "right_half", "anywhere where not here.in_line(agent)")
            made["place"] = self.rng.choice((*whole, *free))
            self.taken.update({made["place"]} & set(beside))
        if self.often(0.4):
            made["facing"] = self.rng.choice(("down", "pick(left | up)", "toward(agent)"))
        if self.often(0.3):
            made["view"] = self.rng.choice((3, 4, 5, 9))
        if self.often(0.4):
            made["earshot"] = self.rng.choice(("room", "next_to", 3))
        if self.often(0.1):
            made["audible"] = "always"
        return made

    def belief(self, sort: str) -> dict[str, Any]:
        """What is believed, and when it is looked at."""
        where = Where(reset=True, still=True, searching=True)
        what, _ = self.rng.choice(sorted(self.declared.contents.items()) or [("", "")])
        of: dict[str, Callable[[], str]] = {
            "truth": lambda: self.phrases.relation(where),
            "color": lambda: (
                f"nearest(o in {self.declared.several[0].name} to agent).color"
                if self.declared.several
                else "agent.color"
            ),
            "cell": lambda: "agent.cell",
            "number": lambda: self.rng.choice(self.single_numbers()),
            "thing": lambda: f"{self.phrases.one(self.declared.group(what), where)}.inside",
        }

        def source(hears: bool) -> dict[str, Any]:
            found: dict[str, Any] = {"of": of[sort]()}
            if hears:
                found["hears"] = self.rng.choice(("any", self.phrases.heard(), self.phrases.heard()))
            if not hears or self.often(0.3):
                found["when"] = self.rng.choice(("sees(agent)", "next_to(agent)", "agent.sees(self)"))
            return found

        made: dict[str, Any] = source(False)
        if self.often(0.3):
            del made["when"]
        if self.often(0.4):
            made = {"from": [made, source(True), source(False)][: self.rng.randint(1, 3)]}
            self.rng.shuffle(made["from"])
            if self.often(0.5) or "hears" in made["from"][0]:
                made["start"] = "none"
        if self.often(0.4):
            made["forget"] = self.rng.choice((1, 2, 3, "t % 3 == 0", "agent.next_to(self)"))
        return made

    # -- how it ends, and how it looks -------------------------------------------------------------------------

    def outcome(self) -> list[dict[str, Any]]:
        """Ends that are rare enough for an episode to last a while."""
        where = Where(acts=self.acts)
        entries: list[dict[str, Any]] = []
        for number in range(self.rng.randint(1, 3)):
            kind = self.rng.choice(("success", "success", "failure"))
            entry: dict[str, Any] = {
                kind: f"t > {self.rng.randint(5, 15)} and ({self.phrases.condition(where, 1)})"
            }
            if kind == "success" and self.often(0.5):
                entry["reward"] = self.rng.choice((30, "100 - 10 * (t + " + self.phrases.number(where) + ")"))
            if self.often(0.3):
                entry["id"] = f"end_{number}"
            entries.append(entry)
        return [
            *entries,
            {"success": "t > 10 and agent.spoke and agent.did(forward)"},
        ]  # one that is possible

    def probe(self) -> dict[str, Any]:
        """A question about anything that can be known from outside."""
        where = Where(acts=self.acts, still=True)
        phrases = self.phrases
        values = (
            phrases.color,
            phrases.direction,
            phrases.counted if self.declared.several else phrases.color,
        )
        answer = self.rng.choice((*values, phrases.condition))(where)
        probe: dict[str, Any] = {
            "ask": f"What is <{phrases.in_text(self.rng.choice(values), where)}>",
            "answer": f"prev(({answer}))" if self.often(0.2) else answer,
        }
        if self.often(0.8):
            condition = phrases.condition(where)
            probe["when"] = f"prev(({condition}))" if self.often(0.2) else condition
        if self.often(0.3):
            probe["answers"] = ["this", f"<{phrases.in_text(self.rng.choice(values), where)}>", "No."]
        return probe

    def observe(self) -> dict[str, Any]:
        """What the agent perceives."""
        made: dict[str, Any] = {"image": "before_npcs"} if self.often(0.25) else {}
        if self.often(0.15):
            made["npcs"] = "hidden"
        if self.often(0.2):
            made["names"] = "hidden"
        if self.often(0.25):
            made["own_voice"] = True
        if self.often(0.2):
            made["lines"] = "marked"
        if self.often(0.3):
            made["directions"] = "egocentric"
        if self.often(0.25):
            made["channels"] = ["type", "color", "status", "orientation", "pointing", "last_act"]
            made["channels"] += ["pointing_right", "pointing_ahead"] if self.often(0.6) else []
            if self.declared.carried and self.often(0.7):
                made["channels"].append("carrying")
            made["channels"] += [look.name for look in self.declared.looks if self.often(0.6)]
        spoken = [look.name for look in self.declared.looks if look.of == "cast"]
        if spoken and self.often(0.4):
            made["tone"] = self.rng.choice(spoken)
        return made


def fits(one: Thing, other: Thing) -> bool:
    """Whether something can be linked to something: one to all, or group to group of the same size."""
    return one.count is None or other.count is None or one.count == other.count


def say_somewhere(frames: list[dict[str, Any]], texts: tuple[str, ...]) -> None:
    """Let each of these texts be said by somebody, so that others can wait for it."""
    for number, text in enumerate(texts if frames else ()):
        frame = frames[number % len(frames)]
        if "steps" in frame:
            frame["steps"].append({"for": 1, "say": text})
        else:
            state = [*frame["states"].values()][number % len(frame["states"])]
            state.setdefault("then", []).append({"chance": 0.25, "say": text})


def tell_numbers(name: str, grammar: dict[str, Any], frames: list[dict[str, Any]]) -> None:
    """Let members tell each other numbers in a slot that no template has, some of them no word of it."""
    rng, told = Random(name), [frame for frame in frames if "states" in frame]
    if not told or not 0 < len(grammar.get("slots", ())) < 3 or rng.random() < 0.4:
        return
    grammar["slots"]["heap"] = "1..4"
    says = {"when": f"t % {rng.randint(2, 4)} == 1", "say": f"It makes <t % {rng.randint(3, 6)} + 1>"}
    hears = {
        "hears": "It makes <heap>",
        "when": f"heap % 2 == {rng.randint(0, 1)} or heap > {rng.randint(1, 4)}",
    }
    for rule in (says, hears | {"say": "It makes <heap + 1>"}):
        state = rng.choice([*rng.choice(told)["states"].values()])
        state.setdefault("then", []).insert(0, rule)
