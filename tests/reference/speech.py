"""Utterances: what they are compared with, who hears them, and the tokens that become the agent's history."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from tests.reference.script import Filler, Grammar
from tests.reference.world import Entity, Heard, World, as_list, distance


@dataclass(frozen=True)
class AnyOf:
    """In what an utterance is compared with: all that can stand in a slot."""

    slot: str


def noun_value(noun: str | int) -> str | int:
    """A noun that is a number has that value."""
    return int(noun) if re.fullmatch("-?[0-9]+", str(noun)) else str(noun)


def noun_values(world: World) -> list[str | int]:
    """All nouns of the grammar."""
    return [noun_value(noun) for noun in world.nouns]


def plain(text: str) -> str:
    """A text without case, in plain forms of its letters, and without what only tells how others are shown."""
    return shown(shown(text).casefold())


def shown(text: str) -> str:
    """A text as it looks."""
    seen = [
        c
        for c in unicodedata.normalize("NFKC", text)
        if unicodedata.category(c) != "Cf" and not 0xFE00 <= ord(c) <= 0xFE0F
    ]
    return "".join(seen).replace("\u2019", "'")


def canonical(text: str) -> str:
    """Matching ignores forms of letters, case, final `.`, `!` or `?`, and how many blanks there are."""
    blanks = " ".join(plain(text).split())
    return re.sub(r"[.!?\u3002]+$", "", blanks).strip() or blanks


def meaning(world: World, filler: Filler) -> Any:
    """What a word stands for: something in the room, a number, else itself."""
    if filler.key is None:
        return noun_value(filler.word)
    name, _, number = filler.key.rstrip("]").partition("[")
    return as_list(world.objects[name])[int(number or 0)] if name in world.objects else world.cast[filler.key]


def spelled_in(world: World, slot: str, value: Any) -> str:
    """The word that stands for something in a slot."""
    return next(filler.word for filler in world.fillers[slot] if meaning(world, filler) == value)


def match(pieces: list[str | AnyOf], text: str, world: World) -> dict[str, Any] | None:
    """None if the text is not what was asked for, else what was captured in its slots."""
    asked = list(dict.fromkeys(piece.slot for piece in pieces if isinstance(piece, AnyOf)))
    for chosen in product(*(world.fillers[slot] for slot in asked)):
        words = dict(zip(asked, (filler.word for filler in chosen), strict=True))
        candidate = "".join(words[piece.slot] if isinstance(piece, AnyOf) else str(piece) for piece in pieces)
        if canonical(candidate) == canonical(text):
            return {slot: meaning(world, filler) for slot, filler in zip(asked, chosen, strict=True)}
    return None


def filled(world: World, grammar: Grammar, template: int, *choices: int) -> dict[str, Any]:
    """What stands in the slots of a sentence."""
    return {
        slot: meaning(world, fillers[choice])
        for (slot, fillers), choice in zip(grammar.fillers.items(), choices, strict=True)
        if f"<{slot}>" in grammar.templates[template]
    }


def slots_of(world: World, grammar: Grammar, heard: Heard) -> dict[str, Any]:
    """What stands in the slots of an utterance: what was chosen, else what the sentence has whose text it is."""
    if heard.filled:
        return heard.filled
    for template, *choices in grammar.pairs():
        fits = canonical(grammar.utterance(template, *choices)) == canonical(heard.text)
        if fits and "<" in grammar.templates[template]:
            return filled(world, grammar, template, *choices)
    return {}


def within_earshot(world: World, speaker: Entity, hearer: Entity) -> bool:
    """An utterance carries as far as its speaker's earshot, from where the speaker stands now."""
    # What is said in the turn in which one vanishes is heard from where that was.
    start = speaker.cell or speaker.left_from
    if start is None or hearer.cell is None:
        return False
    reach = world.earshot[speaker.key]
    if reach == "room":
        return True
    apart = distance(start, hearer.cell)
    return apart == 1 if reach == "next_to" else apart <= int(reach)


