"""What a member of the cast sees: the cells of which `sees` holds, as the engine answers it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.envs.asking import Companion
from socialai_dsl.program import CELL, place_of
from socialai_dsl.semantics import terms
from socialai_dsl.semantics.plans import CheckedScenario, Drawn, ProbePlan
from socialai_dsl.vocabulary import TRUTHS


class Gaze(Companion):
    """Plays along with one environment, see `Companion`, and knows which cells a member of the cast sees.

    Args:
        loaded: what the environment plays.
        checked: the scenario that has the member; of a suite that of one of its members.
        number: of the member, as `Entity.number` has it.
        own: see `Companion`.
    """

    def __init__(self, loaded: Loaded, checked: CheckedScenario, number: int, own: int | None = None) -> None:
        super().__init__(_asking(loaded, checked, number), own)

    def cells(self, begins: bool = False) -> frozenset[tuple[int, int]]:
        """The cells that it sees now, x and y; none where the episode plays another scenario of the suite.

        Args:
            begins: whether the episode has just begun.
        """
        answers = self.values(begins).items()
        return frozenset(place_of(int(name)) for name, answer in answers if answer == TRUTHS[True])


def _asking(loaded: Loaded, checked: CheckedScenario, number: int) -> Loaded:
    """The same with a probe for each cell, and no others."""
    if isinstance(loaded, LoadedSuite):
        return replace(loaded, members=tuple(_with_probes(one, checked, number) for one in loaded.members))
    return _with_probes(loaded, checked, number)


def _with_probes(loaded: LoadedScenario, checked: CheckedScenario, number: int) -> LoadedScenario:
    probes = tuple(_probes(checked, number)) if loaded.checked is checked else ()
    return replace(loaded, checked=replace(loaded.checked, probes=probes))


def _probes(checked: CheckedScenario, number: int) -> Iterator[ProbePlan]:
    """Whether a member sees a cell, for all cells of the largest room."""
    width, height = checked.room.canvas
    span = checked.entities[number].span
    for cell in (CELL + 32 * y + x for y in range(height) for x in range(width)):
        seen = terms.Sees(terms.entity(number), terms.Const(terms.CELL, cell))
        site = f"probes.{cell}"
        value = Drawn(site, terms.BOOL, terms.SitedTerm(seen, site, span))
        yield ProbePlan(str(cell), span, None, (), value, ())
