"""A small scenario whose parts each test replaces."""

from __future__ import annotations

import copy

import pytest
import yaml

from socialai_dsl.frontend import check

BASE = {
    "scenario": "small",
    "horizon": 20,
    "grammar": {
        "templates": ["Where is <noun>", "Here is <noun>", "How are <noun>"],
        "nouns": ["sesame", "the exit", "you", "red", "blue", 0, 1, 2, 3],
    },
    "room": {"size": "5..8"},
    "objects": {"doors": {"type": "door", "count": 4, "place": "each_wall(2)", "color": "distinct"}},
    "let": {"exit": "pick(doors)"},
    "cast": {"guide": {"name": "Gus"}, "agent": {}},
    "outcome": [{"success": "agent.at(exit)"}],
}


class Plainly(yaml.SafeDumper):
    """Writes what is there twice twice: the language has no anchors."""

    def ignore_aliases(self, data):
        return True


@pytest.fixture
def examine(tmp_path):
    """Check the base scenario with some of its sections changed; `None` takes a section out, `remove` members."""

    def examined(remove=(), **sections):
        data = copy.deepcopy(BASE)
        for key, value in sections.items():
            if isinstance(value, dict) and isinstance(data.get(key), dict):
                data[key] = {**data[key], **value}
            else:
                data[key] = value
        for member in remove:
            del data["cast"][member]
        file = tmp_path / "small.yaml"
        kept = {key: value for key, value in data.items() if value is not None}
        file.write_text(yaml.dump(kept, Dumper=Plainly, sort_keys=False))
        return check(file)

    return examined


@pytest.fixture
def meaning(examine):
    """The checked scenario; fails with the findings if there are errors."""

    def meant(**sections):
        result = examine(**sections)
        assert result.checked is not None, [str(d) for d in result.diagnostics]
        return result.checked

    return meant


@pytest.fixture
def mistakes(examine):
    """The codes and messages of the findings."""

    def found(**sections):
        return [f"{d.code} {d.text}" for d in examine(**sections).diagnostics]

    return found


@pytest.fixture
def outcome_term(meaning):
    """The term of an expression used as an outcome."""

    def term(expression, **sections):
        return meaning(outcome=[{"success": expression}], **sections).outcomes[0].condition.term

    return term
