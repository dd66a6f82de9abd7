"""Everything that may be heard, numbered: fixed texts, texts with values inside, and the agent's own utterances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.classes import Classes, texts_of_pairs
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.registers import Registers, said_path
from socialai_dsl.program import Op
from socialai_dsl.semantics.plans import Activity, Checked, Entity
from socialai_dsl.semantics.terms import Const, Line, Pattern, SaidBy, Term, Type, Variable
from socialai_dsl.trees import every
from socialai_dsl.vocabulary import normal, words

UNKNOWN = 1
MAX_TOKENS = 256


@dataclass
class Lines:
    """The line table.

    Attributes:
        texts: text of each line as the agent hears it. classes: utterance class to NPCs. nouns: what `<noun>` is in it,
        -1 nothing. tokens: ids of its words.
        agent_says: 1 + number of the agent's utterance (0, 0) where the agent's utterances are lines; else 0.
        speakers: for each entity that says something, the numbers of its lines.
    """

    checked: Checked
    classes_of: Classes
    texts: list[str] = field(default_factory=list)
    classes: list[int] = field(default_factory=list)
    nouns: list[int] = field(default_factory=list)
    tokens: list[list[int]] = field(default_factory=list)
    agent_says: int = 0
    speakers: dict[int, set[int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._known: dict[tuple[int, tuple[str | Term, ...]], int] = {}
        self.grammar = tuple(texts_of_pairs(self.checked))
        self.vocabulary = ("<pad>", "<unk>", *self.checked.words_in_order)
        self._ids = {word: number for number, word in enumerate(self.vocabulary)}
        if self.checked.own_voice or any(frame.entity == 0 for frame in self.checked.frames):
            self._add_agent()

    def _add_agent(self) -> None:
        self.agent_says = 1 + len(self.texts)
        agent = self.checked.entities[0]
        for k, text in enumerate(self.grammar):
            line = self._append(agent, self._word(agent.name), text)
            self.classes[line] = self.classes_of.of_pair[k]
            self.nouns[line] = self._noun_of_pair(k)

    def _append(self, speaker: Entity, name: str, text: str) -> int:
        heard = f"{name}: {text}" if self.checked.names_shown else text
        line = len(self.texts)
        self.texts.append(heard)
        self.classes.append(self.classes_of.of_text(text))
        self.nouns.append(self.classes_of.noun_in(text))
        # A text without a single word still has to be heard as something.
        self.tokens.append([self._ids.get(word, UNKNOWN) for word in words(heard)] or [UNKNOWN])
        self.speakers.setdefault(speaker.number, set()).add(line)
        return line

    @staticmethod
    def _word(term: Term | None) -> str:
        assert isinstance(term, Const), "internal: the agent's name is drawn"
        return term.type.words[term.value - term.type.low]

    def _noun_of_pair(self, k: int) -> int:
        return k % len(self.checked.nouns)

    def adopt(self, other: Lines) -> None:
        """Number all lines as `other` does, which was made for the same scenario."""
        self.texts, self.classes, self.nouns = [*other.texts], [*other.classes], [*other.nouns]
        self.tokens, self._known = [*other.tokens], dict(other._known)
        self.speakers = {speaker: set(lines) for speaker, lines in other.speakers.items()}

    def said_by(self, speaker: int, pattern: Pattern | None) -> frozenset[int]:
        """The lines of an NPC that fit a pattern (None: all of them), once it is known what everybody says."""
        wanted = None if pattern is None else self.classes_of.matching(pattern)
        own = self.speakers.get(speaker, set())
        return frozenset(line for line in own if wanted is None or self.classes[line] in wanted)

    def bounds(self, speaker: Entity, line: Line) -> tuple[int, int]:
        """The least and the greatest number of the line that `say` gives."""
        if speaker.number == 0:
            numbers = [number for number in self._utterances(line) if number is not None]
            return min(numbers), max(numbers)
        first = self._family(speaker, (speaker.name or "", *line.parts))
        return first, first + prod(map(len, map(_choices, (speaker.name or "", *line.parts)))) - 1

    def speak(self, to: Expressions, speaker: Entity, line: int) -> None:
        """Emit that `speaker` says the line in an operand, and note it where somebody asks what was said."""
        block = to.block
        block.emit(Op.SAY, constant(speaker.number), line)
        noted = to.registers.by_path.get(said_path(speaker))
        if noted is None:
            return
        spoken = Label()
        mark = block.taken
        block.test(Op.IF_EQ, noted, constant(0), spoken)
        block.emit(Op.LOAD, noted, to.into_temporary(Op.ADD, line, constant(1)))
        block.bind(spoken)
        block.release(mark)

    def say(self, to: Expressions, speaker: Entity, line: Line) -> int:
        """Emit the number of the line that `speaker` says; the operand it is in."""
        to.site, to.block.span = line.site, line.span
        if speaker.number == 0:
            return self._utterance(to, line)
        pieces = (speaker.name or "", *line.parts)
        first = self._family(speaker, pieces)
        return self._index(to, [part for part in pieces if not isinstance(part, str | Const)], first)

    def perform(self, to: Expressions, speaker: Entity, utterance: Term) -> None:
        """Emit that `speaker` says an utterance of the grammar as part of a sequence; 0 is silence."""
        if isinstance(utterance, Const) and utterance.value == 0:
            return
        block = to.block
        silent = Label()
        said = to.value(utterance)
        if not isinstance(utterance, Const):
            block.test(Op.IF_NE, said, constant(0), silent)
            said = to.into_temporary(Op.MAX, said, constant(1))
        line = self._line_performed(to, speaker, said)
        self.speak(to, speaker, line)
        block.bind(silent)

    def _line_performed(self, to: Expressions, speaker: Entity, said: int) -> int:
        """The operand of the line for a pair that is in an operand, counted from 1."""
        name = speaker.name if speaker.number != 0 else None
        if (before := self.first_performed(speaker) - 1) != 0:
            said = to.into_temporary(Op.ADD, said, constant(before))
        if name is not None and not isinstance(name, Const):
            named = to.into_temporary(Op.MUL, self._index(to, [name], 0), constant(len(self.grammar)))
            said = to.into_temporary(Op.ADD, said, named)
        return said

    def first_performed(self, speaker: Entity) -> int:
        """The line of the first pair; the others follow."""
        if speaker.number == 0:
            return self.agent_says - 1
        texts = self.grammar
        anything = Variable(Type("utterance", 1, len(texts), texts), "performed")
        first = self._family(speaker, (speaker.name or "", anything))
        for k in range(len(_choices(speaker.name or "")) * len(texts)):
            self.classes[first + k] = self.classes_of.of_performed[k % len(texts)]
            self.nouns[first + k] = self._noun_of_pair(k % len(texts))
        return first

    @staticmethod
    def _index(to: Expressions, varying: Sequence[Term], first: int) -> int:
        """First + the values of the varying parts as one mixed-radix number."""
        result: int | None = None
        stride = 1
        for part in reversed(varying):
            value = to.saturated(part)
            first -= part.type.low * stride
            if stride != 1:
                value = to.into_temporary(Op.MUL, value, constant(stride))
            result = value if result is None else to.into_temporary(Op.ADD, result, value)
            stride *= part.type.size
        if result is None:
            return constant(first)
        return result if first == 0 else to.into_temporary(Op.ADD, result, constant(first))

    def _family(self, speaker: Entity, parts: tuple[str | Term, ...]) -> int:
        """Number of the first of all lines that these parts can make; the last varying part changes fastest."""
        key = (speaker.number, parts)
        if key not in self._known:
            self._known[key] = len(self.texts)
            for name, *pieces in product(*(_choices(part) for part in parts)):
                self._append(speaker, name, "".join(pieces))
        return self._known[key]

    def _utterance(self, to: Expressions, line: Line) -> int:
        """The agent's line among the utterances of the grammar: its parts are a fixed text, or enumerated.

        What the grammar cannot say makes the rule false, as a pick that finds nothing does.
        """
        numbers = self._utterances(line)
        varying = [part for part in line.parts if not isinstance(part, str | Const)]
        position = self._index(to, varying, 0)
        result = to.block.temporary()
        sayable = [number for number in numbers if number is not None]
        to.block.emit(Op.LOAD, result, constant(sayable[0]))
        for i, number in enumerate(numbers):
            if number == sayable[0]:
                continue
            if number is None:
                assert to.failed is not None, "internal: an unsayable line outside of a rule"
                to.block.test(Op.IF_NE, position, constant(i), to.failed)
                continue
            following = Label()
            to.block.test(Op.IF_EQ, position, constant(i), following)
            to.block.emit(Op.LOAD, result, constant(number))
            to.block.bind(following)
        return result

    def _utterances(self, line: Line) -> list[int | None]:
        """The agent's lines for all that the parts can be; None for what it cannot say."""
        pairs = {normal(text): self.agent_says - 1 + k for k, text in enumerate(self.grammar)}
        return [
            pairs.get(normal("".join(pieces))) for pieces in product(*(_choices(part) for part in line.parts))
        ]

    @property
    def history_length(self) -> int:
        """L: room for the longest history an episode can make, a multiple of 8 from 8 to 256."""
        heard = [s for s in self.speakers if s != 0 or self.checked.own_voice]
        longest = sum(max(len(self.tokens[line]) for line in self.speakers[s]) for s in heard)
        bound = max(self.checked.horizon * longest, max((len(t) for t in self.tokens), default=1))
        return max(8, min(MAX_TOKENS, -(-bound // 8) * 8))


def note_what_is_said(checked: Checked, lines: Lines, registers: Registers) -> None:
    """Where somebody asks what an NPC has said: find all lines there are, and make room to note them."""
    asked = list(every(SaidBy, checked))
    if not asked:
        return
    for frame in checked.frames:
        speaker = checked.entities[frame.entity]
        for said in every(Line, frame):
            lines.bounds(speaker, said)
        for activity in every(Activity, frame):
            if activity.name == "perform":
                lines.first_performed(speaker)
    for number in sorted({term.entity for term in asked}):
        if number in lines.speakers:
            registers.add(
                said_path(checked.entities[number]), Type("int", 0, len(lines.texts)), fleeting=True
            )
    for term in asked:
        lines.classes_of.said[term.entity, term.pattern] = lines.said_by(term.entity, term.pattern)


def _choices(part: str | Term) -> tuple[str, ...]:
    """The words a part of a line can be."""
    if isinstance(part, str):
        return (part,)
    words = part.type.words or tuple(str(value) for value in range(part.type.low, part.type.high + 1))
    return (words[part.value - part.type.low],) if isinstance(part, Const) else words
