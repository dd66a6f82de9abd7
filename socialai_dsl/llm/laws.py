"""What a model is told before it plays: who plays, what is seen and heard, in which order, what ends an episode."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from socialai_dsl.diagnostics import printable
from socialai_dsl.llm.looks import steps
from socialai_dsl.program import VIEW, EntityColumn, Flag, Header, Program

_ANYWHERE: Final = 1 << 16
"""More steps than a room has."""

_COUNTS: Final = ("one", "two", "three", "four", "five", "six", "seven", "eight")
_PLACES: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")

_Reach = tuple[int, int]
"""The least and the greatest distance at which a voice is heard, in steps."""


def has(program: Program, flag: Flag) -> bool:
    """Whether a program has a flag."""
    return bool(program.header(Header.FLAGS) & flag)


def players(programs: Collection[Program], name: str | None) -> str:
    """That there are several players, and which body is one's own unless that is hidden; empty for one seat.

    Args:
        programs: that may be played.
        name: by which others hear this player; None where it is not known.
    """
    count = _seats(programs)
    if count == 1:
        return ""
    named = "" if name is None or _are_hidden(programs) else f"{printable(name)}, "
    return (
        f"You are {named}one of {_COUNTS[count - 1]} players, each with a body of its own: you move and speak with "
        "yours, and see and hear from where it stands. Once it is out of the room, you see nothing but walls."
    )


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


def hearing(programs: Collection[Program], seat: str) -> str:
    """Who hears whom, and how a line begins, for the player of a seat; empty where nobody can be heard."""
    theirs = {reach for program in programs for reach in _reaches(program, body(program, seat))}
    if not theirs:
        return ""
    mine = {_reach(program, body(program, seat)) for program in programs if program.templates}
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


def order(programs: Collection[Program], seat: str) -> str:
    """The order of events within a turn, for the player of a seat."""
    before = {has(program, Flag.PICTURE_BEFORE_NPCS) for program in programs}
    speaks = any(program.templates for program in programs)
    if _seats(programs) == 1:
        begins = f"In a turn you move first{', then you are heard' if speaks else ''}"
    else:
        number = [str(entity) for entity in next(iter(programs)).seats].index(seat)
        own = "" if _are_hidden(programs) else f", you {_PLACES[number]}"
        heard = ", then they are heard in the same order" if speaks else ""
        begins = f"In a turn the players move one after the other{own}{heard}"
    others = "then the others act one after the other"
    if before == {True}:
        return f"{begins}; you see this moment, {others}, and you hear what they say."
    return f"{begins}, {others}, then you see and hear the result."


def pushing(programs: Collection[Program], seat: str) -> str:
    """That others can push one's own body; empty where they cannot."""
    if not any(is_pushed(program, seat) for program in programs):
        return ""
    return "Who walks into you pushes you one step the same way, if that cell is free."


def is_pushed(program: Program, seat: str) -> bool:
    """Whether others can push the body of a seat."""
    manners = program.table(Header.ENTITY_AT)[body(program, seat), EntityColumn.MANNERS]
    return bool(manners & 2)


def body(program: Program, seat: str) -> int:
    """The number of the entity that the player of a seat has."""
    return [str(entity) for entity in program.entities].index(seat)


def _are_hidden(programs: Collection[Program]) -> bool:
    """Whether players are not to know which of them they are."""
    return any(has(program, Flag.SEATS_HIDDEN) for program in programs)


def _seats(programs: Collection[Program]) -> int:
    return max(len(program.seats) for program in programs)


def ending(programs: Collection[Program]) -> str:
    """What ends an episode, in general."""
    turns = max(program.header(Header.HORIZON) for program in programs)
    return f"An episode ends with success, with failure, or after {turns} turns."


def _reaches(program: Program, own: int) -> Iterator[_Reach]:
    """Of the voices that a body can hear."""
    hidden = has(program, Flag.NPCS_HIDDEN)
    for number, entity in enumerate(program.entities):
        audible = program.table(Header.ENTITY_AT)[number, EntityColumn.MANNERS] & 1
        speaks = entity.role == "npc" or (number == 0 and program.templates)
        if number != own and speaks and (audible or not hidden):
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
