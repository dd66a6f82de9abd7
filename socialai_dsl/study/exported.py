"""The tables of a study as `study data` wrote them: read again, as the log that they were made from would be."""

from __future__ import annotations

import csv
import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.errors import UnreadableError, UsageError
from socialai_dsl.loader.reader import display_name
from socialai_dsl.loader.resolved import taken_apart
from socialai_dsl.schema.study import Question
from socialai_dsl.study.columns import COLUMNS
from socialai_dsl.study.replay import PlayedBlock, Row, StudyData
from socialai_dsl.traces.endings import Ending

ABOUT: Final = "study.json"
"""The file that says what the tables are of."""
FORMAT: Final = "socialai-study-data/1"
TABLES: Final = "data"
_AGAIN: Final = "write it again with `socialai study data`"

_LONGEST: Final = 2**31 - 1
"""Characters of a field; by default csv refuses some replies of language models."""
_AS: Final[Mapping[str, Callable[[str], Any]]] = {
    "bool": lambda text: {"True": True, "False": False}[text],
    "int": int,
    "float": float,
    "str": str,
}


def table_file(name: str, table: str) -> str:
    """The file of a table, in the layout of Psych-DS."""
    return f"study-{name.replace('_', '')}_table-{table}_data.csv"


def write_about(data: StudyData, out: Path) -> Path:
    """Say beside tables what they are of, so that they can be read without the study's file.

    Args:
        data: the same that the tables were written from.
        out: the folder that holds their folder.

    Raises:
        OSError: it cannot be written.
    """
    files = {table: out / TABLES / table_file(data.study, table) for table in data.tables}
    about = {
        "format": FORMAT,
        "study": data.study,
        "begun": data.begun,
        "simulated": data.simulated,
        "replayed": data.replayed,
        "unended": data.unended,
        "blocks": [asdict(block) | {"scenario": _from(block.scenario, out)} for block in data.blocks],
        "questions": [[name, one.model_dump(mode="json", by_alias=True)] for name, one in data.questions],
        "tables": {
            table: {"sha256": _digest(file), "columns": _types(data.tables[table], table)}
            for table, file in files.items()
        },
    }
    write_json(out / ABOUT, about)
    return out / ABOUT


def is_exported(folder: Path) -> bool:
    """Whether a folder holds tables of a study, or is that of the tables themselves, or of an older version."""
    return any((folder / name).is_file() for name in (ABOUT, "dataset_description.json")) or bool(
        next(folder.glob("study-*_table-*_data.csv"), None)
    )


def read_exported(folder: Path) -> StudyData:
    """The data of a study from the folder that `study data` wrote.

    Raises:
        OSError: a file cannot be read.
        UsageError: it is not that folder, or of an older version.
        UnreadableError: a table was changed since.
    """
    if not (folder / ABOUT).is_file():
        if (folder.parent / ABOUT).is_file():
            raise UsageError(f"{folder}: holds the tables alone; name the folder above, {folder.parent}")
        raise UsageError(f"{folder}: has no {ABOUT}, which says what its tables are of; {_AGAIN}")
    try:
        about = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        if about["format"] != FORMAT:
            raise UnreadableError(f"{folder / ABOUT}: is of another version; {_AGAIN}")
        tables = {name: _table(folder, about["study"], name, about["tables"][name]) for name in COLUMNS}
        return StudyData(
            tables,
            about["replayed"],
            about["unended"],
            about["simulated"],
            [_block(block, folder) for block in about["blocks"]],
            about["study"],
            about["begun"],
            [(name, Question.model_validate(one)) for name, one in about["questions"]],
        )
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, UsageError):
            raise
        raise UnreadableError(f"{folder / ABOUT}: is damaged ({error}); {_AGAIN}") from None


def _table(folder: Path, study: str, name: str, about: Mapping[str, Any]) -> list[Row]:
    file = folder / TABLES / table_file(study, name)
    if not file.is_file():
        raise UsageError(f"{file}: is not there; {_AGAIN}")
    if _digest(file) != about["sha256"]:
        raise UnreadableError(f"{file}: was changed since it was written, so it cannot be believed; {_AGAIN}")
    kinds = about["columns"]
    csv.field_size_limit(_LONGEST)
    with open(file, encoding="utf-8", newline="") as stream:
        return [
            {key: _AS[kinds[key]](text) if text else text for key, text in row.items()} | _scale(row)
            for row in csv.DictReader(stream)
        ]


def _scale(row: Mapping[str, str]) -> Row:
    """The answer to a scale, which is a number where others are texts."""
    return {"answer": int(row["answer"])} if row.get("kind") == "scale" else {}


def _types(rows: Sequence[Row], table: str) -> dict[str, str]:
    """Of each column what its values are; texts where they differ."""
    found = {}
    for column in COLUMNS[table]:
        kinds = {type(row[column]).__name__ for row in rows if row[column] != ""}
        if kinds == {"int", "float"}:
            kinds = {"float"}
        found[column] = kinds.pop() if len(kinds) == 1 else "str"
    return found


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _from(scenario: str, out: Path) -> str:
    """A scenario as it is called from the folder of the tables; one that ships is called so everywhere."""
    base, changes = taken_apart(scenario)
    return Path(os.path.relpath(base, out)).as_posix() + changes if Path(base).is_file() else scenario


def _block(block: Mapping[str, Any], folder: Path) -> PlayedBlock:
    scenario = block["scenario"]
    base, changes = taken_apart(scenario, folder)
    if (folder / base).is_file():
        scenario = display_name((folder / base).resolve()) + changes
    endings = [Ending(**one) for one in block["endings"]]
    return PlayedBlock(**{**block, "scenario": scenario, "endings": endings})
