"""What `load` returned to what environments are made of."""

from __future__ import annotations

from typing import overload

from socialai_dsl.checking import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.compiler import compile_asking, compile_probed, compile_scenario
from socialai_dsl.compiler.probes import Part, Probe, Probed, Value
from socialai_dsl.compiler.questions import ProbeNotes
from socialai_dsl.compiler.questions import Text as NotedText
from socialai_dsl.program import Program
from socialai_dsl.program_suite import ProgramSuite
from socialai_dsl.semantics.plans import Checked

__all__ = [
    "NotedText",
    "Part",
    "Probe",
    "ProbeNotes",
    "Probed",
    "Value",
    "compile_asking_loaded",
    "compile_loaded",
    "compile_probed",
    "scenarios_of",
]


@overload
def compile_loaded(loaded: LoadedScenario) -> Program: ...
@overload
def compile_loaded(loaded: LoadedSuite) -> ProgramSuite: ...
@overload
def compile_loaded(loaded: Loaded) -> Program | ProgramSuite: ...


def compile_loaded(loaded: Loaded) -> Program | ProgramSuite:
    """The program of a scenario, or the programs of a suite.

    Raises:
        ValueError: it was not loaded yet.
    """
    if isinstance(loaded, LoadedScenario):
        return compile_scenario(loaded.checked)
    if not isinstance(loaded, LoadedSuite):
        raise ValueError(f"compile: got {loaded!r}; expected what `load` returns")
    return _suite(loaded, tuple(compile_scenario(member.checked) for member in loaded.members))


def compile_asking_loaded(
    loaded: Loaded,
) -> tuple[Program | ProgramSuite, tuple[tuple[ProbeNotes, ...], ...]]:
    """Programs that do the same as those of `compile_loaded` and note what `probes` ask about; and where they do.

    Returns:
        The program or suite, and for each of its programs the notes of its probes.
    """
    asking = tuple(map(compile_asking, scenarios_of(loaded)))
    programs = tuple(one.program for one in asking)
    playable = _suite(loaded, programs) if isinstance(loaded, LoadedSuite) else programs[0]
    return playable, tuple(one.probes for one in asking)


def _suite(loaded: LoadedSuite, programs: tuple[Program, ...]) -> ProgramSuite:
    space = loaded.space
    return ProgramSuite(
        loaded.name,
        programs,
        loaded.member_names,
        space.actions,
        space.templates,
        space.nouns,
        space.template_maps,
        space.noun_maps,
        loaded.labels,
        loaded.weights,
        tuple(None if start is None else start.layout for start in loaded.starts),
        loaded.in_sequence,
    )


def scenarios_of(loaded: Loaded) -> tuple[Checked, ...]:
    """The scenarios of what was loaded, in the order of the programs that `compile_loaded` makes of them."""
    return tuple(
        member.checked for member in (loaded.members if isinstance(loaded, LoadedSuite) else (loaded,))
    )
