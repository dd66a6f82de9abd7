"""`socialai schema` prints what is shipped."""

import pytest

from socialai_dsl.authoring.language_schema import shipped_schema
from socialai_dsl.cli.main import main


def test_the_schema_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert capsys.readouterr().out == shipped_schema()
