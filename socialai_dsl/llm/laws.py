"""What a model is told before it plays: what is seen and heard, in which order, and what ends an episode."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from socialai_dsl.llm.looks import steps
from socialai_dsl.program import VIEW, EntityColumn, Flag, Header, Program

_ANYWHERE: Final = 1 << 16
"""More steps than a room has."""

_Reach = tuple[int, int]
"""The least and the greatest distance at which a voice is heard, in steps."""


def has(program: Program, flag: Flag) -> bool:
    """Whether a program has a flag."""
    return bool(program.header(Header.FLAGS) & flag)


def sight(programs: Collection[Program]) -> str:
    """What is seen, and how directions are given."""
    blocked = any(has(program, Flag.OCCLUSION) for program in programs)
    told = [
        f"You see the cells up to {VIEW - 1} steps ahead of you and up to {VIEW // 2} steps to your left and "
        f"right{', as far as nothing blocks your sight' if blocked else ''}."
    ]
    egocentric = {has(program, Flag.EGOCENTRIC) for program in programs}
    if True in egocentric:
        told.append(
            'Directions of others are as seen from you; "past you" is opposite to your own direction.'
        )
    if False in egocentric:
        told.append("Directions of others are those of a compass; your own is not given.")
    return " ".join(told)


def hearing(programs: Collection[Program]) -> str:
    """Who hears whom, and how a line begins; empty where nobody can be heard."""
    theirs = {reach for program in programs for reach in _reaches(program)}
    if not theirs:
        return ""
    mine = {_reach(program, 0) for program in programs if program.templates}
    if theirs == mine and len(mine) == 1:
        told = [f"You and others hear each other when you are {_within(mine, 'each other')}."]
    else:
        told = [f"You hear others who are {_within(theirs, 'you')}."]
        told += [f"You are heard by others who are {_within(mine, 'you')}."] if mine else []
    if any(has(program, Flag.OWN_VOICE) for program in programs):
        told.append("You hear yourself as well.")
    if all(program.names_shown for program in programs):
        told.append("A line begins with the name of who says it; names are not seen.")
    tones = dict.fromkeys(tone for program in programs for tone in program.tones)
    if tones:
        words = ", ".join(f"({tone})" for tone in tones)
        told.append(f"A word in brackets before a line is the tone in which it is said: {words}.")
    return " ".join(told)


def order(programs: Collection[Program]) -> str:
    """The order of events within a turn."""
    before = {has(program, Flag.PICTURE_BEFORE_NPCS) for program in programs}
    heard = ", then you are heard" if any(program.templates for program in programs) else ""
    others = "then the others act one after the other"
    if before == {True}:
        return f"In a turn you move first{heard}; you see this moment, {others}, and you hear what they say."
    return f"In a turn you move first{heard}, {others}, then you see and hear the result."


def ending(programs: Collection[Program]) -> str:
    """What ends an episode, in general."""
    turns = max(program.header(Header.HORIZON) for program in programs)
    return f"An episode ends with success, with failure, or after {turns} turns."


def _reaches(program: Program) -> Iterator[_Reach]:
    """Of the voices that the agent can hear."""
    hidden = has(program, Flag.NPCS_HIDDEN)
    for number, entity in enumerate(program.entities):
        audible = program.table(Header.ENTITY_AT)[number, EntityColumn.MANNERS] & 1
        if entity.role == "npc" and (audible or not hidden):
            yield _reach(program, number)


def _reach(program: Program, entity: int) -> _Reach:
    near, far = program.table(Header.ENTITY_AT)[entity, [EntityColumn.NEAR, EntityColumn.FAR]].tolist()
    longest = program.header(Header.CANVAS_WIDTH) + program.header(Header.CANVAS_HEIGHT) - 2 * 3
    return near, (_ANYWHERE if far >= longest else far)


def _within(reaches: Collection[_Reach], whom: str) -> str:
    """`next to you`, `within 3 steps of you`, `anywhere in the room`; of several the farthest, `some only ...`."""
    *others, farthest = (
        _place(*reach, whom) for reach in sorted(reaches, key=lambda reach: (reach[1], -reach[0]))
    )
    return f"{farthest}{''.join(f', some only {other}' for other in others[::-1])}"


def _place(near: int, far: int, whom: str) -> str:
    if far == _ANYWHERE:
        return "anywhere in the room"
    return f"next to {whom}" if near == far == 1 else f"within {steps(far)} of {whom}"
