"""Terms and lines to code: a false condition skips, a value ends in an operand, a line becomes a number."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from math import prod
from typing import Final

from socialai_dsl.compiler.assembler import (
    Label,
    Registers,
    entity_register,
    found_path,
    said_path,
    seat_path,
    state_names,
)
from socialai_dsl.compiler.cells import (
    Emitter,
    LoopCell,
    among,
    asks,
    coordinate,
    count_cells,
    count_things,
    first_thing,
    nearest_thing,
    one_cell,
    picked_thing,
    selected_condition,
    selected_value,
)
from socialai_dsl.compiler.folding import SILENCE, Classes, fold, fold_whole
from socialai_dsl.compiler.rows import row
from socialai_dsl.grammar.ast import every
from socialai_dsl.program import Field, Op, Register, SeatRegister, constant, is_temporary
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import Activity, CheckedScenario, Entity
from socialai_dsl.semantics.terms import Const, Line, Pattern, SaidBy, Term, Type, Variable
from socialai_dsl.vocabulary import mark_of, normal, telling_pieces, tokens, words
from socialai_dsl.widths import UNSPOKEN

_TESTS = {
    "at": Op.IF_SAME_CELL,
    "next_to": Op.IF_NEXT_TO,
    "faces": Op.IF_FACES,
    "faces_toward": Op.IF_FACES_TOWARD,
    "in_front_of": Op.IF_IN_FRONT_OF,
    "eye_contact": Op.IF_EYE_CONTACT,
    "in_line": Op.IF_IN_LINE,
    "can_reach": Op.IF_REACHES,
    "looks_at": Op.IF_LOOKS_AT,
    "unobstructed": Op.IF_UNOBSTRUCTED,
}
_ARITHMETIC = {
    "+": Op.ADD,
    "-": Op.SUB,
    "*": Op.MUL,
    "//": Op.DIV,
    "%": Op.MOD,
    "min": Op.MIN,
    "max": Op.MAX,
}
_COMPARE = {"==": Op.IF_EQ, "!=": Op.IF_NE, "<": Op.IF_LT, "<=": Op.IF_LE}
_OPPOSITE = {"==": "!=", "!=": "=="}


_FEW: Final = 64
"""Rules that take no more temporaries need no code that gives some back."""


def chance_word(probability: float) -> int:
    """A probability as an operand."""
    return round(probability * 65536)


class Expressions(Emitter):
    """Emits conditions and values of every kind."""

    # --- conditions ---

    def sited_condition(self, sited: terms.SitedTerm, otherwise: Label) -> None:
        """A condition with its own site and place in the source. It is false if something in it finds nothing."""
        self.site, self.block.span = sited.site, sited.span
        failed, self.failed = self.failed, otherwise
        self.condition(fold_whole(sited.term, self.facts, self.classes), otherwise)
        self.failed = failed

    def test(self, term: Term, otherwise: Label) -> None:
        """See `Emitter.test`."""
        block = self.block
        match term:
            case Const():
                if not term.value:
                    block.skip(otherwise)
            case terms.Logic(op="and"):
                for arg in term.args:
                    self.condition(arg, otherwise)
            case terms.Logic():
                asked = asks(term)
                if asked is not None:
                    key, numbers = asked
                    among(self, self.value(key), key.type, numbers, otherwise)
                else:
                    self._either(term.args, otherwise)
            case terms.Not():
                self._negated(term.arg, otherwise)
            case terms.Compare():
                equality = term.op in _OPPOSITE
                left, right = self._compared(term.left, equality), self._compared(term.right, equality)
                block.test(_COMPARE[term.op], left, right, otherwise)
            case terms.Test(subject=None):
                assert term.name in ("next_to", "at"), f"internal: here.{term.name} is a board of its own"
                block.test(_TESTS[term.name], self._loop("").cell, self.value(term.object), otherwise)
            case terms.Test():
                assert term.subject is not None
                subject = self.value(term.subject)
                if self.is_bare and term.name == "can_reach":
                    block.emit(Op.DRAW_ROOM, 1)
                    self.has_drawn = True
                block.test(_TESTS[term.name], subject, self.value(term.object), otherwise)
            case terms.Sees():
                self._sees(term, otherwise)
            case terms.Chance():
                site = self.sites.row(self.site, term.ordinal)
                block.test(Op.IF_CHANCE, chance_word(term.probability), site, otherwise)
            case terms.Select():
                selected_condition(self, term, otherwise)
            case terms.Quantification(op="any", cells=True):
                block.test(Op.IF_NE, count_cells(self, term), constant(0), otherwise)
            case terms.Quantification(op="all", cells=True):
                block.test(Op.IF_EQ, count_cells(self, term, opposite=True), constant(0), otherwise)
            case terms.Quantification(op="any" | "all"):
                self.condition(fold(term, self.facts, self.classes), otherwise)
            case terms.PokedNow():
                block.test(Op.IF_EQ, Register.POKED, self.value(term.entity), otherwise)
            case terms.Spoke():
                block.test(Op.IF_NE, Register.CLASS, constant(SILENCE), otherwise)
            case terms.Said():
                self.one_of(Op.IF_EQ, Register.CLASS, self.classes.matching(term.pattern), otherwise)
            case terms.Heard():
                heard = frozenset[int]().union(*(self.classes.matching(pattern) for pattern in term.patterns))
                self.one_of(Op.IF_HEARD, self.inbox, heard, otherwise)
            case terms.SaidBy():
                self._said_by(term, otherwise)
            case terms.InState():
                self._in_state(term, otherwise)
            case _:  # a value of type bool
                block.test(Op.IF_NE, self.value(term), constant(0), otherwise)

    def _either(self, args: Iterable[Term], otherwise: Label) -> None:
        *rest, last = args
        done = Label()
        for arg in rest:
            following = Label()
            self.condition(arg, following)
            self.block.skip(done)
            self.block.bind(following)
        self.condition(last, otherwise)
        self.block.bind(done)

    def _negated(self, arg: Term, otherwise: Label) -> None:
        if isinstance(arg, terms.Compare) and arg.op in _OPPOSITE:
            self.condition(replace(arg, op=_OPPOSITE[arg.op]), otherwise)  # type: ignore[arg-type]
            return
        false = Label()
        self.condition(arg, false)
        self.block.skip(otherwise)
        self.block.bind(false)

    def _said_by(self, term: terms.SaidBy, otherwise: Label) -> None:
        """Whether what an NPC has said in this step is one of its lines that fit."""
        said = self.registers.by_path.get(said_path(self.checked.entities[term.entity]))
        lines = self.classes.said[term.entity, term.pattern]
        if said is None or not lines:
            self.block.skip(otherwise)
        elif term.pattern is None:
            self.block.test(Op.IF_NE, said, constant(0), otherwise)
        elif max(lines) - min(lines) == len(lines) - 1:
            self.block.test(Op.IF_LE, constant(1 + min(lines)), said, otherwise)
            self.block.test(Op.IF_LE, said, constant(1 + max(lines)), otherwise)
        else:
            self.one_of(Op.IF_EQ, said, frozenset(1 + line for line in lines), otherwise)

    def _in_state(self, term: terms.InState, otherwise: Label) -> None:
        frame = next(f for f in self.checked.frames if f.member == term.member and f.frame == term.frame)
        register = self.registers.by_path[f"{term.member}.frame"]
        numbers = frozenset(i for i, name in enumerate(state_names(frame)) if name == term.state)
        self.one_of(Op.IF_EQ, register, numbers, otherwise)

    def _loop(self, name: str) -> LoopCell:
        """The cell that a variable stands for; `here` has the empty name."""
        assert self.loop is not None, f"internal: {name or 'here'} outside of a loop over cells"
        assert self.loop.name == name, f"internal: the variable {name or 'here'} is free"
        return self.loop

    def _sees(self, term: terms.Sees, otherwise: Label) -> None:
        """The op takes the direction from where it leaves its answer."""
        facing = term.facing or terms.FieldOf(terms.DIRECTION, term.viewer, "dir")
        seen = self.value(facing)
        if not is_temporary(seen):
            seen = self.into_temporary(Op.LOAD, seen)
        target = self.value(term.target)
        self.block.emit(Op.SEES, seen, self.value(term.viewer), target)
        self.block.test(Op.IF_NE, seen, constant(0), otherwise)

    # --- values ---

    def sited_value(self, sited: terms.SitedTerm) -> int:
        """A value with its own site and place in the source, within its type."""
        self.site, self.block.span = sited.site, sited.span
        return self.saturated(fold(sited.term, self.facts, self.classes))

    def _compared(self, term: Term, equality: bool) -> int:
        """A value that is only compared: no noun at all is unlike any noun, and nothing is unlike anything."""
        if isinstance(term, terms.World) and term.name == "noun" and term.type.kind == "noun":
            return self._digit(Register.NOUN, term.digit)
        if equality and isinstance(term, terms.Read | terms.ReadEach) and term.nothing is not None:
            return self.held(term)
        return self.value(term)

    def value(self, term: Term) -> int:
        """Emit what computes the term; the operand it is in afterwards."""
        match term:
            case Const():
                return self.number(term.value)
            case terms.Read(nothing=None):
                return self._read(term.path)
            case terms.Read() | terms.ReadEach():
                return self._something(term)
            case terms.World(name="noun"):
                return self._found(self._digit(Register.NOUN, term.digit), term.digit)
            case terms.World():
                return int(Register[term.name.upper()])
            case terms.Here():
                here = self._loop("")
                return {"x": here.x, "y": here.y, "cell": here.cell}[term.name]
            case terms.FieldOf() if term.entity.type.kind == "cell":
                return coordinate(self, term)
            case terms.FieldOf(name="inside"):
                return self._container(term)
            case terms.FieldOf(entity=Const(value=entity)) if not (
                term.name in ("x", "y") and entity in self.leaving
            ):
                return entity_register(entity, Field[term.name.upper()])
            case terms.FieldOf():
                return self.into_temporary(Op.FIELD, self.value(term.entity), Field[term.name.upper()])
            case terms.Operation():
                return self._operation(term)
            case terms.Measure():
                op = Op.DISTANCE if term.name == "distance" else Op.QUADRANT
                return self.into_temporary(op, self.value(term.args[0]), self.value(term.args[1]))
            case terms.CellOf():
                of = self.value(term.entity)
                return of if term.entity.type.kind == "cell" else self.into_temporary(Op.CELL_OF, of)
            case terms.CellBeside():
                beside = self.value(term.entity)
                return self.into_temporary(Op.CELL_BESIDE, beside, self.value(term.direction))
            case terms.Speaker():
                return self._heard(Op.HEARD_FROM, term)
            case terms.HeardNoun():
                return self._heard(Op.HEARD_NOUN, term)
            case terms.Select():
                return selected_value(self, term)
            case terms.Quantification(op="count", cells=True):
                return count_cells(self, term)
            case terms.Quantification(op="first" | "pick" | "nearest", cells=True):
                return one_cell(self, term)
            case terms.Quantification(op="pick"):
                return picked_thing(self, term)
            case terms.Quantification(op="first"):
                return first_thing(self, term)
            case terms.Quantification(op="count"):
                return count_things(self, term)
            case terms.Quantification(op="nearest"):
                return nearest_thing(self, term)
            case terms.Variable():
                return self._loop(term.name).cell
            case _:
                return self._truth_value(term)

    def _read(self, path: str) -> int:
        """A register; there may be nothing in it."""
        found = self.registers.by_path.get(found_path(path))
        if found is not None and self.failed is not None:
            self.block.test(Op.IF_NE, found, constant(0), self.failed)
        return self.registers.by_path[path]

    def held(self, term: terms.Read | terms.ReadEach) -> int:
        """What is in a register, or in that of a key, nothing included."""
        if isinstance(term, terms.Read):
            return self.registers.by_path[term.path]
        if (known := term.known()) is not None:
            return self.registers.by_path[known.path]
        first, place = row(self, term)
        return self.into_temporary(Op.READ_AT, first, place)

    def _something(self, term: terms.Read | terms.ReadEach) -> int:
        """What is in a register that may hold nothing: that fails, or else is as good as the least there is."""
        held = self.held(term)
        if term.nothing is None:
            return held
        if self.failed is not None:
            self.block.test(Op.IF_NE, held, self.number(term.nothing), self.failed)
        return self.into_temporary(Op.MAX, held, self.number(term.type.low))

    def _found(self, number: int, digit: terms.Digit | None = None) -> int:
        """Something's number, where -1, or a digit above all words, is nothing: that fails, or is as good as any."""
        if digit is not None:
            last = constant(digit.radix - 2)
            if self.failed is not None:
                self.block.test(Op.IF_LE, number, last, self.failed)
            return self.into_temporary(Op.MIN, number, last)
        if self.failed is not None:
            self.block.test(Op.IF_LE, constant(0), number, self.failed)
        return self.into_temporary(Op.MAX, number, constant(0))

    def _digit(self, filling: int, digit: terms.Digit | None) -> int:
        """One slot of a filling; of -1, which is silence, a digit above all words, as division rounds down."""
        if digit is None:
            return filling
        if digit.stride > 1:
            filling = self.into_temporary(Op.DIV, filling, constant(digit.stride))
        return self.into_temporary(Op.MOD, filling, constant(digit.radix))

    def _heard(self, op: Op, term: terms.Speaker | terms.HeardNoun) -> int:
        assert self.inbox >= 0, "internal: nobody is there to hear it"
        number = self.into_temporary(op, self.inbox, self.classes.set_of(term.patterns))
        digit = term.digit if isinstance(term, terms.HeardNoun) else None
        return self._found(self._digit(number, digit), digit)

    def _container(self, term: terms.FieldOf) -> int:
        """What a thing lies in, or lay in last; 0 if it never did: the condition fails, or the first holder counts."""
        if isinstance(term.entity, Const):
            number = entity_register(term.entity.value, Field.INSIDE)
        else:
            number = self.into_temporary(Op.FIELD, self.value(term.entity), Field.INSIDE)
        if term.may_miss and self.failed is not None:
            self.block.test(Op.IF_LE, constant(term.type.low), number, self.failed)
        number = self.into_temporary(Op.MAX, number, constant(term.type.low))
        return self.into_temporary(Op.MIN, number, constant(term.type.high))

    def sited_copy(self, sited: terms.SitedTerm) -> int:
        """The same in a temporary that nothing else changes or reads."""
        mark, value = self.block.taken, self.sited_value(sited)
        if not is_temporary(value):
            value = self.into_temporary(Op.LOAD, value)
        return self.alone(mark, value)

    def alone(self, mark: int, value: int) -> int:
        """The value; where many temporaries are taken, those from `mark` on are given back but for its own."""
        if self.block.taken <= _FEW:
            return value
        self.block.taken = mark
        if not is_temporary(value, mark):
            return value
        first = self.block.temporary()
        if value != first:
            self.block.emit(Op.LOAD, first, value)
        return first

    def value_alone(self, term: Term) -> int:
        """The value of a term, `alone`."""
        return self.alone(self.block.taken, self.value(term))

    def _operation(self, term: terms.Operation) -> int:
        if term.op in ("abs", "neg"):
            value = self.value(term.args[0])
            return self.into_temporary(
                *((Op.ABS, value) if term.op == "abs" else (Op.SUB, constant(0), value))
            )
        if term.op == "turn":
            total = self.into_temporary(Op.ADD, self.value(term.args[0]), self.value(term.args[1]))
            return self.into_temporary(Op.MOD, total, constant(4))
        result = self.value(term.args[0])
        for arg in term.args[1:]:
            result = self.into_temporary(_ARITHMETIC[term.op], result, self.value(arg))
        return result

    def note_whether(self, register: int, condition: terms.SitedTerm) -> None:
        """Let a register tell whether a condition holds."""
        self.block.emit(Op.LOAD, register, constant(0))
        false = Label()
        self.sited_condition(condition, false)
        self.block.emit(Op.LOAD, register, constant(1))
        self.block.bind(false)

    def note_value(self, path: str, value: terms.SitedTerm, nothing: Label | None) -> None:
        """Put a value into a register; skip to `nothing` if it finds nothing (None: it always finds something)."""
        self.failed = nothing
        found = self.sited_copy(value)
        self.failed = None
        self.store(path, found)

    def _truth_value(self, term: Term) -> int:
        result = self.block.temporary()
        false = Label()
        self.block.emit(Op.LOAD, result, constant(0))
        self.condition(term, false)
        self.block.emit(Op.LOAD, result, constant(1))
        self.block.bind(false)
        return result


