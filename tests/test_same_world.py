"""What differs for one mind differs for all: trained agents, language models and people get the same world."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import socialai_dsl as sd
from socialai_dsl.program import Header, LineColumn, Program
from socialai_dsl.program_suite import Playable
from socialai_dsl.vocabulary import composed
from tests.quick import one_in
from tests.test_agreement import shipped

SUITES = (
    "social_env",
    "diverse_exit",
    "school/apple_stealing_suite",
    "school/collaboration",
    "school/information_seeking",
    "school/role_reversal",
)


def lines_of(program: Program) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Each line as it looks, with its tokens."""
    table, at = program.table(Header.LINE_AT).tolist(), program.header(Header.TOKEN_AT)
    for line, row in zip(program.lines, table, strict=True):
        first, count = row[LineColumn.FIRST_TOKEN], row[LineColumn.TOKENS]
        tokens = program.words[at + first : at + first + count].tolist()
        yield " ".join(composed(line).split()), tuple(tokens)


def differ_alike(program: Program) -> bool:
    """Whether lines differ as tokens exactly if they differ as they look."""
    lines = set(lines_of(program))
    return len(lines) == len({look for look, _ in lines}) == len({tokens for _, tokens in lines})


def members(program: Playable) -> tuple[Program, ...]:
    """The programs of a suite, or the one."""
    return (program,) if isinstance(program, Program) else program.programs


@pytest.mark.parametrize("name", one_in(12, [*shipped(), *SUITES], "compiles every scenario"))
def test_lines_differ_for_a_trained_agent_where_they_differ_for_others(name: str) -> None:
    for program in members(sd.compile(sd.load(name))):
        assert differ_alike(program), program.name
