"""Writes the data of a study: tables with a codebook."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_json, write_text
from socialai_dsl.checking.studies import LoadedStudy
from socialai_dsl.errors import UsageError
from socialai_dsl.study.columns import COLUMNS
from socialai_dsl.study.exported import TABLES, table_file, write_about
from socialai_dsl.study.replay import StudyData

_REHEARSAL: Final = "Simulated: a rehearsal, in which no person took part."


def write_data(data: StudyData, loaded: LoadedStudy, out: Path, parquet: bool = False) -> list[Path]:
    """Write the tables, in the layout of Psych-DS, with a codebook.

    Args:
        data: the tables.
        loaded: the study.
        out: the folder.
        parquet: whether Parquet files are written as well; this needs pyarrow.

    Returns:
        The files.

    Raises:
        OSError: they cannot be written.
        UsageError: pyarrow is not installed.
    """
    folder = out / TABLES
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for table, rows in data.tables.items():
        file = folder / table_file(data.study, table)
        with open(file, "w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, list(COLUMNS[table]))
            writer.writeheader()
            writer.writerows(rows)
        written.append(file)
    written += _parquet(data, folder) if parquet else []
    described = out / "dataset_description.json"
    write_json(described, _description(loaded, data.simulated))
    codebook = out / "codebook.md"
    write_text(codebook, _codebook(loaded, data.simulated))
    return [*written, described, codebook, write_about(data, out)]


def _parquet(data: StudyData, folder: Path) -> list[Path]:
    try:
        import pyarrow as pa
        from pyarrow import parquet as pq
    except ImportError:
        raise UsageError("Parquet needs pyarrow: pip install 'socialai-dsl[parquet]'") from None
    written = []
    for table, rows in data.tables.items():
        columns = {}
        for column in COLUMNS[table]:
            values = [None if row[column] == "" else row[column] for row in rows]
            kinds = {type(value) for value in values if value is not None}
            columns[column] = pa.array(
                values if len(kinds) <= 1 else [None if v is None else str(v) for v in values]
            )
        file = (folder / table_file(data.study, table)).with_suffix(".parquet")
        pq.write_table(pa.table(columns), file)
        written.append(file)
    return written


def _description(loaded: LoadedStudy, simulated: bool) -> dict[str, Any]:
    """`dataset_description.json`, as Psych-DS has it."""
    measured = [
        {"@type": "PropertyValue", "name": column, "description": meaning}
        for columns in COLUMNS.values()
        for column, meaning in columns.items()
    ]
    unique = list({one["name"]: one for one in measured}.values())
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": loaded.study.study,
        "description": (f"{_REHEARSAL} " if simulated else "")
        + (loaded.study.about or f"Data of the study {loaded.study.study}."),
        "variableMeasured": unique,
    }


def _codebook(loaded: LoadedStudy, simulated: bool) -> str:
    lines = [
        f"# {loaded.study.study}",
        "",
        *([_REHEARSAL, ""] if simulated else []),
        loaded.study.about or "",
        "",
    ]
    for table, columns in COLUMNS.items():
        lines += [f"## {table}", "", "| column | meaning |", "|---|---|"]
        lines += [f"| `{column}` | {meaning} |" for column, meaning in columns.items()] + [""]
    lines += ["## Questions", "", "| question | kind | asked |", "|---|---|---|"]
    asked = [*loaded.study.questions, *(q for block in loaded.study.blocks for q in block.questions)]
    for question in asked:
        words = json.dumps(question.ask, ensure_ascii=False)[1:-1].replace("|", "\\|")
        lines.append(f"| `{question.id}` | {question.kind} | {words} |")
    return "\n".join(lines) + "\n"
