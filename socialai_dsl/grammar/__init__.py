"""The small language inside YAML strings: expressions, places, activities, effects and texts."""

from socialai_dsl.grammar.parser import ParseProblem, parse_expression, parse_text
from socialai_dsl.grammar.unparse import unparse

__all__ = ["ParseProblem", "parse_expression", "parse_text", "unparse"]
