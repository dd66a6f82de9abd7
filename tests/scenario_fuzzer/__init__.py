"""Random scenarios as text: whole files of the language, valid by construction, each made by one seed."""

from tests.scenario_fuzzer.author import write, write_asking, write_furnished, write_seated

__all__ = ["write", "write_asking", "write_furnished", "write_seated"]
