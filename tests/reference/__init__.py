"""A slow, readable interpreter of the scenario language: the judge of compiler and engine."""

from tests.reference.interpreter import Action, Reference, Result

__all__ = ["Action", "Reference", "Result"]
