"""What a reply states in the end: its thoughts, tags and tokens are taken away, then its last statements are found.

All time is linear in the length of the reply.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

_READ: Final = 20_000
"""The most characters of a reply without its thoughts that are read, the last ones."""
_LOOKED_AT: Final = 50
"""The most marks and JSON objects that are looked at, the last ones of each."""
_TOGETHER: Final = 8
"""The most different statements that can stand together before it is plain that they do not agree."""

_THOUGHTS: Final = frozenset(
    "think thinking thought thoughts reason reasoning analysis reflection scratchpad scratch_pad cot monologue "
    "inner_monologue internal_monologue seed:think antml:thinking antthinking".split()
)
"""Tags around thoughts."""
_BRACKETS: Final = {
    "[think]": "[/think]",
    "◁think▷": "◁/think▷",
    "<|start_thinking|>": "<|end_thinking|>",
    "<|begin_of_thought|>": "<|end_of_thought|>",
    "<|inner_prefix|>": "<|inner_suffix|>",
    "<unused94>": "<unused95>",
}
"""Thoughts between other marks."""
_CHANNEL: Final = "channel"
"""Thoughts in a channel of their own, which another channel ends."""
_END_OF_CHANNEL: Final = r"<\|channel\|>\s{0,3}(?:final|commentary\s{0,3}to=)|<channel\|>"
_ANSWERS: Final = frozenset("answer action act final_answer finalanswer".split())
"""Tags around what is meant."""
_FRAMES: Final = frozenset(
    "final response output solution result reply decision move tool_call tool_calls function_call json".split()
)
"""Tags around more than that."""
_EMPHASIS: Final = frozenset("b strong i em u code kbd tt".split())
_ENDS: Final = frozenset(["</s>", "<eos>", "<end_of_turn>", "<turn|>", "[eos]"])
"""Tokens that end a turn and are written otherwise than `<|im_end|>`."""
_TOKEN_OF_AN_END: Final = re.compile(
    r"(?!.*(?:header|role|tool))(?:(?:.*[_▁])?(?:end|eo[tms]).*|return|call|stop|user|human|observation)"
)
_TAG: Final = re.compile(
    r"<(?:(?=[\sa-z/])\s?/?\s?(?P<name>[a-z_:]{1,20}(?:9\d)?)(?:\||\s[^<>\n]{0,200})?>"
    r"|(?=[|｜]).(?:(?P<channel>channel\|?>\s{0,3}(?:analysis|thought|final|commentary(?:\s{0,3}to=)?))"
    r"|(?P<token>[^<>|｜\n]{1,40})[|｜]>))"
    r"|\[(?:/?think|eos)\]|◁/?think▷"
    r"|\\boxed\{(?P<boxed>[^{}\n]{0,500})\}",
    re.IGNORECASE,
)
_MOST_TAGS: Final = 500
"""The most tags that are read outside of thoughts; a reply with more of them says nothing."""
_NEXT_TURN: Final = re.compile(r"^[#* ]{0,6}(?:User|Human)\**:", re.MULTILINE)
"""Where a model goes on with what others say, without a token."""
_MARKUP: Final = " `*_\t"
_COLON: Final = "[:：﹕∶꞉]"
_BEFORE_A_MARK: Final = re.compile(
    r"(?:^(?:[^\w\n]|_){0,20}|[.!?…:：;)\]>|–—→-][ \t*_`]{0,10})"
    r"(?:(?:so|therefore|thus|my|the|final|chosen)[ \t]{1,3}){0,4}(?<![\"'“‘{])\Z",
    re.IGNORECASE,
)
_LOOKED_BACK: Final = 48
_BRACE: Final = re.compile(r"\\.|[\"{}\n]")
_FENCE: Final = re.compile(r"```\w*")

Statement = str | dict[str, Any]
"""The rest of a line behind a mark, or a JSON object."""


def mark(word: str, sign: str = _COLON) -> re.Pattern[str]:
    """The pattern of a mark such as `Act:`."""
    return re.compile(rf"{word}[*_`]{{0,4}}[ \t]{{0,3}}{sign}[*_`]{{0,4}}", re.IGNORECASE)


@dataclass(frozen=True)
class Conclusion:
    """What a reply states in the end.

    Attributes:
        statements: those that stand together at its end, with no words in between. The last one counts, and the others
            must not contradict it.
        last_line: behind them; empty if nothing follows.
    """

    statements: list[Statement]
    last_line: str = ""


def conclusion(text: str, pattern: re.Pattern[str], key: str = "") -> Conclusion:
    """The statements at the end of a text: JSON objects, and lines with a mark.

    Args:
        text: a reply, see `readable`.
        pattern: of the mark, see `mark`.
        key: that an object must have, if any.
    """
    stated = (one for one in _objects(text) if not key or key in one[2])
    found = sorted([*stated, *_marked(text, pattern)], key=lambda one: one[0])
    found = [one for one, inner in zip(found, _are_inner(found), strict=True) if not inner]
    if not found:
        return Conclusion([])
    together: list[Statement] = []
    for number in range(len(found) - 1, -1, -1):
        _, end, statement = found[number]
        if together and _has_words(text[end : found[number + 1][0]]):
            break
        if statement not in together:
            together.insert(0, statement)
        if len(together) > _TOGETHER:
            break
    rest = lines_of(text[found[-1][1] :])
    return Conclusion(together, rest[-1] if rest else "")


def readable(reply: str, word: str) -> str:
    """The end of a reply, without thoughts, tags and tokens.

    Args:
        reply: all of it.
        word: of the mark that stands for a tag such as `<answer>`.
    """
    text = _without_tags(_without_analysis(reply), word)
    others = _NEXT_TURN.search(text)
    if others is not None and text[: others.start()].strip():
        text = text[: others.start()]
    if len(text) > _READ:
        # Half a line might mean something else.
        text = text[-_READ:].partition("\n")[2]
    whole = text.strip()
    quoted = len(whole) > 1 and whole[0] == whole[-1] == '"' and whole.count('"') == 2
    return "".join(c if c.isprintable() or c == "\n" else " " for c in (whole[1:-1] if quoted else text))


def lines_of(text: str) -> list[str]:
    """The lines that hold more than markup."""
    return [line for line in _FENCE.sub("", text).splitlines() if line.strip(_MARKUP)]


def _without_analysis(reply: str) -> str:
    """A reply without the thoughts of a model whose tokens for channels were dropped, so that their names are left."""
    if not re.match("analysis[A-Z]", reply):
        return reply
    return reply.partition("assistantfinal")[2]


def _without_tags(text: str, word: str) -> str:
    """What stands outside of thoughts, up to the token that ends the turn.

    Thoughts that nothing ends go on to the end of the text. Where some end that did not begin, the prompt has begun
    them, and all before belongs to them. A model that goes on behind the end of its turn makes up what others say.
    """
    kept: list[str] = []
    at, said = 0, False
    for _ in range(_MOST_TAGS):
        found = _TAG.search(text, at)
        if found is None:
            return "".join([*kept, text[at:]])
        kept.append(text[at : found.start()])
        at, said = found.end(), said or not (kept[-1] == "" or kept[-1].isspace())
        match _meaning(found, word):
            case _Thoughts(closing=None):
                kept, said = [], False
            case _Thoughts(closing=str(closing)):
                end = re.compile(closing, re.IGNORECASE).search(text, at)
                if end is None:
                    return "".join(kept)
                kept.append("\n")
                at = end.end()
            case None if said:
                return "".join(kept)
            case str(instead):
                kept.append(instead)
            case _:
                kept.append("\n")
    return ""


class _Thoughts(NamedTuple):
    """A tag that opens thoughts, with the pattern that closes them, or that closes some: None."""

    closing: str | None


def _meaning(found: re.Match[str], word: str) -> _Thoughts | str | None:
    """What a tag does with thoughts, or what to read instead of it; None for the end of a turn."""
    sign = found[0].lower()
    if found["channel"] is not None or sign == "<channel|>":
        aside = sign.endswith(("analysis", "thought", "commentary"))
        return _Thoughts(_END_OF_CHANNEL if aside else None)
    if sign in _BRACKETS or sign in _BRACKETS.values():
        return _Thoughts(re.escape(_BRACKETS[sign]) if sign in _BRACKETS else None)
    if sign in _ENDS:
        return None
    if found["boxed"] is not None:
        return f"\n{word}: {found['boxed']}\n"
    if found["token"] is not None:
        return None if _TOKEN_OF_AN_END.fullmatch(found["token"].lower()) else "\n"
    return _instead_of(found["name"].lower(), "/" in sign[:3], found[0], word)


def _instead_of(name: str, closes: bool, tag: str, word: str) -> _Thoughts | str:
    """What stands for a tag with a name."""
    if name in _THOUGHTS:
        return _Thoughts(None if closes else rf"<\s?/\s?{name}(?:\s[^<>\n]{{0,200}})?>")
    if name in _ANSWERS and not closes:
        return f"\n{word}: "
    if name in _ANSWERS or name in _FRAMES:
        return "\n"
    return " " if name in _EMPHASIS else tag


Place = tuple[int, int, Statement]
"""Where a statement begins and ends, and what it is."""


def _marked(text: str, pattern: re.Pattern[str]) -> Iterator[Place]:
    """What stands behind each mark: the rest of its line, or the next line that says something."""
    marks = [found for found in list(pattern.finditer(text))[-_LOOKED_AT:] if _begins(text, found.start())]
    for number, found in enumerate(marks):
        limit = marks[number + 1].start() if number + 1 < len(marks) else len(text)
        start = found.end()
        for _ in range(4):
            end = text.find("\n", start, limit)
            end = limit if end < 0 else end
            if text[start:end].strip(_MARKUP):
                yield found.start(), end, text[start:end]
                break
            start = end + 1
            if start >= limit:
                break


def _begins(text: str, at: int) -> bool:
    """Whether a mark begins a line or follows a sentence; in `My last action: left` it is a part of one."""
    start = max(0, at - _LOOKED_BACK)
    *earlier, line = text[start:at].split("\n")
    return _BEFORE_A_MARK.search(line if earlier or start == 0 else f"x{line}") is not None


def _objects(text: str) -> Iterator[Place]:
    """The last JSON objects that are in no other."""
    spans: list[tuple[int, int]] = []
    opened: list[int] = []
    quoted = False
    for found in _BRACE.finditer(text) if "{" in text else ():
        sign = found[0]
        if sign == '"':
            quoted = bool(opened) and not quoted
        elif sign == "\n":
            quoted = False
        elif sign == "{" and not quoted:
            opened.append(found.start())
        elif sign == "}" and opened and not quoted:
            start = opened.pop()
            while spans and spans[-1][0] > start:
                spans.pop()
            spans.append((start, found.end()))
    for start, end in spans[-_LOOKED_AT:]:
        try:
            found_object = json.loads(text[start:end], object_pairs_hook=plain)
        except (ValueError, RecursionError):
            continue
        if found_object:
            yield start, end, found_object


def plain(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON; a key that is given two values has a list of both, which is no action."""
    found: dict[str, Any] = {}
    for key, value in pairs:
        found[key] = [found[key], value] if key in found and found[key] != value else value
    return found


def _are_inner(found: Sequence[Place]) -> Iterator[bool]:
    """Of each statement, whether it is but a part of another one.

    A mark in a text of an object marks nothing, an object within a marked line is no statement, and
    `Act: {"move": "left"}` is the object alone.
    """
    end = 0
    for number, (start, own_end, statement) in enumerate(found):
        following = found[number + 1 : number + 2]
        is_head = isinstance(statement, str) and statement.lstrip(_MARKUP)[:1] == "{"
        inner = start < end or (is_head and bool(following) and isinstance(following[0][2], dict))
        end = end if inner else own_end
        yield inner


def _has_words(between: str) -> bool:
    """Whether anything is said between two statements; a number in a list says nothing."""
    return any(map(str.isalpha, _FENCE.sub("", between)))
