"""TalkItOut written by hand, in C and for Numba: the speed limit of an engine that does nothing else."""

from benchmarks.limits.compiled_c import CompiledC, has_compiler, has_permutes
from benchmarks.limits.compiled_numba import CompiledNumba
from benchmarks.limits.workload import WORDS, HardCoded, Rooms

__all__ = ["WORDS", "CompiledC", "CompiledNumba", "HardCoded", "Rooms", "has_compiler", "has_permutes"]
