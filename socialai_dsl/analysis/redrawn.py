"""Programs that differ only in the draws at some sites, and those draws in words."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Final

from socialai_dsl.draws import GOLDEN, mix
from socialai_dsl.draws import site as number_of
from socialai_dsl.program import Header, Program
from socialai_dsl.semantics.plans import CheckedScenario, Coloring, Drawn, Facing, Placing
from socialai_dsl.semantics.terms import Quantification, SitedTerm, walk

_SITE_MASK: Final = (1 << 31) - 1


Site = tuple[int, int]
"""A site of a draw: its hash and its number (`draws`)."""


def redrawn(program: Program, sites: Collection[Site], salt: int) -> Program:
    """The program with other draws at some sites, of those it has; salt 0 changes nothing.

    Programs that have a site in common draw the same there with the same salt.
    """
    if salt == 0:
        return program
    other = replace(program, words=program.words.copy())
    table = other.table(Header.SITE_AT)
    for row, site in enumerate(sites_of(program)):
        if site in sites:
            table[row, 0] = mix(site[0] + salt * GOLDEN) & _SITE_MASK
    return other


def redrawn_each(program: Program, sites: Collection[Site], copies: int) -> list[Program]:
    """For each site as many programs that draw something else there, and nothing else."""
    return [redrawn(program, [site], salt) for site in sites for salt in range(1, copies + 1)]


def sites_of(program: Program) -> list[Site]:
    """The sites of a program."""
    return [(number, member) for number, member in program.table(Header.SITE_AT).tolist()]


def names_of_sites(checked: CheckedScenario, program: Program) -> dict[Site, str | None]:
    """What is drawn at each site, in words: "`exit`"; None for what is not drawn at reset."""
    paths = {number_of(path): path for path in _paths(checked)}
    return {site: _said(paths[site[0]]) if site[0] in paths else None for site in sites_of(program)}


def _paths(checked: CheckedScenario) -> Iterator[str]:
    """The sites of what a reset draws."""
    yield from ("room.width", "room.height")
    for item in checked.setup:
        match item:
            case Drawn(value=SitedTerm(site=site)):
                yield site
            case Placing():
                yield from (item.site, item.where_site)
            case Coloring() | Facing():
                yield item.site
                if item.value is not None:
                    yield item.value.site
        yield from (part.site for part in walk(item) if isinstance(part, Quantification) and part.site)


def _said(path: str) -> str:
    """`let.exit` as "`exit`", `cast.ada.cell` as "where `ada` is put"."""
    match path.split("."):
        case ["room", "width" | "height" as side]:
            return f"the {side} of the room"
        case ["cast" | "objects", name, "cell"]:
            return f"where `{name}` is put"
        case ["cast" | "objects", name, key]:
            return f"the {key} of `{name}`" if key != "inside" else f"what `{name}` lies in"
        case ["let", name]:
            return f"`{re.sub(r'[^A-Za-z0-9_].*', '', name)}`"
    return f"`{path}`"
