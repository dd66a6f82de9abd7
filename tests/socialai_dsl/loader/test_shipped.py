"""Which files are scenarios to readers, and which only change one."""

from socialai_dsl import frontend
from socialai_dsl.loader.shipped import file_of, shipped_scenarios, variants_of


def test_scenarios_and_variants_that_say_what_they_are_about() -> None:
    names = shipped_scenarios()
    assert {"talkitout", "talkitout_no_liar"} <= set(names)
    assert not [name for name in names if name.endswith(("_oracle", "_as_coded", "unsocial"))]


def test_variants() -> None:
    variants = variants_of("talkitout")
    assert {"as_coded", "oracle", "unsocial"} <= set(variants)
    assert "no_liar" not in variants, "a scenario of its own"
    assert "liar_oracle" not in variants, "a variant of another one"
    assert len(variants) == len(set(variants))


def test_variants_can_be_applied() -> None:
    for variant in variants_of("talkitout_no_liar"):
        result = frontend.check(f"talkitout_no_liar+{variant}")
        assert not result.has_errors, result.diagnostics


CUES = {"pointing", "color", "feedback", "emulation", "scaffolding"}


def test_a_folder_has_variants_for_those_of_its_scenarios_that_they_suit() -> None:
    assert {*CUES, "oracle", "asocial", "alone", "unsocial"} <= set(variants_of("school/boxes"))
    assert {*CUES, "asocial", "unsocial"} <= set(variants_of("school/doors"))
    assert "alone" not in variants_of("school/doors"), "`doors_alone` is a scenario of its own"
    assert CUES.isdisjoint(variants_of("school/apple_stealing")), "nobody is there to give a cue"
    assert CUES.isdisjoint(variants_of("school/information_seeking")), "its members have them"
    assert not [name for name in variants_of("school/levers") if name.endswith("_oracle")], (
        "scripts of others"
    )
    assert file_of("school/boxes", "pointing").name == "pointing.yaml"
    assert file_of("school/boxes", "unsocial").name == "unsocial.yaml"
