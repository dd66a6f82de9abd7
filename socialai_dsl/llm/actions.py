"""Actions of language models: instructions, constraints, and the reader of replies."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from heapq import nlargest
from itertools import dropwhile, islice
from typing import Any, Final, Literal, NamedTuple, get_args

from socialai_dsl.diagnostics import bounded_suggestions, printable, suggested
from socialai_dsl.llm.replies import conclusion, lines_of, mark, plain, readable
from socialai_dsl.program_suite import Playable
from socialai_dsl.vocabulary import NOUN, normal, words

Mode = Literal["text", "json", "tools"]
"""How a model gives its action: in a line of its reply, as a JSON object, or by calling tools."""

_QUOTED: Final = 80
_ASIDE: Final = 400
"""The most characters that a line can have beside the longest sentence and still be an action."""
_COMPARED, _SUGGESTED, _EFFORT = 2000, 60, 50_000
"""The sentences whose words are compared with what cannot be said, those of them whose letters are, and the pairs of
letters: a suggestion takes milliseconds."""
_MOST_SENTENCES: Final = 500
"""The most sentences that a JSON Schema lists; servers refuse longer lists."""

_MEANINGS: Final = {
    "left": "turn left where you stand",
    "right": "turn right where you stand",
    "forward": "take a step ahead",
    "pickup": "pick up what is in front of you",
    "drop": "put down what you carry",
    "toggle": "use what is in front of you: open it, close it, switch it, poke it",
    "done": "declare that you are done",
}
_STANDING: Final = "none"
_SYNONYMS: Final = {
    "left": ("turn left", "rotate left", "go left", "move left", "turn to the left"),
    "right": ("turn right", "rotate right", "go right", "move right", "turn to the right"),
    "forward": (
        "move forward",
        "go forward",
        "step forward",
        "walk forward",
        "ahead",
        "move ahead",
        "go straight",
    ),
    "pickup": ("pick up", "pick it up"),
    "drop": ("drop it",),
    "toggle": ("use", "use it", "toggle it", "interact"),
    "done": ("i am done", "i'm done"),
    _STANDING: ("stay", "wait", "stand still", "do nothing", "no movement", "noop", "stand", "silence"),
}
_SAYING: Final = frozenset("say saying speak ask tell utter".split())
_FILLERS: Final = frozenset(
    "i i'll i'd will would want to let me my next action is move then now please and while also".split()
)
_ALTERNATIVES: Final = frozenset(
    "or not instead otherwise else unless if rather but maybe perhaps either neither nor".split()
)
"""Words behind a sentence by which it may not be meant."""
_SILENCE: Final = frozenset([(), ("none",), ("null",), ("nothing",), ("silence",)])
"""The words that stand for no sentence where one can be given."""

_MARK: Final = mark("act(?:ion)?")
_QUOTATION: Final = re.compile(r"[\"“«]([^\"“”«»\n]{1,500})[\"”»]|(?<!\w)['‘]([^'‘’\n]{1,500})['’](?!\w)")


class Action(NamedTuple):
    """An agent's action in words, in the form that `ScenarioEnv.encode_action` takes.

    Attributes:
        movement: the word for a body action; None for no movement.
        sentence: the utterance; None for silence.
    """

    movement: str | None = None
    sentence: str | None = None


class Parsed(NamedTuple):
    """The result of reading a reply.

    Attributes:
        action: None if the reply holds none.
        error: what was wrong with the reply and what is possible, for the model; empty if nothing was.
    """

    action: Action | None
    error: str = ""


class ToolCall(NamedTuple):
    """A model's call of a tool.

    Attributes:
        name: `move` or `say`.
        arguments: a JSON object as the model wrote it.
    """

    name: str
    arguments: str


class ActionLanguage:
    """Replies as actions: the instructions for a model, and the reader of its replies.

    Args:
        program: of a scenario or suite.
    """

    def __init__(self, program: Playable) -> None:
        self._actions = (*program.actions, _STANDING)
        self._templates = tuple(dict.fromkeys(program.templates))
        self._slots = {
            slot.name: tuple(dict.fromkeys(slot.words))
            for slot in program.sentences.slots
            if slot.name == NOUN or any(slot.place in template for template in self._templates)
        }
        self._movements = {
            tuple(words(said)): action
            for action in self._actions
            for said in (action, *_SYNONYMS.get(action, ()))
        }
        spoken = (program.sentences.text(*one) for one in program.sentences.each())
        self._sentences = list(dict.fromkeys(spoken))
        counts = Counter(tuple(words(sentence)) for sentence in self._sentences)
        by_words = {tuple(words(sentence)): sentence for sentence in self._sentences}
        self._by_words = {said: sentence for said, sentence in by_words.items() if counts[said] == 1}
        self._as_heard = {normal(sentence): sentence for sentence in self._sentences}
        self._exact = set(self._sentences)
        self._longest = _ASIDE + max(map(len, self._sentences), default=0)
        moving = (said for said, action in self._movements.items() if action != _STANDING)
        self._moving = {said[0] for said in moving if len(said) == 1}

    def instructions(self, mode: Mode) -> str:
        """The possible actions and utterances, and the form of a reply.

        Raises:
            ValueError: there is no such mode.
        """
        if mode not in get_args(Mode):
            raise ValueError(f"mode: got {mode!r}, expected one of {', '.join(get_args(Mode))}")
        lines = ["Each turn you can make one movement, say one sentence, or do both at once. Movements:"]
        lines += [f"- {action}: {_MEANINGS[action]}" for action in self._actions[:-1]]
        lines += [f"- {_STANDING}: stay as you are"]
        if self._sentences:
            lines += ["", *self._what_can_be_said()]
        return "\n".join([*lines, "", *self._how_to_reply(mode)])

    def _what_can_be_said(self) -> Iterator[str]:
        """Templates and what stands in their slots, as instructions."""
        templates = "; ".join(map(printable, self._templates))
        if not self._slots:
            yield f"Sentences: {templates}"
            return
        if [*self._slots] == [NOUN]:
            filled = f"one of these nouns for <{NOUN}>"
        else:
            filled = f"one of these words for each {_listed([f'<{name}>' for name in self._slots])} in it"
        yield f"A sentence is one of these templates with {filled}."
        yield f"Templates: {templates}"
        for name, known in self._slots.items():
            yield f"{'Nouns' if name == NOUN else f'<{name}>'}: {'; '.join(map(printable, known))}"

    def write(self, action: Action) -> str:
        """The action as a reply in the mode `text`; `parse` reads it back."""
        said = f'say "{action.sentence}"' if action.sentence is not None else ""
        moved = action.movement if action.movement is not None or said else _STANDING
        return f"Act: {', '.join(part for part in (moved, said) if part)}"

    def parse(self, reply: str) -> Parsed:
        """Read a reply of the modes `text` and `json`.

        What counts is the last JSON object or the last line marked `Act:`, whichever comes later; without either,
        the last line, if it says nothing but an action. Case, quotes, punctuation, markdown and the tokens of chat
        templates do not count, nor do thoughts. Two actions that stand together and differ are refused.
        """
        text = readable(reply, "Act")
        stated = conclusion(text, _MARK)
        *others, meant = stated.statements or lines_of(text)[-2:] or [""]
        if not meant:
            return self._wrong("the reply held no action" if reply.strip() else "the reply was empty")
        if stated.last_line:
            others.append(stated.last_line)
        parsed = self._meaning(meant) if isinstance(meant, str) else self._arguments(meant)
        for other in others if parsed.action is not None else ():
            action = self._understood(other) if isinstance(other, str) else self._arguments(other).action
            if action not in (None, parsed.action):
                return self._wrong(f"the reply held two actions, {_cited(other)} and {_cited(meant)}")
        return parsed

    def parse_calls(self, calls: Sequence[ToolCall]) -> Parsed:
        """Read the tools that a reply calls: a movement, a sentence, or both; what differs is refused."""
        if not calls:
            return self._wrong("no tool was called")
        together = Action()
        for call in calls:
            arguments = _object(call.arguments or "{}")
            if not isinstance(arguments, dict) or call.name not in ("move", "say"):
                return self._wrong(f"{_cited(call.name)} with {_cited(call.arguments)} is no call of a tool")
            parsed = self._arguments(arguments)
            if parsed.action is None:
                return parsed
            for before, now in zip(together, parsed.action, strict=True):
                if None not in (before, now) and before != now:
                    return self._wrong(f"the reply held two actions, {_cited(before)} and {_cited(now)}")
            together = Action(*(before or now for before, now in zip(together, parsed.action, strict=True)))
        return Parsed(together)

    def gbnf(self) -> str:
        """A grammar in llama.cpp's notation of the replies that `write` gives."""
        movements = " | ".join(json.dumps(action, ensure_ascii=False) for action in self._actions)
        rules = [f"movement ::= {movements}"]
        if not self._sentences:
            return "\n".join(['root ::= "Act: " movement', *rules])
        fillers = [
            f"{_rule_name(name)} ::= {' | '.join(json.dumps(word, ensure_ascii=False) for word in known)}"
            for name, known in self._slots.items()
        ]
        templates = " | ".join(_rule_of(template) for template in self._templates)
        return "\n".join(
            [
                'root ::= "Act: " (movement | speech | movement ", " speech)',
                r'speech ::= "say \"" sentence "\""',
                f"sentence ::= {templates}",
                *fillers,
                *rules,
            ]
        )

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the replies of the mode `json`."""
        sentence: dict[str, Any] = {"type": ["string", "null"]}
        if len(self._sentences) <= _MOST_SENTENCES:
            sentence["enum"] = [*self._sentences, None]
        return {
            "type": "object",
            "properties": {"move": {"type": "string", "enum": list(self._actions)}, "say": sentence},
            "required": ["move", "say"],
            "additionalProperties": False,
        }

    def tools(self) -> list[dict[str, Any]]:
        """The tools `move` and `say`, as OpenAI's interface takes them; `say` can move as well."""
        direction = _choice("what to do", self._actions)
        tools = [_tool("move", "Move your body.", {"direction": direction})]
        if self._sentences:
            spoken = {"template": _choice("what to say", self._templates)}
            fillers = {
                name: _choice(f"what stands for <{name}>", known) for name, known in self._slots.items()
            }
            both = {"direction": _choice("what to do at the same time", self._actions)}
            if [*self._slots] == [NOUN]:
                about = "Say a template with a noun for its <noun>."
                tools.append(_tool("say", about, spoken | fillers, both))
            else:
                about = "Say a template with a word for each of the slots <...> that it has."
                if not fillers:
                    about = "Say a sentence."
                tools.append(_tool("say", about, spoken, fillers | both))
        return tools

    def _how_to_reply(self, mode: Mode) -> list[str]:
        example = self._sentences[0] if self._sentences else ""
        first = self._actions[0]
        if mode == "tools":
            both = " To move and speak at once, give `say` a direction." if example else ""
            return [f"Reply by calling a tool.{both}"]
        if mode == "json":
            said = json.dumps(example, ensure_ascii=False) if example else "null"
            return [
                "Reply with one JSON object; `say` is null for silence:",
                f'{{"move": "{first}", "say": {said}}}',
            ]
        examples = [Action(first), *([Action(None, example), Action(first, example)] if example else [])]
        return [
            "Think first if you like. End your reply with one line in one of these forms:",
            *map(self.write, examples),
        ]

    def _meaning(self, content: str) -> Parsed:
        """What a piece of a reply says that is done, or what is wrong with it."""
        action = self._understood(content)
        return self._not_understood(content) if action is None else Parsed(action)

    def _understood(self, content: str) -> Action | None:
        """A movement, a sentence, or both; None if it is not plainly one action."""
        if len(content) > self._longest:
            return None
        bare = content.strip(" \t`*_\"'“”.,;!")
        if bare in self._exact and tuple(words(bare)) not in self._movements:
            return Action(None, bare)
        quotations = ((found, found[1] or found[2]) for found in _QUOTATION.finditer(content))
        quoted = [
            (found, self._sentence(text))
            for found, text in quotations
            if tuple(words(text)) not in self._movements or _says(content[: found.start()])
        ]
        if any(sentence is not None for _, sentence in quoted):
            return self._with_quotations(content, quoted)
        said = _without_fillers(words(content))
        movement = self._movements.get(tuple(words(content))) or self._movements.get(tuple(_trimmed(said)))
        if movement:
            return _action(movement)
        for start in (0, 1):
            if said[start:] and (start == 0 or said[0] in _SAYING):
                sentence = self._by_words.get(tuple(said[start:]))
                if sentence is not None:
                    return Action(None, sentence)
        return self._both(said)

    def _sentence(self, text: str) -> str | None:
        """The sentence that a text is; None if it cannot be said."""
        if text in self._exact:
            return text
        return self._as_heard.get(normal(text)) or self._by_words.get(tuple(words(text)))

    def _with_quotations(
        self, content: str, quoted: Sequence[tuple[re.Match[str], str | None]]
    ) -> Action | None:
        """Read `forward, say "Where is the exit"`; None where another sentence, movement or none may be meant."""
        (first, sentence), (last, _) = quoted[0], quoted[-1]
        if sentence is None or any(other != sentence for _, other in quoted):
            return None
        before = [word for word in _without_fillers(words(content[: first.start()])) if word not in _SAYING]
        after = _trimmed(words(content[last.end() :]))
        moves = [self._movements.get(tuple(_trimmed(before))), self._movements.get(tuple(after))]
        if before and moves[0] is None:
            return None
        if after and moves[1] is None and not (_ALTERNATIVES | self._moving).isdisjoint(after):
            return None
        moved = {move for move in moves if move is not None} - {_STANDING}
        return Action(next(iter(moved), None), sentence) if len(moved) <= 1 else None

    def _both(self, said: Sequence[str]) -> Action | None:
        """A movement, then a sentence, or the other way round, without quotes."""
        for cut in range(len(said) - 1, 0, -1):
            for moved, rest in ((said[:cut], said[cut:]), (said[cut:], said[:cut])):
                movement = self._movements.get(tuple(_trimmed(moved)))
                if movement is None:
                    continue
                spoken = [*_without_fillers(rest), ""]
                spoken = (spoken[1:] if spoken[0] in _SAYING else spoken)[:-1]
                sentence = self._by_words.get(tuple(spoken)) or self._by_words.get(tuple(_trimmed(spoken)))
                if sentence is not None:
                    return Action(_action(movement).movement, sentence)
        return None

    def _arguments(self, given: Mapping[str, Any]) -> Parsed:
        """Read a JSON object: `move` and `say`, or the arguments of a tool."""
        inner = given.get("arguments", given.get("parameters"))
        inner = _object(inner) if isinstance(inner, str) else inner
        given = inner if isinstance(inner, dict) else given
        moves = [given[key] for key in ("move", "direction", "action", "movement") if given.get(key)]
        spoken = next((given[key] for key in ("say", "sentence", "utterance") if given.get(key)), None)
        if spoken is None and isinstance(given.get("template"), str):
            spoken = self._filled(_text(given["template"]), given)
        if not moves and spoken is None and not {"move", "say"} & set(given):
            return self._wrong("the object says neither what to do nor what to say")
        movement, sentence = _STANDING, None
        if moves:
            known = [self._movements.get(tuple(words(_text(move)))) for move in moves]
            movement = next((move for move in known if move is not None), "")
            if not movement:
                return self._wrong(f"{_cited(moves[0])} is no movement")
            if any(move not in (None, movement) for move in known):
                return self._wrong(
                    f"the object names several movements: {_cited(' and '.join(map(str, moves)))}"
                )
        if spoken is not None:
            sentence = self._sentence(_text(spoken))
            if sentence is None and tuple(words(_text(spoken, "?"))) not in _SILENCE:
                return self._unsayable(str(spoken))
        return Parsed(Action(_action(movement).movement, sentence))

    def _filled(self, template: str, given: Mapping[str, Any]) -> str:
        """A template with its slots filled as a call of a tool says."""
        for name in self._slots:
            template = template.replace(f"<{name}>", _text(given.get(name, "")))
        return template

    def _not_understood(self, content: str) -> Parsed:
        """Say why a piece of a reply is not plainly one action."""
        if len(content) > self._longest:
            return self._wrong(f"{_cited(content)} is too long for an action")
        quoted = [found[1] or found[2] for found in _QUOTATION.finditer(content) if "{" not in content]
        known = [sentence for sentence in map(self._sentence, quoted) if sentence is not None]
        if len(set(known)) > 1:
            return self._wrong(f"the reply held two sentences, {_cited(known[0])} and {_cited(known[-1])}")
        if known and len(known) == len(quoted):
            return self._wrong(f"{_cited(content)} is not plainly one action")
        said = _without_fillers(words(content))
        spoken = quoted or (said and said[0] in _SAYING)
        return self._unsayable(content) if spoken else self._wrong(f"{_cited(content)} is no action")

    def _unsayable(self, text: str) -> Parsed:
        """Say that a sentence cannot be said, and which one may be meant."""
        quotations = (found[1] or found[2] for found in _QUOTATION.finditer(text))
        quoted = next((one for one in quotations if self._sentence(one) is None), text)
        as_json = partial(json.dumps, ensure_ascii=False)
        said = set(words(quoted[: 10 * _QUOTED]))
        alike = nlargest(
            _SUGGESTED,
            islice(self._by_words.items(), _COMPARED),
            key=lambda known: len(said.intersection(known[0])),
        )
        with bounded_suggestions(_EFFORT):
            hint = suggested(quoted.strip(), (sentence for _, sentence in alike), quoted=as_json)
        return self._wrong(f"{_cited(quoted)} cannot be said{hint}")

    def _wrong(self, what: str) -> Parsed:
        """Say what was wrong, and what is possible."""
        fillers = "one of the nouns" if [*self._slots] == [NOUN] else "words in place of <...>"
        sayable = f", and sentences are the templates with {fillers}" if self._sentences else ""
        if self._sentences and not self._slots:
            sayable = f", and sentences are {', '.join(map(printable, self._templates))}"
        return Parsed(None, f"{what}. Movements are {', '.join(self._actions)}{sayable}.")


