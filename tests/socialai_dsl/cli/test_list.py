"""`socialai list`: what ships, and what may follow each name."""

import json

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.frontend import check
from socialai_dsl.loader.shipped import catalogue

Capture = pytest.CaptureFixture[str]


def test_each_says_what_it_is_about() -> None:
    entries = catalogue()
    assert {"talkitout", "novel/sally_anne", "school/boxes", "social_env"} <= {one.name for one in entries}
    assert [one.name for one in entries if not one.about] == []
    assert not [one.name for one in entries if one.name.endswith("_oracle")]


@pytest.mark.parametrize(
    "name", ["talkitout_no_liar", "novel/sally_anne", "school/apple_stealing_asocial", "school/levers"]
)
def test_what_is_listed_can_be_loaded(name: str) -> None:
    (entry,) = (one for one in catalogue() if one.name == name)
    assert "oracle" in entry.variants
    specs = [f"{name}+{variant}" for variant in entry.variants]
    specs += [f"{name}?{key}={value}" for key, values in entry.parameters.items() for value in values]
    assert [spec for spec in specs if check(spec).has_errors] == []


def test_the_command(capsys: Capture) -> None:
    assert main(["list", "sally"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "novel/sally_anne"
    assert "    ?moves=mixed (default), control, false_belief" in printed
    assert main(["list", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found[0]["name"] == "talkitout"
    assert {"name", "about", "variants", "parameters"} == set(found[0])


def test_nothing_that_fits_is_a_finding(capsys: Capture) -> None:
    assert main(["list", "no", "such", "thing"]) == 1