# -- lines: fixed texts, texts with values inside, and the agent's own utterances ----------------------------


UNKNOWN = 1
MAX_TOKENS = 256


@dataclass
class Lines:
    """The line table.

    Attributes:
        texts: text of each line as it is heard. said: without who says it and how. classes: utterance class to NPCs.
        nouns: what `<noun>` is in it, -1 nothing.
        agent_says: 1 + number of the agent's utterance (0, 0) where the agent's utterances are lines; else 0.
        speakers: for each entity that says something, the numbers of its lines.
        kept_secret: the lines that the agent never hears, for they are said to others.
    """

    checked: CheckedScenario
    classes_of: Classes
    texts: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    classes: list[int] = field(default_factory=list)
    nouns: list[int] = field(default_factory=list)
    agent_says: int = 0
    speakers: dict[int, set[int]] = field(default_factory=dict)
    kept_secret: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._known: dict[tuple[int, tuple[str | Term, ...], Term | None], int] = {}
        self._marked: dict[
            int, tuple[str, str]
        ] = {}  # where lines are marked, the mark of each and what follows it
        self.grammar = self.checked.sentences.by_number()
        if self._agent_is_heard or any(frame.entity == 0 for frame in self.checked.frames):
            self._add_agent()

    @property
    def _agent_is_heard(self) -> bool:
        """Whether a player hears what the agent says."""
        return self.checked.own_voice or bool(self.checked.seated)

    def _add_agent(self) -> None:
        self.agent_says = 1 + len(self.texts)
        agent = self.checked.entities[0]
        for k, text in enumerate(self.grammar):
            line = self._append(agent, (self._word(agent.name), text))
            self.classes[line] = self.classes_of.of_pair[k]
            self.nouns[line] = self._noun_of_pair(k)

    def _append(self, speaker: Entity, pieces: Sequence[str], to: tuple[int, str] | None = None) -> int:
        """A line of its pieces: the tone if the speaker has one, the name, the text; `to`: the member addressed."""
        *before, name = pieces[: len(_before(speaker))]
        tone = "".join(f"({word}) " for word in before)
        text = "".join(pieces[1 + len(before) :])
        called, name = name, f"{name} to {to[1]}" if to else name
        shown = self.checked.names_shown
        line = len(self.texts)
        self.texts.append(f"{name}: {tone}{text}" if shown else f"{tone}{text}")
        self.said.append(text)
        if self.checked.lines_marked:
            rest = f"to {to[1]}: {tone}{text}" if to and shown else f"{tone}{text}"
            self._marked[line] = mark_of(called if shown else None), rest
        self.classes.append(self.classes_of.of_text(text, to[0] if to else None))
        if to and to[0] != 0 and not self.checked.overheard:
            self.kept_secret.add(line)
        self.nouns.append(self.classes_of.noun_in(text))
        self.speakers.setdefault(speaker.number, set()).add(line)
        return line

    @staticmethod
    def _word(term: Term | None) -> str:
        assert isinstance(term, Const), "internal: the agent's name is drawn"
        return term.type.words[term.value - term.type.low]

    def _noun_of_pair(self, k: int) -> int:
        return k % self.checked.sentences.fillings

    def adopt(self, other: Lines) -> None:
        """Number all lines as `other` does, which was made for the same scenario."""
        self.texts, self.said = [*other.texts], [*other.said]
        self.classes, self.nouns = [*other.classes], [*other.nouns]
        self._known, self._marked = dict(other._known), dict(other._marked)
        self.kept_secret = set(other.kept_secret)
        self.speakers = {speaker: set(lines) for speaker, lines in other.speakers.items()}

    def said_by(self, speaker: int, pattern: Pattern | None) -> frozenset[int]:
        """The lines of an NPC that fit a pattern (None: all of them), once the lines of all members are known."""
        wanted = None if pattern is None else self.classes_of.matching(pattern)
        own = self.speakers.get(speaker, set())
        return frozenset(line for line in own if wanted is None or self.classes[line] in wanted)

    def bounds(self, speaker: Entity, line: Line) -> tuple[int, int]:
        """The least and the greatest number that `say` gives for a line."""
        if speaker.number == 0:
            numbers = [number for number in self._utterances(line) if number is not None]
            return min(numbers), max(numbers)
        pieces = (*_before(speaker), *line.parts)
        first = self._family(speaker, pieces, line)
        return first, first + _number_of(pieces, speaker, line) - 1

    def speak(self, to: Expressions, speaker: Entity, line: int, said: Line) -> None:
        """Emit that `speaker` says a line, whose number is in an operand."""
        self._speak(to, speaker, line, _number_of((*_before(speaker), *said.parts), speaker, said))

    def _speak(self, to: Expressions, speaker: Entity, line: int, of: int, as_player: bool = False) -> None:
        """Emit that `speaker` says one of so many lines in its present tone; note it if a condition reads it.

        While a player has the seat, only what the player says is noted (`as_player`), not what the script would say.
        """
        block = to.block
        if speaker.tone is not None:
            tone = to.into_temporary(Op.MUL, to.value(speaker.tone), constant(of))
            line = to.into_temporary(Op.ADD, line, tone)
        block.emit(Op.SAY, constant(speaker.number), line)
        noted = to.registers.by_path.get(said_path(speaker))
        if noted is None:
            return
        unnoted = Label()
        block.test(Op.IF_EQ, noted, constant(0), unnoted)
        taken = to.registers.by_path.get(seat_path(speaker, SeatRegister.TAKEN))
        if taken is not None and not as_player:
            block.test(Op.IF_EQ, taken, constant(0), unnoted)
        with block.scratch():
            block.emit(Op.LOAD, noted, to.into_temporary(Op.ADD, line, constant(1)))
        block.bind(unnoted)

    def say(self, to: Expressions, speaker: Entity, line: Line) -> int:
        """Emit the number of the line that `speaker` says, in its first tone; the operand it is in."""
        to.site, to.block.span = line.site, line.span
        if speaker.number == 0:
            return self._utterance(to, line)
        pieces = (*_before(speaker), *line.parts)
        first = self._family(speaker, pieces, line)
        varying = [part for part in pieces if not isinstance(part, str | Const) and part is not speaker.tone]
        if line.to is not None and not isinstance(line.to.term, Const):
            return self._said_to(to, [*varying, line.to.term], line.to, first)
        return self._index(to, varying, first)

    def perform(self, to: Expressions, speaker: Entity, utterance: Term, as_player: bool = False) -> None:
        """Emit that `speaker` says an utterance of the grammar, in a sequence or for its player; 0 is silence."""
        if isinstance(utterance, Const) and utterance.value == 0:
            return
        block = to.block
        silent = Label()
        said = to.value(utterance)
        if not isinstance(utterance, Const):
            block.test(Op.IF_NE, said, constant(0), silent)
            said = to.into_temporary(Op.MAX, said, constant(1))
        line = self._line_performed(to, speaker, said)
        of = _number_of((*_before(speaker),), speaker) * len(self.grammar)
        self._speak(to, speaker, line, of, as_player)
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
        before = _before(speaker)
        first = self._family(speaker, (*before, anything))
        for k in range(prod(map(len, map(_choices, before))) * len(texts)):
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

    @staticmethod
    def _said_to(to: Expressions, varying: Sequence[Term], addressee: terms.SitedTerm, first: int) -> int:
        """The operand of a line that is said to one of several."""
        *others, member = varying
        size = member.type.size
        index = Lines._index(to, others, 0)
        if others:
            index = to.into_temporary(Op.MUL, index, constant(size))
        to.site = addressee.site
        who = to.into_temporary(Op.MAX, to.value(member), constant(member.type.low))
        who = to.into_temporary(Op.MIN, who, constant(member.type.high))
        if others:
            who = to.into_temporary(Op.ADD, who, index)
        return to.into_temporary(Op.ADD, who, constant(first - member.type.low))

    def _family(self, speaker: Entity, parts: tuple[str | Term, ...], line: Line | None = None) -> int:
        """Number of the first of all lines that these parts can make; the last varying part changes fastest, and who is
        addressed faster still.
        """
        to = line.to if line is not None else None
        key = (speaker.number, parts, to.term if to is not None else None)
        if key not in self._known:
            self._known[key] = len(self.texts)
            for pieces in product(*(_choices(part) for part in parts)):
                for who in [None] if to is None else terms.numbers_of(to.term):
                    self._append(
                        speaker,
                        pieces,
                        None if who is None or line is None else (who, dict(line.called)[who]),
                    )
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
            with to.block.when(Op.IF_EQ, position, constant(i)):
                to.block.emit(Op.LOAD, result, constant(number))
        return result

    def _utterances(self, line: Line) -> list[int | None]:
        """The agent's lines for all that the parts can be; None for what it cannot say."""
        pairs = {normal(text): self.agent_says - 1 + k for k, text in enumerate(self.grammar)}
        return [
            pairs.get(normal("".join(pieces))) for pieces in product(*(_choices(part) for part in line.parts))
        ]

    @cached_property
    def vocabulary(self) -> tuple[str, ...]:
        """Word of each token id, once all lines are known: those of the scenario, then what tells its lines apart."""
        return tuple(dict.fromkeys((*UNSPOKEN, *self.checked.words_in_order, *self._telling)))

    @cached_property
    def tokens(self) -> list[list[int]]:
        """The ids of the words of each line, once all lines are known."""
        ids = {word: number for number, word in enumerate(self.vocabulary)}
        # A text without a single word still has to be heard as something.
        return [
            [ids.get(word, UNKNOWN) for word in self._read(line)] or [UNKNOWN]
            for line in range(len(self.texts))
        ]

    def _read(self, line: int) -> list[str]:
        """A line as its tokens spell it."""
        mark, text = self._marked.get(line, (None, self.texts[line]))
        said = tokens(text, self._telling) if self._telling else words(text)
        return said if mark is None else [mark, *said]

    @cached_property
    def _telling(self) -> list[str]:
        """What tells the lines apart that the agent can hear, and the names of who says them."""
        heard = set().union(*(self.speakers[speaker] for speaker in self._heard_speakers)) - self.kept_secret
        # A filling that is no utterance has a number, and no text.
        heard = {line for line in heard if self.said[line]}
        lines = [self._marked.get(line, ("", self.texts[line]))[1] for line in sorted(heard)]
        called = self.checked.names_shown and not self.checked.lines_marked
        names = [line.partition(":")[0] for line in lines] if called else []
        return telling_pieces([*names, *lines])

    @property
    def _heard_speakers(self) -> list[int]:
        return [speaker for speaker in self.speakers if speaker != 0 or self._agent_is_heard]

    @property
    def history_length(self) -> int:
        """L: room for the longest history an episode can make, a multiple of 8 from 8 to 256."""
        longest = sum(
            max(len(self.tokens[line]) for line in self.speakers[speaker]) for speaker in self._heard_speakers
        )
        bound = max(self.checked.horizon * longest, max((len(t) for t in self.tokens), default=1))
        return max(8, min(MAX_TOKENS, -(-bound // 8) * 8))


def note_what_is_said(checked: CheckedScenario, lines: Lines, registers: Registers) -> None:
    """For conditions on an NPC's lines: find all its lines, and allocate a register for the last one."""
    for number in checked.seated:
        lines.first_performed(checked.entities[number])
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


def _before(speaker: Entity) -> tuple[str | Term, ...]:
    """The parts of a line before its text: the speaker's tone if it has one, and its name."""
    return (speaker.name or "",) if speaker.tone is None else (speaker.tone, speaker.name or "")


def _number_of(pieces: tuple[str | Term, ...], speaker: Entity, line: Line | None = None) -> int:
    """How many lines pieces make in each tone of the speaker, to all that may be addressed."""
    members = 1 if line is None or line.to is None else line.to.term.type.size
    return members * prod(len(_choices(part)) for part in pieces if part is not speaker.tone)


def _choices(part: str | Term) -> tuple[str, ...]:
    """The words a part of a line can be."""
    if isinstance(part, str):
        return (part,)
    words = part.type.words or tuple(str(value) for value in part.type.values)
    return (words[part.value - part.type.low],) if isinstance(part, Const) else words
