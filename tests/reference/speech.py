"""Utterances: what they are compared with, who hears them, and the tokens that become the agent's history."""

from __future__ import annotations

import re
from typing import Any

from tests.reference.script import Grammar
from tests.reference.world import Entity, Heard, World, distance

ANY_NOUN = None


def noun_value(noun: str | int) -> str | int:
    """A noun that is a number has that value."""
    return int(noun) if str(noun).isdigit() else str(noun)


def noun_values(world: World) -> list[str | int]:
    """All nouns of the grammar."""
    return [noun_value(noun) for noun in world.nouns]


def canonical(text: str) -> str:
    """Matching ignores case, a final `.`, `!` or `?`, and how many blanks there are."""
    return re.sub(r"[.!?]$", "", " ".join(text.split())).lower()


def match(pieces: list[str | None], text: str, world: World) -> dict[str, Any] | None:
    """None if the text is not what was asked for, else what was captured: `noun` where any noun fits."""
    if ANY_NOUN not in pieces:
        return {} if canonical("".join(str(piece) for piece in pieces)) == canonical(text) else None
    for noun in world.nouns:
        candidate = "".join(str(noun) if piece is ANY_NOUN else str(piece) for piece in pieces)
        if canonical(candidate) == canonical(text):
            return {"noun": noun_value(noun)}
    return None


def noun_of(grammar: Grammar, heard: Heard) -> str | int | None:
    """The noun of an utterance: the one that was chosen, else that of the template whose text it is."""
    if heard.noun is not None:
        return heard.noun
    for template, noun in grammar.pairs():
        fits = canonical(grammar.utterance(template, noun)) == canonical(heard.text)
        if fits and "<noun>" in grammar.templates[template]:
            return noun_value(grammar.nouns[noun])
    return None


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


def speak(world: World, speaker: Entity, text: str, noun: str | int | None = None) -> None:
    """Says something: it reaches every member of the cast within earshot, and the agent's history."""
    if speaker.gone and speaker.left_from is None:
        return
    speaker.utterance = text
    speaker.noun = noun
    for hearer in world.cast.values():
        if hearer is speaker or not within_earshot(world, speaker, hearer):
            continue
        # "Hidden NPCs: nothing they say reaches the agent, except a member with `audible: always`."
        if hearer is world.agent and world.npcs_hidden and speaker.key not in world.always_audible:
            continue
        hearer.inbox.append(Heard(speaker, text, noun))
        if hearer is world.agent:
            world.lines.append((speaker, text))
    if speaker is world.agent and world.own_voice:
        world.lines.append((speaker, text))


def in_speaking_order(world: World, inbox: list[Heard]) -> list[Heard]:
    """What was heard in a turn, the agent's first, then in cast order."""
    order = [world.agent, *world.npcs]
    return sorted(inbox, key=lambda heard: order.index(heard.speaker))


def pair(grammar: Grammar, number: int) -> tuple[str, str | int]:
    """The text and noun of an utterance by its number, counted from 1."""
    template, noun = grammar.pairs()[number - 1]
    return grammar.utterance(template, noun), noun_value(grammar.nouns[noun])


def words(text: str) -> list[str]:
    """Lower-cased maximal runs of letters, digits and apostrophes."""
    return re.findall(r"[a-z0-9']+", text.lower())