def speak(
    world: World,
    speaker: Entity,
    text: str,
    filled: dict[str, Any] | None = None,
    to: Entity | None = None,
    tone: str | None = None,
) -> None:
    """Says a line, perhaps addressed to one member: everyone within earshot hears it, players also its tone."""
    if speaker.gone and speaker.left_from is None:
        return
    speaker.utterance = text
    speaker.filled = filled or {}
    for hearer in world.cast.values():
        if hearer is speaker or not within_earshot(world, speaker, hearer):
            continue
        if to not in (None, hearer) and not world.overheard:
            continue
        # "Hidden NPCs: nothing they say reaches the agent, except a member with `audible: always`."
        inaudible = world.npcs_hidden and speaker.key not in world.always_audible
        if hearer is world.agent and inaudible:
            continue
        hearer.inbox.append(Heard(speaker, text, filled or {}, to))
        if not inaudible:
            hearer.lines.append(toned(hearer.inbox[-1], tone))
    if world.own_voice and speaker.taken and not speaker.gone:
        speaker.lines.append(toned(Heard(speaker, text, filled or {}, to), tone))


def toned(heard: Heard, tone: str | None) -> Heard:
    """A line as players hear it."""
    return heard if tone is None else replace(heard, text=f"({tone}) {heard.text}")


def in_speaking_order(world: World, inbox: list[Heard]) -> list[Heard]:
    """What was heard in a turn, the agent's first, then in cast order."""
    return sorted(inbox, key=lambda heard: world.members.index(heard.speaker))


def pair(world: World, grammar: Grammar, number: int) -> tuple[str, dict[str, Any]]:
    """The text of an utterance by its number, counted from 1, and what stands in its slots."""
    spoken = grammar.pairs()[number - 1]
    return grammar.utterance(*spoken), filled(world, grammar, *spoken)


UNSPACED = (
    *("THAI", "LAO", "MYANMAR", "KHMER", "HIRAGANA", "HENTAIGANA", "KATAKANA"),
    *("CJK", "IDEOGRAPHIC", "VERTICAL IDEOGRAPHIC", "HANGZHOU"),
)
"""How the names of letters begin in scripts without blanks."""


def words(text: str) -> list[str]:
    """Runs of letters, digits and apostrophes, with their marks; letters of scripts without blanks stand alone."""
    return [part for part in parts(plain(text)) if part[0].isalnum() or part[0] == "'"]


def spelt(text: str, telling: Collection[str]) -> list[str]:
    """The words of a line, but its telling parts as they are written."""
    heard: list[str] = []
    for part in parts(" ".join(shown(text).split())):
        heard += [part] if part in telling else words(part)
    return heard


def parts(text: str) -> list[str]:
    """A text cut into words and single characters between them."""
    pattern = ""
    for c in text:
        kind = unicodedata.category(c)[0]
        letter = c.isalnum() or c in "'\u0345"
        alone = letter and unicodedata.name(c, "").startswith(UNSPACED)
        pattern += "A" if alone else "L" if letter else "M" if kind == "M" else " "
    return [text[m.start() : m.end()] for m in re.finditer("AM*|L[LM]*|.", pattern)]


def telling_parts(lines: Iterable[str]) -> set[str]:
    """The parts that differ in lines with the same words, between what all of these begin and end with."""
    alike: dict[str, list[list[str]]] = {}
    for line in lines:
        alike.setdefault(" ".join(words(line)), []).append(parts(" ".join(shown(line).split())))
    found: set[str] = set()
    for group in alike.values():
        while all(group) and len({one[0] for one in group}) == 1:
            group = [one[1:] for one in group]
        while all(group) and len({one[-1] for one in group}) == 1:
            group = [one[:-1] for one in group]
        found.update(part for one in group for part in one)
    return found
