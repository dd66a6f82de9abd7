"""Every word that can be heard in a scenario, numbered by first appearance, and how long the history can become."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product
from typing import Any

from socialai_dsl.grammar import ast
from tests.reference.evaluate import weighed
from tests.reference.script import Frame, Member, Script, Sequence
from tests.reference.source import Sources, Value
from tests.reference.speech import spelt, telling_parts, words
from tests.reference.world import COLORS, DIRECTIONS, default_name

PADDING, UNKNOWN = 0, 1
LONGEST = 256
PICKING = ("pick", "first", "nearest")

Who = tuple[str, int]
"""A member of the cast in one of its versions: `one_of` gives several."""


class Words:
    """Words with the numbers that they were given, and how many are kept: 0 pads, 1 is unknown.

    Those that are no words as they are heard tell lines apart.
    """

    def __init__(self, ids: dict[str, int], length: int) -> None:
        self.ids, self.length = ids, length
        self.telling = {word for word in ids if words(word) != [word]}

    def heard(self, line: str) -> list[str]:
        """The words of a line as they are heard."""
        return spelt(line, self.telling)

    def tokens(self, heard: list[str]) -> list[int]:
        """The ids of words."""
        return [self.ids.get(word, UNKNOWN) for word in heard]


class Vocabulary(Words):
    """The words of a scenario, numbered as they appear in it. Made before `observe:` is applied."""

    def __init__(self, scenario: Script, sources: Sources) -> None:
        self.scenario, self.sources = scenario, sources
        self.members = {name: scenario.versions(name) for name in scenario.cast}
        self.seats = scenario.seats()
        super().__init__({}, 0)
        self.ranges: dict[tuple[Who, str], tuple[int, int]] = {}  # of registers that are being worked out
        for text in self.in_order_of_appearance():
            for word in words(text):
                self.ids.setdefault(word, len(self.ids) + 2)
        self.telling = telling_parts(self.lines())
        for part in sorted(self.telling):
            self.ids.setdefault(part, len(self.ids) + 2)
        if scenario.observe.lines == "marked":
            shown = scenario.observe.names == "shown"
            called = [who for name in self.members for who in self.names_of(name)] if shown else ["line"]
            for who in called:
                self.ids.setdefault(f"<{who}>", len(self.ids) + 2)
        self.length = self.longest_history()

    def in_order_of_appearance(self) -> Iterator[str]:
        """Texts of the grammar, names of the cast, then all that members can say."""
        grammar = self.scenario.grammar
        for template in grammar.templates:
            yield re.sub("<[^<>]*>", " ", template)
        yield from (filler.word for fillers in grammar.fillers.values() for filler in fillers)
        for name in self.members:
            yield from self.names_of(name)
        for name in [name for name in self.members if name != "agent"]:
            # All that a member can be follows one frame: each of its lines with what any version puts in.
            # A script of the agent says what the grammar has: with it and without, the words are the same.
            for value in self.sayings((name, 0)):
                for who in self.who(name):
                    for piece in self.pieces(value.tree, who):
                        yield from piece
        for name in self.members:
            yield from self.tones(name)
        frames = self.scenario.frames.values()
        if any(rule.to is not None for frame in frames for rule in self.entries_of(frame)):
            yield "to"

    def lines(self) -> Iterator[str]:
        """All that seats may hear, and the names of who says it."""
        for name in self.speakers():
            texts = {text for who in self.who(name) for text in self.texts(who)}
            tones = [f"({word}) " for word in self.tones(name)] or [""]
            texts |= {*(self.utterances() if name in self.seats else ())}
            said = [f"{tone}{text}" for tone, text in product(tones, texts)]
            if self.scenario.observe.names == "hidden" or self.scenario.observe.lines == "marked":
                yield from said
            elif said:
                names = self.names_of(name)
                yield from names
                yield from (f"{who}: {text}" for who, text in product(names, said))

    def speakers(self) -> list[str]:
        """The members that some seat may hear: the agent only by itself, or by others who have a seat."""
        heard = self.scenario.observe.own_voice or len(self.seats) > 1
        return [name for name in self.members if name != "agent" or heard]

    def utterances(self) -> list[str]:
        """All that the grammar has."""
        grammar = self.scenario.grammar
        return [grammar.utterance(*spoken) for spoken in grammar.pairs()]

    def texts(self, member: Who) -> Iterator[str]:
        """All that a member may say by its frame."""
        for value in self.sayings(member) if member[0] != "agent" else ():
            yield from map("".join, product(*self.pieces(value.tree, member)))
        if self.performs(member) and member[0] != "agent":
            yield from self.utterances()

    # -- what can be said ----------------------------------------------------------------------------------

    def who(self, name: str) -> list[Who]:
        """A member in all its versions."""
        return [(name, number) for number in range(len(self.members[name]))]

    def version(self, member: Who) -> Member:
        """What is written about it."""
        return self.members[member[0]][member[1]]

    def frame(self, member: Who) -> Frame | None:
        """The frame it follows."""
        return self.sources.frame_of(self.version(member).frame)

    def names_of(self, name: str) -> list[str]:
        """All names that a member can bear."""
        return list(dict.fromkeys(bears for who in self.who(name) for bears in self.names_of_version(who)))

    def names_of_version(self, member: Who) -> list[str]:
        """All names that it can bear in one of its versions."""
        written = self.version(member).name
        if written is None:
            return [default_name(member[0])]
        tree = self.sources.name(f"cast.{member[0]}.name", written).tree
        if isinstance(tree, ast.Name) and tree.id not in self.scenario.let:
            return [tree.id]
        return self.values(tree, member)

    def tones(self, name: str) -> tuple[str, ...]:
        """The words that can be heard before what a member says."""
        tone = self.scenario.observe.tone
        if tone is None or name == "agent":
            return ()
        written = self.scenario.looks[tone]
        named = {
            node.id
            for node in self.sources.expression(f"looks.{tone}.for", written.for_).tree.walk()
            if isinstance(node, ast.Name)
        }
        return written.words if named & {"cast", name, name.partition("[")[0]} else ()

    def sayings(self, member: Who) -> list[Value]:
        """The texts of a member's frame, in order of its states or steps."""
        frame_name, frame = self.version(member).frame, self.frame(member)
        if frame is None:
            return []
        rules = self.entries_of(frame)
        return [
            self.sources.text(f"vocabulary.{frame_name}", rule.say, frame_name)
            for rule in rules
            if rule.say is not None
        ]

    @staticmethod
    def entries_of(frame: Frame) -> list[Any]:
        """Its rules and entries, in order."""
        rules: list[Any] = [entry.step for entry in frame.entries]
        for state in (frame.states or {}).values():
            rules += [*state.first, *state.then]
        return rules

    def pieces(self, tree: Any, member: Who) -> list[list[str]]:
        """A text as a row of pieces, each a list of what it can read."""
        if not isinstance(tree, ast.Text):
            return [self.values(tree, member)]
        row: list[list[str]] = []
        for part in tree.parts:
            slot = self.text_slot(part, member)
            if isinstance(part, str):
                row.append([part])
            elif isinstance(part, ast.Attribute) and self.is_text_slot(part):
                row.append(self.slot_of_other(part))
            elif slot is not None:
                row += self.pieces(slot, member)
            else:
                row.append(self.values(part, member))
        return row

    def text_slot(self, part: Any, member: Who) -> ast.Node | None:
        """The text that fills a slot of type text or utterance, if the part names one."""
        frame = self.frame(member)
        if frame is None or not isinstance(part, ast.Name):
            return None
        if frame.slots.get(part.id) not in ("text", "utterance"):
            return None
        path = f"cast.{member[0]}.with.{part.id}"
        return self.sources.text(path, self.version(member).with_[part.id]).tree

    def is_text_slot(self, part: ast.Attribute) -> bool:
        """Whether it names a text of another member: `teacher.formula`."""
        name = self.scenario.player_of(part.subject.id) if isinstance(part.subject, ast.Name) else ""
        frames = [self.frame(who) for who in self.who(name)] if name in self.members else []
        return any(frame and frame.slots.get(part.name) in ("text", "utterance") for frame in frames)

    def slot_of_other(self, part: ast.Attribute) -> list[str]:
        """All that another member's text slot can read."""
        assert isinstance(part.subject, ast.Name)
        name = self.scenario.player_of(part.subject.id)
        texts = []
        for who in self.who(name):
            slot = self.text_slot(ast.Name(part.name), who)
            if slot is not None:
                texts += self.values(slot, who)
        return list(dict.fromkeys(texts))

    # -- the values an expression can have -----------------------------------------------------------------

    def values(self, tree: Any, member: Who) -> list[str]:
        """All texts that a `<...>` part can read, in the order of its type."""
        if isinstance(tree, ast.Attribute):
            if tree.name == "color":
                return list(COLORS)
            if tree.name == "facing":
                return list(DIRECTIONS)
            if tree.name == "name":
                return self.names_of_subject(tree.subject, member)
            if tree.name in self.scenario.looks:
                return list(self.scenario.looks[tree.name].words)
            if tree.name in self.scenario.grammar.slots:
                return self.values(ast.Name(tree.name), member)
        if isinstance(tree, ast.Text):
            texts = [""]
            for piece in self.pieces(tree, member):
                texts = [start + end for start in texts for end in piece]
            return texts
        options = self.options(tree, member)
        if options is None:
            low, high = self.bounds(tree, member)
            return [str(number) for number in range(low, high + 1)]
        for domain in (COLORS, DIRECTIONS):
            if options and all(option in domain for option in options):
                return list(domain)
        if options and all(option.lstrip("-").isdigit() for option in options):
            return [str(number) for number in range(min(map(int, options)), max(map(int, options)) + 1)]
        return options

    def names_of_subject(self, subject: Any, member: Who) -> list[str]:
        """The names that `subject.name` can read."""
        if isinstance(subject, ast.Name) and self.scenario.player_of(subject.id) in self.members:
            return self.names_of(self.scenario.player_of(subject.id))
        if isinstance(subject, ast.Name) and subject.id == "self":
            return self.names_of(member[0])
        mentioned = [
            node.id for node in subject.walk() if isinstance(node, ast.Name) and node.id in self.members
        ]
        everyone = mentioned or list(self.members)
        return list(dict.fromkeys(name for one in everyone for name in self.names_of(one)))

    def options(self, tree: Any, member: Who) -> list[str] | None:
        """The words that an expression can be, or None if it is a number that is computed."""
        if isinstance(tree, ast.Attribute) and tree.name == "words" and isinstance(tree.subject, ast.Name):
            return [filler.word for filler in self.scenario.grammar.fillers[tree.subject.id]]
        if isinstance(tree, ast.Name):
            source = self.declared(tree.id, member)
            if source is not None:
                return self.options(source, member)
            if tree.id == "colors":
                return list(COLORS)
            if tree.id in self.scenario.grammar.slots:
                return [filler.word for filler in self.scenario.grammar.fillers[tree.id]]
            if tree.id in ("noun", "nouns"):
                return [str(noun) for noun in self.scenario.grammar.nouns]
            assigned = self.assigned(tree.id, member)
            if assigned:
                found = [None if self.computes(tree_) else self.options(tree_, member) for tree_ in assigned]
                return (
                    None
                    if None in found
                    else list(dict.fromkeys(word for some in found for word in some or ()))
                )
            if tree.id in self.scenario.looks:
                return list(self.scenario.looks[tree.id].words)
            return None if tree.id in ("t", "W", "H") or tree.id in self.scenario.state else [tree.id]
        if isinstance(tree, ast.Number):
            return [str(tree.value)]
        if isinstance(tree, ast.Text):
            return self.values(tree, member)
        if isinstance(tree, ast.Alternatives):
            found = [self.options(option, member) or [] for option, _ in weighed(tree)]
            return list(dict.fromkeys(word for words_ in found for word in words_))
        if isinstance(tree, ast.Conditional):
            return self.chosen_options(tree, member)
        if isinstance(tree, ast.Quantifier) and tree.name in PICKING:
            return self.options(tree.group, member)
        if isinstance(tree, ast.Call) and tree.name in PICKING:
            return self.options(tree.args[0], member)
        if isinstance(tree, ast.Call) and tree.name in self.scenario.tables:
            return self.table_options(tree.name)
        if isinstance(tree, ast.Attribute):
            words_ = ("color", "facing", "name", *self.scenario.looks)
            return self.values(tree, member) if tree.name in words_ else None
        return None

    def chosen_options(self, tree: ast.Conditional, member: Who) -> list[str] | None:
        """All words that a conditional value can be; None if all it can be are numbers that are computed."""
        parts = (tree.value, tree.other)
        found = [self.options(part, member) for part in parts]
        if found == [None, None]:
            return None
        words_ = [
            self.values(part, member) if known is None else known
            for part, known in zip(parts, found, strict=True)
        ]
        return list(dict.fromkeys(word for some in words_ for word in some))

    def table_options(self, name: str) -> list[str]:
        """All that a table holds; a permuted one holds what the other does."""
        written = self.scenario.tables[name]
        if not isinstance(written, dict):
            return self.table_options(str(written).removeprefix("permuted(").removesuffix(")").strip())
        return list(dict.fromkeys(map(str, written.values())))

    def declared(self, name: str, member: Who) -> ast.Node | None:
        """The tree of a let or slot."""
        frame = self.frame(member)
        if frame is not None and name in frame.slots:
            source = self.version(member).with_[name]
            return self.sources.expression(f"cast.{member[0]}.with.{name}", source).tree
        if name in self.scenario.let and not isinstance(self.scenario.let[name], Sequence):
            return self.sources.expression(f"let.{name}", self.scenario.let[name]).tree
        return None

    def assigned(self, name: str, member: Who) -> list[ast.Node]:
        """All that a register of the member's frame can be given, its start and every `set`; `none` is not said."""
        frame_name, frame = self.version(member).frame, self.frame(member)
        if frame is None or name not in frame.let:
            return []
        entries: list[Any] = [entry.step for entry in frame.entries]
        for state in (frame.states or {}).values():
            entries += [*state.first, *state.then]
        start = frame.let[name]
        start = start["start"] if isinstance(start, dict) else start
        sources = [start, *(entry.set[name] for entry in entries if name in entry.set)]
        return [
            self.sources.expression(f"vocabulary.{frame_name}", source, frame_name).tree
            for source in sources
            if source != "none"
        ]

    @staticmethod
    def computes(tree: ast.Node) -> bool:
        """Whether a value is the result of arithmetic."""
        return any(isinstance(node, ast.Arithmetic | ast.Negative) for node in tree.walk())

    def register_bounds(self, name: str, member: Who) -> tuple[int, int]:
        """The range of a register: what its `set`s can make of it in as many steps as there are."""
        assigned = self.assigned(name, member)
        self.ranges[member, name] = self.bounds(assigned[0], member)
        for _ in range(self.scenario.horizon):
            low, high = self.ranges[member, name]
            found = [self.bounds(tree, member) for tree in assigned[1:]]
            wider = min([low, *(a for a, _ in found)]), max([high, *(b for _, b in found)])
            if wider == (low, high):
                break
            self.ranges[member, name] = wider
        return self.ranges.pop((member, name))

    def bounds(self, tree: Any, member: Who) -> tuple[int, int]:
        """The least and greatest value of a computed number."""
        if isinstance(tree, ast.Number):
            return tree.value, tree.value
        if isinstance(tree, ast.Interval):
            return self.bounds(tree.low, member)[0], self.bounds(tree.high, member)[1]
        if isinstance(tree, ast.Quantifier) and tree.name == "count":
            return 0, self.group_size(tree.group)
        if isinstance(tree, ast.Quantifier):
            return self.bounds(tree.group, member)
        if isinstance(tree, ast.Call) and tree.name == "pick":
            return self.bounds(tree.args[0], member)
        if isinstance(tree, ast.Conditional):
            both = self.bounds(tree.value, member), self.bounds(tree.other, member)
            return min(low for low, _ in both), max(high for _, high in both)
        if isinstance(tree, ast.Name):
            if tree.id == "t":
                return 0, self.scenario.horizon
            if (member, tree.id) in self.ranges:
                return self.ranges[member, tree.id]
            if self.assigned(tree.id, member):
                return self.register_bounds(tree.id, member)
            if tree.id in self.scenario.grammar.slots:
                numbers = [int(f.word) for f in self.scenario.grammar.fillers[tree.id] if f.word.isdigit()]
                return min(numbers), max(numbers)
            if tree.id == "noun":
                numbers = [int(noun) for noun in self.scenario.grammar.nouns if str(noun).isdigit()]
                return min(numbers), max(numbers)
            source = self.declared(tree.id, member)
            return (0, 0) if source is None else self.bounds(source, member)
        if isinstance(tree, ast.Arithmetic):
            a, b = self.bounds(tree.left, member), self.bounds(tree.right, member)
            if tree.op == "+":
                return a[0] + b[0], a[1] + b[1]
            if tree.op == "-":
                return a[0] - b[1], a[1] - b[0]
            if tree.op == "*":
                products = [x * y for x in a for y in b]
                return min(products), max(products)
        if isinstance(tree, ast.Call) and tree.name in ("min", "max"):
            choose = min if tree.name == "min" else max
            lows, highs = zip(*(self.bounds(arg, member) for arg in tree.args), strict=True)
            return choose(lows), choose(highs)
        if isinstance(tree, ast.Attribute) and tree.name in ("noun", *self.scenario.grammar.slots):
            return self.bounds(ast.Name(tree.name), member)
        # Not worked out: one number stands for all, which only matters for how many words there are in all.
        return 0, 0

    def group_size(self, group: Any) -> int:
        """How many members a group has at most."""
        from tests.reference.room import group_size, sizes

        if isinstance(group, ast.Name) and group.id == "cells":
            width, height = (max(sizes(self.scenario, self.sources, side)) for side in ("width", "height"))
            return (width - 2) * (height - 2)
        if isinstance(group, ast.Name) and group.id in self.scenario.objects:
            return group_size(self.scenario.objects[group.id]) or 1
        if isinstance(group, ast.Name) and group.id == "colors":
            return len(COLORS)
        return len(weighed(group))

    # -- length --------------------------------------------------------------------------------------------

    def longest_history(self) -> int:
        """The number of tokens kept: every speaker's longest line at every step, in eights, 8 to 256."""
        per_step = sum(max(map(self.longest_line, self.who(name))) for name in self.speakers())
        bound = self.scenario.horizon * per_step
        return min(LONGEST, max(8, (bound + 7) // 8 * 8))

    def longest_line(self, member: Who) -> int:
        """The words of a member's longest line, its name included; 0 if it says nothing."""
        name = member[0]
        lengths = [
            sum(max(len(self.heard(text)) for text in piece) for piece in self.pieces(value.tree, member))
            for value in self.sayings(member)
            if name != "agent"
        ]
        if name in self.seats or self.performs(member):
            lengths.append(self.longest_utterance())
        tone = max((len(self.heard(text)) for text in self.tones(name)), default=0)
        return self.longest_name(name) + tone + max(lengths) if lengths else 0

    def longest_name(self, name: str) -> int:
        """The words before a member's lines; none where names are hidden."""
        if self.scenario.observe.lines == "marked":
            return 1
        if self.scenario.observe.names == "hidden":
            return 0
        return max(len(self.heard(text)) for text in self.names_of(name))

    def longest_utterance(self) -> int:
        """The words of the longest utterance of the grammar."""
        grammar = self.scenario.grammar
        if grammar.slots:
            return max(len(self.heard(grammar.utterance(*spoken))) for spoken in grammar.pairs())
        template = max(len(self.heard(text.replace("<noun>", " "))) for text in grammar.templates)
        return template + max(len(self.heard(str(text))) for text in grammar.nouns)

    def performs(self, member: Who) -> bool:
        """Whether it may say what the grammar has: whoever performs a sequence."""
        frame = self.frame(member)
        if frame is None:
            return False
        holders: list[Any] = [*(entry.step for entry in frame.entries), *(frame.states or {}).values()]
        holders += [rule for holder in holders for rule in getattr(holder, "first", ())]
        return any("perform(" in str(holder.do) for holder in holders)
