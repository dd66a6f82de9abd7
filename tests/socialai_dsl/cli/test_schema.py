"""`socialai schema`: what an editor is told about every kind of file."""

import json

import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.schema import Npc, Scenario
from socialai_dsl.schema.suite import Suite


@pytest.mark.parametrize(("kind", "model"), [("scenario", Scenario), ("npc", Npc), ("suite", Suite)])
def test_every_kind_of_file_has_its_keys(kind: str, model: type, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    (chosen,) = [rule["then"]["$ref"] for rule in schema["allOf"] if rule["if"] == {"required": [kind]}]
    described = schema["$defs"][chosen.rpartition("/")[2]]
    assert set(described["properties"]) == {
        field.alias or name
        for name, field in model.model_fields.items()  # type: ignore[attr-defined]
    }
    assert kind in described["required"]
    assert described["additionalProperties"] is False


def test_every_reference_leads_somewhere(capsys: pytest.CaptureFixture[str]) -> None:
    main(["schema"])
    text = capsys.readouterr().out
    schema = json.loads(text)
    references = {part.partition('"')[0] for part in text.split('"$ref": "')[1:]}
    assert references
    assert references == {f"#/$defs/{name}" for name in schema["$defs"]}


def test_editors_know_what_the_models_never_see(capsys: pytest.CaptureFixture[str]) -> None:
    main(["schema"])
    definitions = json.loads(capsys.readouterr().out)["$defs"]
    member = definitions["CastMember"]["properties"]
    assert member["count"]["maximum"] == 16
    assert {"type": "array", "items": {}} in member["name"]["anyOf"]
    assert {"type": "string"} in member["one_of"]["anyOf"]
    assert {"type": "string"} in definitions["Scenario"]["properties"]["grammar"]["anyOf"]