def _action(movement: str) -> Action:
    return Action(None if movement == _STANDING else movement)


def _text(given: Any, otherwise: str = "") -> str:
    """What was given, if it is a text that can be an action."""
    return given[: 10 * _QUOTED] if isinstance(given, str) else otherwise


def _object(text: str) -> Any:
    """What JSON says; None if it is none."""
    try:
        return json.loads(text, object_pairs_hook=plain)
    except (ValueError, RecursionError):
        return None


def _says(before: str) -> bool:
    """Whether what stands before a quotation makes it a sentence, whatever it is otherwise."""
    return not _SAYING.isdisjoint(words(before)[-1:])


def _without_fillers(said: Sequence[str]) -> list[str]:
    """Words without those before an action that mean nothing, as in `I will now ...`."""
    return list(dropwhile(_FILLERS.__contains__, said))


def _trimmed(said: Sequence[str]) -> list[str]:
    """Words without those before and behind an action that mean nothing."""
    return _without_fillers(_without_fillers(said)[::-1])[::-1]


def _cited(given: Any) -> str:
    text = " ".join(str(given)[: 2 * _QUOTED].split())
    return json.dumps(printable(text if len(text) <= _QUOTED else f"{text[:_QUOTED]}…"), ensure_ascii=False)


def _rule_of(template: str) -> str:
    """A template as a sequence of a grammar."""
    parts = re.split(r"<(\w+)>", template)  # a piece of text, a slot, a piece of text, ...
    texts = (json.dumps(part, ensure_ascii=False) if part else "" for part in parts[::2])
    slots = (*map(_rule_name, parts[1::2]), "")
    return " ".join(part for pair in zip(texts, slots, strict=True) for part in pair if part)


def _rule_name(slot: str) -> str:
    """The rule of a grammar for what stands in a slot."""
    return slot if slot == NOUN else f"slot-{slot.replace('_', '-')}"


def _listed(parts: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join(part for part in (", ".join(parts[:-1]), parts[-1]) if part)


def _choice(about: str, values: Sequence[str]) -> dict[str, Any]:
    return {"type": "string", "enum": list(values), "description": about}


def _tool(
    name: str, about: str, required: Mapping[str, Any], optional: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    parameters = {
        "type": "object",
        "properties": {**required, **(optional or {})},
        "required": list(required),
        "additionalProperties": False,
    }
    return {"type": "function", "function": {"name": name, "description": about, "parameters": parameters}}
