"""Actions of language models: instructions, constraints, and the reader of replies."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import dropwhile
from typing import Any, Final, Literal, NamedTuple, get_args

from socialai_dsl.diagnostics import printable, suggested
from socialai_dsl.program_suite import Playable
from socialai_dsl.vocabulary import NOUN, words

Mode = Literal["text", "json", "tools"]
"""How a model gives its action: in a line of its reply, as a JSON object, or by calling tools."""

_READ: Final = 20_000
"""The most characters of a reply that are read, the last ones."""
_QUOTED: Final = 80
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
_SAYING: Final = frozenset("say says saying said speak ask tell utter".split())
_FILLERS: Final = frozenset(
    "i i'll i'd will would want to let me my next action is move then now please and while also".split()
)

_THOUGHT: Final = re.compile(r"<(think|thinking|reasoning)>.*?(</\1>|\Z)", re.DOTALL | re.IGNORECASE)
_MARK: Final = re.compile(r"(?<![\w\"'])act(?:ion)?[*_`]*\s*:[*_`]*", re.IGNORECASE)
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
    """A reply that was read.

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
        self._slots = {slot.name: tuple(dict.fromkeys(slot.words)) for slot in program.sentences.slots}
        self._movements = {
            tuple(words(said)): action
            for action in self._actions
            for said in (action, *_SYNONYMS.get(action, ()))
        }
        spoken = (program.sentences.text(*one) for one in program.sentences.each())
        self._sentences = list(dict.fromkeys(spoken))
        self._by_words: dict[tuple[str, ...], str] = {}
        for sentence in self._sentences:
            self._by_words.setdefault(tuple(words(sentence)), sentence)
        self._exact = set(self._sentences)

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
            places = _listed(
                [f"one of these nouns for <{NOUN}>" if n == NOUN else f"<{n}>" for n in self._slots]
            )
            filled = places if [*self._slots] == [NOUN] else f"one of these words for each {places} in it"
            lines += ["", f"A sentence is one of these templates with {filled}."]
            lines += [f"Templates: {'; '.join(map(printable, self._templates))}"]
            for name, known in self._slots.items():
                lines += [f"{'Nouns' if name == NOUN else f'<{name}>'}: {'; '.join(map(printable, known))}"]
        return "\n".join([*lines, "", *self._how_to_reply(mode)])

    def write(self, action: Action) -> str:
        """The action as a reply in the mode `text`; `parse` reads it back."""
        said = f'say "{action.sentence}"' if action.sentence is not None else ""
        moved = action.movement if action.movement is not None or said else _STANDING
        return f"Act: {', '.join(part for part in (moved, said) if part)}"

    def parse(self, reply: str) -> Parsed:
        """Read a reply of the modes `text` and `json`.

        What counts is the last JSON object or the last line marked `Act:`, whichever comes later; without either,
        the last line, if it says nothing but an action. Case, quotes, punctuation and markdown do not count, nor
        does what is written before.
        """
        text = conclusion(reply)
        if not text.strip():
            return self._wrong("the reply was empty" if not reply.strip() else "the reply held no action")
        candidates: list[tuple[int, str | dict[str, Any]]] = [*marked(text, _MARK), *objects(text)]
        if candidates:
            _, meant = max(candidates, key=lambda candidate: candidate[0])
            return self._meaning(meant) if isinstance(meant, str) else self._arguments(meant)
        lines = [line for line in text.splitlines() if line.strip(" `*_\t")]
        return self._meaning(lines[-1]) if lines else self._wrong("the reply held no action")

    def parse_calls(self, calls: Sequence[ToolCall]) -> Parsed:
        """Read the tools that a reply calls: the last movement and the last sentence count."""
        if not calls:
            return self._wrong("no tool was called")
        movement = sentence = None
        for call in calls:
            try:
                arguments = json.loads(call.arguments or "{}")
            except (ValueError, RecursionError):
                arguments = None
            if not isinstance(arguments, dict) or call.name not in ("move", "say"):
                return self._wrong(f"{_cited(call.name)} with {_cited(call.arguments)} is no call of a tool")
            parsed = self._arguments(arguments)
            if parsed.action is None:
                return parsed
            movement = parsed.action.movement or movement
            sentence = parsed.action.sentence or sentence
        return Parsed(Action(movement, sentence))

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
        """What a piece of a reply says that is done: a movement, a sentence, or both."""
        bare = content.strip(" \t`*_\"'“”.,;!")
        if bare in self._exact and tuple(words(bare)) not in self._movements:
            return Parsed(Action(None, bare))
        quoted = self._with_quotation(content)
        if quoted is not None:
            return quoted
        said = _without_fillers(words(content))
        movement = self._movements.get(tuple(words(content))) or self._movements.get(tuple(_trimmed(said)))
        if movement:
            return Parsed(_action(movement))
        for start in (0, 1):
            if said[start:] and (start == 0 or said[0] in _SAYING):
                sentence = self._by_words.get(tuple(said[start:]))
                if sentence is not None:
                    return Parsed(Action(None, sentence))
        both = self._both(said)
        return both if both is not None else self._not_understood(content)

    def _with_quotation(self, content: str) -> Parsed | None:
        """Read `forward, say "Where is the exit"`; None where nothing that is quoted can be said."""
        for match in _QUOTATION.finditer(content):
            quoted = match[1] or match[2]
            sentence = quoted if quoted in self._exact else self._by_words.get(tuple(words(quoted)))
            if sentence is None:
                continue
            before = [
                word for word in _without_fillers(words(content[: match.start()])) if word not in _SAYING
            ]
            after = _without_fillers(words(content[match.end() :]))
            movement = self._movements.get(tuple(_trimmed(before)))
            if before and movement is None:
                return self._not_understood(content)
            return Parsed(
                Action(_action(movement or self._movements.get(tuple(after), _STANDING)).movement, sentence)
            )
        return None

    def _both(self, said: Sequence[str]) -> Parsed | None:
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
                    return Parsed(Action(_action(movement).movement, sentence))
        return None

    def _arguments(self, given: Mapping[str, Any]) -> Parsed:
        """Read a JSON object: `move` and `say`, or the arguments of a tool."""
        if isinstance(inner := given.get("arguments", given.get("parameters")), dict):
            given = inner
        moved = next(
            (given[key] for key in ("move", "direction", "action", "movement") if given.get(key)), None
        )
        spoken = next((given[key] for key in ("say", "sentence", "utterance") if given.get(key)), None)
        if spoken is None and isinstance(given.get("template"), str):
            spoken = given["template"]
            for name in self._slots:
                spoken = spoken.replace(f"<{name}>", str(given.get(name, "")))
        movement = sentence = None
        if moved is not None:
            movement = self._movements.get(tuple(words(str(moved)[:_QUOTED])))
            if movement is None:
                return self._wrong(f"{_cited(moved)} is no movement")
        if spoken is not None:
            text = str(spoken)[: 10 * _QUOTED]
            sentence = text if text in self._exact else self._by_words.get(tuple(words(text)))
            if sentence is None:
                return self._unsayable(text)
        if moved is None and spoken is None and not {"move", "say"} & set(given):
            return self._wrong("the object says neither what to do nor what to say")
        return Parsed(Action(_action(movement or _STANDING).movement, sentence))

    def _not_understood(self, content: str) -> Parsed:
        said = _without_fillers(words(content))
        spoken = (said[:1] and said[0] in _SAYING) or _QUOTATION.search(content)
        return self._unsayable(content) if spoken else self._wrong(f"{_cited(content)} is no action")

    def _unsayable(self, text: str) -> Parsed:
        quoted = next((match[1] or match[2] for match in _QUOTATION.finditer(text)), text)
        as_json = partial(json.dumps, ensure_ascii=False)
        hint = suggested(quoted.strip(), self._sentences[:2000], quoted=as_json)
        return self._wrong(f"{_cited(quoted)} cannot be said{hint}")

    def _wrong(self, what: str) -> Parsed:
        """Say what was wrong, and what is possible."""
        fillers = "one of the nouns" if [*self._slots] == [NOUN] else "words in place of <...>"
        sayable = f", and sentences are the templates with {fillers}" if self._sentences else ""
        return Parsed(None, f"{what}. Movements are {', '.join(self._actions)}{sayable}.")


def _action(movement: str) -> Action:
    return Action(None if movement == _STANDING else movement)


def conclusion(reply: str) -> str:
    """The end of a reply, without its reasoning and what cannot be read."""
    readable = "".join(c if c.isprintable() or c == "\n" else " " for c in reply[-_READ:])
    return _THOUGHT.sub(" ", readable)


def marked(text: str, mark: re.Pattern[str]) -> Iterator[tuple[int, str]]:
    """The last line behind a mark that says something, and where it begins."""
    for found in reversed(list(mark.finditer(text))):
        for line in text[found.end() :].splitlines()[:4]:
            if line.strip(" `*_\t"):
                yield found.end(), line
                return


def objects(text: str) -> Iterator[tuple[int, dict[str, Any]]]:
    """The last JSON object of a text, and where it begins."""
    decoder = json.JSONDecoder()
    end = len(text)
    for _ in range(50):
        end = text.rfind("{", 0, end)
        if end < 0:
            return
        try:
            found, _ = decoder.raw_decode(text[end:])
        except (ValueError, RecursionError):
            continue
        # The arguments of a call are an object within an object: the outer one counts.
        if isinstance(found, dict) and found and not text[:end].rstrip().endswith(":"):
            yield end, found
            return


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
