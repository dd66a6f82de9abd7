"""Which objects may share a cell with other objects, as far as the program tells."""

from __future__ import annotations

from functools import lru_cache

from socialai_dsl.program import CONSTANT, EntityColumn, Flag, Header, Op, Program, TypeColumn


@lru_cache(maxsize=256)
def may_lie_over(program: Program) -> frozenset[int]:
    """Numbers of the objects that other objects may lie on or under.

    Those are the ones that can be walked on, what is put where something may be already, and, where things roll or are
    put somewhere in the course of an episode, all of them.
    """
    objects = {number for number, entity in enumerate(program.entities) if entity.role == "object"}
    ops = program.code[:, 0]
    if program.header(Header.FLAGS) & Flag.ROLLS or (ops == Op.PLACE).any():
        return frozenset(objects)
    return frozenset(number for number in objects if _is_walkable(program, number)) | _put_anywhere(program)


def _is_walkable(program: Program, number: int) -> bool:
    """Whether an object can be walked on in one of its statuses."""
    first = int(program.table(Header.ENTITY_AT)[number, EntityColumn.TYPE])
    statuses = slice(first, first + len(program.entities[number].states))
    return bool(program.table(Header.TYPE_AT)[statuses, TypeColumn.WALKABLE].any())


def _put_anywhere(program: Program) -> frozenset[int]:
    """What is put on a drawn cell that need not be free."""
    found: set[int] = set()
    drawn = free = False
    for op, entity, _, _ in program.code.tolist():
        if op == Op.B_FREE:
            free = True
        elif op == Op.PICK_CELL:
            drawn = True
        elif op == Op.PUT:
            if drawn and not free and entity >= CONSTANT // 2:
                found.add(entity - CONSTANT)
            drawn = free = False
    return frozenset(found)
