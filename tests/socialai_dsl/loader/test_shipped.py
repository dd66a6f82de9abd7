"""Which files are scenarios to readers, and which only change one."""

from socialai_dsl import frontend
from socialai_dsl.loader.shipped import shipped_scenarios, variants_of


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
